//! Values of a YAML file, each with its line and the names that lead to it.

use std::fmt::Display;

use saphyr::{LoadableYamlNode as _, MarkedYaml, YamlData};

/// Largest file that is read, bytes; calibrations have less than a hundredth of it.
const MOST_BYTES: usize = 1 << 20;
/// Most brackets that may be open at a time.
const MOST_NESTED: usize = 32;

/// A value with the names that lead to it.
pub(super) struct Node<'y> {
    yaml: &'y MarkedYaml<'y>,
    path: String,
}

impl<'y> Node<'y> {
    /// Calls `read` with the first document of a text.
    ///
    /// # Errors
    /// The text is no YAML, or none that is read safely; else those of `read`.
    pub(super) fn of_text<T>(
        text: &str,
        read: impl FnOnce(&Node<'_>) -> Result<T, String>,
    ) -> Result<T, String> {
        check_extent(text)?;
        let documents =
            MarkedYaml::load_from_str(text).map_err(|error| format!("not YAML: {error}"))?;
        let Some(yaml) = documents.first() else {
            return Err("is empty".to_owned());
        };
        read(&Node {
            yaml,
            path: String::new(),
        })
    }

    /// The value itself, where a type stands before it.
    fn plain(&self) -> &'y MarkedYaml<'y> {
        match &self.yaml.data {
            YamlData::Tagged(_, value) => value,
            _ => self.yaml,
        }
    }

    /// A field, where this is a table that has it.
    pub(super) fn get(&self, name: &str) -> Option<Self> {
        let YamlData::Mapping(fields) = &self.plain().data else {
            return None;
        };
        let found = fields
            .iter()
            .find(|(key, _)| key.data.as_str() == Some(name));
        let dot = if self.path.is_empty() { "" } else { "." };
        found.map(|(_, yaml)| Self {
            yaml,
            path: format!("{}{dot}{name}", self.path),
        })
    }

    /// A field that must be there.
    pub(super) fn required(&self, name: &str) -> Result<Self, String> {
        self.get(name).ok_or_else(|| {
            let place = match self.path.as_str() {
                "" => "it",
                path => path,
            };
            format!("line {}: {place} lacks `{name}`", self.line())
        })
    }

    fn line(&self) -> usize {
        self.plain().span.start.line()
    }

    /// What to say where this is not what it should be.
    pub(super) fn wrong(&self, expected: &str, got: impl Display) -> String {
        let (line, path) = (self.line(), &self.path);
        format!("line {line}: {path} must be {expected}, got {got}")
    }

    /// What it is, for messages.
    fn written(&self) -> String {
        match &self.plain().data {
            YamlData::Sequence(items) => format!("a list of {}", items.len()),
            YamlData::Mapping(_) => "a table".to_owned(),
            data => match (data.as_integer(), data.as_floating_point(), data.as_str()) {
                (Some(whole), ..) => whole.to_string(),
                (_, Some(number), _) => number.to_string(),
                (.., Some(text)) => format!("{text:?}"),
                _ => "something else".to_owned(),
            },
        }
    }

    /// A word.
    pub(super) fn text(&self) -> Result<&'y str, String> {
        let text = self.plain().data.as_str();
        text.ok_or_else(|| self.wrong("a word", self.written()))
    }

    fn number(&self) -> Result<f64, String> {
        let data = &self.plain().data;
        let whole = data.as_integer().map(|whole| whole as f64);
        let number = whole.or_else(|| data.as_floating_point());
        let finite = number.filter(|number| number.is_finite());
        finite.ok_or_else(|| self.wrong("a finite number", self.written()))
    }

    /// A whole number in `[least, most]`.
    pub(super) fn whole(&self, least: u32, most: u32) -> Result<u32, String> {
        let whole = self.plain().data.as_integer();
        let whole = whole.and_then(|whole| u32::try_from(whole).ok());
        let inside = whole.filter(|whole| (least..=most).contains(whole));
        inside.ok_or_else(|| {
            self.wrong(
                &format!("a whole number in [{least}, {most}]"),
                self.written(),
            )
        })
    }

    /// The elements of a list of so many.
    pub(super) fn items(&self, least: usize, most: usize) -> Result<Vec<Self>, String> {
        match &self.plain().data {
            YamlData::Sequence(items) if (least..=most).contains(&items.len()) => {
                let item = |(i, yaml)| Self {
                    yaml,
                    path: format!("{}[{i}]", self.path),
                };
                Ok(items.iter().enumerate().map(item).collect())
            }
            _ => {
                let expected = match least == most {
                    true => format!("a list of {least} numbers"),
                    false => format!("a list of {least} to {most} numbers"),
                };
                Err(self.wrong(&expected, self.written()))
            }
        }
    }

    /// Finite numbers, so many.
    pub(super) fn numbers(&self, least: usize, most: usize) -> Result<Vec<f64>, String> {
        self.items(least, most)?.iter().map(Self::number).collect()
    }
}

/// Refuses what would take long to read, or many calls within each other.
fn check_extent(text: &str) -> Result<(), String> {
    if text.len() > MOST_BYTES {
        return Err(format!(
            "must have at most {MOST_BYTES} bytes, got {}",
            text.len()
        ));
    }
    let mut open = 0usize;
    for (number, line) in text.lines().enumerate() {
        let indent = line.len() - line.trim_start().len();
        for letter in line.chars() {
            match letter {
                '[' | '{' => open += 1,
                ']' | '}' => open = open.saturating_sub(1),
                _ => {}
            }
        }
        if open > MOST_NESTED || indent > 2 * MOST_NESTED || many_items(line) {
            return Err(format!("line {}: nested too deeply", number + 1));
        }
    }
    Ok(())
}

/// Whether a line may begin many lists within each other, as in `- - - 1`.
fn many_items(line: &str) -> bool {
    let items = line.split_whitespace();
    let items = items.filter(|word| matches!(*word, "-" | "?"));
    items.count() > MOST_NESTED
}
