//! The report of an operation: Markdown, tables, plots, contact sheets.

mod contact;
mod csv;
mod curves;
mod markdown;
mod published;

use std::path::Path;

use uw_guidance::features::Candidate;

use super::Operation;
use super::config::OperationConfig;
use super::flight::Water;
use super::summary::MethodResult;
use crate::error::EvalError;
use crate::files::write_text;
pub use contact::Sheet;

/// Name of the report.
pub const REPORT: &str = "report.md";
/// Views of each leg in a contact sheet.
const SHOWN_PER_LEG: usize = 2;

/// Pictures for the contact sheet of one water, first repetition.
pub struct Pictures {
    sheet: Sheet,
}

impl Pictures {
    /// Takes the pictures that the methods kept.
    pub fn of(water: &Water, methods: &[MethodResult]) -> Result<Self, EvalError> {
        let config = water.config;
        let shown: Vec<usize> = (0..config.depths_m.len())
            .flat_map(|leg| {
                let of_leg = |k: usize| (2 * k + 1) * config.views_per_leg / (2 * SHOWN_PER_LEG);
                (0..SHOWN_PER_LEG).map(move |k| leg * config.views_per_leg + of_leg(k))
            })
            .collect();
        let columns = shown.iter().map(|&i| {
            let depth_m = config.depths_m[i / config.views_per_leg];
            format!("{depth_m} m deep, view {}", i % config.views_per_leg + 1)
        });
        let mut rows = Vec::new();
        for result in methods {
            let Some(flight) = result.flights.first() else {
                continue;
            };
            let picture = |&i: &usize| {
                let step = &flight[i];
                let candidate = Candidate {
                    distance_m: step.view_distance_m,
                    ..step.chosen
                };
                water.frame(&step.place, candidate, super::flight::KEPT_FIRST)
            };
            let frames = shown.iter().map(picture).collect::<Result<_, _>>()?;
            rows.push((result.method.name(), frames));
        }
        Ok(Self {
            sheet: Sheet {
                columns: columns.collect(),
                rows,
            },
        })
    }
}

/// Writes report, tables, plots and contact sheets into a folder.
pub fn write(config: &OperationConfig, found: &Operation, folder: &Path) -> Result<(), EvalError> {
    csv::write(config, found, folder)?;
    for water in &found.waters {
        let name = &water.water.name;
        let profile = folder.join(format!("profile_{name}.json"));
        water.profile.write(&profile)?;
        curves::write(config, water, folder)?;
        let sheet = folder.join(format!("contact_{name}.jpg"));
        water.pictures.sheet.write(&sheet)?;
    }
    write_text(&folder.join(REPORT), &markdown::text(config, found))
}
