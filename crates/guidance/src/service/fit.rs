//! Whether picture, profile and model or water file are of one camera with the same lamps, under one sun.

use uw_calib::{Profile, Rig};

use crate::card::Sun;
use crate::mlp::Model;
use crate::objective::Objective;
use crate::physics::{Water, WaterFile};
use crate::reason::Reason;
use crate::service::{Basis, Loaded};
use crate::wire::inputs::SunSeen;

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

/// Why a picture of this size (pixels) is not one of the water file's camera; `None` where nothing speaks against it.
pub(super) fn other_sensor(size_px: Option<[u32; 2]>, water: &Water) -> Option<Reason> {
    let (got, wanted) = (size_px?, water.size_px());
    let same = got.map(u64::from) == wanted.map(|side| side as u64);
    (!same).then(|| {
        Reason::OtherCamera(format!(
            "the picture must have {} x {} pixels, for which the water file was made, got {} x {}",
            wanted[0], wanted[1], got[0], got[1]
        ))
    })
}

/// Why a profile is not of the water file's camera; `None` where nothing speaks against it.
pub fn other_profile(profile: &Profile, water: &WaterFile) -> Option<Reason> {
    let of_profile = profile.rig().size_px()?;
    let of_water = [water.sensor.width_px, water.sensor.height_px];
    let same = of_profile == of_water.map(|side| side as f64);
    (!same).then(|| {
        Reason::OtherCamera(format!(
            "profile and water file must be of the same camera: pictures have {} x {} pixels for the profile and {} x {} for the water file",
            of_profile[0], of_profile[1], of_water[0], of_water[1]
        ))
    })
}

/// Why the vehicle's camera and lamps are not those of model, water file or profile; `None` where nothing speaks against it.
pub(super) fn other_vehicle(
    vehicle: &Rig,
    basis: &Basis,
    profile: Option<&Profile>,
) -> Option<Reason> {
    let (of_basis, rig) = match basis {
        Basis::Network(model) => ("model", model.card().rig),
        Basis::Physics(water) => ("water file", water.file().rig()),
    };
    let of_profile = profile.map(|profile| ("profile", profile.rig()));
    [(of_basis, &rig)]
        .into_iter()
        .chain(of_profile)
        .find_map(|(of, rig)| {
            let difference = vehicle.differences(rig).into_iter().next()?;
            Some(Reason::OtherCamera(format!(
                "vehicle and {of} must be of the same camera and lamps: {} is {} of the vehicle and {} of the {of}",
                difference.field, difference.first, difference.second
            )))
        })
}

/// Directions of sunlight in air that differ by more make another contrast, degrees (docs/limits.md).
const SAME_SUN_DEG: f64 = 20.0;

/// Why the sun of a request is not that of model or water file; `None` where nothing speaks against it. What a request leaves out is
/// taken to be the file's.
pub(super) fn other_sun(seen: SunSeen, basis: &Basis) -> Option<Reason> {
    if seen == SunSeen::default() {
        return None;
    }
    let (of, known) = match basis {
        Basis::Network(model) => ("model", model.card().training.sun?),
        Basis::Physics(water) => ("water file", water.file().tables.sun?),
    };
    let sun = Sun {
        zenith_deg: seen.zenith_deg.unwrap_or(known.zenith_deg),
        azimuth_deg: seen.azimuth_deg.unwrap_or(known.azimuth_deg),
    };
    let apart_deg = sun.apart_deg(&known);
    (apart_deg > SAME_SUN_DEG).then(|| {
        Reason::OtherSun(format!(
            "the sunlight must come within {SAME_SUN_DEG} degrees of that which the {of} was made for (zenith {} degrees, azimuth {}), got zenith {} and azimuth {}, {apart_deg:.0} degrees apart",
            known.zenith_deg, known.azimuth_deg, sun.zenith_deg, sun.azimuth_deg
        ))
    })
}

impl Loaded {
    /// Why an objective cannot be asked for by physics, or asks for what a water file without daylight has not; `None` where nothing speaks against it.
    pub fn objective_warning(&self, objective: &Objective) -> Option<String> {
        let Basis::Physics(water) = &self.basis else {
            return None;
        };
        let needs = self.basis.needs_profile(objective)?;
        match (&self.profile, water.file().tables.depth_range_m()) {
            (None, _) => Some(Reason::NoProfile(needs).to_string()),
            (Some(_), None) => Some(
                "the water file has no daylight, of which K_z and K_c of a profile are: an objective of the form \"sum\" weighs distances by them; the preset \"tracking\" asks for neither"
                    .to_owned(),
            ),
            (Some(_), Some(_)) => None,
        }
    }

    /// What may be wrong with model or water file and profile, and with them for a `vehicle`, in words; `profile` stands for the loaded
    /// one where it is given.
    pub fn warnings(&self, profile: Option<&Profile>, vehicle: &Rig) -> Vec<String> {
        let profile = profile.or(self.profile.as_deref());
        let mut warnings = match &self.basis {
            Basis::Network(model) => model.card().warnings(),
            Basis::Physics(_) => Vec::new(),
        };
        if let Some(profile) = profile {
            warnings.extend(profile.warnings());
            let other = match &self.basis {
                Basis::Network(model) => other_camera(None, profile, model),
                Basis::Physics(water) => other_profile(profile, water.file()),
            };
            let other = other.or_else(|| other_vehicle(vehicle, &self.basis, Some(profile)));
            warnings.extend(other.map(|reason| reason.to_string()));
        }
        warnings
    }
}
