//! `[water] profile`, `jerlov_profile` and `[[water.plume]]`: how the water differs from place to place.

use uw_media::spectral::{JerlovWater, Response, WaterBands, WaterSpectrum};
use uw_media::{DepthLayer, Iops, WaterType, depth_profile};

use super::phase::{WATER_FIELDS, read_types, refused};
use super::range::Range;
use super::reader::Table;
use super::spectral::read_file;
use super::value::Value;
use super::{Layer, Plume, SceneError, Variation, WaterSurface};

const LAYER_FIELDS: [&str; 5] = ["depth_m", "jerlov", "spectrum", "a", "b"];
const PLUME_FIELDS: [&str; 4] = ["center_m", "sigma_m", "a", "b"];
const LAYER_EXPECTED: &str = "a Jerlov water type, a spectrum, or a and b in 1/m";
/// Most entries of a profile, and most clouds.
const MOST: usize = 64;
/// Smallest standard deviation of a cloud, m.
const LEAST_SIGMA_M: f64 = 1e-3;
/// Share of the clouds that counts in the coefficients that stand for all the water.
const OF_PLUMES: f64 = 0.25;

/// What makes the water of `table` differ with depth: `profile` or `jerlov_profile`.
pub(super) fn profile_field<'d>(table: &Table<'d>) -> Option<Value<'d>> {
    let of = |field| table.optional(field);
    of("jerlov_profile").or_else(|| of("profile"))
}

/// The profile of `water` with its bands; `None` where the water is the same at every depth. `response` is the camera's.
pub(super) fn read_profile(
    water: &Table<'_>,
    response: &Response,
) -> Result<Option<Vec<Layer>>, SceneError> {
    if let Some(value) = water.optional("jerlov_profile") {
        for field in ["profile", "jerlov", "spectrum", "a", "b"] {
            water.refuse(field, "where water.jerlov_profile is given")?;
        }
        return read_typical(water, &value, response).map(Some);
    }
    let Some(profile) = water.optional("profile") else {
        return Ok(None);
    };
    for field in ["jerlov", "spectrum", "a", "b"] {
        water.refuse(field, "where water.profile is given, whose entries hold it")?;
    }
    let elements = profile.as_elements()?;
    if elements.is_empty() || elements.len() > MOST {
        return Err(profile.invalid_got(format!("1 to {MOST} entries"), elements.len().to_string()));
    }
    let named = water.optional("bands").is_some();
    let bands = read_bands(water)?;
    let mut layers: Vec<Layer> = Vec::with_capacity(elements.len());
    for element in &elements {
        let layer = read_layer(element, bands, response)?;
        check_depth(element, &layers, layer.depth_m)?;
        let by_wavelength = layers.first().map(|first| first.spectrum.is_some());
        if by_wavelength.is_some_and(|all| all != layer.spectrum.is_some()) {
            return Err(element.invalid(
                "by wavelength as the entries before it (jerlov or spectrum), or in three numbers as they are (a and b, or \
                 jerlov with water.bands = \"mean\")",
            ));
        }
        layers.push(layer);
    }
    let three_numbers = |element: &Value<'_>| {
        let table = element.as_table(&LAYER_FIELDS);
        table.is_ok_and(|table| table.optional("a").is_some())
    };
    if named && elements.iter().all(three_numbers) {
        water.refuse(
            "bands",
            "where a and b of the profile hold for the channels as they are",
        )?;
    }
    Ok(Some(layers))
}

/// The bands that hold for all entries.
fn read_bands(water: &Table<'_>) -> Result<WaterBands, SceneError> {
    match water.optional("bands") {
        None => Ok(WaterBands::default()),
        Some(value) => {
            let bands = value.as_text()?.parse();
            bands.map_err(|error| refused(&value, error))
        }
    }
}

/// The layers below a surface of the type that `value` names: each the same from its upper to its lower side, with jumps
/// between them, since the source tells one type for a whole layer; below the last known layer its water goes on.
fn read_typical(
    water: &Table<'_>,
    value: &Value<'_>,
    response: &Response,
) -> Result<Vec<Layer>, SceneError> {
    let at_surface: Result<WaterType, _> = value.as_text()?.parse();
    let at_surface = at_surface.map_err(|error| refused(value, error))?;
    let bands = read_bands(water)?;
    let blamed = water.optional("bands");
    let blamed = blamed.as_ref().unwrap_or(value);
    let mut layers: Vec<Layer> = Vec::new();
    for DepthLayer {
        top_m, water_type, ..
    } in depth_profile(at_surface)
    {
        let layer = of_type(*top_m, bands, (*water_type).into(), response, blamed)?;
        if let Some(above) = layers.last() {
            layers.push(Layer {
                depth_m: *top_m,
                ..above.clone()
            });
        }
        layers.push(layer);
    }
    Ok(layers)
}

/// A sentence where a camera at the height `z_m` is below the layers that the source of `jerlov_profile` knows.
pub(super) fn below_known(
    root: &Table<'_>,
    surface: Option<&WaterSurface>,
    z_m: f64,
) -> Result<Option<String>, SceneError> {
    let Some(water) = root.table("water", &WATER_FIELDS)? else {
        return Ok(None);
    };
    let (Some(value), Some(surface)) = (water.optional("jerlov_profile"), surface) else {
        return Ok(None);
    };
    let at_surface: Result<WaterType, _> = value.as_text()?.parse();
    let at_surface = at_surface.map_err(|error| refused(&value, error))?;
    let last = depth_profile(at_surface).last();
    let depth_m = surface.height_m - z_m;
    let below = last.filter(|last| depth_m > last.bottom_m);
    Ok(below.map(|last| {
        format!(
            "water.jerlov_profile {at_surface} is known down to {} m; the camera is {depth_m} m deep, in water of the type {} \
             that goes on from the last known layer",
            last.bottom_m, last.water_type
        )
    }))
}

/// Water of Jerlov's scale at a depth; `blamed` is told where `bands` do not cover it.
fn of_type(
    depth_m: f64,
    bands: WaterBands,
    water: JerlovWater,
    response: &Response,
    blamed: &Value<'_>,
) -> Result<Layer, SceneError> {
    let spectrum = bands.spectrum(water);
    let iops = bands.iops(water, response);
    Ok(Layer {
        depth_m,
        iops: iops.map_err(|error| refused(blamed, error))?,
        spectrum: spectrum.map_err(|error| refused(blamed, error))?,
    })
}

/// Depths grow; two entries at one depth are a jump.
fn check_depth(element: &Value<'_>, before: &[Layer], depth_m: f64) -> Result<(), SceneError> {
    let table = element.as_table(&LAYER_FIELDS)?;
    let Some(value) = table.optional("depth_m") else {
        return Ok(());
    };
    let Some(last) = before.last() else {
        return Ok(());
    };
    if depth_m < last.depth_m {
        return Err(value.invalid(format!(
            "at least {} m, the depth of the entry before it",
            last.depth_m
        )));
    }
    if before.len() > 1 && before[before.len() - 2].depth_m == depth_m {
        return Err(value.invalid(format!(
            "more than {depth_m} m, at which two entries make a jump already"
        )));
    }
    Ok(())
}

fn read_layer(
    element: &Value<'_>,
    bands: WaterBands,
    response: &Response,
) -> Result<Layer, SceneError> {
    let table = element.as_table(&LAYER_FIELDS)?;
    let depth_m = table.number("depth_m", Range::non_negative("m"))?;
    let of_spectrum = |spectrum: WaterSpectrum| Layer {
        depth_m,
        iops: spectrum.near_zero_range(response),
        spectrum: Some(spectrum),
    };
    if let Some(file) = table.optional("spectrum") {
        for field in ["jerlov", "a", "b"] {
            table.refuse(field, "where the entry's spectrum is given")?;
        }
        let (text, path) = read_file(&file)?;
        let spectrum = WaterSpectrum::parse(&text);
        let spectrum = spectrum.map_err(|error| file.unusable_file(&path, error.to_string()))?;
        return Ok(of_spectrum(spectrum));
    }
    if let Some(jerlov) = table.optional("jerlov") {
        for field in ["a", "b"] {
            table.refuse(field, "where the entry's jerlov is given")?;
        }
        let water = read_types(&jerlov)?;
        return of_type(depth_m, bands, water, response, &jerlov);
    }
    if table.optional("a").is_none() && table.optional("b").is_none() {
        return Err(table.missing("jerlov", LAYER_EXPECTED));
    }
    Ok(Layer {
        depth_m,
        iops: read_triples(&table)?,
        spectrum: None,
    })
}

fn read_triples(table: &Table<'_>) -> Result<Iops, SceneError> {
    let coefficient = |field| table.numbers(field, Range::non_negative("1/m"));
    Ok(Iops {
        a: coefficient("a")?,
        b: coefficient("b")?,
    })
}

/// The clouds of `water`.
pub(super) fn read_plumes(water: &Table<'_>) -> Result<Vec<Plume>, SceneError> {
    let elements = water.elements("plume")?;
    if let Some(beyond) = elements.get(MOST) {
        return Err(beyond.invalid_got(
            format!("left out: at most {MOST} clouds"),
            elements.len().to_string(),
        ));
    }
    let read = |element: &Value<'_>| {
        let table = element.as_table(&PLUME_FIELDS)?;
        Ok(Plume {
            centre_m: table.vector("center_m")?,
            sigma_m: table.number("sigma_m", Range::at_least(LEAST_SIGMA_M, "m"))?,
            iops: read_triples(&table)?,
        })
    };
    elements.iter().map(read).collect()
}

/// The spectrum that stands for all layers: their mean; `None` where they are known in three bands.
pub(super) fn mean_spectrum(layers: &[Layer]) -> Option<WaterSpectrum> {
    let mut mean: Option<WaterSpectrum> = None;
    for (i, layer) in layers.iter().enumerate() {
        let own = layer.spectrum.clone()?;
        mean = Some(match mean {
            None => own,
            Some(mean) => mean.towards(&own, 1.0 / (i + 1) as f64),
        });
    }
    mean
}

impl Variation {
    /// Whether the water is the same everywhere.
    pub fn is_none(&self) -> bool {
        let same =
            |pair: &[Layer]| pair[0].iops == pair[1].iops && pair[0].spectrum == pair[1].spectrum;
        self.plumes.is_empty() && self.layers.windows(2).all(same)
    }

    /// What the clouds add to the coefficients that stand for all the water.
    pub(crate) fn share_of_plumes(&self) -> Iops {
        let sum = |of: fn(&Iops) -> [f64; 3]| {
            let plumes = self.plumes.iter().map(|plume| of(&plume.iops));
            plumes.fold([0.0; 3], |sum, own| {
                std::array::from_fn(|k| sum[k] + OF_PLUMES * own[k])
            })
        };
        Iops {
            a: sum(|iops| iops.a),
            b: sum(|iops| iops.b),
        }
    }

    /// Coefficients that stand for all the water, of which `homogeneous` is the part without layers.
    pub fn mean_iops(&self, homogeneous: Iops) -> Iops {
        let n = self.layers.len().max(1) as f64;
        let plumes = self.share_of_plumes();
        let mean = |of: fn(&Iops) -> [f64; 3]| {
            let layers = self.layers.iter().map(|layer| of(&layer.iops));
            let sum = layers.fold([0.0; 3], |sum, own| {
                std::array::from_fn(|k| sum[k] + own[k] / n)
            });
            let base = if self.layers.is_empty() {
                of(&homogeneous)
            } else {
                sum
            };
            std::array::from_fn(|k| base[k] + of(&plumes)[k])
        };
        Iops {
            a: mean(|iops| iops.a),
            b: mean(|iops| iops.b),
        }
    }
}
