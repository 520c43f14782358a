//! How daylight falls with depth where no picture looks up: the diffuse attenuation K_d of pictures of the target.
//!
//! Some metres below the surface all light from above falls like e^(-K_d z), whatever way it goes, so with the lamps off the
//! target and the water before it get darker together. K_d is not K_z, which is the mean of a picture that looks up,
//! as the camera stores it, the clipped disk of the sun included.

/// Least range of depths of a fit, m.
pub(crate) const LEAST_RANGE_M: f64 = 1.0;

/// Light of a picture of the target with the lamps off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Dark {
    pub(crate) depth_m: f64,
    pub(crate) distance_m: f64,
    /// Mean in linear light per channel, [0, 1].
    pub(crate) light: [f64; 3],
}

/// K_d per channel of pictures of one target with one exposure, 1/m, and its standard errors (0 of an exact fit). Pictures
/// of one distance share one brightness at the surface, which may differ from distance to distance.
///
/// # Errors
/// The pictures are too few, one is black, or light does not fall with depth.
pub(crate) fn fit(pictures: &[Dark]) -> Result<([f64; 3], [f64; 3]), String> {
    let mut sorted = pictures.to_vec();
    sorted.sort_by(|x, y| x.distance_m.total_cmp(&y.distance_m));
    let (mut k_d, mut errors) = ([0.0; 3], [0.0; 3]);
    for k in 0..3 {
        // Depth and logarithm of light, less their means over the pictures of the same distance.
        let mut points = Vec::new();
        let mut distances = 0;
        for group in sorted.chunk_by(|x, y| x.distance_m == y.distance_m) {
            if let Some(black) = group.iter().find(|p| !(p.light[k] > 0.0)) {
                return Err(format!(
                    "the picture at {} m depth is black in channel {}",
                    black.depth_m,
                    ['R', 'G', 'B'][k]
                ));
            }
            let n = group.len() as f64;
            let depth = group.iter().map(|p| p.depth_m).sum::<f64>() / n;
            let light = group.iter().map(|p| p.light[k].ln()).sum::<f64>() / n;
            points.extend(
                group
                    .iter()
                    .map(|p| (p.depth_m - depth, p.light[k].ln() - light)),
            );
            distances += 1;
        }
        let squares: f64 = points.iter().map(|p| p.0 * p.0).sum();
        let least = 0.5 * LEAST_RANGE_M * LEAST_RANGE_M;
        if squares < least {
            return Err(format!(
                "no distance has pictures from depths at least {LEAST_RANGE_M} m apart"
            ));
        }
        let slope = points.iter().map(|p| p.0 * p.1).sum::<f64>() / squares;
        let left: f64 = points.iter().map(|p| (p.1 - slope * p.0).powi(2)).sum();
        let freedom = points.len().saturating_sub(distances + 1);
        errors[k] = match freedom {
            0 => 0.0,
            n => (left / n as f64 / squares).sqrt(),
        };
        if slope > 2.0 * errors[k] {
            return Err(format!(
                "channel {} gets brighter with depth, by {slope:.3} ± {:.3} per m in logarithm; was the exposure the same for all?",
                ['R', 'G', 'B'][k],
                errors[k]
            ));
        }
        k_d[k] = (-slope).max(0.0);
    }
    Ok((k_d, errors))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dark(depth_m: f64, distance_m: f64, light: f64) -> Dark {
        Dark {
            depth_m,
            distance_m,
            light: [light; 3],
        }
    }

    #[test]
    fn the_fit_finds_the_attenuation_whatever_the_distances() {
        let at = |z: f64, d: f64| dark(z, d, 0.3 / d * (-0.15 * z).exp());
        let pictures = [
            at(1.0, 1.0),
            at(3.0, 1.0),
            at(6.0, 1.0),
            at(2.0, 2.5),
            at(4.0, 2.5),
            at(9.0, 0.5),
        ];
        let (k_d, errors) = fit(&pictures).unwrap();
        assert!(
            (k_d[0] - 0.15).abs() < 1e-12 && errors[0] < 1e-12,
            "{k_d:?}"
        );
    }

    #[test]
    fn pictures_that_say_nothing_of_depth_are_refused() {
        let cases = [
            (
                vec![dark(1.0, 1.0, 0.1), dark(5.0, 2.0, 0.1)],
                "at least 1 m apart",
            ),
            (vec![dark(1.0, 1.0, 0.1), dark(5.0, 1.0, 0.2)], "exposure"),
            (vec![dark(1.0, 1.0, 0.1), dark(5.0, 1.0, 0.0)], "black"),
        ];
        for (pictures, expected) in cases {
            let error = fit(&pictures).unwrap_err();
            assert!(error.contains(expected), "{error}");
        }
    }
}
