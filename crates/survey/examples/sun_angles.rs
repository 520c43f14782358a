//! What another sun does to contrast: zenith and azimuth against the one that guidance was trained with.
//!
//! `cargo run --release -p uw-survey --example sun_angles` prints the table of docs/limits.md.

#![allow(clippy::print_stdout, reason = "that is what it is for")]

use std::error::Error;
use std::sync::atomic::AtomicBool;

use glam::DVec3;
use uw_assets::assets_dir;
use uw_calib::vehicle::Vehicle;
use uw_scenery::textures::Pattern;
use uw_twin::environment::{Target, View, WaterBody, scene, sensor};
use uw_twin::estimate::pyramid::TexturePyramid;
use uw_twin::estimate::response::CountResponse;
use uw_twin::estimate::target_image::TargetImage;

/// An upright target and one on the bottom.
const TARGETS: [Pattern; 2] = [Pattern::ConcretePier, Pattern::Seabed];
const WATERS: [(&str, f64); 2] = [("IB", 0.0075), ("3C", 0.0183)];
/// Zenith and azimuth, degrees; light that travels the way the camera looks has azimuth 0.
const SUNS_DEG: [[f64; 2]; 7] = [
    [30.0, 0.0],
    [0.0, 0.0],
    [60.0, 0.0],
    [30.0, 90.0],
    [60.0, 90.0],
    [30.0, 180.0],
    [60.0, 180.0],
];
const LEVELS_PCT: [f64; 2] = [0.0, 60.0];
const DEPTH_M: f64 = 3.0;
const DISTANCE_M: f64 = 1.5;

fn main() -> Result<(), Box<dyn Error>> {
    let vehicle = Vehicle {
        width: 640,
        height: 360,
        ..Vehicle::default()
    };
    let counts = CountResponse::new(&sensor(&vehicle, vehicle.exposure));
    println!("contrast, green, 8-bit counts, {DISTANCE_M} m away, {DEPTH_M} m deep");
    for (water, backscatter_fraction) in WATERS {
        let body = WaterBody {
            jerlov: water.parse()?,
            backscatter_fraction,
        };
        for pattern in TARGETS {
            let target = Target::read(pattern, &assets_dir()?)?;
            let pyramid = TexturePyramid::new(&target.texture, f64::from(pattern.tile_m()));
            let view = View::Target {
                depth_m: DEPTH_M,
                distance_m: DISTANCE_M,
            };
            let mut rows = LEVELS_PCT
                .map(|level| format!("{water:3} {:14} lamps {level:2} %", pattern.name()));
            for [zenith, azimuth] in SUNS_DEG.map(|sun| sun.map(f64::to_radians)) {
                let mut scene = scene(&vehicle, &body, &target, view)?;
                let towards = zenith.sin() * DVec3::new(azimuth.cos(), azimuth.sin(), 0.0);
                if let Some(sun) = &mut scene.sun {
                    sun.travel_direction = towards - zenith.cos() * DVec3::Z;
                }
                let image =
                    TargetImage::render(&scene, &pyramid, 7, 4096, &AtomicBool::new(false))?;
                let image = image.ok_or("stopped")?;
                for (row, level) in rows.iter_mut().zip(LEVELS_PCT) {
                    let found = image.statistics(&counts, vehicle.exposure, level);
                    *row += &format!(" {:6.2}", found.contrast[1]);
                }
            }
            rows.iter().for_each(|row| println!("{row}"));
        }
    }
    println!("zenith, azimuth: {SUNS_DEG:?}");
    Ok(())
}
