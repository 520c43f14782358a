//! Finished renders on disk: one small file each, whole or absent, so that nothing is rendered twice.

use std::fs;
use std::path::Path;

use uw_render::image::write_bytes;

use super::DatasetError;
use super::seal::{self, Found, Watch};
use uw_twin::estimate::fields::{Fields, GROUPS};
use uw_twin::estimate::upward::UpwardImage;

/// Start of every file: format and version. After header and numbers the file ends with its checksum.
const MAGIC: &[u8; 16] = b"uw-render-sums/2";
/// The version before, which had no checksum.
const MAGIC_UNSEALED: &[u8; 16] = b"uw-render-sums/1";

impl Watch<'_> {
    /// Writes the fields of a render.
    pub(super) fn write_fields(&self, path: &Path, fields: &Fields) -> Result<(), DatasetError> {
        let per_channel = fields.veil[0][0].len();
        let header = [
            u32::from(fields.lamps),
            fields.samples_per_group,
            GROUPS as u32,
            per_channel as u32,
        ];
        let all = fields.veil.iter().chain(&fields.irradiance);
        self.write(path, &header, all.flatten().flatten().copied())
    }

    /// Reads the fields of a render; `None` when there is no file that can be believed.
    pub(super) fn read_fields(&self, path: &Path) -> Result<Option<Fields>, DatasetError> {
        let found = read(&self.name(path), path)?.and_then(NOT_A_RENDER, fields);
        Ok(self.accept(path, found))
    }

    /// Writes an upward render.
    pub(super) fn write_upward(
        &self,
        path: &Path,
        image: &UpwardImage,
    ) -> Result<(), DatasetError> {
        let header = [2, image.samples_per_group, GROUPS as u32, 0];
        self.write(path, &header, image.sums.iter().flatten().copied())
    }

    /// Reads an upward render; `None` when there is no file that can be believed.
    pub(super) fn read_upward(&self, path: &Path) -> Result<Option<UpwardImage>, DatasetError> {
        let found = read(&self.name(path), path)?.and_then(NOT_A_RENDER, upward);
        Ok(self.accept(path, found))
    }

    fn write(
        &self,
        path: &Path,
        header: &[u32; 4],
        values: impl Iterator<Item = f64>,
    ) -> Result<(), DatasetError> {
        let mut bytes = MAGIC.to_vec();
        header.iter().for_each(|h| bytes.extend(h.to_le_bytes()));
        values.for_each(|v| bytes.extend(v.to_le_bytes()));
        let sum = seal::checksum(&self.name(path), &bytes);
        bytes.extend(sum.to_le_bytes());
        Ok(write_bytes(path, &bytes)?)
    }
}

/// Whether the render at `path`, by `name` inside its folder, is as it was written.
pub(super) fn inspect(name: &str, path: &Path) -> Result<Found<()>, DatasetError> {
    let found = read(name, path)?;
    Ok(found.and_then(NOT_A_RENDER, |content| match content.0[0] {
        2 => upward(content).map(|_| ()),
        _ => fields(content).map(|_| ()),
    }))
}

const NOT_A_RENDER: &str = "it is not a render of this program's format";

/// Header and values of a file.
type StoredValues = ([u32; 4], Vec<f64>);

fn fields(([lamps, samples_per_group, groups, n], values): StoredValues) -> Option<Fields> {
    let (n, groups) = (n as usize, groups as usize);
    if groups != GROUPS || n == 0 || Some(values.len()) != n.checked_mul(2 * GROUPS * 3) {
        return None;
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
    Some(Fields {
        lamps: lamps == 1,
        samples_per_group,
        veil: part(0),
        irradiance: part(GROUPS * 3 * n),
    })
}

fn upward(([_, samples_per_group, _, _], values): StoredValues) -> Option<UpwardImage> {
    let (sums, rest) = values.as_chunks::<4>();
    (sums.len() == UpwardImage::SUMS && rest.is_empty()).then(|| UpwardImage {
        samples_per_group,
        sums: sums.to_vec(),
    })
}

fn read(name: &str, path: &Path) -> Result<Found<StoredValues>, DatasetError> {
    let Some(bytes) = read_bytes(path)? else {
        return Ok(Found::Absent);
    };
    let found = match bytes.split_last_chunk::<4>() {
        Some((sealed, sum)) if sealed.starts_with(MAGIC) => {
            if seal::checksum(name, sealed) == u32::from_le_bytes(*sum) {
                Found::Sealed(sealed)
            } else {
                Found::changed()
            }
        }
        _ if bytes.starts_with(MAGIC_UNSEALED) => Found::Unsealed(bytes.as_slice()),
        _ => Found::Damaged(NOT_A_RENDER.into()),
    };
    Ok(found.and_then("it is cut short", |bytes| {
        let (header, values) = bytes.get(MAGIC.len()..)?.split_first_chunk::<16>()?;
        let (words, _) = header.as_chunks::<4>();
        let header = words.first_chunk::<4>()?.map(u32::from_le_bytes);
        let (values, left) = values.as_chunks::<8>();
        let values = values.iter().map(|v| f64::from_le_bytes(*v)).collect();
        left.is_empty().then_some((header, values))
    }))
}

/// The bytes of a file; `None` when there is none.
pub(super) fn read_bytes(path: &Path) -> Result<Option<Vec<u8>>, DatasetError> {
    match fs::read(path) {
        Ok(bytes) => Ok(Some(bytes)),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(DatasetError::Io {
            path: path.display().to_string(),
            source,
        }),
    }
}
