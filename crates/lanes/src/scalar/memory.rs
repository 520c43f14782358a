//! What a lane in double precision reads and writes: words as wide as an `f64`. Below 2³² they are whole numbers, or the bits
//! of an `f32`.

use crate::{COUNTERS, DISPATCH_WORDS, memory::or_a_row};

/// The index of no primitive, and the mark of triangles; as in `shaders/common/layout.wgsl` and `bvh.wgsl`.
const NONE: u64 = u32::MAX as u64;

/// A word of memory.
pub trait Word: Copy {
    /// As wide as any.
    fn wide(self) -> u64;
}

impl Word for u32 {
    fn wide(self) -> u64 {
        u64::from(self)
    }
}

impl Word for u64 {
    fn wide(self) -> u64 {
        self
    }
}

/// What rays meet. Points and lengths in metres, relative to the camera; indices of primitives are those of the kernels.
pub trait Surfaces: Sync {
    /// Distance, primitive and place on it of the nearest surface closer than `t_max` along a ray that starts on the
    /// primitive `start`; with `any` of any surface.
    fn nearest(
        &self,
        origin: [f64; 3],
        direction: [f64; 3],
        t_max: f64,
        start: u32,
        any: bool,
    ) -> Option<(f64, u32, [f64; 2])>;

    /// The surface where a ray along `direction` meets a primitive.
    fn point(&self, primitive: u32, local: [f64; 2], direction: [f64; 3]) -> Point;
}

/// A point of a surface; as in `shaders/common/bvh.wgsl`.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// Unit normal on the side the ray came from.
    pub normal: [f64; 3],
    /// Unit shading normal on the same side.
    pub shading_normal: [f64; 3],
    /// Reflectance of red, green and blue, in [0, 1].
    pub reflectance: [f64; 3],
    /// Emitted radiance, W/(m² sr).
    pub emission: [f64; 3],
    /// Index of the material.
    pub material: u32,
    /// Roughness; 0 of a Lambertian surface.
    pub roughness: f64,
    /// How much it is a metal, in [0, 1].
    pub metallic: f64,
}

/// Tables of a scene.
#[derive(Clone, Copy)]
pub struct Tables<'a> {
    /// The words of its record.
    pub scene: &'a [u64],
    /// Rows of four words: small tables.
    pub near_rows: &'a [u64],
    /// Rows of four words: large tables in single precision.
    pub far_rows: &'a [u32],
    /// Words of textures.
    pub texels: &'a [u32],
    /// What rays meet.
    pub surfaces: &'a dyn Surfaces,
}

/// Memory of a lane.
pub(super) struct Memory<'a> {
    pub(super) scene: &'a [u64],
    pub(super) dispatch: [u64; DISPATCH_WORDS],
    pub(super) counters: [u32; COUNTERS],
    pub(super) near_rows: &'a [u64],
    pub(super) far_rows: &'a [u32],
    pub(super) texels: &'a [u32],
    surfaces: &'a dyn Surfaces,
    /// Rays that are given, a row each after that of their origin.
    pub(super) rays: Vec<u64>,
    pub(super) scratch: Vec<u64>,
    pub(super) sums: Vec<u64>,
    pub(super) film: Vec<u64>,
    pub(super) completed: Vec<u64>,
    /// The first word of the film and of the counts of completed samples that are here.
    pub(super) first_of_film: u32,
    pub(super) first_of_completed: u32,
}

impl<'a> Memory<'a> {
    pub(super) fn new(
        tables: &Tables<'a>,
        (scratch_rows, film_layers, pixels): (u32, u32, u32),
    ) -> Self {
        let layers = film_layers as usize;
        Self {
            scene: tables.scene,
            dispatch: [0; DISPATCH_WORDS],
            counters: [0; COUNTERS],
            near_rows: if tables.near_rows.is_empty() {
                &[0; 4]
            } else {
                tables.near_rows
            },
            far_rows: or_a_row(tables.far_rows),
            texels: or_a_row(tables.texels),
            surfaces: tables.surfaces,
            rays: vec![0; 4],
            scratch: vec![0; 4 * scratch_rows as usize],
            sums: vec![0; 4 * layers],
            film: vec![0; 3 * layers * pixels as usize],
            completed: vec![0; pixels as usize],
            first_of_film: 0,
            first_of_completed: 0,
        }
    }

    /// Ready for the samples of `dispatch` from a pixel on.
    pub(super) fn start(&mut self, first_pixel: u32, layers: u32, dispatch: [u32; DISPATCH_WORDS]) {
        self.dispatch = dispatch.map(u64::from);
        self.counters = [0; COUNTERS];
        // Words wrap around as the kernels' own do.
        self.first_of_film = first_pixel.wrapping_mul(3 * layers);
        self.first_of_completed = first_pixel;
        self.film.fill(0);
        self.completed.fill(0);
    }

    pub(super) fn nearest(
        &self,
        origin: [f64; 3],
        direction: [f64; 3],
        t_max: f64,
        (start, any): (u64, bool),
    ) -> (f64, u64, [f64; 2]) {
        let found = self
            .surfaces
            .nearest(origin, direction, t_max, start as u32, any);
        found.map_or((t_max, NONE, [0.0; 2]), |(t, primitive, local)| {
            (t, u64::from(primitive), local)
        })
    }

    pub(super) fn surface_point(
        &self,
        primitive: u64,
        local: [f64; 2],
        direction: [f64; 3],
    ) -> Point {
        self.surfaces.point(primitive as u32, local, direction)
    }
}
