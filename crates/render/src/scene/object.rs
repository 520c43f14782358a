//! Objects of a scene file: textured planes, and the placement of glTF files.

use std::collections::HashMap;
use std::path::PathBuf;

use glam::{DAffine3, DMat3, DVec2, DVec3, EulerRot};
use uw_media::spectral::Curve;

use super::range::Range;
use super::reader::Table;
use super::value::Value;
use super::{
    Gloss, Material, Quad, SceneError, Texture, TextureEncoding, TextureFilter, gltf_file,
    spectral, texture,
};

pub(super) const OBJECT_FIELDS: [&str; 10] = [
    "plane",
    "gltf",
    "reflectance",
    "emission",
    "roughness",
    "metallic",
    "refractive_index",
    "translation_m",
    "rotation_deg",
    "scale",
];
const PLANE_FIELDS: [&str; 4] = ["center_m", "normal", "up", "size_m"];
pub(super) const TEXTURE_FIELDS: [&str; 5] =
    ["texture", "encoding", "filter", "tile_m", "spectrum"];
const REFLECTANCE_EXPECTED: &str = "[r, g, b] in [0, 1] or { texture = \"file.png\" }";
/// Refractive index of a glossy surface's dielectric where none is given, as in glTF.
pub(super) const USUAL_INDEX: f64 = 1.5;
/// Smallest edge of a plane and of a texture's tile, m.
const LEAST_EDGE_M: f64 = 1e-6;
/// Sine of the smallest angle between a plane's normal and its up direction.
const PARALLEL_SINE: f64 = 1e-9;

/// What the objects of a scene bring with them.
#[derive(Default)]
pub(super) struct Objects {
    pub(super) quads: Vec<Quad>,
    pub(super) materials: Vec<Material>,
    pub(super) textures: Vec<Texture>,
    pub(super) gltf: gltf_file::Contents,
    /// Textures that have been read, so that objects share them.
    read: HashMap<(PathBuf, TextureEncoding, TextureFilter), usize>,
}

/// Reads all `[[object]]` tables.
pub(super) fn read_objects(root: &Table<'_>) -> Result<Objects, SceneError> {
    let mut objects = Objects::default();
    for element in root.elements("object")? {
        let table = element.as_table(&OBJECT_FIELDS)?;
        match (table.optional("plane"), table.optional("gltf")) {
            (Some(plane), None) => objects.add_plane(&table, &plane)?,
            (None, Some(gltf)) => objects.add_gltf(&table, &gltf)?,
            (Some(_), Some(gltf)) => {
                return Err(gltf.invalid("left out where the object is a plane"));
            }
            (None, None) => return Err(table.missing("plane", "or gltf = \"file.glb\"")),
        }
    }
    Ok(objects)
}

impl Objects {
    fn add_plane(&mut self, table: &Table<'_>, plane: &Value<'_>) -> Result<(), SceneError> {
        for field in ["translation_m", "rotation_deg", "scale"] {
            table.refuse(
                field,
                "for a plane, which is placed by center_m, normal and up",
            )?;
        }
        let mut quad = read_plane(plane)?;
        let reflectance = table.required("reflectance", REFLECTANCE_EXPECTED)?;
        let none = Ok([0.0; 3]);
        let emission = table.optional("emission").map_or(none, |emission| {
            emission.as_numbers(Range::non_negative("W/(m² sr)"))
        })?;
        let mut material = Material {
            reflectance: [1.0; 3],
            emission,
            gloss: read_gloss(table)?,
            ..Material::default()
        };
        if reflectance.is_table() {
            let texture = reflectance.as_table(&TEXTURE_FIELDS)?;
            if let Some(spectrum) = texture.optional("spectrum") {
                for field in &TEXTURE_FIELDS[..4] {
                    texture.refuse(field, "where the reflectance is a spectrum")?;
                }
                material.spectrum = Some(spectral::read_reflectance(&spectrum)?);
            } else {
                if let Some(tile_m) = texture.optional("tile_m") {
                    quad.tile_m =
                        DVec2::from_array(tile_m.as_numbers(Range::at_least(LEAST_EDGE_M, "m"))?);
                }
                material.texture = Some(self.add_texture(&texture)?);
            }
        } else if reflectance.is_array() {
            material.reflectance = reflectance.as_numbers(Range::closed(0.0, 1.0, ""))?;
        } else {
            return Err(reflectance.invalid(REFLECTANCE_EXPECTED));
        }
        quad.material = self.materials.len();
        self.materials.push(material);
        self.quads.push(quad);
        Ok(())
    }

    fn add_texture(&mut self, table: &Table<'_>) -> Result<usize, SceneError> {
        let encodings = [
            ("linear", TextureEncoding::Linear),
            ("srgb", TextureEncoding::Srgb),
        ];
        let filters = [
            ("bilinear", TextureFilter::Bilinear),
            ("nearest", TextureFilter::Nearest),
        ];
        let encoding = table
            .optional("encoding")
            .map_or(Ok(TextureEncoding::Srgb), |word| word.as_choice(&encodings))?;
        let filter = table
            .optional("filter")
            .map_or(Ok(TextureFilter::Bilinear), |word| word.as_choice(&filters))?;
        let file = table.required("texture", "the path of a PNG, JPEG or TIFF file")?;
        let path = file.as_path()?;
        let key = (path, encoding, filter);
        if let Some(&index) = self.read.get(&key) {
            return Ok(index);
        }
        let room = texture::room_beside(&self.textures);
        let texture = Texture::read_within(&key.0, encoding, filter, room)
            .map_err(|reason| file.unusable_file(&key.0, reason))?;
        self.textures.push(texture);
        self.read.insert(key, self.textures.len() - 1);
        Ok(self.textures.len() - 1)
    }

    fn add_gltf(&mut self, table: &Table<'_>, gltf: &Value<'_>) -> Result<(), SceneError> {
        for field in ["emission", "roughness", "metallic", "refractive_index"] {
            table.refuse(field, "for a glTF object, whose file holds its materials")?;
        }
        let spectrum = read_own_spectrum(table)?;
        let path = gltf.as_path()?;
        let placement = read_placement(table)?;
        let first = self.materials.len();
        let (materials, textures) = (&mut self.materials, &mut self.textures);
        let read = gltf_file::read_into(&path, placement, &mut self.gltf, materials, textures);
        read.map_err(|source| SceneError::Gltf {
            file: gltf.doc.file.to_string(),
            line: gltf.line(),
            field: gltf.path.clone(),
            source: Box::new(source),
        })?;
        if let Some(spectrum) = spectrum {
            for material in &mut self.materials[first..] {
                material.texture = None;
                material.spectrum = Some(spectrum.clone());
            }
        }
        Ok(())
    }
}

/// How a plane shines; `None` where it is Lambertian.
fn read_gloss(table: &Table<'_>) -> Result<Option<Gloss>, SceneError> {
    let Some(roughness) = table.optional("roughness") else {
        for field in ["metallic", "refractive_index"] {
            table.refuse(field, "without roughness")?;
        }
        return Ok(None);
    };
    let number = |field, usual, range| {
        table
            .optional(field)
            .map_or(Ok(usual), |value| value.as_number(range))
    };
    Ok(Some(Gloss {
        roughness: roughness.as_number(Range::closed(0.0, 1.0, ""))?,
        metallic: number("metallic", 0.0, Range::closed(0.0, 1.0, ""))?,
        index: number("refractive_index", USUAL_INDEX, Range::closed(1.0, 4.0, ""))?,
        texture: None,
    }))
}

/// The spectrum that takes the place of the reflectances in a glTF file; `None` where they count.
fn read_own_spectrum(table: &Table<'_>) -> Result<Option<Curve>, SceneError> {
    const EXPECTED: &str =
        "{ spectrum = \"file.csv\" } for a glTF object, whose file holds its colours and textures";
    let Some(reflectance) = table.optional("reflectance") else {
        return Ok(None);
    };
    if !reflectance.is_table() {
        return Err(reflectance.invalid(EXPECTED));
    }
    let given = reflectance.as_table(&["spectrum"])?;
    let spectrum = given.required(
        "spectrum",
        "the path of a CSV file with wavelength_nm,reflectance",
    )?;
    spectral::read_reflectance(&spectrum).map(Some)
}

/// A plane with a tile as large as itself; its material is filled in by the caller.
fn read_plane(value: &Value<'_>) -> Result<Quad, SceneError> {
    let table = value.as_table(&PLANE_FIELDS)?;
    let normal = table.direction("normal")?;
    let up = table
        .optional("up")
        .map_or(Ok(DVec3::Z), |up| up.as_direction())?;
    let right = up.cross(normal);
    if right.length() < PARALLEL_SINE {
        return Err(match table.optional("up") {
            Some(up) => up.invalid("a direction not parallel to the plane's normal"),
            None => table.missing("up", "a direction not parallel to the plane's normal"),
        });
    }
    let right = right.normalize();
    let size_m = DVec2::from_array(table.numbers("size_m", Range::at_least(LEAST_EDGE_M, "m"))?);
    Ok(Quad {
        centre_m: table.vector("center_m")?,
        half_u: right * (size_m.x / 2.0),
        half_v: normal.cross(right) * (size_m.y / 2.0),
        normal,
        tile_m: size_m,
        material: 0,
    })
}

/// Scale, then rotation about x, y, z in this order (R = Rz·Ry·Rx), then translation.
fn read_placement(table: &Table<'_>) -> Result<DAffine3, SceneError> {
    let translation = match table.optional("translation_m") {
        Some(_) => table.vector("translation_m")?,
        None => DVec3::ZERO,
    };
    let none = Ok([0.0; 3]);
    let angles = table
        .optional("rotation_deg")
        .map_or(none, |angles| angles.as_numbers(Range::finite("degrees")))?;
    let [x, y, z] = angles.map(f64::to_radians);
    let positive = Range::positive("");
    let scale = match table.optional("scale") {
        Some(scale) if scale.is_array() => DVec3::from_array(scale.as_numbers(positive)?),
        Some(scale) => DVec3::splat(scale.as_number(positive)?),
        None => DVec3::ONE,
    };
    let rotation = DMat3::from_euler(EulerRot::ZYX, z, y, x);
    Ok(DAffine3::from_mat3_translation(
        rotation * DMat3::from_diagonal(scale),
        translation,
    ))
}

impl Quad {
    /// Texture coordinates of the point `centre_m + local[0]·half_u + local[1]·half_v`: (0, 0) at the upper left
    /// corner as seen from the front, u to the right, v downwards, one unit per tile.
    #[inline]
    pub fn texture_coordinates(&self, local: [f64; 2]) -> DVec2 {
        let edge_m = DVec2::new(self.half_u.length(), self.half_v.length());
        DVec2::new(1.0 + local[0], 1.0 - local[1]) * edge_m / self.tile_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;
    use std::path::Path;

    fn quad(text: &str) -> Quad {
        let camera = "[camera]\nposition_m = [0, 0, 0]\nforward = [1, 0, 0]\nhfov_deg = 60\nwidth = 4\nheight = 3\n";
        let text = format!(
            "format = \"uw-scene/1\"\n{camera}[[object]]\nreflectance = [1, 1, 1]\n{text}\n"
        );
        Scene::parse(&text, Path::new(""), "test")
            .expect("valid")
            .quads[0]
    }

    #[test]
    fn a_wall_has_its_texture_upright_as_seen_from_the_front() {
        // The reference scenes' wall: seen along +x, u runs to the right as (4 - y) / 2 tiles of 2 m and
        // v downwards from the upper edge at z = 4 m.
        let wall = quad(
            "plane = { center_m = [2, 0, 0], normal = [-3, 0, 0], up = [0, 0, 1], size_m = [8, 8] }",
        );
        let wall = Quad {
            tile_m: DVec2::splat(2.0),
            ..wall
        };
        assert!((wall.normal + DVec3::X).length() < 1e-15);
        for local in [[-1.0, 1.0], [1.0, -1.0], [0.3, 0.9], [0.0, 0.0]] {
            let point = wall.centre_m + wall.half_u * local[0] + wall.half_v * local[1];
            let expected = DVec2::new((4.0 - point.y) / 2.0, (4.0 - point.z) / 2.0);
            assert!(
                (wall.texture_coordinates(local) - expected).length() < 1e-14,
                "{local:?}"
            );
        }
    }

    #[test]
    fn up_is_made_perpendicular_and_edges_keep_their_length() {
        // A floor seen from above with north up: right is east.
        let floor = quad(
            "plane = { center_m = [0, 0, 0], normal = [0, 0, 1], up = [0, 2, 5], size_m = [6, 4] }",
        );
        assert!((floor.half_u - DVec3::new(3.0, 0.0, 0.0)).length() < 1e-14);
        assert!((floor.half_v - DVec3::new(0.0, 2.0, 0.0)).length() < 1e-14);
        assert!((floor.texture_coordinates([1.0, -1.0]) - DVec2::ONE).length() < 1e-15);
    }
}
