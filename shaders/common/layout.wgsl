// Records and bindings that host and kernels share.
// Host: crates/render/src/kernels/layout.rs. Checked by: tests/system/gpu_shaders.rs (fields by name and offset).
// Lengths are in metres, relative to the camera; radiance in W/(m² sr); missing indices are NONE.

/// Light, or what water or a surface does to it, in the channels that share a walk.
alias Spectrum = vec3f;

const NONE: u32 = 0xffffffffu;
/// Stands for an infinite length, m.
const INFINITE: f32 = 1e30;
const PI: f32 = 3.14159265358979;
/// What a glossy surface's roughness is at least.
const LEAST_ROUGHNESS: f32 = 0.05;

override HAS_MEDIUM: bool = true;
override HAS_SCATTERING: bool = true;
override HAS_SURFACE: bool = true;
override HAS_REFRACTION: bool = true;
override HAS_QUADS: bool = true;
override HAS_TRIANGLES: bool = true;
override HAS_TEXTURES: bool = true;
override HAS_GLOSS: bool = true;
override HAS_NORMAL_MAPS: bool = true;
override HAS_VARIED_REFLECTANCE: bool = true;
override HAS_GEOMETRY_IN_AIR: bool = true;
/// Whether lamps are above the water.
override HAS_AIR_LAMPS: bool = true;
/// Whether the camera or a surface is above the water.
override HAS_AIR: bool = true;
override HAS_SUN: bool = true;
override HAS_SKY: bool = true;
/// Whether the water is not the same everywhere.
override HAS_LAYERS: bool = true;
/// Whether there are clouds in it, and whether its profile has more than 15 nodes.
override HAS_PLUMES: bool = true;
override HAS_MANY_NODES: bool = true;
/// Whether a sample has wavelengths of its own.
override HAS_SPECTRUM: bool = true;
override HAS_DAYLIGHT_FIELD: bool = true;
override HAS_DISTORTION: bool = true;
override HAS_FISHEYE: bool = true;
/// Whether the camera looks through a port, and whether that is a dome.
override HAS_PORT: bool = true;
override HAS_DOME: bool = true;
/// Whether its lens has an opening.
override HAS_OPENING: bool = true;
override HAS_DISKS: bool = true;
override HAS_FALLOFFS: bool = true;
/// Whether lamps have narrow beams, in water that is the same everywhere.
override HAS_BEAMS: bool = true;
/// Whether lamps are so many that they are in groups.
override HAS_GROUPS: bool = true;
/// A single lamp, a single parallelogram: loads with a known index are the cheaper ones.
override ONE_LAMP: bool = false;
override ONE_QUAD: bool = false;
/// Whether a lane makes pixel after pixel, `dispatch.lanes` apart.
override MANY_PIXELS: bool = false;
/// Whether samples look along rays that are given, not through pixels.
override GIVEN_RAYS: bool = false;
/// Whether the small tables lie in a uniform buffer.
override NEAR_IN_UNIFORM: bool = false;

struct Scene {
    camera_forward: vec3f,
    focal_x_px: f32,
    camera_right: vec3f,
    focal_y_px: f32,
    camera_down: vec3f,
    centre_x_px: f32,
    distortion: vec4f,
    distortion_k3: f32,
    centre_y_px: f32,
    width: u32,
    height: u32,
    b: Spectrum,
    c_min: f32,
    c: Spectrum,
    c_max: f32,
    ln_b: Spectrum,
    surface_height_m: f32,
    lamp_sigma: Spectrum,
    refractive_index: f32,
    lamp_ln_sigma: Spectrum,
    lamp_strategies: u32,
    ambient_sigma: Spectrum,
    ambient_strategies: u32,
    stretch: Spectrum,
    lamp_count: u32,
    sun_towards: vec3f,
    quad_count: u32,
    sun_irradiance: Spectrum,
    node_count: u32,
    sun_towards_in_air: vec3f,
    spot_count: u32,
    sun_irradiance_in_air: Spectrum,
    order_ratio: f32,
    sky: Spectrum,
    largest_order: u32,
    bounds_lower: vec3f,
    spot_table: u32,
    bounds_upper: vec3f,
    texture_table: u32,
    largest_emission: Spectrum,
    order_table: u32,
    ambient_scale: Spectrum,
    sobol_table: u32,
    value_ends: vec4u,
    sample_ends: vec4u,
    /// The phase function's mean over the sun's disk.
    sun_value_ends: vec4u,
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
    grid_lower: vec3f,
    a_min: f32,
    grid_step: vec3f,
    b_mean: f32,
    wavelength_sets: u32,
    layer_table: u32,
    layer_rows: u32,
    layer_count: u32,
    bridge_node_count: u32,
    plume_count: u32,
    sun_value_blocks: u32,
    sun_value_cells: u32,
    /// Middle of a dome: right, down, forward.
    dome_offset: vec3f,
    /// Distance of a flat port's sides, radii of a dome's, and the difference of the squares of these.
    port_inner_m: f32,
    port_outer_m: f32,
    port_shell_m2: f32,
    /// Refractive indices of air over glass, and of glass over what is outside.
    into_glass: f32,
    out_of_glass: f32,
    /// Word of the albedos of facets that reflect everything (common/gloss).
    mirror_albedos: u32,
    /// Radius of the lens's opening, and where in front of the lens what is in focus appears.
    opening_radius_m: f32,
    focus_inside_m: f32,
    /// Lamps above the water, after the others.
    air_lamp_count: u32,
    lamp_group_rows: u32,
    lamp_group_count: u32,
    distortion_k4: f32,
    distortion_k5: f32,
    distortion_k6: f32,
    /// Decay of the light of far lamps, 1/m.
    lamp_decay: f32,
    padding_1: u32,
    padding_2: u32,
}

struct Dispatch {
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
    /// With given rays: what keys their numbers in the place of a pixel, and the sample that the first one is.
    ray_key: u32,
    first_ray: u32,
    /// Segments of all daylight walks of a sample, after which those that are left are cut and counted.
    most_segments: u32,
}

/// Read field by field (common/tables), like Triangle.
struct Lamp {
    position: vec3f,
    radius: f32,
    forward: vec3f,
    cos_half_angle: f32,
    intensity: Spectrum,
    level: f32,
    tangent_u: vec3f,
    falloff: u32,
    tangent_v: vec3f,
    film_layer: u32,
    mirror_share: f32,
    beam_cosine: f32,
    padding_1: u32,
    padding_2: u32,
}

/// Lamps that lie together: `count` of them from `first` on.
struct LampGroup {
    centre: vec3f,
    /// No point of them is farther from the centre, m.
    reach: f32,
    /// Sum of their intensities, each the largest of its channels, W/sr.
    intensity: f32,
    /// Mean square of their distances from the centre, m².
    spread2: f32,
    first: u32,
    count: u32,
}

struct Quad {
    centre: vec3f,
    material: u32,
    normal: vec3f,
    tiles_u: f32,
    dual_u: vec3f,
    tiles_v: f32,
    dual_v: vec3f,
    padding: u32,
}

struct Triangle {
    corner: vec3f,
    material: u32,
    edge_1: vec3f,
    smooth_shaded: u32,
    edge_2: vec3f,
    textured: u32,
    normal_0: vec3f,
    u_0: f32,
    normal_1: vec3f,
    v_0: f32,
    normal_2: vec3f,
    u_1: f32,
    v_1: f32,
    u_2: f32,
    v_2: f32,
    padding: u32,
}

/// A box of the tree in depth-first order: its corners on a grid (lower x and y, lower z and upper x, upper y and z; 16
/// bits each, the first the lower), and of an inner node the node to go on with when the box is missed, of a leaf its
/// triangles.
struct Node {
    corners: vec3u,
    link: u32,
}

/// Read row by row (common/tables).
struct Material {
    reflectance: Spectrum,
    texture: u32,
    emission: Spectrum,
    spectrum: u32,
    emission_texture: u32,
    gloss_texture: u32,
    normal_texture: u32,
    normal_scale: f32,
    /// Below 0: Lambertian.
    roughness: f32,
    metallic: f32,
    padding_1: u32,
    padding_2: u32,
    /// Refractive index of the dielectric over that of the water, and the word of its albedos; the same in the air.
    ratio_in_water: f32,
    albedos_in_water: u32,
    ratio_in_air: f32,
    albedos_in_air: u32,
}

struct Counters {
    unfinished: atomic<u32>,
    exhausted: atomic<u32>,
    cut_paths: atomic<u32>,
    paths: atomic<u32>,
    vertices: atomic<u32>,
    not_finite: atomic<u32>,
}

@group(0) @binding(0) var<uniform> scene: Scene;
@group(0) @binding(1) var<uniform> dispatch: Dispatch;
/// Small tables, in one of two places, and large ones.
@group(0) @binding(2) var<uniform> uniform_rows: array<vec4u, 4096>;
@group(0) @binding(4) var<storage, read> near_rows: array<vec4u>;
@group(0) @binding(5) var<storage, read> far_rows: array<vec4u>;
@group(0) @binding(6) var<storage, read> texels: array<u32>;
@group(0) @binding(7) var<storage, read_write> scratch: array<vec4f>;
@group(0) @binding(8) var<storage, read_write> sums: array<vec4f>;
@group(0) @binding(9) var<storage, read_write> film: array<f32>;
@group(0) @binding(10) var<storage, read_write> completed: array<u32>;
@group(0) @binding(11) var<storage, read_write> counters: Counters;
/// Rays that are given: the point they start from, then a direction each.
@group(0) @binding(3) var<uniform> rays: array<vec4f, 4096>;
