//! Levels that lamps are set to, beside the light that they give: inside, light is all that counts.

use serde_json::Value;
use uw_calib::vehicle::LevelCurve;

use crate::wire::inputs::Inputs;
use crate::wire::reply::{Fields, LIGHT_DECIMALS, rounded};
use crate::wire::request::Op;

/// Turns the level of a request into light, by the vehicle's curve where it has one.
pub(super) fn read_level(op: &mut Op, curve: Option<&LevelCurve>) {
    let (Op::State(inputs)
    | Op::Suggest { inputs, .. }
    | Op::SuggestImage { inputs, .. }
    | Op::Predict { inputs, .. }) = op
    else {
        return;
    };
    let Inputs {
        light_pct,
        level_pct,
        ..
    } = inputs;
    if let Some(level) = level_pct.take() {
        *light_pct = Some(curve.map_or(level, |curve| curve.light_pct(level)));
    }
}

/// Adds the level beside the light of a reply and of its target.
pub(super) fn tell_level(fields: &mut Fields, curve: Option<&LevelCurve>) {
    let Some(curve) = curve else { return };
    add(fields, curve);
    if let Some(Value::Object(target)) = fields.get_mut("target") {
        add(target, curve);
    }
}

fn add(fields: &mut Fields, curve: &LevelCurve) {
    if let Some(light_pct) = fields.get("light_pct").and_then(Value::as_f64) {
        let level = rounded(
            curve.level_pct(light_pct.clamp(0.0, 100.0)),
            LIGHT_DECIMALS + 1,
        );
        fields.insert("level_pct".to_owned(), level.into());
    }
}
