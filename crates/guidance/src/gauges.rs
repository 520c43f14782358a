//! What the last advice was, for Prometheus.

use std::sync::atomic::{AtomicU64, Ordering};

use serde_json::Value;

use crate::metrics::{Counter, header, push, sample};
use crate::wire::reply::Fields;

/// A number that several threads set; not a number before the first.
#[derive(Debug)]
struct Gauge(AtomicU64);

impl Default for Gauge {
    fn default() -> Self {
        Self(AtomicU64::new(f64::NAN.to_bits()))
    }
}

impl Gauge {
    fn set(&self, value: Option<f64>) {
        let value = value.unwrap_or(f64::NAN);
        self.0.store(value.to_bits(), Ordering::Relaxed);
    }

    fn get(&self) -> f64 {
        f64::from_bits(self.0.load(Ordering::Relaxed))
    }
}

/// Inputs whose ages are told, by their names in replies.
const INPUTS: [&str; 4] = ["depth", "distance", "light", "image"];

/// The last advice and how many there were.
#[derive(Debug, Default)]
pub struct Gauges {
    distance_m: Gauge,
    light_pct: Gauge,
    gain: Gauge,
    misfit: Gauge,
    ages_s: [Gauge; INPUTS.len()],
    moves: Counter,
    holds: Counter,
}

impl Gauges {
    /// Takes a reply to `suggest` or `suggest_image`, or a pushed one; an error counts as a hold.
    pub fn advised(&self, reply: Option<&Fields>) {
        let get = |name: &str| reply.and_then(|reply| reply.get(name));
        let number = |name: &str| get(name).and_then(Value::as_f64);
        match get("action").and_then(Value::as_str) {
            Some("move") => self.moves.count(),
            _ => self.holds.count(),
        }
        self.distance_m.set(number("distance_m"));
        self.light_pct.set(number("light_pct"));
        self.gain.set(number("gain"));
        let misfit = get("residual_here").and_then(|residual| residual["misfit"].as_f64());
        self.misfit.set(misfit);
        for (gauge, input) in self.ages_s.iter().zip(INPUTS) {
            gauge.set(get("age_s").and_then(|ages| ages[input].as_f64()));
        }
    }

    /// The text that Prometheus reads; `NaN` where there is nothing to tell.
    pub(crate) fn text(&self, text: &mut String) {
        let (moves, holds) = (self.moves.get() as f64, self.holds.get() as f64);
        let plain = [
            (
                "uwguide_advice_distance_metres",
                "Distance of the last advice.",
                self.distance_m.get(),
            ),
            (
                "uwguide_advice_light_percent",
                "Lamp level of the last advice.",
                self.light_pct.get(),
            ),
            (
                "uwguide_advice_gain",
                "Score of the last advice less that of staying.",
                self.gain.get(),
            ),
            (
                "uwguide_residual_misfit",
                "Misfit of the model at the place of the last advice, 1 is allowed.",
                self.misfit.get(),
            ),
            (
                "uwguide_advice_hold_share",
                "Share of advice that was to hold, errors included.",
                holds / (moves + holds),
            ),
        ];
        for (name, help, value) in plain {
            sample(text, name, help, "gauge", value);
        }
        let name = "uwguide_advice_total";
        header(text, name, "Advice by action.", "counter");
        push(text, format_args!("{name}{{action=\"move\"}} {moves}"));
        push(text, format_args!("{name}{{action=\"hold\"}} {holds}"));
        let name = "uwguide_input_age_seconds";
        header(
            text,
            name,
            "Ages of the inputs of the last advice.",
            "gauge",
        );
        for (gauge, input) in self.ages_s.iter().zip(INPUTS) {
            let age_s = gauge.get();
            push(text, format_args!("{name}{{input=\"{input}\"}} {age_s}"));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn the_last_advice_and_the_share_of_holds_are_told() {
        let gauges = Gauges::default();
        let fields = |value: Value| value.as_object().cloned().unwrap();
        gauges.advised(Some(&fields(json!({
            "action": "move", "distance_m": 1.42, "light_pct": 31.5, "gain": 0.34,
            "residual_here": {"contrast": [0.1, 0.2, 0.3], "misfit": 0.25},
            "age_s": {"depth": 0.1, "distance": 0.2, "light": 0.3, "image": 0.4},
        }))));
        let mut text = String::new();
        gauges.text(&mut text);
        for line in [
            "uwguide_advice_distance_metres 1.42",
            "uwguide_advice_light_percent 31.5",
            "uwguide_advice_gain 0.34",
            "uwguide_residual_misfit 0.25",
            "uwguide_advice_hold_share 0",
            "uwguide_input_age_seconds{input=\"distance\"} 0.2",
        ] {
            assert!(text.lines().any(|l| l == line), "{line} not in\n{text}");
        }
        gauges.advised(None);
        text.clear();
        gauges.text(&mut text);
        for line in [
            "uwguide_advice_hold_share 0.5",
            "uwguide_advice_total{action=\"hold\"} 1",
            "uwguide_advice_distance_metres NaN",
        ] {
            assert!(text.lines().any(|l| l == line), "{line} not in\n{text}");
        }
    }
}
