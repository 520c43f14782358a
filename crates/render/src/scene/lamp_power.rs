//! A lamp's intensity: as a scene file states it, or from the power of its light.

use uw_media::Spectrum;
use uw_media::spectral::{Curve, Response, efficacy_lm_per_w, illuminant, mean_seen};

use super::photometry::Photometry;
use super::range::Range;
use super::reader::Table;
use super::{Falloff, SceneError};

/// Spectrum that says how many lumens a watt has where a lamp has none: white light-emitting diodes.
const USUAL_SPECTRUM: &str = "led-5000k";
/// Channels among which the power is shared.
const CHANNELS: f64 = 3.0;
/// What says how bright a lamp is.
const EXPECTED: &str = "[r, g, b] in W/sr; or power_w or power_lm in its place";

/// What else is known of a lamp when its intensity is read.
pub(super) struct Beam<'b> {
    pub(super) falloff: &'b Falloff,
    pub(super) half_angle_deg: f64,
    pub(super) spectrum: Option<&'b Curve>,
    /// The maker's file, where the falloff is from one.
    pub(super) photometry: Option<&'b Photometry>,
}

/// `intensity`, or what `power_w` (W of light between 400 and 700 nm), `power_lm` (lm) or the lumens of a photometric file make it.
///
/// # Errors
/// Two of them, none, or one out of its range.
pub(super) fn read(
    table: &Table<'_>,
    beam: &Beam<'_>,
    response: &Response,
) -> Result<Spectrum, SceneError> {
    let given = ["intensity", "power_w", "power_lm"].map(|field| table.optional(field).is_some());
    if given[0] {
        for field in ["power_w", "power_lm"] {
            table.refuse(field, "where the lamp's intensity is given")?;
        }
        return table.numbers("intensity", Range::non_negative("W/sr"));
    }
    if given[1] {
        table.refuse("power_lm", "where the lamp's power_w is given")?;
        let power_w = table.number("power_w", Range::non_negative("W"))?;
        return Ok(of_power(power_w, beam, response));
    }
    let lumen = match (given[2], beam.photometry) {
        (true, _) => table.number("power_lm", Range::non_negative("lm"))?,
        (false, Some(file)) => file.lumen(beam.half_angle_deg),
        (false, None) => return Err(table.missing("intensity", EXPECTED)),
    };
    let lm_per_w = match beam.spectrum {
        Some(spectrum) => efficacy_lm_per_w(spectrum),
        None => illuminant(USUAL_SPECTRUM).map_or(0.0, |usual| efficacy_lm_per_w(&usual)),
    };
    match lm_per_w > 0.0 {
        true => Ok(of_power(lumen / lm_per_w, beam, response)),
        // Light that nobody sees has no lumens.
        false => table
            .refuse(
                "spectrum",
                "or have light between 400 and 700 nm where lumens say how bright the lamp is",
            )
            .map(|()| [0.0; 3]),
    }
}

/// The intensity on the axis of `power_w` W. Each channel gets a third of it, by its spectrum more or less: the shares of three
/// channels of 100 nm.
fn of_power(power_w: f64, beam: &Beam<'_>, response: &Response) -> Spectrum {
    let shares = match beam.spectrum {
        None => [1.0; 3],
        Some(curve) => {
            let mean = mean_seen(curve);
            (response.channel_values(None, |nm| curve.at(nm)))
                .map(|value| if mean > 0.0 { value / mean } else { 0.0 })
        }
    };
    let solid_angle_sr = beam.falloff.solid_angle_sr(beam.half_angle_deg);
    shares.map(|share| power_w / CHANNELS * share / solid_angle_sr)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn beam<'b>(
        falloff: &'b Falloff,
        half_angle_deg: f64,
        spectrum: Option<&'b Curve>,
    ) -> Beam<'b> {
        Beam {
            falloff,
            half_angle_deg,
            spectrum,
            photometry: None,
        }
    }

    #[test]
    fn a_third_of_the_power_is_in_each_channel() {
        let found = of_power(6.0, &beam(&Falloff::Cosine, 60.0, None), &Response::boxes());
        let solid_angle = std::f64::consts::PI * 0.75;
        for value in found {
            assert!((value * solid_angle / 2.0 - 1.0).abs() < 1e-6, "{found:?}");
        }
    }

    /// Shares by the table's trapezoids, summed by hand (docs/howto/lamp.md has them rounded), and the whole power again when the channels are added up.
    #[test]
    fn a_spectrum_shares_the_power_among_the_channels() {
        let warm = illuminant("led-2700k").expect("a spectrum");
        let lamp = beam(&Falloff::Uniform, 180.0, Some(&warm));
        let watts =
            of_power(1.0, &lamp, &Response::boxes()).map(|i| 4.0 * std::f64::consts::PI * i);
        for (got, want) in watts.iter().zip([0.461, 0.422, 0.117]) {
            assert!((got - want).abs() < 0.002, "{watts:?}");
        }
        assert!((watts.iter().sum::<f64>() - 1.0).abs() < 2e-3, "{watts:?}");
    }
}
