//! Water from what it holds, against the daylight that was measured in such water.

use uw_media::spectral::Constituents;

use crate::reference::{assert_relative, number, rows};

/// Zenith angle of the sun, degrees.
const SUN_DEG: f64 = 30.0;

fn ocean(chlorophyll_mg_m3: f64) -> Constituents {
    Constituents::new(chlorophyll_mg_m3, None, 0.0).expect("a water")
}

/// Attenuation of daylight by absorption and backscattering, 1/m (Lee et al. 2005, J. Geophys. Res. 110, C02017).
fn k_d(water: &Constituents, nm: f64) -> f64 {
    let (spectrum, pure) = (water.spectrum(), ocean(0.0).spectrum());
    let of_particles = |nm: f64| spectrum.b.at(nm) - pure.b.at(nm);
    let back = water.backscatter_fraction() * spectrum.b.at(550.0) - 0.5 * pure.b.at(550.0);
    let backwards = 0.5 * pure.b.at(nm) + back * of_particles(nm) / of_particles(550.0);
    let a = spectrum.a.at(nm);
    (1.0 + 0.005 * SUN_DEG) * a + 4.18 * (1.0 - 0.52 * (-10.8 * a).exp()) * backwards
}

/// Within 15 % from the clearest ocean to a bloom, root mean square of the logarithm (found: 0.10 to 0.13), and without a trend.
#[test]
fn daylight_falls_as_it_was_measured_by_chlorophyll() {
    for chlorophyll in [0.03, 0.1, 0.3, 1.0, 3.0, 10.0] {
        let water = ocean(chlorophyll);
        let ratios = rows("morel1988_kd.csv").into_iter().map(|row| {
            let field = |name| number(&row, name);
            let measured = field("k_w_per_m") + field("chi") * chlorophyll.powf(field("e"));
            (k_d(&water, field("wavelength_nm")) / measured).ln()
        });
        let ratios: Vec<f64> = ratios.collect();
        let n = ratios.len() as f64;
        let mean = ratios.iter().sum::<f64>() / n;
        let rms = (ratios.iter().map(|r| r * r).sum::<f64>() / n).sqrt();
        eprintln!("chlorophyll {chlorophyll}: rms {rms:.3}, mean {mean:.3}");
        assert_eq!(ratios.len(), 30);
        assert!(
            rms < 0.15 && mean.abs() < 0.09,
            "chlorophyll {chlorophyll}: {rms:.3} {mean:.3}"
        );
    }
}

/// Values worked out by hand from the sources' formulas.
#[test]
fn each_constituent_adds_what_its_source_says() {
    let pure = Constituents::new(0.0, None, 0.0).expect("a water");
    let of = |water: &Constituents, nm: f64| {
        let spectrum = water.spectrum();
        (spectrum.a.at(nm), spectrum.b.at(nm))
    };
    assert_eq!(of(&pure, 500.0), (0.0204, 0.0025473));
    assert_relative(pure.backscatter_fraction(), 0.5, 1e-12, "molecules");

    // Chlorophyll of 1 mg/m3 at 440 nm: 0.06, and 0.012 of yellow substance; scattering 0.416 (440 / 550)^-0.15.
    let (a, b) = of(&ocean(1.0), 440.0);
    assert_relative(a - 0.00635, 0.072, 1e-9, "a of chlorophyll");
    assert_relative(
        b - 0.0043796,
        0.416 * 0.8_f64.powf(-0.15),
        1e-9,
        "b of chlorophyll",
    );
    // A bloom of 10 mg/m3 scatters alike at both ends.
    let bloom = ocean(10.0);
    assert_relative(
        of(&bloom, 700.0).1 - 0.0006255,
        of(&bloom, 400.0).1 - 0.0065918,
        1e-9,
        "b of a bloom",
    );

    let river = Constituents::new(0.0, Some(2.0), 10.0).expect("a water");
    let (a, b) = of(&river, 540.0);
    let expected = 2.0 * (-1.4_f64).exp() + 0.41 * (-0.0123 * 97.0_f64).exp();
    assert_relative(a - 0.0474, expected, 1e-9, "a of a river");
    assert_relative(b - 0.0018432, 5.0, 1e-9, "b of a river");
    let backwards = (0.5 * 0.0017068 + 0.024 * 5.0) / (0.0017068 + 5.0);
    assert_relative(
        river.backscatter_fraction(),
        backwards,
        1e-9,
        "B of a river",
    );
}

#[test]
fn what_no_sea_holds_is_refused() {
    for (chlorophyll, cdom, minerals, told) in [
        (
            -1.0,
            None,
            0.0,
            "chlorophyll_mg_m3 must be in [0, 100] mg/m3, got -1",
        ),
        (f64::NAN, None, 0.0, "chlorophyll_mg_m3"),
        (
            1.0,
            Some(21.0),
            0.0,
            "cdom_440_per_m must be in [0, 20] 1/m, got 21",
        ),
        (
            1.0,
            None,
            1e6,
            "minerals_g_m3 must be in [0, 2000] g/m3, got 1000000",
        ),
    ] {
        let error = Constituents::new(chlorophyll, cdom, minerals).expect_err(told);
        assert!(error.to_string().contains(told), "{error}");
    }
}
