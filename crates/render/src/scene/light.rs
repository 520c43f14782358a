//! Light of a scene file: sun, sky and lamps.

use uw_media::Spectrum;
use uw_media::spectral::Response;

use glam::DVec3;

use super::lamp_power::{self, Beam};
use super::photometry::Photometry;
use super::range::Range;
use super::reader::Table;
use super::value::Value;
use super::{Falloff, Lamp, SceneError, Sun, spectral};

pub(super) const SUN_FIELDS: [&str; 4] = ["zenith_deg", "azimuth_deg", "irradiance", "spectrum"];
pub(super) const SKY_FIELDS: [&str; 2] = ["radiance", "spectrum"];
pub(super) const LAMP_FIELDS: [&str; 11] = [
    "name",
    "position_m",
    "forward",
    "intensity",
    "power_w",
    "power_lm",
    "spectrum",
    "level_pct",
    "half_angle_deg",
    "falloff",
    "radius_m",
];
const FALLOFF_EXPECTED: &str =
    "\"uniform\", \"cosine\" or { file = \"beam.csv\" } (also .ies or .ldt)";
/// Difference of a photometric file's half planes, over the intensity on the axis, from which on it is told.
const UNEVEN: f64 = 0.1;
/// Longest lamp name, characters; a name becomes a layer of an image file.
const MAX_NAME_CHARS: usize = 64;

/// Reads `[sun]`.
pub(super) fn read_sun(root: &Table<'_>) -> Result<Option<Sun>, SceneError> {
    let Some(table) = root.table("sun", &SUN_FIELDS)? else {
        return Ok(None);
    };
    let zenith = table
        .number("zenith_deg", Range::below(0.0, 90.0, "degrees"))?
        .to_radians();
    let azimuth = table
        .number_or("azimuth_deg", Range::closed(-360.0, 360.0, "degrees"), 0.0)?
        .to_radians();
    let horizontal = DVec3::new(azimuth.cos(), azimuth.sin(), 0.0);
    Ok(Some(Sun {
        travel_direction: horizontal * zenith.sin() - DVec3::Z * zenith.cos(),
        irradiance: table.numbers("irradiance", Range::non_negative("W/m²"))?,
    }))
}

/// Reads `[sky]`; its radiance, W/(m² sr), is 0 when the table is left out.
pub(super) fn read_sky(root: &Table<'_>) -> Result<Spectrum, SceneError> {
    let Some(table) = root.table("sky", &SKY_FIELDS)? else {
        return Ok([0.0; 3]);
    };
    table.numbers("radiance", Range::non_negative("W/(m² sr)"))
}

/// Reads all `[[lamp]]` tables; what is to be told of them, a sentence each. A lamp's power is shared among the channels of `response`.
pub(super) fn read_lamps(
    root: &Table<'_>,
    response: &Response,
) -> Result<(Vec<Lamp>, Vec<String>), SceneError> {
    let mut lamps: Vec<Lamp> = Vec::new();
    let mut warnings = Vec::new();
    for element in root.elements("lamp")? {
        let table = element.as_table(&LAMP_FIELDS)?;
        let name = match table.optional("name") {
            Some(name) => read_name(&name)?,
            None => format!("lamp{}", lamps.len() + 1),
        };
        if lamps.iter().any(|lamp| lamp.name == name) {
            let value = table.optional("name").unwrap_or(element);
            return Err(value.invalid_got("a name that no other lamp has", format!("\"{name}\"")));
        }
        lamps.push(read_lamp(&table, name, response, &mut warnings)?);
    }
    Ok((lamps, warnings))
}

/// Adds the lamps of glTF files; names that are taken get a number.
pub(super) fn append_named(lamps: &mut Vec<Lamp>, more: Vec<Lamp>) {
    for mut lamp in more {
        let taken = |name: &str| lamps.iter().any(|other| other.name == name);
        if taken(&lamp.name) {
            let numbered = (2..).map(|number| format!("{}_{number}", lamp.name));
            lamp.name = numbered
                .into_iter()
                .find(|name| !taken(name))
                .unwrap_or_default();
        }
        lamps.push(lamp);
    }
}

fn read_name(value: &Value<'_>) -> Result<String, SceneError> {
    let name = value.as_text()?;
    if is_lamp_name(name) {
        return Ok(name.to_string());
    }
    Err(value.invalid(format!("1 to {MAX_NAME_CHARS} letters, digits, `_` or `-`")))
}

fn is_lamp_name(name: &str) -> bool {
    let allowed = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    (1..=MAX_NAME_CHARS).contains(&name.len()) && name.chars().all(allowed)
}

fn read_lamp(
    table: &Table<'_>,
    name: String,
    response: &Response,
    warnings: &mut Vec<String>,
) -> Result<Lamp, SceneError> {
    let half_angle_deg =
        table.number_or("half_angle_deg", Range::above(0.0, 180.0, "degrees"), 180.0)?;
    let radius_m = table.number_or("radius_m", Range::non_negative("m"), 0.0)?;
    let (falloff, photometry) = (table.optional("falloff"))
        .map_or(Ok((Falloff::Uniform, None)), |value| read_falloff(&value))?;
    let same_all_round = half_angle_deg == 180.0 && radius_m == 0.0 && falloff == Falloff::Uniform;
    let forward = match table.optional("forward") {
        None if same_all_round => DVec3::X,
        _ => table.direction("forward")?,
    };
    let spectrum = table
        .optional("spectrum")
        .map(|value| spectral::read_light(&value))
        .transpose()?;
    let beam = Beam {
        falloff: &falloff,
        half_angle_deg,
        spectrum: spectrum.as_ref(),
        photometry: photometry.as_ref(),
    };
    let intensity = lamp_power::read(table, &beam, response)?;
    if let Some(file) = photometry.filter(|file| file.uneven > UNEVEN) {
        warnings.push(format!(
            "lamp {name}: the half planes of its photometric file differ from their mean by up to {:.0} % of the intensity on the \
             axis; a lamp is the same all round its axis here, so the mean is taken",
            100.0 * file.uneven
        ));
    }
    Ok(Lamp {
        name,
        position_m: table.vector("position_m")?,
        forward,
        intensity,
        spectrum,
        level_pct: table.number_or("level_pct", Range::closed(0.0, 100.0, "%"), 100.0)?,
        half_angle_deg,
        falloff,
        radius_m,
    })
}

fn read_falloff(value: &Value<'_>) -> Result<(Falloff, Option<Photometry>), SceneError> {
    if value.is_table() {
        let file = value
            .as_table(&["file"])?
            .required("file", "the path of a CSV, IES or EULUMDAT file")?;
        let path = file.as_path()?;
        if !Photometry::is_meant(&path) {
            let (text, path) = spectral::read_file(&file)?;
            let beam = parse_beam(&text).map_err(|reason| file.unusable_file(&path, reason))?;
            return Ok((beam, None));
        }
        let found = Photometry::read(&path).map_err(|reason| file.unusable_file(&path, reason))?;
        let axis = found.beam[0].1;
        let relative = found.beam.iter().map(|&(angle, cd)| (angle, cd / axis));
        return Ok((Falloff::Profile(relative.collect()), Some(found)));
    }
    if !value.is_text() {
        return Err(value.invalid(FALLOFF_EXPECTED));
    }
    let known = [("uniform", Falloff::Uniform), ("cosine", Falloff::Cosine)];
    Ok((value.as_choice(&known)?, None))
}

/// Reads a beam profile: rows of angle from the axis, degrees, and relative intensity. A header row,
/// empty lines and lines that start with `#` are passed over. The table starts on the axis and is
/// scaled to 1 there, because a lamp's intensity is stated on the axis.
fn parse_beam(text: &str) -> Result<Falloff, String> {
    let mut rows: Vec<(f64, f64)> = Vec::new();
    let mut header_allowed = true;
    for (number, line) in text
        .lines()
        .enumerate()
        .map(|(i, line)| (i + 1, line.trim()))
    {
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let header = std::mem::take(&mut header_allowed);
        match parse_beam_row(line) {
            Some(row) => rows.push(
                check_beam_row(row, rows.last())
                    .map_err(|what| format!("line {number}: {what}"))?,
            ),
            None if header => {}
            None => {
                return Err(format!(
                    "line {number}: must be angle_deg,relative, got {line}"
                ));
            }
        }
    }
    match rows.first() {
        Some(&(angle_deg, axis)) if rows.len() >= 2 && angle_deg == 0.0 && axis > 0.0 => {
            Ok(Falloff::Profile(
                rows.iter()
                    .map(|(angle_deg, relative)| (*angle_deg, relative / axis))
                    .collect(),
            ))
        }
        Some((angle_deg, axis)) if rows.len() >= 2 => Err(format!(
            "the first row must be 0 degrees with a relative intensity > 0, got {angle_deg},{axis}"
        )),
        _ => Err(format!(
            "must have at least two rows angle_deg,relative, got {}",
            rows.len()
        )),
    }
}

fn parse_beam_row(line: &str) -> Option<(f64, f64)> {
    let (angle_deg, relative) = line.split_once(',')?;
    Some((
        angle_deg.trim().parse().ok()?,
        relative.trim().parse().ok()?,
    ))
}

fn check_beam_row(row: (f64, f64), before: Option<&(f64, f64)>) -> Result<(f64, f64), String> {
    let (angle_deg, relative) = row;
    if !(0.0..=180.0).contains(&angle_deg) || before.is_some_and(|before| angle_deg <= before.0) {
        return Err(format!(
            "the angle must rise from row to row within [0, 180] degrees, got {angle_deg}"
        ));
    }
    if !(0.0..=1e12).contains(&relative) {
        return Err(format!(
            "the relative intensity must be a finite number >= 0, got {relative}"
        ));
    }
    Ok(row)
}

impl Falloff {
    /// Relative intensity at an angle from the axis, degrees in [0, 180]; 0 beyond the end of a profile.
    pub fn relative(&self, angle_deg: f64) -> f64 {
        match self {
            Falloff::Uniform => 1.0,
            Falloff::Cosine => angle_deg.to_radians().cos().max(0.0),
            Falloff::Profile(rows) => interpolate(rows, angle_deg),
        }
    }
}

fn interpolate(rows: &[(f64, f64)], angle_deg: f64) -> f64 {
    let after = rows.partition_point(|row| row.0 <= angle_deg);
    match (
        after.checked_sub(1).map(|before| rows[before]),
        rows.get(after),
    ) {
        (Some((x0, y0)), Some((x1, y1))) => y0 + (y1 - y0) * (angle_deg - x0) / (x1 - x0),
        (Some((x0, y0)), None) if x0 == angle_deg => y0,
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_beam_table_is_scaled_to_its_axis_and_interpolated() {
        let beam =
            parse_beam("# lamp\nangle_deg,relative\n0,200\n10,100\n\n30, 0\n").expect("valid");
        for (angle_deg, expected) in [
            (0.0, 1.0),
            (5.0, 0.75),
            (10.0, 0.5),
            (20.0, 0.25),
            (30.0, 0.0),
            (90.0, 0.0),
        ] {
            assert!(
                (beam.relative(angle_deg) - expected).abs() < 1e-15,
                "{angle_deg}"
            );
        }
        let flat_end = parse_beam("0,1\n60,0.5").expect("valid");
        assert_eq!(
            (flat_end.relative(60.0), flat_end.relative(60.001)),
            (0.5, 0.0)
        );
    }

    #[test]
    fn a_bad_beam_table_says_what_is_wrong_in_which_line() {
        let refused = [
            ("0,1\n5,0.5\n5,0.4\n", "line 3: the angle must rise"),
            (
                "0,1\n5,-0.5\n",
                "line 2: the relative intensity must be a finite number >= 0, got -0.5",
            ),
            ("0,1\n5,nan\n", "line 2: the relative intensity"),
            ("0,1\n190,1\n", "line 2: the angle"),
            (
                "0,1\nfive,1\n",
                "line 2: must be angle_deg,relative, got five,1",
            ),
            ("5,1\n10,1\n", "the first row must be 0 degrees"),
            ("0,0\n10,1\n", "relative intensity > 0"),
            ("angle,relative\n0,1\n", "at least two rows"),
        ];
        for (text, expected) in refused {
            let reason = parse_beam(text).expect_err(text);
            assert!(reason.contains(expected), "{text}: {reason}");
        }
    }

    #[test]
    fn cosine_lamps_are_dark_behind() {
        assert!((Falloff::Cosine.relative(60.0) - 0.5).abs() < 1e-15);
        assert_eq!(Falloff::Cosine.relative(120.0), 0.0);
    }
}
