//! Lamps from what their maker's data sheet says.

use std::path::Path;

use uw_render::scene::{Falloff, Scene, SceneError};

use super::scene_text::inline;
use super::{LampSettings, LightSpectrum, ResponseSettings};

/// White light-emitting diodes by their colour temperature, K.
const WHITE: [(f64, &str); 5] = [
    (2700.0, "led-2700k"),
    (3000.0, "led-3000k"),
    (4100.0, "led-4100k"),
    (5000.0, "led-5000k"),
    (6600.0, "led-6600k"),
];

/// What a data sheet says of a lamp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DataSheet {
    /// Luminous flux, lm.
    pub flux_lm: f64,
    /// Colour temperature, K.
    pub temperature_k: f64,
    /// Beam angle under water, degrees from edge to edge.
    pub beam_angle_deg: f64,
}

impl Default for DataSheet {
    fn default() -> Self {
        Self {
            flux_lm: 1500.0,
            temperature_k: 5000.0,
            beam_angle_deg: 120.0,
        }
    }
}

impl DataSheet {
    /// The spectrum that comes nearest, by the reciprocal of the temperature, in which equal steps look alike.
    pub fn spectrum(&self) -> &'static str {
        let off = |(temperature_k, _): &(f64, &str)| {
            (1.0 / temperature_k - 1.0 / self.temperature_k).abs()
        };
        let nearest = WHITE.iter().min_by(|a, b| off(a).total_cmp(&off(b)));
        nearest.map_or(WHITE[0].1, |(_, name)| name)
    }

    /// Gives a lamp the light of the sheet: an intensity that falls with the cosine and ends at half the beam angle, as a scene
    /// file's `power_lm` makes it. `response` is the camera's, whose files are found from `folder`.
    ///
    /// # Errors
    /// A number out of its range.
    pub fn set(
        &self,
        lamp: &mut LampSettings,
        response: &ResponseSettings,
        folder: &Path,
    ) -> Result<(), SceneError> {
        let (flux_lm, half_angle_deg) = (self.flux_lm, 0.5 * self.beam_angle_deg);
        let entry = response.entry.as_ref();
        let response = entry.map_or(String::new(), |e| format!("response = {}\n", inline(e)));
        let name = self.spectrum();
        let text = format!(
            "format = \"uw-scene/1\"\n[camera]\nposition_m = [0.0, 0.0, 0.0]\nforward = [1.0, 0.0, 0.0]\nhfov_deg = 60.0\n\
             width = 16\nheight = 16\n{response}[[lamp]]\nposition_m = [0.0, 0.0, 0.0]\nforward = [1.0, 0.0, 0.0]\n\
             power_lm = {flux_lm:?}\nhalf_angle_deg = {half_angle_deg:?}\nfalloff = \"cosine\"\nspectrum = \"{name}\"\n"
        );
        let scene = Scene::parse(&text, folder, "data sheet")?;
        for sheet in &scene.lamps {
            lamp.intensity = sheet.intensity;
            lamp.half_angle_deg = half_angle_deg;
            lamp.falloff = Falloff::Cosine;
            lamp.beam_file = None;
            lamp.spectrum = LightSpectrum::named(name);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::{OpenScene, open_scene::lamp_beside};
    use super::*;

    /// docs/howto/lamp.md: 1500 lm at 5000 K over 120° are 0.649 W/sr in a channel on average, [0.51, 0.91, 0.54] by the spectrum.
    #[test]
    fn a_sheet_gives_the_intensity_of_its_lumens() {
        let (_, settings) = OpenScene::fallback().expect("valid");
        let mut lamp = lamp_beside(&settings);
        let sheet = DataSheet::default();
        let set = sheet.set(&mut lamp, &settings.response, Path::new(""));
        set.expect("within its range");
        let mean = lamp.intensity.iter().sum::<f64>() / 3.0;
        assert!((mean / 0.649 - 1.0).abs() < 0.01, "{:?}", lamp.intensity);
        for (got, want) in lamp.intensity.into_iter().zip([0.51, 0.91, 0.54]) {
            assert!((got - want).abs() < 0.01, "{:?}", lamp.intensity);
        }
        assert_eq!(
            (lamp.half_angle_deg, &lamp.falloff),
            (60.0, &Falloff::Cosine)
        );
        let wide = DataSheet {
            beam_angle_deg: 720.0,
            ..sheet
        };
        let before = lamp.clone();
        let refused = wide.set(&mut lamp, &settings.response, Path::new(""));
        let said = refused.expect_err("too wide").to_string();
        assert!(said.contains("half_angle_deg"), "{said}");
        assert_eq!(lamp, before);
    }

    #[test]
    fn the_nearest_white_is_taken() {
        for (temperature_k, name) in [
            (1800.0, "led-2700k"),
            (3000.0, "led-3000k"),
            (4000.0, "led-4100k"),
            (5600.0, "led-5000k"),
            (10_000.0, "led-6600k"),
        ] {
            let sheet = DataSheet {
                temperature_k,
                ..DataSheet::default()
            };
            assert_eq!(sheet.spectrum(), name);
        }
    }
}
