//! A view of a flat target made ready: its two sources of light, and paths until the image is known well enough.

use uw_render::integrator::RenderError;
use uw_render::prepare::Prepared;
use uw_render::scene::Scene;

use super::fields::{FieldSampler, Fields};
use super::guess::{Guess, LampGuess};
use super::pyramid::TexturePyramid;
use super::radiance::{Lattice, Source};
use super::source_light::{SeenLight, SourceLight};
use super::spread::Spread;
use super::target_view::{BeyondTarget, TargetView};

/// Pixels along each edge of a patch at which standard errors are found.
const ERROR_PIXELS: usize = 8;

/// A view of a target with what the water does to it.
#[derive(Clone, Debug)]
pub struct TargetModel<'p> {
    view: TargetView,
    pyramid: &'p TexturePyramid,
    even: Guess,
    lamps: Guess,
    daylight_spread: Spread,
    lamps_spread: Spread,
    symmetric: bool,
    /// Of the walks.
    seed: u64,
}

impl<'p> TargetModel<'p> {
    /// The model of `scene`, which `prepared` was built from and which shows one quad with the texture of
    /// `pyramid`. `upright` says that the view is square to the target, so that lamp light is symmetric.
    pub fn new(
        scene: &Scene,
        prepared: &Prepared,
        pyramid: &'p TexturePyramid,
        upright: bool,
        seed: u64,
    ) -> Result<Self, BeyondTarget> {
        let view = TargetView::new(scene)?;
        let (lamps, lamp_light) = lamp_guess(scene, prepared, &view);
        let spread = |guess: &Guess, light: Option<&SourceLight>| {
            spread(scene, prepared, &view, (guess, light), pyramid, seed)
        };
        let daylight = daylight(scene, prepared);
        Ok(Self {
            daylight_spread: spread(&Guess::Even, daylight.as_ref()),
            lamps_spread: spread(&lamps, lamp_light.as_ref()),
            view,
            pyramid,
            even: Guess::Even,
            lamps,
            symmetric: upright,
            seed,
        })
    }

    /// The same water, camera and target seen from another depth; `prepared` is what the first one was made with.
    pub fn at(&self, scene: &Scene, prepared: &Prepared) -> Result<Self, BeyondTarget> {
        let view = TargetView::new(scene)?;
        // In three bands daylight is the same at all depths but for a factor.
        let daylight_spread = match daylight(scene, prepared) {
            None => self.daylight_spread.clone(),
            light => {
                let light = (&self.even, light.as_ref());
                spread(scene, prepared, &view, light, self.pyramid, self.seed)
            }
        };
        Ok(Self {
            lamps: lamp_guess(scene, prepared, &view).0,
            daylight_spread,
            view,
            ..self.clone()
        })
    }

    /// The view.
    pub fn view(&self) -> &TargetView {
        &self.view
    }

    /// Daylight.
    pub fn daylight(&self) -> Source<'_> {
        Source {
            lamps: false,
            symmetric: false,
            view: &self.view,
            pyramid: self.pyramid,
            spread: &self.daylight_spread,
            guess: &self.even,
        }
    }

    /// Lamps at 100 %.
    pub fn lamps(&self) -> Source<'_> {
        Source {
            lamps: true,
            symmetric: self.symmetric,
            spread: &self.lamps_spread,
            guess: &self.lamps,
            ..self.daylight()
        }
    }

    /// Every `step`-th pixel of the image.
    pub fn lattice(&self, step: usize) -> Lattice {
        Lattice {
            width: self.view.camera.width as usize,
            height: self.view.camera.height as usize,
            step: step.max(1),
        }
    }

    /// The lattice on which standard errors are found.
    pub fn error_lattice(&self) -> Lattice {
        let patch = (self.view.camera.width / 10).min(self.view.camera.height / 6) as usize;
        self.lattice((patch / ERROR_PIXELS).max(1))
    }
}

/// Daylight of a scene by wavelength; `None` in three bands.
fn daylight(scene: &Scene, prepared: &Prepared) -> Option<SourceLight> {
    let wavelengths = prepared.spectrum.as_ref()?;
    Some(SourceLight::daylight(scene, wavelengths))
}

/// The guess for a scene's lamps, and their light by wavelength.
fn lamp_guess(
    scene: &Scene,
    prepared: &Prepared,
    view: &TargetView,
) -> (Guess, Option<SourceLight>) {
    let guess = LampGuess::new(scene, view.normal);
    let Some(wavelengths) = &prepared.spectrum else {
        return (Guess::Lamps(guess), None);
    };
    let light = SourceLight::lamps(&guess, wavelengths);
    let (width, height) = view.size_px();
    let guess = match view.sight(width / 2.0, height / 2.0) {
        Some(centre) => guess.losing(light.lost_per_m(centre.point)),
        None => guess,
    };
    (Guess::Lamps(guess), Some(light))
}

/// What the water between camera and target does to the sight of it, in the light of one source.
fn spread(
    scene: &Scene,
    prepared: &Prepared,
    view: &TargetView,
    (guess, light): (&Guess, Option<&SourceLight>),
    pyramid: &TexturePyramid,
    seed: u64,
) -> Spread {
    match (&scene.water, &prepared.medium) {
        (Some(water), Some(medium)) => {
            Spread::new(water, &medium.phase, view, (guess, light), pyramid, seed)
        }
        _ => Spread::none(
            pyramid,
            light.map(|light| SeenLight::new(light, guess, view)),
        ),
    }
}

/// The scene with its lamps alone at 100 %. Their light hardly knows the water surface: it is left out, so that
/// one render serves all depths.
pub fn lamps_alone(scene: &Scene) -> Scene {
    let mut alone = scene.clone();
    alone.surface = None;
    alone.sun = None;
    alone.sky_radiance = [0.0; 3];
    alone.lamps.iter_mut().for_each(|l| l.level_pct = 100.0);
    alone
}

/// The scene without its lamps.
pub fn daylight_alone(scene: &Scene) -> Scene {
    Scene {
        lamps: Vec::new(),
        ..scene.clone()
    }
}

/// Fewest and most paths per group; doubled in between until the image is known well enough.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effort {
    /// Fewest paths per group.
    pub least: u32,
    /// Most paths per group.
    pub most: u32,
}

impl Effort {
    /// Takes paths of `source` in the scene `prepared` until `enough` accepts the fit or the most are taken.
    /// `go_on` is asked before each round; `None` when it says no or no fit is possible.
    ///
    /// # Errors
    /// The scene does not fit the kernels, or light is no number.
    pub fn fields(
        &self,
        source: &Source,
        prepared: &Prepared,
        seed: u64,
        go_on: &dyn Fn() -> bool,
        enough: &mut dyn FnMut(&Fields) -> bool,
    ) -> Result<Option<Fields>, RenderError> {
        let mut sampler = FieldSampler::new(source, prepared, seed)?;
        let mut samples = self.least;
        loop {
            if !go_on() {
                return Ok(None);
            }
            sampler.extend_to(samples)?;
            let Some(fields) = sampler.fit() else {
                return Ok(None);
            };
            if samples >= self.most || enough(&fields) {
                return Ok(Some(fields));
            }
            samples = (2 * samples).min(self.most);
        }
    }
}
