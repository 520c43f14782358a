//! Daylight in plane-parallel water against reference rows and discrete ordinates: irradiances and radiances of the
//! problems of Mobley et al. 1993 (Applied Optics 32, 7484): sun at 60°, flat surface, black sky, infinite depth.
//! Both everywhere.

use uw_media::phase::{FournierForand, Phase, Rayleigh};
use uw_render::prepare::Prepared;
use uw_tests::corpus_scene;
use uw_tests::discrete_ordinates::{Irradiances, Problem, Travel, irradiances, radiances};
use uw_tests::reference::{IrradianceRow, rayleigh_irradiances, rayleigh_radiances};
use uw_tests::single_ray::{camera_against, empty, sun, surface, water};

use crate::agreement::{View, assert_sensors_agree, assert_views_agree, compare};

const DEPTHS_M: [f64; 4] = [0.0, 1.0, 5.0, 10.0];
/// Optical depth is depth: c is 1 1/m in every channel.
const A: [f64; 3] = [0.8, 0.5, 0.1];
pub(crate) const B: [f64; 3] = [0.2, 0.5, 0.9];
/// Gauss nodes of the discrete ordinates per panel; 64 change nothing above 1.5e-4.
const NODES: usize = 48;
/// Directions per depth and hemisphere on the vector units.
const SAMPLES: u32 = 1 << 19;
/// Samples of each of 64 pixels that look along one direction, on the vector units.
const SAMPLES_PER_PIXEL: u32 = 1024;

fn albedo(channel: usize) -> String {
    format!("albedo {}", B[channel])
}

/// All depths and quantities of all channels of a scene against discrete ordinates.
fn against_discrete_ordinates(name: &str, seed: u64) {
    let scene = corpus_scene(name);
    let phase = &scene.water.as_ref().expect("water").phase;
    let solved: [Vec<Irradiances>; 3] =
        B.map(|albedo| irradiances(&Problem::benchmark(phase, albedo), &DEPTHS_M, NODES));
    assert_sensors_agree(name, &scene, &DEPTHS_M, (SAMPLES, seed), |measured| {
        let of_channel = |(channel, solved): (usize, &Vec<Irradiances>)| {
            compare(measured, channel, &albedo(channel), |level, name| {
                Some(solved[level].quantity(name))
            })
        };
        solved.iter().enumerate().flat_map(of_channel).collect()
    });
}

#[test]
fn irradiances_in_molecular_water_are_the_reference_rows() {
    let (name, rows) = ("rt_rayleigh", rayleigh_irradiances());
    let scene = corpus_scene(name);
    assert_sensors_agree(name, &scene, &DEPTHS_M, (SAMPLES, 1), |measured| {
        let of_channel = |channel: usize| {
            compare(measured, channel, &albedo(channel), |level, name| {
                let is_this = |row: &&IrradianceRow| {
                    row.albedo == B[channel]
                        && row.optical_depth == DEPTHS_M[level]
                        && row.quantity == name
                };
                rows.iter().find(is_this).map(|row| row.reference)
            })
        };
        let comparisons: Vec<_> = [0, 2].into_iter().flat_map(of_channel).collect();
        assert_eq!(comparisons.len(), rows.len());
        comparisons
    });
}

#[test]
fn irradiances_in_petzolds_water_are_those_of_discrete_ordinates() {
    against_discrete_ordinates("rt_petzold", 2);
}

#[test]
fn irradiances_in_fournier_forand_water_are_those_of_discrete_ordinates() {
    against_discrete_ordinates("rt_fournier_forand", 4);
}

/// What a row of pixels under the sun of the problems sees of light that travels so, in the channel of the largest albedo.
fn view(phase: &Phase, at: (f64, Travel), reference: f64, seed: u64) -> View {
    let mut scene = empty(camera_against(at.0, at.1, 64));
    scene.water = Some(water(A, B, phase.clone()));
    scene.surface = Some(surface(true));
    scene.sun = Some(sun(60.0, [1.0; 3]));
    View {
        scene: Prepared::build(&scene),
        at,
        reference,
        seed,
    }
}

#[test]
fn radiances_in_molecular_water_are_the_reference_rows() {
    let phase = Phase::Rayleigh(Rayleigh::new(0.0).expect("valid"));
    let rows = rayleigh_radiances();
    let views = rows.iter().zip(10..).map(|(row, seed)| {
        let at = (row.optical_depth, row.travel());
        view(&phase, at, row.reference, seed)
    });
    assert_views_agree(&views.collect::<Vec<_>>(), 2, SAMPLES_PER_PIXEL);
}

/// Away from the sun's direction, where nodes would have to resolve the peak.
#[test]
fn radiances_in_fournier_forand_water_are_those_of_discrete_ordinates() {
    let phase = Phase::FournierForand(FournierForand::new(1.10, 0.0183).expect("valid"));
    let depths_m = [1.0, 5.0];
    let directions = [
        (1.0, 0.0),
        (0.8, 90.0),
        (0.8, 180.0),
        (0.1, 90.0),
        (-0.2, 0.0),
        (-0.2, 180.0),
        (-0.6, 90.0),
        (-1.0, 0.0),
    ]
    .map(|(down, azimuth_deg)| Travel { down, azimuth_deg });
    // 32 nodes change nothing above 5e-4 in these directions.
    let problem = Problem::benchmark(&phase, B[2]);
    let solved = radiances(&problem, &depths_m, &directions, 24);
    let mut views = Vec::new();
    for (&depth_m, level) in depths_m.iter().zip(&solved) {
        for (&travel, &reference) in directions.iter().zip(level) {
            let seed = 40 + views.len() as u64;
            views.push(view(&phase, (depth_m, travel), reference, seed));
        }
    }
    assert_views_agree(&views, 2, SAMPLES_PER_PIXEL);
}
