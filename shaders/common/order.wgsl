// How many scatterings a bridge has: q(k | D), a Poisson law with a geometric tail.
// Host: crates/render/src/kernels/order.rs (makes the table). Checked by: crates/render/src/gpu/functions/orders.rs.
import package::common::layout::{NONE, scene};
import package::common::math::expm1;
import package::common::settings::largest_order;
import package::common::tables::table_f32;

const TAIL_SHARE: f32 = 0.02;
const LN_POISSON_SHARE: f32 = -0.0202027073;
/// ln of a share of the law that no draw tells from nothing.
const LN_NEGLIGIBLE: f32 = -80.0;

/// ln of ε (1 − γ) γ^k k!.
fn order_ln_tail(k: u32) -> f32 {
    return table_f32(scene.order_table + k);
}

/// Poisson variate by inversion; more than the largest order is not told apart.
fn poisson(u: f32, mean: f32) -> u32 {
    // Terms that are nothing beside a number drawn: in logarithms, because they can be below the range of a float.
    var ln_term = -mean;
    var k = 0u;
    loop {
        if ln_term > LN_NEGLIGIBLE || k > largest_order() {
            break;
        }
        k += 1u;
        ln_term += log(mean / f32(k));
    }
    var term = exp(max(ln_term, LN_NEGLIGIBLE));
    var sum = term;
    if u <= sum || k > largest_order() {
        return k;
    }
    loop {
        k += 1u;
        term *= mean / f32(k);
        sum += term;
        // What is left of the tail is below the rounding of the sum.
        if u <= sum || k > largest_order() || (f32(k) > mean && term < 1e-9) {
            break;
        }
    }
    return k;
}

/// Draws k for optical depth `depth` from `u` in (0, 1); NONE beyond the largest order.
fn order_sample(depth: f32, u: f32) -> u32 {
    var k: u32;
    if u < TAIL_SHARE {
        k = u32(log(u / TAIL_SHARE) / log(scene.order_ratio));
    } else {
        k = poisson((u - TAIL_SHARE) / (1.0 - TAIL_SHARE), depth);
    }
    return select(NONE, k, k <= largest_order());
}

/// Probability of at least one scattering, 1 − q(0 | D).
fn scattered_share(depth: f32) -> f32 {
    return TAIL_SHARE * scene.order_ratio - (1.0 - TAIL_SHARE) * expm1(-depth);
}

/// Draws k >= 1, with probability q(k | D) / (1 − q(0 | D)); NONE beyond the largest order.
fn order_sample_scattered(depth: f32, u: f32) -> u32 {
    let x = u * scattered_share(depth);
    let tail = TAIL_SHARE * scene.order_ratio;
    var k: u32;
    if x < tail {
        k = 1u + u32(log(x / tail) / log(scene.order_ratio));
    } else {
        k = max(poisson(exp(max(-depth, -87.0)) + (x - tail) / (1.0 - TAIL_SHARE), depth), 1u);
    }
    return select(NONE, k, k <= largest_order());
}
