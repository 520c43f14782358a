//! What advice has to pass: the model knows the place, the residual at the present place, the gain.

use serde_json::json;
use uw_calib::Profile;
use uw_guidance::{
    Advice, Checks, Model, Objective, Observation, Reason, Strictness, advise, advise_checked,
};

use crate::support::{Numbers, echo_model, profile};

const NOW: Observation = Observation {
    depth_m: 3.0,
    distance_m: 1.0,
    light_pct: 20.0,
    mean: [41.0, 88.0, 79.0],
    std: [3.4, 6.2, 7.1],
    quality: None,
};

fn water() -> Profile {
    profile(&mut Numbers::new(3))
}

fn model(per_m: f64, per_pct: f64) -> Model {
    Model::from_json(&echo_model(per_m, per_pct)).unwrap()
}

/// A model that predicts `bias` more contrast than the picture has, for no change.
fn misfitting(bias: [f64; 3]) -> Model {
    let mut document = echo_model(-2.0, 0.02);
    document["layers"][0]["bias"] = json!(bias);
    Model::from_json(&document).unwrap()
}

fn ask(now: &Observation, model: &Model, checks: &Checks) -> Advice {
    advise_checked(now, &water(), model, &Objective::default(), checks)
}

fn assert_hold(advice: &Advice, reason: &str) {
    assert_eq!(advice.reason.as_ref().map(Reason::name), Some(reason));
    assert!(!advice.valid() && !advice.moves());
    assert_eq!(
        (advice.distance_m, advice.light_pct),
        (NOW.distance_m, NOW.light_pct)
    );
    assert_eq!(
        (advice.delta_distance_m, advice.delta_light_pct),
        (0.0, 0.0)
    );
    assert_eq!((advice.predicted_contrast, advice.score), (None, None));
}

#[test]
fn a_model_that_misses_the_picture_is_not_followed() {
    // The sun stood behind the target, which training did not know: 4.0 9.6 11.1 predicted, 3.4 6.2 7.1 measured.
    let model = misfitting([0.6, 3.4, 4.0]);
    let advice = ask(&NOW, &model, &Checks::default());
    assert_hold(&advice, "model_misfit");
    let residual = advice.residual_here.unwrap();
    for (k, expected) in [0.6, 3.4, 4.0].into_iter().enumerate() {
        assert!((residual.counts[k] - expected).abs() < 1e-9);
    }
    assert!(residual.misfit > 3.0, "{residual:?}");
    let told = advice.reason.unwrap().to_string();
    assert!(
        told.contains("4.0 9.6 11.1") && told.contains("3.4 6.2 7.1"),
        "{told}"
    );
    // A warning leaves the advice as it is.
    let warn = Checks {
        misfit: Strictness::Warn,
        ..Checks::default()
    };
    let warned = ask(&NOW, &model, &warn);
    assert!(warned.valid() && warned.moves());
    assert_eq!(warned.warnings[0].name(), "model_misfit");
    assert!(ask(&NOW, &model, &Checks::none()).warnings.is_empty());
}

#[test]
fn contrasts_of_another_depth_are_told_or_refused() {
    let ask_at = |depth_m: f64, calibrated_m: Option<[f64; 2]>, checks: &Checks| {
        let water = match calibrated_m {
            Some(depths_m) => water().with_contrast_depth(depths_m).unwrap(),
            None => water(),
        };
        let now = Observation { depth_m, ..NOW };
        advise_checked(
            &now,
            &water,
            &model(-2.0, 0.02),
            &Objective::default(),
            checks,
        )
    };
    let default = Checks::default();
    // At the depth of the contrasts, within half a metre of it, or where that depth is not known.
    for (depth_m, calibrated_m) in [
        (3.0, Some([3.0, 3.0])),
        (2.6, Some([3.0, 3.0])),
        (4.4, Some([2.0, 4.0])),
        (5.0, None),
    ] {
        let advice = ask_at(depth_m, calibrated_m, &default);
        assert!(advice.valid() && advice.warnings.is_empty(), "{advice:?}");
    }
    let advice = ask_at(4.5, Some([1.5, 3.0]), &default);
    assert!(advice.valid() && advice.moves(), "{advice:?}");
    assert_eq!(advice.warnings[0].name(), "other_depth");
    let refuse = Checks {
        other_depth: Strictness::Refuse,
        ..default
    };
    assert!(ask_at(3.0, Some([3.0, 3.0]), &refuse).valid());
    let advice = ask_at(4.5, Some([1.5, 3.0]), &refuse);
    assert_hold(&advice, "other_depth");
    let told = advice.reason.unwrap().to_string();
    assert!(
        told.contains("at a depth of 1.5 to 3 m, the vehicle is 4.5 m deep, and 0.5 m beyond"),
        "{told}"
    );
    let ignore = Checks {
        other_depth: Strictness::Ignore,
        ..default
    };
    assert!(ask_at(1.0, Some([3.0, 3.0]), &ignore).warnings.is_empty());
    let wide = Checks {
        depth_margin_m: 2.0,
        ..refuse
    };
    assert!(ask_at(4.5, Some([3.0, 3.0]), &wide).valid());
}

#[test]
fn the_usual_error_of_a_model_is_no_misfit() {
    let advice = ask(&NOW, &misfitting([0.2, -0.3, 0.4]), &Checks::default());
    assert!(advice.valid() && advice.warnings.is_empty(), "{advice:?}");
    assert!(advice.residual_here.unwrap().misfit < 0.4);
    let predicted = advice.predicted_here.unwrap();
    assert!((predicted[2] - 7.5).abs() < 1e-9, "{predicted:?}");
}

#[test]
fn a_model_that_does_not_state_its_residuals_only_warns() {
    let mut document = echo_model(-2.0, 0.02);
    document["layers"][0]["bias"] = json!([0.6, 3.4, 4.0]);
    document["training"]
        .as_object_mut()
        .unwrap()
        .remove("residual_here");
    let model = Model::from_json(&document).unwrap();
    let advice = ask(&NOW, &model, &Checks::default());
    assert!(advice.valid());
    assert_eq!(advice.warnings[0].name(), "model_misfit");
}

#[test]
fn a_suggestion_that_buys_too_little_is_to_hold() {
    let water = water();
    // Contrast alone counts and hardly changes: a metre buys a thousandth of the score.
    let flat = Objective {
        lambda_d: 0.0,
        ..Objective::default()
    };
    let model = model(-0.02, 0.0);
    let bare = advise(&NOW, &water, &model, &flat);
    assert!(bare.moves() && bare.delta_distance_m < -0.4, "{bare:?}");
    let advice = advise_checked(&NOW, &water, &model, &flat, &Checks::default());
    assert!(advice.valid() && !advice.moves());
    assert_eq!(advice.reason.as_ref().map(Reason::name), Some("small_gain"));
    assert_eq!(
        (advice.delta_distance_m, advice.delta_light_pct),
        (0.0, 0.0)
    );
    assert_eq!(advice.gain(), Some(0.0));
    assert_eq!(advice.predicted_contrast, advice.predicted_here);
    // Where the vehicle may not stay, it has to move, whatever that gains.
    let nearer = Objective {
        distance_m: [0.5, 0.9],
        ..flat
    };
    assert!(advise_checked(&NOW, &water, &model, &nearer, &Checks::default()).moves());
    let any = Checks {
        min_gain: 0.0,
        ..Checks::default()
    };
    assert!(advise_checked(&NOW, &water, &model, &flat, &any).moves());
}

#[test]
fn the_terms_make_the_score_and_suggestions_lie_on_centimetres() {
    let advice = ask(&NOW, &model(-2.0, 0.02), &Checks::default());
    assert!(advice.moves(), "{advice:?}");
    let (terms, here) = (advice.terms.unwrap(), advice.terms_here.unwrap());
    assert!((terms.contrast + terms.distance - advice.score.unwrap()).abs() < 1e-12);
    assert!((here.contrast + here.distance - advice.score_here.unwrap()).abs() < 1e-12);
    assert_eq!(
        advice.distance_m,
        (advice.distance_m * 100.0).round() / 100.0
    );
    assert_eq!(advice.light_pct, (advice.light_pct * 10.0).round() / 10.0);
}

#[test]
fn the_shipped_models_state_all_that_is_checked() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/models");
    for (name, width) in [
        ("default", 1280.0),
        ("paper", 1280.0),
        ("small_camera", 240.0),
    ] {
        let model = Model::read(format!("{folder}/{name}.json").as_ref()).unwrap();
        let card = model.card();
        assert_eq!(card.warnings(), Vec::<String>::new(), "{name}");
        assert_eq!(card.rig.width_px, Some(width));
        assert_eq!(card.training.sun.unwrap().azimuth_deg, 0.0);
        assert!(card.training.textures.len() >= 2);
        // The limit is about twice what 99 of 100 of their own pictures have.
        let normal = card.training.residual_here.unwrap();
        let limit = Checks::default().max_misfit;
        assert!(
            (1.9..2.5).contains(&(limit / normal.p99)),
            "{name} {normal:?}"
        );
    }
}

#[test]
fn the_shipped_model_advises_on_what_it_knows_and_refuses_what_it_does_not() {
    let model = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../assets/models/default.json"
    );
    let model = Model::read(model.as_ref()).unwrap();
    let data = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../guidance/tests/data/hull_red"
    );
    let water = Profile::read(format!("{data}.json").as_ref()).unwrap();
    let mut table = csv::Reader::from_path(format!("{data}.csv")).unwrap();
    let (mut pictures, mut moves) = (0, 0);
    for row in table.records() {
        let n: Vec<f64> = row.unwrap().iter().map(|v| v.parse().unwrap()).collect();
        let now = Observation {
            depth_m: n[0],
            distance_m: n[1],
            light_pct: n[2],
            mean: [n[3], n[4], n[5]],
            std: [n[6], n[7], n[8]],
            quality: None,
        };
        let ask = |now: &Observation| {
            advise_checked(
                now,
                &water,
                &model,
                &Objective::default(),
                &Checks::default(),
            )
        };
        let advice = ask(&now);
        assert!(advice.valid(), "{advice:?}");
        pictures += 1;
        moves += usize::from(advice.moves());
        // More contrast than water and distance leave: another target, another sun.
        let other = Observation {
            std: now.std.map(|s| 1.5 * s + 1.0),
            ..now
        };
        assert!(!ask(&other).valid(), "{other:?}");
    }
    assert!(
        pictures > 20 && moves * 10 > pictures * 9,
        "{moves} of {pictures}"
    );
}
