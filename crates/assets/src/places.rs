//! Where files are looked for before the embedded ones are taken.

use std::ffi::OsString;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use crate::AssetError;

/// Environment variables that name the folder, the first one that is set counts.
pub const VARIABLES: [&str; 2] = ["UWGUIDE_ASSETS", "UW_ASSETS"];
/// Name of the folder beside a program.
const BESIDE: &str = "assets";
/// Name of the folder in data directories.
const IN_DATA: &str = "uwguide";

/// The folder of the option `--assets`.
static OPTION: OnceLock<PathBuf> = OnceLock::new();

/// How a place came to be searched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// The option `--assets`.
    Option,
    /// This environment variable.
    Variable(&'static str),
    /// Beside the program: `assets` in its folder, or `../share/uwguide` from there.
    Program,
    /// `$XDG_DATA_HOME/uwguide`, `~/.local/share/uwguide` where that is not set.
    UserData,
    /// `uwguide` in a folder of `$XDG_DATA_DIRS`, `/usr/local/share` and `/usr/share` where that is not set.
    SystemData,
}

impl fmt::Display for Origin {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Option => "--assets",
            Self::Variable(name) => name,
            Self::Program => "beside the program",
            Self::UserData => "data of the user",
            Self::SystemData => "data of the system",
        })
    }
}

/// A folder that is searched.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The folder, which need not exist.
    pub folder: PathBuf,
    /// How it came to be searched.
    pub origin: Origin,
}

impl fmt::Display for Place {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} ({})", self.folder.display(), self.origin)
    }
}

/// The folders that are searched, in order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Places {
    /// The folders, the first one first.
    pub folders: Vec<Place>,
    /// Whether a folder was named: then it is the only one, and embedded files are not taken.
    pub named: bool,
}

impl Places {
    /// Those of this process.
    pub fn of_process() -> Self {
        let program = std::env::current_exe().ok();
        Self::new(OPTION.get().cloned(), program.as_deref(), |name| {
            std::env::var_os(name)
        })
    }

    /// Those of the folder of the option `--assets`, a program's path and the environment.
    pub fn new(
        option: Option<PathBuf>,
        program: Option<&Path>,
        variable: impl Fn(&str) -> Option<OsString>,
    ) -> Self {
        let set = |name: &str| variable(name).filter(|value| !value.is_empty());
        let of_variable = || {
            VARIABLES.iter().find_map(|&name| {
                Some(Place {
                    folder: set(name)?.into(),
                    origin: Origin::Variable(name),
                })
            })
        };
        let of_option = option.map(|folder| Place {
            folder,
            origin: Origin::Option,
        });
        if let Some(place) = of_option.or_else(of_variable) {
            return Self {
                folders: vec![place],
                named: true,
            };
        }
        let mut folders = Vec::new();
        let mut add = |folder: PathBuf, origin| folders.push(Place { folder, origin });
        if let Some(beside) = program.and_then(Path::parent) {
            add(beside.join(BESIDE), Origin::Program);
            if let Some(prefix) = beside.parent() {
                add(prefix.join("share").join(IN_DATA), Origin::Program);
            }
        }
        let home = || set("HOME").map(|home| PathBuf::from(home).join(".local/share"));
        if let Some(data) = set("XDG_DATA_HOME").map(PathBuf::from).or_else(home) {
            add(data.join(IN_DATA), Origin::UserData);
        }
        let system = set("XDG_DATA_DIRS").unwrap_or_else(|| "/usr/local/share:/usr/share".into());
        for data in std::env::split_paths(&system).filter(|data| data.is_absolute()) {
            add(data.join(IN_DATA), Origin::SystemData);
        }
        Self {
            folders,
            named: false,
        }
    }

    /// Whether the folder that was named is one; where none was named, nothing is amiss.
    ///
    /// # Errors
    /// [`AssetError::NoFolder`].
    pub fn check(&self) -> Result<(), AssetError> {
        match self.folders.first() {
            Some(place) if self.named && !place.folder.is_dir() => {
                Err(AssetError::NoFolder(place.clone()))
            }
            _ => Ok(()),
        }
    }
}

/// Takes files from `folder` alone from now on: the option `--assets`. The first call counts.
///
/// # Errors
/// [`AssetError::NoFolder`] where it is none.
pub fn take_from(folder: &Path) -> Result<(), AssetError> {
    Places::new(Some(folder.to_path_buf()), None, |_| None).check()?;
    OPTION.get_or_init(|| folder.to_path_buf());
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folders(option: Option<&str>, variables: &[(&str, &str)]) -> Vec<String> {
        let program = Path::new("/opt/uw/bin/uw");
        let places = Places::new(option.map(PathBuf::from), Some(program), |asked| {
            let found = variables.iter().find(|(name, _)| *name == asked);
            found.map(|(_, value)| OsString::from(value))
        });
        assert_eq!(places.named, places.folders.len() == 1, "{places:?}");
        places.folders.iter().map(Place::to_string).collect()
    }

    #[test]
    fn a_folder_that_is_named_is_the_only_one() {
        let both = [("UW_ASSETS", "/old"), ("UWGUIDE_ASSETS", "/new")];
        assert_eq!(folders(Some("mine"), &both), ["mine (--assets)"]);
        assert_eq!(folders(None, &both), ["/new (UWGUIDE_ASSETS)"]);
        assert_eq!(folders(None, &both[..1]), ["/old (UW_ASSETS)"]);
        // An empty variable is none.
        let empty = [("UWGUIDE_ASSETS", ""), ("UW_ASSETS", "/old")];
        assert_eq!(folders(None, &empty), ["/old (UW_ASSETS)"]);
    }

    #[test]
    fn without_one_the_program_and_data_directories_are_searched_in_order() {
        let beside = [
            "/opt/uw/bin/assets (beside the program)",
            "/opt/uw/share/uwguide (beside the program)",
        ];
        let found = folders(None, &[("HOME", "/home/me")]);
        assert_eq!(found[..2], beside);
        assert_eq!(
            found[2..],
            [
                "/home/me/.local/share/uwguide (data of the user)",
                "/usr/local/share/uwguide (data of the system)",
                "/usr/share/uwguide (data of the system)",
            ]
        );
        let named = [
            ("HOME", "/home/me"),
            ("XDG_DATA_HOME", "/data"),
            ("XDG_DATA_DIRS", "/a::relative:/b"),
        ];
        assert_eq!(
            folders(None, &named)[2..],
            [
                "/data/uwguide (data of the user)",
                "/a/uwguide (data of the system)",
                "/b/uwguide (data of the system)",
            ]
        );
    }
}
