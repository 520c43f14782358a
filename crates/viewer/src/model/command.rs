//! The command line that renders what is set.

use std::path::Path;

use toml::{Table, Value};
use uw_render::scene::{Scene, Setting};

use super::scene_text::{inline, scene_text};
use super::{OpenScene, Settings};

/// How far two numbers may be apart that mean the same, as a share: directions are normalised when they are read.
const SAME_WITHIN: f64 = 1e-12;
/// Characters of a word that a shell takes as it is, besides letters and digits.
const PLAIN: &str = "_-./:=,@%+";

/// What a render is asked for, besides its scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Wanted {
    /// Samples per pixel.
    pub samples: u64,
    /// Width and height, pixels.
    pub size_px: (u32, u32),
    /// Seed of all random numbers.
    pub seed: u64,
    /// The layer, where it is not the picture.
    pub layer: Option<String>,
    /// Whether it is denoised.
    pub denoised: bool,
}

/// The command that renders `settings` of the open scene, whose file has `filed`.
///
/// # Errors
/// Why the file and options cannot say it, and the scene must be saved before.
pub fn command(
    open: &OpenScene,
    (filed, settings): (&Settings, &Settings),
    wanted: &Wanted,
) -> Result<String, String> {
    let path = open.path.as_ref().ok_or("the scene was never saved")?;
    let changes = changes(open, path, filed, settings)?;
    let is_shipped = uw_assets::shipped_name(path).is_some();
    let file = match is_shipped {
        true => path.clone(),
        false => std::path::absolute(path).unwrap_or_else(|_| path.clone()),
    };
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let out = match wanted.layer {
        Some(_) => format!("{stem}.exr"),
        None => format!("{stem}.png"),
    };
    // Denoising renders two halves.
    let samples = match wanted.denoised {
        true => wanted.samples.next_multiple_of(2),
        false => wanted.samples,
    };
    let (width, height) = wanted.size_px;
    let file = quoted(&file.to_string_lossy());
    let out = quoted(&out);
    let mut text = format!(
        "uw render {file} -o {out} --spp {samples} --width {width} --height {height} --seed {}",
        wanted.seed
    );
    if let Some(layer) = &wanted.layer {
        text += &format!(" --layers {}", quoted(layer));
    }
    if wanted.denoised {
        text += " --denoise";
    }
    for change in changes {
        text += &format!(" --set {}", quoted(&change));
    }
    Ok(text)
}

/// The settings that make the file's scene the one that is set, as `--set` takes them.
fn changes(
    open: &OpenScene,
    path: &Path,
    filed: &Settings,
    settings: &Settings,
) -> Result<Vec<String>, String> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let table = |settings: &Settings| -> Result<Table, String> {
        let text = scene_text(open, settings, folder);
        toml::from_str(&text).map_err(|error| error.to_string())
    };
    let (old, new) = (table(filed)?, table(settings)?);
    let text = uw_assets::ALL.read_to_string(path);
    let text = text.map_err(|error| format!("{}: {error}", path.display()))?;
    let file: Table = toml::from_str(&text).map_err(|error| error.message().to_owned())?;
    let mut reason = String::new();
    // Field by field where the file says it in the same fields, else by whole tables.
    for by_field in [true, false] {
        let found = differences(&old, &new, by_field)?;
        match says(&file, &found, path, (open, settings)) {
            Ok(()) => return Ok(found.into_iter().map(|c| c.to_string()).collect()),
            Err(why) => reason = why,
        }
    }
    Err(reason)
}

/// A value that takes the place of another.
struct Change {
    path: Vec<String>,
    value: Value,
}

impl std::fmt::Display for Change {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}={}", self.path.join("."), written(&self.value))
    }
}

/// A value as `--set` takes it: text that TOML knows as nothing else goes without quotes.
fn written(value: &Value) -> String {
    let is_word = |text: &&str| {
        text.chars().all(|c| c.is_ascii_alphanumeric() || c == '-')
            && toml::from_str::<Table>(&format!("value = {text}")).is_err()
    };
    let text = value.as_str().filter(is_word);
    text.map_or_else(|| inline(value), str::to_owned)
}

/// What differs between two scenes: fields of their tables, or whole tables.
fn differences(old: &Table, new: &Table, by_field: bool) -> Result<Vec<Change>, String> {
    let mut found = Vec::new();
    for (name, value) in new {
        let here = vec![name.clone()];
        match (old.get(name), value) {
            (Some(Value::Array(old)), Value::Array(new)) => {
                if old.len() != new.len() {
                    return Err(format!("{name}s were added or removed"));
                }
                for (i, (old, new)) in old.iter().zip(new).enumerate() {
                    let path = vec![name.clone(), element(new, i)];
                    table_differences(path, Some(old), new, by_field, &mut found);
                }
            }
            (old, new) => table_differences(here, old, new, by_field, &mut found),
        }
    }
    match old.keys().find(|name| !new.contains_key(*name)) {
        Some(gone) => Err(format!("{gone} was switched off")),
        None => Ok(found),
    }
}

/// An element of an array as a path names it: by its name where it has one that can be no number and holds no point.
fn element(table: &Value, index: usize) -> String {
    let name = table.get("name").and_then(Value::as_str);
    let is_plain = |name: &&str| {
        let mut letters = name.chars();
        letters.next().is_some_and(char::is_alphabetic)
            && letters.all(|c| c.is_alphanumeric() || "_-".contains(c))
    };
    name.filter(is_plain)
        .map_or_else(|| index.to_string(), str::to_owned)
}

fn table_differences(
    path: Vec<String>,
    old: Option<&Value>,
    new: &Value,
    by_field: bool,
    found: &mut Vec<Change>,
) {
    if old == Some(new) {
        return;
    }
    match (old.and_then(Value::as_table), new.as_table()) {
        (Some(old), Some(new)) if by_field => {
            for (field, value) in new.iter().filter(|(f, v)| old.get(*f) != Some(v)) {
                let path = path.iter().chain([field]).cloned().collect();
                let value = value.clone();
                found.push(Change { path, value });
            }
        }
        _ => found.push(Change {
            path,
            value: new.clone(),
        }),
    }
}

/// Whether the file's scene with the changes is the one that is set; objects that are the same are left out.
fn says(
    file: &Table,
    changes: &[Change],
    path: &Path,
    (open, settings): (&OpenScene, &Settings),
) -> Result<(), String> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let (mut file, mut bare) = (file.clone(), settings.clone());
    // A camera of a glTF file, or lamps of one, are with the objects.
    let is_gltf = |object: &Value| object.get("gltf").is_some();
    let is_changed = changes.iter().any(|change| change.path[0] == "object");
    if !is_changed && !settings.objects.iter().any(is_gltf) {
        file.remove("object");
        bare.objects.clear();
    }
    let parsed: Result<Vec<Setting>, String> =
        changes.iter().map(|c| c.to_string().parse()).collect();
    let text = file.to_string();
    let name = path.display().to_string();
    Scene::parse_with(&text, folder, &name, &parsed?).map_err(|error| error.to_string())?;
    for change in changes {
        put(&mut file, &change.path, &change.value);
    }
    let amended = OpenScene::parse(&file.to_string(), path);
    let (amended, read) = amended.map_err(|error| error.to_string())?;
    let table = |open: &OpenScene, settings: &Settings| -> Result<Table, String> {
        let text = scene_text(open, settings, folder);
        toml::from_str(&text).map_err(|error| error.to_string())
    };
    let (wanted, got) = (table(open, &bare)?, table(&amended, &read)?);
    match is_same(&Value::Table(wanted), &Value::Table(got)) {
        true => Ok(()),
        false => Err("options cannot say what was set".to_owned()),
    }
}

/// Puts a value where its path leads, as `--set` does.
fn put(table: &mut Table, path: &[String], value: &Value) {
    let [name, rest @ ..] = path else {
        return;
    };
    let [key, field @ ..] = rest else {
        table.insert(name.clone(), value.clone());
        return;
    };
    match table.entry(name.clone()).or_insert(Table::new().into()) {
        Value::Table(below) => put(below, rest, value),
        Value::Array(elements) => {
            let named = |(i, element): (usize, &Value)| self::element(element, i) == *key;
            if let Some(i) = elements.iter().enumerate().position(named) {
                match (&mut elements[i], field) {
                    (Value::Table(below), [_, ..]) => put(below, field, value),
                    (whole, _) => *whole = value.clone(),
                }
            }
        }
        _ => {}
    }
}

/// Whether two values mean the same.
fn is_same(a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::Float(a), Value::Float(b)) => {
            (a - b).abs() <= SAME_WITHIN * a.abs().max(b.abs()).max(1.0)
        }
        (Value::Array(a), Value::Array(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| is_same(a, b))
        }
        (Value::Table(a), Value::Table(b)) => {
            let same = |(name, a): (&String, &Value)| b.get(name).is_some_and(|b| is_same(a, b));
            a.len() == b.len() && a.iter().all(same)
        }
        (a, b) => a == b,
    }
}

/// A word as a shell takes it.
fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || PLAIN.contains(c);
    match !word.is_empty() && word.chars().all(is_plain) {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\'', r"'\''")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_survive_a_shell() {
        for (word, expected) in [
            ("/a/b.toml", "/a/b.toml"),
            ("water.jerlov=3C", "water.jerlov=3C"),
            ("water.a=[0.1, 0.2, 0.3]", "'water.a=[0.1, 0.2, 0.3]'"),
            ("it's $HOME", r"'it'\''s $HOME'"),
            ("", "''"),
        ] {
            assert_eq!(quoted(word), expected);
        }
    }

    #[test]
    fn numbers_may_differ_in_their_last_digits_alone() {
        let same = |a: f64, b: f64| is_same(&Value::Float(a), &Value::Float(b));
        assert!(same(0.1 + 0.2, 0.3) && same(0.0, 1e-17));
        assert!(!same(0.3, 0.3001) && !same(0.0, 1e-6));
    }
}
