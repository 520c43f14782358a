//! Where the picture is in the window, and how much of it is seen.

use egui::{Rect, Vec2, vec2};
use glam::DVec2;

use crate::model::zoom::{Place, Zoom};

/// Where the picture is, and what of it is seen.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// The part of the window that is for it.
    pub area: Rect,
    /// All of the picture, which may reach over its part of the window.
    pub picture: Rect,
    /// What of it is seen.
    pub visible: Rect,
    /// The place for it, without the window.
    pub place: Place,
    zoom: Zoom,
}

impl Seen {
    /// A picture of `proportions` whose pixels, fitting, have a side of `pixel_side` pixels of the screen.
    pub fn new(area: Rect, zoom: Zoom, proportions: Vec2, pixel_side: f64) -> Self {
        let place = place(area, proportions, pixel_side);
        let picture = placed(area, &zoom, &place);
        Self {
            area,
            picture,
            visible: picture.intersect(area),
            place,
            zoom,
        }
    }

    /// Where a picture of other proportions is at the same zoom.
    pub fn other(&self, proportions: Vec2) -> Rect {
        let place = place(self.area, proportions, 1.0);
        placed(self.area, &self.zoom, &place)
    }

    /// The part that is seen, in [0, 1] from the picture's upper left corner.
    pub fn part(&self) -> Rect {
        let share = |at: egui::Pos2| ((at - self.picture.min) / self.picture.size()).to_pos2();
        Rect::from_min_max(share(self.visible.min), share(self.visible.max))
    }

    /// A place of the picture in the window.
    pub fn at(&self, share: DVec2) -> egui::Pos2 {
        self.picture.min + vec2(share.x as f32, share.y as f32) * self.picture.size()
    }

    /// What of the picture is at a place in the window, in [0, 1] from its upper left corner.
    pub fn share(&self, at: egui::Pos2) -> DVec2 {
        let share = (at - self.picture.min) / self.picture.size();
        DVec2::new(f64::from(share.x), f64::from(share.y))
    }
}

fn place(area: Rect, proportions: Vec2, pixel_side: f64) -> Place {
    let scale = (area.size() / proportions).min_elem();
    let fitted = proportions * scale;
    Place {
        room: double(area.size()),
        fitted: double(fitted),
        one_to_one: 1.0 / pixel_side,
    }
}

fn placed(area: Rect, zoom: &Zoom, place: &Place) -> Rect {
    let (corner, size) = zoom.rect(place);
    let single = |v: DVec2| vec2(v.x as f32, v.y as f32);
    Rect::from_min_size(area.center() + single(corner), single(size))
}

fn double(v: Vec2) -> DVec2 {
    DVec2::new(f64::from(v.x), f64::from(v.y))
}
