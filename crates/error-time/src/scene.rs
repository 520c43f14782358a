//! A scene of the benchmark: its name, its content as a hash, its size, and the scene prepared for rendering.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::Instant;

use uw_render::prepare::Prepared;
use uw_render::scene::{Scene, SceneError, SizeError};

use super::hash::{HashError, content_hash};

/// Width and height that replace those of scene files; one alone keeps the proportions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Size {
    /// Width, pixels.
    pub width: Option<u32>,
    /// Height, pixels.
    pub height: Option<u32>,
}

/// A scene of the benchmark.
pub struct BenchmarkScene {
    /// Name: the stem of the file.
    pub name: String,
    /// The scene file.
    pub path: PathBuf,
    /// Hash of the scene's content, see [`content_hash`].
    pub hash: String,
    /// Whether the picture has another size than the scene file says.
    pub resized: bool,
    scene: Scene,
    read_s: f64,
    prepared: OnceLock<(Prepared, f64)>,
}

/// A scene that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum BenchmarkSceneError {
    /// The scene file is not valid.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A file cannot be read for its hash.
    #[error(transparent)]
    Unreadable(#[from] HashError),
    /// The path has no file name to be called by.
    #[error("{}: must be a scene file with a name", path.display())]
    NoName {
        /// The path.
        path: PathBuf,
    },
    /// Two scenes go by one name.
    #[error("{} and {} have the same name; references and results go by the names of scene files, so rename one", one.display(), other.display())]
    SameName {
        /// A scene file.
        one: PathBuf,
        /// Another.
        other: PathBuf,
    },
    /// The picture would be too large or empty.
    #[error("{}: {source}", path.display())]
    Size {
        /// The scene file.
        path: PathBuf,
        /// The size.
        source: SizeError,
    },
}

impl BenchmarkScene {
    /// Reads a scene file; its camera is given `size`.
    ///
    /// # Errors
    /// A scene that is not valid, or a size that is not.
    pub fn read(path: &Path, size: Size) -> Result<Self, BenchmarkSceneError> {
        let name = path
            .file_stem()
            .ok_or_else(|| BenchmarkSceneError::NoName {
                path: path.to_path_buf(),
            })?;
        let start = Instant::now();
        let mut scene = Scene::read(path)?;
        let read_s = start.elapsed().as_secs_f64();
        let own = (scene.camera.width, scene.camera.height);
        let resized = scene.camera.resized(size.width, size.height);
        scene.camera = resized.map_err(|source| BenchmarkSceneError::Size {
            path: path.to_path_buf(),
            source,
        })?;
        Ok(Self {
            name: name.to_string_lossy().into_owned(),
            path: path.to_path_buf(),
            hash: content_hash(path)?,
            resized: own != (scene.camera.width, scene.camera.height),
            scene,
            read_s,
            prepared: OnceLock::new(),
        })
    }

    /// Reads all scenes, each under a name of its own.
    ///
    /// # Errors
    /// Those of [`BenchmarkScene::read`], and two scenes of one name.
    pub fn read_all(paths: &[PathBuf], size: Size) -> Result<Vec<Self>, BenchmarkSceneError> {
        let mut scenes: Vec<Self> = Vec::new();
        for path in paths {
            let scene = Self::read(path, size)?;
            if let Some(other) = scenes.iter().find(|s| s.name == scene.name) {
                return Err(BenchmarkSceneError::SameName {
                    one: other.path.clone(),
                    other: scene.path,
                });
            }
            scenes.push(scene);
        }
        Ok(scenes)
    }

    /// Width and height of the picture, pixels.
    pub fn size_px(&self) -> (u32, u32) {
        (self.scene.camera.width, self.scene.camera.height)
    }

    /// Most scatterings and reflections of a path, as the scene file says; 0 for no limit.
    pub fn max_bounces(&self) -> u32 {
        self.scene.render.max_bounces
    }

    /// What was read but cannot be honoured.
    pub fn warnings(&self) -> &[String] {
        &self.scene.warnings
    }

    /// The scene as the integrator reads it, made on the first call and kept.
    pub fn prepared(&self) -> &Prepared {
        &self.made().0
    }

    /// Seconds it took to read and to prepare the scene.
    pub fn setup_s(&self) -> f64 {
        self.read_s + self.made().1
    }

    fn made(&self) -> &(Prepared, f64) {
        self.prepared.get_or_init(|| {
            let start = Instant::now();
            let prepared = Prepared::build(&self.scene);
            (prepared, start.elapsed().as_secs_f64())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: &str = r#"
format = "uw-scene/1"
[camera]
position_m = [0.0, 0.0, 0.0]
forward = [1.0, 0.0, 0.0]
up = [0.0, 0.0, 1.0]
fx = 300.0
cx = 150.0
cy = 70.0
width = 320
height = 180
"#;

    fn read(size: Size) -> Result<BenchmarkScene, BenchmarkSceneError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pool.toml");
        std::fs::write(&path, SCENE).unwrap();
        BenchmarkScene::read(&path, size)
    }

    fn size(width: Option<u32>, height: Option<u32>) -> Size {
        Size { width, height }
    }

    #[test]
    fn a_smaller_picture_shows_the_same_view() {
        let whole = read(Size::default()).unwrap();
        assert!(!whole.resized && whole.name == "pool");
        for small in [
            size(Some(80), None),
            size(None, Some(45)),
            size(Some(80), Some(45)),
        ] {
            let scene = read(small).unwrap();
            assert!(scene.resized);
            assert_eq!(scene.size_px(), (80, 45));
            for (x, y) in [(0.0, 0.0), (160.0, 90.0), (320.0, 180.0)] {
                let from = whole.scene.camera.direction(x, y);
                let to = scene.scene.camera.direction(x / 4.0, y / 4.0);
                assert!((from - to).length() < 1e-12, "{from} {to}");
            }
        }
        // Another shape keeps the width of the view and the middle of the picture in its place.
        let tall = read(size(Some(320), Some(320))).unwrap().scene.camera;
        assert_eq!((tall.focal_px.x, tall.focal_px.y), (300.0, 300.0));
        assert_eq!((tall.centre_px.x, tall.centre_px.y), (150.0, 140.0));
    }

    #[test]
    fn sizes_without_pixels_and_equal_names_are_refused() {
        let refusal = |size| read(size).err().map(|e| e.to_string()).unwrap_or_default();
        for (wrong, got) in [
            (size(Some(0), Some(5)), "0 × 5"),
            (size(None, Some(20_000)), "35556 × 20000"),
        ] {
            let message = refusal(wrong);
            assert!(
                message.contains("1..=16384") && message.contains(got),
                "{message}"
            );
        }
        let folder = tempfile::tempdir().unwrap();
        let paths = ["one", "two"].map(|sub| {
            std::fs::create_dir(folder.path().join(sub)).unwrap();
            let path = folder.path().join(sub).join("pool.toml");
            std::fs::write(&path, SCENE).unwrap();
            path
        });
        let both = BenchmarkScene::read_all(&paths, Size::default());
        assert!(matches!(both, Err(BenchmarkSceneError::SameName { .. })));
    }
}
