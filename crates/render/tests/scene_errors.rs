//! Every hostile scene in `tests/bad` is refused with a message that names file, line, field and value.

use std::fs;
use std::path::{Path, PathBuf};

use uw_render::scene::Scene;

/// Scene file, and how its message goes on after the file's name. What the system or a decoder says at
/// the end of some is left out; the folder is left out of paths.
#[rustfmt::skip]
const CASES: &[(&str, &str)] = &[
    ("broken_texture.toml", r#":5: object 1 reflectance.texture: broken_texture.png:"#),
    ("camera_without_width.toml", r#":5: camera lacks the required field `width` (pixels)"#),
    ("distortion_of_six.toml", r#":9: camera.distortion must be an array of 5 numbers (k1, k2, p1, p2, k3) or 8 (and k4, k5, k6), got [0.1, 0, 0, 0, 0, 0.2]"#),
    ("empty_water.toml", r#":3: water lacks the required field `jerlov` (a Jerlov water type, or a and b in 1/m)"#),
    ("fisheye_and_distortion.toml", r#":9: camera.distortion must be left out where camera.fisheye is given, got [0.1, 0.0, 0.0, 0.0, 0.0]"#),
    ("fisheye_field.toml", r#":7: camera.hfov_deg must be a field of view up to which camera.fisheye is one-to-one, in degrees, got 200.0"#),
    ("fisheye_five.toml", r#":8: camera.fisheye must be an array of 4 numbers, got [0.1, 0.0, 0.0, 0.0, 0.0]"#),
    ("fisheye_folding.toml", r#":8: camera.fisheye must be k1, k2, k3, k4 of a lens that sees less than 180° off its axis and is one-to-one over the image, got [-0.5, 0.0, 0.0, 0.0]"#),
    ("fisheye_snow.toml", r#":11: camera.fisheye must be left out where there is [water.snow], which is not seen 90° off the optical axis and beyond, got [0.0, 0.0, 0.0, 0.0]"#),
    ("folding_distortion.toml", r#":9: camera.distortion must be k1, k2, p1, p2, k3 (and k4, k5, k6) of a distortion that is one-to-one over the image, got [-3.0, 0, 0, 0, 0]"#),
    ("fractional_width.toml", r#":9: camera.width must be a whole number in [1, 16384] pixels, got 32.5"#),
    ("gloss_index.toml", r#":7: object 1 refractive_index must be in [1, 4], got 0.9"#),
    ("gloss_metallic_alone.toml", r#":6: object 1 metallic must be left out without roughness, got 0.5"#),
    ("gloss_roughness.toml", r#":6: object 1 roughness must be in [0, 1], got 1.5"#),
    ("gltf_accessor_beyond_buffer.toml", r#":4: object 1 gltf: gltf_accessor_beyond_buffer.gltf: mesh 0 (hull) primitive 0 POSITION (accessor 0): 9 elements must not reach beyond buffer view 0 of 36 bytes"#),
    ("gltf_camera_without_lens.toml", r#":4: object 1 gltf: gltf_camera_without_lens.gltf: camera 0: lacks the required field `perspective`"#),
    ("gltf_cycle.toml", r#":4: object 1 gltf: gltf_cycle.gltf: not a valid glTF 2.0 file: nodes[0] must not be inside itself"#),
    ("gltf_five_indices.toml", r#":4: object 1 gltf: gltf_five_indices.gltf: mesh 0 (hull) primitive 0 number of indices must be a multiple of 3, got 5"#),
    ("gltf_header_length.toml", r#":4: object 1 gltf: gltf_header_length.glb: not a valid glTF 2.0 file: its header states 3 bytes, the file has 32"#),
    ("gltf_huge_count.toml", r#":4: object 1 gltf: gltf_huge_count.gltf: mesh 0 (hull) primitive 0 POSITION (accessor 0): must have at most 268435456 elements, got 4611686018427387904"#),
    ("gltf_image_without_type.toml", r#":4: object 1 gltf: gltf_image_without_type.gltf: image 0: The image format could not be determined"#),
    ("gltf_index_out_of_range.toml", r#":4: object 1 gltf: gltf_index_out_of_range.gltf: mesh 0 (hull) primitive 0 index 5 must be a whole number below 3, the number of vertices, got 7"#),
    ("gltf_missing.toml", r#":4: object 1 gltf: no_such_hull.glb: cannot be read:"#),
    ("gltf_missing_buffer.toml", r#":4: object 1 gltf: gltf_missing_buffer.gltf: buffer 0 (no_such_buffer.bin):"#),
    ("gltf_missing_image.toml", r#":4: object 1 gltf: gltf_missing_image.gltf: image 0 (no_such_image.png):"#),
    ("gltf_missing_mesh.toml", r#":4: object 1 gltf: gltf_missing_mesh.gltf: not a valid glTF 2.0 file: nodes[0].mesh must be an index below 1 (meshes), got 3"#),
    ("gltf_nan_vertex.toml", r#":4: object 1 gltf: gltf_nan_vertex.gltf: mesh 0 (hull) primitive 0 POSITION 1 must be finite, got [1.0, NaN, 0.0]"#),
    ("gltf_not_json.toml", r#":4: object 1 gltf: gltf_not_json.gltf: not a valid glTF 2.0 file: EOF while parsing a value at line 2 column 0"#),
    ("gltf_reflectance.toml", r#":5: object 1 reflectance must be { spectrum = "file.csv" } for a glTF object, whose file holds its colours and textures, got [1, 1, 1]"#),
    ("gltf_required_extension.toml", r#":4: object 1 gltf: gltf_required_extension.gltf: extensionsRequired[0] must be an extension that is honoured or can be left aside; export the file without it, got "KHR_draco_mesh_compression""#),
    ("gltf_roughness.toml", r#":5: object 1 roughness must be left out for a glTF object, whose file holds its materials, got 0.5"#),
    ("gltf_scale.toml", r#":5: object 1 scale must be > 0, got -1.0"#),
    ("gltf_spot_angles.toml", r#":4: object 1 gltf: gltf_spot_angles.gltf: light 0 (beam) cone angles [inner, outer] must be 0 <= inner <= outer <= pi radians, outer > 0, got [0.9, 0.3]"#),
    ("gltf_truncated.toml", r#":4: object 1 gltf: gltf_truncated.glb: not a valid glTF 2.0 file: its header states 604 bytes, the file has 584"#),
    ("huge_image.toml", r#":9: camera.width must be at most 4096 for this height (67108864 pixels in all), got 16384"#),
    ("huge_number.toml", r#":4: surface.height_m must be at most 1e12 in magnitude, got 1e300"#),
    ("infinite_coefficient.toml", r#":5: water.b must be a finite number >= 0 1/m, got inf"#),
    ("jerlov_and_a.toml", r#":5: water.a must be left out where water.jerlov is given, got [0.35, 0.06, 0.025]"#),
    ("jerlov_profile_beside.toml", r#":10: water.jerlov must be left out where water.jerlov_profile is given, got "II""#),
    ("jerlov_profile_case.toml", r#":10: water.jerlov_profile must be one of I IA IB II III 1C 3C 5C 7C 9C, got "3c" (did you mean "3C"?)"#),
    ("jerlov_profile_measured.toml", r#":11: water.bands must be bands "measured" do not cover Jerlov type I; covered: IB II III 1C 3C 5C, got "spectral-measured""#),
    ("jerlov_profile_no_surface.toml", r#":9: water.jerlov_profile must be left out without [surface], from which depths are counted, got "3C""#),
    ("jerlov_profile_number.toml", r#":10: water.jerlov_profile must be text in quotes, got 3"#),
    ("lamp_across_surface.toml", r#":13: lamp 1 position_m[2] must be at least 1.3 or at most surface.height_m = 1: a disk above the water does not reach into it, got 1.2"#),
    ("lamp_beam.toml", r#":8: lamp 1 falloff.file: lamp_beam.csv: line 4: the angle must rise from row to row within [0, 180] degrees, got 10"#),
    ("lamp_beam_missing.toml", r#":8: lamp 1 falloff.file: no_such_beam.csv:"#),
    ("lamp_falloff.toml", r#":8: lamp 1 falloff must be one of `uniform`, `cosine`, got "gauss""#),
    ("lamp_half_angle.toml", r#":8: lamp 1 half_angle_deg must be in (0, 180] degrees, got 0.0"#),
    ("lamp_level.toml", r#":8: lamp 1 level_pct must be in [0, 100] %, got 120"#),
    ("lamp_name.toml", r#":4: lamp 1 name must be 1 to 64 letters, digits, `_` or `-`, got "left, upper""#),
    ("lamp_names.toml", r#":10: lamp 2 name must be a name that no other lamp has, got "left""#),
    ("missing_texture.toml", r#":5: object 1 reflectance.texture: no_such_texture.png:"#),
    ("nan_coefficient.toml", r#":4: water.a must be a finite number >= 0 1/m, got nan"#),
    ("negative_coefficient.toml", r#":7: water.b must be >= 0 1/m, got -0.2"#),
    ("negative_height.toml", r#":10: camera.height must be a whole number in [1, 16384] pixels, got -18"#),
    ("no_camera.toml", r#":1: the scene file lacks the required field `camera` (a table, or a glTF object that holds a camera)"#),
    ("no_format.toml", r#":1: the scene file lacks the required field `format` ("uw-scene/1")"#),
    ("object_of_nothing.toml", r#":3: object 1 lacks the required field `plane` (or gltf = "file.glb")"#),
    ("object_table.toml", r#":3: object must be an array of tables, got [object]"#),
    ("opening_focus_in_port.toml", r#":11: camera.focus_m must be more than 0.065 m, where the outer side of camera.port is, got 0.06"#),
    ("opening_too_wide.toml", r#":10: camera.aperture_mm must be at most 80 mm: the lens is behind the port and on one side of the water surface, got 90"#),
    ("parallel_up.toml", r#":8: camera.up must be a direction not parallel to camera.forward, got [-2.0, 0.0, 0.0]"#),
    ("phase_backscatter.toml", r#":6: water.phase.backscatter_fraction must be in (0, 0.5), got 0.6"#),
    ("phase_foreign_field.toml", r#":6: water.phase.mu must be left out for the model "henyey-greenstein", got 3.5"#),
    ("phase_nested_g.toml", r#":16: water.phase.parts 2 phase.g must be in (-1, 1), got 1.5"#),
    ("phase_table_row.toml", r#":6: water.phase.file: phase_table_row.csv: line 3: the value must be finite and >= 0, got -1"#),
    ("plane_size.toml", r#":4: object 1 plane.size_m must be >= 0.000001 m, got 0"#),
    ("plane_up.toml", r#":4: object 1 plane.up must be a direction not parallel to the plane's normal, got [0, 0, 1]"#),
    ("plane_without_reflectance.toml", r#":3: object 1 lacks the required field `reflectance` ([r, g, b] in [0, 1] or { texture = "file.png" })"#),
    ("plume_thin.toml", r#":13: water.plume 1 sigma_m must be >= 0.001 m, got 0.0"#),
    ("port_distance.toml", r#":8: camera.port.distance_m must be >= 0.0001 m, got 0.0"#),
    ("port_dry.toml", r#":8: camera.port must be left out where there is no [water] before it, got { kind = "flat", distance_m = 0.02, thickness_m = 0.01 }"#),
    ("port_flat_wide.toml", r#":9: camera.port must be a dome, where the image reaches 90° off the optical axis: a flat port is seen below that alone, got { kind = "flat", distance_m = 0.02, thickness_m = 0.01 }"#),
    ("port_foreign_field.toml", r#":8: unknown field `radius_m` in camera.port; known fields are `kind`, `distance_m`, `thickness_m`, `glass_index`"#),
    ("port_glass.toml", r#":8: camera.port.glass_index must be in [1, 3], got 0.9"#),
    ("port_kind.toml", r#":8: camera.port.kind must be one of `flat`, `dome`, got "cylinder""#),
    ("port_offset.toml", r#":8: camera.port.offset_m must be at most 0.0475 m long (0.95 of radius_m): the camera is inside the dome, got 0.05"#),
    ("port_snow.toml", r#":11: camera.port must be left out where there is [water.snow], which is not seen through ports, got {"#),
    ("port_thickness.toml", r#":8: camera.port.thickness_m must be >= 0 m, got -0.01"#),
    ("profile_above.toml", r#":11: water.profile 1 depth_m must be >= 0 m, got -1.0"#),
    ("profile_beside.toml", r#":10: water.jerlov must be left out where water.profile is given, whose entries hold it, got "II""#),
    ("profile_empty.toml", r#":10: water.profile must be 1 to 64 entries, got 0"#),
    ("profile_mixed.toml", r#":12: water.profile 2 must be by wavelength as the entries before it (jerlov or spectrum), or in three numbers as they are (a and b, or jerlov with water.bands = "mean"), got"#),
    ("profile_negative.toml", r#":12: water.profile 2 b must be >= 0 1/m, got -0.1"#),
    ("profile_no_surface.toml", r#":9: water.profile must be left out without [surface], from which depths are counted, got"#),
    ("profile_three.toml", r#":13: water.profile 3 depth_m must be more than 1 m, at which two entries make a jump already, got 1.0"#),
    ("profile_unsorted.toml", r#":12: water.profile 2 depth_m must be at least 2 m, the depth of the entry before it, got 1.0"#),
    ("reflectance_above_one.toml", r#":5: object 1 reflectance must be in [0, 1], got 1.5"#),
    ("refractive_index.toml", r#":6: water.refractive_index must be in [1, 2], got 0.9"#),
    ("render_samples.toml", r#":4: render.samples_per_pixel must be a whole number in [1, 1073741824], got 0"#),
    ("repeated_field.toml", r#":5: not valid TOML: duplicate key at `radiance`"#),
    ("sensor_bits.toml", r#":4: sensor.bits must be 8 or 16, got 12"#),
    ("sensor_curve.toml", r#":4: sensor.encoding.curve must be a list of [counts, light], 8-bit counts and light, both rising (counts and light of a curve must rise from point to point, got [20, 0.1] after [10, 0.2]), got [[10, 0.2], [20, 0.1]]"#),
    ("sensor_curve_points.toml", r#":4: sensor.encoding.curve 1 must be a list of [counts, light], 8-bit counts and light, both rising, got 10"#),
    ("sensor_exposure.toml", r#":4: sensor.exposure.auto_mean must be in (0, 1], got 1.5"#),
    ("sensor_noise.toml", r#":4: sensor.noise.a must be >= 0, got -1e-3"#),
    ("sensor_vignetting.toml", r#":4: sensor.vignetting must be k1, k2, k3 of which 1 + k1 r^2 + k2 r^4 + k3 r^6 is from 0.05 to 1.5 for r from 0 to 1, got [-1.0, 0.0, 0.0]"#),
    ("sky_negative.toml", r#":4: sky.radiance must be >= 0 W/(m² sr), got -0.1"#),
    ("snow_diameter.toml", r#":13: water.snow.diameter_mm must be [smallest, largest] diameter in mm, got [5.0, 0.3]"#),
    ("snow_exposure.toml", r#":8: camera.exposure_s must be in [0, 3600] s, got -0.01"#),
    ("snow_field.toml", r#":13: unknown field `per_liter` in water.snow; did you mean `per_litre`?"#),
    ("snow_no_focus.toml", r#":2: camera lacks the required field `focus_m` (the distance along the optical axis that is in focus, where camera.aperture_mm is above 0)"#),
    ("snow_per_litre.toml", r#":13: water.snow.per_litre must be in [0.000001, 1000000] flakes, got 0"#),
    ("snow_seed.toml", r#":13: water.snow.seed must be a whole number in [0, 4294967295], got -1"#),
    ("snow_share.toml", r#":13: water.snow.share must be in [0, 1], got 1.5"#),
    ("sun_on_horizon.toml", r#":4: sun.zenith_deg must be in [0, 90) degrees, got 90.0"#),
    ("syntax.toml", r#":3: not valid TOML: unclosed table, expected `]`"#),
    ("texture_encoding.toml", r#":5: object 1 reflectance.encoding must be one of `linear`, `srgb`, got "gamma""#),
    ("two_coefficients.toml", r#":4: water.a must be an array of 3 numbers >= 0 1/m, got [0.35, 0.06]"#),
    ("two_focal_lengths.toml", r#":9: camera.fx must be left out where camera.hfov_deg is given, got 300.0"#),
    ("unknown_bands.toml", r#":5: water.bands must be one of mean, paper-printed, measured, camera:canon5d2, camera:nikon_d5100, camera:imx219, or three intervals in nm such as 600-700,500-600,400-500; or by wavelength spectral, spectral-measured, got "median""#),
    ("unknown_field.toml", r#":9: unknown field `refelctance` in object 2; did you mean `reflectance`?"#),
    ("unknown_field_in_plane.toml", r#":4: unknown field `centre_m` in object 1 plane; did you mean `center_m`?"#),
    ("unknown_jerlov.toml", r#":4: water.jerlov must be one of I IA IB II III 1C 3C 5C 7C 9C, got "4C""#),
    ("unknown_phase.toml", r#":6: water.phase.model must be one of `fournier-forand`, `henyey-greenstein`, `rayleigh`, `petzold`, `draine`, `isotropic`, `table`, `mix`, got "fournier-forland""#),
    ("unknown_section.toml", r#":3: unknown field `watter` in the scene file; did you mean `water`?"#),
    ("vertical_without_up.toml", r#":7: camera.forward must be a direction that is not vertical, where camera.up is left out, got [0.0, 0.0, -1.0]"#),
    ("wide_field.toml", r#":8: camera.hfov_deg must be in [0.000001, 180) degrees, got 180.0"#),
    ("wrong_format.toml", r#":1: format must be `uw-scene/1`, got "uw-scene/9""#),
    ("wrong_type.toml", r#":3: water must be a table with the fields `jerlov`, `bands`, `spectrum`, `profile`, `jerlov_profile`, `plume`, `snow`, `fitted`, `a`, `b`, `phase`, `refractive_index`, got "clear""#),
    ("zero_forward.toml", r#":7: camera.forward must be a direction of non-zero length, got [0.0, 0.0, 0.0]"#),
    ("zero_size_image.toml", r#":9: camera.width must be a whole number in [1, 16384] pixels, got 0"#),
];

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/bad")
}

#[test]
fn each_bad_scene_gets_its_message() {
    let prefix = format!("{}/", folder().display());
    for (name, expected) in CASES {
        let message = match Scene::read(&folder().join(name)) {
            Ok(_) => panic!("{name} was accepted"),
            Err(error) => error.to_string().replace(&prefix, ""),
        };
        let expected = format!("{name}{expected}");
        assert!(
            message.starts_with(&expected),
            "must start with\n{expected}\ngot\n{message}"
        );
        assert!(!message.contains('\n'), "one line: {message}");
    }
}

#[test]
fn every_bad_scene_is_in_the_list() {
    let mut files: Vec<String> = fs::read_dir(folder())
        .expect("folder")
        .map(|entry| {
            entry
                .expect("entry")
                .file_name()
                .to_string_lossy()
                .into_owned()
        })
        .filter(|name| name.ends_with(".toml"))
        .collect();
    files.sort();
    let listed: Vec<&str> = CASES.iter().map(|(name, _)| *name).collect();
    assert_eq!(files, listed);
}
