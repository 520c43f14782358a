//! Records that host and kernels share. Twins: `shaders/common/layout.wgsl` and `shaders/common/picture.wgsl`. Lengths in metres relative to the camera.

use bytemuck::{Pod, Zeroable};

use super::words::{Field, Record};

/// A missing index.
pub const NONE: u32 = u32::MAX;
/// Stands for the logarithm of zero.
pub const LN_ZERO: f64 = -1e30;
/// Rows of four words of a sample that waits for its daylight walks; twin: `shaders/common/ambient_queue.wgsl`.
pub const QUEUED_ROWS: u32 = 3;
/// The same where rays do not all start in one point.
pub const QUEUED_ROWS_WITH_ORIGIN: u32 = 4;

/// A record: its name in the shaders, its size, and its fields with their offsets, in bytes.
pub type RecordLayout = (&'static str, usize, Vec<(&'static str, usize)>);

/// Every record.
pub fn record_layouts() -> Vec<RecordLayout> {
    [exact_layouts(), plain_layouts()].concat()
}

/// Records that kernels of every precision read.
macro_rules! exact_records {
    ($($(#[$note:meta])* $name:ident { $($field:ident: $type:ty),+ $(,)? })+) => {
        $(
            $(#[$note])*
            #[derive(Clone, Copy, Debug)]
            pub(crate) struct $name { $(pub(crate) $field: <$type as Field>::Host),+ }

            impl Record for $name {
                const ZERO: Self = Self { $($field: <$type as Field>::ZERO),+ };

                fn put(&self, words: &mut Vec<u64>) {
                    $(<$type as Field>::put(&self.$field, words);)+
                }
            }
        )+

        fn exact_layouts() -> Vec<RecordLayout> {
            vec![$({
                let mut end = 0;
                let fields = vec![$({
                    let start = end;
                    end += 4 * <$type as Field>::WORDS;
                    (stringify!($field), start)
                }),+];
                (stringify!($name), end, fields)
            }),+]
        }
    };
}

/// Records of single precision, and of whole numbers.
macro_rules! plain_records {
    ($($(#[$note:meta])* $name:ident { $($field:ident: $type:ty),+ $(,)? })+) => {
        $(
            $(#[$note])*
            #[repr(C)]
            #[derive(Clone, Copy, Debug, Pod, Zeroable)]
            #[allow(missing_docs, reason = "the fields are those of the shader's record, explained there and in the host's types")]
            pub struct $name { $(pub $field: $type),+ }
        )+

        fn plain_layouts() -> Vec<RecordLayout> {
            vec![$((
                stringify!($name),
                size_of::<$name>(),
                vec![$((stringify!($field), std::mem::offset_of!($name, $field))),+],
            )),+]
        }
    };
}

exact_records! {
    /// What a kernel knows of a scene besides its tables.
    Scene {
        camera_forward: [f32; 3],
        focal_x_px: f32,
        camera_right: [f32; 3],
        focal_y_px: f32,
        camera_down: [f32; 3],
        centre_x_px: f32,
        distortion: [f32; 4],
        distortion_k3: f32,
        centre_y_px: f32,
        width: u32,
        height: u32,
        b: [f32; 3],
        c_min: f32,
        c: [f32; 3],
        c_max: f32,
        ln_b: [f32; 3],
        surface_height_m: f32,
        lamp_sigma: [f32; 3],
        refractive_index: f32,
        lamp_ln_sigma: [f32; 3],
        lamp_strategies: u32,
        ambient_sigma: [f32; 3],
        ambient_strategies: u32,
        stretch: [f32; 3],
        lamp_count: u32,
        sun_towards: [f32; 3],
        quad_count: u32,
        sun_irradiance: [f32; 3],
        node_count: u32,
        sun_towards_in_air: [f32; 3],
        spot_count: u32,
        sun_irradiance_in_air: [f32; 3],
        order_ratio: f32,
        sky: [f32; 3],
        largest_order: u32,
        bounds_lower: [f32; 3],
        spot_table: u32,
        bounds_upper: [f32; 3],
        texture_table: u32,
        largest_emission: [f32; 3],
        order_table: u32,
        ambient_scale: [f32; 3],
        sobol_table: u32,
        value_ends: [u32; 4],
        sample_ends: [u32; 4],
        sun_value_ends: [u32; 4],
        value_blocks: u32,
        value_cells: u32,
        sample_blocks: u32,
        sample_cells: u32,
        field_table: u32,
        film_layers: u32,
        lamp_rows: u32,
        quad_rows: u32,
        triangle_rows: u32,
        material_rows: u32,
        spectrum_table: u32,
        spectrum_rows: u32,
        grid_lower: [f32; 3],
        a_min: f32,
        grid_step: [f32; 3],
        b_mean: f32,
        wavelength_sets: u32,
        layer_table: u32,
        layer_rows: u32,
        layer_count: u32,
        bridge_node_count: u32,
        plume_count: u32,
        sun_value_blocks: u32,
        sun_value_cells: u32,
        dome_offset: [f32; 3],
        port_inner_m: f32,
        port_outer_m: f32,
        port_shell_m2: f32,
        into_glass: f32,
        out_of_glass: f32,
        mirror_albedos: u32,
        opening_radius_m: f32,
        focus_inside_m: f32,
        air_lamp_count: u32,
        lamp_group_rows: u32,
        lamp_group_count: u32,
        distortion_k4: f32,
        distortion_k5: f32,
        distortion_k6: f32,
        lamp_decay: f32,
        padding_1: u32,
        padding_2: u32,
    }
    /// A lamp at 100 %.
    Lamp {
        position: [f32; 3],
        radius: f32,
        forward: [f32; 3],
        cos_half_angle: f32,
        intensity: [f32; 3],
        level: f32,
        tangent_u: [f32; 3],
        falloff: u32,
        tangent_v: [f32; 3],
        film_layer: u32,
        mirror_share: f32,
        beam_cosine: f32,
        padding_1: u32,
        padding_2: u32,
    }
    /// Lamps that lie together.
    LampGroup {
        centre: [f32; 3],
        reach: f32,
        intensity: f32,
        spread2: f32,
        first: u32,
        count: u32,
    }
    /// A parallelogram.
    Quad {
        centre: [f32; 3],
        material: u32,
        normal: [f32; 3],
        tiles_u: f32,
        dual_u: [f32; 3],
        tiles_v: f32,
        dual_v: [f32; 3],
        padding: u32,
    }
    /// A surface.
    Material {
        reflectance: [f32; 3],
        texture: u32,
        emission: [f32; 3],
        spectrum: u32,
        emission_texture: u32,
        gloss_texture: u32,
        normal_texture: u32,
        normal_scale: f32,
        roughness: f32,
        metallic: f32,
        padding_1: u32,
        padding_2: u32,
        ratio_in_water: f32,
        albedos_in_water: u32,
        ratio_in_air: f32,
        albedos_in_air: u32,
    }
}

plain_records! {
    /// What one dispatch does.
    Dispatch {
        seed_low: u32,
        seed_high: u32,
        batch: u32,
        batch_samples: u32,
        first_pixel: u32,
        pixel_count: u32,
        samples: u32,
        forced: u32,
        max_events: u32,
        slots: u32,
        lanes: u32,
        loop_probe: u32,
        queued: u32,
        ray_key: u32,
        first_ray: u32,
        most_segments: u32,
    }
    /// A triangle with its shading.
    Triangle {
        corner: [f32; 3],
        material: u32,
        edge_1: [f32; 3],
        smooth_shaded: u32,
        edge_2: [f32; 3],
        textured: u32,
        normal_0: [f32; 3],
        u_0: f32,
        normal_1: [f32; 3],
        v_0: f32,
        normal_2: [f32; 3],
        u_1: f32,
        v_1: f32,
        u_2: f32,
        v_2: f32,
        padding: u32,
    }
    /// A box of the tree of triangles.
    Node {
        corners: [u32; 3],
        link: u32,
    }
    /// What the lanes of a dispatch count.
    Counters {
        unfinished: u32,
        exhausted: u32,
        cut_paths: u32,
        paths: u32,
        vertices: u32,
        not_finite: u32,
    }
    /// What is to be done with the queued film.
    PictureTask {
        mean: [f32; 3],
        pixels: u32,
        width: u32,
        film_layers: u32,
        samples_before: f32,
        batch_samples: f32,
        batches: f32,
        exposure: f32,
        srgb: u32,
        bits: u32,
        noise_a: f32,
        noise_b: f32,
        noise_low: u32,
        noise_high: u32,
        red: [f32; 3],
        padding_1: u32,
        green: [f32; 3],
        padding_2: u32,
        blue: [f32; 3],
        padding_3: u32,
    }
}
