//! Numbers as the words of tables. A word is as wide as a double: whole numbers lie below 2³², and so do the bits of numbers
//! that are no more precise than `f32`; every other word is the bits of an `f64`. Kernels in single precision read
//! [`narrow`] words.

use uw_lanes::scalar::word_of;

/// The word of kernels in single precision.
pub(crate) fn narrow(word: u64) -> u32 {
    if word >> 32 == 0 {
        word as u32
    } else {
        (f64::from_bits(word) as f32).to_bits()
    }
}

/// The type of a record's field in the shaders: what the host holds for it, and its words.
pub(crate) trait Field {
    /// In double precision.
    type Host: Copy;
    /// Number of words.
    const WORDS: usize;
    /// Nothing.
    const ZERO: Self::Host;
    /// Adds the words of a value.
    fn put(value: &Self::Host, words: &mut Vec<u64>);
}

impl Field for f32 {
    type Host = f64;
    const WORDS: usize = 1;
    const ZERO: f64 = 0.0;

    fn put(value: &f64, words: &mut Vec<u64>) {
        words.push(word_of(*value));
    }
}

impl Field for u32 {
    type Host = Self;
    const WORDS: usize = 1;
    const ZERO: Self = 0;

    fn put(value: &Self, words: &mut Vec<u64>) {
        words.push(u64::from(*value));
    }
}

impl<T: Field, const N: usize> Field for [T; N] {
    type Host = [T::Host; N];
    const WORDS: usize = N * T::WORDS;
    const ZERO: Self::Host = [T::ZERO; N];

    fn put(value: &Self::Host, words: &mut Vec<u64>) {
        for part in value {
            T::put(part, words);
        }
    }
}

/// A record of whole words.
pub(crate) trait Record: Sized {
    /// A record of zeros.
    const ZERO: Self;

    /// Adds its words.
    fn put(&self, words: &mut Vec<u64>);

    /// Its words.
    fn words(&self) -> Vec<u64> {
        let mut words = Vec::new();
        self.put(&mut words);
        words
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whole numbers and bits of `f32` stay what they are; other numbers are rounded once, those out of range as `as` does.
    #[test]
    fn words_of_kernels_in_single_precision() {
        for whole in [0, 1, 0x3f80_0000, u32::MAX] {
            assert_eq!(narrow(u64::from(whole)), whole);
        }
        for x in [
            1.0,
            -0.1,
            1e-40,
            1e30,
            1e300,
            -0.0,
            f64::INFINITY,
            5e-324,
            1e-310,
        ] {
            assert_eq!(f32::from_bits(narrow(word_of(x))), x as f32, "{x}");
        }
    }
}
