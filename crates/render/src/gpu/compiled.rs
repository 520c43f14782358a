//! Compiled kernels, kept for the next scene that asks for the same: compiling takes longer than a first picture may.

use std::{
    borrow::Cow,
    collections::HashMap,
    sync::{Arc, Mutex, PoisonError},
};

use super::{Gpu, pruned::pruned};
use crate::kernels::GpuError;

/// The composed text and the constants, by name and bits. Constants are switches, so that there are few.
type Key = (String, Vec<(&'static str, u64)>);

/// Compiled kernels of a device.
#[derive(Clone, Debug, Default)]
pub(super) struct Compiled {
    pipelines: Arc<Mutex<HashMap<Key, wgpu::ComputePipeline>>>,
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
        // Those that the shader does not have make no other kernel of it.
        let declared: Vec<_> = constants
            .iter()
            .filter(|(constant, _)| text.contains(&format!("override {constant}:")))
            .copied()
            .collect();
        let bits = declared
            .iter()
            .map(|(name, value)| (*name, value.to_bits()));
        let key = (text.to_owned(), bits.collect());
        let kept = || {
            let pipelines = self.compiled.pipelines.lock();
            pipelines.unwrap_or_else(PoisonError::into_inner)
        };
        if let Some(pipeline) = kept().get(&key) {
            return Ok(pipeline.clone());
        }
        let shader = pruned(text, &declared).map_err(|reason| GpuError::Shader {
            name: name.to_owned(),
            reason,
        })?;
        let module = self
            .device
            .create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(name),
                source: wgpu::ShaderSource::Naga(Cow::Owned(shader)),
            });
        let pipeline = self
            .device
            .create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(name),
                layout: Some(layout),
                module: &module,
                entry_point: Some("main"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                cache: None,
            });
        self.check()?;
        kept().insert(key, pipeline.clone());
        Ok(pipeline)
    }
}
