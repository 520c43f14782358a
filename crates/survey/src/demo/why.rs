//! A suggestion in words: what is weighed, what wins, and what a pilot would do.

use std::fmt::Write;

use uw_calib::Profile;
use uw_guidance::Objective;
use uw_guidance::objective::Criterion;

use super::Visit;
use super::ask::Choice;

/// Changes smaller than these are none to a pilot: m and percent.
const SMALL_M: f64 = 0.05;
const SMALL_PCT: f64 = 2.0;
/// A difference of contrast that nobody sees, counts.
const HARDLY: f64 = 0.1;

/// The two terms of the score of a choice.
#[derive(Clone, Copy, Debug)]
pub(super) struct Terms {
    pub(super) contrast: f64,
    pub(super) distance: f64,
}

/// What the objective makes of the choices at one visit.
pub(super) struct Weighing {
    /// Distance that the objective prefers near the suggested one, m.
    pub(super) preferred_m: f64,
    /// Terms of each of the visit's choices.
    pub(super) terms: Vec<Terms>,
}

/// Splits the scores of a visit's choices; `None` where the depth is outside the profile.
pub(super) fn weigh(profile: &Profile, visit: &Visit) -> Option<Weighing> {
    let objective = Objective::default();
    let k_z = profile.k_z(visit.depth_m).ok()?;
    let criterion = Criterion::new(&objective, profile, visit.depth_m, k_z);
    let terms = |c: &Choice| {
        let distance = objective.lambda_d * criterion.distance_term(c.distance_m);
        Terms {
            contrast: c.score - distance,
            distance,
        }
    };
    Some(Weighing {
        preferred_m: criterion.preferred_distance_m(visit.suggestion.distance_m),
        terms: visit.choices.iter().map(terms).collect(),
    })
}

/// What a pilot would do.
pub(super) fn orders(visit: &Visit) -> String {
    let s = &visit.suggestion;
    let away = s.distance_m - visit.distance_m;
    let brighter = s.light_pct - visit.light_pct;
    let fly = match away {
        d if d.abs() < SMALL_M => "stay at this distance".to_owned(),
        d if d < 0.0 => format!("come {:.2} m closer", -d),
        d => format!("back off by {d:.2} m"),
    };
    let lamps = match (brighter, s.light_pct) {
        (b, _) if b.abs() < SMALL_PCT => "leave the lamps as they are".to_owned(),
        (_, l) if l < SMALL_PCT => "switch the lamps off".to_owned(),
        (b, l) if b < 0.0 => format!("dim the lamps to {l:.0} %"),
        (_, l) if l > 100.0 - SMALL_PCT => "set the lamps to full".to_owned(),
        (_, l) => format!("set the lamps to {l:.0} %"),
    };
    format!("{fly} and {lamps}")
}

/// Why the suggestion wins, from the predictions for the choices beside it: staying, the suggested distance with other
/// lamp levels, and the suggestion itself, last.
pub(super) fn reasons(visit: &Visit, weighing: &Weighing) -> String {
    let mut text = String::new();
    let (Some((stay, stay_terms)), Some((best, best_terms))) = (
        visit.choices.first().zip(weighing.terms.first()),
        visit.choices.last().zip(weighing.terms.last()),
    ) else {
        return text;
    };
    let contrast = best_terms.contrast - stay_terms.contrast;
    let distance = best_terms.distance - stay_terms.distance;
    let change = |v: f64| format!("{} {:.2}", if v < 0.0 { "loses" } else { "gains" }, v.abs());
    // Writing to a string cannot fail.
    let _ = write!(
        text,
        "At this depth and in this water the objective prefers {:.2} m. Against staying, the distance term {} and the contrast \
         term {}",
        weighing.preferred_m,
        change(distance),
        change(contrast)
    );
    let _ = match (contrast < 0.0, distance > contrast.abs()) {
        (true, true) => write!(
            text,
            ": **contrast goes down, because the better distance is worth more to the objective than what is lost** ({:.1} \
             instead of {:.1} counts on average). Who wants contrast above all raises `lambda_c`.",
            mean(best.contrast),
            mean(stay.contrast)
        ),
        _ => write!(
            text,
            " ({:.1} instead of {:.1} counts on average).",
            mean(best.contrast),
            mean(stay.contrast)
        ),
    };
    if let Some(words) = lamps(visit) {
        let _ = write!(text, " {words}");
    }
    text
}

/// Why the lamps: the same distance with the lamps off and at full.
fn lamps(visit: &Visit) -> Option<String> {
    let there = |light_pct: f64| {
        let mut choices = visit.choices.iter();
        choices.find(|c| c.light_pct == light_pct && c.distance_m == visit.suggestion.distance_m)
    };
    let (off, full) = (mean(there(0.0)?.contrast), mean(there(100.0)?.contrast));
    let difference = full - off;
    let why = match difference {
        d if d.abs() < HARDLY && visit.suggestion.light_pct < SMALL_PCT => {
            "the lamps hardly matter from here, and off saves their power"
        }
        d if d.abs() < HARDLY => "the lamps hardly matter from here",
        d if d > 0.0 => "the lamps show more of the target than they veil",
        _ => "the lamps veil more, by what the water scatters back, than they show of the target",
    };
    Some(format!(
        "At that distance {off:.2} counts are predicted with the lamps off and {full:.2} with full lamps: {why}."
    ))
}

/// Mean over the channels.
pub(super) fn mean(contrast: [f64; 3]) -> f64 {
    contrast.iter().sum::<f64>() / 3.0
}
