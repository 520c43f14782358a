//! From a coarse first picture to the full one: sizes, batches and times.

use std::time::Duration;

/// How long the first picture of a change may take: about half of the 200 ms within which it should show, because the
/// one before it may have to end first.
const FIRST_PICTURE: Duration = Duration::from_millis(35);
/// How long the first picture may go on although newer settings have come.
const GRACE: Duration = Duration::from_millis(45);
/// The same after first pictures that were given up: on a busy machine none would ever come otherwise.
const MOST_GRACE: Duration = Duration::from_millis(360);
/// Least and most time between two pictures on the screen while samples are added.
const SHOW_EVERY: [Duration; 2] = [Duration::from_millis(200), Duration::from_secs(2)];
/// Time between two pictures, as a share of the age of the render: an old picture changes slowly.
const SHOW_SHARE: f64 = 0.15;
/// Coarsest first picture: pixels of the full one per pixel of it, along an edge.
const COARSEST: u32 = 32;
/// Fewest pixels along an edge of a first picture.
const FEWEST_PIXELS: u32 = 16;
/// Samples per second that are assumed before any were counted.
pub const FIRST_RATE: f64 = 50_000.0;

/// How long the first picture of a change may go on although newer settings have come.
#[derive(Clone, Copy, Debug)]
pub struct Grace(Duration);

impl Default for Grace {
    fn default() -> Self {
        Self(GRACE)
    }
}

impl Grace {
    /// The time of the next first picture.
    pub fn now(self) -> Duration {
        self.0
    }

    /// Learns whether a first picture was finished: each that was given up doubles the time of the next.
    pub fn learn(&mut self, finished: bool) {
        self.0 = if finished {
            GRACE
        } else {
            (2 * self.0).min(MOST_GRACE)
        };
    }
}

/// Coarseness of the first picture of `width` × `height` pixels at `rate` samples per second: the finest power of two
/// that keeps its time.
pub fn first_coarseness(width: u32, height: u32, rate: f64) -> u32 {
    let affordable = (rate * FIRST_PICTURE.as_secs_f64()).max(1.0);
    let pixels = f64::from(width) * f64::from(height);
    let mut coarseness = 1;
    while coarseness < COARSEST
        && width.min(height) / (2 * coarseness) >= FEWEST_PIXELS
        && pixels / f64::from(coarseness * coarseness) > affordable
    {
        coarseness *= 2;
    }
    coarseness
}

/// Time until the next picture of a render that has gone on for `age`.
pub fn show_every(age: Duration) -> Duration {
    let [least, most] = SHOW_EVERY;
    age.mul_f64(SHOW_SHARE).clamp(least, most)
}

/// Samples of a batch at full resolution: small at first, for an early picture and an early estimate of its error.
pub fn batch_samples(batch: u32) -> u32 {
    match batch {
        0..=3 => 1,
        4..=7 => 4,
        _ => 16,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 45, 90, 180, 360 ms and no more, and 45 ms again after the first that was finished.
    #[test]
    fn grace_grows_while_pictures_are_given_up_and_returns_with_the_first_that_is_not() {
        let mut grace = Grace::default();
        for expected_ms in [45, 90, 180, 360, 360, 360] {
            assert_eq!(grace.now(), Duration::from_millis(expected_ms));
            grace.learn(false);
        }
        grace.learn(true);
        assert_eq!(grace.now(), Duration::from_millis(45));
        grace.learn(true);
        assert_eq!(grace.now(), Duration::from_millis(45));
    }

    #[test]
    fn the_first_picture_keeps_its_time_and_shows_something() {
        for rate in [1e3, 5e4, 3e5, 2e6, 1e9] {
            for (width, height) in [(1280, 720), (320, 180), (4000, 3000), (20, 10), (1, 1)] {
                let k = first_coarseness(width, height, rate);
                let pixels = f64::from(width / k) * f64::from(height / k);
                let too_many = pixels > rate * FIRST_PICTURE.as_secs_f64();
                let smallest = k == COARSEST || width.min(height) / (2 * k) < FEWEST_PIXELS;
                assert!(!too_many || smallest, "{width} x {height} at {rate}: {k}");
                assert!(k == 1 || width.min(height) / k >= FEWEST_PIXELS);
            }
        }
        assert_eq!(first_coarseness(1280, 720, 1e9), 1);
    }
}
