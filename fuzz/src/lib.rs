//! What the fuzz targets share: a small model and profile.

use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

use uw_calib::Profile;
use uw_guidance::Model;
use uw_guidance::service::{Loaded, Service, Settings};

/// A model of one hidden layer of four units.
pub fn model() -> Model {
    let text = include_str!("small_model.json");
    let value = serde_json::from_str(text).expect("valid JSON");
    Model::from_json(&value).expect("a usable model")
}

/// A profile of two samples each.
pub fn profile() -> Profile {
    let text = include_str!("small_profile.json");
    Profile::from_json(&serde_json::from_str(text).expect("valid JSON")).expect("a usable profile")
}

/// One service for all inputs of a run; it reads no files.
pub fn service() -> Arc<Service> {
    static SERVICE: OnceLock<Arc<Service>> = OnceLock::new();
    let new = || {
        let loaded = Loaded {
            basis: model().into(),
            model_name: "small".to_owned(),
            model_digest: String::new(),
            profile: Some(Arc::new(profile())),
        };
        let settings = Settings {
            images: uw_guidance::service::ImagePolicy::NoFile,
            ..Settings::default()
        };
        Arc::new(Service::with_settings(loaded, settings))
    };
    Arc::clone(SERVICE.get_or_init(new))
}

/// Writes an input to a file of its own folder, for what reads files only. The folder is made once a run and stays.
pub fn as_file(name: &str, bytes: &[u8]) -> PathBuf {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    let new = || tempfile::tempdir().expect("a folder").keep();
    let path = FOLDER.get_or_init(new).join(name);
    std::fs::write(&path, bytes).expect("written");
    path
}
