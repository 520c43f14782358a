//! Water that varies with depth, and the homogeneous slices that stand for it.

/// Water at a depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Level {
    /// Depth, m, 0 or more.
    pub depth_m: f64,
    /// Absorption, 1/m, 0 or more.
    pub a: f64,
    /// Scattering, 1/m, 0 or more.
    pub b: f64,
}

/// Water whose coefficients are linear in depth between levels and the same above the first and below the last one. Two
/// levels at one depth are a jump.
#[derive(Clone, Debug, PartialEq)]
pub struct Water {
    levels: Vec<Level>,
    slice: f64,
}

impl Water {
    /// Homogeneous water of c = 1/m, where metres are optical depths. `albedo` is b/c, 0..1.
    pub fn homogeneous(albedo: f64) -> Self {
        let level = Level {
            depth_m: 0.0,
            a: 1.0 - albedo,
            b: albedo,
        };
        Self::layered(&[level], 1.0)
    }

    /// Water through these levels, down. Where it varies it is cut into slices of homogeneous water of at most the
    /// optical depth `slice`, more than 0.
    ///
    /// # Panics
    /// When there is no level, when one is higher than the one before, or when `slice` is not more than 0.
    pub fn layered(levels: &[Level], slice: f64) -> Self {
        assert!(!levels.is_empty(), "water has no level");
        assert!(slice > 0.0, "slices of an optical depth of {slice}");
        for pair in levels.windows(2) {
            assert!(pair[0].depth_m <= pair[1].depth_m, "{pair:?} go up");
        }
        Self {
            levels: levels.to_vec(),
            slice,
        }
    }

    /// Stretches from the surface down, the last one without end.
    fn stretches(&self) -> Vec<Stretch> {
        let (first, last) = (self.levels[0], self.levels[self.levels.len() - 1]);
        let top = Level {
            depth_m: 0.0,
            ..first
        };
        let end = Level {
            depth_m: f64::INFINITY,
            ..last
        };
        let all: Vec<Level> = [top]
            .iter()
            .chain(&self.levels)
            .chain([&end])
            .copied()
            .collect();
        let mut stretches: Vec<Stretch> = Vec::new();
        for pair in all.windows(2) {
            let next = Stretch {
                from: pair[0],
                to: pair[1],
            };
            if next.from.depth_m == next.to.depth_m {
                continue;
            }
            match stretches.last_mut() {
                Some(above) if above.goes_on_in(&next) => above.to = next.to,
                _ => stretches.push(next),
            }
        }
        stretches
    }

    /// Slices from the surface to `end_m`, with a border at each of `borders_m` above it.
    pub(super) fn slices(&self, borders_m: &[f64], end_m: f64) -> Vec<Slice> {
        let mut slices = Vec::new();
        for stretch in self.stretches() {
            let bottom_m = stretch.to.depth_m.min(end_m);
            let inside = |z: &f64| stretch.from.depth_m < *z && *z < bottom_m;
            let mut cuts_m = stretch.cuts_m(self.slice);
            cuts_m.extend(borders_m);
            cuts_m.retain(inside);
            cuts_m.extend([stretch.from.depth_m, bottom_m]);
            cuts_m.sort_by(f64::total_cmp);
            cuts_m.dedup();
            let borders = cuts_m.windows(2).filter(|pair| pair[0] < pair[1]);
            slices.extend(borders.map(|pair| stretch.slice(pair[0], pair[1])));
            if bottom_m == end_m {
                break;
            }
        }
        slices
    }

    /// Depth below which nothing varies, m.
    pub(super) fn uniform_from_m(&self) -> f64 {
        let stretches = self.stretches();
        stretches[stretches.len() - 1].from.depth_m
    }

    /// What is below the last level.
    pub(super) fn deep(&self) -> Level {
        self.levels[self.levels.len() - 1]
    }
}

/// Water between two depths, its coefficients linear between them.
struct Stretch {
    from: Level,
    to: Level,
}

impl Stretch {
    fn varies(&self) -> bool {
        self.from.a != self.to.a || self.from.b != self.to.b
    }

    /// Whether this and `next`, the one below, are one homogeneous layer.
    fn goes_on_in(&self, next: &Self) -> bool {
        let same = self.to.a == next.from.a && self.to.b == next.from.b;
        same && !self.varies() && !next.varies()
    }

    /// Depths that cut what varies into slices of equal thickness.
    fn cuts_m(&self, slice: f64) -> Vec<f64> {
        if !self.varies() {
            return Vec::new();
        }
        let thickness_m = self.to.depth_m - self.from.depth_m;
        let c = 0.5 * (self.from.a + self.from.b + self.to.a + self.to.b);
        let count = (thickness_m * c / slice).ceil().max(1.0);
        (1..count as u32)
            .map(|i| self.from.depth_m + thickness_m * f64::from(i) / count)
            .collect()
    }

    /// What stands for the water from `top_m` to `bottom_m`: its mean.
    fn slice(&self, top_m: f64, bottom_m: f64) -> Slice {
        let share = if self.varies() {
            let middle_m = 0.5 * (top_m + bottom_m);
            (middle_m - self.from.depth_m) / (self.to.depth_m - self.from.depth_m)
        } else {
            0.0
        };
        let mean = |from: f64, to: f64| from + (to - from) * share;
        Slice {
            top_m,
            thickness_m: bottom_m - top_m,
            a: mean(self.from.a, self.to.a),
            b: mean(self.from.b, self.to.b),
        }
    }
}

/// Homogeneous water between two depths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slice {
    /// Depth of its top, m.
    pub top_m: f64,
    /// Thickness, m.
    pub thickness_m: f64,
    /// Absorption, 1/m.
    pub a: f64,
    /// Scattering, 1/m.
    pub b: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn level(depth_m: f64, a: f64, b: f64) -> Level {
        Level { depth_m, a, b }
    }

    /// Absorption and scattering together from the surface to a depth.
    fn optical_depth(slices: &[Slice]) -> f64 {
        slices.iter().map(|s| (s.a + s.b) * s.thickness_m).sum()
    }

    #[test]
    fn slices_keep_the_optical_depth() {
        let levels = [
            level(1.0, 0.1, 0.3),
            level(3.0, 0.3, 1.5),
            level(3.0, 0.2, 0.2),
        ];
        let water = Water::layered(&levels, 0.1);
        // 1 m of 0.4, 2 m of 1.1 in the mean, 4 m of 0.4.
        for (end_m, expected) in [(0.5, 0.2), (3.0, 2.6), (7.0, 4.2)] {
            let depth = optical_depth(&water.slices(&[2.3, 5.0], end_m));
            assert!((depth - expected).abs() < 1e-12, "{end_m}: {depth}");
        }
        let thickest = water.slices(&[2.3], 3.0)[1..]
            .iter()
            .map(|s| (s.a + s.b) * s.thickness_m)
            .fold(0.0, f64::max);
        assert!((0.08..0.2).contains(&thickest), "{thickest}");
        assert_eq!(water.uniform_from_m(), 3.0);
    }

    #[test]
    fn levels_that_say_the_same_are_one_slice() {
        let water = Water::layered(&[level(0.5, 0.1, 0.9), level(2.0, 0.1, 0.9)], 0.1);
        assert_eq!(water.slices(&[3.0], 4.0).len(), 2);
        assert_eq!(water.uniform_from_m(), 0.0);
    }
}
