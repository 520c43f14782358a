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
    let mut values = ZERO;
    for k in 0..3 {
        for half in 0..2 {
            values[lane(k, half)] = of(k, half);
        }
    }
    values
}

/// Every half's number where that of the other half was.
#[inline]
pub(super) fn crossed(values: &Lanes) -> Lanes {
    let [a, b, c, d, e, f] = *values;
    [b, a, d, c, f, e]
}

#[inline]
pub(super) fn product(a: &Lanes, b: &Lanes) -> Lanes {
    let mut product = *a;
    for lane in 0..product.len() {
        product[lane] *= b[lane];
    }
    product
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

#[inline]
pub(super) fn scaled(values: &Lanes, factor: f64) -> Lanes {
    let mut scaled = *values;
    scaled.iter_mut().for_each(|value| *value *= factor);
    scaled
}

/// Adds `factor` times `values` to `sum`.
#[inline]
pub(super) fn add_scaled(sum: &mut Lanes, factor: f64, values: &Lanes) {
    for lane in 0..sum.len() {
        sum[lane] += factor * values[lane];
    }
}
