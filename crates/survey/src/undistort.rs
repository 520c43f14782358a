//! Pictures of a camera with a lens and a port as the ideal camera of a vehicle would have taken them.

use glam::{DVec2, DVec3};
use uw_calib::{Resampling, Undistortion};
use uw_render::scene::Camera;

use uw_calib::vehicle::Vehicle;
use uw_twin::estimate::water_tables::spaced_distances_m;

/// Distance of what is far away, m: a port moves rays by centimetres.
const FAR_M: f64 = 100.0;
/// Directions that differ by less than this (its sine) are one: where a lens folds, a point is seen in another's place.
const SAME_DIRECTION: f64 = 1e-4;

/// Distances of the target for which the way through a port is kept where those of the pictures are not known, m.
pub fn port_distances_m() -> Vec<f64> {
    spaced_distances_m(0.3, 6.0, 9)
}

/// The way from pictures of `camera` to those of the vehicle's ideal one: same centre of projection, same axis, the vehicle's size and horizontal
/// field of view. With a port that is another one at each of `distances_m`.
pub fn undistortion(camera: &Camera, vehicle: &Vehicle, distances_m: &[f64]) -> Undistortion {
    let at = |distance_m: f64| {
        let size = [vehicle.width, vehicle.height];
        Resampling::new([camera.width, camera.height], size, |x, y| {
            seen(camera, ahead(camera, vehicle, [x, y]), distance_m).map(|at| at.to_array())
        })
    };
    let near = match camera.port {
        Some(_) => distances_m.iter().map(|&d| (d, at(d))).collect(),
        None => Vec::new(),
    };
    Undistortion::new(vehicle.hfov_deg, at(FAR_M), near)
}

/// Where the ideal camera looks at (x, y), pixels; 1 along the axis.
fn ahead(camera: &Camera, vehicle: &Vehicle, [x, y]: [f64; 2]) -> DVec3 {
    let half = [vehicle.width, vehicle.height].map(|side| 0.5 * f64::from(side));
    let per_pixel = (0.5 * vehicle.hfov_deg.to_radians()).tan() / half[0];
    let [across, down] = [x - half[0], y - half[1]].map(|off| off * per_pixel);
    camera.forward + across * camera.right + down * camera.down
}

/// Where the camera sees a point at a distance along its axis, pixels.
fn seen(camera: &Camera, ahead: DVec3, distance_m: f64) -> Option<DVec2> {
    let point = camera.position_m + distance_m * ahead;
    let at = camera.project(point)?;
    let ray = camera.ray(at.x, at.y);
    let towards = (point - ray.origin_m).normalize();
    (towards.cross(ray.direction).length() < SAME_DIRECTION && towards.dot(ray.direction) > 0.0)
        .then_some(at)
}

#[cfg(test)]
mod tests {
    use super::*;
    use uw_render::scene::Scene;

    fn camera(folder: &std::path::Path, fields: &str) -> Camera {
        let file = folder.join("camera.toml");
        let text = format!(
            "format = \"uw-scene/1\"\n[water]\njerlov = \"IB\"\nbands = \"mean\"\n[camera]\nposition_m = [0.0, 0.0, 0.0]\nforward = [1.0, 0.0, 0.0]\n\
             width = 640\nheight = 360\n{fields}\n"
        );
        std::fs::write(&file, text).expect("written");
        Scene::read(&file).expect("a scene").camera
    }

    fn vehicle(hfov_deg: f64) -> Vehicle {
        Vehicle {
            width: 320,
            height: 180,
            hfov_deg,
            ..Vehicle::default()
        }
    }

    #[test]
    fn points_are_where_the_camera_sees_them() {
        let folder = tempfile::tempdir().expect("a folder");
        for fields in [
            "hfov_deg = 60.0",
            "hfov_deg = 80.0\ndistortion = [-0.2, 0.03, 0.001, -0.002, 0.0]",
            "hfov_deg = 120.0\nfisheye = [0.01, -0.003, 0.0, 0.0]",
            "hfov_deg = 80.0\nport = { kind = \"flat\", distance_m = 0.03, thickness_m = 0.01 }",
        ] {
            let camera = camera(folder.path(), fields);
            let vehicle = vehicle(50.0);
            let way = undistortion(&camera, &vehicle, &[0.5, 2.0]);
            for (x, y) in [(160.0, 90.0), (30.0, 20.0), (311.0, 100.0), (1.0, 179.0)] {
                for distance_m in [0.5, 2.0] {
                    let point = distance_m * ahead(&camera, &vehicle, [x, y]);
                    let right = camera.project(camera.position_m + point).expect("seen");
                    let map = way.near(distance_m);
                    let [px, py] = map.at(x, y).expect("seen");
                    assert!(
                        right.distance(DVec2::new(px, py)) < 0.02,
                        "{fields} {right} {px} {py}"
                    );
                }
            }
        }
        // Of the ideal camera with the same field of view it is its own place, scaled.
        let same = undistortion(
            &camera(folder.path(), "hfov_deg = 60.0"),
            &vehicle(60.0),
            &[],
        );
        let [x, y] = same.far().at(100.0, 50.0).expect("seen");
        assert!((x - 200.0).abs() < 1e-6 && (y - 100.0).abs() < 1e-6);
        assert_eq!(same.far().seen(), 1.0);
        // A wider one is not seen all over.
        let wider = undistortion(
            &camera(folder.path(), "hfov_deg = 40.0"),
            &vehicle(60.0),
            &[],
        );
        assert!(wider.far().seen() < 0.5, "{}", wider.far().seen());
    }
}
