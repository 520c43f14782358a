//! Messages that appear in a corner and leave again.

use std::time::{Duration, Instant};

use egui::{Align2, Area, Color32, Frame, Id, Order, RichText};

/// Most messages at once.
const MOST: usize = 5;

/// How much a message matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// Something was done.
    Info,
    /// Something is not as one might think.
    Warning,
    /// Something did not work.
    Error,
}

impl Level {
    fn shown_for(self) -> Duration {
        match self {
            Self::Info => Duration::from_secs(4),
            Self::Warning => Duration::from_secs(8),
            Self::Error => Duration::from_secs(15),
        }
    }

    fn colour(self) -> Color32 {
        match self {
            Self::Info => Color32::from_rgb(0, 122, 150),
            Self::Warning => Color32::from_rgb(190, 130, 0),
            Self::Error => Color32::from_rgb(200, 60, 50),
        }
    }
}

/// A message.
#[derive(Clone, Debug)]
pub struct Toast {
    /// How much it matters.
    pub level: Level,
    /// What it says.
    pub text: String,
    since: Instant,
}

/// The messages on the screen.
#[derive(Clone, Debug, Default)]
pub struct Toasts(Vec<Toast>);

impl Toasts {
    /// Says that something was done.
    pub fn info(&mut self, text: impl Into<String>) {
        self.add(Level::Info, text.into());
    }

    /// Says that something is not as one might think.
    pub fn warn(&mut self, text: impl Into<String>) {
        self.add(Level::Warning, text.into());
    }

    /// Says that something did not work, and what would be right.
    pub fn error(&mut self, text: impl Into<String>) {
        self.add(Level::Error, text.into());
    }

    fn add(&mut self, level: Level, text: String) {
        self.0.retain(|toast| toast.text != text);
        if self.0.len() == MOST {
            self.0.remove(0);
        }
        self.0.push(Toast {
            level,
            text,
            since: Instant::now(),
        });
    }

    /// The messages, the oldest first.
    pub fn all(&self) -> &[Toast] {
        &self.0
    }

    /// Shows the messages; a click takes one away.
    pub fn show(&mut self, ctx: &egui::Context) {
        self.0.retain(|t| t.since.elapsed() < t.level.shown_for());
        if self.0.is_empty() {
            return;
        }
        ctx.request_repaint_after(Duration::from_millis(500));
        let mut clicked = None;
        Area::new(Id::unique("toasts"))
            .order(Order::Foreground)
            .anchor(Align2::RIGHT_BOTTOM, [-12.0, -36.0])
            .show(ctx, |ui| {
                for (i, toast) in self.0.iter().enumerate() {
                    let frame = Frame::popup(ui.style()).stroke((1.5, toast.level.colour()));
                    frame.show(ui, |ui| {
                        ui.set_max_width(420.0);
                        ui.horizontal_top(|ui| {
                            ui.label(RichText::new("•").heading().color(toast.level.colour()));
                            ui.add(egui::Label::new(&toast.text).wrap());
                            if ui.small_button("x").on_hover_text("Dismiss").clicked() {
                                clicked = Some(i);
                            }
                        });
                    });
                    ui.add_space(4.0);
                }
            });
        if let Some(i) = clicked {
            self.0.remove(i);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_message_comes_once_and_the_oldest_goes_first() {
        let mut toasts = Toasts::default();
        for i in 0..8 {
            toasts.error(format!("message {}", i % 7));
        }
        let texts: Vec<_> = toasts.all().iter().map(|t| t.text.as_str()).collect();
        let expected = [
            "message 3",
            "message 4",
            "message 5",
            "message 6",
            "message 0",
        ];
        assert_eq!(texts, expected);
    }
}
