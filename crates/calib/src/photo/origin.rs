//! What a picture that was made of stored ones has of their noise: another exposure, a lens, resampling and the mean of frames change it.

use crate::stats::{self, PATCH_COLUMNS, PATCH_ROWS};

/// Of a picture, by the patches of the 10 × 6 grid, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Origin {
    patches: Vec<PatchOrigin>,
}

/// Of one patch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatchOrigin {
    /// The share of its light that the stored picture has, > 0: by the lens, the exposure time and the f-number. Above 1 where that was exposed longer.
    pub share: f64,
    /// Variance of the light of a pixel over that of as much light of a stored one, > 0: what resampling and the mean of frames leave.
    pub left: f64,
    /// Stored pixels behind one of its pixels, those of all frames, > 0: the mean of many has the noise of so many independent ones.
    pub pixels: f64,
}

impl PatchOrigin {
    /// Of a picture as the camera stored it.
    pub const STORED: Self = Self {
        share: 1.0,
        left: 1.0,
        pixels: 1.0,
    };
}

impl Origin {
    /// Of a picture whose patches are alike.
    pub fn alike(patch: PatchOrigin) -> Self {
        Self {
            patches: vec![patch; PATCH_COLUMNS * PATCH_ROWS],
        }
    }

    /// Of a picture of `size` pixels whose patches, each of which begins at a pixel and has a size, are as `patch` says.
    pub(crate) fn new(
        size: [usize; 2],
        patch: impl Fn([usize; 2], [usize; 2]) -> PatchOrigin,
    ) -> Self {
        let side = [size[0] / PATCH_COLUMNS, size[1] / PATCH_ROWS];
        let corners = stats::corners(size).into_iter();
        Self {
            patches: corners
                .map(|corner| patch([corner % size[0], corner / size[0]], side))
                .collect(),
        }
    }

    /// Of patch `i`.
    pub fn patch(&self, i: usize) -> PatchOrigin {
        self.patches.get(i).copied().unwrap_or(PatchOrigin::STORED)
    }

    /// Of the patch at (u, v), shares of the picture's width and height.
    pub fn at(&self, u: f64, v: f64) -> PatchOrigin {
        let place = |share: f64, n: usize| ((share * n as f64).max(0.0) as usize).min(n - 1);
        self.patch(place(v, PATCH_ROWS) * PATCH_COLUMNS + place(u, PATCH_COLUMNS))
    }
}
