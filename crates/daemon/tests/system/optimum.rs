//! The search against a dense grid as judge, over random waters, models and objectives.

use crate::support::{Numbers, profile, random_model};
use serde_json::Value;
use uw_calib::Profile;
use uw_guidance::advice::{Reason, predict};
use uw_guidance::objective::{ContrastTerm, DepthTerm};
use uw_guidance::{Candidate, Model, Objective, Observation, advise};

const CASES: u64 = 120;
/// What the optimum may miss of the best value on the grid; scores are about 1.
const TOLERANCE: f64 = 1e-4;
/// Distances of the judge: steps of 2.5 mm, a fifth of the narrowest ridge's width.
const JUDGE_DISTANCES: u32 = 1001;
const JUDGE_LIGHTS: u32 = 41;

fn models(numbers: &mut Numbers) -> Vec<Model> {
    let example: Value =
        serde_json::from_str(include_str!("../../../guidance/tests/data/mlp_a.json")).unwrap();
    let mut models = vec![Model::from_json(&example).unwrap()];
    for hidden in [&[16, 16][..], &[32, 16], &[8], &[24, 24, 24]] {
        models.push(Model::from_json(&random_model(numbers, hidden)).unwrap());
    }
    models
}

fn objective(numbers: &mut Numbers) -> Objective {
    let near = numbers.between(0.5, 1.2);
    let dim = numbers.between(0.0, 40.0);
    let wide = numbers.between(0.0, 1.0) < 0.5;
    Objective {
        lambda_c: numbers.between(0.1, 1.5),
        lambda_d: numbers.between(0.0, 1.5),
        kappa_b: numbers.between(1.0, 5.0),
        kappa_c: numbers.between(0.5, 3.0),
        contrast: numbers.pick(&[ContrastTerm::Sum, ContrastTerm::Mean]),
        contrast_scale: 15.0,
        depth_term: numbers.pick(&[DepthTerm::Z, DepthTerm::OnePlusHalfZ]),
        distance_m: if wide {
            [0.5, 3.0]
        } else {
            [near, near + numbers.between(0.3, 1.8)]
        },
        light_pct: if wide {
            [0.0, 100.0]
        } else {
            [dim, dim + numbers.between(10.0, 60.0)]
        },
        ..Objective::default()
    }
}

fn observation(numbers: &mut Numbers) -> Observation {
    Observation {
        depth_m: numbers.between(0.5, 6.0),
        distance_m: numbers.between(0.5, 3.0),
        light_pct: numbers.between(0.0, 100.0),
        mean: std::array::from_fn(|_| numbers.between(5.0, 200.0)),
        std: std::array::from_fn(|_| numbers.between(0.5, 15.0)),
        quality: None,
    }
}

fn judge(now: &Observation, profile: &Profile, model: &Model, objective: &Objective) -> f64 {
    let between = |[low, high]: [f64; 2], k: u32, of: u32| {
        (low + (high - low) * f64::from(k) / f64::from(of - 1)).min(high)
    };
    let mut best = f64::NEG_INFINITY;
    for i in 0..JUDGE_DISTANCES {
        let row: Vec<Candidate> = (0..JUDGE_LIGHTS)
            .map(|j| Candidate {
                distance_m: between(objective.distance_m, i, JUDGE_DISTANCES).min(3.0),
                light_pct: between(objective.light_pct, j, JUDGE_LIGHTS),
            })
            .collect();
        let scores = predict(now, &row, profile, model, objective)
            .unwrap()
            .scores;
        best = scores.into_iter().fold(best, f64::max);
    }
    best
}

#[test]
fn the_search_finds_the_global_optimum() {
    let models = models(&mut Numbers::new(1));
    let (mut misses, mut evaluations) = (Vec::new(), Vec::new());
    for case in 0..CASES {
        let numbers = &mut Numbers::new(1000 + case);
        let water = profile(numbers);
        let (now, objective) = (observation(numbers), objective(numbers));
        let model = &models[case as usize % models.len()];
        let advice = advise(&now, &water, model, &objective);
        let (score, best) = (
            advice.score.unwrap(),
            judge(&now, &water, model, &objective),
        );
        assert!((objective.distance_m[0]..=objective.distance_m[1]).contains(&advice.distance_m));
        assert!((objective.light_pct[0]..=objective.light_pct[1]).contains(&advice.light_pct));
        evaluations.push(advice.evaluations);
        if score < best - TOLERANCE {
            misses.push((case, score, best));
        }
    }
    let mean = evaluations.iter().sum::<usize>() / evaluations.len();
    assert!(
        misses.is_empty(),
        "{} of {CASES} missed: {misses:?}",
        misses.len()
    );
    assert!(mean < 500, "{mean} evaluations a question on average");
}

#[test]
fn the_same_question_has_the_same_answer() {
    let model = &models(&mut Numbers::new(1))[0];
    let numbers = &mut Numbers::new(7);
    let water = profile(numbers);
    let (now, objective) = (observation(numbers), Objective::default());
    assert_eq!(
        advise(&now, &water, model, &objective),
        advise(&now, &water, model, &objective)
    );
}

#[test]
fn without_a_usable_answer_the_advice_is_to_hold() {
    let numbers = &mut Numbers::new(7);
    let water = profile(numbers);
    let good = &models(&mut Numbers::new(1))[0];
    let mut overflowing: Value =
        serde_json::from_str(include_str!("../../../guidance/tests/data/mlp_a.json")).unwrap();
    overflowing["outputs"][1]["scale"] = serde_json::json!(1e308);
    let overflowing = Model::from_json(&overflowing).unwrap();
    let now = Observation {
        depth_m: 3.0,
        ..observation(numbers)
    };
    let objective = Objective::default();
    let far = Objective {
        distance_m: [4.0, 5.0],
        ..objective
    };
    let of = |now: Observation| advise(&now, &water, good, &objective);
    let cases = [
        (
            of(Observation {
                depth_m: 9.0,
                ..now
            }),
            "outside_calibration",
        ),
        (
            of(Observation {
                distance_m: 0.4,
                ..now
            }),
            "outside_calibration",
        ),
        (
            of(Observation {
                light_pct: f64::NAN,
                ..now
            }),
            "bad_observation",
        ),
        (advise(&now, &water, good, &far), "no_candidates"),
        (advise(&now, &water, &overflowing, &objective), "not_finite"),
    ];
    for (advice, reason) in cases {
        assert_eq!(advice.reason.as_ref().map(Reason::name), Some(reason));
        assert_eq!(
            (advice.delta_distance_m, advice.delta_light_pct),
            (0.0, 0.0)
        );
        assert_eq!((advice.predicted_contrast, advice.score), (None, None));
    }
    assert!(advise(&now, &water, good, &objective).valid());
}
