//! What a group of lanes reads and writes.

use crate::tree::{Tree, Waiting};

/// Words of the record of a scene and more: a constant length, so that no read of it is checked.
const SCENE_WORDS: usize = 256;
/// Words of the record of a dispatch.
pub const DISPATCH_WORDS: usize = 16;
/// Counters of the kernels, in their order: unfinished, exhausted, cut paths, paths, vertices, not finite.
pub const COUNTERS: usize = 6;

/// Tables of a scene, as the kernels bind them.
#[derive(Clone, Copy, Debug)]
pub struct Tables<'a> {
    /// The words of its record.
    pub scene: &'a [u32],
    /// Rows of four words: small tables.
    pub near_rows: &'a [u32],
    /// Rows of four words: large tables.
    pub far_rows: &'a [u32],
    /// Words of textures.
    pub texels: &'a [u32],
    /// Its triangles.
    pub tree: Tree<'a>,
}

/// Memory of a group of lanes: tables that it shares with others and buffers of its own.
#[derive(Clone, Debug)]
pub struct Memory<'a, const LANES: usize> {
    pub(crate) scene: Box<[u32; SCENE_WORDS]>,
    pub(crate) dispatch: [u32; DISPATCH_WORDS],
    pub(crate) counters: [u32; COUNTERS],
    pub(crate) near_rows: &'a [u32],
    pub(crate) far_rows: &'a [u32],
    pub(crate) texels: &'a [u32],
    pub(crate) tree: Tree<'a>,
    /// Rays that are given, a row each after that of their origin.
    pub(crate) rays: Vec<u32>,
    /// Room for a way through the tree.
    pub(crate) waiting: Vec<Waiting<LANES>>,
    pub(crate) scratch: Vec<u32>,
    pub(crate) sums: Vec<u32>,
    pub(crate) film: Vec<u32>,
    pub(crate) completed: Vec<u32>,
    film_layers: u32,
    /// The first word of the film and of the counts of completed samples that are here.
    pub(crate) first_of_film: u32,
    pub(crate) first_of_completed: u32,
}

impl<'a, const LANES: usize> Memory<'a, LANES> {
    /// With `scratch_rows` rows of four words for each lane and a film of `pixels` pixels in `film_layers` layers.
    pub(crate) fn new(
        tables: &Tables<'a>,
        (scratch_rows, film_layers, pixels): (u32, u32, u32),
    ) -> Self {
        let mut scene = Box::new([0; SCENE_WORDS]);
        scene[..tables.scene.len()].copy_from_slice(tables.scene);
        let layers = film_layers as usize;
        Self {
            scene,
            dispatch: [0; DISPATCH_WORDS],
            counters: [0; COUNTERS],
            near_rows: or_a_row(tables.near_rows),
            far_rows: or_a_row(tables.far_rows),
            texels: or_a_row(tables.texels),
            tree: tables.tree,
            rays: vec![0; 4],
            waiting: Vec::new(),
            scratch: vec![0; 4 * scratch_rows as usize * LANES],
            sums: vec![0; 4 * layers * LANES],
            film: vec![0; 3 * layers * pixels as usize],
            completed: vec![0; pixels as usize],
            film_layers,
            first_of_film: 0,
            first_of_completed: 0,
        }
    }

    /// Makes room for the samples of `dispatch` from `first_pixel` on.
    pub(crate) fn begin(&mut self, first_pixel: u32, dispatch: [u32; DISPATCH_WORDS]) {
        self.dispatch = dispatch;
        self.counters = [0; COUNTERS];
        // Words wrap around as the kernels' own do.
        self.first_of_film = first_pixel.wrapping_mul(3 * self.film_layers);
        self.first_of_completed = first_pixel;
        self.film.fill(0);
        self.completed.fill(0);
    }
}

/// Reads beyond the end give the last row, so that there has to be one.
pub(crate) fn or_a_row(rows: &[u32]) -> &[u32] {
    if rows.is_empty() { &[0; 4] } else { rows }
}
