//! Light of one place, by distance and lamp level: the tables, made ready for many candidates.
//!
//! What depends on the depth is looked up once, with logarithms, in [`Column`]; what depends on the distance once for all lamp
//! levels, in [`Lit`]; a level is then a weighted sum of daylight and lamps, [`Seen`].

use super::grid::{self, PATCHES};
use super::water::{SourceTables, WaterTables};

/// Daylight and lamps.
const SOURCES: usize = 2;
/// The source whose light falls with the square of the distance.
const LAMPS: usize = 1;
/// Veil, E · T and E · S.
const KINDS: usize = 3;

/// Values per patch and their logarithms.
#[derive(Clone, Debug)]
struct Values {
    plain: [f64; PATCHES],
    /// Meaningless where a value is not above 0.
    log: [f64; PATCHES],
}

/// One source in one view and channel.
#[derive(Clone, Debug)]
struct Source {
    /// Veil, E · T and E · S; the latter two of lamps times the squared distance, which makes them smooth.
    values: [Values; KINDS],
    /// Per wave of the tables.
    transfer: Vec<f64>,
}

/// The tables at one depth.
#[derive(Clone, Debug)]
pub(super) struct Column {
    /// Logarithms of the views' distances, m.
    log_distances: Vec<f64>,
    /// Per view, channel and source.
    views: Vec<[[Source; SOURCES]; 3]>,
    waves: Waves,
}

/// The waves of which tables know what the water leaves of them.
#[derive(Clone, Debug)]
pub(super) struct Waves {
    frequencies_per_m: Vec<f64>,
    log: Vec<f64>,
}

/// A view at a distance, for any lamp level.
#[derive(Clone, Debug)]
pub(super) struct Lit<'a> {
    waves: &'a Waves,
    channels: [[LitSource; SOURCES]; 3],
}

/// One source of a channel.
#[derive(Clone, Debug)]
struct LitSource {
    veil: [f64; PATCHES],
    /// E · (T + S).
    gain: [f64; PATCHES],
    /// Sums over patches of E · T and E · S.
    straight: f64,
    scattered: f64,
    transfer: Vec<f64>,
}

/// Everything of a view that a picture at one depth, distance and lamp level needs, per channel: sums of daylight and lamps.
#[derive(Clone, Debug)]
pub(super) struct Seen<'a> {
    /// V per patch.
    pub(super) veil: [[f64; PATCHES]; 3],
    /// Share of the lamps in all light that comes from the target.
    pub(super) lamps: [f64; 3],
    /// E · (T + S) per patch: what an even target of reflectance 1 would add.
    pub(super) gain: [[f64; PATCHES]; 3],
    /// Contrast left of waves, relative to an even target.
    transfer: [Vec<f64>; 3],
    waves: &'a Waves,
}

/// A place between two nodes: the one before and how far it is to the next, beyond the ends below 0 or above 1.
#[derive(Clone, Copy, Debug)]
struct Between {
    before: usize,
    share: f64,
}

/// Where `at` lies among rising `nodes`.
fn between(nodes: &[f64], at: f64) -> Between {
    let n = nodes.len();
    if n < 2 {
        return Between {
            before: 0,
            share: 0.0,
        };
    }
    let before = nodes.partition_point(|&node| node <= at).clamp(1, n - 1) - 1;
    Between {
        before,
        share: (at - nodes[before]) / (nodes[before + 1] - nodes[before]),
    }
}

fn line(from: f64, to: f64, share: f64) -> f64 {
    from + share * (to - from)
}

impl Values {
    fn new(of: impl Fn(usize) -> f64) -> Self {
        let plain: [f64; PATCHES] = std::array::from_fn(of);
        Self {
            log: plain.map(f64::ln),
            plain,
        }
    }

    /// Between these and others by their logarithms, in a straight line where one of them is 0; never below 0.
    fn towards(&self, other: &Self, share: f64) -> [f64; PATCHES] {
        std::array::from_fn(|i| match self.plain[i] > 0.0 && other.plain[i] > 0.0 {
            true => line(self.log[i], other.log[i], share).exp(),
            false => line(self.plain[i], other.plain[i], share).max(0.0),
        })
    }
}

impl Source {
    /// Between the tables of two depths, times `square`.
    fn new([upper, lower]: [&SourceTables; 2], k: usize, share: f64, square: f64) -> Self {
        let mixed = |of: fn(&SourceTables) -> &[Vec<f64>; 3], i: usize| {
            grid::between(of(upper)[k][i], of(lower)[k][i], share).max(0.0)
        };
        let light = |i: usize| square * mixed(|s| &s.light, i);
        let waves = upper.transfer[k].iter().zip(&lower.transfer[k]);
        Self {
            values: [
                Values::new(|i| mixed(|s| &s.veil, i)),
                Values::new(|i| light(i) * mixed(|s| &s.straight, i)),
                Values::new(|i| light(i) * mixed(|s| &s.scattered, i)),
            ],
            transfer: waves.map(|(&a, &b)| line(a, b, share)).collect(),
        }
    }

    /// One without light, of as many waves.
    fn none(waves: usize) -> Self {
        Self {
            values: std::array::from_fn(|_| Values::new(|_| 0.0)),
            transfer: vec![0.0; waves],
        }
    }

    /// Between this and the source of the next view, E divided by `square`.
    fn towards(&self, next: &Self, share: f64, square: f64) -> LitSource {
        let values = |kind: usize| self.values[kind].towards(&next.values[kind], share);
        let (straight, scattered) = (values(1), values(2));
        let waves = self.transfer.iter().zip(&next.transfer);
        LitSource {
            veil: values(0),
            gain: std::array::from_fn(|i| (straight[i] + scattered[i]) / square),
            straight: straight.iter().sum::<f64>() / square,
            scattered: scattered.iter().sum::<f64>() / square,
            transfer: waves.map(|(&a, &b)| line(a, b, share)).collect(),
        }
    }
}

impl Column {
    /// The tables at `depth_m`.
    pub(super) fn new(tables: &WaterTables, depth_m: f64) -> Self {
        let depth = between(&tables.depths_m, depth_m);
        let waves = tables.frequencies_per_m.len();
        let view = |view: &super::water::ViewTables| {
            let at = |i: usize| view.daylight.get(i);
            let upper = at(depth.before);
            let day = upper.map(|upper| [upper, at(depth.before + 1).unwrap_or(upper)]);
            let square = view.distance_m * view.distance_m;
            std::array::from_fn(|k| {
                let daylight = day.map(|day| Source::new(day, k, depth.share, 1.0));
                [
                    daylight.unwrap_or_else(|| Source::none(waves)),
                    Source::new([&view.lamps; 2], k, 0.0, square),
                ]
            })
        };
        let log = |values: &[f64]| values.iter().map(|v| v.ln()).collect();
        let distances_m: Vec<f64> = tables.views.iter().map(|view| view.distance_m).collect();
        Self {
            log_distances: log(&distances_m),
            views: tables.views.iter().map(view).collect(),
            waves: Waves {
                log: log(&tables.frequencies_per_m),
                frequencies_per_m: tables.frequencies_per_m.clone(),
            },
        }
    }

    /// The view from `distance_m`, straight on by logarithms beyond the tables' ends.
    pub(super) fn lit(&self, distance_m: f64) -> Lit<'_> {
        let place = between(&self.log_distances, distance_m.ln());
        let next = (place.before + 1).min(self.views.len() - 1);
        let source = |k: usize, source: usize| {
            let square = match source == LAMPS {
                true => distance_m * distance_m,
                false => 1.0,
            };
            let (near, far) = (&self.views[place.before], &self.views[next]);
            near[k][source].towards(&far[k][source], place.share, square)
        };
        Lit {
            waves: &self.waves,
            channels: std::array::from_fn(|k| [0, LAMPS].map(|of| source(k, of))),
        }
    }
}

impl<'a> Lit<'a> {
    /// The view with the tables' daylight and lamps times these, per channel.
    pub(super) fn seen(&self, daylight: [f64; 3], lamps: [f64; 3]) -> Seen<'a> {
        let channels = &self.channels;
        let sum = |k: usize, of: &dyn Fn(&LitSource) -> f64| {
            daylight[k] * of(&channels[k][0]) + lamps[k] * of(&channels[k][LAMPS])
        };
        let patches = |of: &dyn Fn(&LitSource) -> &[f64; PATCHES]| {
            std::array::from_fn(|k| std::array::from_fn(|i| sum(k, &|source| of(source)[i])))
        };
        let transfer = |k: usize| {
            let straight = sum(k, &|source| source.straight);
            let total = straight + sum(k, &|source| source.scattered);
            let wave = |f: usize| {
                let left = straight + sum(k, &|source| source.scattered * source.transfer[f]);
                left / total.max(f64::MIN_POSITIVE)
            };
            (0..self.waves.log.len()).map(wave).collect()
        };
        let of_lamps = |k: usize| {
            let light = |of: usize| channels[k][of].straight + channels[k][of].scattered;
            let (day, lamp) = (daylight[k] * light(0), lamps[k] * light(LAMPS));
            lamp / (day + lamp).max(f64::MIN_POSITIVE)
        };
        Seen {
            lamps: std::array::from_fn(of_lamps),
            veil: patches(&|source| &source.veil),
            gain: patches(&|source| &source.gain),
            transfer: std::array::from_fn(transfer),
            waves: self.waves,
        }
    }
}

impl Seen<'_> {
    /// Contrast left of waves of a frequency; 1 below the lowest of the tables, by the last above the highest.
    pub(super) fn left_of(&self, k: usize, frequency_per_m: f64) -> f64 {
        let (waves, transfer) = (self.waves, &self.transfer[k]);
        let Some(&lowest) = waves.frequencies_per_m.first() else {
            return 1.0;
        };
        if frequency_per_m <= lowest {
            return line(1.0, transfer[0], (frequency_per_m / lowest).max(0.0));
        }
        let place = between(&waves.log, frequency_per_m.ln());
        let after = (place.before + 1).min(waves.log.len() - 1);
        line(
            transfer[place.before],
            transfer[after],
            place.share.min(1.0),
        )
    }
}
