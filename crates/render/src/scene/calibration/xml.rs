//! Values of an XML file.

use roxmltree::{Document, Node};

use super::value::{Value, list_of, told};

/// An element or an attribute with the names that lead to it.
pub(super) struct Element<'x> {
    /// The element, or that which has the attribute.
    node: Node<'x, 'x>,
    /// Of an attribute.
    attribute: Option<&'x str>,
    path: String,
}

impl<'x> Element<'x> {
    /// Calls `read` with the outermost element of a text.
    ///
    /// # Errors
    /// The text is no XML, or none that is read safely; else those of `read`.
    pub(super) fn of_text<T>(
        text: &str,
        read: impl FnOnce(&Element<'_>) -> Result<T, String>,
    ) -> Result<T, String> {
        let document = Document::parse(text);
        let document = document.map_err(|error| format!("not XML: {error}"))?;
        read(&Element {
            node: document.root_element(),
            attribute: None,
            path: String::new(),
        })
    }

    /// Its name.
    pub(super) fn name(&self) -> &'x str {
        self.node.tag_name().name()
    }

    /// Whether it has an attribute of this value.
    pub(super) fn says(&self, name: &str, value: &str) -> bool {
        self.node.attribute(name) == Some(value)
    }

    /// All elements of a name in it, at any depth.
    pub(super) fn all(&self, name: &str) -> Vec<Self> {
        let inside = self.node.descendants();
        let found = inside.filter(|node| node.has_tag_name(name));
        found
            .map(|node| Self {
                node,
                attribute: None,
                path: name.to_owned(),
            })
            .collect()
    }
}

impl Value for Element<'_> {
    fn get(&self, name: &str) -> Option<Self> {
        let mut inside = self.node.children().filter(Node::is_element);
        let element = inside.find(|node| node.tag_name().name().eq_ignore_ascii_case(name));
        let attribute = self.node.attribute(name);
        if self.attribute.is_some() || (element.is_none() && attribute.is_none()) {
            return None;
        }
        Some(Self {
            node: element.unwrap_or(self.node),
            attribute: attribute.filter(|_| element.is_none()),
            path: self.path_of(name),
        })
    }

    fn path(&self) -> &str {
        &self.path
    }

    fn line(&self) -> usize {
        let place = self.node.document().text_pos_at(self.node.range().start);
        place.row as usize
    }

    fn written(&self) -> String {
        match self.as_text() {
            Some(text) => format!("{text:?}"),
            None => "no text".to_owned(),
        }
    }

    fn as_text(&self) -> Option<&str> {
        let text = self.attribute.or_else(|| self.node.text());
        text.map(str::trim).filter(|text| !text.is_empty())
    }

    fn as_number(&self) -> Option<f64> {
        self.as_text()?.parse().ok()
    }

    fn as_whole(&self) -> Option<u32> {
        self.as_text()?.parse().ok()
    }

    fn numbers(&self, least: usize, most: usize) -> Result<Vec<f64>, String> {
        let words: Vec<&str> = self
            .as_text()
            .unwrap_or_default()
            .split_whitespace()
            .collect();
        if !(least..=most).contains(&words.len()) {
            let got = format!("a list of {}", words.len());
            return Err(self.wrong(&list_of(least, most), got));
        }
        let number = |(i, word): (usize, &&str)| {
            let number = word.parse().ok().filter(|number: &f64| number.is_finite());
            number.ok_or_else(|| {
                let (line, path) = (self.line(), self.path());
                format!(
                    "line {line}: {path}[{i}] must be a finite number, got {}",
                    told(format_args!("{word:?}"))
                )
            })
        };
        words.iter().enumerate().map(number).collect()
    }
}
