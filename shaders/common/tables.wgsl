// What a scene's tables hold, in rows of four words. The small ones lie in a uniform buffer on adapters that read it
// faster than storage, all but the sun's, which come last.
// Host: crates/render/src/kernels/{tables,records}.rs. Checked by: crates/render/src/gpu/functions/tables.rs (both
// places), tests/system/gpu_shaders.rs (fields and their rows).
import package::common::layout::{HAS_DISKS, HAS_FALLOFFS, LampGroup, NEAR_IN_UNIFORM, NONE, ONE_LAMP, ONE_QUAD, Node, Quad, Spectrum, far_rows, near_rows, scene, uniform_rows};
import package::common::spectrum::lamp_spectrum;

/// Row `i` of the small tables.
fn table_row(i: u32) -> vec4u {
    if NEAR_IN_UNIFORM {
        return uniform_rows[i];
    }
    return near_rows[i];
}

/// Row `i` of the small tables, also of the sun's, which no uniform buffer holds.
fn stored_row(i: u32) -> vec4u {
    return near_rows[i];
}

fn table_row_f32(i: u32) -> vec4f {
    return bitcast<vec4f>(table_row(i));
}

/// Word `i`, counted from the first row.
fn table_word(i: u32) -> u32 {
    if NEAR_IN_UNIFORM {
        return uniform_rows[i >> 2u][i & 3u];
    }
    return near_rows[i >> 2u][i & 3u];
}

fn table_f32(i: u32) -> f32 {
    return bitcast<f32>(table_word(i));
}

/// Row `k` of lamp `i`.
fn lamp_row(i: u32, k: u32) -> vec4u {
    return table_row(scene.lamp_rows + select(6u * i, 0u, ONE_LAMP) + k);
}

fn lamp_position(i: u32) -> vec3f {
    return bitcast<vec4f>(lamp_row(i, 0u)).xyz;
}

fn lamp_radius(i: u32) -> f32 {
    return select(0.0, bitcast<vec4f>(lamp_row(i, 0u)).w, HAS_DISKS);
}

fn lamp_forward(i: u32) -> vec3f {
    return bitcast<vec4f>(lamp_row(i, 1u)).xyz;
}

fn lamp_cos_half_angle(i: u32) -> f32 {
    return bitcast<vec4f>(lamp_row(i, 1u)).w;
}

fn lamp_intensity(i: u32) -> Spectrum {
    return lamp_spectrum(i, bitcast<vec4f>(lamp_row(i, 2u)).xyz);
}

fn lamp_level(i: u32) -> f32 {
    return bitcast<vec4f>(lamp_row(i, 2u)).w;
}

fn lamp_tangent_u(i: u32) -> vec3f {
    return bitcast<vec4f>(lamp_row(i, 3u)).xyz;
}

fn lamp_falloff(i: u32) -> u32 {
    return select(NONE, lamp_row(i, 3u).w, HAS_FALLOFFS);
}

fn lamp_tangent_v(i: u32) -> vec3f {
    return bitcast<vec4f>(lamp_row(i, 4u)).xyz;
}

fn lamp_film_layer(i: u32) -> u32 {
    return lamp_row(i, 4u).w;
}

fn lamp_mirror_share(i: u32) -> f32 {
    return bitcast<vec4f>(lamp_row(i, 5u)).x;
}

/// Cosine of the beam's half angle; 2 where it is too wide to be called one.
fn lamp_beam_cosine(i: u32) -> f32 {
    return bitcast<vec4f>(lamp_row(i, 5u)).y;
}

fn lamp_group(i: u32) -> LampGroup {
    let first = scene.lamp_group_rows + 2u * i;
    let place = table_row_f32(first);
    let sums = table_row_f32(first + 1u);
    let lamps = table_row(first + 1u);
    return LampGroup(place.xyz, place.w, sums.x, sums.y, lamps.z, lamps.w);
}

fn quad_at(i: u32) -> Quad {
    let first = scene.quad_rows + select(4u * i, 0u, ONE_QUAD);
    let corner = table_row(first);
    let normal = table_row_f32(first + 1u);
    let u = table_row_f32(first + 2u);
    let v = table_row_f32(first + 3u);
    return Quad(bitcast<vec3f>(corner.xyz), corner.w, normal.xyz, normal.w, u.xyz, u.w, v.xyz, 0u);
}

fn quad_normal(i: u32) -> vec3f {
    return table_row_f32(scene.quad_rows + select(4u * i, 0u, ONE_QUAD) + 1u).xyz;
}

/// Row `k` of triangle `i`.
fn triangle_row(i: u32, k: u32) -> vec4u {
    return far_rows[scene.triangle_rows + 7u * i + k];
}

fn triangle_corner(i: u32) -> vec3f {
    return bitcast<vec4f>(triangle_row(i, 0u)).xyz;
}

fn triangle_material(i: u32) -> u32 {
    return triangle_row(i, 0u).w;
}

fn triangle_edge_1(i: u32) -> vec3f {
    return bitcast<vec4f>(triangle_row(i, 1u)).xyz;
}

fn triangle_smooth_shaded(i: u32) -> u32 {
    return triangle_row(i, 1u).w;
}

fn triangle_edge_2(i: u32) -> vec3f {
    return bitcast<vec4f>(triangle_row(i, 2u)).xyz;
}

fn triangle_textured(i: u32) -> u32 {
    return triangle_row(i, 2u).w;
}

fn triangle_normal_0(i: u32) -> vec3f {
    return bitcast<vec4f>(triangle_row(i, 3u)).xyz;
}

fn triangle_u_0(i: u32) -> f32 {
    return bitcast<vec4f>(triangle_row(i, 3u)).w;
}

fn triangle_normal_1(i: u32) -> vec3f {
    return bitcast<vec4f>(triangle_row(i, 4u)).xyz;
}

fn triangle_v_0(i: u32) -> f32 {
    return bitcast<vec4f>(triangle_row(i, 4u)).w;
}

fn triangle_normal_2(i: u32) -> vec3f {
    return bitcast<vec4f>(triangle_row(i, 5u)).xyz;
}

fn triangle_u_1(i: u32) -> f32 {
    return bitcast<vec4f>(triangle_row(i, 5u)).w;
}

fn triangle_v_1(i: u32) -> f32 {
    return bitcast<vec4f>(triangle_row(i, 6u)).x;
}

fn triangle_u_2(i: u32) -> f32 {
    return bitcast<vec4f>(triangle_row(i, 6u)).y;
}

fn triangle_v_2(i: u32) -> f32 {
    return bitcast<vec4f>(triangle_row(i, 6u)).z;
}

fn node_at(i: u32) -> Node {
    let row = far_rows[i];
    return Node(row.xyz, row.w);
}

/// Row `k` of material `i`.
fn material_row(i: u32, k: u32) -> vec4u {
    return table_row(scene.material_rows + 5u * i + k);
}

fn material_reflectance(i: u32) -> Spectrum {
    return bitcast<vec4f>(material_row(i, 0u)).xyz;
}

fn material_texture(i: u32) -> u32 {
    return material_row(i, 0u).w;
}

fn material_emission(i: u32) -> Spectrum {
    return bitcast<vec4f>(material_row(i, 1u)).xyz;
}

/// Row of its own reflectance spectrum, NONE where it is mixed of red, green and blue.
fn material_spectrum(i: u32) -> u32 {
    return material_row(i, 1u).w;
}

/// Textures of emission, of roughness and metallic, and of normals, and the bits of what these are multiplied by along the surface.
fn material_maps(i: u32) -> vec4u {
    return material_row(i, 2u);
}

/// Roughness, below 0 of a Lambertian surface, and metallic.
fn material_gloss(i: u32) -> vec2f {
    return bitcast<vec4f>(material_row(i, 3u)).xy;
}

/// Word of the refractive index over that of the water or the air, and after it the word of the albedos.
fn material_dielectric(i: u32, in_air: bool) -> u32 {
    return 4u * (scene.material_rows + 5u * i + 4u) + select(0u, 2u, in_air);
}
