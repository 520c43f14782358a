//! Waters, models and numbers for the tests.

use serde_json::{Value, json};
use uw_calib::{ContrastSample, DepthSample, Profile, Source};

/// Uniform numbers from a seed (xorshift64*, Vigna 2016).
pub(crate) struct Numbers(u64);

impl Numbers {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    /// In [low, high).
    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        let bits = self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11;
        low + (high - low) * bits as f64 / (1u64 << 53) as f64
    }

    /// The sum of twelve uniform numbers, which is close to a normal one.
    pub(crate) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.between(-0.5, 0.5)).sum()
    }

    pub(crate) fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.between(0.0, from.len() as f64) as usize]
    }
}

/// A profile over depths 0.5-6 m and distances 0.5-3 m: light falls exponentially with depth, contrast with
/// distance.
pub(crate) fn profile(numbers: &mut Numbers) -> Profile {
    let k_d: [f64; 3] = std::array::from_fn(|_| numbers.between(0.05, 0.9));
    let contrast: [f64; 3] = std::array::from_fn(|_| numbers.between(5.0, 25.0));
    let decay: [f64; 3] = std::array::from_fn(|_| numbers.between(0.3, 2.0));
    let curve = |gain: f64| -> Vec<ContrastSample> {
        (1..=6)
            .map(|k| 0.5 * f64::from(k))
            .map(|distance_m| ContrastSample {
                distance_m,
                k_c: std::array::from_fn(|k| gain * contrast[k] * (-decay[k] * distance_m).exp()),
            })
            .collect()
    };
    let depth = (1..=12)
        .map(|k| 0.5 * f64::from(k))
        .map(|depth_m| DepthSample {
            depth_m,
            k_z: std::array::from_fn(|k| (-k_d[k] * (depth_m - 0.5)).exp()),
        })
        .collect();
    let source = Source {
        made_by: "tests".to_owned(),
        images: 0,
        note: None,
    };
    Profile::new(depth, curve(1.6), curve(1.0), source).unwrap()
}

/// A network of the given hidden widths with random weights of the usual size.
pub(crate) fn random_model(numbers: &mut Numbers, hidden: &[usize]) -> Value {
    let example: Value =
        serde_json::from_str(include_str!("../../../guidance/tests/data/mlp_a.json")).unwrap();
    let mut layers = Vec::new();
    let mut inputs = 20;
    for (k, &units) in hidden.iter().chain(&[3]).enumerate() {
        let size = (6.0 / inputs as f64).sqrt();
        let mut row = |n: usize, size: f64| -> Vec<f64> {
            (0..n).map(|_| numbers.between(-size, size)).collect()
        };
        let kernel: Vec<Vec<f64>> = (0..inputs).map(|_| row(units, size)).collect();
        let activation = if k == hidden.len() { "linear" } else { "relu" };
        layers.push(json!({
            "type": "dense", "units": units, "activation": activation,
            "kernel": kernel, "bias": row(units, 0.5),
        }));
        inputs = units;
    }
    let output =
        |c: &str| json!({"name": format!("contrast_{c}"), "unit": "8bit_counts", "scale": 5.0});
    json!({
        "format": "uw-mlp", "version": 1,
        "inputs": example["inputs"], "normalisation": example["normalisation"],
        "layers": layers, "outputs": [output("r"), output("g"), output("b")],
    })
}

/// A model that predicts the picture's own contrast and what `per_m` and `per_pct` add for each metre and percent of
/// change. It states the ranges of the paper's grid, its camera and its residuals.
pub(crate) fn echo_model(per_m: f64, per_pct: f64) -> Value {
    let example: Value =
        serde_json::from_str(include_str!("../../../guidance/tests/data/mlp_a.json")).unwrap();
    let mut inputs = example["inputs"].clone();
    let mut kernel = vec![vec![0.0; 3]; 20];
    for (row, input) in inputs.as_array_mut().unwrap().iter_mut().enumerate() {
        let name = input["name"].as_str().unwrap().to_owned();
        let channel = ["std_r", "std_g", "std_b"].iter().position(|&n| n == name);
        if let Some(channel) = channel {
            kernel[row][channel] = 1.0;
        }
        match name.as_str() {
            "delta_distance" => kernel[row] = vec![per_m; 3],
            "delta_light" => kernel[row] = vec![per_pct; 3],
            _ => {}
        }
        let (min, max) = match name.as_str() {
            "distance" => (0.5, 3.0),
            "light" => (0.0, 100.0),
            "depth" => (1.0, 5.0),
            "delta_distance" => (-2.5, 2.5),
            "delta_light" => (-100.0, 100.0),
            name if name.starts_with("mean") => (2.0, 180.0),
            name if name.starts_with("std") => (1.0, 40.0),
            name if name.starts_with("kz") => (0.0, 1.0),
            _ => (0.0, 60.0),
        };
        input["min"] = json!(min);
        input["max"] = json!(max);
    }
    let output = |c: &str| json!({"name": format!("contrast_{c}"), "unit": "8bit_counts"});
    json!({
        "format": "uw-mlp", "version": 1, "inputs": inputs,
        "normalisation": {"mean": vec![0.0; 20], "std": vec![1.0; 20]},
        "layers": [{"type": "dense", "units": 3, "activation": "linear", "kernel": kernel,
                    "bias": [0.0, 0.0, 0.0]}],
        "outputs": [output("r"), output("g"), output("b")],
        "camera": {"width_px": 1280, "height_px": 720, "hfov_deg": 60.0},
        "training": {"textures": ["hull_red"], "residual_here": {"median": 0.05, "p99": 0.3}},
    })
}
