//! Values of a file, each with its line and the names that lead to it.

use std::fmt::Display;

/// A value with the names that lead to it.
pub(super) trait Value: Sized {
    /// A field, where this is a table that has it; programs differ in capital letters.
    fn get(&self, name: &str) -> Option<Self>;

    /// The names that lead to it.
    fn path(&self) -> &str;

    /// Counted from 1.
    fn line(&self) -> usize;

    /// What it is, for messages.
    fn written(&self) -> String;

    /// The text, where it is one.
    fn as_text(&self) -> Option<&str>;

    /// The number, where it is one.
    fn as_number(&self) -> Option<f64>;

    /// The whole number, where it is one that is not negative.
    fn as_whole(&self) -> Option<u32>;

    /// Finite numbers, so many.
    fn numbers(&self, least: usize, most: usize) -> Result<Vec<f64>, String>;

    /// The names that lead to a field of it.
    fn path_of(&self, name: &str) -> String {
        match self.path() {
            "" => name.to_owned(),
            path => format!("{path}.{name}"),
        }
    }

    /// A field that must be there.
    fn required(&self, name: &str) -> Result<Self, String> {
        self.get(name).ok_or_else(|| {
            let place = match self.path() {
                "" => "it",
                path => path,
            };
            format!("line {}: {place} lacks `{name}`", self.line())
        })
    }

    /// What to say where this is not what it should be.
    fn wrong(&self, expected: &str, got: impl Display) -> String {
        let (line, path, got) = (self.line(), self.path(), told(got));
        format!("line {line}: {path} must be {expected}, got {got}")
    }

    /// A word.
    fn text(&self) -> Result<&str, String> {
        let text = self.as_text();
        text.ok_or_else(|| self.wrong("a word", self.written()))
    }

    /// A finite number.
    fn number(&self) -> Result<f64, String> {
        let finite = self.as_number().filter(|number| number.is_finite());
        finite.ok_or_else(|| self.wrong("a finite number", self.written()))
    }

    /// A whole number in `[least, most]`.
    fn whole(&self, least: u32, most: u32) -> Result<u32, String> {
        let inside = self
            .as_whole()
            .filter(|whole| (least..=most).contains(whole));
        inside.ok_or_else(|| {
            let expected = format!("a whole number in [{least}, {most}]");
            self.wrong(&expected, self.written())
        })
    }
}

/// Longest text of a file that a message holds, characters.
const MOST_TOLD: usize = 60;

/// What a file says, for messages.
pub(super) fn told(got: impl Display) -> String {
    let text = got.to_string();
    match text.char_indices().nth(MOST_TOLD) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text,
    }
}

/// Words for a list of so many numbers.
pub(super) fn list_of(least: usize, most: usize) -> String {
    match least == most {
        true => format!("a list of {least} numbers"),
        false => format!("a list of {least} to {most} numbers"),
    }
}
