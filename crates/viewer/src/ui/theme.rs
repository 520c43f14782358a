//! Colours and spacing.

use egui::{Color32, Theme, Ui, Visuals};

/// Colours of the channels in plots, for dark and light.
pub fn channel_colours(ui: &Ui) -> [Color32; 3] {
    if ui.visuals().dark_mode {
        [
            Color32::from_rgb(235, 100, 90),
            Color32::from_rgb(95, 200, 110),
            Color32::from_rgb(100, 150, 245),
        ]
    } else {
        [
            Color32::from_rgb(200, 50, 45),
            Color32::from_rgb(30, 140, 60),
            Color32::from_rgb(40, 90, 200),
        ]
    }
}

/// Names of the channels.
pub const CHANNELS: [&str; 3] = ["R", "G", "B"];

/// What lies around the picture.
pub fn backdrop(ui: &Ui) -> Color32 {
    if ui.visuals().dark_mode {
        Color32::from_gray(14)
    } else {
        Color32::from_gray(190)
    }
}

/// Colour of marks for what is right now, against that of suggestions.
pub const HERE: Color32 = Color32::WHITE;
/// Colour of marks for suggestions.
pub const SUGGESTED: Color32 = Color32::from_rgb(255, 80, 160);

/// Sets the look of both themes.
pub fn set(ctx: &egui::Context) {
    let accent = Color32::from_rgb(0, 122, 150);
    for (theme, mut visuals) in [
        (Theme::Dark, Visuals::dark()),
        (Theme::Light, Visuals::light()),
    ] {
        visuals.selection.bg_fill = accent;
        visuals.selection.stroke.color = Color32::WHITE;
        visuals.slider_trailing_fill = true;
        ctx.set_visuals_of(theme, visuals);
    }
    ctx.all_styles_mut(|style| {
        style.spacing.slider_width = 150.0;
        style.spacing.item_spacing = egui::vec2(8.0, 5.0);
    });
}
