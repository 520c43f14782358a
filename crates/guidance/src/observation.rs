//! What the vehicle knows at the moment it asks.

use uw_calib::json::FieldError;

/// Distance, depth, lamp level and the statistics of the current image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Depth below the surface, m, finite and >= 0.
    pub depth_m: f64,
    /// Distance to the target along the optical axis, m, finite and > 0.
    pub distance_m: f64,
    /// Lamp level, percent of full intensity, in [0, 100].
    pub light_pct: f64,
    /// Mean of the image per channel, 8-bit counts, in [0, 255].
    pub mean: [f64; 3],
    /// Contrast of the image per channel (mean over patches of the standard deviation, as in
    /// [`uw_calib::stats`]), 8-bit counts, in [0, 255].
    pub std: [f64; 3],
}

impl Observation {
    /// Refuses values that no vehicle and no image can have. Whether they are calibrated is another question.
    pub fn check(&self) -> Result<(), FieldError> {
        let depth_ok = self.depth_m.is_finite() && self.depth_m >= 0.0;
        let distance_ok = self.distance_m.is_finite() && self.distance_m > 0.0;
        let light_ok = (0.0..=100.0).contains(&self.light_pct);
        if !depth_ok {
            return Err(FieldError::out_of_range(
                "depth_m",
                "finite and >= 0 m",
                self.depth_m,
            ));
        }
        if !distance_ok {
            return Err(FieldError::out_of_range(
                "distance_m",
                "finite and > 0 m",
                self.distance_m,
            ));
        }
        if !light_ok {
            return Err(FieldError::out_of_range(
                "light_pct",
                "from 0 to 100 percent",
                self.light_pct,
            ));
        }
        for (name, values) in [("mean", self.mean), ("std", self.std)] {
            if let Some(k) = values.iter().position(|v| !(0.0..=255.0).contains(v)) {
                let field = format!("{name}[{k}]");
                return Err(FieldError::out_of_range(
                    field,
                    "from 0 to 255 8-bit counts",
                    values[k],
                ));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: Observation = Observation {
        depth_m: 3.0,
        distance_m: 1.0,
        light_pct: 20.0,
        mean: [41.0, 88.0, 79.0],
        std: [4.1, 7.7, 6.2],
    };

    #[test]
    fn impossible_values_are_named() {
        assert_eq!(GOOD.check(), Ok(()));
        let cases = [
            (
                Observation {
                    depth_m: f64::NAN,
                    ..GOOD
                },
                "depth_m",
            ),
            (
                Observation {
                    distance_m: 0.0,
                    ..GOOD
                },
                "distance_m",
            ),
            (
                Observation {
                    light_pct: 100.1,
                    ..GOOD
                },
                "light_pct",
            ),
            (
                Observation {
                    mean: [0.0, 255.5, 0.0],
                    ..GOOD
                },
                "mean[1]",
            ),
            (
                Observation {
                    std: [0.0, 1.0, f64::NAN],
                    ..GOOD
                },
                "std[2]",
            ),
        ];
        for (observation, field) in cases {
            assert_eq!(observation.check().unwrap_err().field, field);
        }
    }
}
