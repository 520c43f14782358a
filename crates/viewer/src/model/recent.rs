//! The files opened last.

use std::path::{Path, PathBuf};

use uw_render::image::write_bytes;

/// Files that are kept.
const MOST: usize = 10;

/// The files opened last, the newest first, kept in a file of their own.
#[derive(Clone, Debug, Default)]
pub struct Recent {
    store: Option<PathBuf>,
    paths: Vec<PathBuf>,
}

impl Recent {
    /// Those of the user; kept nowhere without a folder for them.
    pub fn of_user() -> Self {
        state_folder().map_or_else(Self::default, |f| Self::stored_in(f.join("recent.json")))
    }

    /// Those kept in `store`; none where it cannot be read.
    pub fn stored_in(store: PathBuf) -> Self {
        let text = std::fs::read_to_string(&store).unwrap_or_default();
        let mut paths: Vec<PathBuf> = serde_json::from_str(&text).unwrap_or_default();
        paths.truncate(MOST);
        Self {
            store: Some(store),
            paths,
        }
    }

    /// The files, the newest first.
    pub fn paths(&self) -> &[PathBuf] {
        &self.paths
    }

    /// Puts a file first. That the list cannot be stored is no reason to disturb: it then lasts for this run.
    pub fn add(&mut self, path: &Path) {
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
        self.paths.retain(|p| *p != path);
        self.paths.insert(0, path);
        self.paths.truncate(MOST);
        if let (Some(store), Ok(text)) = (&self.store, serde_json::to_string(&self.paths)) {
            keep(store, &text);
        }
    }
}

/// The folder of what lasts: below `XDG_STATE_HOME`, `%LOCALAPPDATA%` or `~/.local/state`; `None` without any.
pub fn state_folder() -> Option<PathBuf> {
    let named = |name: &str| std::env::var_os(name).map(PathBuf::from);
    let folder = named("XDG_STATE_HOME")
        .filter(|path| path.is_absolute())
        .or_else(|| named("LOCALAPPDATA"))
        .or_else(|| Some(named("HOME")?.join(".local/state")));
    Some(folder?.join("uw-viewer"))
}

/// Writes a file of what lasts. That it cannot be kept is no reason to disturb.
pub(super) fn keep(store: &Path, text: &str) {
    let folder = store.parent().unwrap_or(Path::new(""));
    let _ = std::fs::create_dir_all(folder);
    let _ = write_bytes(store, text.as_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_comes_first_once_and_lasts() {
        let folder = tempfile::tempdir().expect("folder");
        let store = folder.path().join("deep/recent.json");
        let mut recent = Recent::stored_in(store.clone());
        for i in 0..15 {
            recent.add(Path::new(&format!("/s/{i}.toml")));
        }
        recent.add(Path::new("/s/12.toml"));
        let again = Recent::stored_in(store);
        assert_eq!(again.paths(), recent.paths());
        assert_eq!(again.paths().len(), MOST);
        assert_eq!(again.paths()[0], Path::new("/s/12.toml"));
        assert_eq!(again.paths()[1], Path::new("/s/14.toml"));
    }
}
