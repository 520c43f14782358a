//! The tree of triangles in depth-first order with skip links, which needs no stack.

use glam::Vec3A;
use obvhs::{
    Boundable, BvhBuildParams,
    aabb::Aabb,
    bvh2::{Bvh2, builder::build_bvh2},
};

use super::layout::Node;

/// Padding of boxes, of the largest coordinate: more than the rounding of rays and boxes in f32.
const PADDING: f32 = 2e-6;

struct Padded(Aabb);

impl Boundable for Padded {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

/// The nodes over boxes of triangles given by their lower and upper corners, and the order of the triangles in the
/// leaves.
pub(super) fn build(boxes: &[([f32; 3], [f32; 3])]) -> (Vec<Node>, Vec<u32>) {
    if boxes.is_empty() {
        return (Vec::new(), Vec::new());
    }
    let largest = boxes
        .iter()
        .flat_map(|(lower, upper)| lower.iter().chain(upper))
        .fold(0.0f32, |m, x| m.max(x.abs()));
    let padding = Vec3A::splat(PADDING * largest);
    let padded: Vec<Padded> = boxes
        .iter()
        .map(|(lower, upper)| {
            Padded(Aabb::new(
                Vec3A::from_array(*lower) - padding,
                Vec3A::from_array(*upper) + padding,
            ))
        })
        .collect();
    let mut build_time = std::time::Duration::ZERO;
    let tree = build_bvh2(&padded, BvhBuildParams::medium_build(), &mut build_time);
    let mut nodes = Vec::with_capacity(tree.nodes.len());
    flatten(&tree, &mut nodes);
    (nodes, tree.primitive_indices)
}

/// Depth-first order; a node's skip link is the number of nodes before the end of its subtree.
fn flatten(tree: &Bvh2, nodes: &mut Vec<Node>) {
    /// Either a node still to be written, or one whose subtree has been.
    enum Step {
        Enter(usize),
        Leave(usize),
    }
    let mut steps = vec![Step::Enter(0)];
    while let Some(step) = steps.pop() {
        match step {
            Step::Enter(index) => {
                let node = &tree.nodes[index];
                let place = nodes.len();
                nodes.push(Node {
                    lower: node.aabb.min.to_array(),
                    skip: 0,
                    upper: node.aabb.max.to_array(),
                    first: if node.prim_count > 0 {
                        node.first_index
                    } else {
                        0
                    },
                    count: node.prim_count,
                    padding_1: 0,
                    padding_2: 0,
                    padding_3: 0,
                });
                steps.push(Step::Leave(place));
                if node.prim_count == 0 {
                    let child = node.first_index as usize;
                    steps.push(Step::Enter(child + 1));
                    steps.push(Step::Enter(child));
                }
            }
            Step::Leave(place) => nodes[place].skip = nodes.len() as u32,
        }
    }
}
