//! OpenEXR: one part with the channels R, G, B and any number of named groups such as `lamp.left.R`.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Blocks, Compression, Encoding, FlatSamples, Image,
    LayerAttributes, LineOrder, MetaData, ReadChannels, ReadLayers, Text, WritableImage, f16,
};

use super::{ImageError, Picture, write_atomically};

/// Largest image side that is read, pixels.
const MAX_SIDE_PX: usize = 1 << 16;
/// Most pixels times channels that are read.
const MAX_SAMPLES: usize = 1 << 30;
const RGB: [&str; 3] = ["R", "G", "B"];
const XYZ: [&str; 3] = ["X", "Y", "Z"];

/// A linear picture with its layers and what was written down about it.
#[derive(Clone, Debug, PartialEq)]
pub struct ExrImage {
    /// The channels R, G, B.
    pub picture: Picture,
    /// Further layers of the same size, in the order of their names when read.
    pub layers: Vec<Layer>,
    /// Text attributes such as scene, seed and samples per pixel: (name, value), in the order of their names when read.
    pub attributes: Vec<(String, String)>,
}

/// A named layer.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// Name, such as `ambient`, `lamp.left` or `depth`; what stands before the last point of its channels.
    pub name: String,
    /// One value per pixel, row 0 at the top.
    pub data: LayerData,
}

/// Values of a layer.
#[derive(Clone, Debug, PartialEq)]
pub enum LayerData {
    /// Channels `.R`, `.G`, `.B`.
    Colour(Vec<[f32; 3]>),
    /// Channels `.X`, `.Y`, `.Z`: a vector in the world.
    Vector(Vec<[f32; 3]>),
    /// The single channel `.Z`, such as a depth in m.
    Scalar(Vec<f32>),
}

impl ExrImage {
    /// A picture without layers and attributes.
    pub fn new(picture: Picture) -> Self {
        Self {
            picture,
            layers: Vec::new(),
            attributes: Vec::new(),
        }
    }

    /// The values of a layer.
    pub fn layer(&self, name: &str) -> Option<&LayerData> {
        self.layers
            .iter()
            .find(|layer| layer.name == name)
            .map(|layer| &layer.data)
    }

    /// Writes the file, float32 and without loss. It appears whole or not at all.
    ///
    /// # Errors
    /// A picture with a value that is not finite (layers may have some, such as an infinite depth), a layer of another size
    /// than the picture, two layers of one name, or a file that cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), ImageError> {
        self.write_as(path, FlatSamples::F32)
    }

    /// Like [`ExrImage::write`] in half floats: half the size, a relative error of at most 2^-11 from 6.2e-5 to
    /// 65504, coarser in steps of 6e-8 below and infinite above.
    ///
    /// # Errors
    /// Those of [`ExrImage::write`].
    pub fn write_half(&self, path: &Path) -> Result<(), ImageError> {
        self.write_as(path, |plane| {
            FlatSamples::F16(plane.into_iter().map(f16::from_f32).collect())
        })
    }

    /// Writes the file with the channels as `encode` stores them.
    fn write_as(
        &self,
        path: &Path,
        encode: impl Fn(Vec<f32>) -> FlatSamples,
    ) -> Result<(), ImageError> {
        self.check_finite(path)?;
        let channels: Vec<_> = self
            .channels(path)?
            .into_iter()
            .map(|(name, plane)| AnyChannel::new(latin(&name), encode(plane)))
            .collect();
        let mut attributes = LayerAttributes {
            software_name: Some(Text::from(concat!("uw-render ", env!("CARGO_PKG_VERSION")))),
            ..LayerAttributes::default()
        };
        for (name, value) in &self.attributes {
            attributes
                .other
                .insert(latin(name), AttributeValue::Text(latin(value)));
        }
        let encoding = Encoding {
            compression: Compression::ZIP16,
            blocks: Blocks::ScanLines,
            line_order: LineOrder::Increasing,
        };
        let size = (self.picture.width as usize, self.picture.height as usize);
        let layer = exr::prelude::Layer::new(
            size,
            attributes,
            encoding,
            AnyChannels::sort(channels.into()),
        );
        let image = Image::from_layer(layer);
        write_atomically(path, |writer| {
            image
                .write()
                .to_buffered(writer)
                .map_err(|error| content(path, error))
        })
    }

    /// Whether all values of the picture are finite numbers.
    fn check_finite(&self, path: &Path) -> Result<(), ImageError> {
        let is_bad = |pixel: &[f32; 3]| pixel.iter().any(|value| !value.is_finite());
        let Some(first) = self.picture.data.iter().position(is_bad) else {
            return Ok(());
        };
        let count = self
            .picture
            .data
            .iter()
            .filter(|pixel| is_bad(pixel))
            .count();
        let width = self.picture.width.max(1) as usize;
        let (column, row) = (first % width, first / width);
        Err(content(
            path,
            format!(
                "{count} pixels are no finite numbers, the first in column {column}, row {row} (from 0): {:?}",
                self.picture.data[first]
            ),
        ))
    }

    /// The channels by name, in the order of their names.
    fn channels(&self, path: &Path) -> Result<BTreeMap<String, Vec<f32>>, ImageError> {
        let mut named = BTreeMap::new();
        let base = RGB.iter().map(|name| name.to_string());
        named.extend(base.zip(planes(&self.picture.data)));
        for Layer { name, data } in &self.layers {
            let (suffixes, planes): (&[&str], Vec<Vec<f32>>) = match data {
                LayerData::Colour(values) => (&RGB, planes(values).into()),
                LayerData::Vector(values) => (&XYZ, planes(values).into()),
                LayerData::Scalar(values) => (&["Z"], vec![values.clone()]),
            };
            for (suffix, plane) in suffixes.iter().zip(planes) {
                if named.insert(format!("{name}.{suffix}"), plane).is_some() {
                    return Err(content(path, format!("layer {name} is given twice")));
                }
            }
        }
        let pixels = self.picture.width as usize * self.picture.height as usize;
        match named.iter().find(|(_, plane)| plane.len() != pixels) {
            Some((name, plane)) => Err(content(
                path,
                format!(
                    "channel {name} must have {pixels} values, got {}",
                    plane.len()
                ),
            )),
            None => Ok(named),
        }
    }

    /// Reads an EXR file with at least the channels R, G, B; other groups become layers, other channels are
    /// passed over. Half floats and whole numbers become float32.
    ///
    /// # Errors
    /// A file that cannot be read, is no EXR file, or has no R, G, B.
    pub fn read(path: &Path) -> Result<Self, ImageError> {
        let system = |source| ImageError::System {
            path: path.to_path_buf(),
            action: "read",
            source,
        };
        let open = || File::open(path).map(BufReader::new).map_err(system);
        check_size(
            path,
            &MetaData::read_from_buffered(open()?, false).map_err(|error| content(path, error))?,
        )?;
        let reader = exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels();
        let image = reader
            .first_valid_layer()
            .all_attributes()
            .from_buffered(open()?);
        let layer = image.map_err(|error| content(path, error))?.layer_data;
        let mut named: BTreeMap<String, Vec<f32>> = BTreeMap::new();
        for channel in layer.channel_data.list {
            named.insert(channel.name.to_string(), floats(channel.sample_data));
        }
        let data = take(&mut named, "", &RGB).ok_or_else(|| {
            let found = named.keys().cloned().collect::<Vec<_>>().join(", ");
            content(
                path,
                format!("must have the channels R, G and B, got {found}"),
            )
        })?;
        let (width, height) = (layer.size.width() as u32, layer.size.height() as u32);
        let mut attributes: Vec<(String, String)> = layer
            .attributes
            .other
            .iter()
            .filter_map(text_attribute)
            .collect();
        attributes.sort();
        Ok(Self {
            picture: Picture {
                width,
                height,
                data,
            },
            layers: layers(named),
            attributes,
        })
    }
}

fn check_size(path: &Path, meta: &MetaData) -> Result<(), ImageError> {
    for header in &meta.headers {
        let (width, height, channels) = (
            header.layer_size.width(),
            header.layer_size.height(),
            header.channels.list.len(),
        );
        let fits = width.max(height) <= MAX_SIDE_PX
            && (width * height).saturating_mul(channels) <= MAX_SAMPLES;
        if !fits {
            let limits =
                format!("at most {MAX_SIDE_PX} pixels a side and {MAX_SAMPLES} values in all");
            return Err(content(
                path,
                format!("must have {limits}, got {width} x {height} with {channels} channels"),
            ));
        }
    }
    Ok(())
}

fn planes(pixels: &[[f32; 3]]) -> [Vec<f32>; 3] {
    std::array::from_fn(|k| pixels.iter().map(|pixel| pixel[k]).collect())
}

fn floats(samples: FlatSamples) -> Vec<f32> {
    match samples {
        FlatSamples::F32(values) => values,
        FlatSamples::F16(values) => values.into_iter().map(|value| value.to_f32()).collect(),
        FlatSamples::U32(values) => values.into_iter().map(|value| value as f32).collect(),
    }
}

/// Takes the channels `prefix` + suffix out of the map, if all three are there and equally long.
fn take(
    named: &mut BTreeMap<String, Vec<f32>>,
    prefix: &str,
    suffixes: &[&str; 3],
) -> Option<Vec<[f32; 3]>> {
    let names = suffixes.map(|suffix| format!("{prefix}{suffix}"));
    if !names.iter().all(|name| named.contains_key(name)) {
        return None;
    }
    let [x, y, z] = names.map(|name| named.remove(&name).unwrap_or_default());
    Some(
        x.into_iter()
            .zip(y)
            .zip(z)
            .map(|((x, y), z)| [x, y, z])
            .collect(),
    )
}

fn layers(mut named: BTreeMap<String, Vec<f32>>) -> Vec<Layer> {
    let prefixes: Vec<String> = named
        .keys()
        .filter_map(|name| name.rsplit_once('.'))
        .map(|(prefix, _)| prefix.to_string())
        .collect();
    let mut layers: Vec<Layer> = Vec::new();
    for name in prefixes {
        let dotted = format!("{name}.");
        let colour = take(&mut named, &dotted, &RGB).map(LayerData::Colour);
        let vector = colour.or_else(|| take(&mut named, &dotted, &XYZ).map(LayerData::Vector));
        let data = vector.or_else(|| named.remove(&format!("{dotted}Z")).map(LayerData::Scalar));
        layers.extend(data.map(|data| Layer { name, data }));
    }
    layers
}

fn text_attribute((name, value): (&Text, &AttributeValue)) -> Option<(String, String)> {
    match value {
        AttributeValue::Text(text) => Some((name.to_string(), text.to_string())),
        _ => None,
    }
}

/// EXR text holds Latin characters only; others become `?`.
fn latin(text: &str) -> Text {
    let printable: String = text
        .chars()
        .map(|c| if c.is_ascii() && c != '\0' { c } else { '?' })
        .collect();
    Text::from(printable.as_str())
}

fn content(path: &Path, reason: impl ToString) -> ImageError {
    ImageError::Content {
        path: path.to_path_buf(),
        reason: reason.to_string(),
    }
}

#[cfg(test)]
mod tests;
