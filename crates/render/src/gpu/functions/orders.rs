//! Orders of bridges.

use super::{ROWS, adapter, probe, scene};

/// Share of the geometric part of the law, `shaders/common/order.wgsl`.
const TAIL_SHARE: f64 = 0.02;

/// q(k | D) of the law for water with this largest albedo: Poisson's with a geometric tail.
fn probability(k: u32, depth: f64, albedo: f64) -> f64 {
    let ln_factorial: f64 = (1..=k).map(|i| f64::from(i).ln()).sum();
    let poisson = (f64::from(k) * depth.ln() - depth - ln_factorial).exp();
    (1.0 - TAIL_SHARE) * poisson + TAIL_SHARE * (1.0 - albedo) * albedo.powi(k as i32)
}

/// Over even numbers the orders are drawn as often as the law has them but for one each: where its two parts meet, and at an
/// order's end.
#[test]
fn drawn_orders_follow_the_stated_law() {
    let Some(gpu) = adapter() else { return };
    let scene = scene();
    let albedo = scene.medium.as_ref().expect("water").albedo;
    let n = ROWS as f64;
    for depth in [1e-3f32, 0.4, 3.0, 20.0] {
        let even = |i: usize| (i as f32 + 0.5) / ROWS as f32;
        let inputs: Vec<_> = (0..ROWS).map(|i| [depth, even(i), 0.0, 0.0]).collect();
        let rows = probe(gpu, &scene, 7, &inputs);
        let count = |column: usize, k: u32| {
            let is_it = |row: &&[f32; 4]| row[column] == k as f32;
            rows.iter().filter(is_it).count() as f64
        };
        let depth = f64::from(depth);
        let scattered = 1.0 - probability(0, depth, albedo);
        let share = f64::from(rows[0][2]);
        assert!((share / scattered - 1.0).abs() < 1e-4, "{depth}: {share}");
        for k in 0..60 {
            let q = probability(k, depth, albedo);
            let (all, of_scattered) = (count(0, k), count(1, k));
            assert!(
                (all - n * q).abs() < 3.0,
                "{depth}, {k}: {all} of {}",
                n * q
            );
            let expected = if k == 0 { 0.0 } else { n * q / scattered };
            assert!(
                (of_scattered - expected).abs() < 3.0,
                "{depth}, {k}: {of_scattered} of {expected}"
            );
        }
    }
}
