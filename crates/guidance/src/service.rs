//! From a line to a line: what the daemon answers, without any socket.

use std::fs;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use base64::Engine as _;
use serde_json::{Value, json};
use uw_calib::{PatchGrid, Profile};

use crate::advice::{advise, predict};
use crate::mlp::Model;
use crate::objective::{ContrastTerm, DepthTerm, Objective};
use crate::observation::Observation;
use crate::wire::frame::MAX_LINE_BYTES;
use crate::wire::reply::{self, Code, Fields, WireError};
use crate::wire::request::{ImageSource, Op, Request, State};

/// Largest image file read for a request, bytes; above that of any camera's single frame.
const MAX_IMAGE_FILE_BYTES: u64 = 256 << 20;

/// What all connections share: model, profile, objective and counters.
#[derive(Debug)]
pub struct Service {
    model: Model,
    model_name: String,
    profile: Arc<Profile>,
    objective: Objective,
    started: Instant,
    requests: AtomicU64,
    errors: AtomicU64,
}

impl Service {
    /// A service; `model_name` is what `info` calls the model.
    pub fn new(
        model: Model,
        model_name: impl Into<String>,
        profile: Profile,
        objective: Objective,
    ) -> Self {
        Self {
            model,
            model_name: model_name.into(),
            profile: Arc::new(profile),
            objective,
            started: Instant::now(),
            requests: AtomicU64::new(0),
            errors: AtomicU64::new(0),
        }
    }
}

/// One connection's view of the service: it may have a profile of its own.
#[derive(Clone, Debug)]
pub struct Session {
    service: Arc<Service>,
    profile: Arc<Profile>,
}

/// A request that is read but not yet answered.
#[derive(Debug)]
pub struct Pending {
    request: Request,
    received: Instant,
}

impl Pending {
    /// Whether answering takes long enough (reading and decoding an image) to keep it off the threads
    /// that serve the sockets.
    pub fn is_slow(&self) -> bool {
        matches!(self.request.op, Ok(Op::SuggestImage { .. }))
    }
}

impl Session {
    /// A session with the service's profile.
    pub fn new(service: Arc<Service>) -> Self {
        let profile = Arc::clone(&service.profile);
        Self { service, profile }
    }

    /// Reads a request line.
    pub fn read(&self, line: &[u8]) -> Pending {
        let received = Instant::now();
        Pending {
            request: Request::parse(line, &self.service.objective),
            received,
        }
    }

    /// Answers a request with a reply line (without its newline).
    pub fn answer(&mut self, pending: Pending) -> String {
        let Pending {
            request: Request { id, op },
            received,
        } = pending;
        let answer = op.and_then(|op| self.fields(op)).map(|mut fields| {
            let elapsed_us = u64::try_from(received.elapsed().as_micros()).unwrap_or(u64::MAX);
            fields.insert("elapsed_us".to_owned(), elapsed_us.into());
            fields
        });
        self.count(answer.is_err());
        reply::line(&id, answer)
    }

    /// The reply to a line that was too long to be read.
    pub fn line_too_long(&self) -> String {
        self.count(true);
        let message = format!("a line must be at most {MAX_LINE_BYTES} bytes long");
        reply::line(
            &Value::Null,
            Err(WireError::new(Code::LineTooLong, message)),
        )
    }

    fn count(&self, error: bool) {
        self.service.requests.fetch_add(1, Ordering::Relaxed);
        self.service
            .errors
            .fetch_add(u64::from(error), Ordering::Relaxed);
    }

    fn fields(&mut self, op: Op) -> Result<Fields, WireError> {
        match op {
            Op::Suggest {
                observation,
                objective,
            } => self.suggest(&observation, &objective),
            Op::SuggestImage {
                state,
                image,
                objective,
            } => self.suggest_image(state, &image, &objective),
            Op::Predict {
                observation,
                candidates,
                objective,
            } => {
                let model = &self.service.model;
                let found = predict(&observation, &candidates, &self.profile, model, &objective)?;
                Ok(reply::prediction(&found))
            }
            Op::SetProfile(profile) => {
                self.profile = Arc::from(profile);
                Ok(reply::fields(
                    json!({"profile": describe_profile(&self.profile)}),
                ))
            }
            Op::Info => Ok(self.info()),
            Op::Health => Ok(self.health()),
        }
    }

    fn suggest(
        &self,
        observation: &Observation,
        objective: &Objective,
    ) -> Result<Fields, WireError> {
        reply::advice(advise(
            observation,
            &self.profile,
            &self.service.model,
            objective,
        ))
    }

    fn suggest_image(
        &self,
        state: State,
        image: &ImageSource,
        objective: &Objective,
    ) -> Result<Fields, WireError> {
        let stats = measure(image)?.stats;
        let observation = Observation {
            depth_m: state.depth_m,
            distance_m: state.distance_m,
            light_pct: state.light_pct,
            mean: stats.mean,
            std: stats.contrast,
        };
        let mut fields = self.suggest(&observation, objective)?;
        fields.extend(reply::fields(
            json!({"mean": stats.mean, "std": stats.contrast}),
        ));
        Ok(fields)
    }

    fn info(&self) -> Fields {
        let model = &self.service.model;
        let inputs: Vec<&str> = model.inputs().iter().map(|input| input.name).collect();
        reply::fields(json!({
            "version": env!("CARGO_PKG_VERSION"),
            "model": {
                "name": self.service.model_name,
                "inputs": inputs,
                "layer_widths": model.layer_widths(),
            },
            "profile": describe_profile(&self.profile),
            "objective": describe_objective(&self.service.objective),
        }))
    }

    fn health(&self) -> Fields {
        reply::fields(json!({
            "status": "ok",
            "uptime_s": self.service.started.elapsed().as_secs_f64(),
            "requests": self.service.requests.load(Ordering::Relaxed),
            "errors": self.service.errors.load(Ordering::Relaxed),
        }))
    }
}

fn measure(image: &ImageSource) -> Result<PatchGrid, WireError> {
    let bad = |field: &str, message: String| WireError::new(Code::BadImage, message).at(field);
    match image {
        ImageSource::Path(path) => {
            let field = "image.path";
            // A device or a pipe could be endless, or never answer.
            let file = fs::metadata(path)
                .map_err(|error| bad(field, format!("image.path cannot be read: {error}")))?;
            if !file.is_file() || file.len() > MAX_IMAGE_FILE_BYTES {
                let what = "a file of at most 256 MiB";
                return Err(bad(
                    field,
                    format!("image.path must be {what}, got something else"),
                ));
            }
            PatchGrid::from_file(path.as_ref()).map_err(|error| bad(field, error.to_string()))
        }
        ImageSource::Base64(text) => {
            let field = "image.base64_png";
            let bytes = base64::engine::general_purpose::STANDARD
                .decode(text)
                .map_err(|error| bad(field, format!("image.base64_png is not base64: {error}")))?;
            PatchGrid::from_encoded(&bytes, field).map_err(|error| bad(field, error.to_string()))
        }
    }
}

fn describe_profile(profile: &Profile) -> Value {
    json!({
        "depth_m": profile.depth_range_m(),
        "distance_m": profile.distance_range_m(),
        "source": profile.source(),
    })
}

fn describe_objective(objective: &Objective) -> Value {
    json!({
        "lambda_c": objective.lambda_c,
        "lambda_d": objective.lambda_d,
        "kappa_b": objective.kappa_b,
        "kappa_c": objective.kappa_c,
        "contrast": match objective.contrast {
            ContrastTerm::Sum => "sum",
            ContrastTerm::Mean => "mean",
        },
        "contrast_scale": objective.contrast_scale,
        "depth_term": match objective.depth_term {
            DepthTerm::Z => "z",
            DepthTerm::OnePlusHalfZ => "1+z/2",
        },
        "distance_m": objective.distance_m,
        "light_pct": objective.light_pct,
    })
}
