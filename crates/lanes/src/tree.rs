//! A tree over triangles that all lanes of a group go through together: a node is looked at once for all rays that meet it.
//! Neighbouring pixels have rays that meet nearly the same nodes (Wald and others 2001), which are then loaded once
//! instead of lane by lane; rays that part cost as much as one after the other.

/// Children of a node.
pub const WIDTH: usize = 8;
/// The mark of a child that is a leaf; below it the first of its triangles, and in the lowest bits their number.
pub const LEAF: u32 = 1 << 31;
/// Bits of a leaf for the number of its triangles.
pub const COUNT_BITS: u32 = 4;
/// Words of the record of a triangle: its first corner, and from the fifth and ninth word on two edges.
pub const TRIANGLE_WORDS: usize = 28;

/// Marks the index of a triangle among the primitives, as in `shaders/common/bvh.wgsl`, where the next two stand too.
pub(crate) const TRIANGLE: u32 = 1 << 31;
/// Tolerance of barycentric weights.
pub(crate) const EDGE_ROUNDING: f32 = 1e-6;
/// Widens the way through a box by more than the rounding of its products.
pub(crate) const WIDENED: f32 = 1.000002;

/// Up to eight boxes and what is in them. Slot `i` lies where bits 2, 1 and 0 of `i` say whether x, y and z are large,
/// as far as the boxes allow, so that the slots in the order of `i ^ o` are those from near to far for rays of octant `o`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(64))]
pub struct Node {
    /// Least x, y and z of each box, then the largest, m.
    pub bounds: [[f32; WIDTH]; 6],
    /// Index of a node, or a leaf.
    pub children: [u32; WIDTH],
}

impl Node {
    /// A node whose boxes no ray meets.
    pub const EMPTY: Self = Self {
        bounds: [
            [f32::INFINITY; WIDTH],
            [f32::INFINITY; WIDTH],
            [f32::INFINITY; WIDTH],
            [f32::INFINITY; WIDTH],
            [f32::INFINITY; WIDTH],
            [f32::INFINITY; WIDTH],
        ],
        children: [LEAF; WIDTH],
    };
}

/// Nodes, the first of which is the root, and the records of triangles that its leaves name.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tree<'a> {
    /// Nodes.
    pub nodes: &'a [Node],
    /// Words of the records.
    pub triangles: &'a [u32],
}

/// A child that waits, and where rays enter it: at no finite distance where they miss it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Waiting<const LANES: usize> {
    pub(crate) child: u32,
    pub(crate) enter: [u32; LANES],
}

/// The numbers of a triangle's record: a corner and two edges.
pub(crate) fn corner_and_edges(tree: &Tree<'_>, index: u32) -> [[f32; 3]; 3] {
    let first = index as usize * TRIANGLE_WORDS;
    let words = &tree.triangles[first..first + 12];
    [0, 4, 8].map(|k| [words[k], words[k + 1], words[k + 2]].map(f32::from_bits))
}

/// The way through a tree, with an attribute. Twin: `trace_triangles` of `shaders/common/bvh.wgsl`; triangles are tested
/// with the same arithmetic.
macro_rules! tree_functions {
    (#[$attribute:meta]) => {
        $crate::elementary::lane_functions! {
            #[$attribute]

            // Nearest triangle along the rays of the lanes in `m`, closer than `best`: distance, primitive and weights of
            // two corners. `limits` are the least distance, the primitive that a ray starts on, and whether any hit will do.
            fn nearest_triangles(
                tree: &Tree<'_>,
                waiting: &mut Vec<Waiting<LANES>>,
                m: B,
                ray: ([F; 3], [F; 3]),
                limits: (F, U, B),
                best: (F, U, [F; 2]),
            ) -> (F, U, [F; 2]) {
                let (origin, direction) = ray;
                let (t_min, start, any_hit) = limits;
                let (mut t, mut primitive, [mut u, mut v]) = best;
                // Infinite along axes. Where a ray runs within a face this may give no number, and the box may be missed:
                // triangles lie within boxes by the padding.
                let inverse = [
                    fdiv(fs(1.0), direction[0]),
                    fdiv(fs(1.0), direction[1]),
                    fdiv(fs(1.0), direction[2]),
                ];
                let far = octant_of(m, direction) ^ (WIDTH - 1);
                // Before this boxes and triangles count.
                let mut end = fsel(m, t, fs(f32::NEG_INFINITY));
                let mut child = 0;
                waiting.clear();
                loop {
                    let before = waiting.len();
                    if child & LEAF == 0 {
                        wait_for_children(&tree.nodes[child as usize], waiting, far, (origin, inverse, end));
                    } else {
                        let first = (child & !LEAF) >> COUNT_BITS;
                        for index in first..first + (child & ((1 << COUNT_BITS) - 1)) {
                            let (met, found) = meet_triangle(corner_and_edges(tree, index), ray, (t_min, end));
                            let index = us(TRIANGLE | index);
                            let met = band(met, une(start, index));
                            if any(met) {
                                t = fsel(met, found[0], t);
                                primitive = usel(met, index, primitive);
                                u = fsel(met, found[1], u);
                                v = fsel(met, found[2], v);
                                end = fsel(met, fsel(any_hit, fs(f32::NEG_INFINITY), t), end);
                            }
                        }
                    }
                    if waiting.len() == before {
                        // What rays have since met something before is passed over.
                        while waiting.pop_if(|next| !any(fle(ubitsf(of_words(next.enter)), end))).is_some() {}
                    }
                    match waiting.pop() {
                        Some(next) => child = next.child,
                        None => return (t, primitive, [u, v]),
                    }
                }
            }

            // Puts the children that rays meet before `end` on the list, the nearest last.
            fn wait_for_children(node: &Node, waiting: &mut Vec<Waiting<LANES>>, far: usize, ray: ([F; 3], [F; 3], F)) {
                let mut found = [[0; LANES]; WIDTH];
                let mut left = 0;
                for child in 0..WIDTH {
                    let (met, enter) = meet_box(node, child ^ far, ray);
                    found[child] = words_of(fbitsu(fsel(met, enter, fs(f32::INFINITY))));
                    left |= u32::from(any(met)) << child;
                }
                for child in lane_numbers_in(left) {
                    waiting.push(Waiting { child: node.children[child ^ far], enter: found[child] });
                }
            }

            fn meet_box(node: &Node, slot: usize, ray: ([F; 3], [F; 3], F)) -> (B, F) {
                let (origin, inverse, end) = ray;
                let slot = slot % WIDTH;
                let (x, y, z) = (
                    meet_slab(node.bounds[0][slot], node.bounds[3][slot], origin[0], inverse[0]),
                    meet_slab(node.bounds[1][slot], node.bounds[4][slot], origin[1], inverse[1]),
                    meet_slab(node.bounds[2][slot], node.bounds[5][slot], origin[2], inverse[2]),
                );
                let enter = fmax(fmax(x.0, y.0), fmax(z.0, fs(0.0)));
                let leave = fmin(fmin(x.1, y.1), fmin(z.1, end));
                (fle(enter, fmul(leave, fs(WIDENED))), enter)
            }

            fn meet_slab(low: f32, high: f32, origin: F, inverse: F) -> (F, F) {
                let a = fmul(fsub(fs(low), origin), inverse);
                let b = fmul(fsub(fs(high), origin), inverse);
                (fmin(a, b), fmax(a, b))
            }

            // Möller and Trumbore 1997: distance and weights of two corners where the distance is in the range.
            fn meet_triangle(triangle: [[f32; 3]; 3], ray: ([F; 3], [F; 3]), range: (F, F)) -> (B, [F; 3]) {
                let (origin, direction) = ray;
                let (corner, edge_1, edge_2) = (splat(triangle[0]), splat(triangle[1]), splat(triangle[2]));
                let p = cross(direction, edge_2);
                let determinant = dot(edge_1, p);
                let s = [fsub(origin[0], corner[0]), fsub(origin[1], corner[1]), fsub(origin[2], corner[2])];
                let u = fdiv(dot(s, p), determinant);
                let q = cross(s, edge_1);
                let v = fdiv(dot(direction, q), determinant);
                let t = fdiv(dot(edge_2, q), determinant);
                let least = fs(-EDGE_ROUNDING);
                let inside = band(fle(least, u), fle(least, v));
                let inside = band(inside, fle(fadd(u, v), fs(1.0 + EDGE_ROUNDING)));
                let inside = bandnot(feq(determinant, fs(0.0)), inside);
                (band(inside, band(flt(range.0, t), flt(t, range.1))), [t, u, v])
            }

            // Which parts of the direction are negative in the first lane: bits 2, 1 and 0 for x, y and z.
            fn octant_of(m: B, direction: [F; 3]) -> usize {
                let first = lanes_of(m).trailing_zeros() as usize % LANES;
                let x = words_of(fbitsu(direction[0]))[first] >> 31;
                let y = words_of(fbitsu(direction[1]))[first] >> 31;
                let z = words_of(fbitsu(direction[2]))[first] >> 31;
                (x << 2 | y << 1 | z) as usize
            }

            fn splat(v: [f32; 3]) -> [F; 3] {
                [fs(v[0]), fs(v[1]), fs(v[2])]
            }

            fn dot(a: [F; 3], b: [F; 3]) -> F {
                fadd(fadd(fmul(a[0], b[0]), fmul(a[1], b[1])), fmul(a[2], b[2]))
            }

            fn cross(a: [F; 3], b: [F; 3]) -> [F; 3] {
                [
                    fsub(fmul(a[1], b[2]), fmul(a[2], b[1])),
                    fsub(fmul(a[2], b[0]), fmul(a[0], b[2])),
                    fsub(fmul(a[0], b[1]), fmul(a[1], b[0])),
                ]
            }
        }
    };
}

pub(crate) use tree_functions;
