//! A function on (0, 1) as piecewise cubics, dense at both ends.

/// Bits of the mantissa that choose a block: eight blocks to the octave.
const BLOCK_BITS: u32 = 3;
const BLOCKS_PER_OCTAVE: usize = 1 << BLOCK_BITS;
/// Bits of the mantissa that remain inside a block.
const INNER_BITS: u32 = 52 - BLOCK_BITS;
const INNER_MASK: u64 = (1 << INNER_BITS) - 1;
const ONE_BITS: u64 = 0x3ff0_0000_0000_0000;
/// Exponent field of numbers in [1/4, 1/2), the octave next to the middle.
const TOP_EXPONENT: u64 = 1021;
/// A block holds at most 2^MAX_SPLIT cells.
const MAX_SPLIT: u32 = 10;
/// Least split of blocks in which the function bends.
const BENT_SPLIT: u32 = 4;
const SPLIT_BITS: u32 = 4;

/// How many octaves below 1/2 a table resolves at its low end, and of one minus the argument at its
/// high end. Arguments nearer to an end are taken as the smallest one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ends {
    pub(super) low_octaves: u32,
    pub(super) high_octaves: u32,
}

/// The piecewise cubics. The key of an argument `x` is `min(x, 1 - x)`; the exponent and the first three
/// bits of the key's mantissa name a block, the next few bits a cell of the block, and the remaining
/// bits are the place in the cell.
#[derive(Clone, Debug)]
pub(super) struct CellTable {
    /// Per block `first cell << SPLIT_BITS | split`; blocks of the low end, then of the high end.
    blocks: Vec<u32>,
    /// Coefficients of 1, t, t², t³ with t in [0, 1) along the key.
    cells: Vec<[f64; 4]>,
    /// The low and the high end.
    ends: [End; 2],
}

/// A table laid open, for lookups elsewhere.
#[derive(Clone, Copy, Debug)]
pub struct CellParts<'a> {
    /// Per block `first cell << 4 | split`, the block being cut into 2^split cells.
    pub blocks: &'a [u32],
    /// Coefficients of 1, t, t², t³ with t in [0, 1) along the key.
    pub cells: &'a [[f64; 4]],
    /// Smallest key and first block of the low and the high end; each octave from there on has eight blocks.
    pub ends: [(f64, u32); 2],
}

/// Where the blocks of one end lie.
#[derive(Clone, Copy, Debug)]
struct End {
    /// Smallest key, as bits.
    smallest: u64,
    /// What to add to `key >> INNER_BITS` for the index of the block.
    shift: i64,
}

/// Largest key, as bits: the float below 1/2.
const LARGEST: u64 = ((TOP_EXPONENT + 1) << 52) - 1;

impl End {
    fn new(octaves: u32, first_block: usize) -> Self {
        let smallest = (TOP_EXPONENT + 1 - u64::from(octaves)) << 52;
        Self {
            smallest,
            shift: first_block as i64 - (smallest >> INNER_BITS) as i64,
        }
    }

    /// First and last key of a block of this end.
    fn key_range(&self, block: usize) -> (f64, f64) {
        let key = ((block as i64 - self.shift) as u64) << INNER_BITS;
        (f64::from_bits(key), f64::from_bits(key + (1 << INNER_BITS)))
    }
}

impl CellTable {
    /// Tabulates a function, given twice: as a function of the argument for its low end, and of one
    /// minus the argument for its high end. Its error where the exact value is y is to stay below
    /// `tolerance(y)`; blocks that cannot meet that within `max_bytes` get as close as the memory allows. Blocks of the low end that
    /// reach into `bends`, where the function bends more sharply than a few points of a cell would show, have 2^4 cells at least.
    pub(super) fn build(
        sides: [&dyn Fn(f64) -> f64; 2],
        ends: Ends,
        tolerance: &dyn Fn(f64) -> f64,
        max_bytes: usize,
        bends: [f64; 2],
    ) -> Self {
        let octaves = [ends.low_octaves, ends.high_octaves];
        let blocks = octaves.map(|octaves| octaves as usize * BLOCKS_PER_OCTAVE);
        let ends = [End::new(octaves[0], 0), End::new(octaves[1], blocks[0])];
        let fits: Vec<BlockFit> = (0..blocks[0] + blocks[1])
            .map(|block| {
                let side = usize::from(block >= blocks[0]);
                let (start, end) = ends[side].key_range(block);
                let bent = side == 0 && end > bends[0] && start < bends[1];
                let least = if bent { BENT_SPLIT } else { 0 };
                BlockFit::new(sides[side], (start, end), tolerance, least)
            })
            .collect();
        let cap = largest_split_within(&fits, max_bytes);
        let mut table = Self {
            blocks: Vec::with_capacity(fits.len()),
            cells: Vec::new(),
            ends,
        };
        for fit in &fits {
            let split = fit.split.min(cap);
            let first_cell = table.cells.len() as u32;
            table.blocks.push(first_cell << SPLIT_BITS | split);
            table.cells.extend(fit.cubics(split));
        }
        table
    }

    /// The tabulated function at `x` in [0, 1].
    #[inline]
    pub(super) fn at(&self, x: f64) -> f64 {
        // Chosen by index, not by a branch, because the ends come in random order.
        let high = usize::from(x >= 0.5);
        let key = x.min(1.0 - x);
        let end = &self.ends[high];
        // As signed integers negative numbers sort below all positive ones.
        let bits = (key.to_bits() as i64).clamp(end.smallest as i64, LARGEST as i64) as u64;
        let block = self.blocks[((bits >> INNER_BITS) as i64 + end.shift) as usize];
        let split = block & ((1 << SPLIT_BITS) - 1);
        let inner = bits & INNER_MASK;
        let cell = (block >> SPLIT_BITS) as usize + (inner >> (INNER_BITS - split)) as usize;
        let inside = (inner << split) & INNER_MASK;
        let t = f64::from_bits(ONE_BITS | (inside << BLOCK_BITS)) - 1.0;
        let [c0, c1, c2, c3] = self.cells[cell];
        (c0 + t * c1) + t * t * (c2 + t * c3)
    }

    pub(super) fn parts(&self) -> CellParts<'_> {
        let of_end = |end: &End| {
            let first = (end.smallest >> INNER_BITS) as i64 + end.shift;
            (f64::from_bits(end.smallest), first as u32)
        };
        CellParts {
            blocks: &self.blocks,
            cells: &self.cells,
            ends: [of_end(&self.ends[0]), of_end(&self.ends[1])],
        }
    }

    pub(super) fn bytes(&self) -> usize {
        size_of_val(self.blocks.as_slice()) + size_of_val(self.cells.as_slice())
    }
}

/// A block and the split that meets the tolerance.
struct BlockFit<'a> {
    function: &'a dyn Fn(f64) -> f64,
    start: f64,
    width: f64,
    split: u32,
}

impl<'a> BlockFit<'a> {
    fn new(
        function: &'a dyn Fn(f64) -> f64,
        (start, end): (f64, f64),
        tolerance: &dyn Fn(f64) -> f64,
        least_split: u32,
    ) -> Self {
        let mut fit = Self {
            function,
            start,
            width: end - start,
            split: least_split,
        };
        while fit.split < MAX_SPLIT && !fit.meets(tolerance) {
            fit.split += 1;
        }
        fit
    }

    /// Start and width of the cells of a split.
    fn cells(&self, split: u32) -> impl Iterator<Item = (f64, f64)> {
        let count = 1usize << split;
        let width = self.width / count as f64;
        (0..count).map(move |i| (self.start + width * i as f64, width))
    }

    /// Whether every cell agrees with the function between the points that it was made from.
    fn meets(&self, tolerance: &dyn Fn(f64) -> f64) -> bool {
        self.cells(self.split).all(|(start, width)| {
            let [c0, c1, c2, c3] = cubic(self.function, start, width);
            [0.12, 0.5, 0.88].iter().all(|&t| {
                let exact = (self.function)(start + width * t);
                let fitted = c0 + t * (c1 + t * (c2 + t * c3));
                (fitted - exact).abs() <= tolerance(exact)
            })
        })
    }

    fn cubics(&self, split: u32) -> impl Iterator<Item = [f64; 4]> {
        self.cells(split)
            .map(|(start, width)| cubic(self.function, start, width))
    }
}

/// Largest cap on the splits that keeps the cells within `max_bytes`.
fn largest_split_within(fits: &[BlockFit], max_bytes: usize) -> u32 {
    let bytes = |cap: u32| -> usize {
        let cells: usize = fits.iter().map(|fit| 1 << fit.split.min(cap)).sum();
        cells * size_of::<[f64; 4]>() + fits.len() * size_of::<u32>()
    };
    (0..=MAX_SPLIT)
        .rev()
        .find(|&cap| bytes(cap) <= max_bytes)
        .unwrap_or(0)
}

/// The cubic through the function at t = 0, 1/3, 2/3, 1; neighbouring cells join without a step.
fn cubic(function: &dyn Fn(f64) -> f64, start: f64, width: f64) -> [f64; 4] {
    let y = [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0].map(|t| function(start + width * t));
    let first = [y[1] - y[0], y[2] - y[1], y[3] - y[2]];
    let second = [first[1] - first[0], first[2] - first[1]];
    let third = second[1] - second[0];
    [
        y[0],
        3.0 * first[0] - 1.5 * second[0] + third,
        4.5 * (second[0] - third),
        4.5 * third,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    const ENDS: Ends = Ends {
        low_octaves: 20,
        high_octaves: 10,
    };

    fn polynomial(x: f64) -> f64 {
        1.0 - 2.0 * x + 3.0 * x * x - 4.0 * x * x * x
    }

    #[test]
    fn a_cubic_is_met_exactly_by_one_cell_to_the_block() {
        let sides: [&dyn Fn(f64) -> f64; 2] = [&polynomial, &|y| polynomial(1.0 - y)];
        let table = CellTable::build(sides, ENDS, &|_| 1e-13, 1 << 20, [0.0; 2]);
        assert_eq!(table.cells.len(), 30 * BLOCKS_PER_OCTAVE);
        for i in 1..1000 {
            let x = f64::from(i) / 1000.0;
            assert!((table.at(x) - polynomial(x)).abs() < 1e-13, "x {x}");
        }
    }

    #[test]
    fn memory_is_bounded_and_then_shared_by_all_blocks() {
        let step = |x: f64| f64::from(u8::from(x > 0.3));
        let sides: [&dyn Fn(f64) -> f64; 2] = [&step, &|y| step(1.0 - y)];
        let free = CellTable::build(sides, ENDS, &|_| 1e-6, 1 << 20, [0.0; 2]);
        assert_eq!(
            free.cells.len(),
            30 * BLOCKS_PER_OCTAVE - 1 + (1 << MAX_SPLIT)
        );
        let bounded = CellTable::build(sides, ENDS, &|_| 1e-6, 12 << 10, [0.0; 2]);
        assert!(bounded.bytes() <= 12 << 10);
        assert_eq!((bounded.at(0.28), bounded.at(0.35)), (0.0, 1.0));
    }
}
