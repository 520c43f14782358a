//! Finished renders on disk: one small file each, whole or absent, so that nothing is rendered twice.

use std::fs;
use std::io::Write;
use std::path::Path;

use uw_render::image::{ImageError, write_atomically};

use super::DatasetError;
use crate::estimate::fields::{Fields, GROUPS};
use crate::estimate::upward::UpwardImage;

/// Start of every file: format and version.
const MAGIC: &[u8; 16] = b"uw-render-sums/1";

/// Writes the fields of a render.
pub(super) fn write_fields(path: &Path, fields: &Fields) -> Result<(), DatasetError> {
    let per_channel = fields.veil[0][0].len();
    let header = [
        u32::from(fields.lamps),
        fields.samples_per_group,
        GROUPS as u32,
        per_channel as u32,
    ];
    let all = fields.veil.iter().chain(&fields.irradiance);
    write(path, &header, all.flatten().flatten().copied())
}

/// Reads the fields of a render; `None` when there is no file.
pub(super) fn read_fields(path: &Path) -> Result<Option<Fields>, DatasetError> {
    let Some(([lamps, samples_per_group, groups, n], values)) = read(path)? else {
        return Ok(None);
    };
    let (n, groups) = (n as usize, groups as usize);
    if groups != GROUPS || n == 0 || values.len() != 2 * GROUPS * 3 * n {
        return Err(damaged(path));
    }
    let part = |start: usize| -> Vec<[Vec<f64>; 3]> {
        (0..GROUPS)
            .map(|g| {
                std::array::from_fn(|k| {
                    let at = start + (g * 3 + k) * n;
                    values[at..at + n].to_vec()
                })
            })
            .collect()
    };
    Ok(Some(Fields {
        lamps: lamps == 1,
        samples_per_group,
        veil: part(0),
        irradiance: part(GROUPS * 3 * n),
    }))
}

/// Writes an upward render.
pub(super) fn write_upward(path: &Path, image: &UpwardImage) -> Result<(), DatasetError> {
    let header = [2, image.samples_per_group, GROUPS as u32, 0];
    write(path, &header, image.sums.iter().flatten().copied())
}

/// Reads an upward render; `None` when there is no file.
pub(super) fn read_upward(path: &Path) -> Result<Option<UpwardImage>, DatasetError> {
    let Some(([_, samples_per_group, _, _], values)) = read(path)? else {
        return Ok(None);
    };
    let (sums, rest) = values.as_chunks::<4>();
    if sums.len() != UpwardImage::SUMS || !rest.is_empty() {
        return Err(damaged(path));
    }
    Ok(Some(UpwardImage {
        samples_per_group,
        sums: sums.to_vec(),
    }))
}

fn write(
    path: &Path,
    header: &[u32; 4],
    values: impl Iterator<Item = f64>,
) -> Result<(), DatasetError> {
    let mut bytes = MAGIC.to_vec();
    header.iter().for_each(|h| bytes.extend(h.to_le_bytes()));
    values.for_each(|v| bytes.extend(v.to_le_bytes()));
    Ok(write_bytes(path, &bytes)?)
}

/// Header and values of a file.
type Content = ([u32; 4], Vec<f64>);

fn read(path: &Path) -> Result<Option<Content>, DatasetError> {
    let bytes = match fs::read(path) {
        Ok(bytes) => bytes,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(source) => {
            return Err(DatasetError::Io {
                path: path.display().to_string(),
                source,
            });
        }
    };
    let Some(rest) = bytes.strip_prefix(MAGIC.as_slice()) else {
        return Err(damaged(path));
    };
    let (words, _) = rest.as_chunks::<4>();
    let Some(header) = words.first_chunk::<4>() else {
        return Err(damaged(path));
    };
    let (values, left) = rest[16..].as_chunks::<8>();
    if !left.is_empty() {
        return Err(damaged(path));
    }
    let values = values.iter().map(|v| f64::from_le_bytes(*v)).collect();
    Ok(Some((header.map(u32::from_le_bytes), values)))
}

fn damaged(path: &Path) -> DatasetError {
    DatasetError::Inconsistent(format!(
        "{} is not a render of this program's format; delete it to have it made again",
        path.display()
    ))
}

/// Writes a file whole or not at all.
pub(super) fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), ImageError> {
    write_atomically(path, |file| {
        file.write_all(bytes).map_err(|source| ImageError::System {
            path: path.to_path_buf(),
            action: "written",
            source,
        })
    })
}
