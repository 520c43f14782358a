//! The embedded files against the folder that they come from, and what is said where one cannot be had.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use uw_assets::{ALL, DEFAULT_MODEL, DEFAULT_SCENE, Found, Places, SMALL, joined, shipped_name};

fn repository_assets() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets")
}

/// Places of a process with this folder named, or with this user's data.
fn places(named: Option<&Path>, data: &Path) -> Places {
    Places::new(named.map(Path::to_path_buf), None, |name| match name {
        "XDG_DATA_HOME" => Some(data.into()),
        "XDG_DATA_DIRS" => Some("/no/such/data".into()),
        _ => None,
    })
}

#[test]
fn all_that_ships_is_embedded_byte_for_byte() {
    let mut found = BTreeMap::new();
    for folder in ["models", "profiles", "vehicles", "scenes", "textures"] {
        for entry in fs::read_dir(repository_assets().join(folder)).expect(folder) {
            let path = entry.expect("an entry").path();
            let ending = path.extension().and_then(|e| e.to_str()).unwrap_or("");
            let is_recipe = ending == "toml" && ["models", "profiles"].contains(&folder);
            if path.is_file() && ending != "md" && !is_recipe {
                let name = path.file_name().expect("a name").to_string_lossy();
                found.insert(format!("{folder}/{name}"), fs::read(&path).expect("read"));
            }
        }
    }
    let names: Vec<_> = ALL.names().collect();
    assert_eq!(names.len(), found.len(), "{names:?}");
    for (name, bytes) in found {
        assert!(ALL.embedded(&name) == Some(&bytes), "{name}");
    }
    // The daemon holds no pictures.
    assert!(SMALL.files().map(|(_, bytes)| bytes.len()).sum::<usize>() < 2_000_000);
    for default in [DEFAULT_MODEL, DEFAULT_SCENE] {
        assert!(SMALL.read(default.as_ref()).is_ok(), "{default}");
    }
}

#[test]
fn shipped_paths_are_known_and_followed() {
    for (path, name) in [
        ("shipped:models/default.json", Some("models/default.json")),
        ("shipped:/models", Some("models")),
        ("shipped:scenes/../textures/t.png", Some("textures/t.png")),
        ("shipped:../../../etc/passwd", Some("etc/passwd")),
        ("models/default.json", None),
        ("./shipped:models/default.json", None),
    ] {
        assert_eq!(shipped_name(path.as_ref()).as_deref(), name, "{path}");
    }
    let scenes = Path::new("shipped:scenes");
    let texture = joined(scenes, "../textures/t.png");
    assert_eq!(shipped_name(&texture).as_deref(), Some("textures/t.png"));
    let own = Path::new("/mine");
    assert_eq!(
        joined(own, "shipped:textures/t.png"),
        Path::new("shipped:textures/t.png")
    );
    assert_eq!(joined(own, "t.png"), Path::new("/mine/t.png"));
}

#[test]
fn a_file_of_the_user_stands_before_the_embedded_one() {
    let data = tempfile::tempdir().expect("a folder");
    let name = "vehicles/default.toml";
    let find = || SMALL.find(name, &places(None, data.path())).expect("found");
    assert!(matches!(find(), Found::Embedded(bytes) if Some(bytes) == SMALL.embedded(name)));
    let own = data.path().join("uwguide").join(name);
    fs::create_dir_all(own.parent().expect("a folder")).expect("made");
    fs::write(&own, "mine").expect("written");
    assert!(matches!(find(), Found::File(path, _) if path == own));
}

#[test]
fn what_cannot_be_had_is_named_with_the_places_searched() {
    let data = tempfile::tempdir().expect("a folder");
    let told = |name: &str, named: Option<&Path>| {
        let found = ALL.find(name, &places(named, data.path()));
        found.expect_err(name).to_string()
    };
    let gone = data.path().join("gone");
    let shown = format!("{} (--assets)", gone.display());
    let error = told("models/default.json", Some(&gone));
    assert!(
        error.starts_with(&format!("{shown} is no folder")),
        "{error}"
    );
    // A folder that is named is the only one: the embedded file does not stand in.
    fs::create_dir(&gone).expect("made");
    let error = told("models/default.json", Some(&gone));
    assert!(
        error.starts_with(&format!(
            "no file models/default.json in {shown}, and nowhere else"
        )),
        "{error}"
    );
    let error = told("models/none.json", None);
    let own = format!("{}/uwguide (data of the user)", data.path().display());
    assert!(
        error.starts_with("no file models/none.json ships") && error.contains(&own),
        "{error}"
    );
}

#[test]
fn names_mean_shipped_files_where_no_file_is_called_so() {
    let named = |given: &str| SMALL.named(given.as_ref(), "profiles", "json");
    let path = named("1C").expect("a shipped profile");
    assert_eq!(path, Path::new("shipped:profiles/1C.json"));
    for other in ["1C.json", "mine/1C", "shipped:profiles/1C.json"] {
        assert_eq!(named(other).expect("a path"), Path::new(other));
    }
    let error = named("2C").expect_err("no such water").to_string();
    assert_eq!(
        error,
        "\"2C\" is neither a file nor one of the shipped profiles: 1C, 5C, 9C, IB, III"
    );
    // `src` is a folder here: what is there is what is meant.
    assert_eq!(named("src").expect("a path"), Path::new("src"));
}
