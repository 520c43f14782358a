//! A slider, and a point of a profile, dragged for a long time: frames stay short, memory stays flat, nothing stale is called current.
//! A program of its own, because the memory it reads is that of the whole process.

#[path = "../common/mod.rs"]
mod common;

use std::time::{Duration, Instant};

use uw_media::Iops;
use uw_viewer::app::{Options, Viewer};
use uw_viewer::model::{Coefficients, DepthProfile, OpenScene, Water, WaterBands};

use common::{PATIENCE, SCENE};

/// Events per second.
const RATE_HZ: u32 = 60;
/// Seconds of dragging, where `UW_DRAG_SECONDS` asks for no other number.
const SECONDS: u32 = 6;
/// Longest work of the window's own thread on one frame. Its processor time, so that other work on the machine does
/// not count; two milliseconds are usual.
const LONGEST: Duration = Duration::from_millis(100);
/// Frames in a hundred that may take longer: a virtual machine that is halted for a while counts that time as the
/// thread's own (one frame of 720 took 189 ms so). Work that a change brings to the window's thread comes with each
/// frame.
const HALTED_PCT: usize = 1;
/// Growth of the memory over the second half, bytes: some frames in flight, no leak (one frame per event would be
/// some hundred times more).
const GROWTH: u64 = 24 << 20;

/// Resident memory of this process, bytes, where the system tells.
fn memory() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/statm").ok()?;
    let pages: u64 = text.split_whitespace().nth(1)?.parse().ok()?;
    Some(4096 * pages)
}

/// Water between the types, by a slider that goes to and fro.
fn slide(water: &mut Water, i: u32) {
    water.coefficients = Coefficients::Jerlov {
        scale: 4.5 + 4.5 * (f64::from(i) * 0.05).sin(),
        bands: WaterBands::Spectral,
    };
}

/// A layer that a dragged point makes denser and deeper, and thinner and shallower again.
fn draw(water: &mut Water, i: u32) {
    if let Coefficients::Jerlov { .. } = water.coefficients {
        let clear = Coefficients::Direct(Iops {
            a: [0.3, 0.1, 0.05],
            b: [0.2; 3],
        });
        let mut profile = DepthProfile::of(&clear, 6.0);
        profile.insert(3.0);
        water.coefficients = Coefficients::Profile(profile);
    }
    if let Coefficients::Profile(profile) = &mut water.coefficients {
        let share = (f64::from(i) * 0.05).sin();
        profile.set_depth(1, 3.0 + share);
        let (a, b) = ([0.3, 0.1, 0.05], [0.6 + 0.4 * share; 3]);
        profile.set_values(1, Iops { a, b });
    }
}

/// One after the other, because the memory is that of the whole process.
#[test]
fn dragging_neither_freezes_nor_leaks_nor_lies() {
    for change in [slide, draw] {
        is_dragged(change);
    }
}

fn is_dragged(change: fn(&mut Water, u32)) {
    let text = SCENE.replace("width = 160, height = 90", "width = 640, height = 360");
    let opened = OpenScene::parse(&text, "drag.toml".as_ref()).expect("valid");
    let viewer =
        Viewer::new(&egui::Context::default(), opened, Options::default()).expect("a thread");
    let mut harness = egui_kittest::Harness::builder()
        .with_size([1280.0, 720.0])
        .build_ui_state(|ui, viewer: &mut Viewer| viewer.show(ui), viewer);
    harness.run_steps(3);
    let start = Instant::now();
    let (mut frames, mut pictures, mut last_serial) = (Vec::new(), 0, 0);
    let (mut half_way, mut last_generation) = (None, 0);
    let asked = std::env::var("UW_DRAG_SECONDS").ok();
    let seconds = asked.and_then(|s| s.parse().ok()).unwrap_or(SECONDS);
    let events = RATE_HZ * seconds;
    for i in 0..events {
        let due = start + Duration::from_secs(1) * i / RATE_HZ;
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        let water = harness.state_mut().settings.water.as_mut().expect("water");
        change(water, i);
        let before = cpu_time::ThreadTime::now();
        harness.step();
        frames.push(before.elapsed());
        let viewer = harness.state();
        assert!(
            viewer.generation() > last_generation,
            "a change was not sent"
        );
        last_generation = viewer.generation();
        if let Some(frame) = viewer.frame() {
            assert_eq!(viewer.is_current(), frame.generation == viewer.generation());
            pictures += u32::from(frame.serial != last_serial);
            last_serial = frame.serial;
        }
        if i == events / 2 {
            half_way = memory();
        }
    }
    frames.sort_unstable();
    let longest = frames[frames.len() - 1 - frames.len() * HALTED_PCT / 100];
    eprintln!(
        "frames of {:.1} ms but for {HALTED_PCT} %, {pictures} pictures in {seconds} s, memory half way and now {:?} {:?} MiB",
        1e3 * longest.as_secs_f64(),
        half_way.map(|b| b >> 20),
        memory().map(|b| b >> 20)
    );
    assert!(longest < LONGEST, "frames of the window took {longest:?}");
    assert!(pictures >= 2, "no pictures came while dragging");
    if let (Some(then), Some(now)) = (half_way, memory()) {
        assert!(
            now < then + GROWTH,
            "memory grew from {then} to {now} bytes"
        );
    }
    let end = Instant::now();
    while !harness.state().is_current() {
        harness.step();
        assert!(end.elapsed() < PATIENCE, "the last picture did not come");
        std::thread::sleep(Duration::from_millis(5));
    }
}
