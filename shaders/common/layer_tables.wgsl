// Rows of water that varies: nodes of its profile in depth, and clouds.
// Host: crates/render/src/prepare/layers.rs (makes the rows). Checked by: tests/system/ (varying_water, layered_water).
import package::common::layout::{HAS_MANY_NODES, HAS_SPECTRUM, Spectrum, scene};
import package::common::settings::{bridge_node_count, layer_count};
import package::common::spectrum::spectral;
import package::common::tables::table_row_f32;

/// Rows of a cloud.
const PLUME_ROWS: u32 = 3u;

/// Which of the numbers a way is drawn by.
const BY_SCATTERING: u32 = 0u;
const BY_ATTENUATION: u32 = 1u;
const BY_BRIDGE: u32 = 2u;

/// Depth of a node, m, and its relative number.
fn layer_node(i: u32, by: u32) -> vec2f {
    let row = table_row_f32(scene.layer_table + select(0u, layer_count(), by == BY_BRIDGE) + i);
    return vec2f(row.x, select(row.y, row.z, by == BY_ATTENUATION));
}

/// Number of the nodes.
fn node_count_by(by: u32) -> u32 {
    return select(layer_count(), bridge_node_count(), by == BY_BRIDGE);
}

/// Row `row` of a cloud: middle and standard deviation, m; its relative numbers by scattering, by attenuation and, itself
/// and blurred, by bridges; the standard deviation of the blurred cloud.
fn plume_row(i: u32, row: u32) -> vec4f {
    return table_row_f32(scene.layer_table + layer_count() + bridge_node_count() + PLUME_ROWS * i + row);
}

/// Attenuation at node `i`, or, beyond the nodes, of a cloud; one row on: scattering.
fn layer_coefficient(i: u32, kind: u32) -> Spectrum {
    let row = scene.layer_rows + 2u * i + kind;
    if HAS_SPECTRUM {
        return spectral(row);
    }
    return table_row_f32(row).xyz;
}

/// Number of nodes at a depth or above it. Written out, because drivers count the iterations of all loops of a lane.
fn nodes_above(depth_m: f32, by: u32) -> u32 {
    var above = 0u;
    if HAS_MANY_NODES {
        above = with_nodes(above, 128u, depth_m, by);
        above = with_nodes(above, 64u, depth_m, by);
        above = with_nodes(above, 32u, depth_m, by);
        above = with_nodes(above, 16u, depth_m, by);
    }
    above = with_nodes(above, 8u, depth_m, by);
    above = with_nodes(above, 4u, depth_m, by);
    above = with_nodes(above, 2u, depth_m, by);
    return with_nodes(above, 1u, depth_m, by);
}

/// `above` and `more` nodes, if all are at the depth or above it. Without a branch, of which drivers would have eight for each search.
fn with_nodes(above: u32, more: u32, depth_m: f32, by: u32) -> u32 {
    let all = above + more;
    let count = node_count_by(by);
    let last = layer_node(max(min(all, count), 1u) - 1u, by);
    return select(above, all, all <= count && last.x <= depth_m);
}

/// The nodes at the ends of the stretch below `above` nodes; the same one twice beyond all nodes.
fn upper_node(above: u32) -> u32 {
    return select(above - 1u, 0u, above == 0u);
}

fn lower_node(above: u32, by: u32) -> u32 {
    return min(above, node_count_by(by) - 1u);
}

/// How far a depth is from the upper to the lower end of a stretch, which are at depths given.
fn share_between(upper_m: f32, lower_m: f32, depth_m: f32) -> f32 {
    return clamp((depth_m - upper_m) / max(lower_m - upper_m, 1e-30), 0.0, 1.0);
}

/// The relative number of a stretch between two nodes at a depth.
fn number_between(upper: vec2f, lower: vec2f, depth_m: f32) -> f32 {
    return mix(upper.y, lower.y, share_between(upper.x, lower.x, depth_m));
}

/// Signed depth of a point, m.
fn signed_depth(point: vec3f) -> f32 {
    return scene.surface_height_m - point.z;
}
