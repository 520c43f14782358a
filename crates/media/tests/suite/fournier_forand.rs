//! The Fournier-Forand function against numbers of 60 and 80 digits.

use uw_media::phase::{FournierForand, PhaseFunction, X_FLOOR};

use crate::reference::{assert_relative, number, rows};

/// What the product promises for f64.
const TOLERANCE: f64 = 1e-7;

fn phase_of(row: &std::collections::HashMap<String, String>) -> FournierForand {
    FournierForand::new(number(row, "n"), number(row, "B")).expect("valid parameters")
}

/// x cannot be nearer to 1 than its own rounding; the complement of the CDF feels that.
fn ccdf_tolerance(tolerance: f64, x: f64) -> f64 {
    tolerance + f64::EPSILON / (1.0 - x)
}

#[test]
fn value_and_cdf_equal_the_table() {
    for row in rows("ff/ff_table.csv") {
        let phase = phase_of(&row);
        let x = (0.5 * number(&row, "theta_deg").to_radians()).sin().powi(2);
        let at = |name: &str| format!("{name} n {} B {} {}°", row["n"], row["B"], row["theta_deg"]);
        assert_relative(
            phase.value(x),
            number(&row, "p_per_sr"),
            TOLERANCE,
            &at("p"),
        );
        assert_relative(phase.cdf(x), number(&row, "cdf"), TOLERANCE, &at("cdf"));
        if x < 1.0 {
            let tolerance = ccdf_tolerance(TOLERANCE, x);
            assert_relative(phase.ccdf(x), number(&row, "ccdf"), tolerance, &at("ccdf"));
        }
        assert_relative(phase.mu(), number(&row, "mu"), 1e-14, &at("mu"));
    }
}

#[test]
fn value_and_cdf_equal_the_wide_table_to_ten_digits() {
    // Rounding of n - 1 and of the parameters costs up to five of the sixteen digits; one more for other math libraries.
    let tolerance = 1e-10;
    for row in rows("ff/ff_wide.csv") {
        let phase = phase_of(&row);
        let x = number(&row, "x");
        let at = |name: &str| format!("{name} n {} B {} x {}", row["n"], row["B"], row["x"]);
        assert_relative(
            phase.value(x),
            number(&row, "p_per_sr"),
            tolerance,
            &at("p"),
        );
        assert_relative(phase.cdf(x), number(&row, "cdf"), tolerance, &at("cdf"));
        if x < 1.0 {
            let tolerance = ccdf_tolerance(tolerance, x);
            assert_relative(phase.ccdf(x), number(&row, "ccdf"), tolerance, &at("ccdf"));
        }
    }
}

#[test]
fn inverse_cdf_equals_the_table() {
    for row in rows("ff/ff_inverse_cdf.csv") {
        let phase = phase_of(&row);
        let x = phase.inverse_cdf(number(&row, "u"));
        let expected_deg = number(&row, "theta_deg");
        let at = format!("n {} B {} u {}", row["n"], row["B"], row["u"]);
        if expected_deg < 1e-145 {
            assert_eq!(x, X_FLOOR, "{at}");
        } else {
            let got_deg = 2.0 * x.sqrt().asin().to_degrees();
            assert_relative(got_deg, expected_deg, 1e-10, &at);
        }
    }
}

#[test]
fn mean_cosine_and_the_removable_singularity_equal_the_table() {
    for row in rows("ff/ff_params.csv") {
        let phase = phase_of(&row);
        let at = format!("n {} B {}", row["n"], row["B"]);
        assert_relative(phase.mean_cosine(), number(&row, "mean_cosine"), 1e-12, &at);
        assert_relative(phase.backscatter_fraction(), number(&row, "B"), 1e-12, &at);
        let theta = number(&row, "theta_deg_where_delta_is_1").to_radians();
        let x = (0.5 * theta).sin().powi(2);
        assert_relative(phase.value(x), number(&row, "p_at_delta_1"), 1e-12, &at);
        assert_relative(phase.cdf(x), number(&row, "cdf_at_delta_1"), 1e-12, &at);
    }
}
