//! Arguments, and the way from them to a window.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::{Arc, Mutex, PoisonError};

use clap::{Parser, ValueEnum};
use eframe::egui_wgpu::RenderState;
use uw_assets::{AssetError, Places};
use uw_calib::Profile;
use uw_calib::vehicle::{Vehicle, VehicleFile};
use uw_guidance::Model;
use uw_render::backend::Backend;
use uw_render::gpu::{Gpu, GpuError};
use uw_render::image::{Counts, Frame as Stored, write_frame};

use crate::app::{self, Options, Tab, Viewer};
use crate::guidance::Adviser;
use crate::guidance::operation::Operation;
use crate::model::{OpenScene, Settings, lasting::Lasting, recent::Recent};
use crate::ui::theme;
use crate::worker::{Goal, RenderDevice};
use crate::{screen, window};

/// The water, its knobs and the advice in one window.
#[derive(Clone, Debug, Parser)]
#[command(name = "viewer", version)]
pub struct Args {
    /// Scene (.toml) or glTF file (.glb, .gltf) to open, or the name of a shipped scene
    #[arg(long, value_name = "NAME|FILE")]
    pub scene: Option<PathBuf>,
    /// Write a picture of the window and leave
    #[arg(long, value_name = "OUT.png")]
    pub screenshot: Option<PathBuf>,
    /// Samples per pixel before the screenshot
    #[arg(long, value_name = "N", default_value_t = 16, requires = "screenshot")]
    pub after_samples: u64,
    /// Where pictures are rendered; auto takes a hardware GPU where there is one
    #[arg(long, value_enum, default_value_t = BackendName::Auto)]
    pub backend: BackendName,
    /// Part of the name of the graphics adapter that renders
    #[arg(long, value_name = "NAME")]
    pub adapter: Option<String>,
    /// Threads of the processor's renderer; one per core when left out
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub threads: Option<u32>,
    /// Seed of all random numbers
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Panel that is open at first; the one of the last time when left out
    #[arg(long, value_enum)]
    pub panel: Option<TabName>,
    /// Calibration profile for the guidance panel: a file or the name of a shipped one
    #[arg(long, value_name = "NAME|FILE")]
    pub profile: Option<PathBuf>,
    /// Run the calibration routine at the start
    #[arg(long)]
    pub calibrate: bool,
    /// Network for the guidance panel, instead of the one that ships: a file or the name of another that ships
    #[arg(long, value_name = "NAME|FILE")]
    pub model: Option<PathBuf>,
    /// Vehicle of the guidance panel's images: a shipped one's name or a file (uw-vehicle/1)
    #[arg(long, value_name = "NAME|FILE", default_value = "default")]
    pub vehicle: String,
    /// Recorded operation for the guidance panel, as uwguide writes it (`operations.record`)
    #[arg(long, value_name = "FILE")]
    pub record: Option<PathBuf>,
    /// Folder of the shipped files, from which alone they are then taken
    #[arg(long, value_name = "DIR")]
    pub assets: Option<PathBuf>,
    /// Light instead of dark
    #[arg(long)]
    pub light: bool,
    /// Size of the window, points
    #[arg(long, value_name = "WIDTHxHEIGHT", default_value = "1280x720", value_parser = parse_size)]
    pub size: (u32, u32),
}

/// Names of backends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum BackendName {
    /// A hardware GPU, or else cpu-simd.
    Auto,
    /// The processor, in double precision.
    Cpu,
    /// The GPU's kernels on the processor's vector units: faster, in single precision.
    CpuSimd,
    /// A graphics adapter, software ones included.
    Gpu,
}

/// Names of panels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum TabName {
    /// Water.
    Water,
    /// Scene.
    Scene,
    /// Guidance.
    Guidance,
    /// Comparison, histogram, zoom and pinned pixels.
    Inspect,
}

fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let sides = text
        .split_once('x')
        .and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    match sides {
        Some((w, h)) if (320..=8192).contains(&w) && (240..=8192).contains(&h) => Ok((w, h)),
        _ => Err("must be WIDTHxHEIGHT, 320x240 to 8192x8192".to_owned()),
    }
}

/// Exit code for unusable arguments or input.
const UNUSABLE: u8 = 2;

/// Runs the viewer with the arguments of the process.
pub fn main() -> ExitCode {
    let args = Args::parse();
    match start(&args) {
        Ok(()) => ExitCode::SUCCESS,
        Err(Failure::Input(message)) => fail(&message, UNUSABLE),
        Err(Failure::Running(message)) => fail(&message, 1),
    }
}

fn fail(message: &str, code: u8) -> ExitCode {
    use std::io::Write;
    // Nothing can be done about a closed standard error.
    let _ = writeln!(std::io::stderr(), "viewer: {message}");
    ExitCode::from(code)
}

/// Why the viewer did not run to its end.
enum Failure {
    Input(String),
    Running(String),
}

fn start(args: &Args) -> Result<(), Failure> {
    assets_of(args).map_err(|e| Failure::Input(e.to_string()))?;
    let options = options(args);
    let last = options.lasting.choices().scene.as_deref();
    let (opened, note) = first_scene(args, last).map_err(Failure::Input)?;
    let advice = AdviceFiles::read(args).map_err(Failure::Input)?;
    if screen::is_missing(|name| std::env::var_os(name)) {
        return Err(Failure::Running(screen::missing(args.scene.as_deref())));
    }
    let outcome = Outcome::default();
    let for_app = Arc::clone(&outcome);
    let scene = args.scene.clone();
    let args = args.clone();
    let ended = eframe::run_native(
        "uwguide viewer",
        native_options(&args),
        Box::new(move |creation| {
            let mut options = options;
            if let Err(error) =
                choose_device(&args, creation.wgpu_render_state.as_ref(), &mut options)
            {
                keep(&for_app, Err(Failure::Input(error.to_string())));
                return Err(error.into());
            }
            let gpu = options
                .render_device
                .device
                .gpu()
                .cloned()
                .filter(Gpu::is_shared);
            let mut viewer = first_viewer(&creation.egui_ctx, &args, opened, options, advice)?;
            if let Some(note) = note {
                viewer.toasts.warn(note);
            }
            let screenshot = args.screenshot.map(|path| Screenshot {
                path,
                after_samples: args.after_samples,
                asked: false,
                outcome: Arc::clone(&for_app),
            });
            Ok(Box::new(Window {
                viewer,
                screenshot,
                gpu,
                outcome: for_app,
            }))
        }),
    );
    let outcome = outcome
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
        .take();
    // What was kept is the cause of what the window says.
    outcome.unwrap_or(Ok(()))?;
    ended.map_err(|error| Failure::Running(screen::unusable(&error, scene.as_deref())))
}

/// How the program ends, once that is known.
type Outcome = Arc<Mutex<Option<Result<(), Failure>>>>;

/// Keeps how the program ends; what came first counts.
fn keep(outcome: &Outcome, result: Result<(), Failure>) {
    outcome
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
        .get_or_insert(result);
}

fn native_options(args: &Args) -> eframe::NativeOptions {
    let (width, height) = args.size;
    let viewport = egui::ViewportBuilder::default()
        .with_title("uwguide viewer")
        .with_app_id("uwguide-viewer")
        .with_inner_size([width as f32, height as f32])
        .with_min_inner_size([640.0, 400.0])
        .with_drag_and_drop(true);
    eframe::NativeOptions {
        viewport,
        wgpu_options: window::configuration(
            matches!(args.backend, BackendName::Auto | BackendName::Gpu),
            args.adapter.as_deref(),
        ),
        // It costs a software adapter time, and pictures have noise of their own.
        dithering: false,
        ..Default::default()
    }
}

/// The viewer as the arguments want it.
fn first_viewer(
    ctx: &egui::Context,
    args: &Args,
    opened: (OpenScene, Settings),
    options: Options,
    advice: AdviceFiles,
) -> std::io::Result<Viewer> {
    theme::set(ctx);
    let choices = options.lasting.choices();
    ctx.set_theme(match args.light {
        true => egui::ThemePreference::Light,
        false => app::theme(choices.brightness),
    });
    ctx.set_zoom_factor(choices.controls);
    let mut viewer = Viewer::new(ctx, opened, options)?;
    viewer.tab = match args.panel {
        Some(TabName::Water) => Tab::Water,
        Some(TabName::Scene) => Tab::Scene,
        Some(TabName::Guidance) => Tab::Guidance,
        Some(TabName::Inspect) => Tab::Inspect,
        None => viewer.tab,
    };
    let guidance = &mut viewer.guidance;
    guidance.profile = advice.profile.map(Arc::new);
    guidance.operation = advice.operation;
    guidance.vehicle = advice.vehicle;
    if let Some((model, path)) = advice.model {
        guidance.model = Ok((Arc::new(model), path.display().to_string()));
        guidance.adviser = Adviser::Network;
    }
    if args.calibrate {
        guidance.calibrate(&viewer.settings, &mut viewer.toasts);
    }
    Ok(viewer)
}

/// What the arguments give to the guidance panel.
struct AdviceFiles {
    profile: Option<Profile>,
    model: Option<(Model, PathBuf)>,
    operation: Option<Operation>,
    vehicle: Vehicle,
}

/// The JSON file that an option means: one of the system, or by its name a shipped one of `folder`.
fn named(given: Option<&Path>, option: &str, folder: &str) -> Result<Option<PathBuf>, String> {
    let path = given.map(|given| uw_assets::SMALL.named(given, folder, "json"));
    path.transpose().map_err(|e| format!("{option}: {e}"))
}

impl AdviceFiles {
    fn read(args: &Args) -> Result<Self, String> {
        let profile = named(args.profile.as_deref(), "--profile", "profiles")?;
        let profile = profile.as_deref().map(Profile::read).transpose();
        let read_model = |path: PathBuf| Model::read(&path).map(|model| (model, path));
        let model = named(args.model.as_deref(), "--model", "models")?;
        let model = model.map(read_model).transpose();
        let operation = args.record.as_deref().map(Operation::read).transpose();
        Ok(Self {
            profile: profile.map_err(|e| e.to_string())?,
            model: model.map_err(|e| e.to_string())?,
            operation: operation.map_err(|e| e.to_string())?,
            vehicle: vehicle(&args.vehicle, args.model.is_some())?,
        })
    }
}

/// The vehicle of the guidance panel, whose scenes have the spectra of the scene that is open.
fn vehicle(name_or_file: &str, own_model: bool) -> Result<Vehicle, String> {
    let file = VehicleFile::find(name_or_file, Path::new(""));
    let vehicle = file.map_err(|e| format!("--vehicle: {e}"))?.vehicle;
    match vehicle.needs_wavelengths() {
        Some(field) => Err(format!(
            "--vehicle: {name_or_file}: {field} counts by wavelength alone, and the scene that is open has the spectra here; leave it out"
        )),
        None if vehicle.encoding != uw_calib::Encoding::Srgb && !own_model => Err(format!(
            "--vehicle: {name_or_file}: encoding is not srgb, and the network that ships is of pictures in sRGB; give one made for this \
             vehicle (--model)"
        )),
        None => Ok(vehicle),
    }
}

/// Sets where pictures are rendered.
fn choose_device(
    args: &Args,
    window: Option<&RenderState>,
    options: &mut Options,
) -> Result<(), GpuError> {
    let backend = match args.backend {
        BackendName::Auto => Backend::Auto,
        BackendName::Cpu => Backend::Cpu,
        BackendName::CpuSimd => Backend::CpuSimd,
        BackendName::Gpu => Backend::Gpu,
    };
    options.render_device.device = window::renderer(window, backend, args.adapter.as_deref())?;
    options.canvas = window.cloned();
    Ok(())
}

fn options(args: &Args) -> Options {
    let headless = args.screenshot.is_some();
    Options {
        render_device: RenderDevice {
            threads: args.threads.map(|n| n as usize),
            ..RenderDevice::default()
        },
        seed: args.seed,
        goal: if headless {
            Goal {
                samples_per_pixel: args.after_samples.max(1),
                target_error: None,
            }
        } else {
            Goal::default()
        },
        // A picture of the window hangs on its arguments alone.
        recent: match headless {
            true => Recent::default(),
            false => Recent::of_user(),
        },
        lasting: match headless {
            true => Lasting::default(),
            false => Lasting::of_user(),
        },
        ..Options::default()
    }
}

/// Takes the shipped files from where the arguments or the environment say.
fn assets_of(args: &Args) -> Result<(), AssetError> {
    if let Some(folder) = &args.assets {
        uw_assets::take_from(folder)?;
    }
    Places::of_process().check()
}

/// What is open at first, and what there is to say about it.
type First = ((OpenScene, Settings), Option<String>);

/// The scene of the arguments, the `last` one, the one that ships, or a grey wall.
fn first_scene(args: &Args, last: Option<&Path>) -> Result<First, String> {
    if let Some(path) = &args.scene {
        let path = uw_assets::ALL.named(path, "scenes", "toml");
        let path = path.map_err(|e| format!("--scene: {e}"))?;
        let opened = OpenScene::read(&path).map_err(|e| e.to_string())?;
        return Ok((opened, None));
    }
    let note = match last.map(OpenScene::read) {
        Some(Ok(opened)) => return Ok((opened, None)),
        Some(Err(error)) => Some(format!("{error}\nThe scene of the last time is left out.")),
        None => None,
    };
    let shipped = OpenScene::read(Path::new(uw_assets::DEFAULT_SCENE));
    let opened = shipped.or_else(|_| OpenScene::fallback());
    Ok((opened.map_err(|e| e.to_string())?, note))
}

/// The viewer as a window's contents.
struct Window {
    viewer: Viewer,
    screenshot: Option<Screenshot>,
    /// The adapter that draws the window, where it renders too.
    gpu: Option<Gpu>,
    outcome: Outcome,
}

impl eframe::App for Window {
    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        let fault = self.gpu.as_ref().and_then(Gpu::fault);
        if let Some(error @ GpuError::Lost { .. }) = fault {
            // Nothing can be drawn any more, not even a message.
            let advice = "start the viewer again, with --backend cpu if it happens again";
            keep(
                &self.outcome,
                Err(Failure::Running(format!("{error}; {advice}"))),
            );
            ui.ctx().send_viewport_cmd(egui::ViewportCommand::Close);
            return;
        }
        self.viewer.show(ui);
        if let Some(screenshot) = &mut self.screenshot {
            screenshot.watch(&self.viewer, ui.ctx());
        }
    }
}

/// A picture of the window that is wanted.
struct Screenshot {
    path: PathBuf,
    after_samples: u64,
    asked: bool,
    outcome: Outcome,
}

impl Screenshot {
    /// Takes the picture once there are enough samples.
    fn watch(&mut self, viewer: &Viewer, ctx: &egui::Context) {
        let ready = viewer.is_current()
            && viewer.guidance.progress().is_none()
            && !viewer.guidance.is_reading()
            && viewer
                .frame()
                .is_some_and(|f| f.coarseness == 1 && f.samples >= self.after_samples);
        if self.asked {
            // The picture comes back with a later frame, which nothing else may ask for.
            ctx.request_repaint();
        }
        if self.asked || !ready {
            return;
        }
        self.asked = true;
        let (path, outcome, ctx_then) = (self.path.clone(), Arc::clone(&self.outcome), ctx.clone());
        ctx.request_screenshot(move |image| {
            let written = write_png(&path, &image);
            keep(&outcome, written.map_err(Failure::Running));
            ctx_then.send_viewport_cmd(egui::ViewportCommand::Close);
        });
    }
}

/// Writes a picture of the window.
fn write_png(path: &Path, image: &egui::ColorImage) -> Result<(), String> {
    let counts = image.pixels.iter().flat_map(|p| [p.r(), p.g(), p.b()]);
    let frame = Stored {
        width: image.size[0] as u32,
        height: image.size[1] as u32,
        counts: Counts::Bits8(counts.collect()),
    };
    write_frame(path, &frame).map_err(|e| e.to_string())
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn arguments_are_consistent_and_sizes_are_checked() {
        Args::command().debug_assert();
        assert_eq!(parse_size("1280x720"), Ok((1280, 720)));
        for text in ["1280", "0x0", "1280x", "-5x720", "99999x720"] {
            assert!(parse_size(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_vehicle_is_read_and_what_is_wrong_is_told() {
        assert_eq!(vehicle("default", false), Ok(Vehicle::default()));
        let folder = std::env::temp_dir().join(format!("uw-viewer-vehicle-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        let file = folder.join("v.toml");
        let read = |line: &str, own_model: bool| {
            std::fs::write(&file, format!("format = \"uw-vehicle/1\"\n{line}")).expect("written");
            vehicle(&file.display().to_string(), own_model)
        };
        let mine = read("lamp_half_angle_deg = 35.0", false).expect("a vehicle");
        assert_eq!(mine.lamp_half_angle_deg, 35.0);
        for (line, words) in [
            (
                "lamp_spectrum = \"halogen\"",
                "v.toml: lamp_spectrum counts by wavelength",
            ),
            ("encoding = \"linear\"", "v.toml: encoding is not srgb"),
            ("width = -3", "v.toml: width = -3"),
        ] {
            let told = read(line, false).expect_err(line);
            assert!(
                told.starts_with("--vehicle: ") && told.contains(words),
                "{told}"
            );
        }
        assert!(read("encoding = \"linear\"", true).is_ok());
        std::fs::remove_dir_all(&folder).expect("removed");
        let told = vehicle("yacht", false).expect_err("no such vehicle");
        assert!(told.contains("vehicle \"yacht\""), "{told}");
    }
}
