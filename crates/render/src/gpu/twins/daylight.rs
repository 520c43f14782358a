//! Daylight: the field that steers walks, sunlight scattered once on a segment, flights.

use std::sync::LazyLock;

use glam::DVec3;

use super::{
    DAYLIGHT, ROWS, absolute, adapter, compare, direction_of, draws_of, in_box, probe, relative,
    scene_with, spread, three_numbers, uniform_rows,
};
use crate::{
    integrator::{
        cpu::{
            ambient_flight::{draw_within, draw_within_water},
            ambient_path::Walk,
            ambient_window::{light_ahead, light_on_surface},
            camera_ray::End,
            spectral::Spectral,
            sun_line::{Attenuation, Line, scattered_sunlight},
        },
        sampling::directions,
    },
    prepare::{DaylightField, Medium, Prepared, Primitive, SurfacePoint},
};

/// The field's exponentials are exact here and rough to 1e-3 on the CPU, because they only steer.
const ROUGH: f64 = 2e-3;

static SUNLIT: LazyLock<Prepared> = LazyLock::new(|| {
    scene_with(
        "emission = [0.1, 0.0, 0.2]\n[sun]\nzenith_deg = 35.0\nazimuth_deg = 60.0\nirradiance = [1.0, 1.1, 1.2]\n\
         [sky]\nradiance = [0.1, 0.15, 0.2]\n",
    )
});

fn field() -> &'static DaylightField {
    SUNLIT.daylight.as_ref().expect("daylight")
}

fn water() -> &'static Medium {
    SUNLIT.medium.as_ref().expect("water")
}

/// A point of the box below the surface.
fn below_surface(numbers: [f32; 3]) -> DVec3 {
    let [x, y, z] = numbers.map(f64::from);
    in_box(&SUNLIT, [x, y, 0.52 * z])
}

fn walk_at(origin: DVec3, direction: DVec3) -> Walk {
    Walk {
        origin,
        direction,
        from: Primitive::None,
        in_air: false,
        scattered: false,
        met_surface: false,
        leading: false,
        events: 0,
        spectral: Spectral::start(&water().by_attenuation, 0.4),
    }
}

fn with_zero([a, b, c]: [f64; 3]) -> [f64; 4] {
    [a, b, c, 0.0]
}

#[test]
fn the_field_of_daylight_is_read_alike() {
    let Some(gpu) = adapter() else { return };
    let inputs = uniform_rows(20);
    let within = [relative(ROUGH); 4];
    compare(gpu, &SUNLIT, DAYLIGHT, 0, &inputs, within, |r| {
        let (depth, line) = (20.0 * f64::from(r[0]), 0.01 * f64::from(r[3]));
        with_zero(field().scattered(depth, direction_of(r[1], r[2]), [line; 3]))
    });
    compare(gpu, &SUNLIT, DAYLIGHT, 1, &inputs, within, |r| {
        let up = f64::from(r[1]);
        let planes = field().diffuse_irradiance(20.0 * f64::from(r[0]));
        with_zero(planes.map(|(down, upward)| up * down + (1.0 - up) * upward))
    });
}

/// From the nearest node: between two of them either may be taken.
#[test]
fn shares_around_the_sun_agree() {
    let Some(gpu) = adapter() else { return };
    let inputs = uniform_rows(21);
    let found = probe(gpu, &SUNLIT, DAYLIGHT, 2, &inputs);
    let different = inputs.iter().zip(found).filter(|(r, found)| {
        let share = field().sun_share(20.0 * f64::from(r[0]), direction_of(r[1], r[2]));
        (0..3).any(|k| (f64::from(found[k]) - share[k]).abs() > 1e-6)
    });
    assert!(different.count() < 4);
}

/// Exponents of up to 8 in f32; close to a rate of nothing a series of three terms takes over.
#[test]
fn attenuation_of_sunlight_agrees() {
    let Some(gpu) = adapter() else { return };
    let inputs = uniform_rows(22);
    let within = [relative(2e-5), absolute(1e-5), absolute(0.0), absolute(0.0)];
    compare(gpu, &SUNLIT, DAYLIGHT, 3, &inputs, within, |r| {
        let r = r.map(f64::from);
        let length = 3.0 * r[2];
        let rate = 4.0 * r[1] - 1.5;
        let attenuation = Attenuation {
            start: 3.0 * r[0] + (-rate).max(0.0) * length,
            rate,
        };
        [
            attenuation.integral(length),
            attenuation.sample(length, r[3]),
            0.0,
            0.0,
        ]
    });
}

/// Where a shadow may fall, the drawn point may lie on either side of its edge, and the choice of a channel may differ.
#[test]
fn sunlight_scattered_once_agrees() {
    let Some(gpu) = adapter() else { return };
    let inputs = uniform_rows(23);
    let found = probe(gpu, &SUNLIT, DAYLIGHT, 4, &inputs);
    let (mut different, mut dark) = (0, 0);
    for (row, (input, found)) in (0..).zip(inputs.iter().zip(found)) {
        let mut draws = draws_of(row);
        let u = three_numbers(&mut draws);
        let line = Line {
            origin: below_surface([input[0], input[1], input[2]]),
            direction: direction_of(0.49 * u[0], u[1]),
            length: 2.0 * f64::from(input[3]),
        };
        let light = scattered_sunlight(&SUNLIT, water(), &line, &mut draws);
        dark += usize::from(light[1] == 0.0);
        let off = |k: usize| (f64::from(found[k]) - light[k]).abs() > 2e-4 * light[k];
        different += usize::from((0..3).any(off));
    }
    assert!(dark > ROWS / 50, "{dark}");
    assert!(different < ROWS / 200, "{different} of {ROWS}");
}

#[test]
fn light_ahead_of_a_walk_agrees() {
    let Some(gpu) = adapter() else { return };
    let inputs = uniform_rows(24);
    let found = probe(gpu, &SUNLIT, DAYLIGHT, 5, &inputs);
    let close = |input: &[f32; 4], found: &[f32; 4], light: [f64; 3]| {
        for k in 0..3 {
            let error = (f64::from(found[k]) - light[k]).abs();
            assert!(error < ROUGH * light[k], "{input:?}: {found:?} {light:?}");
        }
    };
    for (row, (input, found)) in (0..).zip(inputs.iter().zip(found)) {
        let u = three_numbers(&mut draws_of(row));
        let point = surface_point(direction_of(u[0], u[1]));
        let origin = below_surface([input[0], input[1], input[2]]);
        let walk = walk_at(origin, DVec3::new(0.6, 0.0, -0.8));
        let light = light_on_surface(&SUNLIT, &walk, 2.0 * f64::from(input[3]), &point);
        close(input, &found, light);
    }
    let found = probe(gpu, &SUNLIT, DAYLIGHT, 6, &inputs);
    for (input, found) in inputs.iter().zip(found) {
        let origin = below_surface([input[0], input[1], input[2]]);
        let walk = walk_at(origin, direction_of(0.9 * f64::from(input[1]), input[0]));
        let point = surface_point(DVec3::Z);
        let end = End::Surface(2.0 * f64::from(input[3]), point, Primitive::None);
        close(input, &found, light_ahead(&SUNLIT, &walk, &end, [0.01; 3]));
    }
}

fn surface_point(normal: DVec3) -> SurfacePoint {
    SurfacePoint {
        normal,
        shading_normal: normal,
        reflectance: [0.3, 0.5, 0.7],
        emission: [0.1, 0.0, 0.2],
    }
}

/// Distances within 1e-5 of the distribution's range; weights are exponentials of up to 5. Where the number lies between
/// two outcomes either may be taken.
#[test]
fn flights_of_daylight_agree() {
    let Some(gpu) = adapter() else { return };
    let strategies = &water().by_attenuation;
    let inputs = uniform_rows(25);
    let found = probe(gpu, &SUNLIT, DAYLIGHT, 7, &inputs);
    let mut different = 0;
    for (input, found) in inputs.iter().zip(found) {
        let r = input.map(f64::from);
        let direction = DVec3::new((1.0 - r[1] * r[1]).sqrt(), 0.0, r[1]);
        let mut walk = walk_at(SUNLIT.camera.position_m, direction);
        let length = 3.0 * r[2];
        let t = if input[0] > 0.7 {
            draw_within_water(&SUNLIT, strategies, &End::Nothing, r[3], &mut walk).distance()
        } else if input[0] > 0.3 {
            let end = End::Boundary(length);
            draw_within_water(&SUNLIT, strategies, &end, r[3], &mut walk).distance()
        } else {
            Some(draw_within(&SUNLIT, strategies, length, r[3], &mut walk))
        };
        let t = t.expect("finite");
        let weight = walk.spectral.weight();
        let off = |k: usize| (f64::from(found[k + 1]) - weight[k]).abs() > 2e-4 * weight[k] + 1e-7;
        different += usize::from((f64::from(found[0]) - t).abs() > 3e-5 || (0..3).any(off));
    }
    assert!(different < 8, "{different} of {ROWS}");
}

/// The angle from the sun is carried as a difference: half of it is good to 1e-6 of the angles turned by, however small.
#[test]
fn angles_from_the_sun_keep_their_digits() {
    let Some(gpu) = adapter() else { return };
    let sun = SUNLIT.sun.as_ref().expect("sun").towards;
    let inputs: Vec<_> = uniform_rows(26)
        .iter()
        .map(|r| [spread(r[0], 12.0), r[1], spread(r[2], 12.0), r[3]])
        .collect();
    let found = probe(gpu, &SUNLIT, DAYLIGHT, 8, &inputs);
    for (input, found) in inputs.iter().zip(found) {
        let r = input.map(f64::from);
        let around = directions::turn(sun, r[0], r[1]);
        let further = directions::turn(around, r[2], r[3]);
        let half = |x: f64| x.sqrt();
        let ratio = f64::from(found[0]) / r[0];
        assert!((ratio - 1.0).abs() < 1e-5, "{input:?}: {}", found[0]);
        let expected = half(directions::sin2_half(further, sun));
        let error = (half(f64::from(found[1])) - expected).abs();
        // f64 directions themselves lose the angle below 1e-8.
        let allowed = 4e-6 * (half(r[0]) + half(r[2])) + 1e-8;
        assert!(
            error < allowed,
            "{input:?}: {} {expected}",
            half(f64::from(found[1]))
        );
    }
}
