//! Channel coefficients against numbers from a separate program.

use uw_media::{Bands, MediaError, WaterType, channel_iops};

use crate::reference::{assert_relative, number, rows};

/// The reference is printed with six digits.
const TOLERANCE: f64 = 6e-6;

#[test]
fn every_rule_equals_the_reference() -> Result<(), MediaError> {
    let rules = [
        ("paper", "mean"),
        ("paper", "600-700,500-600,400-500"),
        ("paper_printed", "paper-printed"),
        ("canon5d2", "camera:canon5d2"),
        ("nikon_d5100", "camera:nikon_d5100"),
        ("imx219", "camera:imx219"),
        ("wh2022", "measured"),
    ];
    let mut compared = 0;
    for row in rows("rgb_wideband.csv") {
        for (_, name) in rules.iter().filter(|(method, _)| *method == row["method"]) {
            let bands: Bands = name.parse()?;
            assert_eq!(bands.to_string(), *name);
            let iops = channel_iops(row["water_type"].parse()?, &bands)?;
            for (k, channel) in ["r", "g", "b"].iter().enumerate() {
                let at = |q: &str| format!("{q}_{channel} of {} {name}", row["water_type"]);
                let expected = |q: &str| number(&row, &format!("{q}_{channel}"));
                assert_relative(iops.a[k], expected("a"), TOLERANCE, &at("a"));
                assert_relative(iops.b[k], expected("b"), TOLERANCE, &at("b"));
                assert_relative(iops.c()[k], expected("c"), TOLERANCE, &at("c"));
            }
            compared += 1;
        }
    }
    assert_eq!(
        compared, 66,
        "ten types by six rules and six measured types"
    );
    Ok(())
}

#[test]
fn red_absorption_rises_with_the_coastal_type() -> Result<(), MediaError> {
    use WaterType::{C1, C3, C5, C7, C9};
    let red = |water_type| channel_iops(water_type, &Bands::Mean).map(|iops| iops.a[0]);
    let series = [red(C1)?, red(C3)?, red(C5)?, red(C7)?, red(C9)?];
    assert!(
        series.windows(2).all(|pair| pair[0] < pair[1]),
        "{series:?}"
    );
    // The misprint in the table as published breaks this order.
    let printed = |t| channel_iops(t, &Bands::PaperPrinted).map(|iops| iops.a[0]);
    assert!(printed(C5)? > printed(C9)?);
    Ok(())
}

#[test]
fn narrow_intervals_lie_between_their_neighbours() -> Result<(), MediaError> {
    // 625 nm is tabulated; 610 lies between 600 and 625, at 2/5 of the way.
    let at = |text: &str| channel_iops(WaterType::II, &text.parse()?);
    let (left, right) = (
        at("600-600,500-500,400-400")?,
        at("625-625,525-525,425-425")?,
    );
    let between = at("609-611,509-511,409-411")?;
    for k in 0..3 {
        let expected = 0.6 * left.a[k] + 0.4 * right.a[k];
        assert_relative(between.a[k], expected, 1e-12, "a");
    }
    Ok(())
}

#[test]
fn bad_bands_are_refused_by_name() {
    let text = |bands: &str| bands.parse::<Bands>().map_err(|e| e.to_string());
    let known = "mean, paper-printed, measured, camera:canon5d2, camera:nikon_d5100, \
                 camera:imx219, or three intervals in nm such as 600-700,500-600,400-500; or by wavelength spectral, \
                 spectral-measured";
    for unknown in ["", "average", "camera:nikon", "600-700,500-600"] {
        assert_eq!(
            text(unknown),
            Err(format!("unknown bands {unknown:?}; known: {known}"))
        );
    }
    let range = "must be FROM-TO in nm with 300 <= FROM <= TO <= 700";
    for (bands, part) in [
        ("600-800,500-600,400-500", "600-800"),
        ("600-700,600-500,400-500", "600-500"),
        ("600-700,NaN-600,400-500", "NaN-600"),
        ("600-700,500,400-500", "500"),
    ] {
        assert_eq!(text(bands), Err(format!("band {part:?} {range}")));
    }
    let error = channel_iops(WaterType::C9, &Bands::Measured).map_err(|e| e.to_string());
    assert_eq!(
        error,
        Err(
            "bands \"measured\" do not cover Jerlov type 9C; covered: IB II III 1C 3C 5C"
                .to_owned()
        )
    );
}
