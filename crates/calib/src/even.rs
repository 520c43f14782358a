//! Pictures of a camera whose lens takes light away from the middle, without that: light over the share that is left, at the
//! middle's level.
//!
//! Pictures that were exposed longer or shorter than others are brought to the light of those alike ([`Even::exposed`]).
//!
//! Noise grows where light was missing. What [`crate::detail`] takes off is that of the stored picture, grown alike. Light that comes
//! out beyond full scale is at full scale, as are pixels that were there.

use crate::Encoding;
use crate::photo::{FULL, Lights, Origin, PatchOrigin};
use crate::picture::Counts;
use crate::planes::Planes;
use crate::vehicle::{Vehicle, Vignetting};

/// A lens, an exposure, and how counts behind them stand for light.
#[derive(Clone, Debug, PartialEq)]
pub struct Even {
    lens: Option<Vignetting>,
    /// Of the pictures, over the one that they are brought to; 1 where they stay as they are.
    exposure: f64,
    lights: Lights,
}

impl Even {
    /// Of a lens before a camera of this encoding.
    pub fn new(lens: Vignetting, encoding: Encoding) -> Self {
        Self {
            lens: Some(lens),
            exposure: 1.0,
            lights: Lights::new(encoding),
        }
    }

    /// Of pictures that were exposed `exposure` (finite, > 0) times as long as those that they are compared with, by a camera of this encoding.
    pub fn of_exposure(exposure: f64, encoding: Encoding) -> Self {
        Self {
            lens: None,
            exposure,
            lights: Lights::new(encoding),
        }
    }

    /// The same lens before pictures that were exposed so many times as long as those that they are compared with.
    pub fn exposed(&self, exposure: f64) -> Self {
        Self {
            exposure,
            ..self.clone()
        }
    }

    /// Of a vehicle's lens, if it has one that takes light.
    pub fn of_vehicle(vehicle: &Vehicle, encoding: Encoding) -> Option<Self> {
        vehicle.vignetting.map(|lens| Self::new(lens, encoding))
    }

    /// Makes a picture even that the camera stored.
    pub fn apply(&self, picture: &mut Counts) {
        let size = [picture.width, picture.height];
        for (i, pixel) in picture.pixels.iter_mut().enumerate() {
            let share = self.share([i % size[0], i / size[0]], size);
            *pixel = pixel.map(|counts| self.counts(counts, share));
        }
        picture.origin = Some(Origin::new(size, |corner, side| PatchOrigin {
            share: self.share([0, 1].map(|k| corner[k] + side[k] / 2), size),
            ..PatchOrigin::STORED
        }));
    }

    /// The same of a picture by channels; unknown pixels stay so.
    pub(crate) fn of_planes(&self, stored: &Planes) -> Planes {
        let size = [stored.width, stored.height];
        let mut channels = [const { Vec::new() }; 3];
        for i in 0..size[0] * size[1] {
            let share = self.share([i % size[0], i / size[0]], size);
            for (from, to) in stored.channels.iter().zip(&mut channels) {
                to.push(self.counts(from[i], share));
            }
        }
        Planes {
            width: size[0],
            height: size[1],
            channels,
        }
    }

    /// 8-bit counts of a pixel that had `counts` where `share` of the light was left; unknown (NaN) where they are.
    pub fn counts(&self, counts: f64, share: f64) -> f64 {
        match counts {
            unknown if unknown.is_nan() => unknown,
            full if full >= FULL => FULL,
            counts => self.lights.counts(self.lights.light(counts) / share),
        }
    }

    /// The share of the light at a pixel of a picture of `size` pixels: the lens' there times the exposure.
    pub fn share(&self, place: [usize; 2], size: [usize; 2]) -> f64 {
        let [place, size] = [place, size].map(|v| v.map(|v| u32::try_from(v).unwrap_or(u32::MAX)));
        let of_lens = |lens: Vignetting| lens.share_at(place.into(), size.into());
        self.exposure * self.lens.map_or(1.0, of_lens)
    }

    /// What a pixel of `even` counts was before, where the lens left `share`; and by how much a small difference about it has grown.
    pub(crate) fn before(&self, even: f64, share: f64) -> (f64, f64) {
        let encoding = self.lights.encoding;
        let light = encoding.light(even.clamp(0.0, FULL));
        (
            encoding.counts(share * light),
            growth(encoding, light, share),
        )
    }
}

/// By how much a small difference of counts about a light has grown where `share` (> 0) of that light was stored.
pub fn growth(encoding: Encoding, light: f64, share: f64) -> f64 {
    encoding.slope(light) / (encoding.slope(share * light) * share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::{NoiseModel, SensorNoise};
    use crate::response::LinearNoise;
    use crate::stats::Measured;
    use uw_media::ResponseCurve;

    fn lens() -> Vignetting {
        Vignetting::new([-0.4, 0.05, -0.1]).expect("a lens")
    }

    fn encodings() -> [Encoding; 3] {
        let curve = ResponseCurve::new(&[[8.0, 0.001], [60.0, 0.05], [255.0, 1.0]]);
        [
            Encoding::Srgb,
            Encoding::Linear,
            Encoding::Curve(curve.expect("a curve")),
        ]
    }

    #[test]
    fn light_is_that_of_the_middle() {
        for encoding in encodings() {
            let even = Even::new(lens(), encoding);
            for counts in [0.0, 0.02, 1.5, 33.3, 128.0, 240.0] {
                for share in [1.0, 0.8, 0.55] {
                    let light = encoding.light(counts) * share;
                    let back = even.counts(encoding.counts(light), share);
                    assert!((back - counts).abs() < 0.02, "{encoding:?} {counts} {back}");
                    let (before, grown) = even.before(counts, share);
                    assert!((before - encoding.counts(light)).abs() < 1e-6);
                    let little = even.counts(before + 0.5, share)
                        - even.counts((before - 0.5).max(0.0), share);
                    if counts > 20.0 {
                        assert!(
                            (little / grown - 1.0).abs() < 0.02,
                            "{encoding:?} {little} {grown}"
                        );
                    }
                }
            }
            assert_eq!(even.counts(255.0, 0.5), 255.0);
            assert_eq!(even.counts(254.0, 0.5), 255.0);
        }
    }

    /// A board of a fine pattern behind the lens, stored in 8 bits with noise.
    fn board(lens: Vignetting, encoding: Encoding, noise: LinearNoise) -> (Vec<u8>, [usize; 2]) {
        let size = [320, 192];
        let even = Even::new(lens, Encoding::Linear);
        let mut state = 7_u64;
        let mut uniform = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            ((state >> 33) as f64 + 0.5) / (1_u64 << 31) as f64
        };
        let mut samples = Vec::new();
        for i in 0..size[0] * size[1] {
            let place = [i % size[0], i / size[0]];
            let texture = 0.3 + 0.1 * ((place[0] / 16 + place[1] / 16) % 2) as f64;
            let share = even.share(place, size);
            for _ in 0..3 {
                let light = texture * share;
                let normal =
                    (-2.0 * uniform().ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos();
                let seen = light + noise.standard_deviation(light) * normal;
                samples.push(encoding.counts(seen).round() as u8);
            }
        }
        (samples, size)
    }

    fn png(samples: &[u8], size: [usize; 2]) -> Vec<u8> {
        let mut bytes = std::io::Cursor::new(Vec::new());
        let picture = image::RgbImage::from_raw(size[0] as u32, size[1] as u32, samples.to_vec());
        let picture = picture.expect("a picture");
        picture
            .write_to(&mut bytes, image::ImageFormat::Png)
            .expect("written");
        bytes.into_inner()
    }

    /// Contrast without noise is that of the camera without vignetting, with the noise known and found in the picture.
    #[test]
    fn contrast_is_that_of_a_lens_that_leaves_all_light() {
        let noise = LinearNoise { a: 4e-4, b: 4e-6 };
        for encoding in encodings() {
            let even = Even::new(lens(), encoding);
            let sensor = SensorNoise::new(encoding, noise).expect("noise");
            let [dark, bright] = [0.3, 0.4].map(|light| encoding.counts(light));
            let (contrast, mean) = (0.5 * (bright - dark), 0.5 * (bright + dark));
            let (seen, size) = board(lens(), encoding, noise);
            for model in [NoiseModel::Sensor(sensor), NoiseModel::Picture] {
                let bytes = png(&seen, size);
                let got = Measured::from_encoded(&bytes, "board", &model, Some(&even));
                let got = got.expect("measured");
                let held = Measured::from_rgb8(size[0], size[1], &seen, &model, Some(&even));
                assert_eq!(held.expect("measured"), got);
                let detail = got.detail.expect("patches are large enough");
                for k in 0..3 {
                    let off = detail.contrast[k] / contrast - 1.0;
                    assert!(
                        off.abs() < 0.01,
                        "{} {:?} {off}",
                        encoding.name(),
                        model.source()
                    );
                    assert!((got.grid.stats.mean[k] - mean).abs() < 0.5);
                }
            }
        }
    }
}
