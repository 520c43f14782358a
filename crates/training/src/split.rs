//! Stage 3: rows for training and rows for the test.

use crate::Error;
use crate::columns::ENVIRONMENT;
use crate::rng::{Rng, Use};
use crate::table::{Environments, Table};

/// What is drawn when rows are put aside for the test.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SplitBy {
    /// Single rows. Test rows then share their images and water with training rows, so the test
    /// error says how well the network interpolates, not how well it does in new water.
    Row,
    /// Whole environments: no test row's water and texture is in any training row.
    Environment,
}

impl SplitBy {
    /// The word that stands for it on the command line and in the report.
    pub fn word(self) -> &'static str {
        match self {
            Self::Row => "row",
            Self::Environment => "environment",
        }
    }
}

/// Rows of a table by their use. Both lists are ascending, not empty, and have no row in common.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Split {
    /// Rows that the network is fitted to.
    pub train: Vec<usize>,
    /// Rows that only measure its error.
    pub test: Vec<usize>,
    /// Names of the environments put aside, sorted; empty for a split by row.
    pub test_environments: Vec<String>,
}

impl Split {
    /// Draws a split with `test_fraction` of the rows or environments, at least one on each side.
    ///
    /// # Errors
    /// When a split by environment is asked of a table without environments or with only one.
    pub fn draw(table: &Table, by: SplitBy, test_fraction: f64, seed: u64) -> Result<Self, Error> {
        let mut rng = Rng::new(seed, Use::Split);
        match by {
            SplitBy::Row => {
                let chosen = choose(table.rows(), test_fraction, &mut rng);
                Ok(Self::new(table.rows(), |row| chosen[row], Vec::new()))
            }
            SplitBy::Environment => {
                let environments = table.environments.as_ref().ok_or(Error::NoEnvironments {
                    column: ENVIRONMENT,
                })?;
                Self::by_environment(environments, test_fraction, &mut rng)
            }
        }
    }

    fn by_environment(
        environments: &Environments,
        test_fraction: f64,
        rng: &mut Rng,
    ) -> Result<Self, Error> {
        let got = environments.names.len();
        if got < 2 {
            return Err(Error::TooFewEnvironments { got });
        }
        // Sorted first, so that the draw does not depend on the order of the rows.
        let mut by_name: Vec<usize> = (0..got).collect();
        by_name.sort_by_key(|&index| &environments.names[index]);
        let chosen = choose(got, test_fraction, rng);
        let mut is_test = vec![false; got];
        let mut test_environments = Vec::new();
        for (&index, &chosen) in by_name.iter().zip(&chosen) {
            is_test[index] = chosen;
            if chosen {
                test_environments.push(environments.names[index].clone());
            }
        }
        let of_row = &environments.of_row;
        Ok(Self::new(
            of_row.len(),
            |row| is_test[of_row[row]],
            test_environments,
        ))
    }

    fn new(rows: usize, is_test: impl Fn(usize) -> bool, test_environments: Vec<String>) -> Self {
        let (test, train) = (0..rows).partition(|&row| is_test(row));
        Self {
            train,
            test,
            test_environments,
        }
    }
}

/// Marks about `fraction` of `n` >= 2 items at random, at least one and not all.
fn choose(n: usize, fraction: f64, rng: &mut Rng) -> Vec<bool> {
    let count = ((n as f64 * fraction).round() as usize).clamp(1, n - 1);
    let mut marks: Vec<bool> = (0..n).map(|index| index < count).collect();
    rng.shuffle(&mut marks);
    marks
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::columns::{INPUTS, OUTPUTS, Offsets};

    /// 60 rows of the environments e0 to e5 in turn.
    fn table() -> Table {
        Table {
            offsets: Offsets::Delta,
            inputs: vec![[0.0; INPUTS]; 60],
            contrast: vec![[0.0; OUTPUTS]; 60],
            environments: Some(Environments {
                names: (0..6).map(|k| format!("e{k}")).collect(),
                of_row: (0..60).map(|row| row % 6).collect(),
            }),
            std_errors: None,
            pictures: None,
        }
    }

    #[test]
    fn row_split_takes_the_fraction_and_every_row_once() {
        let split = Split::draw(&table(), SplitBy::Row, 0.2, 1).expect("a valid table");
        assert_eq!((split.train.len(), split.test.len()), (48, 12));
        let mut all = [split.train.clone(), split.test.clone()].concat();
        all.sort_unstable();
        assert_eq!(all, (0..60).collect::<Vec<_>>());
        let other = Split::draw(&table(), SplitBy::Row, 0.2, 2).expect("a valid table");
        assert_ne!(split, other, "the seed must matter");
    }

    #[test]
    fn environment_split_shares_no_environment() {
        let split = Split::draw(&table(), SplitBy::Environment, 0.34, 1).expect("a valid table");
        assert_eq!(split.test_environments.len(), 2);
        assert_eq!((split.train.len(), split.test.len()), (40, 20));
        for row in &split.test {
            assert!(split.test_environments.contains(&format!("e{}", row % 6)));
        }
        for row in &split.train {
            assert!(!split.test_environments.contains(&format!("e{}", row % 6)));
        }
    }

    #[test]
    fn each_side_keeps_at_least_one() {
        for fraction in [0.001, 0.999] {
            let split = Split::draw(&table(), SplitBy::Environment, fraction, 1).expect("valid");
            assert!(!split.train.is_empty() && !split.test.is_empty());
        }
    }
}
