//! Stage 5: fitting the network, with Adam on the mean absolute error.

use std::time::Instant;

use burn::module::Module;
use burn::optim::{AdamConfig, GradientsParams, ModuleOptimizer};
use burn::tensor::{Device, Tensor, TensorData};
use serde::Serialize;

use crate::columns::{CONTRAST_SCALE_COUNTS, INPUTS, OUTPUTS, inputs};
use crate::model_file::Dense;
use crate::network::{Network, numbers};
use crate::normalisation::Normalisation;
use crate::rng::{Rng, Use};
use crate::{Error, Model, Split, SplitBy, Table};

/// Added to the root of Adam's second moment; 1e-7 as in Keras.
const ADAM_EPSILON: f32 = 1e-7;
/// Most units in a hidden layer.
const MOST_HIDDEN: usize = 4096;
/// Rows predicted at once when errors are measured; any number gives the same result up to rounding.
const ROWS_PER_PREDICTION: usize = 4096;

/// How the step size changes over the training.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Schedule {
    /// The same throughout.
    Constant,
    /// Falls to nothing along half a cosine.
    Cosine,
}

impl Schedule {
    /// The word that stands for it on the command line and in the report.
    pub fn word(self) -> &'static str {
        match self {
            Self::Constant => "constant",
            Self::Cosine => "cosine",
        }
    }

    /// Factor on the step size when `done` in [0, 1) of the training is over.
    fn factor(self, done: f64) -> f64 {
        match self {
            Self::Constant => 1.0,
            Self::Cosine => 0.5 * (1.0 + (std::f64::consts::PI * done).cos()),
        }
    }
}

/// How to train.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Units in each of the two hidden layers, >= 1.
    pub hidden: usize,
    /// How the step size changes.
    pub schedule: Schedule,
    /// Passes over the training rows, >= 1.
    pub epochs: usize,
    /// Rows per step, >= 1.
    pub batch: usize,
    /// Adam's step size, > 0 and finite.
    pub learning_rate: f64,
    /// Part of the rows or environments kept for the test, in (0, 1).
    pub test_fraction: f64,
    /// What is drawn for the test.
    pub split: SplitBy,
    /// False trains without the nine calibration inputs; the model file then still names them,
    /// with zero weights.
    pub calibration: bool,
    /// Seed of the split, the initial weights and the order of the rows.
    pub seed: u64,
}

impl Default for Settings {
    /// The published recipe: 20-128-128-3, 25 epochs, 20 % test rows.
    fn default() -> Self {
        Self {
            hidden: 128,
            schedule: Schedule::Constant,
            epochs: 25,
            batch: 32,
            learning_rate: 1e-3,
            test_fraction: 0.2,
            split: SplitBy::Row,
            calibration: true,
            seed: 0,
        }
    }
}

impl Settings {
    /// Checks every field against its range.
    ///
    /// # Errors
    /// Names the first field that is outside, with its range.
    pub fn check(&self) -> Result<(), Error> {
        let refuse = |name, expected, got| {
            Err(Error::Setting {
                name,
                expected,
                got,
            })
        };
        if !(1..=MOST_HIDDEN).contains(&self.hidden) {
            return refuse("hidden", "1 to 4096", self.hidden.to_string());
        }
        if self.epochs == 0 {
            return refuse("epochs", "at least 1", self.epochs.to_string());
        }
        if self.batch == 0 {
            return refuse("batch", "at least 1", self.batch.to_string());
        }
        if !(self.learning_rate > 0.0 && self.learning_rate.is_finite()) {
            let got = self.learning_rate.to_string();
            return refuse("learning-rate", "finite and > 0", got);
        }
        if !(self.test_fraction > 0.0 && self.test_fraction < 1.0) {
            let got = self.test_fraction.to_string();
            return refuse("test-fraction", "between 0 and 1, both excluded", got);
        }
        Ok(())
    }

    fn diverged(&self, epoch: usize) -> Error {
        Error::Diverged {
            epoch,
            learning_rate: self.learning_rate,
        }
    }
}

/// One pass over the training rows.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Epoch {
    /// Number, from 1.
    pub epoch: usize,
    /// Mean absolute error while training, over the epoch and the three outputs, 8-bit counts.
    pub train_mae_counts: f64,
    /// Mean absolute error over the test rows after the epoch, 8-bit counts.
    pub test_mae_counts: f64,
    /// Wall-clock time of the epoch with its test, s.
    pub seconds: f64,
}

/// A trained network and what it took.
#[derive(Clone, Debug)]
pub struct Trained {
    /// The network after the last epoch.
    pub model: Model,
    /// The learning curve; the last epoch's model is kept whatever its test error, so that the
    /// test rows have no part in choosing it.
    pub curve: Vec<Epoch>,
    /// The rows used for training and test.
    pub split: Split,
    /// How they were split.
    pub by: SplitBy,
    /// Whether the calibration inputs were used.
    pub calibration: bool,
    /// Predicted contrast of the training rows after the last epoch, 8-bit counts, in the order of `split.train`.
    pub train_predictions: Vec<[f32; OUTPUTS]>,
    /// Predicted contrast of the test rows after the last epoch, 8-bit counts, in the order of `split.test`.
    pub test_predictions: Vec<[f32; OUTPUTS]>,
}

/// Trains a network on a table. `progress` sees every epoch as it ends.
///
/// # Errors
/// When a setting is outside its range, the table does not allow the split, or the error becomes
/// infinite or NaN.
pub fn train(
    table: &Table,
    settings: &Settings,
    mut progress: impl FnMut(&Epoch),
) -> Result<Trained, Error> {
    settings.check()?;
    let split = Split::draw(table, settings.split, settings.test_fraction, settings.seed)?;
    let mut used = [false; INPUTS];
    for (used, input) in used.iter_mut().zip(inputs(table.offsets)) {
        *used = settings.calibration || !input.calibration;
    }
    let normalisation = Normalisation::of(&table.inputs, &split.train);
    let rows = Rows::new(table, &normalisation, &used);

    let device = Device::flex().autodiff();
    let mut weights = Rng::new(settings.seed, Use::Weights);
    let mut fit = Fit {
        network: Network::new(&used, settings.hidden, &mut weights, &device),
        adam: AdamConfig::new().with_epsilon(ADAM_EPSILON).init(),
        device,
    };
    let mut order_rng = Rng::new(settings.seed, Use::RowOrder);
    let mut order = split.train.clone();
    let mut curve = Vec::with_capacity(settings.epochs);
    for epoch in 1..=settings.epochs {
        let started = Instant::now();
        order_rng.shuffle(&mut order);
        let train_mae_counts = fit.pass(&rows, &order, settings, epoch - 1)?;
        let test = predict(&fit.network, &rows, &split.test)?;
        let entry = Epoch {
            epoch,
            train_mae_counts,
            test_mae_counts: mean(&mae_counts(&test, table, &split.test)),
            seconds: started.elapsed().as_secs_f64(),
        };
        if !(entry.train_mae_counts.is_finite() && entry.test_mae_counts.is_finite()) {
            return Err(settings.diverged(epoch));
        }
        progress(&entry);
        curve.push(entry);
    }
    let layers = fit.network.layers()?;
    // A ReLU can hide a NaN weight from the error.
    if !layers.iter().all(Dense::is_finite) {
        return Err(settings.diverged(settings.epochs));
    }
    let mut model = Model::new(table.offsets, &normalisation, layers);
    model.describe(table, &split.train, table.pictures.as_ref());
    Ok(Trained {
        train_predictions: predict(&fit.network, &rows, &split.train)?,
        test_predictions: predict(&fit.network, &rows, &split.test)?,
        model,
        curve,
        split,
        by: settings.split,
        calibration: settings.calibration,
    })
}

/// Mean absolute error per output, 8-bit counts, of predictions for the listed rows (not empty).
pub fn mae_counts(predicted: &[[f32; OUTPUTS]], table: &Table, rows: &[usize]) -> [f64; OUTPUTS] {
    let mut sums = [0.0; OUTPUTS];
    for (predicted, &row) in predicted.iter().zip(rows) {
        for (k, sum) in sums.iter_mut().enumerate() {
            *sum += f64::from(predicted[k] - table.contrast[row][k]).abs();
        }
    }
    sums.map(|sum| sum / rows.len() as f64)
}

/// Mean over the outputs.
pub(crate) fn mean(per_output: &[f64; OUTPUTS]) -> f64 {
    per_output.iter().sum::<f64>() / OUTPUTS as f64
}

/// All rows of a table as the network sees them.
struct Rows {
    inputs: Vec<[f32; INPUTS]>,
    contrast: Vec<[f32; OUTPUTS]>,
}

impl Rows {
    /// Normalises the inputs, zeroes those not used and scales the outputs.
    fn new(table: &Table, normalisation: &Normalisation, used: &[bool; INPUTS]) -> Self {
        let normalise = |row| {
            let row = normalisation.apply(row);
            std::array::from_fn(|k| if used[k] { row[k] } else { 0.0 })
        };
        let scale = |row: &[f32; OUTPUTS]| row.map(|counts| counts / CONTRAST_SCALE_COUNTS);
        Self {
            inputs: table.inputs.iter().map(normalise).collect(),
            contrast: table.contrast.iter().map(scale).collect(),
        }
    }
}

/// The listed rows as a tensor [rows][N].
fn gather<const N: usize>(values: &[[f32; N]], rows: &[usize], device: &Device) -> Tensor<2> {
    let flat: Vec<f32> = rows.iter().flat_map(|&row| values[row]).collect();
    Tensor::from_data(TensorData::new(flat, [rows.len(), N]), device)
}

/// The network while it is trained.
struct Fit {
    network: Network,
    adam: ModuleOptimizer,
    device: Device,
}

impl Fit {
    /// One epoch over the rows in the given order; the mean absolute error on the way, in counts.
    fn pass(
        &mut self,
        rows: &Rows,
        order: &[usize],
        settings: &Settings,
        epochs_done: usize,
    ) -> Result<f64, Error> {
        let mut sum = 0.0;
        for (i, batch) in order.chunks(settings.batch).enumerate() {
            let of_epoch = (i * settings.batch) as f64 / order.len() as f64;
            let done = (epochs_done as f64 + of_epoch) / settings.epochs as f64;
            let rate = settings.learning_rate * settings.schedule.factor(done);
            sum += f64::from(self.step(rows, batch, rate)?) * batch.len() as f64;
        }
        Ok(sum / order.len() as f64 * f64::from(CONTRAST_SCALE_COUNTS))
    }

    /// One step of Adam; the mean absolute error before it, in units of the contrast scale.
    fn step(&mut self, rows: &Rows, batch: &[usize], learning_rate: f64) -> Result<f32, Error> {
        let inputs = gather(&rows.inputs, batch, &self.device);
        let contrast = gather(&rows.contrast, batch, &self.device);
        let loss = (self.network.forward(inputs) - contrast).abs().mean();
        let gradients = GradientsParams::from_grads(loss.clone().backward(), &self.network);
        self.network = self
            .adam
            .step(learning_rate, self.network.clone(), gradients);
        loss.try_into_scalar::<f32>()
            .map_err(|error| Error::Backend(error.to_string()))
    }
}

/// Predicted contrast of the listed rows in 8-bit counts.
fn predict(network: &Network, rows: &Rows, chosen: &[usize]) -> Result<Vec<[f32; OUTPUTS]>, Error> {
    let network = network.valid();
    let device = Device::flex();
    let mut predictions = Vec::with_capacity(chosen.len());
    for part in chosen.chunks(ROWS_PER_PREDICTION) {
        let flat = numbers(network.forward(gather(&rows.inputs, part, &device)))?;
        let (in_rows, _) = flat.as_chunks::<OUTPUTS>();
        predictions.extend(
            in_rows
                .iter()
                .map(|row| row.map(|y| y * CONTRAST_SCALE_COUNTS)),
        );
    }
    Ok(predictions)
}
