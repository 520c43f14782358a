//! A vehicle's pictures without what its lens takes of their light.

use uw_calib::Encoding;
use uw_calib::vehicle::Vignetting;
use uw_render::image::{Counts, Frame};

/// The picture without vignetting: light over the share that the lens leaves, at the middle's level, encoded and rounded again. Pixels at
/// full scale stay there; noise grows where light was missing.
pub fn even(lens: Vignetting, frame: &Frame, encoding: Encoding) -> Frame {
    let counts = match &frame.counts {
        Counts::Bits8(c) => {
            Counts::Bits8(evened((lens, encoding), frame, c, u8::MAX.into(), |c| {
                c as u8
            }))
        }
        Counts::Bits16(c) => {
            Counts::Bits16(evened((lens, encoding), frame, c, u16::MAX.into(), |c| {
                c as u16
            }))
        }
    };
    Frame { counts, ..*frame }
}

fn evened<T: Copy + Into<f64>>(
    (lens, encoding): (Vignetting, Encoding),
    frame: &Frame,
    counts: &[T],
    full: f64,
    store: impl Fn(f64) -> T,
) -> Vec<T> {
    let one = |(i, &count): (usize, &T)| {
        let pixel = i as u32 / 3;
        let place = (pixel % frame.width, pixel / frame.width);
        let share = lens.share_at(place, (frame.width, frame.height));
        let stored: f64 = count.into();
        if stored >= full {
            return count;
        }
        let light = encoding.light(stored * 255.0 / full) / share;
        store((encoding.counts(light) * full / 255.0).round())
    };
    counts.iter().enumerate().map(one).collect()
}
