//! From a reply of the protocol to a message.

use serde_json::Value;

use super::CameraAxis;
use super::messages::{Header, Suggestion, Vector3};

/// The message of a reply.
pub(super) fn suggestion(reply: &Value, header: Header, axis: CameraAxis) -> Suggestion {
    let text = |name: &str| reply[name].as_str().unwrap_or_default().to_owned();
    let number = |name: &str| some(&reply[name]);
    let words = |names: [&Value; 2]| {
        let found = names.iter().find_map(|value| value.as_str());
        found.unwrap_or_default().to_owned()
    };
    let error = &reply["error"];
    let reason = words([&reply["reason"], &error["code"]]);
    let message = words([&reply["message"], &error["message"]]);
    let valid = reply["valid"] == true;
    let delta_distance_m = number("delta_distance_m");
    Suggestion {
        header,
        valid,
        action: match valid {
            true => text("action"),
            false => "hold".to_owned(),
        },
        reason,
        message,
        why: text("why"),
        warnings: warnings(&reply["warnings"]),
        distance_m: number("distance_m"),
        light_pct: number("light_pct"),
        level_pct: number("level_pct"),
        delta_distance_m,
        delta_light_pct: number("delta_light_pct"),
        displacement: along(axis, -delta_distance_m),
        predicted_contrast: three(&reply["predicted_contrast"]),
        predicted_contrast_error: three(&reply["predicted_contrast_error"]),
        predicted_here: three(&reply["predicted_here"]),
        predicted_here_error: three(&reply["predicted_here_error"]),
        residual_here: three(&reply["residual_here"]["contrast"]),
        residual_misfit: some(&reply["residual_here"]["misfit"]),
        score: number("score"),
        score_here: number("score_here"),
        gain: number("gain"),
        predictor: text("predictor"),
    }
}

fn some(value: &Value) -> f64 {
    value.as_f64().unwrap_or(f64::NAN)
}

fn three(values: &Value) -> [f64; 3] {
    [0, 1, 2].map(|k| some(&values[k]))
}

/// A way towards the target in the frame of the camera.
fn along(axis: CameraAxis, way_m: f64) -> Vector3 {
    // Not -0: it reads badly.
    let way_m = way_m + 0.0;
    match axis {
        CameraAxis::X => Vector3 {
            x: way_m,
            y: 0.0,
            z: 0.0,
        },
        CameraAxis::Z => Vector3 {
            x: 0.0,
            y: 0.0,
            z: way_m,
        },
    }
}

fn warnings(list: &Value) -> Vec<String> {
    let words = |warning: &Value| {
        let word = |name: &str| warning[name].as_str().unwrap_or_default().to_owned();
        format!("{}: {}", word("reason"), word("message"))
    };
    list.as_array()
        .map(|list| list.iter().map(words).collect())
        .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_reply_becomes_a_message() {
        let reply = json!({
            "ok": true, "valid": true, "action": "move", "reason": null, "message": null, "why": "nearer",
            "warnings": [{"reason": "other_sun", "message": "30 degrees"}],
            "distance_m": 1.2, "light_pct": 40.0, "delta_distance_m": -0.3, "delta_light_pct": 5.0,
            "predicted_contrast": [1.0, null, 3.0], "score": 0.5, "score_here": 0.25, "gain": 0.25,
            "residual_here": {"contrast": [0.5, -0.5, null], "misfit": 0.2}, "predictor": "physics",
        });
        let header = Header {
            frame_id: "camera_optical".to_owned(),
            ..Header::default()
        };
        let made = suggestion(&reply, header.clone(), CameraAxis::Z);
        assert!(made.valid && made.action == "move" && made.reason.is_empty());
        assert_eq!(made.header, header);
        assert_eq!(made.warnings, ["other_sun: 30 degrees"]);
        // Towards the target is where the camera looks.
        assert_eq!((made.displacement.z, made.displacement.x), (0.3, 0.0));
        let of_body = suggestion(&reply, header, CameraAxis::X);
        assert_eq!((of_body.displacement.x, of_body.displacement.z), (0.3, 0.0));
        assert_eq!(made.predicted_contrast[2], 3.0);
        assert!(made.predicted_contrast[1].is_nan() && made.level_pct.is_nan());
        assert_eq!((made.residual_here[1], made.residual_misfit), (-0.5, 0.2));
    }

    #[test]
    fn errors_hold() {
        let reply = json!({
            "ok": false, "valid": false, "reason": "outside_calibration", "error": {"code": "out_of_range", "message": "9 m"},
        });
        let made = suggestion(&reply, Header::default(), CameraAxis::Z);
        assert!(!made.valid && made.action == "hold");
        assert_eq!(
            (made.reason.as_str(), made.message.as_str()),
            ("outside_calibration", "9 m")
        );
        assert!(made.distance_m.is_nan() && made.displacement.z.is_nan());
        let wrong = json!({"ok": false, "error": {"code": "bad_image", "message": "no picture"}});
        let made = suggestion(&wrong, Header::default(), CameraAxis::Z);
        assert_eq!(
            (made.action.as_str(), made.reason.as_str()),
            ("hold", "bad_image")
        );
    }
}
