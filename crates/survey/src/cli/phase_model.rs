//! A phase function from command-line options, the same models and parameters as in scene files.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use uw_media::MediaError;
use uw_media::phase::{Draine, FournierForand, HenyeyGreenstein, Phase, Rayleigh, Tabulated};

use super::error::CliError;

/// Which phase function, and its parameters.
#[derive(Debug, Args)]
pub(super) struct PhaseModel {
    /// The model.
    #[arg(long, value_enum)]
    model: ModelName,
    /// fournier-forand: refractive index of the particles relative to the water, in (1, 10].
    #[arg(long, allow_negative_numbers = true)]
    n: Option<f64>,
    /// fournier-forand: share of the light scattered by more than 90°, in (0, 0.5).
    #[arg(long, allow_negative_numbers = true)]
    backscatter_fraction: Option<f64>,
    /// fournier-forand: slope of the size distribution, in (3, 5), instead of the backscatter fraction.
    #[arg(
        long,
        allow_negative_numbers = true,
        conflicts_with = "backscatter_fraction"
    )]
    mu: Option<f64>,
    /// henyey-greenstein, draine: the parameter g, in (-1, 1).
    #[arg(long, allow_negative_numbers = true)]
    g: Option<f64>,
    /// draine: the parameter alpha.
    #[arg(long, allow_negative_numbers = true)]
    alpha: Option<f64>,
    /// rayleigh: depolarisation ratio, in [0, 1]. Default: 0.
    #[arg(long, allow_negative_numbers = true)]
    depolarisation: Option<f64>,
    /// table: CSV file with the columns angle in degrees and phase function in any unit.
    #[arg(long)]
    file: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ModelName {
    FournierForand,
    HenyeyGreenstein,
    Rayleigh,
    Petzold,
    Draine,
    Isotropic,
    Table,
}

impl ModelName {
    /// The options it takes.
    fn parameters(self) -> &'static [&'static str] {
        match self {
            Self::FournierForand => &["--n", "--backscatter-fraction", "--mu"],
            Self::HenyeyGreenstein => &["--g"],
            Self::Rayleigh => &["--depolarisation"],
            Self::Draine => &["--g", "--alpha"],
            Self::Table => &["--file"],
            Self::Petzold | Self::Isotropic => &[],
        }
    }
}

impl PhaseModel {
    /// The phase function.
    ///
    /// # Errors
    /// A parameter that is missing, out of range, or of another model; a table that cannot be used.
    pub(super) fn phase(&self) -> Result<Phase, CliError> {
        self.refuse_others()?;
        let g = || self.needed("--g", self.g);
        let phase = match self.model {
            ModelName::FournierForand => self.fournier_forand()?.map(Phase::FournierForand),
            ModelName::HenyeyGreenstein => HenyeyGreenstein::new(g()?).map(Phase::HenyeyGreenstein),
            ModelName::Rayleigh => {
                Rayleigh::new(self.depolarisation.unwrap_or(0.0)).map(Phase::Rayleigh)
            }
            ModelName::Petzold => Ok(Phase::Tabulated(Tabulated::petzold())),
            ModelName::Draine => {
                Draine::new(g()?, self.needed("--alpha", self.alpha)?).map(Phase::Draine)
            }
            ModelName::Isotropic => Ok(Phase::Isotropic),
            ModelName::Table => {
                let file = self.needed("--file", self.file.as_deref())?;
                Tabulated::from_csv(file).map(Phase::Tabulated)
            }
        };
        phase.map_err(CliError::input)
    }

    fn fournier_forand(&self) -> Result<Result<FournierForand, MediaError>, CliError> {
        let n = self.needed("--n", self.n)?;
        if let Some(mu) = self.mu {
            return Ok(FournierForand::from_mu(n, mu));
        }
        let fraction = self.needed("--backscatter-fraction or --mu", self.backscatter_fraction)?;
        Ok(FournierForand::new(n, fraction))
    }

    fn needed<T>(&self, option: &str, value: Option<T>) -> Result<T, CliError> {
        value.ok_or_else(|| CliError::input(format!("--model {} needs {option}", self.name())))
    }

    fn refuse_others(&self) -> Result<(), CliError> {
        let given = [
            ("--n", self.n.is_some()),
            (
                "--backscatter-fraction",
                self.backscatter_fraction.is_some(),
            ),
            ("--mu", self.mu.is_some()),
            ("--g", self.g.is_some()),
            ("--alpha", self.alpha.is_some()),
            ("--depolarisation", self.depolarisation.is_some()),
            ("--file", self.file.is_some()),
        ];
        let own = self.model.parameters();
        let Some((option, _)) = given
            .iter()
            .find(|(option, is_given)| *is_given && !own.contains(option))
        else {
            return Ok(());
        };
        let takes = if own.is_empty() {
            "no parameters".to_owned()
        } else {
            own.join(", ")
        };
        let name = self.name();
        Err(CliError::input(format!(
            "{option} means nothing to --model {name}, which takes {takes}"
        )))
    }

    /// The model's name as the user writes it.
    fn name(&self) -> String {
        self.model
            .to_possible_value()
            .map_or_else(String::new, |value| value.get_name().to_owned())
    }
}
