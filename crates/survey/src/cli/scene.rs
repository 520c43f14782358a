//! The scene of a command, with what the command line says instead of its file.

use std::path::PathBuf;

use clap::Args;
use uw_render::scene::{Scene, Setting};

use super::error::CliError;
use super::scene_file;

/// Arguments of the commands that look through a scene's camera.
#[derive(Debug, Args)]
pub(super) struct SceneArguments {
    /// Scene file (uw-scene/1), or the name of a shipped scene, as in flat_hull.
    #[arg(value_name = "NAME|FILE")]
    pub(super) scene: PathBuf,
    /// Width instead of the scene's, pixels; alone it keeps the proportions. The horizontal field of view stays.
    #[arg(long, value_name = "PIXELS")]
    width: Option<u32>,
    /// Height instead of the scene's, pixels; alone it keeps the proportions.
    #[arg(long, value_name = "PIXELS")]
    height: Option<u32>,
    /// Another value for a field of the scene file, as in water.jerlov=3C, camera.position_m=[0,0,-3],
    /// lamp.left.level_pct=50 or object.0.reflectance=[0.5,0.4,0.3]; may be given many times. Values are TOML, bare words
    /// are text; elements go by their number from 0, lamps also by their name.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<Setting>,
}

impl SceneArguments {
    /// The scene file with what the command line says instead.
    pub(super) fn read(&self) -> Result<Scene, CliError> {
        let file = scene_file(&self.scene)?;
        let mut scene = Scene::read_with(&file, &self.set).map_err(CliError::input)?;
        let resized = scene.camera.resized(self.width, self.height);
        scene.camera =
            resized.map_err(|error| CliError::input(format!("--width, --height: {error}")))?;
        Ok(scene)
    }

    /// What the command line says instead of the scene file.
    pub(super) fn changes(&self) -> Vec<String> {
        let settings = self.set.iter().map(|setting| format!("--set {setting}"));
        let width = self.width.map(|width| format!("--width {width}"));
        let height = self.height.map(|height| format!("--height {height}"));
        settings.chain(width).chain(height).collect()
    }
}
