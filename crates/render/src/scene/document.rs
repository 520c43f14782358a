//! The text of a scene file.

use std::path::Path;

/// The text of a scene file and where it comes from.
pub(super) struct Document<'a> {
    /// Name for error messages.
    pub(super) file: &'a str,
    /// The whole text.
    pub(super) text: &'a str,
    /// Folder that paths in the file start from.
    pub(super) base_dir: &'a Path,
}

impl Document<'_> {
    /// Line, counted from 1, of a byte offset.
    pub(super) fn line_at(&self, offset: usize) -> usize {
        let before = &self.text.as_bytes()[..offset.min(self.text.len())];
        1 + before.iter().filter(|&&byte| byte == b'\n').count()
    }
}

/// The names, each in backquotes.
pub(super) fn listed(names: &[&str]) -> String {
    names
        .iter()
        .map(|name| format!("`{name}`"))
        .collect::<Vec<_>>()
        .join(", ")
}
