//! Numbers of all channels and both halves of the samples side by side: fits do the same with each of them, which vector units do at
//! once.

/// One number per channel and half, at [`lane`].
pub(super) type Lanes = [f64; 6];

pub(super) const ZERO: Lanes = [0.0; 6];

/// Where the number of channel `k` and a half is.
#[inline]
pub(super) const fn lane(k: usize, half: usize) -> usize {
    2 * k + half
}

/// Lanes of what a function says of each channel and half.
#[inline]
pub(super) fn lanes(of: impl Fn(usize, usize) -> f64) -> Lanes {
    std::array::from_fn(|lane| of(lane / 2, lane % 2))
}

/// Every half's number where that of the other half was.
#[inline]
pub(super) fn crossed(values: &Lanes) -> Lanes {
    std::array::from_fn(|lane| values[lane ^ 1])
}

#[inline]
pub(super) fn product(a: &Lanes, b: &Lanes) -> Lanes {
    std::array::from_fn(|lane| a[lane] * b[lane])
}

/// Adds a product to `sum`.
#[inline]
pub(super) fn add_product(sum: &mut Lanes, a: &Lanes, b: &Lanes) {
    for lane in 0..sum.len() {
        sum[lane] += a[lane] * b[lane];
    }
}

/// Takes a product off `sum`.
#[inline]
pub(super) fn take_product(sum: &mut Lanes, a: &Lanes, b: &Lanes) {
    for lane in 0..sum.len() {
        sum[lane] -= a[lane] * b[lane];
    }
}

/// Adds `factor` times `values` to `sum`.
#[inline]
pub(super) fn add_scaled(sum: &mut Lanes, factor: f64, values: &Lanes) {
    for lane in 0..sum.len() {
        sum[lane] += factor * values[lane];
    }
}
