use std::time::Duration;

use super::*;
use uw_calib::response::LinearNoise;
use uw_calib::{Encoding, NoiseModel, SensorNoise};
use uw_guidance::objective::Objective;

fn read(text: &str) -> Result<Config, ConfigError> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("uwguide.toml");
    fs::write(&path, text).unwrap();
    Config::read(&path)
}

#[test]
fn fields_lie_over_the_defaults() {
    let config = read(
        "format = \"uwguide-config/1\"\n[objective]\npreset = \"paper\"\nlambda_d = 2\n\
         [limits]\nidle_time_s = 1.5\n",
    )
    .unwrap();
    assert_eq!(
        config.settings.objective,
        Objective {
            lambda_d: 2.0,
            ..Objective::paper()
        }
    );
    assert_eq!(config.limits.idle_time, Duration::from_millis(1500));
    assert_eq!(
        config.limits.max_connections,
        Limits::default().max_connections
    );
}

#[test]
fn wrong_files_are_refused_with_the_field() {
    let cases = [
        ("[objective]\n", "format is missing"),
        ("format = \"uwguide-config/2\"\n", "format must be"),
        (
            "format = \"uwguide-config/1\"\n[objectiv]\n",
            "did you mean objective?",
        ),
        (
            "format = \"uwguide-config/1\"\n[objective]\nlambda_c = nan\n",
            "objective.lambda_c",
        ),
        (
            "format = \"uwguide-config/1\"\n[limits]\nidle_time_s = 0\n",
            "limits.idle_time_s",
        ),
        (
            "format = \"uwguide-config/1\"\n[limits]\nmax_connections = 0\n",
            "max_connections",
        ),
        (
            "format = \"uwguide-config/1\"\n[beams]\nazimuths_deg = [1.0, nan]\n",
            "beams.azimuths_deg[1]",
        ),
        (
            "format = \"uwguide-config/1\"\n[tls]\nkey = \"x\"\n",
            "tls.certificate is missing",
        ),
        (
            "format = \"uwguide-config/1\"\n[operations]\nlog_level = \"loud\"\n",
            "operations.log_level must be one of error",
        ),
        (
            "format = \"uwguide-config/1\"\n[max_age]\ndepth_s = 0\n",
            "max_age.depth_s must be > 0",
        ),
        (
            "format = \"uwguide-config/1\"\n[images]\nnoise_a = 1e-3\n",
            "images.noise_b is missing",
        ),
        (
            "format = \"uwguide-config/1\"\n[images]\nnoise_a = 1e-3\nnoise_b = -1\n",
            "images.noise_b must be >= 0",
        ),
        (
            "format = \"uwguide-config/1\"\n[images]\nencoding = \"log\"\n",
            "images.encoding must be",
        ),
        ("format = \n", "not valid TOML"),
    ];
    for (text, expected) in cases {
        let message = read(text).unwrap_err().to_string();
        assert!(message.contains(expected), "{text}: {message}");
    }
}

#[test]
fn the_printed_default_is_the_default() {
    let parsed = Config::parse(DEFAULT_CONFIG, "default.toml").unwrap();
    assert_eq!(parsed, Config::default());
}

#[test]
fn the_noise_of_the_camera_is_read() {
    let text = "format = \"uwguide-config/1\"\n[images]\nnoise_a = 1e-3\nnoise_b = 1e-5\nencoding = \"linear\"\n";
    let noise = Config::parse(text, "c.toml").unwrap().settings.noise;
    let right = LinearNoise { a: 1e-3, b: 1e-5 };
    let right = SensorNoise::new(Encoding::Linear, right).unwrap();
    assert_eq!(noise, NoiseModel::Sensor(right));
}

#[test]
fn the_encoding_of_images_goes_before_the_vehicles() {
    let encoding = |images: &str| {
        let text = format!(
            "format = \"uwguide-config/1\"\n[images]\n{images}[vehicle]\nfile = \"default\"\n"
        );
        let mut config = read(&text).unwrap();
        config.read_vehicle().unwrap();
        config.settings.treatment.encoding
    };
    assert_eq!(encoding("encoding = \"linear\"\n"), Encoding::Linear);
    assert_eq!(encoding(""), Encoding::Srgb);
}

#[test]
fn short_tokens_are_refused_and_only_the_first_line_counts() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("token");
    let mut config = Config {
        token_file: Some(path.clone()),
        ..Config::default()
    };
    fs::write(&path, "short\n").unwrap();
    let message = config.read_token().unwrap_err().to_string();
    assert!(message.contains("16 to 4096 bytes"), "{message}");
    fs::write(&path, "0123456789abcdef0123\nrest\n").unwrap();
    config.read_token().unwrap();
    assert_eq!(
        config.settings.token.as_deref(),
        Some("0123456789abcdef0123")
    );
}
