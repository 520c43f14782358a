//! Beams from a maker's photometric files: IES LM-63 (`.ies`, 1986 to 2019, type C) and EULUMDAT (`.ldt`).
//!
//! Both give luminous intensity, cd, by the angle from the lamp's axis in half planes around it. A scene's lamp is the same all round its
//! axis, so its beam is the mean over the half planes.

use std::f64::consts::TAU;
use std::path::Path;

/// Most numbers of a table.
const MOST_VALUES: usize = 1 << 20;
/// How far planes may be from closing a circle, degrees.
const ROUND_DEG: f64 = 1e-6;
/// Rings of the sum over all directions, per degree.
const RINGS_PER_DEG: f64 = 20.0;

/// A lamp's beam as a photometric file has it.
#[derive(Clone, Debug, PartialEq)]
pub struct Photometry {
    /// Angle from the axis, degrees in [0, 180], rising from 0, and luminous intensity, cd, above 0 on the axis; dark beyond the last.
    pub beam: Vec<(f64, f64)>,
    /// Largest difference of a half plane from the beam, over the intensity on the axis.
    pub uneven: f64,
}

/// A table of intensities: half planes at angles around the axis.
struct Planes {
    /// Angles from the axis, degrees, rising.
    angles_deg: Vec<f64>,
    /// Angles around the axis, degrees, rising.
    around_deg: Vec<f64>,
    /// Per half plane the intensities at the angles, cd.
    candelas: Vec<Vec<f64>>,
}

impl Photometry {
    /// Whether a file is taken for a photometric one by its name.
    pub fn is_meant(path: &Path) -> bool {
        kind(path).is_some()
    }

    /// Reads a file, shipped or any other. Comments may be in any encoding of text.
    ///
    /// # Errors
    /// A file that cannot be read, and those of [`parse`](Self::parse).
    pub fn read(path: &Path) -> Result<Self, String> {
        let bytes = uw_assets::ALL.read(path).map_err(|e| e.to_string())?;
        Self::parse(&String::from_utf8_lossy(&bytes), path)
    }

    /// The beam in a file's `text`; `path` tells which of the two it is.
    ///
    /// # Errors
    /// What is not as the formats have it, with its line where there is one.
    pub fn parse(text: &str, path: &Path) -> Result<Self, String> {
        match kind(path) {
            Some(Kind::Ies) => of_planes(&ies(text)?),
            Some(Kind::Eulumdat) => of_planes(&eulumdat(text)?),
            None => Err("must be a photometric file, .ies or .ldt".to_owned()),
        }
    }

    /// Luminous flux, lm, within `half_angle_deg` of the axis.
    pub fn lumen(&self, half_angle_deg: f64) -> f64 {
        let beam = super::Falloff::Profile(self.beam.clone());
        beam.solid_angle_sr(half_angle_deg)
    }
}

impl super::Falloff {
    /// The relative intensity over all directions within `half_angle_deg` of the axis, sr: what an intensity on the axis makes a power.
    pub fn solid_angle_sr(&self, half_angle_deg: f64) -> f64 {
        let rings = (RINGS_PER_DEG * half_angle_deg).ceil().max(1.0);
        let step_deg = half_angle_deg / rings;
        let ring = |i: u32| {
            let edges = [i, i + 1].map(|edge| f64::from(edge) * step_deg);
            let (middle, width) = (0.5 * (edges[0] + edges[1]), edges[1] - edges[0]);
            // The difference of the edges' cosines, exact where they are close.
            let area = 2.0 * middle.to_radians().sin() * (0.5 * width).to_radians().sin();
            TAU * area * self.relative(middle)
        };
        (0..rings as u32).map(ring).sum()
    }
}

enum Kind {
    Ies,
    Eulumdat,
}

fn kind(path: &Path) -> Option<Kind> {
    let ending = path.extension()?.to_str()?.to_ascii_lowercase();
    match ending.as_str() {
        "ies" => Some(Kind::Ies),
        "ldt" => Some(Kind::Eulumdat),
        _ => None,
    }
}

/// The mean over the half planes.
fn of_planes(planes: &Planes) -> Result<Photometry, String> {
    let angles = &planes.angles_deg;
    check_rising("angles from the axis", angles, 180.0)?;
    check_rising("angles around the axis", &planes.around_deg, 360.0)?;
    if angles[0] != 0.0 {
        return Err(format!(
            "angles from the axis must begin at 0 degrees, where a lamp's intensity is stated, got {}",
            angles[0]
        ));
    }
    let wrong = |value: &&f64| !(**value >= 0.0 && value.is_finite());
    if let Some(value) = planes.candelas.iter().flatten().find(wrong) {
        return Err(format!(
            "intensities must be finite numbers >= 0 cd, got {value}"
        ));
    }
    let weights = weights(&planes.around_deg);
    let mean = |i: usize| {
        let of_plane = planes.candelas.iter().zip(&weights);
        of_plane
            .map(|(plane, weight)| weight * plane[i])
            .sum::<f64>()
    };
    let beam: Vec<(f64, f64)> = (0..angles.len()).map(|i| (angles[i], mean(i))).collect();
    let axis = beam[0].1;
    if !(axis > 0.0) {
        return Err("the intensity on the axis must be above 0 cd, got 0".to_owned());
    }
    let of_plane = |plane: &Vec<f64>| {
        let off = plane.iter().zip(&beam);
        off.map(|(value, (_, mean))| (value - mean).abs())
            .fold(0.0, f64::max)
    };
    let uneven = planes.candelas.iter().map(of_plane).fold(0.0, f64::max) / axis;
    Ok(Photometry { beam, uneven })
}

fn check_rising(what: &str, degrees: &[f64], most: f64) -> Result<(), String> {
    if degrees.is_empty() {
        return Err(format!("there are no {what}"));
    }
    if let Some(degree) = degrees.iter().find(|d| !(0.0..=most).contains(*d)) {
        return Err(format!(
            "{what} must be in [0, {most}] degrees, got {degree}"
        ));
    }
    match degrees.windows(2).find(|pair| !(pair[0] < pair[1])) {
        Some(pair) => Err(format!(
            "{what} must rise, got {} after {}",
            pair[1], pair[0]
        )),
        None => Ok(()),
    }
}

/// Share of each half plane. A file whose planes stop half way round, or at a quarter, means that the rest mirrors them; one that goes
/// round may leave out the plane at 360°, which is that at 0.
fn weights(around_deg: &[f64]) -> Vec<f64> {
    let n = around_deg.len();
    if n == 1 {
        return vec![1.0];
    }
    let (first, last) = (around_deg[0], around_deg[n - 1]);
    let open = last - first > 180.0 + ROUND_DEG && last - first < 360.0 - ROUND_DEG;
    let mut width: Vec<f64> = (0..n)
        .map(|i| 0.5 * (around_deg[(i + 1).min(n - 1)] - around_deg[i.saturating_sub(1)]))
        .collect();
    if open {
        let gap = 0.5 * (360.0 - (last - first));
        width[0] += gap;
        width[n - 1] += gap;
    }
    let all: f64 = width.iter().sum();
    width.iter().map(|w| w / all).collect()
}

/// The numbers of LM-63 after its `TILT=` line, wherever its lines break.
struct Numbers<'t> {
    words: Vec<(usize, &'t str)>,
    next: usize,
}

impl<'t> Numbers<'t> {
    fn new(lines: impl Iterator<Item = (usize, &'t str)>) -> Self {
        let separator = |c: char| c.is_whitespace() || c == ',';
        let words = lines.flat_map(|(number, line)| {
            let words = line.split(separator).filter(|word| !word.is_empty());
            words.map(move |word| (number, word))
        });
        Self {
            words: words.collect(),
            next: 0,
        }
    }

    fn number(&mut self, what: &str) -> Result<f64, String> {
        let Some(&(line, word)) = self.words.get(self.next) else {
            return Err(format!("ends before its {what}"));
        };
        self.next += 1;
        match word.parse() {
            Ok(number) => Ok(number),
            Err(_) => Err(format!(
                "line {line}: {what} must be a number, got {word:?}"
            )),
        }
    }

    fn count(&mut self, what: &str) -> Result<usize, String> {
        let number = self.number(what)?;
        match number >= 1.0 && number <= MOST_VALUES as f64 && number.fract() == 0.0 {
            true => Ok(number as usize),
            false => Err(format!(
                "{what} must be a whole number in [1, {MOST_VALUES}], got {number}"
            )),
        }
    }

    fn list(&mut self, count: usize, what: &str) -> Result<Vec<f64>, String> {
        (0..count).map(|_| self.number(what)).collect()
    }
}

/// IES LM-63.
fn ies(text: &str) -> Result<Planes, String> {
    let mut lines = (1..).zip(text.lines());
    let tilt = lines.find_map(|(_, line)| {
        let line = line.trim();
        line.to_ascii_uppercase()
            .starts_with("TILT")
            .then(|| line.split_once('=').map_or("", |(_, kind)| kind).trim())
    });
    let Some(tilt) = tilt else {
        return Err("is no IES LM-63 file: it has no line TILT=".to_owned());
    };
    let mut numbers = Numbers::new(lines);
    match tilt.to_ascii_uppercase().as_str() {
        "NONE" => {}
        // How the lamp burns when it is tilted: the table is of a lamp that is not.
        "INCLUDE" => {
            numbers.number("tilt's geometry")?;
            let pairs = numbers.count("number of tilt angles")?;
            numbers.list(2 * pairs, "tilt")?;
        }
        other => {
            return Err(format!(
                "TILT must be NONE or INCLUDE, got {other:?}: another file is not read"
            ));
        }
    }
    numbers.number("number of lamps")?;
    numbers.number("lumens per lamp")?;
    let multiplier = numbers.number("candela multiplier")?;
    let angles = numbers.count("number of vertical angles")?;
    let planes = numbers.count("number of horizontal angles")?;
    let kind = numbers.number("photometric type")?;
    if kind != 1.0 {
        return Err(format!(
            "the photometric type must be 1 (type C, angles from the axis), got {kind}; makers have lamps as type C, too"
        ));
    }
    if angles * planes > MOST_VALUES {
        return Err(format!(
            "must have at most {MOST_VALUES} intensities, got {angles} x {planes}"
        ));
    }
    numbers.list(4, "units, width, length and height")?;
    let ballast = numbers.number("ballast factor")?;
    numbers.list(2, "number for future use and input watts")?;
    let angles_deg = numbers.list(angles, "vertical angle")?;
    let around_deg = numbers.list(planes, "horizontal angle")?;
    let factor = multiplier * ballast;
    let plane = |_| {
        let values = numbers.list(angles, "intensity")?;
        Ok(values.iter().map(|value| factor * value).collect())
    };
    let candelas = (0..planes).map(plane).collect::<Result<_, String>>()?;
    Ok(Planes {
        angles_deg,
        around_deg,
        candelas,
    })
}

/// The lines of EULUMDAT that matter, from 1.
mod line {
    pub(super) const SYMMETRY: usize = 3;
    pub(super) const PLANES: usize = 4;
    pub(super) const PLANE_STEP: usize = 5;
    pub(super) const ANGLES: usize = 6;
    pub(super) const CONVERSION: usize = 24;
    pub(super) const SETS: usize = 26;
    pub(super) const FLUX: usize = 29;
    /// Lines of a set of lamps.
    pub(super) const PER_SET: usize = 6;
    /// Direct ratios after the sets.
    pub(super) const RATIOS: usize = 10;
}

/// EULUMDAT (Stockmar 1990): a value a line, intensities in cd per 1000 lm of the lamps.
fn eulumdat(text: &str) -> Result<Planes, String> {
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    let number = |line: usize, what: &str| -> Result<f64, String> {
        let Some(word) = lines.get(line - 1) else {
            return Err(format!("ends before its {what} (line {line})"));
        };
        // Some programs write a comma for the point.
        word.replace(',', ".")
            .parse()
            .map_err(|_| format!("line {line}: {what} must be a number, got {word:?}"))
    };
    let whole = |line: usize, what: &str, least: usize, most: usize| {
        let got = number(line, what)?;
        match got >= least as f64 && got <= most as f64 && got.fract() == 0.0 {
            true => Ok(got as usize),
            false => Err(format!(
                "line {line}: {what} must be a whole number in [{least}, {most}], got {got}"
            )),
        }
    };
    let symmetry = whole(line::SYMMETRY, "symmetry", 0, 4)?;
    let around = whole(line::PLANES, "number of C-planes", 1, 721)?;
    let angles = whole(line::ANGLES, "number of intensities in a plane", 2, 721)?;
    let conversion = number(line::CONVERSION, "conversion factor")?;
    let sets = whole(line::SETS, "number of sets of lamps", 1, 20)?;
    let flux = number(line::FLUX, "luminous flux of the lamps, lm")?;
    // Which planes are there, by the symmetry: all, one, half a circle from 0° or from 90°, a quarter.
    let (first_deg, stored) = match symmetry {
        0 => (0.0, around),
        1 => (0.0, 1),
        2 => (0.0, around / 2 + 1),
        3 => (90.0, around / 2 + 1),
        _ => (0.0, around / 4 + 1),
    };
    let step_deg = match stored {
        1 => 0.0,
        _ => number(line::PLANE_STEP, "distance between C-planes, degrees")?,
    };
    let start = line::SETS + line::PER_SET * sets + line::RATIOS + 1 + around;
    let angles_deg: Vec<f64> = (0..angles)
        .map(|i| number(start + i, "angle, degrees"))
        .collect::<Result<_, _>>()?;
    let factor = conversion * flux.abs() / 1000.0;
    let plane = |p: usize| {
        let of_plane = start + angles * (1 + p);
        let value = |i| Ok(factor * number(of_plane + i, "intensity, cd per 1000 lm")?);
        (0..angles).map(value).collect::<Result<_, String>>()
    };
    Ok(Planes {
        angles_deg,
        around_deg: (0..stored)
            .map(|p| first_deg + step_deg * p as f64)
            .collect(),
        candelas: (0..stored).map(plane).collect::<Result<_, _>>()?,
    })
}

#[cfg(test)]
mod tests;
