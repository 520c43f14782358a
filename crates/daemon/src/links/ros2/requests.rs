//! From messages to requests of the protocol.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Map, Value, json};

use super::messages::{FluidPressure, Header, Range};
use super::{DepthAxis, Ros2Config};

/// Standard gravity, m/s².
const GRAVITY_M_PER_S2: f64 = 9.806_65;

/// The distance that a range means; `None` without an echo: infinities and NaN (REP 117), and what lies outside the sensor's own limits.
pub(super) fn distance_m(range: &Range, config: &Ros2Config) -> Option<f64> {
    let (least, most) = (range.min_range, range.max_range);
    let limited = least < most;
    let inside = !limited || (least..=most).contains(&range.range);
    distance_of(range.range.into(), config).filter(|_| inside)
}

/// The distance that a number means; `None` for what is no distance.
pub(super) fn distance_of(value_m: f64, config: &Ros2Config) -> Option<f64> {
    (value_m.is_finite() && value_m > 0.0).then_some(value_m + config.range_offset_m)
}

/// The depth that an absolute pressure means; 0 above the surface, where waves bring it.
pub(super) fn depth_m(pressure: &FluidPressure, config: &Ros2Config) -> f64 {
    let above = pressure.fluid_pressure - config.surface_pressure_pa;
    (above / (config.water_density_kg_per_m3 * GRAVITY_M_PER_S2)).max(0.0)
}

/// The depth that a number or a z means, of which `usual` is the way that its type grows; 0 above the surface where it is a height.
pub(super) fn depth_along(value_m: f64, usual: DepthAxis, config: &Ros2Config) -> f64 {
    match config.depth_axis.unwrap_or(usual) {
        DepthAxis::Down => value_m,
        DepthAxis::Up if value_m > 0.0 => 0.0,
        // Not -0, and NaN stays what it is.
        DepthAxis::Up => 0.0 - value_m,
    }
}

/// News of the state; values that are no numbers are none.
pub(super) fn state(field: &str, value: f64, time_s: Option<f64>) -> Option<Value> {
    value
        .is_finite()
        .then(|| timed(json!({"op": "state", field: value}), time_s))
}

/// A picture, as a file, that asks for advice.
pub(super) fn picture(file: &[u8], time_s: Option<f64>) -> Value {
    let text = STANDARD.encode(file);
    timed(
        json!({"op": "suggest_image", "image": {"base64_png": text}}),
        time_s,
    )
}

/// When a message was measured, s since 1970; `None` where its header does not say or is not believed.
pub(super) fn time_s(header: &Header, config: &Ros2Config) -> Option<f64> {
    let stamp = header.stamp;
    let is_given = (stamp.sec, stamp.nanosec) != (0, 0);
    (config.stamps && is_given).then(|| f64::from(stamp.sec) + 1e-9 * f64::from(stamp.nanosec))
}

fn timed(mut request: Value, time_s: Option<f64>) -> Value {
    let fields: Option<&mut Map<_, _>> = request.as_object_mut();
    if let (Some(fields), Some(time_s)) = (fields, time_s) {
        fields.insert("time_s".to_owned(), time_s.into());
    }
    request
}

#[cfg(test)]
mod tests {
    use super::super::messages::Time;
    use super::*;

    fn range(range: f32) -> Range {
        Range {
            header: Header::default(),
            radiation_type: 0,
            field_of_view: 0.1,
            min_range: 0.2,
            max_range: 10.0,
            range,
        }
    }

    #[test]
    fn ranges_without_an_echo_are_none() {
        let config = Ros2Config {
            range_offset_m: 0.25,
            ..Ros2Config::default()
        };
        assert_eq!(distance_m(&range(1.5), &config), Some(1.75));
        for none in [
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::NAN,
            0.0,
            -1.0,
            0.1,
            11.0,
        ] {
            assert_eq!(distance_m(&range(none), &config), None, "{none}");
        }
        // Limits that are not filled in are none.
        let unlimited = Range {
            min_range: 0.0,
            max_range: 0.0,
            ..range(11.0)
        };
        assert_eq!(distance_m(&unlimited, &config), Some(11.25));
        assert_eq!(distance_of(11.0, &config), Some(11.25));
        assert_eq!(distance_of(-1.0, &config), None);
    }

    #[test]
    fn pressure_is_depth_below_the_surface() {
        let config = Ros2Config::default();
        let at = |fluid_pressure: f64| {
            let message = FluidPressure {
                header: Header::default(),
                fluid_pressure,
                variance: 0.0,
            };
            depth_m(&message, &config)
        };
        let three = 101_325.0 + 3.0 * 1025.0 * 9.806_65;
        assert!((at(three) - 3.0).abs() < 1e-12);
        assert_eq!(at(101_000.0), 0.0);
    }

    #[test]
    fn depths_grow_as_they_are_said_to() {
        let mut config = Ros2Config::default();
        assert_eq!(depth_along(3.0, DepthAxis::Down, &config), 3.0);
        assert_eq!(depth_along(-3.0, DepthAxis::Up, &config), 3.0);
        assert_eq!(depth_along(0.2, DepthAxis::Up, &config), 0.0);
        assert!(depth_along(f64::NAN, DepthAxis::Down, &config).is_nan());
        assert!(depth_along(f64::NAN, DepthAxis::Up, &config).is_nan());
        config.depth_axis = Some(DepthAxis::Up);
        assert_eq!(depth_along(-3.0, DepthAxis::Down, &config), 3.0);
        config.depth_axis = Some(DepthAxis::Down);
        assert_eq!(depth_along(3.0, DepthAxis::Up, &config), 3.0);
    }

    #[test]
    fn stamps_are_told_where_they_are_believed() {
        let header = Header {
            stamp: Time {
                sec: 12,
                nanosec: 500_000_000,
            },
            frame_id: String::new(),
        };
        let mut config = Ros2Config::default();
        assert_eq!(time_s(&header, &config), Some(12.5));
        assert_eq!(time_s(&Header::default(), &config), None);
        config.stamps = false;
        assert_eq!(time_s(&header, &config), None);
        assert_eq!(state("depth_m", f64::NAN, None), None);
        let told = state("depth_m", 3.0, Some(12.5));
        assert_eq!(
            told,
            Some(json!({"op": "state", "depth_m": 3.0, "time_s": 12.5}))
        );
    }
}
