//! A vehicle's pictures without what its lens takes of their light.

use uw_calib::vehicle::Vignetting;
use uw_calib::{Encoding, Even};
use uw_render::image::{Counts, Frame};

/// The picture without vignetting ([`uw_calib::even`]), rounded again. Pixels at full scale stay there; noise grows where light was
/// missing.
pub fn even(lens: Vignetting, frame: &Frame, encoding: Encoding) -> Frame {
    let even = Even::new(lens, encoding);
    let counts = match &frame.counts {
        Counts::Bits8(c) => Counts::Bits8(evened(&even, frame, c, u8::MAX.into(), |c| c as u8)),
        Counts::Bits16(c) => Counts::Bits16(evened(&even, frame, c, u16::MAX.into(), |c| c as u16)),
    };
    Frame { counts, ..*frame }
}

fn evened<T: Copy + Into<f64>>(
    even: &Even,
    frame: &Frame,
    counts: &[T],
    full: f64,
    store: impl Fn(f64) -> T,
) -> Vec<T> {
    let one = |(i, &count): (usize, &T)| {
        let pixel = i / 3;
        let size = [frame.width, frame.height].map(|side| side as usize);
        let share = even.share([pixel % size[0], pixel / size[0]], size);
        let stored: f64 = count.into();
        store((even.counts(stored * 255.0 / full, share) * full / 255.0).round())
    };
    counts.iter().enumerate().map(one).collect()
}
