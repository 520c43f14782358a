//! The text of a scene file.

use std::path::{Path, PathBuf};

use uw_assets::{joined, shipped_name};

/// The text of a scene file and where it comes from.
pub(super) struct Document<'a> {
    /// Name for error messages.
    pub(super) file: &'a str,
    /// The whole text: the file's, then the settings.
    pub(super) text: &'a str,
    /// Where the settings begin, bytes.
    pub(super) settings_from: usize,
    /// Folder that paths in the file start from.
    pub(super) base_dir: &'a Path,
}

impl Document<'_> {
    /// Line, counted from 1, of a byte offset.
    pub(super) fn line_at(&self, offset: usize) -> usize {
        let before = &self.text.as_bytes()[..offset.min(self.text.len())];
        1 + before.iter().filter(|&&byte| byte == b'\n').count()
    }

    /// The path that a value at the byte `offset` means. It starts from the folder of the scene file. Nobody can put a file into that of a
    /// shipped scene, so a setting then means a file of the working directory where there is one.
    pub(super) fn path(&self, written: &str, offset: usize) -> PathBuf {
        let is_setting = offset >= self.settings_from;
        let is_here = || Path::new(written).is_file();
        if is_setting && shipped_name(self.base_dir).is_some() && is_here() {
            return written.into();
        }
        joined(self.base_dir, written)
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
