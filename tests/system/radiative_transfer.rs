//! Daylight in plane-parallel water against reference rows and discrete ordinates: irradiances and radiances of the
//! problems of Mobley et al. 1993 (Applied Optics 32, 7484): sun at 60°, flat surface, black sky, infinite depth.
//! Both everywhere.

use uw_media::phase::{FournierForand, Phase, Rayleigh};
use uw_render::irradiance::{DepthIrradiance, IrradiancePlan};
use uw_render::scene::Scene;
use uw_tests::discrete_ordinates::{Irradiances, Problem, Travel, irradiances, radiances};
use uw_tests::reference::{rayleigh_irradiances, rayleigh_radiances};
use uw_tests::single_ray::{camera_against, empty, sun, surface, water};
use uw_tests::{
    corpus_scene,
    gpu::{Backend, everywhere},
    measure,
};

use crate::agreement::{Comparison, assert_agreement, compare, compare_radiance};

const DEPTHS_M: [f64; 4] = [0.0, 1.0, 5.0, 10.0];
/// Optical depth is depth: c is 1 1/m in every channel.
const A: [f64; 3] = [0.8, 0.5, 0.1];
pub(crate) const B: [f64; 3] = [0.2, 0.5, 0.9];
/// Gauss nodes of the discrete ordinates per panel; 64 change nothing above 1.5e-4.
const NODES: usize = 48;
/// Directions per depth and hemisphere.
const SAMPLES: u32 = 1 << 19;
/// Samples of each of 64 pixels that look along one direction.
const SAMPLES_PER_PIXEL: u32 = 1024;

fn sensors(backend: Backend, scene: &Scene, samples: u32, seed: u64) -> Vec<DepthIrradiance> {
    let plan = IrradiancePlan {
        depths_m: DEPTHS_M.to_vec(),
        samples: backend.samples(samples),
        seed,
        threads: None,
        max_bounces: 0,
    };
    backend.irradiances(scene, &plan).expect("valid")
}

fn albedo(channel: usize) -> String {
    format!("albedo {}", B[channel])
}

/// All depths and quantities of all channels of a scene against discrete ordinates.
fn against_discrete_ordinates(name: &str, samples: u32, seed: u64) {
    let scene = corpus_scene(name);
    let phase = &scene.water.as_ref().expect("water").phase;
    let solved: [Vec<Irradiances>; 3] =
        B.map(|albedo| irradiances(&Problem::benchmark(phase, albedo), &DEPTHS_M, NODES));
    everywhere(|backend| {
        let measured = sensors(backend, &scene, samples, seed);
        let mut comparisons = Vec::new();
        for (channel, solved) in solved.iter().enumerate() {
            comparisons.extend(compare(
                &measured,
                channel,
                &albedo(channel),
                |level, name| Some(solved[level].quantity(name)),
            ));
        }
        // Depths times hemispheres (and the single direction); quantities and channels share directions.
        assert_agreement(&comparisons, 3 * DEPTHS_M.len());
    });
}

#[test]
fn irradiances_in_molecular_water_are_the_reference_rows() {
    everywhere(|backend| {
        let measured = sensors(backend, &corpus_scene("rt_rayleigh"), SAMPLES, 1);
        let rows = rayleigh_irradiances();
        let mut comparisons = Vec::new();
        for channel in [0, 2] {
            comparisons.extend(compare(
                &measured,
                channel,
                &albedo(channel),
                |level, name| {
                    let is_this = |row: &&uw_tests::reference::IrradianceRow| {
                        row.albedo == B[channel]
                            && row.optical_depth == DEPTHS_M[level]
                            && row.quantity == name
                    };
                    rows.iter().find(is_this).map(|row| row.reference)
                },
            ));
        }
        assert_eq!(comparisons.len(), rows.len());
        assert_agreement(&comparisons, 3 * DEPTHS_M.len());
    });
}

#[test]
fn irradiances_in_petzolds_water_are_those_of_discrete_ordinates() {
    against_discrete_ordinates("rt_petzold", SAMPLES, 2);
}

#[test]
fn irradiances_in_fournier_forand_water_are_those_of_discrete_ordinates() {
    against_discrete_ordinates("rt_fournier_forand", SAMPLES, 4);
}

/// What a row of pixels under the sun of the problems sees of light that travels so, in the channel of the largest albedo.
fn compared(
    backend: Backend,
    phase: Phase,
    depth_m: f64,
    travel: Travel,
    reference: f64,
    seed: u64,
) -> Comparison {
    let mut scene = empty(camera_against(depth_m, travel, 64));
    scene.water = Some(water(A, B, phase));
    scene.surface = Some(surface(true));
    scene.sun = Some(sun(60.0, [1.0; 3]));
    let seen = measure(backend, &scene, SAMPLES_PER_PIXEL, 0, seed);
    compare_radiance(seen, 2, (depth_m, travel), reference)
}

#[test]
fn radiances_in_molecular_water_are_the_reference_rows() {
    let phase = || Phase::Rayleigh(Rayleigh::new(0.0).expect("valid"));
    let rows = rayleigh_radiances();
    everywhere(|backend| {
        let comparisons: Vec<Comparison> = rows
            .iter()
            .zip(10..)
            .map(|(row, seed)| {
                let (depth_m, travel) = (row.optical_depth, row.travel());
                compared(backend, phase(), depth_m, travel, row.reference, seed)
            })
            .collect();
        assert_agreement(&comparisons, comparisons.len());
    });
}

/// Away from the sun's direction, where nodes would have to resolve the peak.
#[test]
fn radiances_in_fournier_forand_water_are_those_of_discrete_ordinates() {
    let phase = || Phase::FournierForand(FournierForand::new(1.10, 0.0183).expect("valid"));
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
    let problem_phase = phase();
    let problem = Problem::benchmark(&problem_phase, B[2]);
    let solved = radiances(&problem, &depths_m, &directions, 24);
    everywhere(|backend| {
        let mut comparisons = Vec::new();
        for (&depth_m, level) in depths_m.iter().zip(&solved) {
            for (&travel, &reference) in directions.iter().zip(level) {
                let seed = 40 + comparisons.len() as u64;
                let compared = compared(backend, phase(), depth_m, travel, reference, seed);
                comparisons.push(compared);
            }
        }
        assert_agreement(&comparisons, comparisons.len());
    });
}
