//! The project's own scenery: procedural textures and glTF models.
//!
//! `noise` → `tile` (noise and scattered items in metres) → `textures` (reflectance pictures) →
//! `image_file`; `mesh` → `models`, `sites` → `gltf_writer`. [`write_all`] makes the shipped files again, byte for byte.

pub mod colour;
pub mod gltf_writer;
pub mod image_file;
pub mod mesh;
pub mod models;
pub mod noise;
pub mod sites;
pub mod textures;
pub mod tile;

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use textures::Pattern;
use tile::Tile;
use uw_render::image::{ImageError, write_bytes};

/// How to make the scenery. The default makes the shipped files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Seed of all patterns and models.
    pub seed: u32,
    /// Width and height of the textures that models carry (`hull_red`, `seabed`), texels, 16..=16384.
    pub main_texture_px: u32,
    /// Width and height of the other textures, texels, 16..=16384.
    pub texture_px: u32,
    /// Quality of the JPEG inside models, 1..=100.
    pub jpeg_quality: u8,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            seed: 1,
            main_texture_px: 1920,
            texture_px: 1024,
            jpeg_quality: 92,
        }
    }
}

/// Why scenery could not be made.
#[derive(Debug, thiserror::Error)]
pub enum SceneryError {
    /// An option is outside its range.
    #[error("{field} must be {expected}, got {got}")]
    OutOfRange {
        /// Name of the option.
        field: &'static str,
        /// What it may be.
        expected: &'static str,
        /// What it is.
        got: u32,
    },
    /// A picture could not be encoded.
    #[error("cannot encode {width} × {height} texels as {format}: {source}")]
    Encode {
        /// Image format.
        format: &'static str,
        /// Width, texels.
        width: u32,
        /// Height, texels.
        height: u32,
        /// What the encoder says.
        source: image::ImageError,
    },
    /// A model exceeds what binary glTF can hold.
    #[error("model needs {bytes} bytes, binary glTF holds less than 4294967296")]
    ModelTooLarge {
        /// Size the file would have.
        bytes: usize,
    },
    /// A file could not be completed.
    #[error(transparent)]
    File(#[from] ImageError),
    /// The folder of a file could not be made.
    #[error("cannot make the folder for {}: {source}", path.display())]
    Folder {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
}

/// The bumpy plate of the benchmark, from the output folder, and the picture beside it that it shows.
const BUMPY_PLATE: &str = "benchmarks/bumpy_plate.glb";
const BUMPY_PLATE_TEXTURE: &str = "target_tex_srgb.png";

/// Makes all textures (`DIR/textures/*.png`), models (`DIR/scenes/*.glb`) and the plate of the benchmark
/// (`DIR/benchmarks/bumpy_plate.glb`, without the picture that it shows) and returns the files written. Each file appears complete or not at all. The same options give the same bytes.
pub fn write_all(dir: &Path, options: &Options) -> Result<Vec<PathBuf>, SceneryError> {
    options.check()?;
    let mut files = Vec::new();
    for pattern in Pattern::ALL.into_iter().chain(Pattern::OF_SITES) {
        let tile = Tile {
            size_m: pattern.tile_m(),
            seed: options.seed,
        };
        let model = match pattern {
            Pattern::HullRed => Some(models::ship_hull(options.seed)),
            Pattern::Seabed => Some(models::seabed(options.seed)),
            _ => None,
        };
        let width = if model.is_some() {
            options.main_texture_px
        } else {
            options.texture_px
        };
        let picture = pattern.draw(&tile, width);
        let path = dir.join("textures").join(format!("{}.png", pattern.name()));
        write_file(&path, &image_file::png_bytes(&picture)?)?;
        files.push(path);
        if let Some(model) = model {
            let path = dir.join("scenes").join(format!("{}.glb", model.name));
            write_file(
                &path,
                &gltf_writer::glb_bytes(&model, &picture, options.jpeg_quality)?,
            )?;
            files.push(path);
        }
    }
    for site in sites::all(options.seed) {
        let path = dir.join("scenes").join(format!("{}.glb", site.name));
        write_file(&path, &gltf_writer::site_glb_bytes(&site)?)?;
        files.push(path);
    }
    let path = dir.join(BUMPY_PLATE);
    write_file(&path, &bumpy_plate_bytes(options.seed)?)?;
    files.push(path);
    Ok(files)
}

fn bumpy_plate_bytes(seed: u32) -> Result<Vec<u8>, SceneryError> {
    gltf_writer::tiled_glb_bytes(
        "bumpy_plate",
        &models::bumpy_tile(seed),
        &models::bumpy_plate_places(),
        BUMPY_PLATE_TEXTURE,
    )
}

impl Options {
    fn check(&self) -> Result<(), SceneryError> {
        for (field, got) in [
            ("main_texture_px", self.main_texture_px),
            ("texture_px", self.texture_px),
        ] {
            if !(16..=16_384).contains(&got) {
                return Err(SceneryError::OutOfRange {
                    field,
                    expected: "between 16 and 16384",
                    got,
                });
            }
        }
        if !(1..=100).contains(&self.jpeg_quality) {
            let got = u32::from(self.jpeg_quality);
            return Err(SceneryError::OutOfRange {
                field: "jpeg_quality",
                expected: "between 1 and 100",
                got,
            });
        }
        Ok(())
    }
}

/// Writes a file under its name once it is complete; makes the folder where there is none.
fn write_file(path: &Path, bytes: &[u8]) -> Result<(), SceneryError> {
    let cannot = |source| SceneryError::Folder {
        path: path.to_path_buf(),
        source,
    };
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).map_err(cannot)?;
    }
    write_bytes(path, bytes)?;
    Ok(())
}

#[cfg(test)]
mod tests;
