//! A phase function against Petzold's average particle, over a logarithmic axis of angles.

use std::sync::OnceLock;

use egui::{Color32, Ui};
use egui_plot::{Line, LineStyle, PlotPoints};
use uw_media::phase::{Phase, PhaseFunction, Tabulated};

use super::knobs::{still_plot, y_axis};

/// Smallest and largest angle of the plot, degrees.
const RANGE_DEG: (f64, f64) = (0.1, 180.0);
/// Points of a curve.
const POINTS: usize = 200;

/// Decimal logarithms of the angle in degrees and of the phase function in 1/sr.
pub fn curve(phase: &Phase) -> Vec<[f64; 2]> {
    let (from, to) = (RANGE_DEG.0.log10(), RANGE_DEG.1.log10());
    (0..POINTS)
        .map(|i| {
            let angle = from + (to - from) * i as f64 / (POINTS - 1) as f64;
            let half = 0.5 * 10_f64.powf(angle).to_radians();
            let value = phase.value(half.sin().powi(2)).max(1e-9);
            [angle, value.log10()]
        })
        .collect()
}

/// The curve of Petzold's average particle.
pub fn petzold() -> &'static [[f64; 2]] {
    static CURVE: OnceLock<Vec<[f64; 2]>> = OnceLock::new();
    CURVE.get_or_init(|| curve(&Phase::Tabulated(Tabulated::petzold())))
}

/// Shows the plot.
pub fn show(ui: &mut Ui, name: &str, phase: &Phase) {
    let ink = ui.visuals().text_color();
    let power = |value: f64| {
        let number = 10_f64.powf(value);
        if (0.01..1e4).contains(&number) {
            format!("{}", (number * 1e4).round() / 1e4)
        } else {
            format!("1e{value:.0}")
        }
    };
    still_plot("phase", 160.0)
        .x_axis_label("scattering angle, degrees")
        .custom_y_axes(vec![
            y_axis("1/sr").formatter(move |mark, _| power(mark.value)),
        ])
        .x_grid_spacer(|input| decades(input.bounds, 1))
        .y_grid_spacer(|input| decades(input.bounds, 2))
        .x_axis_formatter(move |mark, _| power(mark.value))
        .legend(egui_plot::Legend::default())
        .show(ui, |plot| {
            plot.line(
                Line::new("Petzold", PlotPoints::from(petzold().to_vec()))
                    .color(Color32::from_rgb(230, 160, 40))
                    .style(LineStyle::dashed_loose())
                    .width(2.0),
            );
            plot.line(
                Line::new(name, PlotPoints::from(curve(phase)))
                    .color(ink)
                    .width(2.0),
            );
        });
}

/// Marks at every `step`-th power of ten between the bounds.
fn decades((from, to): (f64, f64), step: i32) -> Vec<egui_plot::GridMark> {
    (from.ceil() as i32..=to.floor() as i32)
        .filter(|power| power % step == 0)
        .map(|power| egui_plot::GridMark {
            value: f64::from(power),
            step_size: f64::from(step),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use uw_media::phase::FournierForand;

    #[test]
    fn curves_follow_the_phase_functions() {
        let [angle, value] = curve(&Phase::Isotropic)[17];
        assert!((value - (0.25 / std::f64::consts::PI).log10()).abs() < 1e-12);
        assert!((RANGE_DEG.0.log10()..=RANGE_DEG.1.log10()).contains(&angle));
        // The default particles are close to Petzold's: 0.043 root mean square in log10 was measured.
        let ff = Phase::FournierForand(FournierForand::new(1.10, 0.0183).expect("valid"));
        let squares = curve(&ff)
            .iter()
            .zip(petzold())
            .map(|(a, b)| (a[1] - b[1]).powi(2))
            .sum::<f64>();
        assert!((squares / POINTS as f64).sqrt() < 0.1);
    }
}
