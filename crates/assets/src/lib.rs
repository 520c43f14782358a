//! The files that ship with the programs: models, profiles, vehicles, scenes, textures.
//!
//! They are embedded, so that a program stands alone. `shipped:NAME` is the path of one, as in
//! `shipped:textures/hull_red.png`: it is looked for in the folders of [`Places`] and taken from the program where none of
//! them holds it. Where a folder was named (`--assets`, `UWGUIDE_ASSETS`) nothing else is searched. No path of the machine that
//! built the program plays a part. The tables of water and spectra belong to `uw-media`, which holds them.

mod places;

use std::borrow::Cow;
use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};

pub use places::{Origin, Place, Places, VARIABLES, take_from};

/// What the path of a shipped file begins with.
pub const SCHEME: &str = "shipped:";
/// The model that is taken where none is given.
pub const DEFAULT_MODEL: &str = "shipped:models/default.json";
/// The scene that is shown where none is given.
pub const DEFAULT_SCENE: &str = "shipped:scenes/reef.toml";

/// The folder of the shipped files, whose paths are made by [`Path::join`]. Where a folder was named (`--assets`,
/// `UWGUIDE_ASSETS`) files come from there alone, else see [`Places`].
///
/// # Errors
/// A folder that was named and is none.
pub fn assets_dir() -> Result<PathBuf, AssetError> {
    Places::of_process().check()?;
    Ok(SCHEME.into())
}

/// A file within the program.
struct Embedded {
    /// Its name, as in `models/default.json`.
    name: &'static str,
    bytes: &'static [u8],
}

include!(concat!(env!("OUT_DIR"), "/embedded.rs"));

/// The small files: models, profiles, vehicles, texts of scenes. What uses this alone holds no pictures.
pub static SMALL: Shelf = Shelf {
    tables: &[&SMALL_FILES],
};
/// All files.
pub static ALL: Shelf = Shelf {
    tables: &[&SMALL_FILES, &LARGE_FILES],
};

/// A choice of the embedded files.
pub struct Shelf {
    tables: &'static [&'static [Embedded]],
}

/// Where a shipped file is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Found {
    /// In a folder: its path, and the place.
    File(PathBuf, Place),
    /// In the program.
    Embedded(&'static [u8]),
}

/// A shipped file cannot be had.
#[derive(Debug, thiserror::Error)]
pub enum AssetError {
    /// The folder that was named is none.
    #[error(
        "{0} is no folder; it must be one that holds the shipped files (make one: uw assets --copy -o DIR), or be left out"
    )]
    NoFolder(Place),
    /// The folder that was named lacks the file.
    #[error(
        "no file {name} in {place}, and nowhere else is searched because that folder was named"
    )]
    Missing {
        /// The file, as in `models/default.json`.
        name: String,
        /// The folder.
        place: Place,
    },
    /// No such file ships.
    #[error("no file {name} ships with the program, and there is none in {searched}")]
    Unknown {
        /// The file, as in `models/default.json`.
        name: String,
        /// The folders searched.
        searched: String,
    },
    /// The name is neither a file's nor a shipped one's.
    #[error("{given:?} is neither a file nor one of the shipped {folder}: {known}")]
    NoName {
        /// What was given.
        given: PathBuf,
        /// Folder of the shipped files, as in `scenes`.
        folder: String,
        /// The names that are known.
        known: String,
    },
}

impl From<AssetError> for io::Error {
    fn from(error: AssetError) -> Self {
        Self::new(io::ErrorKind::NotFound, error)
    }
}

/// The name of a shipped file or folder, as in `textures/hull_red.png`, where `path` is one's; `..` is followed within the name.
pub fn shipped_name(path: &Path) -> Option<String> {
    let rest = path.to_str()?.strip_prefix(SCHEME)?;
    let mut parts: Vec<&str> = Vec::new();
    for component in Path::new(rest).components() {
        match component {
            Component::Normal(part) => parts.push(part.to_str()?),
            Component::ParentDir => drop(parts.pop()),
            Component::CurDir | Component::RootDir | Component::Prefix(_) => {}
        }
    }
    Some(parts.join("/"))
}

/// The path of `file`, which is taken from `folder` where it is neither a shipped one's nor a whole path.
pub fn joined(folder: &Path, file: &str) -> PathBuf {
    match shipped_name(file.as_ref()) {
        Some(name) => format!("{SCHEME}{name}").into(),
        None => folder.join(file),
    }
}

impl Shelf {
    /// Where the file `name` is, as in `models/default.json`.
    ///
    /// # Errors
    /// All of [`AssetError`] but [`AssetError::NoName`].
    pub fn find(&self, name: &str, places: &Places) -> Result<Found, AssetError> {
        places.check()?;
        for place in &places.folders {
            let path = place.folder.join(name);
            if path.is_file() {
                return Ok(Found::File(path, place.clone()));
            }
        }
        let name = name.to_owned();
        match (places.folders.first(), self.embedded(&name)) {
            (Some(place), _) if places.named => Err(AssetError::Missing {
                name,
                place: place.clone(),
            }),
            (_, Some(bytes)) => Ok(Found::Embedded(bytes)),
            (_, None) => {
                let searched = places.folders.iter().map(Place::to_string);
                let searched = searched.collect::<Vec<_>>().join(", ");
                Err(AssetError::Unknown { name, searched })
            }
        }
    }

    /// The bytes of a file: a shipped one (`shipped:NAME`) or any other.
    ///
    /// # Errors
    /// Those of the system; for a shipped file [`AssetError`] within.
    pub fn read(&self, path: &Path) -> io::Result<Cow<'static, [u8]>> {
        let Some(name) = shipped_name(path) else {
            return fs::read(path).map(Cow::Owned);
        };
        match self.find(&name, &Places::of_process())? {
            Found::File(path, _) => fs::read(path).map(Cow::Owned),
            Found::Embedded(bytes) => Ok(Cow::Borrowed(bytes)),
        }
    }

    /// The same as text.
    ///
    /// # Errors
    /// Those of [`read`](Self::read), and bytes that are no UTF-8.
    pub fn read_to_string(&self, path: &Path) -> io::Result<String> {
        let bytes = self.read(path)?.into_owned();
        String::from_utf8(bytes).map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))
    }

    /// The files of a folder in order: a shipped one (`shipped:scenes`) with all that is found and embedded, or any other. None
    /// where there is no such folder.
    pub fn list(&self, folder: &Path) -> Vec<PathBuf> {
        let Some(name) = shipped_name(folder) else {
            return files_in(folder);
        };
        let places = Places::of_process();
        let shipped = |file: &str| PathBuf::from(format!("{SCHEME}{name}/{file}"));
        let mut files: Vec<PathBuf> = (places.folders.iter())
            .flat_map(|place| files_in(&place.folder.join(&name)))
            .filter_map(|path| Some(shipped(path.file_name()?.to_str()?)))
            .collect();
        if !places.named {
            let within = self
                .names()
                .filter_map(|n| n.strip_prefix(&name)?.strip_prefix('/'));
            files.extend(within.map(shipped));
        }
        files.sort();
        files.dedup();
        files
    }

    /// The path that `given` means: a shipped file of `folder` where it is one's name without `ending` and no file is called so.
    /// A `folder` is as in `scenes`, an `ending` as in `toml`.
    ///
    /// # Errors
    /// [`AssetError::NoName`] for a bare name that is neither.
    pub fn named(&self, given: &Path, folder: &str, ending: &str) -> Result<PathBuf, AssetError> {
        let is_bare = given.extension().is_none() && given.components().count() == 1;
        if !is_bare || given.exists() || shipped_name(given).is_some() {
            return Ok(given.to_path_buf());
        }
        let shipped = self.list(Path::new(&format!("{SCHEME}{folder}")));
        let mut shipped = shipped
            .into_iter()
            .filter(|path| path.extension().is_some_and(|e| e == ending))
            .collect::<Vec<_>>();
        if let Some(at) = shipped
            .iter()
            .position(|path| path.file_stem() == given.file_name())
        {
            return Ok(shipped.swap_remove(at));
        }
        let known = shipped.iter().filter_map(|path| path.file_stem()?.to_str());
        Err(AssetError::NoName {
            given: given.to_path_buf(),
            folder: folder.to_owned(),
            known: known.collect::<Vec<_>>().join(", "),
        })
    }

    /// The names of the embedded files, as in `models/default.json`.
    pub fn names(&self) -> impl Iterator<Item = &'static str> {
        self.files().map(|(name, _)| name)
    }

    /// The names and bytes of the embedded files.
    pub fn files(&self) -> impl Iterator<Item = (&'static str, &'static [u8])> {
        let all = self.tables.iter().copied().flatten();
        all.map(|file| (file.name, file.bytes))
    }

    /// The embedded bytes of the file `name`.
    pub fn embedded(&self, name: &str) -> Option<&'static [u8]> {
        self.files().find(|file| file.0 == name).map(|file| file.1)
    }
}

/// The files of a folder of the system, in order.
fn files_in(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut files: Vec<PathBuf> = entries.map(|e| e.path()).filter(|p| p.is_file()).collect();
    files.sort();
    files
}
