//! Several ranges of one surface, combined to the distance along the optical axis.
//!
//! A Doppler log or a sonar head measures along beams that are tilted against the optical axis. A plane is
//! fitted through the points where they end, z = d + s_x·x + s_y·y in the camera frame: d is the distance
//! along the axis, and the plane's normal makes the obliqueness atan(hypot(s_x, s_y)) with the axis.

use uw_calib::json::FieldError;

/// Most beams of one measurement.
pub const MAX_BEAMS: usize = 32;
/// Beams needed for a plane.
const PLANE_BEAMS: usize = 3;
/// A plane whose points miss it by more than this share of the distance is no plane.
const MAX_MISFIT: f64 = 0.15;
/// Steepest surface that counts as measured, degrees.
const MAX_OBLIQUENESS_DEG: f64 = 75.0;
/// Smallest pivot of the normal equations, relative to the number of beams: below, the directions do not
/// span a plane.
const MIN_PIVOT: f64 = 1e-6;

/// Directions of the beams in the camera frame (+z forward, +x right, +y down).
#[derive(Clone, Debug, PartialEq)]
pub struct BeamGeometry {
    /// Angle of every beam against the optical axis, degrees, in [0, 80].
    pub tilt_deg: f64,
    /// Azimuth of each beam around the axis, from +x towards +y, degrees.
    pub azimuths_deg: Vec<f64>,
}

impl Default for BeamGeometry {
    /// Four beams at 22.5° (Janus configuration), as the Water Linked A50 and A125 have.
    fn default() -> Self {
        Self {
            tilt_deg: 22.5,
            azimuths_deg: vec![45.0, 135.0, 225.0, 315.0],
        }
    }
}

impl BeamGeometry {
    /// Refuses angles that no instrument has.
    pub fn check(&self) -> Result<(), FieldError> {
        if !(0.0..=80.0).contains(&self.tilt_deg) {
            let expected = "from 0 to 80 degrees";
            return Err(FieldError::out_of_range(
                "tilt_deg",
                expected,
                self.tilt_deg,
            ));
        }
        let count = self.azimuths_deg.len();
        if !(1..=MAX_BEAMS).contains(&count) {
            let expected = format!("a list of 1 to {MAX_BEAMS} angles");
            return Err(FieldError::out_of_range("azimuths_deg", expected, count));
        }
        match self.azimuths_deg.iter().position(|a| !a.is_finite()) {
            None => Ok(()),
            Some(k) => {
                let field = format!("azimuths_deg[{k}]");
                Err(FieldError::out_of_range(
                    field,
                    "finite",
                    self.azimuths_deg[k],
                ))
            }
        }
    }

    /// Where a beam of the given length ends, m.
    fn end_m(&self, beam: usize, range_m: f64) -> [f64; 3] {
        let (tilt, azimuth) = (
            self.tilt_deg.to_radians(),
            self.azimuths_deg[beam].to_radians(),
        );
        [
            range_m * tilt.sin() * azimuth.cos(),
            range_m * tilt.sin() * azimuth.sin(),
            range_m * tilt.cos(),
        ]
    }
}

/// The surface as the beams see it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Distance along the optical axis, m, > 0.
    pub distance_m: f64,
    /// Angle between the surface's normal and the optical axis, degrees; `None` with fewer than three beams.
    pub obliqueness_deg: Option<f64>,
    /// Root mean square distance of the beams' ends from the plane along the axis, m; `None` unless there
    /// are more than three beams.
    pub residual_m: Option<f64>,
    /// Beams used.
    pub beams: usize,
}

/// Why beams give no distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BeamError {
    /// The list is not as long as the geometry has beams.
    Count {
        /// Beams of the geometry.
        expected: usize,
        /// Ranges given.
        got: usize,
    },
    /// No beam has a range.
    NoBeam,
    /// One beam alone has a range where there are several: a fish, a cable or an old echo is not told from the target.
    Alone {
        /// Beams of the geometry.
        of: usize,
    },
    /// The ends of the beams lie on no plane, or on one seen too obliquely.
    Disagree {
        /// Root mean square misfit, m.
        residual_m: f64,
        /// Distance found, m.
        distance_m: f64,
    },
}

impl std::fmt::Display for BeamError {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Self::Count { expected, got } => write!(
                f,
                "distances_m must be a list of {expected} (one for each beam), got {got}"
            ),
            Self::Alone { of } => write!(
                f,
                "distances_m must hold at least two ranges that agree, got one of {of} beams alone"
            ),
            Self::NoBeam => f.write_str("distances_m must hold at least one range, got only null"),
            Self::Disagree {
                residual_m,
                distance_m,
            } => write!(
                f,
                "the beams lie on no plane that can be used: they miss it by {residual_m:.3} m at {distance_m:.3} m"
            ),
        }
    }
}

/// Combines the ranges along the beams, m; `None` for a beam without an echo.
///
/// Beams that determine no plane, such as two of four, give the mean of their distances along the axis and no
/// obliqueness, if they agree. One beam alone counts only where the geometry has one beam.
pub fn combine(ranges_m: &[Option<f64>], geometry: &BeamGeometry) -> Result<Plane, BeamError> {
    let expected = geometry.azimuths_deg.len();
    if ranges_m.len() != expected {
        let got = ranges_m.len();
        return Err(BeamError::Count { expected, got });
    }
    let ends: Vec<[f64; 3]> = ranges_m
        .iter()
        .enumerate()
        .filter_map(|(beam, range)| range.map(|range_m| geometry.end_m(beam, range_m)))
        .collect();
    if ends.is_empty() {
        return Err(BeamError::NoBeam);
    }
    if ends.len() == 1 && expected > 1 {
        return Err(BeamError::Alone { of: expected });
    }
    match fit(&ends) {
        Some(plane) => plane,
        None => mean(&ends),
    }
}

/// The mean of distances along the axis that agree.
fn mean(ends: &[[f64; 3]]) -> Result<Plane, BeamError> {
    let count = ends.len() as f64;
    let distance_m = ends.iter().map(|end| end[2]).sum::<f64>() / count;
    if agree(ends.iter().map(|end| end[2])) {
        return Ok(Plane {
            distance_m,
            obliqueness_deg: None,
            residual_m: None,
            beams: ends.len(),
        });
    }
    let squares = ends.iter().map(|end| (end[2] - distance_m).powi(2));
    Err(BeamError::Disagree {
        residual_m: (squares.sum::<f64>() / count).sqrt(),
        distance_m,
    })
}

/// Whether all lie within 15 % of their mean.
pub fn agree(distances_m: impl Iterator<Item = f64> + Clone) -> bool {
    let (sum, count) = distances_m
        .clone()
        .fold((0.0, 0.0), |(sum, count), d| (sum + d, count + 1.0));
    let mean_m = sum / count;
    distances_m
        .into_iter()
        .all(|d| (d - mean_m).abs() <= MAX_MISFIT * mean_m)
}

/// Least squares over z = d + s_x·x + s_y·y; `None` where the ends do not determine a plane.
fn fit(ends: &[[f64; 3]]) -> Option<Result<Plane, BeamError>> {
    if ends.len() < PLANE_BEAMS {
        return None;
    }
    // In units of the mean distance, so that the pivots can be judged.
    let unit_m = ends.iter().map(|end| end[2]).sum::<f64>() / ends.len() as f64;
    let mut system = [[0.0; 4]; 3];
    for end in ends {
        let row = [1.0, end[0] / unit_m, end[1] / unit_m];
        for i in 0..3 {
            for j in 0..3 {
                system[i][j] += row[i] * row[j];
            }
            system[i][3] += row[i] * end[2] / unit_m;
        }
    }
    let [d, s_x, s_y] = solve(system, MIN_PIVOT * ends.len() as f64)?;
    let distance_m = d * unit_m;
    let misfit = |end: &[f64; 3]| (end[2] - distance_m - s_x * end[0] - s_y * end[1]).powi(2);
    let residual_m = (ends.iter().map(misfit).sum::<f64>() / ends.len() as f64).sqrt();
    let obliqueness_deg = s_x.hypot(s_y).atan().to_degrees();
    let usable = distance_m > 0.0
        && residual_m <= MAX_MISFIT * distance_m
        && obliqueness_deg <= MAX_OBLIQUENESS_DEG;
    Some(if usable {
        Ok(Plane {
            distance_m,
            obliqueness_deg: Some(obliqueness_deg),
            residual_m: (ends.len() > PLANE_BEAMS).then_some(residual_m),
            beams: ends.len(),
        })
    } else {
        Err(BeamError::Disagree {
            residual_m,
            distance_m,
        })
    })
}

/// Gaussian elimination of three equations; `None` when a pivot is not larger than `min_pivot`.
fn solve(mut system: [[f64; 4]; 3], min_pivot: f64) -> Option<[f64; 3]> {
    for column in 0..3 {
        let largest = (column..3)
            .max_by(|&i, &j| system[i][column].abs().total_cmp(&system[j][column].abs()))?;
        system.swap(column, largest);
        let pivot = system[column];
        if !(pivot[column].abs() > min_pivot) {
            return None;
        }
        for row in system.iter_mut().skip(column + 1) {
            let factor = row[column] / pivot[column];
            for k in column..4 {
                row[k] -= factor * pivot[k];
            }
        }
    }
    let mut x = [0.0; 3];
    for i in (0..3).rev() {
        let known: f64 = (i + 1..3).map(|k| system[i][k] * x[k]).sum();
        x[i] = (system[i][3] - known) / system[i][i];
    }
    Some(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ranges at which the beams meet the plane z = d + s_x·x + s_y·y.
    fn ranges(geometry: &BeamGeometry, d: f64, s_x: f64, s_y: f64) -> Vec<Option<f64>> {
        (0..geometry.azimuths_deg.len())
            .map(|beam| {
                let [x, y, z] = geometry.end_m(beam, 1.0);
                Some(d / (z - s_x * x - s_y * y))
            })
            .collect()
    }

    #[test]
    fn a_plane_seen_obliquely_is_found() {
        let geometry = BeamGeometry::default();
        for (d, s_x, s_y) in [(1.0, 0.0, 0.0), (1.7, 0.4, -0.2), (0.6, -0.9, 0.3)] {
            let obliqueness = f64::hypot(s_x, s_y).atan().to_degrees();
            let mut all = ranges(&geometry, d, s_x, s_y);
            let plane = combine(&all, &geometry).unwrap();
            assert!((plane.distance_m - d).abs() < 1e-12, "{plane:?}");
            assert!((plane.obliqueness_deg.unwrap() - obliqueness).abs() < 1e-9);
            assert!(plane.residual_m.unwrap() < 1e-12);
            all[2] = None;
            let plane = combine(&all, &geometry).unwrap();
            assert!(
                (plane.distance_m - d).abs() < 1e-12,
                "three beams: {plane:?}"
            );
            assert_eq!((plane.beams, plane.residual_m), (3, None));
        }
    }

    #[test]
    fn few_beams_give_a_distance_without_an_angle() {
        let geometry = BeamGeometry::default();
        let mut all = ranges(&geometry, 1.2, 0.0, 0.0);
        (all[1], all[3]) = (None, None);
        let plane = combine(&all, &geometry).unwrap();
        assert!((plane.distance_m - 1.2).abs() < 1e-12, "{plane:?}");
        assert_eq!((plane.obliqueness_deg, plane.beams), (None, 2));
    }

    #[test]
    fn one_beam_alone_counts_only_where_there_is_one() {
        let geometry = BeamGeometry::default();
        for ranges in [
            [Some(1.0), None, None, None],
            [None, None, None, Some(0.42)],
        ] {
            let error = combine(&ranges, &geometry).unwrap_err();
            assert_eq!(error, BeamError::Alone { of: 4 });
        }
        // Two that are far from each other are two different things.
        let apart = combine(&[Some(0.5), None, Some(1.0), None], &geometry);
        assert!(
            matches!(apart, Err(BeamError::Disagree { .. })),
            "{apart:?}"
        );
        let echo_sounder = BeamGeometry {
            tilt_deg: 0.0,
            azimuths_deg: vec![0.0],
        };
        let plane = combine(&[Some(1.2)], &echo_sounder).unwrap();
        assert_eq!((plane.distance_m, plane.beams), (1.2, 1));
    }

    #[test]
    fn beams_on_one_line_determine_no_plane() {
        let geometry = BeamGeometry {
            tilt_deg: 20.0,
            azimuths_deg: vec![0.0, 180.0, 0.0],
        };
        let plane = combine(&ranges(&geometry, 1.0, 0.0, 0.0), &geometry).unwrap();
        assert_eq!(plane.obliqueness_deg, None);
        assert!((plane.distance_m - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_beam_that_sees_something_else_is_told() {
        let geometry = BeamGeometry::default();
        let mut all = ranges(&geometry, 1.0, 0.0, 0.0);
        all[0] = Some(4.0);
        let error = combine(&all, &geometry).unwrap_err();
        assert!(matches!(error, BeamError::Disagree { .. }), "{error:?}");
    }

    #[test]
    fn lists_of_another_length_and_empty_ones_are_refused() {
        let geometry = BeamGeometry::default();
        assert_eq!(combine(&[None; 4], &geometry), Err(BeamError::NoBeam));
        let error = combine(&[Some(1.0)], &geometry).unwrap_err();
        assert_eq!(
            error.to_string(),
            "distances_m must be a list of 4 (one for each beam), got 1"
        );
    }
}
