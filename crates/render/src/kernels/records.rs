//! A prepared scene as records and tables.

use glam::{DVec2, DVec3};
use uw_media::{Spectrum, phase::DiskTable};

use super::{
    GpuError, lamp_groups,
    layout::{LN_ZERO, Lamp, Material, NONE, Quad, Scene, Triangle},
    order::{MAX_ORDER, OrderLaw},
    spectra,
    tables::{FarRows, Rows, narrow_rows},
    tree::{self, MOST_TRIANGLES, Tree},
    wide_tree,
    words::{Record, narrow},
};
use crate::prepare::{Medium, Prepared, PreparedLamp, Strategies};
use crate::scene::{Lens, Port, PortShape};

/// Contribution of an order, relative to the first, below which bridges need not reach.
const LEAST_ORDER_SHARE: f64 = 1e-9;
/// Fewest scatterings that a bridge can have.
const FEWEST_ORDERS: usize = 32;
/// Layers of the film before those of the lamps.
const FIXED_LAYERS: usize = 3;
/// How far around a lamp image points are drawn, pixels.
const SPOT_REACH_PX: f64 = 1.5;
/// Smallest angle about a lamp that directions in f32 tell apart, rad.
const LEAST_SPOT_RAD: f64 = 1e-6;
/// Smallest distance about a lamp in the image in f64, pixels.
const LEAST_SPOT_PX: f64 = 1e-9;

/// Everything that the kernels read of a scene.
#[derive(Clone, Debug)]
pub(crate) struct Tables {
    pub(crate) scene: Scene,
    /// Small tables: words, four to a row.
    near_words: Vec<u64>,
    /// Rows of these before the table of the sun, which few places of the kernels read.
    pub(crate) common_rows: usize,
    /// Nodes, triangles and the field of daylight.
    pub(crate) far_rows: Vec<[u32; 4]>,
    /// Words of textures.
    pub(crate) texels: Vec<u32>,
    /// The tree of lanes.
    pub(crate) wide_nodes: Vec<uw_lanes::tree::Node>,
}

/// Whose way through the triangles is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Tracer {
    /// Compute kernels: nodes among the large tables.
    Kernels,
    /// Lanes of a processor: nodes of their own.
    Lanes,
    /// The prepared geometry itself: neither nodes nor triangles.
    Prepared,
}

impl Tracer {
    /// Smallest distance about a lamp in the image that directions tell apart, pixels.
    fn least_spot_px(self, focal_px: f64) -> f64 {
        match self {
            Self::Kernels | Self::Lanes => LEAST_SPOT_RAD * focal_px,
            Self::Prepared => LEAST_SPOT_PX,
        }
    }
}

fn logarithms(v: Spectrum) -> Spectrum {
    v.map(|x| x.max(LN_ZERO))
}

impl Tables {
    /// The tables of `scene` for the lamps in `active` and for `tracer`.
    ///
    /// # Errors
    /// [`GpuError::Limit`] when the scene has more triangles than indices can name.
    pub(crate) fn build(
        scene: &Prepared,
        active: &[usize],
        tracer: Tracer,
    ) -> Result<Self, GpuError> {
        let origin = scene.camera.position_m;
        let mut rows = Rows::default();
        let mut far = FarRows::default();
        let mut texels = Vec::new();
        let mut record = camera(scene);
        let (in_water, in_air): (Vec<usize>, Vec<usize>) =
            active.iter().partition(|&&i| !scene.lamps[i].in_air);
        let (in_water, groups) = lamp_groups::arranged(scene, in_water);
        let active = &[&in_water[..], &in_air].concat()[..];
        let lamps: Vec<Lamp> = active
            .iter()
            .map(|&i| lamp(scene, i, origin, &mut rows))
            .collect();
        record.lamp_count = in_water.len() as u32;
        record.air_lamp_count = in_air.len() as u32;
        record.lamp_rows = rows.records(&lamps);
        record.lamp_group_count = groups.len() as u32;
        record.lamp_group_rows = rows.records(&groups);
        let spots = spots(scene, &in_water, tracer);
        record.spot_count = spots.len() as u32;
        record.spot_table = rows.spots(&spots);
        record.sobol_table = rows.sobol();
        record.film_layers = (FIXED_LAYERS + scene.lamps.len()) as u32;
        if let Some(medium) = &scene.medium {
            water(medium, &mut record, &mut rows);
        }
        if let Some(layers) = &scene.layers {
            rows.layers(layers, origin, scene.spectrum.is_some(), &mut record);
        }
        daylight(scene, origin, &mut record);
        let quads: Vec<Quad> = quads(scene, origin);
        let (triangles, tree, wide_nodes) = triangles(scene, origin, tracer)?;
        record.quad_count = quads.len() as u32;
        record.quad_rows = rows.records(&quads);
        record.node_count = match tracer {
            Tracer::Kernels => tree.nodes.len() as u32,
            Tracer::Lanes => wide_nodes.len() as u32,
            Tracer::Prepared => u32::from(scene.geometry.tree.is_some()),
        };
        record.grid_lower = tree.grid.lower.map(f64::from);
        record.grid_step = tree.grid.step.map(f64::from);
        far.records(&tree.nodes);
        record.triangle_rows = far.records(&triangles);
        if let Some(field) = &scene.daylight {
            record.field_table = rows.field(field, &mut far);
        }
        let materials = materials(scene, active.len(), &mut rows, &mut record);
        record.material_rows = rows.records(&materials);
        if let Some(sets) = &scene.spectrum {
            spectra::add(sets, active, &mut record, &mut far);
        }
        record.texture_table = rows.textures(&scene.geometry.textures, &mut texels);
        let common_rows = rows.next_row() as usize;
        // Where there is no sun nobody looks.
        if let Some(table) = scene.sun_phase.as_deref() {
            sun(table, &mut record, &mut rows);
        }
        Ok(Self {
            scene: record,
            near_words: rows.finish(),
            common_rows,
            far_rows: far.finish(),
            texels,
            wide_nodes,
        })
    }

    /// The record of the scene in double precision.
    pub(crate) fn exact_scene(&self) -> Vec<u64> {
        self.scene.words()
    }

    /// The small tables in double precision.
    pub(crate) fn exact_rows(&self) -> &[u64] {
        &self.near_words
    }

    /// The record of the scene in single precision.
    pub(crate) fn scene_words(&self) -> Vec<u32> {
        self.scene.words().into_iter().map(narrow).collect()
    }

    /// The small tables in single precision.
    pub(crate) fn near_rows(&self) -> Vec<[u32; 4]> {
        narrow_rows(&self.near_words)
    }
}

/// Highest order of bridges in water whose largest single scattering albedo is `albedo`.
pub(super) fn largest_order(albedo: f64) -> usize {
    if albedo <= 0.0 {
        return 0;
    }
    let needed = (LEAST_ORDER_SHARE.ln() / albedo.min(1.0 - 1e-12).ln()).ceil();
    (needed as usize).clamp(FEWEST_ORDERS, MAX_ORDER)
}

fn camera(scene: &Prepared) -> Scene {
    let camera = &scene.camera;
    let (distortion, [k3, k4, k5, k6]) = match camera.lens {
        Lens::Perspective([k1, k2, p1, p2, more @ ..]) => ([k1, k2, p1, p2], more),
        Lens::Fisheye(k) => (k, [0.0; 4]),
    };
    let record = Scene {
        camera_forward: camera.forward.to_array(),
        focal_x_px: camera.focal_px.x,
        camera_right: camera.right.to_array(),
        focal_y_px: camera.focal_px.y,
        camera_down: camera.down.to_array(),
        centre_x_px: camera.centre_px.x,
        distortion,
        distortion_k3: k3,
        distortion_k4: k4,
        distortion_k5: k5,
        distortion_k6: k6,
        centre_y_px: camera.centre_px.y,
        width: camera.width,
        height: camera.height,
        opening_radius_m: camera.opening_radius_m(),
        focus_inside_m: (camera.opening.as_ref())
            .map_or(0.0, |opening| camera.focus_inside_m(opening)),
        refractive_index: 1.0,
        ..Scene::ZERO
    };
    camera
        .port
        .as_ref()
        .map_or(record, |port| with_port(record, port))
}

fn with_port(record: Scene, port: &Port) -> Scene {
    let (inner_m, offset_m) = match port.shape {
        PortShape::Flat { distance_m } => (distance_m, DVec3::ZERO),
        PortShape::Dome { radius_m, offset_m } => (radius_m, offset_m),
    };
    let outer_m = inner_m + port.thickness_m;
    Scene {
        dome_offset: offset_m.to_array(),
        port_inner_m: inner_m,
        port_outer_m: outer_m,
        port_shell_m2: port.thickness_m * (outer_m + inner_m),
        into_glass: 1.0 / port.glass_index,
        out_of_glass: port.glass_index / port.outside_index,
        ..record
    }
}

fn water(medium: &Medium, record: &mut Scene, rows: &mut Rows) {
    record.b = medium.b;
    record.c = medium.c;
    record.a_min = medium.a_min;
    record.b_mean = medium.b_mean();
    record.c_min = medium.c_min;
    record.c_max = medium.c_max;
    record.lamp_decay = medium.lamp_decay();
    record.ln_b = logarithms(medium.ln_b);
    let strategies = |s: &Strategies| (s.sigma, logarithms(s.sigma.map(f64::ln)), s.count as u32);
    (
        record.lamp_sigma,
        record.lamp_ln_sigma,
        record.lamp_strategies,
    ) = strategies(&medium.by_scattering);
    (record.ambient_sigma, _, record.ambient_strategies) = strategies(&medium.by_attenuation);
    let [value, sample] = medium.phase.parts().map(|parts| rows.cells(&parts));
    record.value_ends = value.ends;
    record.value_blocks = value.blocks;
    record.value_cells = value.cells;
    record.sample_ends = sample.ends;
    record.sample_blocks = sample.blocks;
    record.sample_cells = sample.cells;
    let albedo = medium.albedo;
    let largest = largest_order(albedo);
    record.largest_order = largest as u32;
    record.order_ratio = OrderLaw::new(albedo).ratio();
    record.order_table = rows.orders(&OrderLaw::new(albedo), largest);
}

/// The phase function's mean over the disk of the sun.
fn sun(table: &DiskTable, record: &mut Scene, rows: &mut Rows) {
    let mean = rows.cells(&table.parts());
    record.sun_value_ends = mean.ends;
    record.sun_value_ends[2] = (table.far_x() as f32).to_bits();
    record.sun_value_ends[3] = (table.value(0.0) as f32).to_bits();
    record.sun_value_blocks = mean.blocks;
    record.sun_value_cells = mean.cells;
}

fn daylight(scene: &Prepared, origin: DVec3, record: &mut Scene) {
    if let Some(boundary) = &scene.boundary {
        record.surface_height_m = boundary.height - origin.z;
        record.refractive_index = boundary.index;
    }
    if let Some(sun) = &scene.sun {
        record.sun_towards = sun.towards.to_array();
        record.sun_towards_in_air = sun.towards_in_air.to_array();
        record.sun_irradiance = sun.irradiance;
        record.sun_irradiance_in_air = sun.irradiance_in_air;
    }
    record.sky = scene.sky;
    record.stretch = scene.stretch;
    record.largest_emission = scene.largest_emission;
    record.ambient_scale = scene.ambient_scale;
    if let Some((lower, upper)) = scene.geometry.bounds() {
        record.bounds_lower = (lower - origin).to_array();
        record.bounds_upper = (upper - origin).to_array();
    }
}

fn lamp(scene: &Prepared, index: usize, origin: DVec3, rows: &mut Rows) -> Lamp {
    let lamp = &scene.lamps[index];
    let falloff = lamp.falloff.as_ref();
    Lamp {
        position: (lamp.position - origin).to_array(),
        radius: lamp.radius,
        forward: lamp.forward.to_array(),
        cos_half_angle: lamp.cos_half_angle,
        intensity: lamp.intensity,
        level: lamp.level,
        tangent_u: lamp.tangent.0.to_array(),
        falloff: falloff.map_or(NONE, |table| rows.falloff(table)),
        tangent_v: lamp.tangent.1.to_array(),
        film_layer: (FIXED_LAYERS + index) as u32,
        mirror_share: lamp.mirror_share,
        beam_cosine: lamp.beam_cosine,
        padding_1: 0,
        padding_2: 0,
    }
}

fn quads(scene: &Prepared, origin: DVec3) -> Vec<Quad> {
    let quads = scene.geometry.quads.iter().map(|prepared| {
        let quad = &prepared.quad;
        // Tiles per half edge: texture coordinates are (1 ± local) times these.
        let tiles = DVec2::new(quad.half_u.length(), quad.half_v.length()) / quad.tile_m;
        Quad {
            centre: (quad.centre_m - origin).to_array(),
            material: quad.material as u32,
            normal: quad.normal.to_array(),
            tiles_u: tiles.x,
            dual_u: prepared.dual_u.to_array(),
            tiles_v: tiles.y,
            dual_v: prepared.dual_v.to_array(),
            padding: 0,
        }
    });
    quads.collect()
}

/// Triangles in the order of their tree, and the tree: one of the two is empty.
fn triangles(
    scene: &Prepared,
    origin: DVec3,
    tracer: Tracer,
) -> Result<(Vec<Triangle>, Tree, Vec<uw_lanes::tree::Node>), GpuError> {
    let geometry = &scene.geometry;
    let Some(tree) = &geometry.tree else {
        return Ok((Vec::new(), Tree::default(), Vec::new()));
    };
    if tree.triangles().len() as u64 >= MOST_TRIANGLES {
        return Err(GpuError::Limit {
            what: "the number of triangles".to_owned(),
            limit: "indices of triangles",
            needed: tree.triangles().len() as u64,
            available: MOST_TRIANGLES,
        });
    }
    let corner = |p: DVec3| (p - origin).as_vec3();
    let boxes: Vec<_> = tree
        .triangles()
        .iter()
        .map(|t| {
            let (a, b, c) = (
                corner(t.corner),
                corner(t.corner + t.edge_1),
                corner(t.corner + t.edge_2),
            );
            (a.min(b).min(c).to_array(), a.max(b).max(c).to_array())
        })
        .collect();
    let boxes = tree::padded(&boxes);
    let (order, linked, wide) = match tracer {
        Tracer::Kernels => {
            let mut linked = tree::build(&boxes);
            (std::mem::take(&mut linked.order), linked, Vec::new())
        }
        Tracer::Lanes => {
            let native_order = (0..tree.triangles().len() as u32).collect();
            let wide = wide_tree::nodes(tree.nodes(), &boxes);
            (native_order, Tree::default(), wide)
        }
        Tracer::Prepared => return Ok((Vec::new(), Tree::default(), Vec::new())),
    };
    let records = order.into_iter().map(|i| {
        let (t, shading) = (&tree.triangles()[i as usize], &geometry.shading[i as usize]);
        let normals = shading.normals.unwrap_or_default().map(|n| n.as_vec3());
        let uvs = shading.uvs.unwrap_or_default().map(|uv| uv.as_vec2());
        Triangle {
            corner: corner(t.corner).to_array(),
            material: shading.material,
            edge_1: t.edge_1.as_vec3().to_array(),
            smooth_shaded: u32::from(shading.normals.is_some()),
            edge_2: t.edge_2.as_vec3().to_array(),
            textured: u32::from(shading.uvs.is_some()),
            normal_0: normals[0].to_array(),
            u_0: uvs[0].x,
            normal_1: normals[1].to_array(),
            v_0: uvs[0].y,
            normal_2: normals[2].to_array(),
            u_1: uvs[1].x,
            v_1: uvs[1].y,
            u_2: uvs[2].x,
            v_2: uvs[2].y,
            padding: 0,
        }
    });
    Ok((records.collect(), linked, wide))
}

/// Materials, after the tables of albedos that glossy ones need.
fn materials(scene: &Prepared, lamps: usize, rows: &mut Rows, record: &mut Scene) -> Vec<Material> {
    let geometry = &scene.geometry;
    let spectra = spectra::own_spectra(scene, lamps);
    let tables = &scene.albedos;
    if let Some(tables) = tables {
        record.mirror_albedos = rows.albedos(&tables.mirrors);
    }
    let dielectrics: Vec<(f64, u32)> = tables
        .iter()
        .flat_map(|tables| &tables.dielectrics)
        .map(|(ratio, table)| (*ratio, rows.albedos(table)))
        .collect();
    let dielectric = |ratio: f64| {
        let found = dielectrics.iter().find(|(own, _)| *own == ratio);
        found.copied().unwrap_or((ratio, 0))
    };
    let texture = |index: Option<usize>| index.map_or(NONE, |i| i as u32);
    let materials = geometry.materials.iter().enumerate();
    let materials = materials.map(|(i, m)| {
        let of_gloss = m.gloss.map(|gloss| {
            let ratio = gloss.index / scene.index_of_water;
            (dielectric(ratio), dielectric(gloss.index))
        });
        let (in_water, in_air) = of_gloss.unwrap_or(((1.0, 0), (1.0, 0)));
        Material {
            reflectance: m.reflectance,
            texture: texture(m.texture),
            emission: m.emission,
            spectrum: spectra.get(i).copied().unwrap_or(NONE),
            emission_texture: texture(m.emission_texture),
            gloss_texture: texture(m.gloss.and_then(|gloss| gloss.texture)),
            normal_texture: texture(m.normal_map.map(|map| map.texture)),
            normal_scale: m.normal_map.map_or(1.0, |map| map.scale),
            roughness: m.gloss.map_or(-1.0, |gloss| gloss.roughness),
            metallic: m.gloss.map_or(0.0, |gloss| gloss.metallic),
            padding_1: 0,
            padding_2: 0,
            ratio_in_water: in_water.0,
            albedos_in_water: in_water.1,
            ratio_in_air: in_air.0,
            albedos_in_air: in_air.1,
        }
    });
    materials.collect()
}

/// Centres in the image of small lamps and of their mirror images, pixels, and ln of the range of distances about them.
fn spots(scene: &Prepared, active: &[usize], tracer: Tracer) -> Vec<(DVec2, f64)> {
    if scene.in_air(scene.camera.position_m) {
        return Vec::new();
    }
    let seen_at = |lamp: &PreparedLamp, position: DVec3| {
        let camera = &scene.camera;
        let centre = camera.project(position)?;
        let distance = position.distance(camera.position_m);
        let focal_px = camera.pixels_per_rad(position)?;
        let radius_px = lamp.radius / distance * focal_px;
        let size = DVec2::new(f64::from(camera.width), f64::from(camera.height));
        let seen = centre.cmpge(DVec2::splat(-SPOT_REACH_PX)).all()
            && centre.cmplt(size + SPOT_REACH_PX).all();
        let least_px = radius_px.max(tracer.least_spot_px(focal_px)).min(0.5);
        let octaves = (SPOT_REACH_PX / least_px).ln();
        (seen && radius_px < 0.5).then_some((centre, octaves))
    };
    let mut spots = Vec::new();
    for &i in active {
        let lamp = &scene.lamps[i];
        spots.extend(seen_at(lamp, lamp.position));
        if scene.boundary.is_some() {
            spots.extend(seen_at(lamp, scene.mirror(lamp.position)));
        }
    }
    spots
}
