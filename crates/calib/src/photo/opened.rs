//! A picture of a calibration, opened and made ready to be measured.

use std::path::Path;
use std::sync::Arc;

use super::exposures::Exposed;
use super::frames::{self, Still};
use super::lights::Lights;
use super::mask::Mask;
use super::origin::{Origin, PatchOrigin};
use super::resampling::Resampling;
use super::undistortion::Undistortion;
use crate::Encoding;
use crate::detail::Behind;
use crate::even::Even;
use crate::noise::NoiseModel;
use crate::picture::{Counts, Decoded};
use crate::planes::Planes;
use crate::stats::{self, Measured, PatchGrid, StatsError};

/// What is done to pictures before they are measured.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Treatment {
    /// How counts stand for light.
    pub encoding: Encoding,
    /// Exposure that pictures of the target are brought to, in the unit of the manifest or of EXIF: time (s) · ISO / f-number²; finite and > 0. `None`: the shortest.
    pub exposure: Option<f64>,
    /// The lens that is taken out.
    pub even: Option<Even>,
    /// What is left out of the stored pictures.
    pub mask: Option<Mask>,
    /// From the stored pictures to those of an ideal camera.
    pub undistortion: Option<Undistortion>,
}

/// A picture that is asked for.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    /// File, or folder of frames.
    pub path: &'a Path,
    /// Distance of what it shows, m; `None` where that is far away or not known.
    pub distance_m: Option<f64>,
    /// How it was exposed over what it is brought to.
    pub exposed: Exposed,
}

/// A picture ready to be measured. Pixels that are masked or not seen are unknown (NaN).
#[derive(Debug)]
pub struct Opened {
    name: String,
    step: f64,
    frames: usize,
    stored: Planes,
    /// Where anything was done.
    made: Option<Planes>,
    even: Option<Even>,
    /// Sensitivity (ISO) over that of the pictures whose noise is known.
    gain: f64,
    resampling: Option<Arc<Resampling>>,
    told: Vec<String>,
}

impl Treatment {
    /// Opens a picture: reads it (a folder's frames as their mean), leaves out what is masked, takes lens and exposure out, resamples.
    ///
    /// # Errors
    /// It cannot be read, is no picture of 8 or 16 bits, has another size than mask or camera, or nothing of it is left.
    pub fn open(&self, view: &View<'_>) -> Result<Opened, StatsError> {
        let name = view.path.display().to_string();
        let still = frames::still(view.path, &Lights::new(self.encoding))?;
        self.apply(name, still, view.distance_m, view.exposed)
    }

    /// The same of a picture in memory, of what is `distance_m` away, where that is known, exposed so over what it is brought to.
    ///
    /// # Errors
    /// It has another size than mask or camera.
    pub fn of_decoded(
        &self,
        decoded: &Decoded,
        distance_m: Option<f64>,
        exposed: Exposed,
    ) -> Result<Opened, StatsError> {
        let still = Still {
            planes: decoded.planes.clone(),
            step: decoded.step,
            frames: 1,
            told: Vec::new(),
        };
        self.apply(decoded.name.clone(), still, distance_m, exposed)
    }

    fn apply(
        &self,
        name: String,
        still: Still,
        distance_m: Option<f64>,
        exposed: Exposed,
    ) -> Result<Opened, StatsError> {
        let lights = Lights::new(self.encoding);
        let Still {
            planes: mut stored,
            step,
            frames,
            told,
        } = still;
        let size = |message: String| StatsError::OtherSize {
            name: name.clone(),
            message,
        };
        if let Some(mask) = &self.mask {
            mask.apply(&mut stored).map_err(size)?;
        }
        let even = self.even_of(exposed.over);
        let evened = even.as_ref().map(|even| even.of_planes(&stored));
        let resampling = (self.undistortion.as_ref()).map(|way| way.at(distance_m).clone());
        let made = match &resampling {
            None => evened,
            Some(map) => {
                let [width, height] = map.from_px();
                if [stored.width, stored.height] != [width, height] {
                    return Err(size(format!(
                        "must have the {width} x {height} pixels of the camera's file, got {} x {} (pictures made smaller or larger \
                         need a camera of their size)",
                        stored.width, stored.height
                    )));
                }
                Some(map.apply(evened.as_ref().unwrap_or(&stored), &lights))
            }
        };
        Ok(Opened {
            name,
            step,
            frames,
            stored,
            made,
            even,
            gain: exposed.gain,
            resampling,
            told,
        })
    }

    /// What brings pictures of an exposure, over that which all are brought to, to even light.
    fn even_of(&self, over: f64) -> Option<Even> {
        match &self.even {
            Some(even) => Some(even.exposed(over)),
            None => (over != 1.0).then(|| Even::of_exposure(over, self.encoding)),
        }
    }
}

impl Opened {
    fn planes(&self) -> &Planes {
        self.made.as_ref().unwrap_or(&self.stored)
    }

    fn behind(&self) -> Option<Behind<'_>> {
        let is_stored = self.made.is_none() && self.frames == 1;
        (!is_stored).then_some(Behind {
            even: self.even.as_ref(),
            stored: &self.stored,
            resampling: self.resampling.as_deref(),
            frames: self.frames as f64,
        })
    }

    /// Mean and contrast, with and without noise.
    ///
    /// # Errors
    /// It is smaller than 10 × 6 pixels, or no patch is half known.
    pub fn measure(&self, noise: &NoiseModel) -> Result<Measured, StatsError> {
        let behind = self.behind();
        let measured = stats::of_planes(self.planes(), self.step, Some(noise), behind.as_ref());
        stats::named(measured, &self.name)
    }

    /// Mean and contrast of `light(counts)` in the place of every pixel's counts.
    ///
    /// # Errors
    /// As of [`Opened::measure`].
    pub fn measure_as(&self, light: impl Fn(f64) -> f64) -> Result<PatchGrid, StatsError> {
        let planes = self.planes();
        let grid = stats::patch_statistics(planes.width, planes.height, |i| {
            [0, 1, 2].map(|k| light(planes.channels[k][i]))
        });
        stats::named(grid, &self.name)
    }

    /// Its pixels, and what they have of the stored pictures' noise.
    pub fn counts(&self) -> Counts {
        let planes = self.planes();
        let size = [planes.width, planes.height];
        Counts {
            origin: (self.behind().is_some() || self.gain != 1.0)
                .then(|| Origin::new(size, |corner, side| self.patch(corner, side))),
            ..Counts::of_planes(planes)
        }
    }

    /// Of the patch of `side` pixels that begins at the pixel `corner`.
    fn patch(&self, corner: [usize; 2], side: [usize; 2]) -> PatchOrigin {
        let middle = [0, 1].map(|k| corner[k] as f64 + 0.5 * side[k] as f64);
        let map = self.resampling.as_ref();
        PatchOrigin {
            // With the sensitivity a signal's noise grows as the signal does: it is that of the light alone.
            share: self.stored_share(middle) / self.gain,
            left: map.map_or(1.0, |map| map.noise_left(corner, side)) / self.frames as f64,
            pixels: self.pixels_behind(middle),
        }
    }

    /// The share of a picture's light at (x, y), pixels from the top left corner, that the stored picture has of it: by its lens and its exposure.
    pub fn stored_share(&self, [x, y]: [f64; 2]) -> f64 {
        let Some(even) = &self.even else {
            return 1.0;
        };
        let place = match &self.resampling {
            Some(map) => map.at(x, y).unwrap_or([x, y]),
            None => [x, y],
        };
        let size = [self.stored.width, self.stored.height];
        even.share(
            [0, 1].map(|k| (place[k].max(0.0) as usize).min(size[k] - 1)),
            size,
        )
    }

    /// How many stored pixels are behind one at (x, y), those of all frames.
    pub fn pixels_behind(&self, [x, y]: [f64; 2]) -> f64 {
        let map = self.resampling.as_ref();
        self.frames as f64 * map.map_or(1.0, |map| map.pixels_behind(x, y))
    }

    /// What should be known of it, a sentence each.
    pub fn told(&self) -> &[String] {
        &self.told
    }
}
