use super::*;

const VARIANCE: f64 = 1e-3;

/// A channel of a target that has as much variance in every octave, as a picture from a metre shows it in pixels of a millimetre.
fn even_octaves() -> ChannelDetail {
    let windows_m: Vec<f64> = (0..7).map(|i| 1e-3 * f64::from(1 << i)).collect();
    ChannelDetail {
        mean: 0.3,
        variance: vec![VARIANCE; 6],
        doubt: vec![0.0; 6],
        left: Vec::new(),
        patch_m: 32.0 * windows_m[0],
        evenness: vec![1.0; 6],
        windows_m,
        error: 0.0,
        shape: Shape {
            means: vec![1.0; PATCHES],
            deviations: vec![1.0; PATCHES],
            quantiles: Vec::new(),
        },
        clipped: 0.0,
        bands: OnceLock::new(),
    }
}

#[test]
fn patches_hold_the_octaves_in_them_and_finer_ones_hold_less_and_less() {
    let detail = even_octaves();
    let octaves_from = |distance_m: f64| {
        let look = detail.look([1.0, distance_m], 1000.0, &|_| 1.0);
        look.deviation.powi(2) / VARIANCE
    };
    // Patches of 32 pixels hold five octaves; from nearer some of them are finer than the picture's pixels.
    for (distance_m, octaves) in [
        (1.0, 5.0),
        (2.0, 5.0),
        (0.5, 4.0 + 0.8),
        (0.25, 3.0 + 0.8 + 0.8 * 0.8),
    ] {
        let found = octaves_from(distance_m);
        assert!((found - octaves).abs() < 1e-9, "{distance_m}: {found}");
    }
}
