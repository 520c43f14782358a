//! Values of options, as people write them.

/// Three finite numbers with commas between them.
pub(crate) fn triple(text: &str) -> Result<[f64; 3], String> {
    let numbers: Vec<f64> = text
        .split(',')
        .filter_map(|n| n.trim().parse().ok())
        .collect();
    match numbers[..] {
        [r, g, b] if numbers.iter().all(|n| n.is_finite()) && text.split(',').count() == 3 => {
            Ok([r, g, b])
        }
        _ => Err(format!("must be three numbers R,G,B, got {text:?}")),
    }
}

/// Largest number of samples per pixel.
const MOST_SAMPLES: u32 = 1 << 30;

/// A finite number above 0.
pub(crate) fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("must be a finite number > 0".to_owned()),
    }
}

/// A relative error: a finite number above 0, or as many percent.
pub(crate) fn relative_error(text: &str) -> Result<f64, String> {
    let (number, parts) = match text.strip_suffix('%') {
        Some(number) => (number.trim_end(), 100.0),
        None => (text, 1.0),
    };
    let wrong = |_| "must be a finite number > 0, such as 0.05 or 5%".to_owned();
    positive(number).map(|value| value / parts).map_err(wrong)
}

/// A number of samples, also as in 1e6.
pub(crate) fn samples(text: &str) -> Result<u32, String> {
    let whole = text.parse::<u32>().ok();
    let written_short = || {
        let value = text.parse::<f64>().ok()?;
        let is_whole = value.fract() == 0.0 && (0.0..=f64::from(MOST_SAMPLES)).contains(&value);
        is_whole.then_some(value as u32)
    };
    whole
        .or_else(written_short)
        .filter(|samples| (1..=MOST_SAMPLES).contains(samples))
        .ok_or_else(|| format!("must be a whole number in 1..={MOST_SAMPLES}, such as 256 or 1e6"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_finite_and_positive() {
        assert_eq!(positive("1e-3"), Ok(1e-3));
        for text in ["0", "-1", "nan", "inf", "", "1s"] {
            assert!(positive(text).is_err(), "{text}");
        }
    }

    #[test]
    fn errors_can_be_given_in_percent() {
        for (text, value) in [("0.05", 0.05), ("5%", 0.05), ("5 %", 0.05), ("0.5%", 0.005)] {
            assert_eq!(relative_error(text), Ok(value), "{text}");
        }
        for text in ["0%", "%", "-5%", "nan%", "5%%", "five"] {
            let error = relative_error(text).expect_err(text);
            assert!(error.contains("0.05 or 5%"), "{error}");
        }
    }

    #[test]
    fn samples_can_be_written_short() {
        for (text, value) in [("1", 1), ("256", 256), ("1e6", 1_000_000), ("2.5e3", 2500)] {
            assert_eq!(samples(text), Ok(value), "{text}");
        }
        for text in ["0", "-1", "1.5", "1e-3", "1e10", "nan", "inf", "many", ""] {
            let error = samples(text).expect_err(text);
            assert!(error.contains("such as 256 or 1e6"), "{error}");
        }
    }
}
