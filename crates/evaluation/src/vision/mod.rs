//! Images as feature extraction sees them, and what it finds in them.
//!
//! [`grey`] turns frames into grey values; [`sobel`] is the mean gradient; [`features`] equalises contrast (CLAHE) and
//! extracts SIFT features; [`matching`] matches two views and rejects outliers (RANSAC).

pub mod features;
pub mod grey;
pub mod matching;
pub mod sobel;

pub use features::{Detector, Features};
pub use grey::GreyImage;
pub use matching::{Matcher, PairMeasure};

/// Why a vision step could not be made.
#[derive(Debug, thiserror::Error)]
pub enum VisionError {
    /// The image library failed.
    #[error("{step}: {source}")]
    Library {
        /// What was being done.
        step: &'static str,
        /// What the library says.
        source: opencv::Error,
    },
    /// A buffer does not fit the size of its image.
    #[error("a {width} x {height} image must have {expected} values, got {got}")]
    BufferLength {
        /// Width, pixels.
        width: usize,
        /// Height, pixels.
        height: usize,
        /// Values it must have.
        expected: usize,
        /// Values given.
        got: usize,
    },
}

/// Names the step at which the image library failed.
fn at(step: &'static str) -> impl Fn(opencv::Error) -> VisionError {
    move |source| VisionError::Library { step, source }
}
