//! Predictions in waters so simple that the truth is known.

use uw_calib::ImageStats;
use uw_calib::picture::Counts;
use uw_calib::response::CountResponse;

use super::file::{FitNumbers, SensorNumbers, WATER_FORMAT, WaterFile, WaterNumbers};
use super::grid::PATCHES;
use super::light::Column;
use super::water::{Field, SourceTables, ViewTables, WaterTables};
use super::{LinearPicture, Predictor, Sight, WaterDoubt};
use crate::features::Candidate;

const WIDTH: usize = 320;
const HEIGHT: usize = 192;
const HALF_VIEW: f64 = 0.5;
const VEIL: f64 = 0.05;
const C_PER_M: f64 = 0.4;

fn even(value: f64) -> Field {
    std::array::from_fn(|_| vec![value; PATCHES])
}

/// Water that attenuates and adds an even veil that grows with the distance, no scattered rays; lamps whose light falls with its
/// square, and daylight of 0.5.
pub(super) fn even_water() -> WaterFile {
    let frequencies_per_m = vec![1.0, 10.0, 100.0];
    let source = |light: f64, veil: f64, distance_m: f64| SourceTables {
        veil: even(veil),
        light: even(light),
        straight: even((-C_PER_M * distance_m).exp()),
        scattered: even(0.0),
        transfer: std::array::from_fn(|_| vec![0.0; 3]),
    };
    let view = |distance_m: f64| ViewTables {
        distance_m,
        lamps: source(2.0 / (distance_m * distance_m), VEIL, distance_m),
        daylight: vec![source(0.5, VEIL * distance_m, distance_m)],
    };
    WaterFile {
        format: WATER_FORMAT.to_owned(),
        made_by: "a test".to_owned(),
        water: WaterNumbers {
            a_per_m: [0.1; 3],
            b_per_m: [0.3; 3],
            backscatter_fraction: 0.02,
        },
        sensor: SensorNumbers {
            width_px: WIDTH,
            height_px: HEIGHT,
            encoding: uw_calib::Encoding::Srgb,
            exposure_m2_sr_per_w: 1.0,
            noise_a: 1e-4,
            noise_b: 1e-6,
            vignetting: None,
        },
        tables: WaterTables {
            half_view: [HALF_VIEW, HALF_VIEW * HEIGHT as f64 / WIDTH as f64],
            frequencies_per_m,
            sun: None,
            depths_m: vec![3.0],
            views: [0.5, 1.0, 2.0, 4.0].map(view).to_vec(),
        },
        sights: Vec::new(),
        fit: None,
    }
}

/// Reflectance at a point of the target, m: waves of many lengths in both directions.
pub(super) fn reflectance(x: f64, y: f64) -> f64 {
    let wave = |length_m: f64, phase: f64| {
        let turn = std::f64::consts::TAU / length_m;
        (turn * x + phase).sin() * (turn * y - phase).cos()
    };
    0.3 + 0.02 * (wave(0.61, 0.3) + wave(0.23, 1.0) + wave(0.09, 2.0) + wave(0.041, 0.7))
        + 0.015 * (wave(1.7, 0.1) + wave(0.021, 0.5))
}

/// Normal numbers by adding twelve even ones: good enough for noise.
pub(super) struct Noise(pub(super) u64);

impl Noise {
    pub(super) fn next(&mut self) -> f64 {
        let mut sum = -6.0;
        for _ in 0..12 {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            sum += (self.0 >> 11) as f64 / (1u64 << 53) as f64;
        }
        sum
    }
}

/// The stored picture from a distance, pixels averaged over 3 × 3 points, at a lamp level.
pub(super) fn picture(file: &WaterFile, at: &Candidate, seed: u64) -> Counts {
    picture_of(file, at, seed, &reflectance)
}

/// The same of another target.
pub(super) fn picture_of(
    file: &WaterFile,
    at: &Candidate,
    seed: u64,
    reflectance: &dyn Fn(f64, f64) -> f64,
) -> Counts {
    exposed(file, at, (seed, 1.0), reflectance)
}

/// The same, exposed so many times as long as the file's pictures.
pub(super) fn exposed(
    file: &WaterFile,
    at: &Candidate,
    (seed, over): (u64, f64),
    reflectance: &dyn Fn(f64, f64) -> f64,
) -> Counts {
    let (d, level) = (at.distance_m, 0.01 * at.light_pct);
    let day = f64::from(u8::from(!file.tables.depths_m.is_empty()));
    let light = day * 0.5 + level * 2.0 / (d * d);
    let veil = day * VEIL * d + level * VEIL;
    let pixel_m = 2.0 * HALF_VIEW * d / WIDTH as f64;
    let mut noise = Noise(seed);
    let encoding = uw_calib::Encoding::Srgb;
    let pixel = |i: usize| {
        let (column, row) = ((i % WIDTH) as f64, (i / WIDTH) as f64);
        let mut mean = 0.0;
        for j in 0..9 {
            let (u, v) = (
                (j % 3) as f64 / 3.0 + 1.0 / 6.0,
                (j / 3) as f64 / 3.0 + 1.0 / 6.0,
            );
            let x = (column + u - 0.5 * WIDTH as f64) * pixel_m;
            let y = (row + v - 0.5 * HEIGHT as f64) * pixel_m;
            mean += reflectance(x, y) / 9.0;
        }
        let signal = over * (veil + light * (-C_PER_M * d).exp() * mean);
        [0, 1, 2].map(|_| {
            let deviation = (file.sensor.noise_a * signal + file.sensor.noise_b).sqrt();
            encoding.counts(signal + deviation * noise.next()).round()
        })
    };
    Counts::stored(WIDTH, HEIGHT, (0..WIDTH * HEIGHT).map(pixel).collect())
}

/// The same picture before a grey card: its mean and noise.
fn even_picture(file: &WaterFile, at: &Candidate) -> Counts {
    let mut counts = picture(file, at, 3);
    let mean: f64 = counts.pixels.iter().map(|p| p[0]).sum::<f64>() / counts.pixels.len() as f64;
    let mut noise = Noise(5);
    let encoding = file.sensor.encoding;
    let signal = encoding.light(mean);
    let deviation = (file.sensor.noise_a * signal + file.sensor.noise_b).sqrt();
    for pixel in &mut counts.pixels {
        *pixel = [0, 1, 2].map(|_| encoding.counts(signal + deviation * noise.next()).round());
    }
    counts
}

pub(super) fn at(distance_m: f64, light_pct: f64) -> Candidate {
    Candidate {
        distance_m,
        light_pct,
    }
}

pub(super) fn contrast_of(picture: &Counts) -> [f64; 3] {
    let stats = ImageStats::from_counts(picture.width, picture.height, &picture.pixels);
    stats.expect("a picture").contrast
}

fn predictor<'a>(
    file: &'a WaterFile,
    response: &'a CountResponse,
    here: &Candidate,
) -> Predictor<'a> {
    let counts = picture(file, here, 3);
    let linear = LinearPicture::of_counts(&counts, file.sensor.encoding);
    let now = (here, contrast_of(&counts));
    Predictor::new(file.place(response, 3.0), &linear, now, &file.sights)
}

/// The same distance at other lamp levels needs the light alone, and nearer ones what the middle of the picture shows.
#[test]
fn other_levels_and_nearer_distances_are_predicted_from_one_picture() {
    let file = even_water();
    let response = file.sensor.response();
    let here = at(2.0, 20.0);
    let predictor = predictor(&file, &response, &here);
    for (there, allowed) in [
        (here, 0.015),
        (at(2.0, 0.0), 0.02),
        (at(2.0, 100.0), 0.02),
        (at(1.4, 20.0), 0.06),
        (at(1.0, 40.0), 0.08),
    ] {
        let truth = contrast_of(&picture(&file, &there, 8));
        let found = predictor.contrast(&there);
        for k in 0..3 {
            let off = found.counts[k] / truth[k] - 1.0;
            assert!(off.abs() < allowed, "{there:?}: {found:?} {truth:?}");
            let errors = (found.counts[k] - truth[k]).abs() / found.error_counts[k];
            assert!(errors < 4.0, "{there:?}: {found:?} {truth:?}");
        }
    }
}

/// A near picture does not show what farther ones will: its error says so, and a sight from there tells.
#[test]
fn farther_distances_are_told_by_earlier_sights_or_left_open() {
    let mut file = even_water();
    let response = file.sensor.response();
    let (here, there) = (at(0.5, 0.0), at(3.0, 50.0));
    let strong = |x: f64, y: f64| 0.4 + 4.0 * (reflectance(x, y) - 0.3);
    let taken = |file: &WaterFile, at: &Candidate, seed: u64| {
        let counts = picture_of(file, at, seed, &strong);
        let linear = LinearPicture::of_counts(&counts, file.sensor.encoding);
        (linear, contrast_of(&counts))
    };
    let predicted = |file: &WaterFile| {
        let (linear, contrast) = taken(file, &here, 3);
        let place = file.place(&response, 3.0);
        Predictor::new(place, &linear, (&here, contrast), &file.sights).contrast(&there)
    };
    let alone = predicted(&file);
    let (_, truth) = taken(&file, &there, 8);
    let seen = at(3.0, 0.0);
    let sights = [(seen, 9), (here, 10)].map(|(from, seed)| {
        let (linear, _) = taken(&file, &from, seed);
        Sight::new(&file.place(&response, 3.0), &linear, &from)
    });
    file.sights = sights.to_vec();
    // The smallest parts of these pictures have room for an eleventh column of patches.
    file.check().expect("a good file");
    let told = predicted(&file);
    for k in 0..3 {
        assert!(alone.error_counts[k] > 0.15 * alone.counts[k], "{alone:?}");
        assert!(
            told.error_counts[k] < 0.5 * alone.error_counts[k],
            "{told:?} {alone:?}"
        );
        assert!(
            (told.counts[k] / truth[k] - 1.0).abs() < 0.05,
            "{told:?} {truth:?}"
        );
        let off = (alone.counts[k] - truth[k]).abs() / alone.error_counts[k];
        assert!(off < 3.0, "{alone:?} {truth:?}");
    }
}

/// Detail that noise hides is expected from what is seen of coarser detail, neither absent nor as noise has it, and the error holds the truth.
#[test]
fn detail_that_noise_hides_is_expected_from_coarser_detail() {
    let mut file = even_water();
    let there = at(1.0, 0.0);
    let (mut off_counts, mut square, mut n) = (0.0, 0.0, 0.0);
    for (noise, distance_m) in [
        (1e-5, 2.5),
        (1e-5, 3.5),
        (4e-5, 2.5),
        (4e-5, 3.5),
        (1e-4, 2.5),
        (1e-4, 3.5),
        (2e-4, 2.5),
        (2e-4, 3.5),
    ] {
        (file.sensor.noise_a, file.sensor.noise_b) = (5.0 * noise, noise);
        let response = file.sensor.response();
        let truth = contrast_of(&picture(&file, &there, 8));
        let found = predictor(&file, &response, &at(distance_m, 0.0)).contrast(&there);
        for k in 0..3 {
            let off = found.counts[k] - truth[k];
            off_counts += off.abs();
            square += (off / found.error_counts[k]).powi(2);
            n += 1.0;
        }
    }
    let (off_counts, in_errors) = (off_counts / n, f64::sqrt(square / n));
    assert!(off_counts < 0.4, "{off_counts} counts off");
    // This target has in each octave nearly what is expected, which others differ from by the whole of it.
    assert!(
        (0.1..1.5).contains(&in_errors),
        "{off_counts} counts off are {in_errors} standard errors"
    );
}

/// What a fit leaves open of the water grows with the way between the picture and the prediction, and errors of a and b that go against
/// each other cancel as far as both count.
#[test]
fn errors_of_a_fitted_water_are_in_those_of_predictions() {
    let mut file = even_water();
    let response = file.sensor.response();
    let here = at(1.0, 0.0);
    let known = predictor(&file, &response, &here);
    let places = [at(1.0, 0.0), at(2.0, 0.0), at(2.0, 100.0)];
    let errors = |predictor: &Predictor| places.map(|p| predictor.contrast(&p).error_counts[0]);
    let before = errors(&known);
    let counts = places.map(|place| known.contrast(&place).counts[0]);
    // a is 0.1 ± 0.05 1/m, b 0.3 ± 0.06 1/m; in the last file what is added to the one is taken from the other.
    let added = |file: &mut WaterFile, correlation: f64| {
        file.fit = Some(fitted(correlation));
        let after = errors(&predictor(file, &response, &here));
        std::array::from_fn::<f64, 3, _>(|i| {
            (after[i].powi(2) - before[i].powi(2)).max(0.0).sqrt() / counts[i]
        })
    };
    let [same, farther, lit] = added(&mut file, 0.0);
    assert!(same < 1e-6, "{same}");
    // Detail of 0.05² + 0.06² over a metre, of which the sensor's noise is a part that does not change.
    assert!((0.04..0.09).contains(&farther), "{farther}");
    assert!(lit > farther, "{lit} {farther}");
    let doubt = WaterDoubt::new(&fitted(0.0), &file.water).expect("errors");
    for (lamps, ways_of_a) in [(0.0, 1.0), (0.5, 1.5), (1.0, 2.0)] {
        let error = doubt.relative(1, 2.0, [lamps; 2]);
        let exact = 2.0 * f64::hypot(0.05 * ways_of_a, 0.06);
        assert!((error / exact - 1.0).abs() < 1e-9, "{lamps}: {error}");
    }
    // The lamps beside daylight: where their share changes, whatever the way.
    let mut of_lamps = fitted(0.0);
    of_lamps.daylight_gain_relative_error = Some([0.0, 0.1, 0.0]);
    let beside = WaterDoubt::new(&of_lamps, &file.water).expect("errors");
    for (way_m, own) in [(0.0, 0.0), (2.0, doubt.relative(1, 2.0, [0.7; 2]))] {
        let error = beside.relative(1, way_m, [0.2, 0.7]);
        let exact = f64::hypot(own, 0.05);
        assert!((error / exact - 1.0).abs() < 1e-9, "{way_m}: {error}");
    }
    let [_, cancelled, _] = added(&mut file, -1.0);
    assert!(cancelled < 0.3 * farther, "{cancelled} {farther}");
    of_lamps.daylight_gain_relative_error = Some([0.0, -0.1, 0.0]);
    file.fit = Some(of_lamps);
    let error = file.check().expect_err("refused");
    assert!(error.contains("daylight_gain_relative_error[1]"), "{error}");
    for (broken, told) in [(f64::NAN, "correlation of a_r and b_r"), (1.5, "got 1.5")] {
        file.fit = Some(fitted(broken));
        let error = file.check().expect_err("refused");
        assert!(error.contains(told), "{error}");
    }
}

/// Numbers of a fit in which a and b of each channel are correlated.
fn fitted(correlation: f64) -> FitNumbers {
    let names = ["a_r", "a_g", "a_b", "b_r", "b_g", "b_b"];
    let entry = |i: usize, j: usize| match (i == j, i % 3 == j % 3) {
        (true, _) => 1.0,
        (false, true) => correlation,
        (false, false) => 0.0,
    };
    FitNumbers {
        a_relative_error: [0.5; 3],
        b_relative_error: [0.2; 3],
        backscatter_relative_error: 0.3,
        jerlov: None,
        jerlov_error: None,
        lamp_gain: [1.0; 3],
        lamp_gain_relative_error: [0.3; 3],
        daylight_gain: None,
        daylight_gain_relative_error: None,
        reflectance: [0.3; 3],
        names: names.map(str::to_owned).to_vec(),
        correlation: (0..6)
            .map(|i| (0..6).map(|j| entry(i, j)).collect())
            .collect(),
        not_identified: Vec::new(),
        misfit: 1.0,
        exposure_s: None,
        iso: None,
    }
}

/// Without daylight the depth does not count, and without lamps nothing is left but the noise of a black picture.
#[test]
fn in_the_dark_lamps_are_all_the_light() {
    let mut file = even_water();
    file.tables.depths_m.clear();
    file.tables
        .views
        .iter_mut()
        .for_each(|view| view.daylight.clear());
    let file: WaterFile = serde_json::from_str(&file.to_json()).expect("a water file");
    assert_eq!((file.check(), file.tables.depth_range_m()), (Ok(()), None));
    let response = file.sensor.response();
    let here = at(1.0, 60.0);
    let counts = picture(&file, &here, 3);
    let linear = LinearPicture::of_counts(&counts, file.sensor.encoding);
    let now = (&here, contrast_of(&counts));
    let [deep, shallow] = [400.0, 0.0]
        .map(|depth_m| Predictor::new(file.place(&response, depth_m), &linear, now, &[]));
    for there in [at(1.0, 100.0), at(0.7, 20.0), at(0.7, 0.0)] {
        let seen = contrast_of(&picture(&file, &there, 4));
        let predicted = deep.contrast(&there);
        assert_eq!(predicted.counts, shallow.contrast(&there).counts);
        for k in 0..3 {
            let off = predicted.counts[k] - seen[k];
            assert!(
                off.abs() < 0.15 + 0.05 * seen[k],
                "{there:?}: {predicted:?}, {seen:?}"
            );
        }
    }
}

/// A grey card has no contrast but its noise, which is not taken for detail: nearer by, with more light, it stays noise.
#[test]
fn noise_is_not_detail() {
    let file = even_water();
    let response = file.sensor.response();
    let here = at(4.0, 0.0);
    let encoding = file.sensor.encoding;
    let counts = even_picture(&file, &here);
    let linear = LinearPicture::of_counts(&counts, encoding);
    let now = (&here, contrast_of(&counts));
    let predictor = Predictor::new(file.place(&response, 3.0), &linear, now, &[]);
    for k in 0..3 {
        let found = predictor.contrast(&at(0.5, 0.0)).counts[k];
        let as_detail = now.1[k] * (C_PER_M * 3.5).exp();
        assert!(found < 0.5 * as_detail, "{found} {as_detail}");
    }
}

/// Tables without any pattern to them.
fn uneven_water() -> WaterFile {
    let mut file = even_water();
    let mut noise = Noise(17);
    let mut positive = |scale: f64| scale * (0.3 * noise.next()).exp();
    let source = |positive: &mut dyn FnMut(f64) -> f64| {
        let mut field = |scale: f64| -> Field {
            [0, 1, 2].map(|_| (0..PATCHES).map(|_| positive(scale)).collect())
        };
        SourceTables {
            veil: field(0.05),
            light: field(0.8),
            straight: field(0.4),
            scattered: field(0.1),
            transfer: [0.8, 0.6, 0.5].map(|last| vec![0.9, 0.7, 0.3 * last]),
        }
    };
    file.tables.depths_m = vec![1.0, 3.0];
    for view in &mut file.tables.views {
        view.lamps = source(&mut positive);
        view.daylight = vec![source(&mut positive), source(&mut positive)];
    }
    file
}

/// What is looked up once a depth and once a distance is what the tables say: every quantity between the nodes by its logarithm, the light of
/// lamps with the squared distance taken out.
#[test]
fn tables_made_ready_are_the_tables() {
    let tables = uneven_water().tables;
    let (depth_m, distance_m, level) = (1.7, 1.3, 0.35);
    let (daylight, lamps) = ([1.1, 0.9, 1.0], [0.8, 1.2, 1.0]);
    let log = |a: f64, b: f64, share: f64| a * (b / a).powf(share);
    let (deeper, farther) = ((depth_m - 1.0) / 2.0, (distance_m / 1.0_f64).log2());
    let column = Column::new(&tables, depth_m);
    let lit = column.lit(distance_m);
    let seen = lit.seen(daylight, lamps.map(|lamp| level * lamp));
    let views = [&tables.views[1], &tables.views[2]];
    for k in 0..3 {
        let (mut all, mut left) = (0.0, 0.0);
        for i in 0..PATCHES {
            let day = |of: fn(&SourceTables) -> &Field| {
                let [near, far] = views.map(|view| {
                    let [upper, lower] = [0, 1].map(|j| of(&view.daylight[j])[k][i]);
                    log(upper, lower, deeper)
                });
                log(near, far, farther)
            };
            let lamp = |of: fn(&SourceTables) -> &Field| {
                let [near, far] = views.map(|view| of(&view.lamps)[k][i]);
                log(near, far, farther)
            };
            let [near, far] =
                views.map(|view| view.lamps.light[k][i] * view.distance_m * view.distance_m);
            let by_day = daylight[k] * day(|s| &s.light);
            let by_lamps = level * lamps[k] * log(near, far, farther) / (distance_m * distance_m);
            let veil = daylight[k] * day(|s| &s.veil) + level * lamps[k] * lamp(|s| &s.veil);
            let straight = by_day * day(|s| &s.straight) + by_lamps * lamp(|s| &s.straight);
            let scattered = by_day * day(|s| &s.scattered) + by_lamps * lamp(|s| &s.scattered);
            assert!((seen.veil[k][i] / veil - 1.0).abs() < 1e-12);
            assert!((seen.gain[k][i] / (straight + scattered) - 1.0).abs() < 1e-12);
            all += straight + scattered;
            left += straight + 0.7 * scattered;
        }
        assert!((seen.left_of(k, 10.0) - left / all).abs() < 1e-12);
    }
}

/// Detail in the middle of a far picture that noise hides is all that a near one shows: it is not predicted, but the error holds it.
#[test]
fn what_noise_hides_in_the_middle_is_in_the_error() {
    let mut file = even_water();
    file.sensor.noise_a = 1e-3;
    let target = |x: f64, y: f64| {
        let strength = if x.hypot(y) < 1.2 { 0.15 } else { 1.0 };
        0.3 + strength * (reflectance(x, y) - 0.3)
    };
    let (far, near) = (at(4.0, 0.0), at(0.5, 0.0));
    let shown = picture_of(&file, &far, 9, &target);
    // The file says more noise than there is.
    let mut noisy = even_water();
    noisy.sensor.noise_a = 2e-3;
    let linear = LinearPicture::of_counts(&shown, file.sensor.encoding);
    let response = noisy.sensor.response();
    let place = noisy.place(&response, 3.0);
    let predictor = Predictor::new(place, &linear, (&far, contrast_of(&shown)), &[]);
    let found = predictor.contrast(&near);
    let truth = contrast_of(&picture_of(&file, &near, 10, &target));
    for k in 0..3 {
        let (off, error) = (found.counts[k] - truth[k], found.error_counts[k]);
        assert!(error > 1.0 && off.abs() < 1.645 * error, "{off} {error}");
    }
}

/// A picture whose parts differ says that its surroundings will, too: its error grows with the distance, as far as they do.
#[test]
fn a_target_of_unlike_parts_is_less_known_from_afar() {
    let file = even_water();
    let response = file.sensor.response();
    let here = at(0.5, 20.0);
    let mut counts = picture(&file, &here, 3);
    let even = LinearPicture::of_counts(&counts, file.sensor.encoding);
    let mean = counts.pixels.iter().map(|p| p[0]).sum::<f64>() / counts.pixels.len() as f64;
    for (i, pixel) in counts.pixels.iter_mut().enumerate() {
        if i % WIDTH < WIDTH / 2 {
            *pixel = pixel.map(|count| mean + 0.2 * (count - mean));
        }
    }
    let uneven = LinearPicture::of_counts(&counts, file.sensor.encoding);
    let share = |shown: &LinearPicture, there: Candidate| {
        let contrast = contrast_of(&counts);
        let place = file.place(&response, 3.0);
        let found = Predictor::new(place, shown, (&here, contrast), &[]).contrast(&there);
        found.error_counts[1] / found.counts[1]
    };
    for there in [at(1.0, 20.0), at(2.0, 20.0)] {
        let (one, other) = (share(&even, there), share(&uneven, there));
        assert!(other > 1.5 * one, "{there:?}: {one} {other}");
    }
    let same = share(&uneven, here) / share(&even, here);
    assert!((same - 1.0).abs() < 0.2, "{same}");
}
