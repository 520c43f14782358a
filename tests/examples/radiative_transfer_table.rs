//! Prints the table of docs/accuracy.md: irradiances of the radiative transfer benchmark by this renderer beside
//! discrete ordinates and published means.

#![allow(clippy::print_stdout, reason = "the table is the result")]

use std::sync::atomic::AtomicBool;

use uw_render::backend::Device;
use uw_render::irradiance::{IrradiancePlan, measure};
use uw_render::prepare::Prepared;
use uw_tests::corpus_scene;
use uw_tests::discrete_ordinates::{Problem, irradiances};
use uw_tests::reference::{IrradianceRow, rayleigh_irradiances};

const DEPTHS_M: [f64; 3] = [1.0, 5.0, 10.0];
/// Channels of the scenes that have an albedo of the benchmark.
const CHANNELS: [(usize, f64); 2] = [(0, 0.2), (2, 0.9)];
const SHOWN: [&str; 4] = ["E_d", "E_u", "E_ou", "L_u"];
const SAMPLES: u32 = 1 << 22;
const NODES: usize = 64;

fn main() {
    let published = rayleigh_irradiances();
    println!(
        "| phase function | albedo | optical depth | quantity | this renderer ± standard error | discrete ordinates | difference | z | Mobley et al. 1993 |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for (name, phase_name) in [
        ("rt_rayleigh", "Rayleigh"),
        ("rt_petzold", "Petzold"),
        ("rt_fournier_forand", "Fournier-Forand"),
    ] {
        print_scene(name, phase_name, &published);
    }
}

fn print_scene(name: &str, phase_name: &str, published: &[IrradianceRow]) {
    let scene = corpus_scene(name);
    let Some(water) = &scene.water else { return };
    let plan = IrradiancePlan {
        depths_m: DEPTHS_M.to_vec(),
        samples: SAMPLES,
        seed: 0,
        threads: None,
        max_bounces: 0,
    };
    let measured = measure(
        &Device::Cpu,
        &Prepared::build(&scene),
        &plan,
        &AtomicBool::new(false),
        &|_| {},
    )
    .unwrap_or_else(|e| panic!("{e}"));
    for (channel, albedo) in CHANNELS {
        let solved = irradiances(&Problem::benchmark(&water.phase, albedo), &DEPTHS_M, NODES);
        for (row, reference) in measured.iter().zip(&solved) {
            let shown = row.quantities().into_iter();
            for (quantity, estimate) in shown.filter(|(q, _)| SHOWN.contains(q)) {
                let (value, error) = (estimate.value[channel], estimate.standard_error[channel]);
                let reference = reference.quantity(quantity);
                let mean = published
                    .iter()
                    .filter(|_| phase_name == "Rayleigh")
                    .find(|r| {
                        r.albedo == albedo
                            && r.optical_depth == row.depth_m
                            && r.quantity == quantity
                    })
                    .and_then(|r| r.published_mean)
                    .map_or(String::new(), |mean| format!("{mean:.2e}"));
                println!(
                    "| {phase_name} | {albedo} | {} | {quantity} | {value:.4e} ± {:.2} % | {reference:.4e} | {:+.2} % | {:+.1} | {mean} |",
                    row.depth_m,
                    100.0 * error / value,
                    100.0 * (value / reference - 1.0),
                    (value - reference) / error,
                );
            }
        }
    }
}
