//! A function of wavelength.

/// A function of wavelength by its nodes: straight lines between them, nothing outside.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Wavelength, nm, increasing, and value.
    nodes: Vec<(f64, f64)>,
}

impl Curve {
    /// A curve through `nodes` of wavelength (nm, increasing) and value.
    pub fn new(nodes: Vec<(f64, f64)>) -> Self {
        Self { nodes }
    }

    /// A bell of a relative height 1 around `centre_nm` with full width `width_nm` at half its height, every nm.
    pub fn bell(centre_nm: f64, width_nm: f64) -> Self {
        let at = |nm: f64| (-4.0 * 2.0_f64.ln() * ((nm - centre_nm) / width_nm).powi(2)).exp();
        let reach = (2.0 * width_nm).ceil();
        let steps = (2.0 * reach) as u32;
        let nodes = (0..=steps).map(|i| centre_nm.round() - reach + f64::from(i));
        Self::new(nodes.map(|nm| (nm, at(nm))).collect())
    }

    /// Value at a wavelength, nm; 0 outside the nodes.
    pub fn at(&self, wavelength_nm: f64) -> f64 {
        let after = self.nodes.partition_point(|node| node.0 <= wavelength_nm);
        match (after.checked_sub(1), self.nodes.get(after)) {
            (Some(before), Some(&(x1, y1))) => {
                let (x0, y0) = self.nodes[before];
                y0 + (y1 - y0) * (wavelength_nm - x0) / (x1 - x0)
            }
            (Some(last), None) if self.nodes[last].0 == wavelength_nm => self.nodes[last].1,
            _ => 0.0,
        }
    }

    /// First and last wavelength, nm; `None` without nodes.
    pub fn range_nm(&self) -> Option<(f64, f64)> {
        Some((self.nodes.first()?.0, self.nodes.last()?.0))
    }

    /// The nodes: wavelength, nm, and value.
    pub fn nodes(&self) -> &[(f64, f64)] {
        &self.nodes
    }

    /// Values between this curve (`share` 0) and another (1), at the nodes of this one.
    pub fn towards(&self, other: &Self, share: f64) -> Self {
        let between = |&(nm, value): &(f64, f64)| (nm, value + share * (other.at(nm) - value));
        Self::new(self.nodes.iter().map(between).collect())
    }

    /// The same with every value as `change` makes it of wavelength and value.
    pub fn map(&self, change: impl Fn(f64, f64) -> f64) -> Self {
        Self::new(
            self.nodes
                .iter()
                .map(|&(nm, value)| (nm, change(nm, value)))
                .collect(),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn straight_between_nodes_and_nothing_outside() {
        let curve = Curve::new(vec![(400.0, 1.0), (500.0, 3.0), (510.0, 0.0)]);
        for (nm, value) in [
            (399.9, 0.0),
            (400.0, 1.0),
            (450.0, 2.0),
            (505.0, 1.5),
            (510.0, 0.0),
            (511.0, 0.0),
        ] {
            assert!((curve.at(nm) - value).abs() < 1e-12, "{nm}");
        }
        assert_eq!(curve.range_nm(), Some((400.0, 510.0)));
    }

    #[test]
    fn a_bell_is_half_as_high_at_half_its_width() {
        let bell = Curve::bell(450.0, 20.0);
        assert!((bell.at(450.0) - 1.0).abs() < 1e-12);
        assert!((bell.at(460.0) - 0.5).abs() < 1e-12 && (bell.at(440.0) - 0.5).abs() < 1e-12);
    }
}
