//! Model, profile and settings as JSON.

use serde_json::{Value, json};
use uw_calib::{Mask, Profile, Rig, Undistortion};

use crate::mlp::Model;
use crate::objective::{ContrastTerm, DepthTerm, Form, Objective};
use crate::physics::WaterFile;
use crate::service::Settings;
use crate::wire::reply::{self, SHARE_DECIMALS};

pub(super) fn model(model: &Model, name: &str) -> Value {
    let inputs: Vec<&str> = model.inputs().iter().map(|input| input.name).collect();
    let card = model.card();
    let ranges: Option<Vec<Value>> = card.ranges.as_ref().map(|ranges| {
        let named = model.inputs().iter().zip(ranges);
        named
            .map(|(input, [min, max])| {
                json!({"name": input.name, "unit": input.unit, "min": min, "max": max})
            })
            .collect()
    });
    let mut described = json!({
        "name": name, "inputs": inputs, "layer_widths": model.layer_widths(),
        "trained_range": ranges, "training": card.training.to_json(),
    });
    add_rig(&mut described, &card.rig);
    described
}

/// A water file: what it is of, its camera, and where it holds.
pub(super) fn water(water: &WaterFile, name: &str) -> Value {
    json!({
        "name": name, "made_by": water.made_by, "water": water.water, "sensor": water.sensor,
        "distance_m": water.tables.distance_range_m(), "depth_m": water.tables.depth_range_m(),
        "sights": water.sights.len(),
    })
}

/// Camera, sensor and lamps; null where nothing is stated.
fn add_rig(described: &mut Value, rig: &Rig) {
    let mut stated = rig.to_json();
    for section in Rig::SECTIONS {
        described[section] = stated.remove(section).unwrap_or(Value::Null);
    }
}

pub(super) fn profile(profile: &Profile) -> Value {
    let mut described = json!({
        "depth_m": profile.depth_range_m(),
        "distance_m": profile.distance_range_m(),
        "source": profile.source(),
    });
    if let Some(depths_m) = profile.contrast_depth_m() {
        described["contrast_depth_m"] = json!(depths_m);
    }
    if let Some(corrected) = profile.corrected() {
        described["noise_corrected"] = json!(corrected.source.name());
    }
    add_rig(&mut described, profile.rig());
    described
}

pub(super) fn objective(objective: &Objective) -> Value {
    json!({
        "lambda_c": objective.lambda_c,
        "lambda_d": objective.lambda_d,
        "kappa_b": objective.kappa_b,
        "kappa_c": objective.kappa_c,
        "contrast": match objective.contrast {
            ContrastTerm::Sum => "sum",
            ContrastTerm::Mean => "mean",
        },
        "contrast_scale": objective.contrast_scale,
        "depth_term": match objective.depth_term {
            DepthTerm::Z => "z",
            DepthTerm::OnePlusHalfZ => "1+z/2",
        },
        "form": match objective.form {
            Form::Sum => "sum",
            Form::Overlap => "overlap",
        },
        "half_contrast": objective.half_contrast,
        "sharpness": objective.sharpness,
        "touch_distance_m": objective.touch_distance_m,
        "distance_m": objective.distance_m,
        "light_pct": objective.light_pct,
    })
}

/// How images are measured.
fn images(settings: &Settings) -> Value {
    let treatment = &settings.treatment;
    let mask = |mask: &Mask| json!({"left_out": reply::rounded(mask.share(), SHARE_DECIMALS)});
    let undistortion = |lens: &Undistortion| {
        json!({
            "stored_px": lens.far().from_px(),
            "ideal_px": lens.ideal_px(),
            "hfov_deg": lens.hfov_deg(),
        })
    };
    json!({
        "noise": settings.noise.source().name(),
        "mask": treatment.mask.as_ref().map(mask),
        "undistortion": treatment.undistortion.as_ref().map(undistortion),
    })
}

pub(super) fn settings(settings: &Settings) -> Value {
    let (age, steering, beams) = (&settings.max_age, &settings.steering, &settings.beams);
    let checks = &settings.checks;
    let mut described = json!({
        "checks": {
            "training": checks.training.name(),
            "training_margin": checks.training_margin,
            "max_misfit": checks.max_misfit,
            "misfit": checks.misfit.name(),
            "min_gain": checks.min_gain,
            "other_camera": checks.other_camera.name(),
            "other_depth": checks.other_depth.name(),
            "depth_margin_m": checks.depth_margin_m,
            "noise_floor": checks.noise_floor.name(),
            "saturation": checks.saturation.name(),
            "max_saturated": checks.max_saturated,
            "other_sun": checks.other_sun.name(),
            "oblique": checks.oblique.name(),
            "max_obliqueness_deg": checks.max_obliqueness_deg,
            "processing": checks.processing.name(),
        },
        "images": images(settings),
        "max_age": {
            "depth_s": age.depth_s,
            "distance_s": age.distance_s,
            "light_s": age.light_s,
            "image_s": age.image_s,
        },
        "steering": {
            "min_gain": steering.min_gain,
            "distance_rate_m_per_s": steering.distance_rate_m_per_s,
            "light_rate_pct_per_s": steering.light_rate_pct_per_s,
            "distance_deadband_m": steering.distance_deadband_m,
            "light_deadband_pct": steering.light_deadband_pct,
        },
        "beams": {"tilt_deg": beams.tilt_deg, "azimuths_deg": beams.azimuths_deg},
    });
    if let Some(curve) = &settings.level_curve {
        described["level_curve"] = json!(curve);
    }
    if !settings.vehicle.is_empty() {
        described["vehicle"] = settings.vehicle.to_json().into();
    }
    described
}
