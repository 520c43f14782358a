//! Settings that take the place of values of a scene file, such as `water.jerlov=3C` from a command line.

use std::borrow::Cow;
use std::fmt;
use std::ops::Range;
use std::str::FromStr;

use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue};

use super::SceneError;

/// Arrays of tables that a scene file has.
const ARRAYS: [&str; 2] = ["lamp", "object"];
/// Fields of `[water]` that tell the whole water; a and b do so together.
const WATERS: [&str; 7] = [
    "jerlov",
    "spectrum",
    "profile",
    "jerlov_profile",
    "fitted",
    "a",
    "b",
];
/// How a setting is written.
const EXPECTED: &str = "KEY=VALUE, such as water.jerlov=3C or lamp.left.level_pct=50";
/// Name of the value where it is parsed.
const NAME: &str = "value";

/// A field of a scene file, by its path, and the value that it gets.
///
/// Parts of the path are joined by points. An element of an array goes by its number, counted from 0, a lamp also by its
/// name. The value is TOML; a bare word is text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    /// As the user wrote it.
    written: String,
    path: Vec<String>,
    /// The value as TOML.
    value: String,
}

impl FromStr for Setting {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("must be {EXPECTED}");
        let (key, value) = text.split_once('=').ok_or_else(wrong)?;
        let path: Vec<String> = key.split('.').map(|part| part.trim().to_owned()).collect();
        let value = value.trim();
        if value.is_empty() || path.iter().any(String::is_empty) {
            return Err(wrong());
        }
        Ok(Self {
            written: text.to_owned(),
            path,
            value: as_toml(value)?,
        })
    }
}

impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.written)
    }
}

/// A value as TOML: as it is, or in quotes where it is a bare word.
fn as_toml(value: &str) -> Result<String, String> {
    match DeTable::parse(&format!("{NAME} = {value}")) {
        Ok(_) => Ok(value.to_owned()),
        Err(error) if value.starts_with(['[', '{', '"', '\'']) || value.contains('\n') => {
            let reason = error.message().replace('\n', ", ");
            Err(format!("the value is not valid TOML: {reason}"))
        }
        Err(_) => Ok(toml::Value::String(value.to_owned()).to_string()),
    }
}

/// The text of a scene file with settings below it, so that every value, from wherever it comes, has a place in one text.
pub(super) struct Amended<'s> {
    /// The file's text, then a line for each setting.
    pub(super) text: String,
    /// Where in `text` each setting begins.
    starts: Vec<usize>,
    /// Each setting alone, behind as many spaces as it has text before it.
    padded: Vec<String>,
    settings: &'s [Setting],
}

impl<'s> Amended<'s> {
    pub(super) fn new(text: &str, settings: &'s [Setting]) -> Self {
        let mut amended = Self {
            text: text.to_owned(),
            starts: Vec::new(),
            padded: Vec::new(),
            settings,
        };
        for setting in settings {
            amended.text.push('\n');
            let start = amended.text.len();
            let line = format!("{NAME} = {}", setting.value);
            amended.starts.push(start);
            amended.padded.push(" ".repeat(start) + &line);
            amended.text += &line;
        }
        amended
    }

    /// Puts the settings into the tables of the file, the later ones over the earlier.
    pub(super) fn apply<'i>(&'i self, root: &mut Spanned<DeValue<'i>>) -> Result<(), SceneError> {
        for (setting, padded) in self.settings.iter().zip(&self.padded) {
            let refused = |reason| SceneError::Setting {
                setting: setting.to_string(),
                reason,
            };
            let parsed = DeTable::parse(padded);
            let parsed = parsed.map_err(|error| refused(error.message().to_owned()))?;
            if let Some(value) = parsed.into_inner().remove(NAME) {
                forget_water(root, &setting.path);
                set(root, "", &setting.path, value).map_err(refused)?;
            }
        }
        Ok(())
    }

    /// An error in a line that is a setting names the setting in place of file and line.
    pub(super) fn blame(&self, error: SceneError) -> SceneError {
        let Some((file, line)) = error.place() else {
            return error;
        };
        let line_of = |start: &usize| 1 + self.text[..*start].matches('\n').count();
        let found = self.starts.iter().rposition(|start| line_of(start) <= line);
        let Some(setting) = found.map(|i| &self.settings[i]) else {
            return error;
        };
        let (text, prefix) = (error.to_string(), format!("{file}:{line}: "));
        SceneError::Setting {
            setting: setting.to_string(),
            reason: text.strip_prefix(&prefix).unwrap_or(&text).to_owned(),
        }
    }
}

/// Takes what told the water before out of the scene, where `path` leads to what tells it from now on.
fn forget_water(root: &mut Spanned<DeValue<'_>>, path: &[String]) {
    let [table, new] = path else {
        return;
    };
    let DeValue::Table(root) = root.get_mut() else {
        return;
    };
    let water = root.get_mut("water").filter(|_| table == "water");
    let Some(DeValue::Table(water)) = water.map(Spanned::get_mut) else {
        return;
    };
    if !WATERS.contains(&new.as_str()) {
        return;
    }
    let is_pair = |field: &str| ["a", "b"].contains(&field);
    for old in WATERS {
        if old != new && !(is_pair(old) && is_pair(new)) {
            water.remove(old);
        }
    }
    // What the new water tells itself.
    let told: &[&str] = match new.as_str() {
        "fitted" => &["bands", "phase"],
        "spectrum" | "a" | "b" => &["bands"],
        _ => &[],
    };
    for field in told {
        water.remove(*field);
    }
}

/// Sets what `path` leads to from `node`, whose own path is `here`; tables on the way that are not there are made.
fn set<'i>(
    node: &mut Spanned<DeValue<'i>>,
    here: &str,
    path: &[String],
    new: Spanned<DeValue<'i>>,
) -> Result<(), String> {
    let Some((key, rest)) = path.split_first() else {
        *node = new;
        return Ok(());
    };
    let below = if here.is_empty() {
        key.clone()
    } else {
        format!("{here}.{key}")
    };
    let kind = node.get_ref().type_str();
    match node.get_mut() {
        DeValue::Table(table) if rest.is_empty() => {
            table.remove(key.as_str());
            table.insert(spanned_key(key, new.span()), new);
            Ok(())
        }
        DeValue::Table(table) => {
            if here.is_empty()
                && ARRAYS.contains(&key.as_str())
                && !table.contains_key(key.as_str())
            {
                return Err(format!("the scene file has no [[{key}]]"));
            }
            if !table.contains_key(key.as_str()) {
                let empty = DeValue::Table(DeTable::new());
                table.insert(
                    spanned_key(key, new.span()),
                    Spanned::new(new.span(), empty),
                );
            }
            match table.get_mut(key.as_str()) {
                Some(inner) => set(inner, &below, rest, new),
                None => Ok(()),
            }
        }
        DeValue::Array(array) => {
            let index = element(array, here, key)?;
            match array.get_mut(index) {
                Some(inner) => set(inner, &below, rest, new),
                None => Ok(()),
            }
        }
        _ => Err(format!(
            "{here} is no table but a value ({kind}), so that it has no `{key}`"
        )),
    }
}

fn spanned_key<'i>(key: &str, span: Range<usize>) -> Spanned<Cow<'i, str>> {
    Spanned::new(span, Cow::Owned(key.to_owned()))
}

/// Index of the element of `array` that `key` means: its number from 0, or the name of a lamp.
fn element(array: &DeArray<'_>, here: &str, key: &str) -> Result<usize, String> {
    let names: Vec<Option<String>> = array
        .iter()
        .enumerate()
        .map(|(i, element)| {
            let table = element.get_ref().as_table()?;
            let name = table.get("name").and_then(|name| name.get_ref().as_str());
            let default = || (here == "lamp").then(|| format!("lamp{}", i + 1));
            name.map(str::to_owned).or_else(default)
        })
        .collect();
    let named = names.iter().position(|name| name.as_deref() == Some(key));
    let numbered = key.parse().ok().filter(|index| *index < array.len());
    named.or(numbered).ok_or_else(|| {
        let known: Vec<String> = names
            .iter()
            .enumerate()
            .map(|(i, name)| match name {
                Some(name) => format!("{i} ({name})"),
                None => i.to_string(),
            })
            .collect();
        format!("{here} has no element `{key}`; it has {}", known.join(", "))
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::scene::Scene;

    const SCENE: &str = r#"
        format = "uw-scene/1"
        [water]
        jerlov = "IB"
        [camera]
        position_m = [0.0, 0.0, 0.0]
        forward = [1.0, 0.0, 0.0]
        hfov_deg = 60.0
        width = 32
        height = 18
        [[lamp]]
        name = "left"
        position_m = [0.0, 0.3, 0.0]
        intensity = [10.0, 10.0, 10.0]
        [[lamp]]
        position_m = [0.0, -0.3, 0.0]
        intensity = [8.0, 10.0, 12.0]
        level_pct = 25.0
    "#;

    fn read(settings: &[&str]) -> Result<Scene, String> {
        let settings: Result<Vec<Setting>, String> = settings.iter().map(|s| s.parse()).collect();
        Scene::parse_with(SCENE, Path::new("."), "pool.toml", &settings?).map_err(|e| e.to_string())
    }

    #[test]
    fn values_of_every_kind_can_be_set() {
        let scene = read(&[
            "camera.width=640",
            "lamp.left.level_pct=50",
            "lamp.1.level_pct = 75",
            "lamp.lamp2.name=right",
            "camera.position_m.2=-3",
            "water.phase={ model = \"petzold\" }",
            "water.bands=600-700,500-600,400-500",
            "water.jerlov=3C",
            "surface.height_m=2",
            "surface.height_m=1.5",
        ])
        .expect("valid");
        assert_eq!((scene.camera.width, scene.camera.height), (640, 18));
        let levels: Vec<f64> = scene.lamps.iter().map(|lamp| lamp.level_pct).collect();
        assert_eq!(levels, [50.0, 75.0]);
        assert_eq!(scene.lamps[1].name, "right");
        assert_eq!(scene.camera.position_m.z, -3.0);
        assert_eq!(scene.surface.map(|surface| surface.height_m), Some(1.5));
        let other = SCENE.replace("\"IB\"", "\"3C\"\nbands = \"600-700,500-600,400-500\"");
        let other = Scene::parse(&other, Path::new("."), "other").expect("valid");
        let coefficients = |scene: &Scene| {
            scene
                .water
                .as_ref()
                .map(|water| (water.iops.a, water.iops.b))
        };
        assert_eq!(coefficients(&scene), coefficients(&other));
    }

    /// Each way of telling the water takes the place of every other, with what goes with it.
    #[test]
    fn another_water_takes_the_place_of_that_of_the_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let rows = [400, 450, 500, 550, 600, 650, 700].map(|nm| format!("{nm},0.1,0.2\n"));
        let table = format!("wavelength_nm,a_per_m,b_per_m\n{}", rows.concat());
        let fitted = r#"{"format": "uw-water/1", "water": {"a_per_m": [0.4, 0.1, 0.2], "b_per_m": [0.3, 0.3, 0.3],
            "backscatter_fraction": 0.02, "particle_index": 1.1}}"#;
        std::fs::write(folder.path().join("sea.csv"), table).expect("written");
        std::fs::write(folder.path().join("w.json"), fitted).expect("written");
        let ways = [
            "water.jerlov=3C",
            "water.spectrum=sea.csv",
            "water.fitted=w.json",
            "water.jerlov_profile=IB",
            "water.profile=[{ depth_m = 0, jerlov = \"II\" }]",
        ];
        let read = |settings: &[&str]| {
            let settings: Result<Vec<Setting>, String> =
                settings.iter().map(|text| text.parse()).collect();
            let text = SCENE.replace("\"IB\"", "\"IB\"\nbands = \"mean\"");
            let text = text + "\n[surface]\nheight_m = 2.0\n";
            let settings = settings.expect("settings");
            let scene = Scene::parse_with(&text, folder.path(), "pool.toml", &settings);
            scene.map(|scene| format!("{:?}", scene.water))
        };
        for last in ways {
            // Bands hold for types on the scale and for profiles of them, and go with the rest.
            let bands = last.contains("jerlov").then_some("water.bands=mean");
            let with_bands = |settings: &[&'static str]| -> Vec<&'static str> {
                settings.iter().copied().chain(bands).collect()
            };
            let alone = read(&with_bands(&[last])).expect(last);
            for first in ways {
                let after = read(&with_bands(&[first, last]));
                assert_eq!(after.expect(last), alone, "{first} {last}");
            }
            let three = ["water.a=[0.1, 0.1, 0.1]", "water.b=[0.2, 0.2, 0.2]"];
            let own = read(&[last, three[0], three[1]]).expect(last);
            assert_eq!(own, read(&three).expect("a and b"), "{last}");
        }
        // A fitted water tells its phase function.
        let phase = "water.phase={ model = \"petzold\" }";
        let fitted = read(&[phase, "water.fitted=w.json"]).expect("fitted");
        assert_eq!(fitted, read(&["water.fitted=w.json"]).expect("fitted"));
        let half = read(&["water.a=[0.1, 0.1, 0.1]"]).expect_err("b is missing");
        assert!(half.to_string().contains("`b`"), "{half}");
    }

    #[test]
    fn what_cannot_be_set_is_refused_by_its_option() {
        for (setting, words) in [
            (
                "water.jerlow=3C",
                &[
                    "--set water.jerlow=3C: unknown field `jerlow` in water",
                    "`jerlov`",
                ][..],
            ),
            (
                "waters.jerlov=3C",
                &["--set waters.jerlov=3C: unknown field `waters`", "`water`"],
            ),
            (
                "water.jerlov=4C",
                &["--set water.jerlov=4C: water.jerlov", "\"4C\""],
            ),
            (
                "camera.width=0",
                &["--set camera.width=0: camera.width must be", "got 0"],
            ),
            (
                "camera.width=wide",
                &[
                    "--set camera.width=wide: camera.width must be",
                    "got \"wide\"",
                ],
            ),
            ("camera.width.x=1", &["camera.width is no table", "`x`"]),
            (
                "lamp.middle.level_pct=1",
                &["lamp has no element `middle`", "0 (left), 1 (lamp2)"],
            ),
            ("lamp.2.level_pct=1", &["lamp has no element `2`"]),
            (
                "lamp.left.level=1",
                &[
                    "--set lamp.left.level=1: unknown field `level` in lamp 1",
                    "level_pct",
                ],
            ),
            ("object.0.gltf=x.glb", &["the scene file has no [[object]]"]),
            (
                "sun.zenith_deg=30",
                &["--set sun.zenith_deg=30: sun lacks the required field `irradiance`"],
            ),
            ("water.phase={model=", &["not valid TOML"]),
            ("water.jerlov", &["must be KEY=VALUE"]),
            ("=3", &["must be KEY=VALUE"]),
            ("water..a=3", &["must be KEY=VALUE"]),
            ("water.jerlov=", &["must be KEY=VALUE"]),
        ] {
            let error = read(&[setting]).err().unwrap_or_default();
            for word in words {
                assert!(error.contains(word), "{setting}: {word:?} not in {error:?}");
            }
            assert!(!error.contains("pool.toml:"), "{setting}: {error}");
        }
    }

    #[test]
    fn errors_of_the_file_keep_their_line() {
        let settings = ["camera.width=640".parse().expect("a setting")];
        let text = SCENE.replace("level_pct = 25.0", "level_pc = 25.0");
        let error = Scene::parse_with(&text, Path::new("."), "pool.toml", &settings).err();
        let error = error.map(|e| e.to_string()).unwrap_or_default();
        assert!(
            error.starts_with("pool.toml:18: unknown field `level_pc`"),
            "{error}"
        );
    }
}
