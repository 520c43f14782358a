//! The tree of triangles for lanes of a processor: the nodes of the prepared tree, with boxes in metres.
//! Twin: `uw_lanes::tree`.

use obvhs::{
    aabb::Aabb,
    cwbvh::{CwBvh, node::CwBvhNode},
};
use uw_lanes::tree::{COUNT_BITS, LEAF, Node, WIDTH};

use super::tree::Padded;

/// The nodes of `tree` over the boxes of its triangles, which are in its order.
pub(super) fn nodes(tree: &CwBvh, boxes: &[Padded]) -> Vec<Node> {
    let mut nodes = vec![Node::EMPTY; tree.nodes.len()];
    let mut around = vec![Aabb::INVALID; tree.nodes.len()];
    // Nodes come after those that name them.
    for index in (0..nodes.len()).rev() {
        for slot in 0..WIDTH {
            let Some(child) = child(&tree.nodes[index], slot) else {
                continue;
            };
            let bounds = if child & LEAF == 0 {
                around[child as usize]
            } else {
                around_triangles(child, boxes)
            };
            around[index] = around[index].union(&bounds);
            let node = &mut nodes[index];
            node.children[slot] = child;
            for k in 0..3 {
                node.bounds[k][slot] = bounds.min[k];
                node.bounds[k + 3][slot] = bounds.max[k];
            }
        }
    }
    nodes
}

/// What is in a slot. Inner nodes are counted from the first; the number of triangles is unary (Ylitie and others 2017).
fn child(node: &CwBvhNode, slot: usize) -> Option<u32> {
    let meta = u32::from(node.child_meta[slot]);
    let inner = u32::from(node.imask);
    if meta == 0 {
        return None;
    }
    if inner >> slot & 1 != 0 {
        let before = (inner & ((1 << slot) - 1)).count_ones();
        return Some(node.child_base_idx + before);
    }
    let first = node.primitive_base_idx + (meta & 31);
    Some(LEAF | first << COUNT_BITS | (meta >> 5).count_ones())
}

fn around_triangles(leaf: u32, boxes: &[Padded]) -> Aabb {
    let first = ((leaf & !LEAF) >> COUNT_BITS) as usize;
    let count = (leaf & ((1 << COUNT_BITS) - 1)) as usize;
    boxes[first..first + count]
        .iter()
        .fold(Aabb::INVALID, |all, Padded(bounds)| all.union(bounds))
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::{
        kernels::tree::padded,
        prepare::bvh::{Triangle, TriangleTree},
        sampling::Rng,
    };

    /// Triangles of very different sizes, some of them points.
    fn tree(count: usize, seed: u64) -> TriangleTree {
        let mut rng = Rng::new(seed, 0, 0, 0);
        let mut point =
            |size: f64| size * (DVec3::from_array([(); 3].map(|()| rng.uniform())) - 0.4);
        let triangles = (0..count)
            .map(|i| {
                let size = if i % 7 == 0 {
                    0.0
                } else {
                    10f64.powi(i as i32 % 5 - 3)
                };
                Triangle {
                    corner: point(80.0),
                    edge_1: point(size),
                    edge_2: point(size),
                }
            })
            .collect();
        TriangleTree::build(triangles).expect("triangles")
    }

    /// Every triangle is in one leaf, within its box and the boxes of all nodes above.
    #[test]
    fn boxes_hold_what_is_below_them() {
        for (count, seed) in [(1, 1), (2, 2), (40, 3), (3000, 4)] {
            let tree = tree(count, seed);
            let corners = |t: &Triangle| {
                [t.corner, t.corner + t.edge_1, t.corner + t.edge_2].map(|p| p.as_vec3())
            };
            let exact: Vec<_> = tree
                .triangles()
                .iter()
                .map(|t| {
                    let [a, b, c] = corners(t);
                    (a.min(b).min(c).to_array(), a.max(b).max(c).to_array())
                })
                .collect();
            let nodes = nodes(tree.nodes(), &padded(&exact));
            let mut found = vec![0; count];
            let unbounded = ([f32::NEG_INFINITY; 3], [f32::INFINITY; 3]);
            let mut to_do = vec![(0u32, unbounded)];
            while let Some((child, (lower, upper))) = to_do.pop() {
                if child & LEAF == 0 {
                    let node = &nodes[child as usize];
                    for slot in (0..WIDTH).filter(|&s| node.bounds[0][s] < f32::INFINITY) {
                        let least = [0, 1, 2].map(|k| node.bounds[k][slot]);
                        let largest = [3, 4, 5].map(|k| node.bounds[k][slot]);
                        assert!((0..3).all(|k| least[k] >= lower[k] && largest[k] <= upper[k]));
                        to_do.push((node.children[slot], (least, largest)));
                    }
                    continue;
                }
                let first = (child & !LEAF) >> COUNT_BITS;
                for index in first..first + (child & ((1 << COUNT_BITS) - 1)) {
                    found[index as usize] += 1;
                    let (least, largest) = exact[index as usize];
                    assert!((0..3).all(|k| least[k] > lower[k] && largest[k] < upper[k]));
                }
            }
            assert!(found.iter().all(|&times| times == 1), "{count}");
        }
    }
}
