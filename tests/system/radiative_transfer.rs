//! Daylight in plane-parallel water against reference rows and discrete ordinates: irradiances and radiances of the
//! problems of Mobley et al. 1993 (Applied Optics 32, 7484): sun at 60°, flat surface, black sky, infinite depth.
//! Both everywhere.

use glam::DVec3;
use uw_media::phase::{FournierForand, Phase, Rayleigh};
use uw_render::irradiance::{DepthIrradiance, IrradiancePlan};
use uw_render::scene::{Scene, Sun};
use uw_tests::discrete_ordinates::{Irradiances, Problem, Travel, irradiances, radiances};
use uw_tests::reference::{rayleigh_irradiances, rayleigh_radiances};
use uw_tests::single_ray::{camera, empty, surface, water};
use uw_tests::tiles::spread;
use uw_tests::{
    corpus_scene,
    gpu::{Backend, everywhere},
    measure,
};

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
/// Departures from the reference that are let pass besides the standard errors.
pub(crate) const IRRADIANCE_MARGIN: f64 = 0.002;
const RADIANCE_MARGIN: f64 = 0.01;

/// An estimate beside what it should be.
pub(crate) struct Comparison {
    pub(crate) what: String,
    pub(crate) value: f64,
    pub(crate) standard_error: f64,
    pub(crate) reference: f64,
    pub(crate) margin: f64,
}

impl Comparison {
    fn z(&self) -> f64 {
        (self.value - self.reference) / self.standard_error
    }

    fn relative_error(&self) -> f64 {
        self.standard_error / self.reference
    }
}

/// Every estimate within three standard errors and its margin, and the set of deviations no wider than standard errors
/// say. `independent` is the number of values that share no random numbers.
pub(crate) fn assert_agreement(comparisons: &[Comparison], independent: usize) {
    for c in comparisons {
        println!(
            "{}: {:.6e} ± {:.3} %, reference {:.6e}, off by {:+.3} %, z {:+.2}",
            c.what,
            c.value,
            100.0 * c.relative_error(),
            c.reference,
            100.0 * (c.value / c.reference - 1.0),
            c.z()
        );
    }
    let z: Vec<f64> = comparisons.iter().map(Comparison::z).collect();
    let (rms, largest) = spread(&z);
    let widest = comparisons
        .iter()
        .map(Comparison::relative_error)
        .fold(0.0, f64::max);
    println!(
        "{} values: rms z {rms:.2}, largest {largest:.2}, widest error {:.2} %",
        z.len(),
        100.0 * widest
    );
    for c in comparisons {
        let allowed = 3.0 * c.standard_error + c.margin * c.reference;
        assert!(
            (c.value - c.reference).abs() < allowed,
            "{}: {} ± {}, {}",
            c.what,
            c.value,
            c.standard_error,
            c.reference
        );
    }
    // Spread of an rms of this many values: 1/sqrt(2n).
    assert!(
        rms < 1.0 + 4.0 / (2.0 * independent as f64).sqrt(),
        "rms z {rms}"
    );
}

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

/// Measured quantities of one channel beside references by depth and name.
fn compare(
    measured: &[DepthIrradiance],
    channel: usize,
    reference: impl Fn(usize, &str) -> Option<f64>,
) -> Vec<Comparison> {
    let mut comparisons = Vec::new();
    for (level, row) in measured.iter().enumerate() {
        for (name, estimate) in row.quantities() {
            let Some(reference) = reference(level, name) else {
                continue;
            };
            comparisons.push(Comparison {
                what: format!("{name} at {} m, albedo {}", row.depth_m, B[channel]),
                value: estimate.value[channel],
                standard_error: estimate.standard_error[channel],
                reference,
                margin: if name == "L_u" {
                    RADIANCE_MARGIN
                } else {
                    IRRADIANCE_MARGIN
                },
            });
        }
    }
    comparisons
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
            comparisons.extend(compare(&measured, channel, |level, name| {
                Some(solved[level].quantity(name))
            }));
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
            comparisons.extend(compare(&measured, channel, |level, name| {
                let is_this = |row: &&uw_tests::reference::IrradianceRow| {
                    row.albedo == B[channel]
                        && row.optical_depth == DEPTHS_M[level]
                        && row.quantity == name
                };
                rows.iter().find(is_this).map(|row| row.reference)
            }));
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

/// Water and sun of the problems, seen by a row of equal pixels against light that travels so.
fn looking(phase: Phase, depth_m: f64, travel: Travel) -> Scene {
    let (sin, cos) = travel.azimuth_deg.to_radians().sin_cos();
    let horizontal = (1.0 - travel.down * travel.down).sqrt();
    let view = DVec3::new(-horizontal * cos, -horizontal * sin, travel.down);
    let mut scene = empty(camera(DVec3::new(0.0, 0.0, -depth_m), view, 64));
    scene.water = Some(water(A, B, phase));
    scene.surface = Some(surface(true));
    let (sin, cos) = 60f64.to_radians().sin_cos();
    scene.sun = Some(Sun {
        travel_direction: DVec3::new(sin, 0.0, -cos),
        irradiance: [1.0; 3],
    });
    scene
}

/// What a row of pixels sees in the channel of the largest albedo.
fn compare_radiance(
    backend: Backend,
    phase: Phase,
    depth_m: f64,
    travel: Travel,
    reference: f64,
    seed: u64,
) -> Comparison {
    let scene = looking(phase, depth_m, travel);
    let (value, standard_error) = measure(backend, &scene, SAMPLES_PER_PIXEL, 0, seed);
    Comparison {
        what: format!(
            "{depth_m} m, light travelling {:.2} down at {}°",
            travel.down, travel.azimuth_deg
        ),
        value: value[2],
        standard_error: standard_error[2],
        reference,
        margin: RADIANCE_MARGIN,
    }
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
                compare_radiance(backend, phase(), depth_m, travel, row.reference, seed)
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
                let compared = compare_radiance(backend, phase(), depth_m, travel, reference, seed);
                comparisons.push(compared);
            }
        }
        assert_agreement(&comparisons, comparisons.len());
    });
}
