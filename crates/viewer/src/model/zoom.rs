//! Which part of the picture is seen, and how large.

use glam::DVec2;

/// Largest side of a pixel of the picture, pixels of the screen.
const LARGEST_PX: f64 = 64.0;

/// The place that a window has for a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Size of the place, points.
    pub room: DVec2,
    /// Size of the largest picture of these proportions in it, points.
    pub fitted: DVec2,
    /// Factor at which a pixel of the picture is as large as one of the screen.
    pub one_to_one: f64,
}

/// Which part of the picture is seen; at first all of it, as large as its place allows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Zoom {
    /// Size against that at which all of the picture is seen.
    factor: f64,
    /// What of the picture is in the middle of its place, in [0, 1] from the upper left corner.
    middle: DVec2,
}

impl Default for Zoom {
    fn default() -> Self {
        Self {
            factor: 1.0,
            middle: DVec2::splat(0.5),
        }
    }
}

impl Zoom {
    /// Whether all of the picture is seen, as large as its place allows.
    pub fn is_fit(&self) -> bool {
        self.factor == 1.0
    }

    /// What of the picture is in the middle of its place, in [0, 1] from the upper left corner.
    pub fn middle(&self) -> DVec2 {
        self.middle
    }

    /// Side of a pixel of the picture, pixels of the screen.
    pub fn pixel_side(&self, place: &Place) -> f64 {
        self.factor / place.one_to_one
    }

    /// Upper left corner of the picture, points from the middle of its place, and its size, points.
    pub fn rect(&self, place: &Place) -> (DVec2, DVec2) {
        let size = place.fitted * self.factor;
        (-self.within(place).middle * size, size)
    }

    /// Changes the size by `change`; what of the picture is at `at` stays where it is on the screen.
    pub fn by(&mut self, place: &Place, at: DVec2, change: f64) {
        let (corner, size) = self.rect(place);
        let on_screen = corner + at * size;
        let low = place.one_to_one.min(1.0);
        let high = (LARGEST_PX * place.one_to_one).max(1.0);
        // A size next to the fitting one is that one, so that steps in and out come back to it.
        let factor = (self.factor * change).clamp(low, high);
        self.factor = if (factor - 1.0).abs() < 1e-3 {
            1.0
        } else {
            factor
        };
        self.middle = at - on_screen / (place.fitted * self.factor);
        *self = self.within(place);
    }

    /// One pixel of the picture for one of the screen; what is at `at` stays where it is.
    pub fn to_pixels(&mut self, place: &Place, at: DVec2) {
        let change = place.one_to_one / self.factor;
        self.by(place, at, change);
    }

    /// Moves the picture by `points` on the screen, as far as it reaches over its place.
    pub fn shift(&mut self, place: &Place, points: DVec2) {
        self.middle -= points / (place.fitted * self.factor);
        *self = self.within(place);
    }

    /// The same where nothing of the place is empty that the picture could fill.
    fn within(&self, place: &Place) -> Self {
        let half = 0.5 * place.room / (place.fitted * self.factor);
        let axis = |half: f64, middle: f64| match half < 0.5 {
            true => middle.clamp(half, 1.0 - half),
            false => 0.5,
        };
        Self {
            factor: self.factor,
            middle: DVec2::new(axis(half.x, self.middle.x), axis(half.y, self.middle.y)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLACE: Place = Place {
        room: DVec2::new(800.0, 600.0),
        fitted: DVec2::new(800.0, 450.0),
        one_to_one: 0.8,
    };

    #[test]
    fn what_is_under_the_pointer_stays_there() {
        let mut zoom = Zoom::default();
        let at = DVec2::new(0.4, 0.55);
        let place = |zoom: &Zoom| {
            let (corner, size) = zoom.rect(&PLACE);
            corner + at * size
        };
        zoom.by(&PLACE, at, 4.0);
        let before = place(&zoom);
        zoom.by(&PLACE, at, 1.5);
        assert!((place(&zoom) - before).length() < 1e-9);
        assert!((zoom.pixel_side(&PLACE) - 7.5).abs() < 1e-12);
        zoom.by(&PLACE, at, 1.0 / 6.0);
        assert_eq!(zoom, Zoom::default());
    }

    #[test]
    fn sizes_have_ends_and_the_picture_covers_its_place() {
        let mut zoom = Zoom::default();
        zoom.by(&PLACE, DVec2::ZERO, 1e9);
        assert_eq!(zoom.pixel_side(&PLACE), LARGEST_PX);
        zoom.shift(&PLACE, DVec2::splat(1e9));
        let (corner, _) = zoom.rect(&PLACE);
        assert!((corner + 0.5 * PLACE.room).length() < 1e-6, "{corner}");
        zoom.shift(&PLACE, DVec2::splat(-1e9));
        let (corner, size) = zoom.rect(&PLACE);
        assert!((corner + size - 0.5 * PLACE.room).length() < 1e-6);
        zoom.to_pixels(&PLACE, DVec2::splat(0.5));
        assert!((zoom.pixel_side(&PLACE) - 1.0).abs() < 1e-12);
        zoom.by(&PLACE, DVec2::ZERO, 1e-9);
        assert!((zoom.pixel_side(&PLACE) - 1.0).abs() < 1e-12);
    }
}
