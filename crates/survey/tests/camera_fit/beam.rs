//! Beams found from pictures of a board.

use std::f64::consts::PI;

use uw_calib::Encoding;
use uw_calib::vehicle::{Vehicle, Vignetting};
use uw_render::image::{Frame, Picture};
use uw_survey::camera_fit::beam::{BeamError, Board, fit};
use uw_twin::environment::sensor;

use crate::draw::Draw;

const SIZE: (u32, u32) = (240, 160);

/// A white board in the light of one lamp of `axis` W/sr whose intensity falls with a power of the cosine.
fn frame(board: &Board, vehicle: &Vehicle, (axis, power): (f64, f64), seed: u64) -> Frame {
    let mut picture = Picture::black(SIZE.0, SIZE.1);
    let focal = 0.5 * f64::from(SIZE.0) / (0.5 * board.hfov_deg.to_radians()).tan();
    for (i, pixel) in picture.data.iter_mut().enumerate() {
        let place = (i as u32 % SIZE.0, i as u32 / SIZE.0);
        let right = (f64::from(place.0) + 0.5 - 0.5 * f64::from(SIZE.0)) / focal * board.distance_m;
        let down = (f64::from(place.1) + 0.5 - 0.5 * f64::from(SIZE.1)) / focal * board.distance_m;
        let distance = (right - board.lamp_right_m)
            .hypot(down)
            .hypot(board.distance_m);
        let cosine = board.distance_m / distance;
        let irradiance = axis * cosine.powf(power) * cosine / (distance * distance);
        let lens = vehicle
            .vignetting
            .map_or(1.0, |lens| lens.share_at(place, SIZE));
        *pixel = [(board.reflectance * irradiance / PI * lens) as f32; 3];
    }
    sensor(vehicle, vehicle.exposure * board.relative_exposure).expose(&picture, seed)
}

#[test]
fn hidden_beams_are_found() {
    let mut draw = Draw(5);
    for seed in 0..12 {
        let vehicle = Vehicle {
            encoding: [Encoding::Srgb, Encoding::Linear][seed as usize % 2],
            vignetting: Vignetting::new([draw.between(-0.5, 0.0), 0.0, 0.0]).ok(),
            ..Vehicle::default()
        };
        let (axis, power) = (draw.between(0.2, 3.0), draw.between(1.0, 6.0));
        let distance_m = draw.between(0.6, 1.5);
        let board = Board {
            distance_m,
            reflectance: draw.between(0.5, 0.95),
            lamp_right_m: draw.between(-0.3, 0.3),
            hfov_deg: draw.between(60.0, 85.0),
            // Two thirds of full scale.
            relative_exposure: 0.67 * PI * distance_m * distance_m
                / (0.95 * axis * vehicle.exposure),
        };
        let frame = frame(&board, &vehicle, (axis, power), seed);
        let found = fit(&[frame], &board, &vehicle).expect("a fit");
        // The mean within 4 degrees of the axis is below the axis by power/2 times the mean square of the angle.
        let dip = 0.5 * power * 0.5 * 4_f64.to_radians().powi(2);
        let off = found.intensity_w_per_sr / axis - 1.0;
        assert!((off + dip).abs() < 4e-3, "{off} {dip}");
        for [angle, relative] in &found.profile[1..] {
            let hidden = angle.to_radians().cos().powf(power);
            // Counts round to 0.4 % of light; linear ones where little light is left to as much of the axis.
            assert!(
                (relative - hidden).abs() < 0.015,
                "{angle}: {relative} {hidden}"
            );
        }
        let half = 0.5_f64.powf(1.0 / power).acos().to_degrees();
        match found.half_deg {
            Some(got) => assert!((got - half).abs() < 0.7, "{got} {half}"),
            None => assert!(found.profile.last().is_some_and(|row| row[0] < half + 1.0)),
        }
    }
}

#[test]
fn what_is_no_beam_is_refused() {
    let vehicle = Vehicle::default();
    let board = Board {
        distance_m: 0.8,
        reflectance: 0.9,
        lamp_right_m: 0.3,
        hfov_deg: 80.0,
        relative_exposure: 0.2,
    };
    let seen = frame(&board, &vehicle, (0.8, 5.0), 1);
    let other_side = Board {
        lamp_right_m: -0.3,
        ..board
    };
    let told = fit(std::slice::from_ref(&seen), &other_side, &vehicle).expect_err("the other side");
    assert!(matches!(told, BeamError::Spread { .. }), "{told}");
    let told = fit(
        std::slice::from_ref(&seen),
        &Board {
            lamp_right_m: 5.0,
            ..board
        },
        &vehicle,
    );
    assert_eq!(told, Err(BeamError::NoAxis));
    let told = fit(
        &[seen],
        &Board {
            distance_m: 0.0,
            ..board
        },
        &vehicle,
    )
    .expect_err("no distance");
    assert_eq!(
        told.to_string(),
        "--distance-m must be in [0.05, 100] m, got 0"
    );
    let bright = frame(
        &Board {
            relative_exposure: 2.0,
            ..board
        },
        &vehicle,
        (0.8, 5.0),
        1,
    );
    let told = fit(&[bright], &board, &vehicle).expect_err("full scale");
    assert!(
        matches!(told, BeamError::Clipped { picture: 1, .. }),
        "{told}"
    );
}
