//! Ways through a tree against a look at every triangle, with all kinds of instructions.

use crate::tree::*;

const TRIANGLES: usize = 700;
const RAYS: usize = 4000;

/// Numbers from −1 to 1, the same every time (Knuth's linear congruence).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f32 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / 8_388_608.0 - 1.0
    }

    fn point(&mut self, size: f32) -> [f32; 3] {
        [(); 3].map(|()| size * self.next())
    }
}

/// A corner and two edges.
type Triangle = [[f32; 3]; 3];

fn triangles() -> Vec<Triangle> {
    let mut numbers = Numbers(1);
    (0..TRIANGLES)
        .map(|_| [numbers.point(2.0), numbers.point(0.8), numbers.point(0.8)])
        .collect()
}

/// Box of a triangle, widened by more than the rounding of a way through it.
fn around(triangle: &Triangle) -> ([f32; 3], [f32; 3]) {
    let [corner, a, b] = triangle;
    let corners = |k: usize| [corner[k], corner[k] + a[k], corner[k] + b[k]];
    let least = |k| corners(k).into_iter().fold(f32::INFINITY, f32::min);
    let largest = |k| corners(k).into_iter().fold(f32::NEG_INFINITY, f32::max);
    (
        std::array::from_fn(|k| least(k) - 1e-5),
        std::array::from_fn(|k| largest(k) + 1e-5),
    )
}

/// A tree over `triangles` from `first` on, which it sorts; returns the index of its root. Some leaves are higher up.
fn build(nodes: &mut Vec<Node>, triangles: &mut [Triangle], first: usize, axis: usize) -> u32 {
    let index = nodes.len();
    nodes.push(Node::EMPTY);
    triangles.sort_by(|a, b| a[0][axis].total_cmp(&b[0][axis]));
    let part = triangles.len().div_ceil(WIDTH).max(2);
    let mut before = first;
    for (slot, part) in triangles.chunks_mut(part).enumerate() {
        for k in 0..3 {
            let boxes = || part.iter().map(around);
            nodes[index].bounds[k][slot] = boxes().map(|b| b.0[k]).fold(f32::INFINITY, f32::min);
            nodes[index].bounds[k + 3][slot] =
                boxes().map(|b| b.1[k]).fold(f32::NEG_INFINITY, f32::max);
        }
        nodes[index].children[slot] = if part.len() <= 3 || (slot == 5 && part.len() < 15) {
            LEAF | (before as u32) << COUNT_BITS | part.len() as u32
        } else {
            build(nodes, part, before, (axis + 1) % 3)
        };
        before += part.len();
    }
    index as u32
}

fn records(triangles: &[Triangle]) -> Vec<u32> {
    let record = |triangle: &Triangle| {
        let mut words = [0; TRIANGLE_WORDS];
        for (k, part) in triangle.iter().enumerate() {
            words[4 * k..4 * k + 3].copy_from_slice(&part.map(f32::to_bits));
        }
        words
    };
    triangles.iter().flat_map(record).collect()
}

#[derive(Clone, Copy, Debug)]
struct Ray {
    origin: [f32; 3],
    direction: [f32; 3],
    t_min: f32,
    t_max: f32,
    start: u32,
    any_hit: bool,
}

/// Groups of eight rays: some from one point in nearly one direction, some from everywhere; some along axes.
fn rays() -> Vec<[Ray; 8]> {
    let mut numbers = Numbers(2);
    (0..RAYS / 8)
        .map(|group| {
            let (origin, towards) = (numbers.point(2.5), numbers.point(1.0));
            std::array::from_fn(|lane| {
                let spread = [0.01, 0.3, 3.0][group % 3];
                let turn = numbers.point(spread);
                let mut direction: [f32; 3] = std::array::from_fn(|k| towards[k] + turn[k]);
                if group % 7 == 0 {
                    direction[lane % 3] = 0.0;
                }
                let length = direction.iter().map(|x| x * x).sum::<f32>().sqrt();
                let shift = numbers.point(spread);
                Ray {
                    origin: std::array::from_fn(|k| origin[k] + shift[k]),
                    direction: direction.map(|x| x / length),
                    t_min: if lane == 3 { 0.5 } else { 0.0 },
                    t_max: if lane == 4 { 1.0 } else { 1e30 },
                    start: u32::MAX,
                    any_hit: group % 2 == 1 || lane == 6,
                }
            })
        })
        .collect()
}

/// The triangles that a ray meets within its range, nearest first, and how far they are; by every triangle in f64.
fn met_by(ray: &Ray, triangles: &[Triangle]) -> Vec<(f64, u32)> {
    let wide = |v: [f32; 3]| v.map(f64::from);
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let cross =
        |a: [f64; 3], b: [f64; 3]| [(1, 2), (2, 0), (0, 1)].map(|(i, j)| a[i] * b[j] - a[j] * b[i]);
    let (origin, direction) = (wide(ray.origin), wide(ray.direction));
    let mut met: Vec<(f64, u32)> = (0..)
        .zip(triangles)
        .filter(|&(index, _)| TRIANGLE | index != ray.start)
        .filter_map(|(index, triangle)| {
            let [corner, a, b] = triangle.map(wide);
            let normal = cross(a, b);
            let s = [0, 1, 2].map(|k| origin[k] - corner[k]);
            let scale = -dot(normal, direction);
            let t = dot(normal, s) / scale;
            let turned = cross(s, direction);
            let (u, v) = (dot(b, turned) / scale, -dot(a, turned) / scale);
            let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0;
            let in_range = t > f64::from(ray.t_min) && t < f64::from(ray.t_max);
            (inside && in_range).then_some((t, index))
        })
        .collect();
    met.sort_by(|a, b| a.0.total_cmp(&b.0));
    met
}

/// Rays that pass an edge, or end, within rounding may be decided either way; none was seen.
const UNDECIDED_SHARE: f64 = 0.0005;

macro_rules! checks {
    ($name:ident, $($lanes:ident)::+, $(#[$attribute:meta])*) => {
        mod $name {
            use super::*;
            use crate::$($lanes)::+::*;

            /// How far the rays in `takes_part` go, and what they meet.
            $(#[$attribute])*
            fn group(tree: &Tree<'_>, rays: &[Ray; LANES], takes_part: [u32; LANES]) -> ([f32; LANES], [u32; LANES]) {
                let floats = |of: &dyn Fn(&Ray) -> f32| ubitsf(of_words(std::array::from_fn(|i| of(&rays[i]).to_bits())));
                let vector = |of: &dyn Fn(&Ray) -> [f32; 3]| [0, 1, 2].map(|k| floats(&|ray| of(ray)[k]));
                let starts = of_words(std::array::from_fn(|i| rays[i].start));
                let any_hit = of_words(std::array::from_fn(|i| u32::from(rays[i].any_hit)));
                let mut waiting = Vec::new();
                let (t, primitive, _) = nearest_triangles(
                    tree,
                    &mut waiting,
                    ueq(of_words(takes_part), us(1)),
                    (vector(&|ray| ray.origin), vector(&|ray| ray.direction)),
                    (floats(&|ray| ray.t_min), starts, ueq(any_hit, us(1))),
                    (floats(&|ray| ray.t_max), us(u32::MAX), [fs(0.0), fs(0.0)]),
                );
                (words_of(fbitsu(t)).map(f32::from_bits), words_of(primitive))
            }

            $(#[$attribute])*
            pub(super) fn agree_with_all_triangles() {
                let mut triangles = triangles();
                let mut nodes = Vec::new();
                build(&mut nodes, &mut triangles, 0, 0);
                let records = records(&triangles);
                let tree = Tree { nodes: &nodes, triangles: &records };
                let (mut met, mut undecided) = (0, 0);
                for (number, mut rays) in rays().into_iter().enumerate() {
                    // As if they started on what they meet first.
                    for ray in &mut rays[..2] {
                        let met = met_by(ray, &triangles);
                        ray.start = met.first().map_or(u32::MAX, |first| TRIANGLE | first.1);
                    }
                    let takes_part: [u32; 8] = std::array::from_fn(|lane| u32::from((number + lane) % 5 != 0));
                    let parts = rays.as_chunks().0.iter().zip(takes_part.as_chunks().0);
                    let (t, primitive): (Vec<_>, Vec<_>) =
                        parts.map(|(rays, takes_part)| group(&tree, rays, *takes_part)).unzip();
                    let (t, primitive) = (t.as_flattened(), primitive.as_flattened());
                    for (lane, ray) in rays.iter().enumerate() {
                        if takes_part[lane] == 0 {
                            assert_eq!((t[lane], primitive[lane]), (ray.t_max, u32::MAX), "left out, {ray:?}");
                            continue;
                        }
                        let expected = met_by(ray, &triangles);
                        met += expected.len().min(1);
                        let is = |&(at, index): &(f64, u32)| {
                            primitive[lane] == TRIANGLE | index && (f64::from(t[lane]) - at).abs() < 1e-4 * at
                        };
                        let agrees = match expected.first() {
                            None => primitive[lane] == u32::MAX && t[lane] == ray.t_max,
                            Some(_) if ray.any_hit => expected.iter().any(is),
                            Some(nearest) => is(nearest),
                        };
                        undecided += usize::from(!agrees);
                    }
                }
                assert!(met > RAYS / 4, "{met} rays met a triangle");
                let share = undecided as f64 / RAYS as f64;
                assert!(share <= UNDECIDED_SHARE, "{share} of the rays met something else");
            }
        }
    };
}

checks!(baseline, four::baseline,);
#[cfg(target_arch = "x86_64")]
checks!(sse4, four::sse4, #[target_feature(enable = "fxsr,sse4.2,cmpxchg16b,popcnt")]);
#[cfg(target_arch = "x86_64")]
checks!(avx2, avx2, #[target_feature(enable = "avx2,fma")]);
#[cfg(target_arch = "x86_64")]
checks!(avx512, avx512, #[target_feature(enable = "avx2,fma,avx512f,avx512vl,avx512dq,avx512bw")]);

#[test]
fn ways_through_a_tree_with_the_baseline() {
    baseline::agree_with_all_triangles();
}

#[cfg(target_arch = "x86_64")]
#[test]
fn ways_through_a_tree_with_sse4() {
    if !crate::Instructions::Sse4.are_here() {
        eprintln!("skipped: the processor lacks SSE4.2");
        return;
    }
    // SAFETY: the processor has the instructions.
    unsafe { sse4::agree_with_all_triangles() }
}

#[cfg(target_arch = "x86_64")]
#[test]
fn ways_through_a_tree_with_avx2() {
    if !crate::Instructions::Avx2.are_here() {
        eprintln!("skipped: the processor lacks AVX2");
        return;
    }
    // SAFETY: the processor has the instructions.
    unsafe { avx2::agree_with_all_triangles() }
}

#[cfg(target_arch = "x86_64")]
#[test]
fn ways_through_a_tree_with_avx512() {
    if !crate::Instructions::Avx512.are_here() {
        eprintln!("skipped: the processor lacks AVX-512");
        return;
    }
    // SAFETY: the processor has the instructions.
    unsafe { avx512::agree_with_all_triangles() }
}
