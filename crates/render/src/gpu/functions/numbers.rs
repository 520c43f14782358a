//! Random numbers, elementary functions, directions and the phase function.

use uw_media::phase::{FournierForand, Phase, PhaseFunction};

use super::{
    BATCH, ROWS, SEED, Within, absolute, adapter, compare, direction_of, probe, relative, scene,
    spread, uniform_rows,
};
use crate::sampling::{Draws, Rng, directions};

#[test]
fn random_bits_are_equal() {
    let Some(gpu) = adapter() else { return };
    let scene = scene();
    let bits = |i: u32| Rng::new(u64::from(i), 0, 0, 0).bits();
    let inputs: Vec<_> = (0..ROWS as u32)
        .map(|i| {
            // As bits: no number that a float cannot hold unchanged.
            let key = [bits(i) >> 9, bits(i + 7) % 4096, i % 3].map(f32::from_bits);
            [key[0], key[1], key[2], 0.0]
        })
        .collect();
    let found = probe(gpu, &scene, 0, &inputs);
    for (input, row) in inputs.iter().zip(found) {
        let [pixel, index, stream] = [input[0], input[1], input[2]].map(f32::to_bits);
        let mut draws = Draws::new(SEED, pixel, BATCH, index, stream);
        let numbers = [
            draws.uniform(),
            draws.uniform(),
            draws.leading(2),
            draws.leading(5),
        ];
        for (number, got) in numbers.iter().zip(row) {
            let expected = (number * 4_294_967_296.0 - 0.5) as u32;
            // A float that is no number may come back as another one.
            if !f32::from_bits(expected).is_nan() {
                assert_eq!(got.to_bits(), expected, "{pixel} {index} {stream}");
            }
        }
    }
}

/// Cubics in f32 with the CPU's coefficients: rounding of four terms, a few 1e-7, more where they nearly cancel.
#[test]
fn phase_function_and_its_inverse_follow_the_tables() {
    let Some(gpu) = adapter() else { return };
    let scene = scene();
    let table = scene
        .medium
        .as_ref()
        .map(|m| m.phase.clone())
        .expect("water");
    let inputs: Vec<_> = uniform_rows(1)
        .iter()
        .map(|r| {
            [
                spread(r[0], 30.0),
                f32::from_bits((r[1] * 2e9) as u32),
                0.0,
                0.0,
            ]
        })
        .collect();
    let within = [relative(1e-5), relative(1e-5), absolute(0.0), absolute(0.0)];
    compare(gpu, &scene, 1, &inputs, within, |r| {
        let u = (f64::from(r[1].to_bits()) + 0.5) / 4_294_967_296.0;
        [table.value(f64::from(r[0])), table.sample_x(u), 0.0, 0.0]
    });
}

/// The table of the inverse CDF that both sides use: |ΔCDF| <= 1e-4, and the angle within 1e-3 above 0.01°.
#[test]
fn inverse_cdf_has_the_stated_error() {
    let Some(gpu) = adapter() else { return };
    let scene = scene();
    let phase = Phase::FournierForand(FournierForand::new(1.10, 0.0183).expect("valid"));
    let inputs: Vec<_> = uniform_rows(2)
        .iter()
        .map(|r| {
            [
                0.5,
                f32::from_bits((spread(r[1], 9.0) * 4.29e9) as u32 & 0x7fff_ffff),
                0.0,
                0.0,
            ]
        })
        .collect();
    let found = probe(gpu, &scene, 1, &inputs);
    for (input, row) in inputs.iter().zip(found) {
        let u = (f64::from(input[1].to_bits()) + 0.5) / 4_294_967_296.0;
        let x = f64::from(row[1]);
        assert!((phase.cdf(x) - u).abs() <= 1e-4, "{u}: {x}");
        let exact = phase.inverse_cdf(u);
        let angle = |x: f64| 2.0 * x.sqrt().asin();
        if angle(exact) > 0.01f64.to_radians() {
            assert!(
                (angle(x) / angle(exact) - 1.0).abs() < 1e-3,
                "{u}: {x} {exact}"
            );
        }
    }
}

/// Series of our own, made for 1e-6; logarithms of the device 1e-6; the angle 3e-6 by its series.
#[test]
fn elementary_functions_are_accurate() {
    let Some(gpu) = adapter() else { return };
    let scene = scene();
    let inputs: Vec<_> = uniform_rows(3)
        .iter()
        .enumerate()
        .map(|(i, r)| {
            let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
            [
                sign * 20.0 * spread(r[0], 8.0),
                sign * 0.999 * spread(r[1], 8.0),
                if i % 3 == 0 {
                    1.0 - spread(r[2], 6.0) * 0.9
                } else {
                    r[2]
                },
                20.0 * r[3] - 10.0,
            ]
        })
        .collect();
    let within = [
        relative(4e-6),
        relative(4e-6),
        Within {
            absolute: 1e-9,
            relative: 4e-6,
        },
        Within {
            absolute: 3e-6,
            relative: 3e-6,
        },
    ];
    compare(gpu, &scene, 2, &inputs, within, |r| {
        let r = r.map(f64::from);
        [r[0].exp_m1(), r[1].ln_1p(), -r[2].ln(), r[3].atan2(r[0])]
    });
}

/// Directions are rounded to 6e-8 at each of a dozen steps; the angle between them, taken from their difference, to 2e-7.
#[test]
fn turned_directions_agree() {
    let Some(gpu) = adapter() else { return };
    let scene = scene();
    let inputs: Vec<_> = uniform_rows(4)
        .iter()
        .map(|r| [r[0], r[1], spread(r[2], 20.0), r[3]])
        .collect();
    let turned = |r: [f32; 4]| {
        let d = direction_of(r[0], r[1]);
        (d, directions::turn(d, f64::from(r[2]), f64::from(r[3])))
    };
    compare(
        gpu,
        &scene,
        3,
        &inputs,
        [
            absolute(2e-6),
            absolute(2e-6),
            absolute(2e-6),
            absolute(1e-6),
        ],
        |r| {
            let (d, t) = turned(r);
            [t.x, t.y, t.z, directions::sin2_half(d, t)]
        },
    );
    let found = probe(gpu, &scene, 3, &inputs);
    for (input, row) in inputs.iter().zip(found) {
        let (d, t) = turned(*input);
        let error = f64::from(row[3]).sqrt() - directions::sin2_half(d, t).sqrt();
        assert!(error.abs() < 4e-7, "{input:?}: half angle off by {error}");
    }
    compare(gpu, &scene, 4, &inputs, [absolute(2e-6); 4], |r| {
        let d = directions::cosine_hemisphere(
            direction_of(r[0], r[1]),
            f64::from(r[2]),
            f64::from(r[3]),
        );
        [d.x, d.y, d.z, 0.0]
    });
}
