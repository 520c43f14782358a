//! How Jerlov's types typically change with depth (Williamson & Hollins 2023).

use std::sync::LazyLock;

use crate::jerlov::WaterType;
use crate::tables::{self, TableRow};

/// Water of one type between two depths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthLayer {
    /// Depth of its upper side below the surface, m.
    pub top_m: f64,
    /// Depth of its lower side, m, more than `top_m`.
    pub bottom_m: f64,
    /// Its type.
    pub water_type: WaterType,
}

/// The water that is typically found below a surface of the type `at_surface`, from the surface down, neighbours of one type
/// put together. The source gives one type for each 10 m, down to 200 m or to where fewer than ten campaigns measured (9C:
/// 10 m; 5C and 7C: 20 m; 3C: 70 m); nothing is known below the last layer.
pub fn depth_profile(at_surface: WaterType) -> &'static [DepthLayer] {
    static PROFILES: LazyLock<[Vec<DepthLayer>; 10]> = LazyLock::new(|| {
        let rows: Vec<TableRow> = tables::rows(tables::DEPTH_PROFILES).collect();
        WaterType::ALL.map(|water_type| read(&rows, water_type))
    });
    &PROFILES[at_surface as usize]
}

fn read(rows: &[TableRow], at_surface: WaterType) -> Vec<DepthLayer> {
    let mut layers: Vec<DepthLayer> = Vec::new();
    let of_surface = |row: &&TableRow| row.text("surface_water_type") == at_surface.name();
    for row in rows.iter().filter(of_surface) {
        let bottom_m = row.number("depth_max_m");
        let name = row.text("water_type");
        let known = WaterType::ALL.into_iter().find(|own| own.name() == name);
        let water_type =
            known.unwrap_or_else(|| panic!("embedded table holds {name:?} under water_type"));
        match layers.last_mut() {
            Some(last) if last.water_type == water_type => last.bottom_m = bottom_m,
            _ => layers.push(DepthLayer {
                top_m: row.number("depth_min_m"),
                bottom_m,
                water_type,
            }),
        }
    }
    layers
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_profile_begins_with_its_own_type_and_has_no_gaps() {
        for at_surface in WaterType::ALL {
            let layers = depth_profile(at_surface);
            assert_eq!(layers[0].top_m, 0.0);
            assert_eq!(layers[0].water_type, at_surface);
            for pair in layers.windows(2) {
                assert_eq!(pair[0].bottom_m, pair[1].top_m, "{at_surface}");
                assert_ne!(pair[0].water_type, pair[1].water_type, "{at_surface}");
            }
            assert!(layers.iter().all(|layer| layer.top_m < layer.bottom_m));
        }
    }

    /// Table 2 of the paper.
    #[test]
    fn profiles_are_those_of_the_source() {
        use WaterType::{C1, C3, C9, I, IA, IB, II, III};
        let of = |at_surface| {
            let layers = depth_profile(at_surface).iter();
            layers
                .map(|layer| (layer.bottom_m, layer.water_type))
                .collect::<Vec<_>>()
        };
        assert_eq!(of(I), [(20.0, I), (40.0, IA), (200.0, IB)]);
        assert_eq!(of(IB), [(200.0, IB)]);
        assert_eq!(of(II), [(100.0, II), (200.0, IB)]);
        assert_eq!(of(C1), [(20.0, C1), (40.0, III), (90.0, II), (110.0, IB)]);
        assert_eq!(of(C3), [(20.0, C3), (40.0, III), (70.0, II)]);
        assert_eq!(of(C9), [(10.0, C9)]);
        let (above, below) = (depth_profile(III).len(), depth_profile(IA).len());
        assert_eq!((above, below), (3, 2));
    }
}
