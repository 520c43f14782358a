//! Stage 4: inputs brought to mean 0 and standard deviation 1 over the training rows.

use serde::Serialize;

use crate::columns::INPUTS;

/// Mean and standard deviation per input, in the input's unit. Kept in 32 bits, as the model file
/// states them, so that the network is trained on exactly what its users compute.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Normalisation {
    /// Mean over the training rows.
    pub mean: [f32; INPUTS],
    /// Population standard deviation over the training rows, > 0; 1 for an input that never varies.
    pub std: [f32; INPUTS],
}

impl Normalisation {
    /// Computed from the listed rows; `rows` must not be empty.
    pub fn of(inputs: &[[f32; INPUTS]], rows: &[usize]) -> Self {
        let columns: [(f32, f32); INPUTS] = std::array::from_fn(|column| {
            mean_and_std(|| rows.iter().map(|&row| inputs[row][column]))
        });
        Self {
            mean: columns.map(|(mean, _)| mean),
            std: columns.map(|(_, std)| std),
        }
    }

    /// One row, normalised.
    pub fn apply(&self, row: &[f32; INPUTS]) -> [f32; INPUTS] {
        std::array::from_fn(|k| (row[k] - self.mean[k]) / self.std[k])
    }
}

/// Mean and population standard deviation; 1 for the latter where the values do not vary.
fn mean_and_std<I: Iterator<Item = f32>>(values: impl Fn() -> I) -> (f32, f32) {
    let count = values().count() as f64;
    let mean = values().map(f64::from).sum::<f64>() / count;
    let squares = values().map(|x| (f64::from(x) - mean).powi(2)).sum::<f64>();
    let std = (squares / count).sqrt() as f32;
    // Compared with each other, because the rounded mean of equal values may differ from them.
    let varies = values().zip(values().skip(1)).any(|(x, y)| x != y);
    // A spread that underflows is as good as none.
    let std = if varies && std > 0.0 { std } else { 1.0 };
    (mean as f32, std)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uses_only_the_listed_rows_and_guards_constants() {
        let mut inputs = vec![[0.1f32; INPUTS]; 4];
        for (row, values) in inputs.iter_mut().enumerate() {
            values[0] = [1.0, 3.0, 5.0, 1000.0][row];
        }
        let normalisation = Normalisation::of(&inputs, &[0, 1, 2]);
        assert_eq!(normalisation.mean[0], 3.0);
        // Population standard deviation of 1, 3, 5 is sqrt(8/3).
        assert!((normalisation.std[0] - (8.0f32 / 3.0).sqrt()).abs() < 1e-6);
        // 0.1 is no binary fraction: the rounded mean may differ from it, the spread must not show.
        assert_eq!(normalisation.std[1], 1.0);
        let row = normalisation.apply(&inputs[1]);
        assert_eq!(row[0], 0.0);
        assert!(row[1].abs() < 1e-7);
    }
}
