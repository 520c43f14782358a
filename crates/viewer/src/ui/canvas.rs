//! The picture in the window: uploaded from the host, or the renderer's own texture where window and renderer share an
//! adapter. Drawn by a shader of its own, because with egui's a software adapter takes longer (`docs/viewer.md`).

use std::sync::Arc;

use eframe::egui_wgpu::{Callback, CallbackResources, CallbackTrait, RenderState};
use eframe::wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindingResource, Buffer, BufferDescriptor,
    BufferUsages, Device, Extent3d, FilterMode, FragmentState, MultisampleState,
    PipelineCompilationOptions, PrimitiveState, Queue, RenderPass, RenderPipeline,
    RenderPipelineDescriptor, SamplerDescriptor, TexelCopyBufferLayout, Texture, TextureDescriptor,
    TextureDimension, TextureFormat, TextureUsages, TextureViewDescriptor, VertexState,
    include_wgsl,
};
use egui::{Color32, ColorImage, PaintCallbackInfo, Painter, Rect, TextureHandle, TextureOptions};

use crate::model::display::Pixels;
use crate::worker::Frame;

/// What shows pictures.
pub struct Canvas {
    /// What draws the window, with what draws the picture there.
    window: Option<(RenderState, RenderPipeline)>,
    /// Of a window whose device is not known.
    by_egui: Option<TextureHandle>,
    /// Of the window's device, for pictures from the host.
    uploaded: Option<Arc<Texture>>,
    drawing: Option<Drawing>,
    serial: u64,
}

impl Part {
    /// A part of `frame`.
    pub fn of(frame: &Frame, seen: Rect) -> Self {
        // Pixel for pixel there is nothing between texels to be found.
        let filter = match frame.coarseness {
            1 => FilterMode::Nearest,
            _ => FilterMode::Linear,
        };
        Self { seen, filter }
    }
}

/// A texture ready to be drawn. Holding it keeps the renderer from writing to it.
#[derive(Clone)]
struct Drawing {
    pipeline: RenderPipeline,
    bindings: BindGroup,
    texture: Arc<Texture>,
    part: Part,
}

/// What of a picture is drawn, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    /// The part, in [0, 1] from the upper left corner of the picture.
    pub seen: Rect,
    /// What is between two pixels.
    pub filter: FilterMode,
}

impl Canvas {
    /// For a window; `None` where what draws it is not known, and textures of an adapter cannot be shown.
    pub fn new(window: Option<RenderState>) -> Self {
        let window = window.map(|state| {
            let pipeline = pipeline(&state);
            (state, pipeline)
        });
        Self {
            window,
            by_egui: None,
            uploaded: None,
            drawing: None,
            serial: 0,
        }
    }

    /// Draws a part of `frame` to `rect`; `false` for one on the adapter of another window.
    pub fn draw(&mut self, painter: &Painter, rect: Rect, part: Part, frame: &Frame) -> bool {
        let is_new = self.serial != frame.serial;
        self.serial = frame.serial;
        let Some((state, pipeline)) = &self.window else {
            return draw_by_egui(&mut self.by_egui, painter, (rect, part), frame, is_new);
        };
        let kept = self.drawing.take().filter(|_| !is_new);
        let drawing = match kept {
            Some(drawing) if drawing.part == part => drawing,
            Some(drawing) => Drawing::new(state, pipeline, drawing.texture, part),
            None => {
                let texture = match &frame.shown.pixels {
                    Pixels::Texture(texture, _) => {
                        self.uploaded = None;
                        Arc::clone(texture)
                    }
                    Pixels::Image(image) => {
                        let texture = fitting(self.uploaded.take(), &state.device, image);
                        write(&state.queue, &texture, image);
                        Arc::clone(self.uploaded.insert(texture))
                    }
                };
                Drawing::new(state, pipeline, texture, part)
            }
        };
        let callback = Callback::new_paint_callback(rect, drawing.clone());
        painter.add(callback);
        self.drawing = Some(drawing);
        true
    }
}

impl Drawing {
    fn new(
        state: &RenderState,
        pipeline: &RenderPipeline,
        texture: Arc<Texture>,
        part: Part,
    ) -> Self {
        Self {
            pipeline: pipeline.clone(),
            bindings: bindings(state, pipeline, &texture, part),
            texture,
            part,
        }
    }
}

impl CallbackTrait for Drawing {
    fn paint(&self, _: PaintCallbackInfo, pass: &mut RenderPass<'static>, _: &CallbackResources) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bindings, &[]);
        pass.draw(0..3, 0..1);
    }
}

/// Draws a picture of the host by egui's own means.
fn draw_by_egui(
    kept: &mut Option<TextureHandle>,
    painter: &Painter,
    (rect, part): (Rect, Part),
    frame: &Frame,
    is_new: bool,
) -> bool {
    let Some(image) = frame.shown.image() else {
        return false;
    };
    let options = match part.filter {
        FilterMode::Nearest => TextureOptions::NEAREST,
        FilterMode::Linear => TextureOptions::LINEAR,
    };
    let texture = match kept.take() {
        Some(mut texture) => {
            if is_new {
                texture.set(image.clone(), options);
            }
            texture
        }
        None => painter
            .ctx()
            .load_texture("picture", image.clone(), options),
    };
    painter.image(texture.id(), rect, part.seen, Color32::WHITE);
    *kept = Some(texture);
    true
}

fn pipeline(state: &RenderState) -> RenderPipeline {
    let device = &state.device;
    let module = device.create_shader_module(include_wgsl!("canvas.wgsl"));
    let encodes = f64::from(u8::from(state.target_format.is_srgb()));
    device.create_render_pipeline(&RenderPipelineDescriptor {
        label: Some("picture"),
        layout: None,
        vertex: VertexState {
            module: &module,
            entry_point: Some("corner"),
            compilation_options: PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: PrimitiveState::default(),
        depth_stencil: None,
        multisample: MultisampleState::default(),
        fragment: Some(FragmentState {
            module: &module,
            entry_point: Some("colour"),
            compilation_options: PipelineCompilationOptions {
                constants: &[("ENCODES", encodes)],
                ..PipelineCompilationOptions::default()
            },
            targets: &[Some(state.target_format.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}

fn bindings(
    state: &RenderState,
    pipeline: &RenderPipeline,
    texture: &Texture,
    part: Part,
) -> BindGroup {
    let device = &state.device;
    let view = texture.create_view(&TextureViewDescriptor::default());
    let sampler = device.create_sampler(&SamplerDescriptor {
        mag_filter: part.filter,
        min_filter: part.filter,
        ..SamplerDescriptor::default()
    });
    let seen = uniform(state, part.seen);
    let entry = |binding, resource| BindGroupEntry { binding, resource };
    device.create_bind_group(&BindGroupDescriptor {
        label: Some("picture"),
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[
            entry(0, BindingResource::TextureView(&view)),
            entry(1, BindingResource::Sampler(&sampler)),
            entry(2, seen.as_entire_binding()),
        ],
    })
}

/// The part that is seen, as the shader takes it.
fn uniform(state: &RenderState, seen: Rect) -> Buffer {
    let values = [seen.left(), seen.top(), seen.width(), seen.height()];
    let bytes: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
    let buffer = state.device.create_buffer(&BufferDescriptor {
        label: Some("picture"),
        size: bytes.len() as u64,
        usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    state.queue.write_buffer(&buffer, 0, &bytes);
    buffer
}

/// The texture of the picture before, or a new one if that has another size.
fn fitting(before: Option<Arc<Texture>>, device: &Device, image: &ColorImage) -> Arc<Texture> {
    let size = size(image);
    before.filter(|t| t.size() == size).unwrap_or_else(|| {
        Arc::new(device.create_texture(&TextureDescriptor {
            label: Some("picture"),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: TextureDimension::D2,
            format: TextureFormat::Rgba8Unorm,
            usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST,
            view_formats: &[],
        }))
    })
}

fn size(image: &ColorImage) -> Extent3d {
    let [width, height] = image.size.map(|side| side as u32);
    Extent3d {
        width,
        height,
        depth_or_array_layers: 1,
    }
}

fn write(queue: &Queue, texture: &Texture, image: &ColorImage) {
    let layout = TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(4 * image.size[0] as u32),
        rows_per_image: None,
    };
    queue.write_texture(texture.as_image_copy(), image.as_raw(), layout, size(image));
}

#[cfg(test)]
mod tests {
    use eframe::egui_wgpu::RendererOptions;
    use eframe::wgpu::{
        CommandEncoderDescriptor, MapMode, PollType, RenderPassColorAttachment,
        RenderPassDescriptor, TexelCopyBufferInfo,
    };
    use egui::pos2;
    use egui_kittest::wgpu::create_render_state;

    use super::*;

    /// Texels in a row: a row of a copy has a multiple of 256 bytes.
    const WIDTH: usize = 64;
    const HEIGHT: usize = 2;

    /// What the window's pixels hold, red, green, blue and alpha in turn, after a picture was drawn to them.
    fn drawn(state: &RenderState, image: &ColorImage, part: Part) -> Vec<u8> {
        let (device, queue) = (&state.device, &state.queue);
        let pipeline = pipeline(state);
        let texture = fitting(None, device, image);
        write(queue, &texture, image);
        let bindings = bindings(state, &pipeline, &texture, part);
        let target = device.create_texture(&TextureDescriptor {
            label: None,
            size: size(image),
            mip_level_count: 1,
            sample_count: 1,
            dimension: TextureDimension::D2,
            format: state.target_format,
            usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let read = device.create_buffer(&BufferDescriptor {
            label: None,
            size: (4 * WIDTH * HEIGHT) as u64,
            usage: BufferUsages::COPY_DST | BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
        {
            let view = target.create_view(&TextureViewDescriptor::default());
            let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
                color_attachments: &[Some(RenderPassColorAttachment {
                    view: &view,
                    depth_slice: None,
                    resolve_target: None,
                    ops: Default::default(),
                })],
                ..Default::default()
            });
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &bindings, &[]);
            pass.draw(0..3, 0..1);
        }
        let layout = TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(4 * WIDTH as u32),
            rows_per_image: None,
        };
        let buffer = TexelCopyBufferInfo {
            buffer: &read,
            layout,
        };
        encoder.copy_texture_to_buffer(target.as_image_copy(), buffer, size(image));
        queue.submit([encoder.finish()]);
        read.map_async(MapMode::Read, .., |_| {});
        device.poll(PollType::wait_indefinitely()).expect("done");
        read.get_mapped_range(..).expect("mapped").to_vec()
    }

    /// All of a picture, or a sixteenth of its width and half of its height in its middle.
    fn part(is_whole: bool, filter: FilterMode) -> Part {
        let (low, high) = match is_whole {
            true => (pos2(0.0, 0.0), pos2(1.0, 1.0)),
            false => (pos2(0.5, 0.5), pos2(0.5625, 1.0)),
        };
        let seen = Rect::from_min_max(low, high);
        Part { seen, filter }
    }

    #[test]
    fn every_pixel_is_shown_as_it_is_whatever_the_window_encodes() {
        if uw_render::gpu::adapters().is_empty() {
            let required = std::env::var("UW_REQUIRE_GPU").is_ok_and(|value| value == "1");
            assert!(
                !required,
                "UW_REQUIRE_GPU is set and there is no graphics adapter"
            );
            eprintln!("skipped: no graphics adapter");
            return;
        }
        let setup = crate::window::configuration(false, None).wgpu_setup;
        let mut state = create_render_state(setup, RendererOptions::PREDICTABLE);
        let colour = |i: usize| Color32::from_rgb(2 * i as u8, 255 - 2 * i as u8, i as u8);
        let pixels = (0..WIDTH * HEIGHT).map(colour).collect();
        let image = ColorImage::new([WIDTH, HEIGHT], pixels);
        for format in [TextureFormat::Rgba8Unorm, TextureFormat::Rgba8UnormSrgb] {
            state.target_format = format;
            for filter in [FilterMode::Nearest, FilterMode::Linear] {
                let got = drawn(&state, &image, part(true, filter));
                let worst = got.iter().zip(image.as_raw()).map(|(a, b)| a.abs_diff(*b));
                assert!(worst.max() <= Some(1), "{format:?} {filter:?} {got:?}");
            }
            // Four pixels of the second row, each over sixteen columns and both rows.
            let got = drawn(&state, &image, part(false, FilterMode::Nearest));
            for (i, pixel) in got.chunks_exact(4).enumerate() {
                let wanted = colour(WIDTH + WIDTH / 2 + i % WIDTH / 16).to_array();
                let worst = pixel.iter().zip(wanted).map(|(a, b)| a.abs_diff(b));
                assert!(worst.max() <= Some(1), "{format:?} {i} {pixel:?}");
            }
        }
    }
}
