//! Vignetting found from pictures of boards.

use uw_calib::Encoding;
use uw_calib::vehicle::Vignetting;
use uw_render::image::{Frame, Picture};
use uw_render::scene::{Exposure, Noise, Sensor};
use uw_survey::camera_fit::even::even;
use uw_survey::camera_fit::vignetting::{VignettingError, fit};

use crate::draw::Draw;

const SIZE: (u32, u32) = (192, 108);

/// A board behind a lens; `board` is its light by the place, -1 to 1 along rows and columns.
fn frame(lens: Vignetting, seed: u64, board: impl Fn(f64, f64) -> f64) -> Frame {
    let mut picture = Picture::black(SIZE.0, SIZE.1);
    for (i, pixel) in picture.data.iter_mut().enumerate() {
        let (column, row) = (i as u32 % SIZE.0, i as u32 / SIZE.0);
        let along = |place: u32, size: u32| (2.0 * f64::from(place) + 1.0) / f64::from(size) - 1.0;
        let light = board(along(column, SIZE.0), along(row, SIZE.1));
        *pixel = [(light * lens.share_at((column, row), SIZE)) as f32; 3];
    }
    let sensor = Sensor {
        exposure: Exposure::Fixed(1.0),
        encoding: Encoding::Srgb,
        noise: Some(Noise { a: 4e-4, b: 2e-6 }),
        ..Sensor::default()
    };
    sensor.expose(&picture, seed)
}

fn lens(draw: &mut Draw) -> Vignetting {
    let k = [
        draw.between(-0.5, 0.05),
        draw.between(-0.1, 0.1),
        draw.between(-0.1, 0.1),
    ];
    Vignetting::new(k).expect("a lens")
}

/// The corner's light lies within the errors told: over 30 lenses the deviation in units of them has a root mean square near 1
/// (which scatters by 0.13), and none is above 4.5.
#[test]
fn hidden_lenses_are_found() {
    let mut draw = Draw(3);
    let (mut squares, mut widest) = (0.0, 0.0_f64);
    for seed in 0..30 {
        let hidden = lens(&mut draw);
        let slopes = [draw.between(-0.1, 0.1), draw.between(-0.1, 0.1)];
        let frame = frame(hidden, seed, |x, y| {
            0.5 * (1.0 + slopes[0] * x + slopes[1] * y)
        });
        let found = fit(&[frame], Encoding::Srgb).expect("a fit");
        let off = (found.vignetting.share(1.0) - hidden.share(1.0)) / found.corner_error;
        squares += off * off;
        widest = widest.max(found.corner_error);
        assert!(off.abs() < 4.5, "{hidden:?}: {found:?}");
        for (got, sure) in found.slope.iter().zip(slopes) {
            // A slope behind a lens is no slope of the picture; the rest is in the fit's own terms.
            assert!(
                (got - sure).abs() < 0.06,
                "{hidden:?} {slopes:?}: {found:?}"
            );
        }
    }
    let rms = (squares / 30.0).sqrt();
    assert!((0.5..1.6).contains(&rms), "{rms}");
    assert!(widest < 0.01, "{widest}");
}

/// What a lens took, `even` brings back within the rounding to counts.
#[test]
fn even_pictures_are_even() {
    let mut draw = Draw(4);
    let hidden = lens(&mut draw);
    let board = frame(hidden, 1, |_, _| 0.5);
    let found = fit(std::slice::from_ref(&board), Encoding::Srgb).expect("a fit");
    let even = even(found.vignetting, &board, Encoding::Srgb);
    let left = fit(&[even], Encoding::Srgb).expect("a fit").vignetting;
    assert!(hidden.share(1.0) < 0.9, "{hidden:?}");
    assert!((left.share(1.0) - 1.0).abs() < 5e-3, "{left:?}");
}

#[test]
fn boards_that_are_none_are_refused() {
    let flat = Vignetting::new([0.0; 3]).expect("no lens");
    let checks = frame(flat, 1, |x, y| {
        0.5 + 0.1 * (9.0 * x).sin().signum() * (9.0 * y).sin().signum()
    });
    let told = fit(&[checks], Encoding::Srgb).expect_err("a pattern");
    assert!(matches!(told, VignettingError::Uneven { .. }), "{told}");
    let bright = frame(flat, 1, |x, _| 1.0 + 0.2 * x);
    let told = fit(&[bright], Encoding::Srgb).expect_err("full scale");
    assert!(
        told.to_string()
            .contains("of picture 1 are black or at full scale"),
        "{told}"
    );
    assert_eq!(fit(&[], Encoding::Srgb), Err(VignettingError::None));
}
