//! Values of a YAML file, each with its line and the names that lead to it.

use saphyr::{LoadableYamlNode as _, MarkedYaml, YamlData};

use super::value::{Value, list_of};

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
            _ => Err(self.wrong(&list_of(least, most), self.written())),
        }
    }
}

impl Value for Node<'_> {
    fn get(&self, name: &str) -> Option<Self> {
        let YamlData::Mapping(fields) = &self.plain().data else {
            return None;
        };
        let is_meant = |key: &str| key.eq_ignore_ascii_case(name);
        let mut fields = fields.iter();
        let found = fields.find(|(key, _)| key.data.as_str().is_some_and(is_meant));
        found.map(|(_, yaml)| Self {
            yaml,
            path: self.path_of(name),
        })
    }

    fn path(&self) -> &str {
        &self.path
    }

    fn line(&self) -> usize {
        self.plain().span.start.line()
    }

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

    fn as_text(&self) -> Option<&str> {
        self.plain().data.as_str()
    }

    fn as_number(&self) -> Option<f64> {
        let data = &self.plain().data;
        let whole = data.as_integer().map(|whole| whole as f64);
        whole.or_else(|| data.as_floating_point())
    }

    fn as_whole(&self) -> Option<u32> {
        let whole = self.plain().data.as_integer();
        whole.and_then(|whole| u32::try_from(whole).ok())
    }

    fn numbers(&self, least: usize, most: usize) -> Result<Vec<f64>, String> {
        self.items(least, most)?.iter().map(Self::number).collect()
    }
}

/// Refuses what would take long to read, or many calls within each other.
fn check_extent(text: &str) -> Result<(), String> {
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
