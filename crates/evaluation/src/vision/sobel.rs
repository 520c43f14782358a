//! Mean gradient: the mean magnitude of the vertical Sobel derivative (as in Lee et al. 2022, who hold it constant).

use super::GreyImage;

/// Mean over all pixels of |Sobel d/dy|, 8-bit counts. 3 × 3 kernel, border mirrored without repeating the edge.
pub fn mean_gradient_y(image: &GreyImage) -> f64 {
    let (width, height) = (image.width(), image.height());
    let row = |y: usize| &image.values()[y * width..(y + 1) * width];
    let mut sum = 0.0;
    for y in 0..height {
        let (above, below) = (row(mirror(y, -1, height)), row(mirror(y, 1, height)));
        for x in 0..width {
            let (left, right) = (mirror(x, -1, width), mirror(x, 1, width));
            let smooth = |values: &[u8]| {
                i32::from(values[left]) + 2 * i32::from(values[x]) + i32::from(values[right])
            };
            sum += f64::from((smooth(below) - smooth(above)).abs());
        }
    }
    sum / (width * height) as f64
}

/// Index `at + step` mirrored at the ends of `0..length`; an end is not repeated.
fn mirror(at: usize, step: isize, length: usize) -> usize {
    let last = length as isize - 1;
    let index = at as isize + step;
    let mirrored = if index < 0 {
        -index
    } else if index > last {
        2 * last - index
    } else {
        index
    };
    mirrored.clamp(0, last) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_has_eight_times_its_slope_and_nothing_at_the_mirrored_border() {
        // Rows 0, 3, 6, 9: inside 8 · 3, at the upper and lower border 0.
        let values = (0..4).flat_map(|y| [3 * y; 5]).collect();
        let image = GreyImage::new(5, 4, values).expect("size");
        assert_eq!(mean_gradient_y(&image), 12.0);
    }

    #[test]
    fn changes_along_a_row_do_not_count() {
        let values = (0..6).flat_map(|_| [0, 90, 20, 200]).collect();
        let image = GreyImage::new(4, 6, values).expect("size");
        assert_eq!(mean_gradient_y(&image), 0.0);
    }
}
