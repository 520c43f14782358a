//! The real window while a slider is dragged: time from one frame to the next on the clock of the wall, drawing included.

use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use uw_render::backend::Backend;
use uw_viewer::app::{Options, Viewer};
use uw_viewer::model::{Coefficients, OpenScene};
use uw_viewer::window;
use uw_viewer::worker::RenderDevice;

/// Time between two events of the slider.
const EVENT_EVERY: Duration = Duration::from_micros(16_667);
/// How long it is dragged, where `UW_DRAG_SECONDS` asks for no other number.
const SECONDS: u64 = 20;
/// Frames that are not counted: the window opens.
const FIRST_FRAMES: usize = 10;

/// Per frame, s: from the one before to this one, and within it what the viewer does itself; the rest is drawing.
type Times = Arc<Mutex<Vec<[f64; 2]>>>;

/// A window whose slider moves by itself.
struct Dragged {
    viewer: Viewer,
    start: Instant,
    before: Option<Instant>,
    times: Times,
    seconds: u64,
}

impl eframe::App for Dragged {
    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        let now = Instant::now();
        let before = self.before.replace(now);
        let age = self.start.elapsed();
        if let Some(water) = &mut self.viewer.settings.water {
            water.coefficients = Coefficients::Jerlov {
                scale: 4.5 + 4.5 * (3.0 * age.as_secs_f64()).sin(),
                bands: uw_viewer::model::WaterBands::Spectral,
            };
        }
        self.viewer.show(ui);
        if let Some(before) = before {
            let mut times = self.times.lock().unwrap_or_else(PoisonError::into_inner);
            times.push([now - before, now.elapsed()].map(|t| t.as_secs_f64()));
        }
        if age > Duration::from_secs(self.seconds) {
            ui.ctx().send_viewport_cmd(egui::ViewportCommand::Close);
        }
        ui.ctx()
            .request_repaint_after(EVENT_EVERY.saturating_sub(now.elapsed()));
    }
}

/// Drags the slider of a scene and says how long frames took, or why there is no window.
pub fn drag(scene: &Path, backend: Backend) -> Result<String, String> {
    let opened = OpenScene::read(scene).map_err(|e| e.to_string())?;
    let times = Times::default();
    let for_app = Arc::clone(&times);
    let asked = std::env::var("UW_DRAG_SECONDS").ok();
    let seconds = asked.and_then(|s| s.parse().ok()).unwrap_or(SECONDS);
    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default().with_inner_size([1280.0, 720.0]),
        wgpu_options: window::configuration(backend == Backend::Gpu, None),
        dithering: false,
        ..Default::default()
    };
    eframe::run_native(
        "latency",
        options,
        Box::new(move |creation| {
            let state = creation.wgpu_render_state.as_ref();
            let options = Options {
                render_device: RenderDevice {
                    device: window::renderer(state, backend, None)?,
                    threads: None,
                },
                canvas: state.cloned(),
                ..Options::default()
            };
            let viewer = Viewer::new(&creation.egui_ctx, opened, options)?;
            Ok(Box::new(Dragged {
                viewer,
                start: Instant::now(),
                before: None,
                times: for_app,
                seconds,
            }))
        }),
    )
    .map_err(|e| e.to_string())?;
    let times = times.lock().unwrap_or_else(PoisonError::into_inner);
    let counted = times.get(FIRST_FRAMES..).unwrap_or_default();
    let [between, own] = [0, 1].map(|which| spread(counted.iter().map(|times| times[which])));
    Ok(format!(
        "{} frames in {seconds} s; median and longest, ms: {between} from one to the next, {own} of the viewer itself",
        counted.len()
    ))
}

/// Median and longest of some times, ms.
fn spread(times: impl Iterator<Item = f64>) -> String {
    let mut times: Vec<f64> = times.collect();
    times.sort_by(f64::total_cmp);
    match (times.get(times.len() / 2), times.last()) {
        (Some(median), Some(longest)) => format!("{:.1}, {:.1}", 1e3 * median, 1e3 * longest),
        _ => "no frames".to_owned(),
    }
}
