//! Compiled kernels, kept for the next scene that asks for the same: compiling takes longer than a first picture may.

use std::sync::{Arc, Mutex, PoisonError};

use super::Gpu;
use crate::kernels::GpuError;

/// The composed text and the constants, by name and bits. Constants are switches, so that there are few.
type Key = (String, Vec<(&'static str, u64)>);

/// Kernels that are kept: of some scenes. On a driver that renders on the processor one holds hundreds of megabytes.
const MOST_KEPT: usize = 10;

/// Compiled kernels of a device, the one that was asked for last at the end.
#[derive(Clone, Debug, Default)]
pub(super) struct Compiled {
    pipelines: Arc<Mutex<Vec<(Key, wgpu::ComputePipeline)>>>,
}

impl Compiled {
    fn get(&self, key: &Key) -> Option<wgpu::ComputePipeline> {
        let mut kept = self
            .pipelines
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        let index = kept.iter().position(|(own, _)| own == key)?;
        kept[index..].rotate_left(1);
        kept.last().map(|(_, pipeline)| pipeline.clone())
    }

    /// Keeps `pipeline` and drops those that nobody has asked for in longest.
    fn keep(&self, key: Key, pipeline: wgpu::ComputePipeline) {
        let mut kept = self
            .pipelines
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        kept.retain(|(own, _)| *own != key);
        kept.push((key, pipeline));
        let over = kept.len().saturating_sub(MOST_KEPT);
        kept.drain(..over);
    }
}

impl Gpu {
    /// The pipeline of the composed shader `text` with those of `constants` that it declares. The same text always
    /// comes with an equal `layout`.
    ///
    /// # Errors
    /// A fault of the shader or of the device.
    pub(super) fn pipeline(
        &self,
        name: &str,
        text: &str,
        layout: &wgpu::PipelineLayout,
        constants: &[(&'static str, f64)],
    ) -> Result<wgpu::ComputePipeline, GpuError> {
        // A constant that the shader does not have would be refused.
        let declared: Vec<_> = constants
            .iter()
            .filter(|(constant, _)| text.contains(&format!("override {constant}:")))
            .copied()
            .collect();
        let bits = declared
            .iter()
            .map(|(name, value)| (*name, value.to_bits()));
        let key = (text.to_owned(), bits.collect());
        if let Some(pipeline) = self.compiled.get(&key) {
            return Ok(pipeline);
        }
        let module = self
            .device
            .create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(name),
                source: wgpu::ShaderSource::Wgsl(text.into()),
            });
        let pipeline = self
            .device
            .create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(name),
                layout: Some(layout),
                module: &module,
                entry_point: Some("main"),
                compilation_options: wgpu::PipelineCompilationOptions {
                    constants: &declared,
                    ..Default::default()
                },
                cache: None,
            });
        self.check()?;
        self.compiled.keep(key, pipeline.clone());
        Ok(pipeline)
    }
}
