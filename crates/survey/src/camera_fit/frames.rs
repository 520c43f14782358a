//! Frames of one still view, in linear light and at one exposure.

use uw_calib::Encoding;
use uw_render::image::{Counts, Frame};

/// Largest ratio of two frames' light that counts as one exposure.
const MOST_GAIN: f64 = 1.25;

/// Frames do not go together, or show nothing that can be measured.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FramesError {
    /// Fewer than two frames.
    #[error("noise needs two or more frames of one still view, got {0}")]
    TooFew(usize),
    /// Size or bits differ; frames count from 1.
    #[error("frame {frame} has {got}, frame 1 has {first}; all must be of one size and kind")]
    Different {
        /// Which frame.
        frame: usize,
        /// Its size and bits.
        got: String,
        /// Those of the first.
        first: String,
    },
    /// Two frames are equal in every pixel.
    #[error(
        "frames {0} and {1} are equal in every pixel: the same picture twice holds no noise; take two exposures"
    )]
    Same(usize, usize),
    /// A frame is brighter or darker than the first by more than an exposure drifts.
    #[error(
        "frame {frame} is {gain:.3} times as bright as the mean of the frames; within {MOST_GAIN} is one exposure"
    )]
    Exposure {
        /// Which frame.
        frame: usize,
        /// Its light over the mean.
        gain: f64,
    },
    /// The view moved, or something in it did.
    #[error(
        "the frames do not match: where the picture has detail they differ more than elsewhere at the same signal ({share:.0} % of \
         the difference, as of a shift by {shift_px:.2} pixels){hint}; fix camera and target, and take frames of a still view"
    )]
    Moved {
        /// Share of the differences' variance that goes with the picture's slope, percent.
        share: f64,
        /// Shift that would make it, pixels.
        shift_px: f64,
        /// What else may be behind it.
        hint: &'static str,
    },
    /// Differences that hang together over neighbouring pixels.
    #[error(
        "the frames do not match: their differences are alike at neighbouring pixels (correlation {correlation:.2}), so they are no \
         noise but a moved view or changed light; fix camera, target and light"
    )]
    Smooth {
        /// Correlation of the differences of neighbours.
        correlation: f64,
    },
    /// Differences that are too much to be noise.
    #[error(
        "the frames do not match: they differ by {:.1} % of full scale (standard deviation at half of it), so that too few pixels \
         are sure to be neither black nor at full scale; fix camera, target and light, or take brighter pictures",
        100.0 * deviation
    )]
    Unlike {
        /// Standard deviation of a frame at half of full scale, linear.
        deviation: f64,
    },
    /// Too little is left.
    #[error(
        "{pixels} pixels at {levels} levels of signal are neither black nor at full scale; at least {LEAST_PIXELS} at {LEAST_LEVELS} \
         levels are needed: a larger or better exposed picture with dark and bright parts"
    )]
    TooLittle {
        /// Pixels of channels that can be used.
        pixels: usize,
        /// Levels of signal with enough of them.
        levels: usize,
    },
}

/// Pixels that a fit needs.
pub(super) const LEAST_PIXELS: usize = 2000;
/// Levels that a line needs beside its two ends.
pub(super) const LEAST_LEVELS: usize = 4;

/// Frames in linear light.
pub(super) struct Linear {
    /// Width, pixels.
    pub width: usize,
    /// Height, pixels.
    pub height: usize,
    /// Channels that differ: 3, or 1 where all pictures are grey.
    pub channels: usize,
    /// By frame and channel: linear signal of each pixel, row by row, at the frames' mean exposure.
    pub signal: Vec<Vec<Vec<f32>>>,
    /// By frame: its light over the mean of the frames.
    pub gains: Vec<f64>,
    /// Largest count.
    pub full: f64,
    /// The curve of the counts.
    pub encoding: Encoding,
}

impl Linear {
    /// Checks that the frames go together, undoes the encoding and brings all frames to their mean exposure.
    pub fn new(frames: &[Frame], encoding: Encoding) -> Result<Self, FramesError> {
        let [first, others @ ..] = frames else {
            return Err(FramesError::TooFew(0));
        };
        if others.is_empty() {
            return Err(FramesError::TooFew(1));
        }
        for (i, frame) in others.iter().enumerate() {
            if kind(frame) != kind(first) {
                return Err(FramesError::Different {
                    frame: i + 2,
                    got: kind(frame),
                    first: kind(first),
                });
            }
        }
        for (j, frame) in frames.iter().enumerate() {
            if let Some(i) = frames[..j].iter().position(|other| other == frame) {
                return Err(FramesError::Same(i + 1, j + 1));
            }
        }
        let channels = if frames.iter().all(is_grey) { 1 } else { 3 };
        let signal = frames.iter().map(|f| planes(f, channels, encoding));
        let mut linear = Self {
            width: first.width as usize,
            height: first.height as usize,
            channels,
            signal: signal.collect(),
            gains: Vec::new(),
            full: full(first),
            encoding,
        };
        linear.level()?;
        Ok(linear)
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.signal.len()
    }

    /// Signals between which a pixel is neither black nor at full scale, at the exposure of the frames' mean.
    pub fn unclipped(&self) -> (f64, f64) {
        let scale = 255.0 / self.full;
        let low = self.encoding.light(0.5 * scale);
        let high = self.encoding.light((self.full - 0.5) * scale);
        let least = self.gains.iter().fold(f64::MAX, |x, &y| x.min(y));
        let most = self.gains.iter().fold(0.0, |x: f64, &y| x.max(y));
        (low / least, high / most)
    }

    /// Counts per signal at a signal.
    pub fn slope(&self, signal: f64) -> f64 {
        self.encoding.slope(signal) * self.full / 255.0
    }

    /// One gain for all channels of a frame, from the pixels that are not clipped in any.
    fn level(&mut self) -> Result<(), FramesError> {
        let frames = self.frames();
        self.gains = vec![1.0; frames];
        let (low, high) = self.unclipped();
        // Black and full scale are left out with a margin, so that the gain does not choose pixels by their noise.
        let inside = |y: f64| y > low + 0.02 * (high - low) && y < low + 0.9 * (high - low);
        let mut sums = vec![0.0; frames];
        for k in 0..self.channels {
            for i in 0..self.width * self.height {
                let of = |frame: &Vec<Vec<f32>>| f64::from(frame[k][i]);
                let mean = self.signal.iter().map(of).sum::<f64>() / frames as f64;
                if inside(mean) {
                    for (sum, frame) in sums.iter_mut().zip(&self.signal) {
                        *sum += of(frame);
                    }
                }
            }
        }
        let mean = sums.iter().sum::<f64>() / frames as f64;
        if mean <= 0.0 {
            return Ok(());
        }
        self.gains = sums.iter().map(|sum| sum / mean).collect();
        let far = |gain: f64| !(1.0 / MOST_GAIN..=MOST_GAIN).contains(&gain);
        if let Some(frame) = self.gains.iter().position(|&gain| far(gain)) {
            return Err(FramesError::Exposure {
                frame: frame + 1,
                gain: self.gains[frame],
            });
        }
        for (gain, frame) in self.gains.iter().zip(&mut self.signal) {
            for value in frame.iter_mut().flatten() {
                *value = (f64::from(*value) / gain) as f32;
            }
        }
        Ok(())
    }
}

fn kind(frame: &Frame) -> String {
    let bits = match frame.counts {
        Counts::Bits8(_) => 8,
        Counts::Bits16(_) => 16,
    };
    format!("{} x {} pixels of {bits} bits", frame.width, frame.height)
}

fn full(frame: &Frame) -> f64 {
    match frame.counts {
        Counts::Bits8(_) => u8::MAX.into(),
        Counts::Bits16(_) => u16::MAX.into(),
    }
}

fn is_grey(frame: &Frame) -> bool {
    fn equal<T: PartialEq>(counts: &[T]) -> bool {
        counts
            .chunks_exact(3)
            .all(|pixel| pixel[0] == pixel[1] && pixel[1] == pixel[2])
    }
    match &frame.counts {
        Counts::Bits8(counts) => equal(counts),
        Counts::Bits16(counts) => equal(counts),
    }
}

fn planes(frame: &Frame, channels: usize, encoding: Encoding) -> Vec<Vec<f32>> {
    let full = full(frame);
    let light: Vec<f32> = (0..=full as usize)
        .map(|count| encoding.light(count as f64 * 255.0 / full) as f32)
        .collect();
    let plane = |k: usize| match &frame.counts {
        Counts::Bits8(counts) => plane(counts, k, &light),
        Counts::Bits16(counts) => plane(counts, k, &light),
    };
    (0..channels).map(plane).collect()
}

fn plane<T: Copy + Into<usize>>(counts: &[T], k: usize, light: &[f32]) -> Vec<f32> {
    let own = counts.iter().skip(k).step_by(3);
    own.map(|&count| light[count.into()]).collect()
}
