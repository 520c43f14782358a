//! Whether picture, profile and model are of one camera with the same lamps.

use uw_calib::{Profile, Rig};

use crate::mlp::Model;
use crate::reason::Reason;
use crate::service::Loaded;

/// Why a picture of this size (pixels) does not fit the profile or the model, or these two each other; `None` where
/// nothing speaks against it.
pub fn other_camera(size_px: Option<[u32; 2]>, profile: &Profile, model: &Model) -> Option<Reason> {
    let made_for = |of: &str, rig: &Rig| {
        let (size, [width, height]) = (size_px?, rig.size_px()?);
        let same = size.map(f64::from) == [width, height];
        (!same).then(|| {
            Reason::OtherCamera(format!(
                "the picture must have {width} x {height} pixels, for which the {of} was made, got {} x {}",
                size[0], size[1]
            ))
        })
    };
    made_for("model", &model.card().rig)
        .or_else(|| made_for("profile", profile.rig()))
        .or_else(|| {
            let difference = model.card().rig.differences(profile.rig()).into_iter().next()?;
            let (field, model, profile) = (difference.field, difference.first, difference.second);
            Some(Reason::OtherCamera(format!(
                "profile and model must be of the same camera and lamps: {field} is {model} of the model and {profile} of the profile"
            )))
        })
}

impl Loaded {
    /// What may be wrong with model and profile, in words; `profile` stands for the loaded one where it is given.
    pub fn warnings(&self, profile: Option<&Profile>) -> Vec<String> {
        let profile = profile.or(self.profile.as_deref());
        let mut warnings = self.model.card().warnings();
        if let Some(profile) = profile {
            warnings.extend(profile.warnings());
            let other = other_camera(None, profile, &self.model);
            warnings.extend(other.map(|reason| reason.to_string()));
        }
        warnings
    }
}
