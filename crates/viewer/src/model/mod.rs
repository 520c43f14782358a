//! What the viewer knows, without a window: the settings, the open scene, undo, camera motions, display,
//! what is looked at closely, what lasts.

pub mod camera;
pub mod cloud;
pub mod command;
pub mod data_sheet;
pub mod depth_profile;
pub mod display;
pub mod histogram;
pub mod inspection;
pub mod lasting;
pub mod object;
pub mod open_scene;
pub mod paths;
pub mod rebuilt;
pub mod recent;
pub mod scene_text;
pub mod settings;
pub mod snapshots;
pub mod spectra;
pub mod undo;
pub mod water;
pub mod zoom;

pub use camera::CameraSettings;
pub use cloud::Cloud;
pub use depth_profile::DepthProfile;
pub use display::{Display, FalseColour, ShownLayer};
pub use inspection::Inspection;
pub use open_scene::{OpenError, OpenScene};
pub use settings::{Balance, LampSettings, SensorSettings, Settings, Sun, Surface, WaterAndSky};
pub use spectra::{LightSpectrum, ResponseSettings};
pub use undo::History;
pub use uw_media::spectral::WaterBands;
pub use water::{Coefficients, PhaseModel, Water};
