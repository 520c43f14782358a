//! Views between the parts of a picture.

use super::super::tests::{at, contrast_of, even_water, picture_of};
use super::super::{LinearPicture, Predictor};

/// The nearer the view, the smaller the part of the picture that it shows: what lies between two of the parts that are kept is between
/// them, and open as far as they differ.
#[test]
fn a_view_between_two_parts_shows_what_is_between_them() {
    let file = even_water();
    let response = file.sensor.response();
    // Stripes that are stronger away from the middle.
    let target = |x: f64, y: f64| {
        let strength = 0.05 + 0.1 * (x.powi(2) + y.powi(2));
        0.4 + strength * (60.0 * x).sin() * (60.0 * y).sin()
    };
    let here = at(2.0, 0.0);
    let shown = picture_of(&file, &here, 3, &target);
    let linear = LinearPicture::of_counts(&shown, file.sensor.encoding);
    let place = file.place(&response, 3.0);
    let predictor = Predictor::new(place, &linear, (&here, contrast_of(&shown)), &[]);
    let found = [2.0, 1.8, 1.6].map(|distance_m| predictor.contrast(&at(distance_m, 0.0)));
    let truth = contrast_of(&picture_of(&file, &at(1.8, 0.0), 4, &target));
    for k in 0..3 {
        // The larger part alone would be off by 14 %.
        let off = found[1].counts[k] / truth[k] - 1.0;
        assert!(off.abs() < 0.08, "{off} of {}", truth[k]);
        let [own, between, nearer] = found.map(|f| f.error_counts[k] / f.counts[k]);
        assert!(
            between > own && between > nearer,
            "{own} {between} {nearer}"
        );
    }
}
