//! The response of a camera's channels, and the wavelengths drawn from it.

use crate::Spectrum;
use crate::error::MediaError;
use crate::tables;

use super::named::embedded;
use super::{Curve, TableError, read_columns};

/// Names that [`Response::named`] knows, for messages.
pub const RESPONSES: &str = "boxes canon5d2 nikon_d5100 imx219 arri_d21 canon_eos_5d_mark_ii canon_powershot_s90 canon_xti \
     nikon_d200 nikon_d7000 nikon_d700 nikon_d70 sony_ilce_7rm2 sony_ilce_7sm2";
/// Cameras of the first table, every 10 nm from 400 to 700 nm.
const FIRST: [&str; 3] = ["canon5d2", "nikon_d5100", "imx219"];
/// Width of a box's edge, nm.
const EDGE_NM: f64 = 1e-6;
/// Widest part over which a response is summed up, nm.
const PART_NM: f64 = 0.25;

/// Relative response of the channels R, G and B per unit of energy.
#[derive(Clone, Debug, PartialEq)]
pub struct Response {
    /// The name, or the file it comes from.
    pub name: String,
    /// R, G and B.
    pub channels: [Curve; 3],
}

impl Response {
    /// Three boxes, 600-700, 500-600 and 400-500 nm.
    pub fn boxes() -> Self {
        let channel = |from: f64, to: f64| {
            Curve::new(vec![
                (from, 0.0),
                (from + EDGE_NM, 1.0),
                (to - EDGE_NM, 1.0),
                (to, 0.0),
            ])
        };
        Self {
            name: "boxes".to_owned(),
            channels: [
                channel(600.0, 700.0),
                channel(500.0, 600.0),
                channel(400.0, 500.0),
            ],
        }
    }

    /// Three bands `width_nm` wide around wavelengths, nm.
    pub fn narrow(middles_nm: [f64; 3], width_nm: f64) -> Self {
        let half = 0.5 * width_nm;
        Self {
            name: "narrow bands".to_owned(),
            channels: middles_nm
                .map(|middle| Curve::new(vec![(middle - half, 1.0), (middle + half, 1.0)])),
        }
    }

    /// A camera that has a name: three of `camera_responses.csv`, others of the rawtoaces collection.
    ///
    /// # Errors
    /// An unknown name.
    pub fn named(name: &str) -> Result<Self, MediaError> {
        if name == "boxes" {
            return Ok(Self::boxes());
        }
        if !RESPONSES.split_whitespace().any(|known| known == name) {
            return Err(MediaError::UnknownName {
                kind: "camera",
                got: name.to_owned(),
                known: RESPONSES.to_owned(),
            });
        }
        let table = match FIRST.contains(&name) {
            true => tables::CAMERAS,
            false => tables::MORE_CAMERAS,
        };
        let channel = |c: &str| embedded(table, &format!("{name}_{c}"));
        // The curve of the IMX219 counts photons; the energy of a photon is ~ 1/wavelength.
        let per_energy = |curve: Curve| match name {
            "imx219" => curve.map(|nm, value| nm * value),
            _ => curve,
        };
        Ok(Self {
            name: name.to_owned(),
            channels: ["r", "g", "b"].map(|c| per_energy(channel(c))),
        })
    }

    /// Reads a table with the columns wavelength_nm, r, g and b; `name` says where it comes from.
    ///
    /// # Errors
    /// As [`read_columns`].
    pub fn parse(text: &str, name: &str) -> Result<Self, TableError> {
        Ok(Self {
            name: name.to_owned(),
            channels: read_columns(text, ["r", "g", "b"], None)?,
        })
    }

    /// Channel values of a spectrum: means weighted by the responses, within `range_nm` where that is given.
    pub fn channel_values(
        &self,
        range_nm: Option<(f64, f64)>,
        of: impl Fn(f64) -> f64,
    ) -> Spectrum {
        std::array::from_fn(|k| {
            let (mut sum, mut weights) = (0.0, 0.0);
            for part in parts_of(&self.channels[k], range_nm) {
                sum += part.weight * of(part.middle_nm);
                weights += part.weight;
            }
            match weights > 0.0 {
                true => sum / weights,
                false => 0.0,
            }
        })
    }

    /// `count` sets of three wavelengths within `range_nm`, one for each channel, drawn in proportion to the channel's
    /// response times its `favour` there, > 0: the middles of equal shares of that. The mean over the sets of a quantity
    /// times the weight is the channel's value.
    ///
    /// `None` where a channel responds to nothing there.
    pub fn wavelength_sets(
        &self,
        count: usize,
        range_nm: (f64, f64),
        favour: &[impl Fn(f64) -> f64; 3],
    ) -> Option<Vec<[Drawn; 3]>> {
        let of = |k: usize| {
            let parts = parts_of(&self.channels[k], Some(range_nm));
            quantiles(&parts, &favour[k], count)
        };
        let channels = [of(0)?, of(1)?, of(2)?];
        let set = |i: usize| std::array::from_fn(|k| channels[k][i]);
        Some((0..count).map(set).collect())
    }

    /// The area under each channel's curve, nm.
    pub fn areas(&self) -> Spectrum {
        let weight = |curve| parts_of(curve, None).iter().map(|part| part.weight).sum();
        self.channels.each_ref().map(weight)
    }

    /// Share of a channel that may lie outside the table of a water.
    pub const MAY_LIE_OUTSIDE: f64 = 0.02;

    /// Largest share of a channel that lies outside `range_nm`, and which channel that is; `None` where it may lie there.
    pub fn not_covered(&self, (low_nm, high_nm): (f64, f64)) -> Option<(f64, &'static str)> {
        let inside = |nm: f64| f64::from(u8::from((low_nm..=high_nm).contains(&nm)));
        let outside = self.channel_values(None, inside).map(|share| 1.0 - share);
        let channels = outside.into_iter().zip(["r", "g", "b"]);
        let worst = channels.max_by(|one, other| one.0.total_cmp(&other.0));
        worst.filter(|(share, _)| *share > Self::MAY_LIE_OUTSIDE)
    }

    /// First and last wavelength at which a channel responds, nm.
    pub fn range_nm(&self) -> (f64, f64) {
        let ranges = self.channels.iter().filter_map(Curve::range_nm);
        ranges.fold((f64::INFINITY, 0.0), |all, own| {
            (all.0.min(own.0), all.1.max(own.1))
        })
    }
}

/// A wavelength that stands for others of its channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drawn {
    /// Wavelength, nm.
    pub wavelength_nm: f64,
    /// What it counts; 1 in the mean over a channel's wavelengths.
    pub weight: f64,
}

/// A small part of a response.
struct Part {
    middle_nm: f64,
    width_nm: f64,
    /// The response times the width.
    weight: f64,
}

/// The parts of a response within a range.
fn parts_of(curve: &Curve, range_nm: Option<(f64, f64)>) -> Vec<Part> {
    let (low, high) = range_nm.unwrap_or((0.0, f64::INFINITY));
    let mut parts = Vec::new();
    for pair in curve.nodes().windows(2) {
        let (from, to) = (pair[0].0.max(low), pair[1].0.min(high));
        if from >= to {
            continue;
        }
        let count = ((to - from) / PART_NM).ceil().max(1.0);
        let width_nm = (to - from) / count;
        parts.extend((0..count as usize).map(|part| {
            let middle_nm = from + (part as f64 + 0.5) * width_nm;
            Part {
                middle_nm,
                width_nm,
                weight: curve.at(middle_nm) * width_nm,
            }
        }));
    }
    parts
}

/// Middles of `count` equal shares of what the parts weigh times their `favour`; within a part it is even.
fn quantiles(parts: &[Part], favour: impl Fn(f64) -> f64, count: usize) -> Option<Vec<Drawn>> {
    let favours: Vec<f64> = parts.iter().map(|part| favour(part.middle_nm)).collect();
    let share = |i: usize| parts[i].weight * favours[i];
    let total: f64 = (0..parts.len()).map(share).sum();
    if !(total > 0.0) {
        return None;
    }
    let (mut found, mut below, mut i) = (Vec::with_capacity(count), 0.0, 0);
    for middle in 0..count {
        let wanted = total * (middle as f64 + 0.5) / count as f64;
        while i + 1 < parts.len() && below + share(i) < wanted {
            below += share(i);
            i += 1;
        }
        let inside = ((wanted - below) / share(i)).clamp(0.0, 1.0);
        found.push(Drawn {
            wavelength_nm: parts[i].middle_nm + (inside - 0.5) * parts[i].width_nm,
            weight: 1.0 / favours[i],
        });
    }
    let mean = found.iter().map(|drawn| drawn.weight).sum::<f64>() / count as f64;
    for drawn in &mut found {
        drawn.weight /= mean;
    }
    Some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_has_a_response() {
        for name in RESPONSES.split_whitespace() {
            let response = Response::named(name).expect(name);
            let [red, green, blue] = response.channel_values(None, |nm| nm);
            assert!(red > green && green > blue, "{name}: {red} {green} {blue}");
        }
        assert!(Response::named("canon").is_err());
    }

    #[test]
    fn boxes_average_their_bands() {
        let values = Response::boxes().channel_values(None, |nm| nm);
        for (value, expected) in values.into_iter().zip([650.0, 550.0, 450.0]) {
            assert!((value - expected).abs() < 1e-6, "{value}");
        }
    }

    /// Sums over the sets of wavelengths are means weighted by the response, of smooth and of crooked functions, also where
    /// long wavelengths are favoured.
    #[test]
    fn sums_over_sets_of_wavelengths_are_means_over_the_response() {
        for name in ["boxes", "canon5d2", "imx219", "sony_ilce_7sm2"] {
            let response = Response::named(name).expect(name);
            sums_are_means(&response, |_| 1.0, 5e-5);
            // Where less is drawn a set stands for more: 2.6e-4 in the blue tail of a red channel.
            sums_are_means(&response, |nm| 0.4 + 1.2 * (nm - 400.0) / 300.0, 3e-4);
        }
    }

    fn sums_are_means(response: &Response, favour: fn(f64) -> f64, of_smooth: f64) {
        const COUNT: usize = 1024;
        let range = (400.0, 700.0);
        let sets = response.wavelength_sets(COUNT, range, &[favour; 3]);
        let sets = sets.expect("a response");
        for (of, tolerance) in [
            ((|nm| nm) as fn(f64) -> f64, of_smooth),
            // In the tail of a response a set stands for some 10 nm.
            (|nm| (-((nm - 400.0) / 60.0)).exp(), 1e-3),
            // A jump is where one of the sets is.
            (|nm| if nm < 630.0 { 1.0 } else { 0.2 }, 5e-3),
        ] {
            let expected = response.channel_values(Some(range), of);
            for k in 0..3 {
                let counted = |set: &[Drawn; 3]| set[k].weight * of(set[k].wavelength_nm);
                let mean = sets.iter().map(counted).sum::<f64>() / COUNT as f64;
                let error = (mean - expected[k]).abs() / expected[k];
                let name = &response.name;
                assert!(error < tolerance, "{name} {k}: {mean} {}", expected[k]);
            }
        }
    }
}
