//! What the sensor makes of a linear signal on average: mean and variance of the stored count.

use uw_calib::response::{self, LinearNoise};
use uw_render::scene::Sensor;

/// Mean and variance of the 8-bit count that the sensor of a scene stores for a linear signal; the closed form is
/// [`uw_calib::response`].
#[derive(Clone, Debug)]
pub struct CountResponse(response::CountResponse);

impl CountResponse {
    /// The response of `sensor`, whose exposure does not enter; counts are taken as 8-bit ones.
    pub fn new(sensor: &Sensor) -> Self {
        let noise = sensor
            .noise
            .map_or(LinearNoise::default(), |n| LinearNoise { a: n.a, b: n.b });
        Self(response::CountResponse::new(sensor.encoding, noise))
    }

    /// Mean and variance of the count at `signal`; what is below 0 counts as 0.
    #[inline]
    pub fn at(&self, signal: f32) -> (f32, f32) {
        self.0.at(signal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use uw_render::image::Picture;
    use uw_render::scene::{Encoding, Exposure, Noise};

    /// Exposes even pictures and compares mean and variance of their counts, in the dark, in the middle and at
    /// the clipping point.
    #[test]
    fn moments_are_those_of_exposed_pictures() {
        for noise in [
            None,
            Some(Noise { a: 2e-4, b: 1e-6 }),
            Some(Noise { a: 1e-2, b: 1e-3 }),
        ] {
            let sensor = Sensor {
                exposure: Exposure::Fixed(1.0),
                encoding: Encoding::Srgb,
                bits: 8,
                noise,
                ..Sensor::default()
            };
            let response = CountResponse::new(&sensor);
            for level in [0.0_f32, 5e-4, 0.004, 0.21, 0.6, 0.985, 1.02] {
                let picture = Picture {
                    data: vec![[level; 3]; 200 * 200],
                    ..Picture::black(200, 200)
                };
                let counts = sensor.expose(&picture, 9).in_8_bit_counts();
                let n = (3 * counts.len()) as f64;
                let all = || counts.iter().flatten();
                let mean = all().sum::<f64>() / n;
                let variance = all().map(|c| (c - mean).powi(2)).sum::<f64>() / n;
                let fourth = all().map(|c| (c - mean).powi(4)).sum::<f64>() / n;
                let (m, v) = response.at(level);
                // 4.5 standard errors, and the table's interpolation.
                let error = 4.5 * (variance / n).sqrt() + 2e-3;
                assert!(
                    (f64::from(m) - mean).abs() < error,
                    "{noise:?} {level}: {m} {mean}"
                );
                let error = 4.5 * ((fourth - variance * variance).max(0.0) / n).sqrt() + 2e-3;
                assert!(
                    (f64::from(v) - variance).abs() < error,
                    "{noise:?} {level}: {v} {variance}"
                );
            }
        }
    }
}
