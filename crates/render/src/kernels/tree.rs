//! The tree of triangles in depth-first order with skip links, which needs no stack. A node is one row of four words: its
//! box on a grid of 16 bits per axis, and where to go on. Loads are what a traversal costs most on a software adapter.
//! Twin: `shaders/common/bvh.wgsl`.

use glam::Vec3A;
use obvhs::{
    Boundable, BvhBuildParams,
    aabb::Aabb,
    bvh2::{Bvh2, builder::build_bvh2},
};

use super::layout::Node;

/// Padding of boxes, of the largest coordinate: more than the rounding of rays and boxes in f32.
const PADDING: f32 = 2e-6;

/// The box of a triangle, m.
pub(super) struct Padded(pub(super) Aabb);

impl Boundable for Padded {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

/// The grid of the boxes' corners, lengths in metres.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BoxGrid {
    pub(super) lower: [f32; 3],
    pub(super) step: [f32; 3],
}

/// Largest coordinate on the grid.
const LAST: f64 = 65535.0;
/// Least extent of the grid, m: steps and their inverses stay normal numbers.
const LEAST_EXTENT: f32 = 1e-20;

/// Cost of a node by that of a triangle: one row to load instead of three. 7 % less time on llvmpipe than with the library's 3
/// (a mesh of 100,000 triangles in clear water, four runs each).
const NODE_COST: f32 = 0.3;
/// Marks the link of a leaf.
const LEAF: u32 = 1 << 31;
/// Bits of a leaf's link for the number of its triangles; the others are the first of them.
const COUNT_BITS: u32 = 4;
/// Most triangles of a leaf.
const MOST_IN_LEAF: u32 = (1 << COUNT_BITS) - 1;
/// Indices of triangles have this many values.
pub(super) const MOST_TRIANGLES: u64 = 1 << (31 - COUNT_BITS);

/// A tree over triangles.
#[derive(Clone, Debug, Default)]
pub(super) struct Tree {
    pub(super) nodes: Vec<Node>,
    /// Triangles in the order of the leaves.
    pub(super) order: Vec<u32>,
    pub(super) grid: BoxGrid,
}

/// The boxes of triangles given by their lower and upper corners.
pub(super) fn padded(boxes: &[([f32; 3], [f32; 3])]) -> Vec<Padded> {
    let largest = boxes
        .iter()
        .flat_map(|(lower, upper)| lower.iter().chain(upper))
        .fold(0.0f32, |m, x| m.max(x.abs()));
    let padding = Vec3A::splat(PADDING * largest);
    boxes
        .iter()
        .map(|(lower, upper)| {
            Padded(Aabb::new(
                Vec3A::from_array(*lower) - padding,
                Vec3A::from_array(*upper) + padding,
            ))
        })
        .collect()
}

/// The tree over boxes.
pub(super) fn build(padded: &[Padded]) -> Tree {
    if padded.is_empty() {
        return Tree::default();
    }
    let mut build_time = std::time::Duration::ZERO;
    let parameters = BvhBuildParams {
        collapse_traversal_cost: NODE_COST,
        ..BvhBuildParams::medium_build()
    };
    let tree = build_bvh2(padded, parameters, &mut build_time);
    let grid = BoxGrid::over(&tree.nodes[0].aabb);
    Tree {
        nodes: flatten(&tree, &grid),
        order: tree.primitive_indices,
        grid,
    }
}

impl BoxGrid {
    fn over(bounds: &Aabb) -> Self {
        let extent = (bounds.max - bounds.min).max(Vec3A::splat(LEAST_EXTENT));
        // A little coarser than needed, so that rounding does not cut the last step off.
        let step = extent * ((1.0 + 1e-6) / LAST as f32);
        Self {
            lower: bounds.min.to_array(),
            step: step.to_array(),
        }
    }

    /// The words of a box, rounded outwards: lower x and y, lower z and upper x, upper y and z.
    fn words(&self, aabb: &Aabb) -> [u32; 3] {
        let grid_step =
            |k: usize, x: f32| (f64::from(x) - f64::from(self.lower[k])) / f64::from(self.step[k]);
        let lower = |k: usize| grid_step(k, aabb.min[k]).floor().clamp(0.0, LAST) as u32;
        let upper = |k: usize| grid_step(k, aabb.max[k]).ceil().clamp(0.0, LAST) as u32;
        [
            lower(0) | lower(1) << 16,
            lower(2) | upper(0) << 16,
            upper(1) | upper(2) << 16,
        ]
    }
}

/// Depth-first order. The link of an inner node is the node after its subtree, that of a leaf its triangles; the node
/// after a leaf is the next. A leaf of many triangles becomes several with one box.
fn flatten(tree: &Bvh2, grid: &BoxGrid) -> Vec<Node> {
    /// Either a node still to be written, or one whose subtree has been.
    enum Step {
        Enter(usize),
        Leave(usize),
    }
    let mut nodes = Vec::with_capacity(tree.nodes.len());
    let mut steps = vec![Step::Enter(0)];
    while let Some(step) = steps.pop() {
        match step {
            Step::Enter(index) => {
                let node = &tree.nodes[index];
                let corners = grid.words(&node.aabb);
                if node.prim_count == 0 {
                    steps.push(Step::Leave(nodes.len()));
                    nodes.push(Node { corners, link: 0 });
                    let child = node.first_index as usize;
                    steps.push(Step::Enter(child + 1));
                    steps.push(Step::Enter(child));
                }
                for i in 0..node.prim_count.div_ceil(MOST_IN_LEAF) {
                    let before = i * MOST_IN_LEAF;
                    let count = (node.prim_count - before).min(MOST_IN_LEAF);
                    let link = LEAF | (node.first_index + before) << COUNT_BITS | count;
                    nodes.push(Node { corners, link });
                }
            }
            Step::Leave(node) => nodes[node].link = nodes.len() as u32,
        }
    }
    nodes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Rng;

    /// Boxes of triangles of very different sizes, some of them without extent.
    fn boxes(count: usize, seed: u64) -> Vec<([f32; 3], [f32; 3])> {
        let mut rng = Rng::new(seed, 0, 0, 0);
        (0..count)
            .map(|i| {
                let centre: [f32; 3] =
                    std::array::from_fn(|_| (80.0 * rng.uniform() - 30.0) as f32);
                let size = if i % 7 == 0 {
                    0.0
                } else {
                    10f64.powf(4.5 * rng.uniform() - 4.0) as f32
                };
                (centre, centre.map(|x| x + size))
            })
            .collect()
    }

    fn corners(grid: &BoxGrid, node: &Node) -> ([f64; 3], [f64; 3]) {
        let [a, b, c] = node.corners;
        let steps = [a, a >> 16, b, b >> 16, c, c >> 16].map(|word| f64::from(word & 0xffff));
        let metres =
            |k: usize| f64::from(grid.lower[k % 3]) + steps[k] * f64::from(grid.step[k % 3]);
        (
            std::array::from_fn(metres),
            std::array::from_fn(|k| metres(k + 3)),
        )
    }

    /// Every box lies within the node that holds it and within all above, every triangle in one leaf.
    #[test]
    fn nodes_hold_what_is_below_them() {
        for (count, seed) in [(1, 1), (2, 2), (40, 3), (3000, 4)] {
            let boxes = boxes(count, seed);
            let tree = build(&padded(&boxes));
            let mut found = vec![0; count];
            for (index, node) in tree.nodes.iter().enumerate() {
                let end = if node.link & LEAF == 0 {
                    node.link as usize
                } else {
                    index + 1
                };
                assert!(end > index && end <= tree.nodes.len());
                let (lower, upper) = corners(&tree.grid, node);
                for below in &tree.nodes[index..end] {
                    if below.link & LEAF == 0 {
                        continue;
                    }
                    let first = (below.link & !LEAF) >> COUNT_BITS;
                    for i in first..first + (below.link & MOST_IN_LEAF) {
                        let triangle = tree.order[i as usize] as usize;
                        found[triangle] += u32::from(end == index + 1 && node.link & LEAF != 0);
                        for k in 0..3 {
                            assert!(lower[k] < f64::from(boxes[triangle].0[k]), "{index} {k}");
                            assert!(upper[k] > f64::from(boxes[triangle].1[k]), "{index} {k}");
                        }
                    }
                }
            }
            assert!(found.iter().all(|&times| times == 1));
        }
    }
}
