//! One connection's view of the service.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use serde_json::{Value, json};
use uw_calib::Profile;
use uw_calib::json::Object;
use uw_calib::picture::Counts;

use crate::advice::{doubt_by, predict_by};
use crate::checks::Strictness;
use crate::features::Candidate;
use crate::feed::Picture;
use crate::objective::Objective;
use crate::physics::{Present, TakenPicture, Water};
use crate::service::album::Album;
use crate::service::lamps::{read_level, tell_level};
use crate::service::resolve::{Known, Unknown, age_s, distance_m, resolve, update};
use crate::service::subscription::{self, Subscription, steering_with};
use crate::service::suggestion::{self, Hold, Predicting, usable};
use crate::service::{Basis, Moment, Service, Snapshot, describe, image};
use crate::wire::frame::MAX_LINE_BYTES;
use crate::wire::inputs::Inputs;
use crate::wire::reply::{self, Code, Fields, WireError};
use crate::wire::request::{Op, Request};

/// One connection: it may have a profile of its own and a subscription.
#[derive(Clone, Debug)]
pub struct Session {
    service: Arc<Service>,
    profile: Option<Arc<Profile>>,
    subscription: Option<Subscription>,
    authorised: bool,
    /// Shared with a copy that answers off the sockets' threads.
    album: Arc<Mutex<Album>>,
}

/// A request that is read but not yet answered.
#[derive(Debug)]
pub struct Pending {
    request: Request,
    received: Instant,
    measured: Option<Picture>,
}

impl Pending {
    /// With the statistics of its image known already, as in a recording.
    pub fn with_picture(mut self, picture: Picture) -> Self {
        self.measured = Some(picture);
        self
    }

    /// Its operation's name, or `invalid`.
    pub fn op(&self) -> &'static str {
        self.request.op.as_ref().map_or("invalid", Op::name)
    }

    /// Whether answering takes long enough (reading and decoding an image) to keep it off the threads
    /// that serve the sockets.
    pub fn is_slow(&self) -> bool {
        matches!(self.request.op, Ok(Op::SuggestImage { .. }))
    }
}

/// An answer that is not yet a line.
#[derive(Debug)]
pub struct Answered {
    /// Its place among all uses of the shared state.
    pub sequence: u64,
    /// The operation's name, or `invalid`.
    pub op: &'static str,
    id: Value,
    fields: Result<Fields, WireError>,
}

impl Answered {
    /// Whether it is an error object.
    pub fn is_error(&self) -> bool {
        self.fields.is_err()
    }

    /// Whether the line was none of this protocol: too long, no text, or no JSON object.
    pub fn is_no_object(&self) -> bool {
        use Code::{BadJson, BadUtf8, LineTooLong};
        matches!(&self.fields, Err(error) if matches!(error.code, BadUtf8 | BadJson | LineTooLong))
    }

    /// The code of the error, or the reason why the answer is not valid.
    pub fn fault(&self) -> Option<&str> {
        match &self.fields {
            Err(error) => Some(error.code.name()),
            Ok(fields) if fields.get("valid") == Some(&Value::Bool(false)) => {
                fields.get("reason").and_then(Value::as_str)
            }
            Ok(_) => None,
        }
    }

    /// The reply line, without its newline.
    pub fn line(self, elapsed_us: u64) -> String {
        let fields = self.fields.map(|mut fields| {
            fields.insert("elapsed_us".to_owned(), elapsed_us.into());
            fields
        });
        reply::line(&self.id, fields)
    }
}

impl Session {
    /// A session with the service's profile; it has to show the token first when there is one.
    pub fn new(service: Arc<Service>) -> Self {
        let authorised = service.settings.token.is_none();
        Self {
            service,
            profile: None,
            subscription: None,
            authorised,
            album: Arc::default(),
        }
    }

    /// A session that needs no token, for a peer who has been recognised otherwise.
    pub fn trusted(service: Arc<Service>) -> Self {
        Self {
            authorised: true,
            ..Self::new(service)
        }
    }

    /// The service it belongs to.
    pub fn service(&self) -> &Arc<Service> {
        &self.service
    }

    /// Whether the peer may ask.
    pub fn is_authorised(&self) -> bool {
        self.authorised
    }

    /// Reads a request line.
    pub fn read(&self, line: &[u8]) -> Pending {
        let received = Instant::now();
        Pending {
            request: Request::parse(line),
            received,
            measured: None,
        }
    }

    /// Answers a line, all in one.
    pub fn reply(&mut self, line: &[u8]) -> String {
        let pending = self.read(line);
        let received = pending.received;
        let now = self.service.now();
        let answered = self.answer(pending, now);
        let elapsed_us = u64::try_from(received.elapsed().as_micros()).unwrap_or(u64::MAX);
        answered.line(elapsed_us)
    }

    /// Answers a request at a moment.
    pub fn answer(&mut self, pending: Pending, now: Moment) -> Answered {
        let (name, measured) = (pending.op(), pending.measured);
        let Request { id, mut op } = pending.request;
        let curve = self.service.settings.level_curve.clone();
        if let Ok(op) = &mut op {
            read_level(op, curve.as_ref());
        }
        let (sequence, mut fields) = match op {
            Ok(Op::State(inputs)) if self.authorised => self.state(&inputs, now),
            Ok(op) => {
                let (snapshot, ()) = self.service.snapshot(|_| ());
                let fields = self.fields(op, &id, measured, &snapshot, now);
                (snapshot.sequence, fields)
            }
            Err(error) => (self.service.snapshot(|_| ()).0.sequence, Err(error)),
        };
        if let Ok(fields) = &mut fields {
            tell_level(fields, curve.as_ref());
        }
        if matches!(name, "suggest" | "suggest_image") && self.authorised {
            self.service.metrics.gauges.advised(fields.as_ref().ok());
        }
        Answered {
            sequence,
            op: name,
            id,
            fields,
        }
    }

    /// The reply to a line that was too long to be read.
    pub fn line_too_long(&self) -> Answered {
        let message = format!(
            "a line must be at most {MAX_LINE_BYTES} bytes long; larger pictures can be named by image.path (images.directory)"
        );
        Answered {
            sequence: self.service.snapshot(|_| ()).0.sequence,
            op: "invalid",
            id: Value::Null,
            fields: Err(WireError::new(Code::LineTooLong, message)),
        }
    }

    /// When the next message of the subscription is due, s since the start; `None` without one.
    pub fn next_push_s(&self) -> Option<f64> {
        self.subscription.as_ref().map(Subscription::next_s)
    }

    /// The message of the subscription, if there is one and it is due.
    pub fn push(&mut self, now: Moment) -> Option<Answered> {
        let subscription = self.subscription.as_mut()?;
        if now.since_start_s < subscription.next_s() {
            return None;
        }
        let (snapshot, ()) = self.service.snapshot(|_| ());
        let own = self.profile.as_deref();
        let album = album(&self.album);
        let settings = &self.service.settings;
        let mut fields = subscription.push((&snapshot, &album), own, settings, now);
        drop(album);
        if let Ok(fields) = &mut fields {
            tell_level(fields, settings.level_curve.as_ref());
        }
        self.service.metrics.gauges.advised(fields.as_ref().ok());
        Some(Answered {
            sequence: snapshot.sequence,
            op: "push",
            id: subscription.id.clone(),
            fields,
        })
    }

    fn fields(
        &mut self,
        op: Op,
        id: &Value,
        measured: Option<Picture>,
        snapshot: &Snapshot,
        now: Moment,
    ) -> Result<Fields, WireError> {
        if let Op::Auth(token) = &op {
            return self.authorise(token);
        }
        if !self.authorised {
            let message = "the first line must be {\"op\": \"auth\", \"token\": ..}";
            return Err(WireError::new(Code::Unauthorised, message));
        }
        match op {
            Op::Suggest { inputs, objective } => {
                self.suggest(&inputs, objective.as_ref(), snapshot, now)
            }
            Op::SuggestImage {
                mut inputs,
                image,
                objective,
            } => {
                let settings = &self.service.settings;
                let distance_m = distance_m(&inputs, &snapshot.feed, &settings.beams);
                let measure = |water| image::measure(&image, settings, water, distance_m);
                let picture = match (&snapshot.loaded.basis, measured) {
                    (Basis::Network(_), Some(picture)) => picture,
                    (Basis::Network(_), None) => measure(None)?.0,
                    (Basis::Physics(water), _) => {
                        let (picture, counts) = measure(Some(water))?;
                        inputs.picture = Some(picture);
                        if let Some(counts) = counts {
                            self.look_at(water, &counts, &inputs, snapshot, now);
                        }
                        picture
                    }
                };
                inputs.picture = Some(picture);
                let mut fields = self.suggest(&inputs, objective.as_ref(), snapshot, now)?;
                let measured = json!({"mean": picture.mean, "std": picture.std});
                fields.extend(reply::fields(measured));
                if let Some([width, height]) = picture.size_px {
                    fields.insert("width".to_owned(), width.into());
                    fields.insert("height".to_owned(), height.into());
                }
                if let Some(quality) = picture.quality {
                    fields.extend(reply::fields(json!({
                        "std_corrected": quality.std_corrected,
                        "noise_floor": quality.noise_floor,
                        "saturated": quality.saturated,
                    })));
                    let processing = quality.processing;
                    if let Some(quality) = processing.jpeg_quality {
                        fields.insert("jpeg_quality".to_owned(), quality.into());
                    }
                    if processing.noise_share.iter().any(Option::is_some) {
                        fields.insert("noise_share".to_owned(), json!(processing.noise_share));
                    }
                }
                Ok(fields)
            }
            Op::Predict {
                inputs,
                candidates,
                objective,
            } => {
                let objective = self.objective(objective.as_ref())?;
                let checks = &self.service.settings.checks;
                let predicted = |known: &Known,
                                 predicting: &Predicting,
                                 profile: Option<&Profile>| {
                    let mut lenient = *checks;
                    lenient.other_camera = Strictness::Ignore;
                    let ground = match predicting.ground(known, profile, &lenient) {
                        Ok((ground, _)) => ground,
                        Err(hold) => return Ok(hold.fields(Some(known))),
                    };
                    let (by, observation) = (ground.by(), &known.observation);
                    let found = predict_by(observation, &candidates, profile, by, &objective)?;
                    let doubt = doubt_by(observation, &candidates, profile, by, &objective, checks);
                    let mut fields = suggestion::prediction(&found, doubt.as_ref(), known, by);
                    predicting.tell(&mut fields);
                    Ok(fields)
                };
                self.with_known(&inputs, &objective, (snapshot, now), predicted)
            }
            Op::Subscribe {
                rate_hz,
                objective,
                steering,
            } => {
                let objective = self.objective(objective.as_ref())?;
                let mut wanted = self.service.settings.steering;
                if let Some(value) = &steering {
                    wanted = steering_with(&wanted, &Object::new(value, "steering")?)?;
                }
                let begun = Subscription::new(id.clone(), rate_hz, objective, wanted, now);
                self.subscription = Some(begun);
                Ok(reply::fields(json!({"rate_hz": rate_hz})))
            }
            Op::Unsubscribe => {
                self.subscription.take().ok_or_else(subscription::none)?;
                Ok(Fields::new())
            }
            Op::SetProfile(profile) => {
                let described = describe::profile(&profile);
                let warnings = snapshot
                    .loaded
                    .warnings(Some(&profile), &self.service.settings.vehicle);
                self.profile = Some(Arc::from(profile));
                Ok(reply::fields(
                    json!({"profile": described, "warnings": warnings}),
                ))
            }
            Op::Info => Ok(self.info(snapshot)),
            Op::Health => Ok(self.health(snapshot, now)),
            // Answered before.
            Op::State(_) | Op::Auth(_) => Ok(Fields::new()),
        }
    }

    fn authorise(&mut self, token: &str) -> Result<Fields, WireError> {
        let right = match &self.service.settings.token {
            Some(expected) => same_bytes(expected.as_bytes(), token.as_bytes()),
            None => true,
        };
        if right {
            self.authorised = true;
            return Ok(Fields::new());
        }
        Err(WireError::new(Code::Unauthorised, "the token is wrong").at("token"))
    }

    /// The configured objective with the request's fields over it.
    fn objective(&self, overrides: Option<&Value>) -> Result<Objective, WireError> {
        let configured = &self.service.settings.objective;
        match overrides {
            None => Ok(*configured),
            Some(value) => Ok(configured.with(&Object::new(value, "objective")?)?),
        }
    }

    fn suggest(
        &self,
        inputs: &Inputs,
        objective: Option<&Value>,
        snapshot: &Snapshot,
        now: Moment,
    ) -> Result<Fields, WireError> {
        let objective = self.objective(objective)?;
        let checks = &self.service.settings.checks;
        let suggested = |known: &Known, predicting: &Predicting, profile: Option<&Profile>| {
            suggestion::suggest(known, predicting, profile, (&objective, checks))
        };
        self.with_known(inputs, &objective, (snapshot, now), suggested)
    }

    /// Answers from a complete and fresh observation and a profile, where one is needed, or says to hold.
    fn with_known(
        &self,
        inputs: &Inputs,
        objective: &Objective,
        (snapshot, now): (&Snapshot, Moment),
        answer: impl FnOnce(&Known, &Predicting, Option<&Profile>) -> Result<Fields, WireError>,
    ) -> Result<Fields, WireError> {
        let settings = &self.service.settings;
        let album = album(&self.album);
        let feed = match &snapshot.loaded.basis {
            Basis::Network(_) => snapshot.feed,
            Basis::Physics(_) => album.feed(snapshot.feed),
        };
        let known = match resolve(inputs, &feed, now, &settings.beams) {
            Ok(known) => known,
            Err(unknown) => return suggestion::unknown(unknown),
        };
        let predicting = Predicting {
            loaded: &snapshot.loaded,
            album: &album,
            settings,
            now,
        };
        let profile = self
            .profile
            .as_deref()
            .or(snapshot.loaded.profile.as_deref());
        let means = (profile, &snapshot.loaded.basis);
        match usable(&known, means, objective, &settings.max_age) {
            Ok(()) => answer(&known, &predicting, profile),
            Err(hold) => Ok(hold.fields(Some(&known))),
        }
    }

    /// Makes a picture of the water file's camera ready for predictions, if it is known where it was taken and it shows anything.
    fn look_at(
        &self,
        water: &Arc<Water>,
        counts: &Counts,
        inputs: &Inputs,
        snapshot: &Snapshot,
        now: Moment,
    ) {
        let beams = &self.service.settings.beams;
        let (Ok(known), Some(picture)) =
            (resolve(inputs, &snapshot.feed, now, beams), inputs.picture)
        else {
            return;
        };
        let observation = &known.observation;
        if observation.check().is_err() {
            return;
        }
        let here = Candidate {
            distance_m: observation.distance_m,
            light_pct: observation.light_pct,
        };
        let taken_s = now.since_start_s - known.ages.image_s;
        let digest = snapshot.loaded.model_digest.clone();
        let earlier = album(&self.album).earlier(&digest, taken_s);
        let taken = TakenPicture {
            present: Arc::new(Present::new(
                Arc::clone(water),
                counts,
                (&here, observation.depth_m),
                picture.std,
                &earlier,
            )),
            taken_s,
            water: digest,
        };
        album(&self.album).take(taken, picture);
    }

    /// Takes news of the vehicle's state; the place among the answers and the reply.
    fn state(&self, inputs: &Inputs, now: Moment) -> (u64, Result<Fields, WireError>) {
        let read = || -> Result<_, Unknown> {
            let age_s = age_s(inputs.stamp, now).map_err(Unknown::Field)?;
            Ok((age_s, update(inputs, &self.service.settings.beams)?))
        };
        let (age_s, update) = match read() {
            Ok(read) => read,
            Err(unknown) => {
                let sequence = self.service.snapshot(|_| ()).0.sequence;
                let fields = match unknown {
                    Unknown::Beams(error) => Ok(reply::fields(json!({
                        "reason": Hold::Beams(error).name(),
                        "message": error.to_string(),
                        "ignored": ["distances_m"],
                    }))),
                    other => suggestion::unknown(other),
                };
                return (sequence, fields);
            }
        };
        let taken_s = now.since_start_s - age_s;
        let (snapshot, ignored) = self.service.snapshot(|feed| feed.apply(&update, taken_s));
        let mut fields = reply::fields(json!({"ignored": ignored}));
        if let Some(plane) = update.range.and_then(|range| range.plane) {
            let described = suggestion::describe_plane(&plane);
            fields.insert("beams".to_owned(), described);
        }
        (snapshot.sequence, Ok(fields))
    }

    fn info(&self, snapshot: &Snapshot) -> Fields {
        let loaded = &snapshot.loaded;
        let settings = &self.service.settings;
        let profile = self.profile.as_ref().or(loaded.profile.as_ref());
        let mut fields = reply::fields(json!({
            "version": env!("CARGO_PKG_VERSION"),
            "model": match &loaded.basis {
                Basis::Network(model) => describe::model(model, &loaded.model_name),
                Basis::Physics(_) => Value::Null,
            },
            "profile": profile.map(|profile| describe::profile(profile)),
            "warnings": loaded.warnings(profile.map(|profile| &**profile), &settings.vehicle),
            "objective": describe::objective(&settings.objective),
            "settings": describe::settings(settings),
        }));
        if let Basis::Physics(water) = &loaded.basis {
            let described = describe::water(water.file(), &loaded.model_name);
            fields.insert("water".to_owned(), described);
        }
        if settings.tell_predictor || matches!(loaded.basis, Basis::Physics(_)) {
            fields.insert("predictor".to_owned(), loaded.basis.name().into());
        }
        fields
    }

    fn health(&self, snapshot: &Snapshot, now: Moment) -> Fields {
        let service = &self.service;
        let feed = &snapshot.feed;
        let reload_error = service.reload_error();
        let age = |taken_s: Option<f64>| taken_s.map(|taken| now.since_start_s - taken);
        reply::fields(json!({
            "status": if reload_error.is_some() { "degraded" } else { "ok" },
            "uptime_s": now.since_start_s,
            "requests": service.metrics.requests(),
            "errors": service.metrics.errors(),
            "connections": service.metrics.connections(),
            "state_age_s": {
                "depth": age(feed.depth_m.map(|reading| reading.taken_s)),
                "distance": age(feed.range.map(|reading| reading.taken_s)),
                "light": age(feed.light_pct.map(|reading| reading.taken_s)),
                "image": age(feed.picture.map(|reading| reading.taken_s)),
            },
            "reloads": service.reloads(),
            "reload_error": *reload_error,
        }))
    }
}

/// The pictures of a connection. Nothing panics while holding the lock; should it, they are whole all the same.
fn album(shared: &Mutex<Album>) -> MutexGuard<'_, Album> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Compares in a time that depends on the lengths only.
fn same_bytes(x: &[u8], y: &[u8]) -> bool {
    let difference = x.iter().zip(y).fold(0, |all, (a, b)| all | (a ^ b));
    x.len() == y.len() && difference == 0
}
