//! A rendered view of the target: daylight and lamps apart, and the statistics of its image at every lamp level.

use std::path::Path;

use serde::{Deserialize, Serialize};
use uw_calib::ImageStats;
use uw_render::image::{Counts, ExrImage, ImageError, Layer, LayerData, Picture};
use uw_render::scene::Sensor;

/// Name of the layer of both lamps at 100 %.
const LAMPS: &str = "lamps";
/// Name of the attribute that holds [`ViewRecord`] as JSON.
const RECORD: &str = "record";
/// Steps of lamp level at which statistics are kept, percent.
const LIGHT_STEP_PCT: f64 = 10.0;
/// Number of lamp levels from 0 to 100 %.
const LIGHT_LEVELS: usize = 11;

/// What is known about a view beside its pixels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ViewRecord {
    /// Contrast per channel at lamp levels 0, 10, .. 100 %, 8-bit counts.
    pub contrast: Vec<[f64; 3]>,
    /// Samples per pixel: of the daylight, of the lamps.
    pub samples: [u32; 2],
    /// Processor time of the render, s.
    pub cpu_s: f64,
}

/// A rendered view.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Radiance from daylight, W/(m² sr).
    ambient: Picture,
    /// Radiance from both lamps at 100 %, W/(m² sr).
    lamps: Vec<[f32; 3]>,
    /// The rest.
    pub record: ViewRecord,
}

impl View {
    /// A view of its two pictures, W/(m² sr): daylight, and the lamps at 100 %. `seed` draws the noise of the sensor in
    /// the statistics.
    pub fn new(
        ambient: Picture,
        lamps: Picture,
        (samples, cpu_s): ([u32; 2], f64),
        sensor: &Sensor,
        seed: u64,
    ) -> Self {
        let mut view = Self {
            ambient,
            lamps: lamps.data,
            record: ViewRecord {
                contrast: Vec::new(),
                samples,
                cpu_s,
            },
        };
        view.record.contrast = (0..LIGHT_LEVELS)
            .map(|i| view.measured_contrast(LIGHT_STEP_PCT * i as f64, sensor, seed))
            .collect();
        view
    }

    /// A view without lamp light, for tests of what only reads the record.
    #[cfg(test)]
    pub fn of_record(ambient: Picture, record: ViewRecord) -> Self {
        Self {
            lamps: vec![[0.0; 3]; ambient.data.len()],
            ambient,
            record,
        }
    }

    /// Contrast of one exposure. It averages so many pixels that its noise is far below its value.
    fn measured_contrast(&self, light_pct: f64, sensor: &Sensor, seed: u64) -> [f64; 3] {
        let frame = sensor.expose(&self.picture(light_pct), seed);
        let (width, height) = (frame.width as usize, frame.height as usize);
        let stats = match &frame.counts {
            Counts::Bits8(counts) => ImageStats::from_rgb8(width, height, counts),
            Counts::Bits16(counts) => ImageStats::from_rgb16(width, height, counts),
        };
        // A frame has the size of its buffer and, by the vehicle's limits, of the patch grid.
        stats.map_or([f64::NAN; 3], |s| s.contrast)
    }

    /// Radiance at a lamp level in percent.
    pub fn picture(&self, light_pct: f64) -> Picture {
        let share = (0.01 * light_pct) as f32;
        let sum = |(ambient, lamps): (&[f32; 3], &[f32; 3])| {
            std::array::from_fn(|k| ambient[k] + share * lamps[k])
        };
        Picture {
            data: self.ambient.data.iter().zip(&self.lamps).map(sum).collect(),
            ..self.ambient
        }
    }

    /// Contrast per channel at a lamp level, 8-bit counts; linear between the levels kept.
    pub fn contrast(&self, light_pct: f64) -> [f64; 3] {
        let at = (light_pct / LIGHT_STEP_PCT).clamp(0.0, (LIGHT_LEVELS - 1) as f64);
        let below = (at.floor() as usize).min(LIGHT_LEVELS - 2);
        let share = at - below as f64;
        let (low, high) = (
            &self.record.contrast[below],
            &self.record.contrast[below + 1],
        );
        std::array::from_fn(|k| (1.0 - share) * low[k] + share * high[k])
    }

    /// Writes the view as half floats with its record; the file appears whole or not at all.
    pub fn write(&self, path: &Path) -> Result<(), ImageError> {
        let record = serde_json::to_string(&self.record).map_err(|e| ImageError::Content {
            path: path.to_path_buf(),
            reason: e.to_string(),
        })?;
        let image = ExrImage {
            layers: vec![Layer {
                name: LAMPS.into(),
                data: LayerData::Colour(self.lamps.clone()),
            }],
            attributes: vec![(RECORD.into(), record)],
            ..ExrImage::new(self.ambient.clone())
        };
        image.write_half(path)
    }

    /// Reads a view back.
    pub fn read(path: &Path) -> Result<Self, ImageError> {
        let content = |reason: String| ImageError::Content {
            path: path.to_path_buf(),
            reason,
        };
        let image = ExrImage::read(path)?;
        let Some(LayerData::Colour(lamps)) = image.layer(LAMPS) else {
            return Err(content(format!("must have the layer {LAMPS}")));
        };
        let text = image.attributes.iter().find(|(name, _)| name == RECORD);
        let (_, text) = text.ok_or_else(|| content(format!("must have the attribute {RECORD}")))?;
        let record: ViewRecord =
            serde_json::from_str(text).map_err(|e| content(format!("{RECORD}: {e}")))?;
        if record.contrast.len() != LIGHT_LEVELS {
            return Err(content(format!(
                "{RECORD} must hold the contrast at {LIGHT_LEVELS} lamp levels, got {}",
                record.contrast.len()
            )));
        }
        Ok(Self {
            lamps: lamps.clone(),
            ambient: image.picture,
            record,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view() -> View {
        let pixels = |scale: f32| (0..200).map(|i| [scale * i as f32, 0.5, scale]).collect();
        View {
            ambient: Picture {
                width: 20,
                height: 10,
                data: pixels(0.25),
            },
            lamps: pixels(0.125),
            record: ViewRecord {
                contrast: (0..LIGHT_LEVELS).map(|i| [i as f64, 2.0, 10.0]).collect(),
                samples: [4, 8],
                cpu_s: 1.5,
            },
        }
    }

    #[test]
    fn a_view_comes_back_from_its_file() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("view.exr");
        view().write(&path).expect("written");
        // All values of the test are exact in half floats.
        assert_eq!(View::read(&path).expect("read"), view());
    }

    #[test]
    fn lamps_add_in_proportion_and_contrast_is_interpolated() {
        let picture = view().picture(40.0);
        assert!((picture.data[100][0] - (25.0 + 0.4 * 12.5)).abs() < 1e-5);
        assert!((view().contrast(25.0)[0] - 2.5).abs() < 1e-12);
        assert_eq!(view().contrast(100.0), [10.0, 2.0, 10.0]);
    }

    #[test]
    fn a_file_that_is_no_view_is_refused() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("other.exr");
        ExrImage::new(view().ambient).write(&path).expect("written");
        let error = View::read(&path).expect_err("no lamps").to_string();
        assert!(error.contains("must have the layer lamps"), "{error}");
    }
}
