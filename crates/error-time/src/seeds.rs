//! Seeds of the renders: no two of a run share one.

/// Seed of a render of the ladder. From one base all seeds differ, those of references included.
pub(super) fn seed_of_run(base: u64, samples_per_pixel: u32, repeat: u32) -> u64 {
    let run = u64::from(repeat.wrapping_add(1)) << 32 | u64::from(samples_per_pixel);
    split_mix(split_mix(base) ^ run)
}

/// Seed of a reference.
pub(super) fn seed_of_reference(base: u64) -> u64 {
    split_mix(split_mix(base))
}

/// A bijection of 64-bit numbers that mixes all bits (SplitMix64, Steele, Lea and Flood 2014).
fn split_mix(value: u64) -> u64 {
    let mut z = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn no_two_renders_share_a_seed() {
        let mut seeds = BTreeSet::from([seed_of_reference(1)]);
        for samples in (0..20).map(|i| 1 << i) {
            for repeat in 0..10 {
                assert!(
                    seeds.insert(seed_of_run(1, samples, repeat)),
                    "{samples} {repeat}"
                );
            }
        }
        assert!(!seeds.contains(&seed_of_run(2, 64, 0)));
        // First output of the published generator for the state 0.
        assert_eq!(split_mix(0), 0xe220_a839_7b1d_cdaf);
    }
}
