//! An autopilot (ArduSub) through MAVLink2REST, the HTTP service that BlueOS offers.
//!
//! Polls `DISTANCE_SENSOR`, `VFR_HUD` (depth below the surface is -alt) and `NAMED_VALUE_FLOAT` `Lights1`
//! (lamp level, 0 to 1) and feeds what is new. By default it advises only: suggestions are asked for by
//! clients. With `act` it sets the lamps to what a subscription commands; distance is never commanded.
//!
//! How lamps are reached depends on the autopilot. Before ArduSub 4.5.6 a servo output with function 0
//! follows `MAV_CMD_DO_SET_SERVO`. From 4.5.6 lamp outputs have functions 181 and 182, which that command
//! does not reach: give the output function 0 and keep "servo", or use "illuminator"
//! (`MAV_CMD_DO_ILLUMINATOR_CONFIGURE`) where the autopilot knows it.

use std::collections::HashMap;
use std::io;
use std::time::Duration;

use serde_json::{Value, json};
use tokio::time::{MissedTickBehavior, interval};

use super::Feeder;
use super::http_client::exchange;

/// Pulse lengths of no light and full light, µs (Blue Robotics Lumen).
const PULSE_US: [f64; 2] = [1100.0, 1900.0];
/// System and component of the daemon in MAVLink: a companion computer's peripheral.
const OWN_SYSTEM: u8 = 255;
const OWN_COMPONENT: u8 = 191;

/// Where the service is and what is done with it.
#[derive(Clone, Debug, PartialEq)]
pub struct MavlinkConfig {
    /// Host and port of MAVLink2REST; BlueOS has it on 6040.
    pub address: String,
    /// Path before `/mavlink`, such as `/v1`.
    pub prefix: String,
    /// System of the autopilot.
    pub system: u8,
    /// How often is polled, Hz.
    pub rate_hz: f64,
    /// Orientation that a distance sensor must have to look where the camera looks.
    pub orientation: String,
    /// What is done with suggestions.
    pub lamps: Lamps,
}

impl Default for MavlinkConfig {
    fn default() -> Self {
        Self {
            address: "127.0.0.1:6040".to_owned(),
            prefix: "/v1".to_owned(),
            system: 1,
            rate_hz: 4.0,
            orientation: "MAV_SENSOR_ROTATION_NONE".to_owned(),
            lamps: Lamps::Advise,
        }
    }
}

/// What is done with suggestions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lamps {
    /// Nothing: clients ask.
    Advise,
    /// `MAV_CMD_DO_SET_SERVO` on this output.
    Servo(u8),
    /// `MAV_CMD_DO_ILLUMINATOR_CONFIGURE`.
    Illuminator,
}

/// Polls and feeds for ever; commands the lamps where that is configured.
pub async fn run(config: MavlinkConfig, mut feeder: Feeder) {
    let mut bridge = Bridge::new(config);
    let mut ticks = interval(Duration::from_secs_f64(1.0 / bridge.config.rate_hz));
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    if bridge.config.lamps != Lamps::Advise {
        feeder.subscribe(bridge.config.rate_hz);
    }
    let mut reachable = true;
    loop {
        ticks.tick().await;
        let polled = bridge.poll(&mut feeder).await;
        if let (Err(error), true) = (&polled, reachable) {
            tracing::warn!(link = "mavlink", %error, "trying again");
        }
        reachable = polled.is_ok();
        if let Some(level_pct) = feeder.commanded_level_pct()
            && let Err(error) = bridge.command(level_pct).await
        {
            tracing::warn!(link = "mavlink", %error, "the lamps could not be set");
        }
    }
}

struct Bridge {
    config: MavlinkConfig,
    /// How often each message had come at the last poll; what has not come since is not new.
    counters: HashMap<&'static str, u64>,
}

impl Bridge {
    fn new(config: MavlinkConfig) -> Self {
        Self {
            config,
            counters: HashMap::new(),
        }
    }

    /// Asks for the messages and feeds what is new.
    async fn poll(&mut self, feeder: &mut Feeder) -> io::Result<()> {
        for name in ["DISTANCE_SENSOR", "VFR_HUD", "NAMED_VALUE_FLOAT"] {
            let MavlinkConfig { prefix, system, .. } = &self.config;
            let path = format!("{prefix}/mavlink/vehicles/{system}/components/1/messages/{name}");
            let answer = match exchange(&self.config.address, &path, None).await {
                Ok(answer) => answer,
                // A message that the autopilot has not sent is answered with an error.
                Err(error) if error.kind() == io::ErrorKind::InvalidData => continue,
                Err(error) => return Err(error),
            };
            if !self.is_new(name, &answer) {
                continue;
            }
            if let Some(state) = state(name, &answer["message"], &self.config.orientation) {
                feeder.ask(&state);
            }
        }
        Ok(())
    }

    /// Whether the message has come again since the last poll. The first poll cannot tell.
    fn is_new(&mut self, name: &'static str, answer: &Value) -> bool {
        let Some(counter) = answer["status"]["time"]["counter"].as_u64() else {
            return false;
        };
        let before = self.counters.insert(name, counter);
        before.is_some_and(|before| before != counter)
    }

    async fn command(&self, level_pct: f64) -> io::Result<()> {
        let Some(body) = lamp_command(&self.config, level_pct) else {
            return Ok(());
        };
        let path = format!("{}/mavlink", self.config.prefix);
        exchange(&self.config.address, &path, Some(&body))
            .await
            .map(drop)
    }
}

/// The `state` request of a MAVLink message; `None` without a usable value.
pub fn state(name: &str, message: &Value, orientation: &str) -> Option<Value> {
    match name {
        "DISTANCE_SENSOR" => {
            let number = |field: &str| message[field].as_f64();
            let distance_cm = number("current_distance")?;
            let within = number("min_distance").is_none_or(|min| distance_cm >= min)
                && number("max_distance").is_none_or(|max| distance_cm <= max);
            // 0 means unknown, 1 invalid.
            let invalid = message["signal_quality"].as_u64() == Some(1);
            let ahead = message["orientation"]["type"].as_str() == Some(orientation);
            (within && ahead && !invalid && distance_cm > 0.0)
                .then(|| json!({"op": "state", "distance_m": distance_cm / 100.0}))
        }
        "VFR_HUD" => {
            let alt_m = message["alt"].as_f64().filter(|alt| alt.is_finite())?;
            Some(json!({"op": "state", "depth_m": (-alt_m).max(0.0)}))
        }
        "NAMED_VALUE_FLOAT" => {
            let share = message["value"].as_f64()?;
            let is_lamp = text(&message["name"])? == "Lights1" && (0.0..=1.0).contains(&share);
            is_lamp.then(|| json!({"op": "state", "level_pct": 100.0 * share}))
        }
        _ => None,
    }
}

/// A name as MAVLink2REST writes it: a string, or its characters up to the first zero.
fn text(name: &Value) -> Option<String> {
    match name {
        Value::String(text) => Some(text.trim_end_matches('\0').to_owned()),
        Value::Array(characters) => {
            let all: Option<String> = characters.iter().map(Value::as_str).collect();
            all.map(|text| text.split('\0').next().unwrap_or_default().to_owned())
        }
        _ => None,
    }
}

/// The message that sets the lamps; `None` where the bridge only advises.
pub fn lamp_command(config: &MavlinkConfig, level_pct: f64) -> Option<Value> {
    let share = (level_pct / 100.0).clamp(0.0, 1.0);
    let (command, first, second) = match config.lamps {
        Lamps::Advise => return None,
        Lamps::Servo(output) => {
            let pulse_us = PULSE_US[0] + share * (PULSE_US[1] - PULSE_US[0]);
            ("MAV_CMD_DO_SET_SERVO", f64::from(output), pulse_us.round())
        }
        // Mode 1: the brightness counts.
        Lamps::Illuminator => ("MAV_CMD_DO_ILLUMINATOR_CONFIGURE", 1.0, 100.0 * share),
    };
    Some(json!({
        "header": {"system_id": OWN_SYSTEM, "component_id": OWN_COMPONENT, "sequence": 0},
        "message": {
            "type": "COMMAND_LONG",
            "command": {"type": command},
            "target_system": config.system,
            "target_component": 1,
            "confirmation": 0,
            "param1": first, "param2": second,
            "param3": 0.0, "param4": 0.0, "param5": 0.0, "param6": 0.0, "param7": 0.0,
        },
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    const AHEAD: &str = "MAV_SENSOR_ROTATION_NONE";

    #[test]
    fn messages_become_states_and_doubtful_ones_nothing() {
        let sensor = |distance_cm: u32, quality: u32, orientation: &str| {
            let message = json!({"current_distance": distance_cm, "min_distance": 20,
                "max_distance": 700, "signal_quality": quality, "orientation": {"type": orientation}});
            state("DISTANCE_SENSOR", &message, AHEAD)
        };
        assert_eq!(sensor(150, 0, AHEAD).unwrap()["distance_m"], 1.5);
        assert_eq!(sensor(150, 1, AHEAD), None, "invalid");
        assert_eq!(sensor(10, 90, AHEAD), None, "too near");
        assert_eq!(sensor(150, 90, "MAV_SENSOR_ROTATION_PITCH_270"), None);
        let depth = state("VFR_HUD", &json!({"alt": -3.25}), AHEAD).unwrap();
        assert_eq!(depth["depth_m"], 3.25);
        let letters = json!(["L", "i", "g", "h", "t", "s", "1", "\u{0}", "x", "\u{0}"]);
        for name in [json!("Lights1"), letters] {
            let lamp = json!({"name": name, "value": 0.25});
            let told = state("NAMED_VALUE_FLOAT", &lamp, AHEAD).unwrap();
            assert_eq!(told["level_pct"], 25.0);
        }
        let other = json!({"name": "CamTilt", "value": 0.25});
        assert_eq!(state("NAMED_VALUE_FLOAT", &other, AHEAD), None);
        assert_eq!(state("VFR_HUD", &Value::Null, AHEAD), None);
    }

    #[test]
    fn lamps_are_commanded_only_when_configured_and_inside_their_range() {
        let with = |lamps| MavlinkConfig {
            lamps,
            ..MavlinkConfig::default()
        };
        assert_eq!(lamp_command(&with(Lamps::Advise), 50.0), None);
        let servo = lamp_command(&with(Lamps::Servo(9)), 50.0).unwrap()["message"].clone();
        assert_eq!(servo["command"]["type"], "MAV_CMD_DO_SET_SERVO");
        assert_eq!(
            (&servo["param1"], &servo["param2"]),
            (&json!(9.0), &json!(1500.0))
        );
        let most = lamp_command(&with(Lamps::Servo(9)), 170.0).unwrap();
        assert_eq!(most["message"]["param2"], 1900.0);
        let lamp = lamp_command(&with(Lamps::Illuminator), 40.0).unwrap();
        assert_eq!(lamp["message"]["param2"], 40.0);
    }
}
