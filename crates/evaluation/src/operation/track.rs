//! The way along the target, and where its places lie in the pictures.

use super::config::OperationConfig;
use super::seed_of;
use crate::vision::matching::Homography;

/// Separates the errors of places from other uses of the same numbers.
const TRACK_ERROR: u64 = 4;

/// A place on the track of one repetition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Index of the leg.
    pub leg: usize,
    /// Station on the leg.
    pub station: usize,
}

/// The places of a repetition in the order of a lawnmower: legs from the shallowest, to and fro. Repetitions start at
/// different stations, and every second one goes the other way.
pub fn places(config: &OperationConfig, repetition: usize) -> Vec<Place> {
    let spare = config.stations - config.views_per_leg;
    let first = repetition % (spare + 1);
    let mut places = Vec::with_capacity(config.depths_m.len() * config.views_per_leg);
    for leg in 0..config.depths_m.len() {
        let stations = first..first + config.views_per_leg;
        let forth = (leg + repetition).is_multiple_of(2);
        let mut on_leg: Vec<Place> = stations.map(|station| Place { leg, station }).collect();
        if !forth {
            on_leg.reverse();
        }
        places.extend(on_leg);
    }
    places
}

/// Position of a station along the leg at a depth, m; the leg's middle is at 0. It is off its nominal place by up to
/// the track error, as a vehicle's would be: views at exact multiples of a step would repeat the pixel grid's phase from
/// some distances, whose features would match better than they ever do.
pub fn along_m(config: &OperationConfig, depth_m: f64, station: usize) -> f64 {
    let nominal_m = config.step_m * (station as f64 - 0.5 * (config.stations - 1) as f64);
    let depth_mm = (1000.0 * depth_m).round() as u64;
    let bits = seed_of(&[config.seed, TRACK_ERROR, depth_mm, station as u64]) >> 11;
    // 53 random bits to [-1, 1).
    let part = 2.0 * (bits as f64 / (1_u64 << 53) as f64) - 1.0;
    nominal_m + config.track_error_m * part
}

/// Sideways position of the leg at a depth over a bottom, m, downwards in the picture; the lanes' middle is at 0. Other
/// depths, such as the calibration's, lie there too.
pub fn lane_m(config: &OperationConfig, depth_m: f64) -> f64 {
    let leg = config.depths_m.iter().position(|&d| d == depth_m);
    let middle = 0.5 * (config.depths_m.len() - 1) as f64;
    config.lane_m * leg.map_or(0.0, |leg| leg as f64 - middle)
}

/// Width and height of what the camera sees of the target from a distance, m.
pub fn footprint_m(config: &OperationConfig, distance_m: f64) -> [f64; 2] {
    let width = 2.0 * distance_m * (0.5 * config.vehicle.hfov_deg.to_radians()).tan();
    let pixel = width / f64::from(config.vehicle.width);
    [width, pixel * f64::from(config.vehicle.height)]
}

/// Where the second of two views of one leg shows what the first one shows; each is (position along the leg, distance)
/// in metres. Pixels are counted from the centre of the upper left one.
pub fn true_homography(
    config: &OperationConfig,
    (along_1_m, distance_1_m): (f64, f64),
    (along_2_m, distance_2_m): (f64, f64),
) -> Homography {
    let (width, height) = (
        f64::from(config.vehicle.width),
        f64::from(config.vehicle.height),
    );
    let focal_px = 0.5 * width / (0.5 * config.vehicle.hfov_deg.to_radians()).tan();
    let (cx, cy) = (0.5 * width - 0.5, 0.5 * height - 0.5);
    let scale = distance_1_m / distance_2_m;
    let shift_px = focal_px * (along_1_m - along_2_m) / distance_2_m;
    [
        [scale, 0.0, cx * (1.0 - scale) + shift_px],
        [0.0, scale, cy * (1.0 - scale)],
        [0.0, 0.0, 1.0],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lawnmower_goes_to_and_fro() {
        let config = OperationConfig {
            depths_m: vec![1.0, 2.0],
            stations: 4,
            views_per_leg: 3,
            ..OperationConfig::default()
        };
        let stations = |repetition| -> Vec<(usize, usize)> {
            let places = places(&config, repetition);
            places.iter().map(|p| (p.leg, p.station)).collect()
        };
        assert_eq!(
            stations(0),
            [(0, 0), (0, 1), (0, 2), (1, 2), (1, 1), (1, 0)]
        );
        assert_eq!(
            stations(1),
            [(0, 3), (0, 2), (0, 1), (1, 1), (1, 2), (1, 3)]
        );
        let exact = OperationConfig {
            track_error_m: 0.0,
            ..config.clone()
        };
        assert_eq!(along_m(&exact, 1.0, 0), -0.75);
        assert_eq!(along_m(&exact, 1.0, 3), 0.75);
        let errors_m = [(1.0, 0), (2.0, 0), (1.0, 3)]
            .map(|(z, s)| along_m(&config, z, s) - along_m(&exact, z, s));
        assert!(
            errors_m
                .iter()
                .all(|e| e.abs() <= config.track_error_m && *e != 0.0)
        );
        assert!(errors_m[0] != errors_m[1] && errors_m[0] != errors_m[2]);
    }

    #[test]
    fn lanes_lie_beside_each_other_around_the_middle() {
        let config = OperationConfig {
            depths_m: vec![1.0, 2.0, 4.0],
            lane_m: 1.5,
            ..OperationConfig::default()
        };
        assert_eq!(
            [1.0, 2.0, 4.0, 3.3].map(|z| lane_m(&config, z)),
            [-1.5, 0.0, 1.5, 0.0]
        );
    }

    #[test]
    fn the_homography_follows_points_of_the_target() {
        let config = OperationConfig::default();
        let pixel = |point_m: f64, along_m: f64, distance_m: f64| {
            120.0 / 30f64.to_radians().tan() * (point_m - along_m) / distance_m + 119.5
        };
        let h = true_homography(&config, (0.5, 1.0), (1.0, 2.0));
        for point_m in [0.3, 0.9, 1.4] {
            let [x, y] = crate::vision::matching::transfer(&h, [pixel(point_m, 0.5, 1.0), 67.0]);
            assert!((x - pixel(point_m, 1.0, 2.0)).abs() < 1e-9);
            assert!((y - 67.0).abs() < 1e-9);
        }
    }
}
