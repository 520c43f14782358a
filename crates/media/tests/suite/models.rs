//! The grid of phase functions that every test runs over, ugly corners included.

use std::sync::LazyLock;

use uw_media::MediaError;
use uw_media::phase::{
    Draine, FournierForand, HenyeyGreenstein, Mixture, Phase, PhaseTable, Rayleigh, Tabulated,
};

/// A phase function, its name in messages, and its table.
pub(crate) struct Model {
    pub(crate) name: String,
    pub(crate) phase: Phase,
    pub(crate) table: PhaseTable,
    /// Whether the density is smooth and nowhere 0.
    pub(crate) smooth: bool,
}

/// Every model, made once.
pub(crate) fn every_model() -> &'static [Model] {
    static MODELS: LazyLock<Vec<Model>> = LazyLock::new(|| {
        let analytic = analytic().expect("valid parameters").into_iter();
        let others = tables_and_mixtures().expect("valid parameters").into_iter();
        let model = |(name, phase), smooth| Model {
            name,
            table: PhaseTable::new(&phase),
            phase,
            smooth,
        };
        analytic
            .map(|named| model(named, true))
            .chain(others.map(|named| model(named, false)))
            .collect()
    });
    &MODELS
}

fn analytic() -> Result<Vec<(String, Phase)>, MediaError> {
    let mut models = vec![("isotropic".to_owned(), Phase::Isotropic)];
    for g in [-0.99, -0.5, 0.0, 0.5, 0.924, 0.99, 0.9999] {
        models.push((
            format!("HG {g}"),
            Phase::HenyeyGreenstein(HenyeyGreenstein::new(g)?),
        ));
    }
    for rho in [0.0, 0.09, 1.0] {
        models.push((
            format!("Rayleigh {rho}"),
            Phase::Rayleigh(Rayleigh::new(rho)?),
        ));
    }
    for (g, alpha) in [
        (-0.6, 1.0),
        (0.0, 1.0),
        (0.9, 1.0),
        (0.7, 30.0),
        (0.97, 0.2),
    ] {
        models.push((
            format!("Draine {g} {alpha}"),
            Phase::Draine(Draine::new(g, alpha)?),
        ));
    }
    // δ(180°) = 1 and δ(90°) = 1 sit at the last two indices.
    let indices = [
        1.001,
        1.01,
        1.05,
        1.10,
        1.2,
        1.33,
        1.5,
        1.0 + (2.0_f64 / 3.0).sqrt(),
        1.0 + (4.0_f64 / 3.0).sqrt(),
    ];
    for n in indices {
        for b in [1e-4, 0.005, 0.0183, 0.1, 0.4, 0.499] {
            models.push((
                format!("FF n {n:.4} B {b}"),
                Phase::FournierForand(FournierForand::new(n, b)?),
            ));
        }
    }
    Ok(models)
}

fn tables_and_mixtures() -> Result<Vec<(String, Phase)>, MediaError> {
    let hg = |g| HenyeyGreenstein::new(g).map(Phase::HenyeyGreenstein);
    let coarse = Tabulated::from_table(
        &[1.0, 5.0, 20.0, 60.0, 100.0, 150.0, 175.0],
        &[100.0, 20.0, 1.5, 0.1, 0.03, 0.05, 0.08],
    )?;
    let with_gap = Tabulated::from_table(
        &[0.0, 5.0, 30.0, 60.0, 120.0, 180.0],
        &[40.0, 1.0, 0.0, 0.0, 0.5, 0.0],
    )?;
    let water = Phase::Rayleigh(Rayleigh::new(0.09)?);
    let particles = Phase::FournierForand(FournierForand::new(1.1, 0.0183)?);
    Ok(vec![
        ("Petzold".to_owned(), Phase::Tabulated(Tabulated::petzold())),
        ("coarse table".to_owned(), Phase::Tabulated(coarse)),
        ("table with a gap".to_owned(), Phase::Tabulated(with_gap)),
        (
            "water and particles".to_owned(),
            Phase::Mixture(Mixture::new(vec![(0.002, water), (0.998, particles)])?),
        ),
        (
            "two opposite peaks".to_owned(),
            Phase::Mixture(Mixture::new(vec![(0.5, hg(0.99)?), (0.5, hg(-0.99)?)])?),
        ),
        (
            "mixture in a mixture".to_owned(),
            Phase::Mixture(Mixture::new(vec![
                (0.3, Phase::Isotropic),
                (
                    0.7,
                    Phase::Mixture(Mixture::new(vec![(1.0, hg(0.8)?), (2.0, hg(-0.3)?)])?),
                ),
            ])?),
        ),
    ])
}
