//! From answers to lines.

use serde_json::{Map, Value, json};
use uw_calib::json::{FieldError, FieldProblem};

use crate::advice::Reason;

/// Format name and version in every reply.
pub const FORMAT: &str = "uwguide/1";

/// Kinds of errors, as programs tell them apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Code {
    /// The line is not UTF-8.
    BadUtf8,
    /// The line is not a JSON object.
    BadJson,
    /// The line is longer than the protocol allows.
    LineTooLong,
    /// A needed field is not there.
    MissingField,
    /// A field has no meaning here.
    UnknownField,
    /// A value of the wrong JSON type.
    WrongType,
    /// A number outside its range, or outside the calibration.
    OutOfRange,
    /// A value that is none of those allowed.
    InvalidValue,
    /// `op` is none of the known.
    UnknownOp,
    /// The image cannot be read or measured.
    BadImage,
    /// All connections are taken.
    Busy,
    /// Nothing came for too long.
    Idle,
    /// Another protocol is spoken.
    ForeignProtocol,
    /// A token is needed, or it is wrong.
    Unauthorised,
    /// The daemon failed; the fault is not the request's.
    Internal,
}

impl Code {
    /// The code on the wire.
    pub fn name(self) -> &'static str {
        match self {
            Self::BadUtf8 => "bad_utf8",
            Self::BadJson => "bad_json",
            Self::LineTooLong => "line_too_long",
            Self::MissingField => "missing_field",
            Self::UnknownField => "unknown_field",
            Self::WrongType => "wrong_type",
            Self::OutOfRange => "out_of_range",
            Self::InvalidValue => "invalid_value",
            Self::UnknownOp => "unknown_op",
            Self::BadImage => "bad_image",
            Self::Busy => "busy",
            Self::Idle => "idle",
            Self::ForeignProtocol => "foreign_protocol",
            Self::Unauthorised => "unauthorised",
            Self::Internal => "internal",
        }
    }
}

/// The error object of a reply.
#[derive(Clone, Debug, PartialEq)]
pub struct WireError {
    /// Kind.
    pub code: Code,
    /// Field that is wrong, where it is one field's fault.
    pub field: Option<String>,
    /// What is wrong and what would be right.
    pub message: String,
    /// Set when a question was understood but cannot be answered: the name of the reason.
    pub reason: Option<&'static str>,
}

impl WireError {
    /// An error that is no single field's fault.
    pub fn new(code: Code, message: impl Into<String>) -> Self {
        Self {
            code,
            field: None,
            message: message.into(),
            reason: None,
        }
    }

    /// The same error as the reason for an answer that is not valid.
    pub fn because(mut self, reason: &'static str) -> Self {
        self.reason = Some(reason);
        self
    }

    /// The same error at a field.
    pub fn at(mut self, field: impl Into<String>) -> Self {
        self.field = Some(field.into());
        self
    }
}

impl From<FieldError> for WireError {
    fn from(error: FieldError) -> Self {
        let code = match error.problem {
            FieldProblem::Missing => Code::MissingField,
            FieldProblem::Unknown { .. } => Code::UnknownField,
            FieldProblem::WrongType { .. } => Code::WrongType,
            FieldProblem::OutOfRange { .. } => Code::OutOfRange,
            FieldProblem::Invalid { .. } => Code::InvalidValue,
        };
        Self::new(code, error.to_string()).at(error.field)
    }
}

impl From<Reason> for WireError {
    fn from(reason: Reason) -> Self {
        let (name, message) = (reason.name(), reason.to_string());
        let error = match reason {
            Reason::BadObservation(error) => error.into(),
            Reason::OutsideCalibration { field, .. } => {
                Self::new(Code::OutOfRange, message).at(field)
            }
            Reason::NoCandidates { .. } => {
                Self::new(Code::OutOfRange, message).at("objective.distance_m")
            }
            Reason::OutsideTraining { input, .. } => Self::new(Code::OutOfRange, message).at(input),
            Reason::OtherDepth { .. } => Self::new(Code::OutOfRange, message).at("depth_m"),
            Reason::ModelMisfit { .. }
            | Reason::NoProfile(_)
            | Reason::OtherCamera(_)
            | Reason::OtherSun(_)
            | Reason::Compressed(_)
            | Reason::Denoised(_)
            | Reason::UnknownExposure
            | Reason::Oblique { .. } => Self::new(Code::InvalidValue, message),
            Reason::OutsideTables { field, .. } => Self::new(Code::OutOfRange, message).at(field),
            Reason::PhysicsMisfit { .. } | Reason::Unexplained { .. } | Reason::Untold(_) => {
                Self::new(Code::InvalidValue, message)
            }
            Reason::NoiseFloor(_) => Self::new(Code::OutOfRange, message).at("std_corrected"),
            Reason::Saturated { .. } => Self::new(Code::OutOfRange, message).at("saturated"),
            Reason::NotFinite | Reason::Clamped { .. } | Reason::SmallGain { .. } => {
                Self::new(Code::Internal, message)
            }
        };
        Self {
            reason: Some(name),
            ..error
        }
    }
}

/// The fields of a reply that is not an error.
pub type Fields = Map<String, Value>;

/// The line of a reply, without its newline.
pub fn line(id: &Value, answer: Result<Fields, WireError>) -> String {
    let mut reply = Map::new();
    reply.insert("id".to_owned(), id.clone());
    reply.insert("ok".to_owned(), answer.is_ok().into());
    reply.insert("format".to_owned(), FORMAT.into());
    match answer {
        Ok(fields) => reply.extend(fields),
        Err(error) => {
            if let Some(reason) = error.reason {
                reply.insert("valid".to_owned(), false.into());
                reply.insert("reason".to_owned(), reason.into());
                reply.insert("action".to_owned(), "hold".into());
            }
            let (code, field, message) = (error.code.name(), error.field, error.message);
            reply.insert(
                "error".to_owned(),
                json!({"code": code, "field": field, "message": message}),
            );
        }
    }
    Value::Object(reply).to_string()
}

/// Decimals of what replies tell: nothing that a vehicle, a camera or the network means is finer.
pub const DISTANCE_DECIMALS: i32 = 2;
/// Of lamp levels, percent.
pub const LIGHT_DECIMALS: i32 = 1;
/// Of contrasts, means and residuals, 8-bit counts.
pub const COUNTS_DECIMALS: i32 = 2;
/// Of scores and their terms.
pub const SCORE_DECIMALS: i32 = 4;
/// Of shares of pixels.
pub const SHARE_DECIMALS: i32 = 4;
/// Of ages, s.
pub const AGE_DECIMALS: i32 = 3;

/// A number with so many decimals.
pub fn rounded(value: f64, decimals: i32) -> f64 {
    let unit = 10f64.powi(decimals);
    let scaled = (value * unit).round();
    // What is too large to have decimals stays as it is; + 0.0 makes -0 a 0.
    if scaled.is_finite() {
        scaled / unit + 0.0
    } else {
        value
    }
}

/// The members of a JSON object.
pub fn fields(object: Value) -> Fields {
    match object {
        Value::Object(fields) => fields,
        other => Map::from_iter([("value".to_owned(), other)]),
    }
}
