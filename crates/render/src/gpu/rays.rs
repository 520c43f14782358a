//! Rays that are given: their light, one after the other.

use super::{
    Gpu,
    dispatches::{Block, Dispatches, Stop},
    pipeline::Loaded,
};
use crate::{
    kernels::{GpuError, MOST_RAYS, RayBatch, Selection, Tables, Tracer, Work},
    prepare::Prepared,
};

/// The kernels of a scene for rays.
pub(crate) struct RayKernels<'a> {
    dispatches: Dispatches<'a>,
}

impl<'a> RayKernels<'a> {
    /// Uploads `scene` and makes the kernels that `selection` needs.
    ///
    /// # Errors
    /// The device fails or the scene does not fit.
    pub(crate) fn new(
        gpu: &'a Gpu,
        scene: &Prepared,
        selection: &Selection,
    ) -> Result<Self, GpuError> {
        gpu.check()?;
        let mut tables = Tables::build(scene, &selection.lamps, Tracer::Kernels)?;
        (tables.scene.width, tables.scene.height) = (MOST_RAYS as u32, 1);
        let loaded = Loaded::new(gpu, scene, &tables, true)?;
        let dispatches = Dispatches::new(loaded, selection, &|text| text)?;
        Ok(Self { dispatches })
    }

    /// Adds the light of rays to the sums of their layers. `rows` are their origin and, at most [`MOST_RAYS`], their
    /// directions, four numbers each; the first is number `first` of `batch`.
    ///
    /// # Errors
    /// The device fails.
    pub(crate) fn run(
        &mut self,
        batch: &RayBatch,
        first: u32,
        rows: &[f64],
        sums: &mut [f64],
    ) -> Result<Work, GpuError> {
        let rows: Vec<[f32; 4]> = rows
            .as_chunks()
            .0
            .iter()
            .map(|r| r.map(|x| x as f32))
            .collect();
        let rays = rows.len() as u32 - 1;
        self.dispatches.work = Work::default();
        self.dispatches.loaded.set_rays(&rows);
        self.dispatches.loaded.clear(false);
        for kernel in 0..self.dispatches.kernels() {
            self.dispatches.loaded.clear(true);
            let mut first_pixel = 0;
            while first_pixel < rays {
                let block = Block {
                    seed: batch.seed,
                    batch: batch.batch,
                    samples: 1,
                    first_pixel,
                    pixels: self.dispatches.block(kernel, rays - first_pixel),
                    rays: (batch.key, first),
                };
                match self.dispatches.run_block(kernel, &block, &|| false) {
                    // Nothing asks for a stop.
                    Ok(()) | Err(Stop::Asked) => {}
                    Err(Stop::Fault(fault)) => return Err(fault),
                }
                first_pixel += block.pixels;
            }
            self.dispatches.check_completed(kernel, rays, 1)?;
        }
        let film = self.dispatches.loaded.read_film()?;
        for (sum, light) in sums.iter_mut().zip(film) {
            *sum += f64::from(light);
        }
        Ok(self.dispatches.work)
    }
}
