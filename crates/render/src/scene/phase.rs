//! `[water]`: coefficients, bands and phase function, handed to the media crate with their place in the file.

use std::str::FromStr;

use uw_media::phase::{
    Draine, FournierForand, HenyeyGreenstein, Mixture, Phase, Rayleigh, Tabulated,
};
use uw_media::spectral::{JerlovWater, Response, WaterBands};
use uw_media::{Iops, MediaError, WaterType, meant};

use super::range::Range;
use super::reader::Table;
use super::value::Value;
use super::{Layer, SceneError, Spectral, Variation, Water, fitted, variation};

pub(super) const WATER_FIELDS: [&str; 12] = [
    "jerlov",
    "bands",
    "spectrum",
    "profile",
    "jerlov_profile",
    "plume",
    "snow",
    "fitted",
    "a",
    "b",
    "phase",
    "refractive_index",
];
const PHASE_FIELDS: [&str; 9] = [
    "model",
    "n",
    "backscatter_fraction",
    "mu",
    "g",
    "depolarisation",
    "alpha",
    "file",
    "parts",
];
/// What `jerlov` may be besides the name of a type.
const TYPES_EXPECTED: &str = "a Jerlov water type such as \"3C\", or what lies between two of them as \"1C-3C@0.4\" or \
     { between = [\"1C\", \"3C\"], share = 0.4 }";
/// Relative refractive index and backscatter fraction of the default phase function: the Fournier-Forand
/// function closest to Petzold's average particle.
pub(super) const DEFAULT_PARTICLES: (f64, f64) = (1.10, 0.0183);
/// Refractive index of sea water against air.
const DEFAULT_REFRACTIVE_INDEX: f64 = 1.34;

/// Which fields a phase function model has besides `model`.
#[derive(Clone, Copy)]
enum Model {
    FournierForand,
    HenyeyGreenstein,
    Rayleigh,
    Petzold,
    Draine,
    Isotropic,
    Table,
    Mix,
}

const MODELS: [(&str, Model); 8] = [
    ("fournier-forand", Model::FournierForand),
    ("henyey-greenstein", Model::HenyeyGreenstein),
    ("rayleigh", Model::Rayleigh),
    ("petzold", Model::Petzold),
    ("draine", Model::Draine),
    ("isotropic", Model::Isotropic),
    ("table", Model::Table),
    ("mix", Model::Mix),
];

impl Model {
    fn fields(self) -> &'static [&'static str] {
        match self {
            Model::FournierForand => &["n", "backscatter_fraction", "mu"],
            Model::HenyeyGreenstein => &["g"],
            Model::Rayleigh => &["depolarisation"],
            Model::Petzold | Model::Isotropic => &[],
            Model::Draine => &["g", "alpha"],
            Model::Table => &["file"],
            Model::Mix => &["parts"],
        }
    }
}

/// Reads `[water]`.
pub(super) fn read_water(
    root: &Table<'_>,
    spectral: Option<&Spectral>,
) -> Result<Option<Water>, SceneError> {
    let Some(table) = root.table("water", &WATER_FIELDS)? else {
        return Ok(None);
    };
    let (n, backscatter_fraction) = DEFAULT_PARTICLES;
    let fitted = fitted::read(&table)?;
    let phase = match (&fitted, table.optional("phase")) {
        (Some(fitted), _) => fitted.phase.clone(),
        (None, Some(value)) => read_phase(&value)?,
        (None, None) => Phase::FournierForand(
            FournierForand::new(n, backscatter_fraction)
                .map_err(|error| table.missing("phase", &error.to_string()))?,
        ),
    };
    let index_range = Range::closed(1.0, 2.0, "");
    let of_file = fitted.map(|fitted| fitted.iops);
    let (iops, variation) = read_coefficients(root, &table, (spectral, of_file))?;
    Ok(Some(Water {
        iops,
        variation,
        phase,
        refractive_index: table.number_or(
            "refractive_index",
            index_range,
            DEFAULT_REFRACTIVE_INDEX,
        )?,
    }))
}

/// Coefficients, and how they differ from place to place.
fn read_coefficients(
    root: &Table<'_>,
    table: &Table<'_>,
    (spectral, of_file): (Option<&Spectral>, Option<Iops>),
) -> Result<(Iops, Variation), SceneError> {
    let boxes = Response::boxes();
    let response = spectral.map_or(&boxes, |spectral| &spectral.response);
    let profile = variation::read_profile(table, response)?;
    if let (Some(value), None) = (variation::profile_field(table), root.optional("surface")) {
        return Err(value.invalid("left out without [surface], from which depths are counted"));
    }
    let homogeneous = match (&profile, spectral, of_file) {
        (Some(layers), ..) => layers[0].iops,
        (None, _, Some(of_file)) => of_file,
        (None, Some(spectral), None) => spectral.wideband(),
        (None, None, None) => read_iops(table)?,
    };
    let mut variation = Variation {
        layers: profile.unwrap_or_default(),
        plumes: variation::read_plumes(table)?,
    };
    if variation.layers.is_empty() && !variation.plumes.is_empty() {
        variation.layers.push(Layer {
            depth_m: 0.0,
            iops: homogeneous,
            spectrum: spectral.and_then(|spectral| spectral.water.clone()),
        });
    }
    Ok((variation.mean_iops(homogeneous), variation))
}

fn read_iops(table: &Table<'_>) -> Result<Iops, SceneError> {
    if let Some(jerlov) = read_jerlov(table)? {
        let iops = jerlov.bands.iops(jerlov.water, &Response::boxes());
        return iops.map_err(|error| refused(&jerlov.source, error));
    }
    if table.optional("a").is_none() && table.optional("b").is_none() {
        return Err(table.missing("jerlov", "a Jerlov water type, or a and b in 1/m"));
    }
    table.refuse(
        "bands",
        "where water.a and water.b are given, which hold for the channels as they are",
    )?;
    let coefficient = |field| table.numbers(field, Range::non_negative("1/m"));
    Ok(Iops {
        a: coefficient("a")?,
        b: coefficient("b")?,
    })
}

/// What `[water]` says of Jerlov's types.
pub(super) struct Jerlov<'d> {
    pub(super) water: JerlovWater,
    pub(super) bands: WaterBands,
    /// The value to blame where the bands do not cover the water.
    pub(super) source: Value<'d>,
}

/// Reads `jerlov` and `bands` of `[water]`; `None` without the first.
pub(super) fn read_jerlov<'d>(table: &Table<'d>) -> Result<Option<Jerlov<'d>>, SceneError> {
    let Some(jerlov) = table.optional("jerlov") else {
        return Ok(None);
    };
    for field in ["a", "b"] {
        table.refuse(field, "where water.jerlov is given")?;
    }
    let water = read_types(&jerlov)?;
    let (bands, source) = match table.optional("bands") {
        None => (WaterBands::default(), jerlov),
        Some(value) => {
            let bands = value.as_text()?.parse();
            (bands.map_err(|error| refused(&value, error))?, value)
        }
    };
    Ok(Some(Jerlov {
        water,
        bands,
        source,
    }))
}

/// The type or the two types of `jerlov`.
pub(super) fn read_types(jerlov: &Value<'_>) -> Result<JerlovWater, SceneError> {
    let one = |value: &Value<'_>| {
        WaterType::from_str(value.as_text()?).map_err(|error| refused(value, error))
    };
    if !jerlov.is_table() {
        if !jerlov.is_text() {
            return Err(jerlov.invalid(TYPES_EXPECTED));
        }
        let text = jerlov.as_text()?;
        return match text.contains('@') {
            true => text.parse().map_err(|_| jerlov.invalid(TYPES_EXPECTED)),
            false => one(jerlov).map(JerlovWater::from),
        };
    }
    let table = jerlov.as_table(&["between", "share"])?;
    let between = table.required("between", "two Jerlov water types")?;
    let [from, to] = &between.as_elements()?[..] else {
        return Err(between.invalid("two Jerlov water types"));
    };
    Ok(JerlovWater {
        from: one(from)?,
        to: one(to)?,
        share: table.number("share", Range::closed(0.0, 1.0, ""))?,
    })
}

fn read_phase(value: &Value<'_>) -> Result<Phase, SceneError> {
    let table = value.as_table(&PHASE_FIELDS)?;
    let words: Vec<&str> = MODELS.iter().map(|(word, _)| *word).collect();
    let name = table.required("model", &format!("one of {}", words.join(", ")))?;
    let model = name.as_choice(&MODELS)?;
    for field in PHASE_FIELDS[1..]
        .iter()
        .filter(|field| !model.fields().contains(field))
    {
        table.refuse(field, &format!("for the model {}", name.written()))?;
    }
    let number = |field| table.number(field, Range::finite(""));
    let phase = match model {
        Model::FournierForand => read_fournier_forand(&table)?.map(Phase::FournierForand),
        Model::HenyeyGreenstein => HenyeyGreenstein::new(number("g")?).map(Phase::HenyeyGreenstein),
        Model::Rayleigh => {
            Rayleigh::new(table.number_or("depolarisation", Range::finite(""), 0.0)?)
                .map(Phase::Rayleigh)
        }
        Model::Petzold => Ok(Phase::Tabulated(Tabulated::petzold())),
        Model::Draine => Draine::new(number("g")?, number("alpha")?).map(Phase::Draine),
        Model::Isotropic => Ok(Phase::Isotropic),
        Model::Table => return read_table(&table.required("file", "the path of a CSV file")?),
        Model::Mix => Mixture::new(read_parts(
            &table.required("parts", "a list of {weight, phase}")?,
        )?)
        .map(Phase::Mixture),
    };
    phase.map_err(|error| refused_field(&table, value, error))
}

fn read_fournier_forand(
    table: &Table<'_>,
) -> Result<Result<FournierForand, MediaError>, SceneError> {
    let n = table.number("n", Range::finite(""))?;
    if table.optional("mu").is_some() {
        table.refuse("backscatter_fraction", "where mu is given")?;
        return Ok(FournierForand::from_mu(
            n,
            table.number("mu", Range::finite(""))?,
        ));
    }
    let backscatter_fraction =
        table.required("backscatter_fraction", "a number in (0, 0.5), or mu")?;
    Ok(FournierForand::new(
        n,
        backscatter_fraction.as_number(Range::finite(""))?,
    ))
}

fn read_table(file: &Value<'_>) -> Result<Phase, SceneError> {
    let path = file.as_path()?;
    let text = uw_assets::ALL
        .read_to_string(&path)
        .map_err(|error| file.unusable_file(&path, error.to_string()))?;
    let table =
        Tabulated::from_csv_text(&text, &path.display().to_string()).map_err(
            |error| match error {
                MediaError::BadRow { row, problem, .. } => {
                    file.unusable_file(&path, format!("line {row}: {problem}"))
                }
                MediaError::BadTable { problem, .. } => file.unusable_file(&path, problem),
                other => file.unusable_file(&path, other.to_string()),
            },
        )?;
    Ok(Phase::Tabulated(table))
}

fn read_parts(parts: &Value<'_>) -> Result<Vec<(f64, Phase)>, SceneError> {
    let mut read = Vec::new();
    for part in parts.as_elements()? {
        let table = part.as_table(&["weight", "phase"])?;
        let weight = table.number("weight", Range::positive(""))?;
        read.push((
            weight,
            read_phase(&table.required("phase", "a phase function")?)?,
        ));
    }
    Ok(read)
}

/// An error of the media crate about one value of the file.
pub(super) fn refused(value: &Value<'_>, error: MediaError) -> SceneError {
    match error {
        MediaError::OutOfRange { expected, .. } => value.invalid(expected),
        MediaError::UnknownName { known, .. } => value.invalid_got(
            format!("one of {known}"),
            match meant(value.as_text().unwrap_or_default(), &known) {
                Some(name) => format!("{} (did you mean {name:?}?)", value.written()),
                None => value.written(),
            },
        ),
        MediaError::BadInterval { expected, .. } => value.invalid(expected),
        other => value.invalid_got(other.to_string(), value.written()),
    }
}

/// An error of the media crate about one field of a table, or about all of it.
fn refused_field(table: &Table<'_>, whole: &Value<'_>, error: MediaError) -> SceneError {
    match &error {
        MediaError::OutOfRange { field, .. } => {
            refused(table.optional(field).as_ref().unwrap_or(whole), error)
        }
        _ => refused(whole, error),
    }
}
