use super::*;
use serde_json::{Value, json};
use uw_calib::{DepthSample, Source};

fn profile() -> Profile {
    let contrast = |distance_m: f64, k_c: [f64; 3]| ContrastSample { distance_m, k_c };
    Profile::new(
        vec![
            DepthSample {
                depth_m: 0.0,
                k_z: [1.0; 3],
            },
            DepthSample {
                depth_m: 4.0,
                k_z: [0.2, 0.6, 0.4],
            },
        ],
        vec![contrast(0.5, [12.0; 3]), contrast(3.0, [4.0; 3])],
        vec![
            contrast(0.5, [6.0, 9.0, 9.0]),
            contrast(1.5, [3.0, 4.0, 5.0]),
            contrast(3.0, [0.0; 3]),
        ],
        Source {
            made_by: "test".to_owned(),
            images: 0,
            note: None,
        },
    )
    .unwrap()
}

fn with(overrides: Value) -> Result<Objective, FieldError> {
    Objective::default().with(&Object::new(&overrides, "objective").unwrap())
}

#[test]
fn release_is_what_its_formula_says() {
    let profile = profile();
    let objective = Objective::release();
    let criterion = Criterion::new(&objective, &profile, 4.0, profile.k_z(4.0).unwrap());
    // Σ K_c at 1 m is 18 counts, 1.2 in units of 15; 1 + z/2 = 3; mean K_z = 0.4.
    let b = 1.2f64.sqrt() * 3.5 / 3.0;
    let c = 0.16 / 1.5;
    assert!((criterion.preferred_distance_m(1.0) - b).abs() < 1e-12);
    assert!((criterion.width_m() - c).abs() < 1e-12);
    let m_d = (-(1.0 - b).powi(2) / (2.0 * c * c)).exp();
    let score = criterion.score([3.0, 6.0, 9.0], 1.0);
    assert!((score - (0.65 * 0.4 + m_d)).abs() < 1e-12, "{score}");
}

#[test]
fn paper_takes_the_sum_and_the_plain_depth() {
    let profile = profile();
    let objective = Objective::paper();
    let criterion = Criterion::new(&objective, &profile, 4.0, profile.k_z(4.0).unwrap());
    let b = 1.2f64.sqrt() * 3.5 / 4.0;
    assert!((criterion.preferred_distance_m(1.0) - b).abs() < 1e-12);
    // With the same contrast the contrast terms of the two presets agree: 0.65/3 of the sum.
    let without = |o: Objective| Objective { lambda_d: 0.0, ..o };
    let (paper, release) = (without(Objective::paper()), without(Objective::release()));
    let score =
        |o: &Objective| Criterion::new(o, &profile, 4.0, [0.4; 3]).score([3.0, 6.0, 9.0], 1.0);
    assert!((score(&paper) - score(&release)).abs() < 1e-12);
    assert!((score(&paper) - 0.26).abs() < 1e-12);
}

#[test]
fn the_surface_and_black_water_give_a_score_all_the_same() {
    let profile = profile();
    let paper = Objective::paper();
    for (depth_m, k_z) in [(0.0, [1.0; 3]), (4.0, [0.0; 3])] {
        let criterion = Criterion::new(&paper, &profile, depth_m, k_z);
        for distance_m in [0.5, 1.0, 3.0] {
            assert_eq!(criterion.distance_term(distance_m), 0.0);
            assert!(criterion.score([1.0; 3], distance_m).is_finite());
        }
        assert!(criterion.peaks_m(0.5, 3.0).iter().all(|d| d.is_finite()));
    }
}

#[test]
fn peaks_hold_every_solution_of_d_equal_b() {
    let profile = profile();
    for kappa_b in [0.4, 1.0, 3.5, 6.0] {
        let objective = Objective {
            kappa_b,
            ..Objective::release()
        };
        let criterion = Criterion::new(&objective, &profile, 2.0, [0.4; 3]);
        let peaks = criterion.peaks_m(0.5, 3.0);
        let g = |d: f64| d - criterion.preferred_distance_m(d);
        let steps = 10_000;
        let d = |i: usize| 0.5 + 2.5 * i as f64 / steps as f64;
        let mut crossings = 0;
        for i in 0..steps {
            if g(d(i)) * g(d(i + 1)) < 0.0 {
                crossings += 1;
                let close =
                    |peak: &&f64| (d(i)..=d(i + 1)).contains(*peak) && g(**peak).abs() < 1e-9;
                assert!(
                    peaks.iter().find(close).is_some(),
                    "kappa_b {kappa_b}: {peaks:?}"
                );
            }
        }
        assert!(
            crossings > 0 || kappa_b == 0.4,
            "kappa_b {kappa_b} tests nothing"
        );
    }
}

#[test]
fn overrides_lie_over_the_preset_or_the_objective_before() {
    let o = with(json!({"preset": "paper", "lambda_c": 2, "depth_term": "1+z/2"})).unwrap();
    let expected = Objective {
        lambda_c: 2.0,
        depth_term: DepthTerm::OnePlusHalfZ,
        ..Objective::paper()
    };
    assert_eq!(o, expected);
    let o =
        with(json!({"distance_m": [1.0, 2.0], "light_pct": [10, 20], "contrast": "sum"})).unwrap();
    assert_eq!((o.distance_m, o.light_pct), ([1.0, 2.0], [10.0, 20.0]));
    assert_eq!((o.lambda_c, o.contrast), (0.65, ContrastTerm::Sum));
}

#[test]
fn unusable_overrides_are_named() {
    let cases = [
        (json!({"lambda": 1}), "objective.lambda"),
        (json!({"lambda_c": "1"}), "objective.lambda_c"),
        (json!({"lambda_d": -1}), "objective.lambda_d"),
        (json!({"kappa_c": 0}), "objective.kappa_c"),
        (json!({"preset": "journal"}), "objective.preset"),
        (json!({"depth_term": "1 + z/2"}), "objective.depth_term"),
        (json!({"distance_m": [2, 1]}), "objective.distance_m"),
        (json!({"light_pct": [0, 101]}), "objective.light_pct"),
    ];
    for (overrides, field) in cases {
        assert_eq!(
            with(overrides.clone()).unwrap_err().field,
            field,
            "{overrides}"
        );
    }
}

#[test]
fn tracking_is_the_visible_share_of_the_overlap() {
    let profile = profile();
    let tracking = Objective::tracking();
    let criterion = Criterion::new(&tracking, &profile, 4.0, [0.4; 3]);
    // A mean of 6 counts is 0.4 in units of 15: half of the features are found again.
    let score = criterion.score([3.0, 6.0, 9.0], 2.0);
    assert!((score - 0.5 * (1.0 - 0.433 / 2.0)).abs() < 1e-12, "{score}");
    // Twice the contrast, power 3: 8/9.
    let score = criterion.score([12.0; 3], 2.0);
    assert!(
        (score - 8.0 / 9.0 * (1.0 - 0.433 / 2.0)).abs() < 1e-12,
        "{score}"
    );
    assert_eq!(criterion.score([9.0; 3], 0.4), 0.0);
    assert_eq!(criterion.score([-1.0; 3], 2.0), 0.0);
    assert!(criterion.score([f64::NAN; 3], 2.0).is_nan());
    assert!(criterion.peaks_m(0.5, 3.0).is_empty());
}

#[test]
fn the_form_and_its_constants_can_be_set() {
    let set =
        with(json!({"preset": "tracking", "half_contrast": 0.2, "touch_distance_m": 0.0})).unwrap();
    assert_eq!(set.form, Form::Overlap);
    assert_eq!((set.half_contrast, set.touch_distance_m), (0.2, 0.0));
    assert_eq!(
        with(json!({"form": "overlap"})).unwrap(),
        Objective::tracking()
    );
    assert_eq!(
        with(json!({"preset": "tracking", "form": "sum"})).unwrap(),
        Objective::release()
    );
    let error = with(json!({"sharpness": 0})).unwrap_err();
    assert_eq!(error.field, "objective.sharpness");
}
