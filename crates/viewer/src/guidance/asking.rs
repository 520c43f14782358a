//! Questions to network, physics and daemon about the present state, where something has changed.

use std::sync::Arc;

use uw_calib::Profile;
use uw_guidance::Observation;
use uw_guidance::advice::By;
use uw_guidance::service::{other_camera, other_profile};

use super::Guidance;
use super::answer::{Answer, Question};
use super::operation::Operation;
use crate::ui::toasts::Toasts;

impl Guidance {
    /// The advice of the network, where everything for it is there and something has changed.
    pub(super) fn ask_network(&mut self) {
        let observation = self.operation_observation().or_else(|| self.observation());
        let (Some(now), Some(profile), Ok((model, _))) = (observation, &self.profile, &self.model)
        else {
            return;
        };
        let question = self.question(now, profile, Arc::as_ptr(model) as usize);
        if self.is_answered(&question) {
            return;
        }
        let other = other_camera(question.2, profile, model);
        let by = By::Network(model);
        let answer = Answer::of_library(&now, profile, by, &self.objective, question, other);
        self.answer = Some(answer);
    }

    /// The advice of physics, likewise.
    pub(super) fn ask_physics(&mut self) {
        let look = self.look_from_here().cloned();
        let (Some(now), Some(look), Some(profile)) =
            (self.observation(), look, self.profile.clone())
        else {
            return;
        };
        let ctx = self.ctx.clone();
        let wake = move || ctx.request_repaint();
        let Some(sighting) = self.sightings.of(&look, self.light_pct, wake) else {
            return;
        };
        let question = self.question(now, &profile, Arc::as_ptr(&sighting.present) as usize);
        if self.is_answered(&question) {
            return;
        }
        let other = other_profile(&profile, sighting.present.water());
        let by = sighting.by();
        let answer = Answer::of_library(&now, &profile, by, &self.objective, question, other);
        self.answer = Some(answer);
    }

    /// What an answer about `now` hangs on, by what lies at `predictor` in memory.
    fn question(&self, now: Observation, profile: &Arc<Profile>, predictor: usize) -> Question {
        let identities = [Arc::as_ptr(profile) as usize, predictor];
        (now, self.objective, self.size_px(), identities)
    }

    fn is_answered(&self, question: &Question) -> bool {
        let answer = self.answer.as_ref();
        answer.is_some_and(|answer| answer.question == Some(*question))
    }

    /// Asks the daemon about the present state.
    pub fn ask_daemon(&mut self, toasts: &mut Toasts) {
        let Some(now) = self.operation_observation().or_else(|| self.observation()) else {
            toasts.warn(
                "Look from the present place first: the daemon needs the statistics of an image",
            );
            return;
        };
        let profile = self.profile.clone();
        let size_px = self.size_px();
        let ctx = self.ctx.clone();
        self.link
            .ask(now, size_px, profile, self.objective, move || {
                ctx.request_repaint()
            });
    }

    /// Width and height of the picture that was measured, pixels; a recording does not tell them.
    fn size_px(&self) -> Option<[u32; 2]> {
        let looked = self.operation_observation().is_none();
        looked.then_some([self.vehicle.width, self.vehicle.height])
    }

    /// What the recorded vehicle knew at the step that is shown.
    pub(super) fn operation_observation(&self) -> Option<Observation> {
        self.operation.as_ref().and_then(Operation::observation)
    }
}
