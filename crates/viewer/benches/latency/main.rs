//! How soon a change of settings shows: time to the first picture of each change while a slider is dragged, and the time
//! between frames of the real window meanwhile, where there is a screen. `cargo bench -p uw-viewer`; with a word after
//! `--`, only that: `pictures` (`pictures-simd`: on the processor's vector units), `window` (`window-simd`), or `window-gpu`
//! for a window that shares its adapter with the renderer; `objects` (objects that are read again), `scenes` (small pictures of scenes).

mod window;

use std::io::Write;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use uw_render::{
    backend::{Backend, Device},
    prepare::Prepared,
};
use uw_viewer::model::{Coefficients, Display, OpenScene, rebuilt::Rebuilt};
use uw_viewer::worker::thumbnails::Thumbnails;
use uw_viewer::worker::{Goal, Job, RenderDevice, View, Worker};

/// Changes per scene.
const CHANGES: u32 = 40;
/// Size of the picture, pixels: its place in a window of 1280 x 720.
const SIZE: (u32, u32) = (884, 497);

fn main() {
    let wanted: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| !a.starts_with('-'))
        .collect();
    let is_wanted = |name: &str| wanted.is_empty() || wanted.iter().any(|w| w == name);
    let scenes = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/scenes"));
    if is_wanted("pictures") {
        pictures(scenes, &Device::Cpu);
    }
    if is_wanted("pictures-simd") {
        pictures(scenes, &Device::CpuSimd);
    }
    if is_wanted("objects") {
        objects(scenes);
    }
    if is_wanted("scenes") {
        small_pictures(scenes);
    }
    // One window per process: the second loop of events would be refused.
    let backend = if wanted.iter().any(|w| w == "window-gpu") {
        Some(Backend::Gpu)
    } else if wanted.iter().any(|w| w == "window-simd") {
        Some(Backend::CpuSimd)
    } else {
        is_wanted("window").then_some(Backend::Cpu)
    };
    if let Some(backend) = backend {
        let line = window::drag(&scenes.join("flat_reef.toml"), backend);
        say(&format!(
            "window: {}",
            line.unwrap_or_else(|reason| format!("not measured: {reason}"))
        ));
    }
}

fn say(line: &str) {
    // Nothing can be done about a closed standard output.
    let _ = writeln!(std::io::stdout().lock(), "{line}");
}

/// How long objects take that are read again.
fn objects(scenes: &Path) {
    say("objects read again, ms");
    for name in [
        "flat_reef",
        "flat_hull",
        "flat_seabed",
        "hull_inspection",
        "reef",
    ] {
        let path = scenes.join(format!("{name}.toml"));
        let (open, _) = OpenScene::read(&path).expect("a shipped scene");
        let start = Instant::now();
        Rebuilt::read(open.objects.clone(), &open.base_dir).expect("its objects");
        say(&format!(
            "{name}: {:.0}",
            1e3 * start.elapsed().as_secs_f64()
        ));
    }
}

/// How long small pictures of scenes take, one after the other.
fn small_pictures(scenes: &Path) {
    say("small pictures, s");
    let mut thumbnails = Thumbnails::start(|| ()).expect("a thread");
    for name in ["flat_hull", "flat_reef", "kelp", "reef", "pier"] {
        let path = scenes.join(format!("{name}.toml"));
        let start = Instant::now();
        while thumbnails.of(&path).is_none() {
            std::thread::sleep(Duration::from_millis(2));
        }
        say(&format!("{name}: {:.1}", start.elapsed().as_secs_f64()));
    }
}

fn pictures(scenes: &Path, device: &Device) {
    say(
        "scene: time to the restart, then to the first picture, median and longest, ms; its size; preparation, ms; \
         time to full size, s",
    );
    for name in [
        "flat_reef",
        "clear_lamp",
        "flat_hull",
        "hull_inspection",
        "seabed_survey",
    ] {
        let line = measure(&scenes.join(format!("{name}.toml")), device);
        say(&format!("{name}: {line}"));
    }
}

fn measure(path: &Path, device: &Device) -> String {
    let (open, mut settings) = OpenScene::read(path).expect("shipped");
    settings.camera = settings.camera.resized(SIZE.0, SIZE.1);
    let view = View {
        display: Display::default(),
        sensor: settings.sensor(),
        probing: false,
        on_host: false,
        denoised: false,
    };
    let goal = Goal {
        samples_per_pixel: 1,
        target_error: None,
    };
    let render_device = RenderDevice {
        device: device.clone(),
        threads: None,
    };
    let worker = Worker::start(render_device, view, goal, || {}).expect("a thread");
    let (mut restarts, mut times) = (Vec::new(), Vec::new());
    let mut size = (0, 0);
    for i in 1..=CHANGES {
        if let Some(water) = &mut settings.water {
            let scale = 9.0 * f64::from(i) / f64::from(CHANGES);
            let bands = uw_viewer::model::WaterBands::Spectral;
            water.coefficients = Coefficients::Jerlov { scale, bands };
        }
        worker.submit(Job {
            generation: u64::from(i),
            settings: settings.clone(),
            geometry: Arc::clone(&open.geometry),
            seed: 1,
        });
        let first = wait(&worker, |f| f.generation == u64::from(i));
        restarts.push(first.begun_after_s);
        times.push(first.since_request_s);
        size = (first.camera.width, first.camera.height);
        // As between events of a slider that is dragged.
        std::thread::sleep(Duration::from_millis(16));
    }
    let start = Instant::now();
    let scene = settings.scene().expect("valid");
    let prepared = Prepared::build_with(&scene, Arc::clone(&open.geometry));
    let preparation = start.elapsed().as_secs_f64();
    drop(prepared);
    let full = wait(&worker, |f| f.coarseness == 1).since_request_s;
    let ms = |t: f64| 1000.0 * t;
    let spread = |mut times: Vec<f64>| {
        times.sort_by(f64::total_cmp);
        let (median, longest) = (times[times.len() / 2], times[times.len() - 1]);
        format!("{:.0}, {:.0}", ms(median), ms(longest))
    };
    format!(
        "{}; {}; {} x {}; {:.0}; {full:.1}",
        spread(restarts),
        spread(times),
        size.0,
        size.1,
        ms(preparation)
    )
}

fn wait(
    worker: &Worker,
    fits: impl Fn(&uw_viewer::worker::Frame) -> bool,
) -> Arc<uw_viewer::worker::Frame> {
    let start = Instant::now();
    loop {
        if let Some(frame) = worker.latest().filter(|f| fits(f)) {
            return frame;
        }
        assert!(start.elapsed() < Duration::from_secs(300), "no picture");
        std::thread::sleep(Duration::from_micros(500));
    }
}
