//! Counters of what the daemon does, and their text for Prometheus (exposition format 0.0.4).

use std::fmt::Write as _;
use std::sync::atomic::{AtomicI64, AtomicU64, Ordering};

use crate::gauges::Gauges;
use crate::wire::request::OPS;

/// Upper ends of the latency histogram, µs.
const BUCKETS_US: [u64; 12] = [
    50, 100, 200, 500, 1_000, 2_000, 5_000, 10_000, 50_000, 200_000, 1_000_000, 10_000_000,
];
/// Faults counted by name: error codes, then reasons to hold; anything else goes under the last.
const FAULTS: [&str; 32] = [
    "bad_utf8",
    "bad_json",
    "line_too_long",
    "missing_field",
    "unknown_field",
    "wrong_type",
    "out_of_range",
    "invalid_value",
    "unknown_op",
    "bad_image",
    "unauthorised",
    "internal",
    "stale_input",
    "missing_input",
    "no_profile",
    "no_range",
    "beams_disagree",
    "not_finite",
    "bad_observation",
    "outside_training",
    "model_misfit",
    "other_camera",
    "other_depth",
    "noise_floor",
    "saturated",
    "other_sun",
    "compressed",
    "denoised",
    "unknown_exposure",
    "oblique",
    "busy",
    "other",
];

/// One counter that several threads raise.
#[derive(Debug, Default)]
pub struct Counter(AtomicU64);

impl Counter {
    /// Raises it by one.
    pub fn count(&self) {
        self.add(1);
    }

    /// Raises it.
    pub fn add(&self, amount: u64) {
        self.0.fetch_add(amount, Ordering::Relaxed);
    }

    /// Its value.
    pub fn get(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }
}

/// All counters.
#[derive(Debug, Default)]
pub struct Metrics {
    /// By operation, the last for lines that are no request, the one before for pushed messages.
    ops: [Counter; OPS.len() + 2],
    faults: [Counter; FAULTS.len()],
    errors: Counter,
    latency_us: [Counter; BUCKETS_US.len() + 1],
    latency_sum_us: Counter,
    connections: AtomicI64,
    /// The last advice.
    pub gauges: Gauges,
    /// Connections accepted.
    pub accepted: Counter,
    /// Connections refused because all places were taken.
    pub refused: Counter,
    /// Connections closed because the client was idle or did not read.
    pub closed_slow: Counter,
    /// Connections closed because the peer spoke another protocol, or no JSON too often.
    pub closed_foreign: Counter,
    /// Wrong tokens.
    pub wrong_tokens: Counter,
    /// Records that could not be written.
    pub record_failures: Counter,
    /// Reloads that were refused.
    pub reload_failures: Counter,
}

impl Metrics {
    /// Counts an answer: the operation, the fault if there is one, and the time it took, µs.
    pub fn answered(&self, op: &str, fault: Option<&str>, is_error: bool, elapsed_us: u64) {
        let op = match op {
            "push" => OPS.len(),
            op => OPS
                .iter()
                .position(|&name| name == op)
                .unwrap_or(OPS.len() + 1),
        };
        self.ops[op].count();
        if is_error {
            self.errors.count();
        }
        if let Some(fault) = fault {
            let known = FAULTS.iter().position(|&name| name == fault);
            self.faults[known.unwrap_or(FAULTS.len() - 1)].count();
        }
        let bucket = BUCKETS_US.partition_point(|&end| end < elapsed_us);
        self.latency_us[bucket].count();
        self.latency_sum_us.add(elapsed_us);
    }

    /// Requests answered, lines that were none included.
    pub fn requests(&self) -> u64 {
        let all: u64 = self.ops.iter().map(Counter::get).sum();
        all - self.ops[OPS.len()].get()
    }

    /// Error objects among the answers.
    pub fn errors(&self) -> u64 {
        self.errors.get()
    }

    /// Connections open now.
    pub fn connections(&self) -> i64 {
        self.connections.load(Ordering::Relaxed)
    }

    /// Counts a connection as open until the guard is dropped.
    pub fn open(&self) -> OpenConnection<'_> {
        self.accepted.count();
        self.connections.fetch_add(1, Ordering::Relaxed);
        OpenConnection(self)
    }

    /// The text that Prometheus reads.
    pub fn text(&self, uptime_s: f64) -> String {
        let mut text = String::with_capacity(4096);
        let ops = OPS.iter().copied().chain(["push", "invalid"]);
        let ops: Vec<(&str, u64)> = ops.zip(self.ops.iter().map(Counter::get)).collect();
        labelled(
            &mut text,
            "uwguide_requests_total",
            "Answers by operation.",
            "op",
            &ops,
        );
        let faults: Vec<(&str, u64)> = FAULTS
            .into_iter()
            .zip(self.faults.iter().map(Counter::get))
            .collect();
        labelled(
            &mut text,
            "uwguide_faults_total",
            "Errors by code and invalid answers by reason.",
            "fault",
            &faults,
        );
        self.latency(&mut text);
        let plain = [
            ("accepted_total", "Connections accepted.", &self.accepted),
            ("refused_total", "Connections refused.", &self.refused),
            (
                "closed_slow_total",
                "Connections closed as idle or not reading.",
                &self.closed_slow,
            ),
            (
                "closed_foreign_total",
                "Connections closed as of another protocol.",
                &self.closed_foreign,
            ),
            ("wrong_tokens_total", "Wrong tokens.", &self.wrong_tokens),
            (
                "record_failures_total",
                "Records not written.",
                &self.record_failures,
            ),
            (
                "reload_failures_total",
                "Reloads refused.",
                &self.reload_failures,
            ),
        ];
        for (name, help, counter) in plain {
            let name = format!("uwguide_{name}");
            sample(&mut text, &name, help, "counter", counter.get() as f64);
        }
        sample(
            &mut text,
            "uwguide_connections",
            "Connections open.",
            "gauge",
            self.connections() as f64,
        );
        sample(
            &mut text,
            "uwguide_uptime_seconds",
            "Since the start.",
            "gauge",
            uptime_s,
        );
        self.gauges.text(&mut text);
        text
    }

    fn latency(&self, text: &mut String) {
        let name = "uwguide_answer_seconds";
        header(text, name, "Time from a line to its answer.", "histogram");
        let mut below = 0;
        for (k, counter) in self.latency_us.iter().enumerate() {
            below += counter.get();
            let end = match BUCKETS_US.get(k) {
                Some(&end_us) => format!("{}", end_us as f64 / 1e6),
                None => "+Inf".to_owned(),
            };
            push(text, format_args!("{name}_bucket{{le=\"{end}\"}} {below}"));
        }
        let sum_s = self.latency_sum_us.get() as f64 / 1e6;
        push(text, format_args!("{name}_sum {sum_s}"));
        push(text, format_args!("{name}_count {below}"));
    }
}

/// Lowers the number of open connections when it goes.
#[derive(Debug)]
pub struct OpenConnection<'a>(&'a Metrics);

impl Drop for OpenConnection<'_> {
    fn drop(&mut self) {
        self.0.connections.fetch_sub(1, Ordering::Relaxed);
    }
}

fn labelled(text: &mut String, name: &str, help: &str, label: &str, values: &[(&str, u64)]) {
    header(text, name, help, "counter");
    for (value, count) in values {
        push(text, format_args!("{name}{{{label}=\"{value}\"}} {count}"));
    }
}

pub(crate) fn sample(text: &mut String, name: &str, help: &str, kind: &str, value: f64) {
    header(text, name, help, kind);
    push(text, format_args!("{name} {value}"));
}

pub(crate) fn header(text: &mut String, name: &str, help: &str, kind: &str) {
    push(text, format_args!("# HELP {name} {help}"));
    push(text, format_args!("# TYPE {name} {kind}"));
}

pub(crate) fn push(text: &mut String, line: std::fmt::Arguments) {
    // Writing to a string cannot fail.
    let _ = writeln!(text, "{line}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_are_counted_where_they_belong() {
        let metrics = Metrics::default();
        metrics.answered("suggest", None, false, 120);
        metrics.answered("suggest", Some("stale_input"), false, 60);
        metrics.answered("invalid", Some("bad_json"), true, 10);
        metrics.answered("push", None, false, 10);
        let open = metrics.open();
        let text = metrics.text(2.5);
        for line in [
            "uwguide_requests_total{op=\"suggest\"} 2",
            "uwguide_requests_total{op=\"invalid\"} 1",
            "uwguide_faults_total{fault=\"stale_input\"} 1",
            "uwguide_faults_total{fault=\"bad_json\"} 1",
            "uwguide_answer_seconds_bucket{le=\"0.0001\"} 3",
            "uwguide_answer_seconds_bucket{le=\"+Inf\"} 4",
            "uwguide_answer_seconds_count 4",
            "uwguide_connections 1",
            "uwguide_uptime_seconds 2.5",
        ] {
            assert!(text.lines().any(|l| l == line), "{line} not in\n{text}");
        }
        assert_eq!((metrics.requests(), metrics.errors()), (3, 1));
        drop(open);
        assert_eq!(metrics.connections(), 0);
    }
}
