//! A picture that was made of stored ones: brought to another exposure, without a lens, the mean of frames. Its noise is not that of the
//! water file's pictures, of which predictions are.

use uw_calib::even::growth;
use uw_calib::photo::{Origin, PatchOrigin};
use uw_calib::picture::Counts;
use uw_calib::response::CountResponse;
use uw_calib::{Encoding, PatchStats, patch_statistics};

/// What tells the noise of such a picture.
#[derive(Clone, Debug)]
pub(super) struct Made {
    origin: Origin,
    encoding: Encoding,
    patches: Vec<PatchStats>,
}

impl Made {
    /// Of a picture; `None` where the camera stored it so.
    pub(super) fn new(picture: &Counts, encoding: Encoding) -> Option<Self> {
        let origin = picture.origin.clone()?;
        let grid = patch_statistics(picture.width, picture.height, |i| picture.pixels[i]).ok()?;
        Some(Self {
            origin,
            encoding,
            patches: grid.patches,
        })
    }

    /// Of the patch at (u, v), shares of the picture's width and height.
    pub(super) fn at(&self, u: f64, v: f64) -> PatchOrigin {
        self.origin.at(u, v)
    }

    /// The share of its light that the stored picture has, on average.
    pub(super) fn share(&self) -> f64 {
        let patches = 0..self.patches.len();
        let sum: f64 = patches.map(|i| self.origin.patch(i).share).sum();
        sum / self.patches.len() as f64
    }

    /// The contrast that was `measured`, 8-bit counts, as it would be with noise of a stored picture of `response`.
    pub(super) fn contrast(&self, measured: [f64; 3], response: &CountResponse) -> [f64; 3] {
        std::array::from_fn(|k| {
            let (mut seen, mut own) = (0.0, 0.0);
            let known = self.patches.iter().enumerate();
            for (i, patch) in known.filter(|(_, patch)| !patch.mean[k].is_nan()) {
                let square = patch.std[k] * patch.std[k];
                let [has, stored] = self.noise(i, patch.mean[k], response);
                seen += patch.std[k];
                own += ((square - has).max(0.0) + stored).sqrt();
            }
            match seen > 0.0 {
                true => measured[k] * own / seen,
                false => measured[k],
            }
        })
    }

    /// Variance of the noise of patch `i` of this mean count, squared counts: as it is, and in a picture as it is stored.
    fn noise(&self, i: usize, mean: f64, response: &CountResponse) -> [f64; 2] {
        let of = self.origin.patch(i);
        let light = self.encoding.light(mean);
        let variance = |light: f64| f64::from(response.at(light as f32).1);
        let growth = growth(self.encoding, light, of.share);
        [
            of.left * growth * growth * variance(of.share * light),
            variance(light),
        ]
    }
}

#[cfg(test)]
mod tests;
