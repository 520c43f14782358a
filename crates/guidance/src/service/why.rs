//! Advice in words.

use crate::advice::Advice;
use crate::objective::{Form, Objective, Terms};

/// Shares of the score below which a term is not worth a word.
const WORTH_A_WORD: f64 = 0.0005;

/// Why the vehicle should do what is advised; the reason where there is one that stops it.
pub(super) fn why(advice: &Advice, objective: &Objective) -> Option<String> {
    if !advice.moves() {
        return advice.reason.as_ref().map(ToString::to_string);
    }
    let (terms, here, gain) = (advice.terms?, advice.terms_here?, advice.gain()?);
    let mut text = format!("{}: the score rises by {gain:.3}", movement(advice));
    let changes = changes(objective, terms, here);
    if !changes.is_empty() {
        text.push_str(&format!(", as {}", changes.join(" and ")));
    }
    if let (Some(there), Some(now)) = (advice.predicted_contrast, advice.predicted_here) {
        let mean = |contrast: [f64; 3]| contrast.iter().sum::<f64>() / 3.0;
        text.push_str(&format!(
            "; the mean contrast goes from {:.1} to {:.1} counts",
            mean(now),
            mean(there)
        ));
    }
    if let Some(reason) = &advice.reason {
        text.push_str(&format!("; {reason}"));
    }
    Some(text)
}

/// "go 0.42 m away, lamps 11.5 % brighter".
fn movement(advice: &Advice) -> String {
    let (metres, percent) = (advice.delta_distance_m, advice.delta_light_pct);
    let mut parts = Vec::new();
    if metres.abs() >= 0.005 {
        let towards = if metres > 0.0 { "away" } else { "nearer" };
        parts.push(format!("go {:.2} m {towards}", metres.abs()));
    }
    if percent.abs() >= 0.05 {
        let how = if percent > 0.0 { "brighter" } else { "dimmer" };
        parts.push(format!("lamps {:.1} % {how}", percent.abs()));
    }
    if parts.is_empty() {
        parts.push("stay".to_owned());
    }
    parts.join(", ")
}

/// What happens to the terms of the score.
fn changes(objective: &Objective, terms: Terms, here: Terms) -> Vec<String> {
    let (contrast, distance) = match objective.form {
        Form::Sum => ("the contrast term", "the distance term"),
        Form::Overlap => ("the share of features found again", "the overlap of views"),
    };
    [
        (contrast, here.contrast, terms.contrast),
        (distance, here.distance, terms.distance),
    ]
    .into_iter()
    .filter(|(_, before, after)| (after - before).abs() >= WORTH_A_WORD)
    .map(|(name, before, after)| {
        let verb = if after > before { "rises" } else { "falls" };
        format!("{name} {verb} from {before:.3} to {after:.3}")
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reason::Reason;

    fn advice() -> Advice {
        Advice {
            reason: None,
            warnings: Vec::new(),
            distance_m: 1.42,
            light_pct: 8.5,
            delta_distance_m: 0.42,
            delta_light_pct: -11.5,
            predicted_contrast: Some([4.0, 5.0, 6.0]),
            predicted_here: Some([6.0, 7.0, 8.0]),
            residual_here: None,
            score: Some(1.2),
            score_here: Some(0.9),
            terms: Some(Terms {
                contrast: 0.2,
                distance: 1.0,
            }),
            terms_here: Some(Terms {
                contrast: 0.3,
                distance: 0.6,
            }),
            evaluations: 300,
            physics: None,
        }
    }

    #[test]
    fn what_rises_and_what_falls_is_told() {
        assert_eq!(
            why(&advice(), &Objective::default()).unwrap(),
            "go 0.42 m away, lamps 11.5 % dimmer: the score rises by 0.300, as the contrast term falls from 0.300 to \
             0.200 and the distance term rises from 0.600 to 1.000; the mean contrast goes from 7.0 to 5.0 counts"
        );
        let clamped = Advice {
            reason: Some(Reason::Clamped { at_m: 1.42 }),
            ..advice()
        };
        let told = why(&clamped, &Objective::tracking()).unwrap();
        assert!(told.contains("the overlap of views rises"), "{told}");
        assert!(told.ends_with("calibrated range, 1.42 m"), "{told}");
    }

    #[test]
    fn a_hold_tells_its_reason() {
        let held = Advice {
            reason: Some(Reason::NotFinite),
            ..advice()
        };
        let told = why(&held, &Objective::default()).unwrap();
        assert!(told.contains("no finite contrast"), "{told}");
    }
}
