//! The side of a ship.

use super::{AssetModel, Part, Surface};
use crate::mesh::{Mesh, Vec3, Vertex, cross, minus, normalised, plus, quarter_turn, times};
use crate::textures::{Pattern, plating};
use crate::tile::Tile;

/// Length along the ship and girth (measured down the plating) of the hull patch, m.
const HULL_M: [f64; 2] = [12.0, 5.0];
/// Girth at which the side begins to turn under, m, and radius of the turn, m.
const BILGE_BEGINS_M: f64 = 3.0;
const BILGE_RADIUS_M: f64 = 1.9;
/// Radius of the sheer along the ship, m.
const WATERLINE_RADIUS_M: f64 = 55.0;
/// Height and half width of a weld bead, m.
const BEAD_M: [f64; 2] = [0.0035, 0.007];
/// Frames press the plating into shallow bays: distance between frames and depth of a bay, m.
const FRAME_M: f64 = 0.75;
const BAY_DEPTH_M: f64 = 0.004;
/// The intake: along the ship, and down the girth, from the upper left corner, m.
const INTAKE_M: [[f64; 2]; 2] = [[7.6, 8.5], [1.75, 2.45]];
const INTAKE_DEPTH_M: f64 = 0.30;
const BARE_METAL: [f32; 3] = [0.16, 0.15, 0.14];
const ZINC: [f32; 3] = [0.42, 0.43, 0.44];
const DARK: [f32; 3] = [0.035, 0.035, 0.035];

/// The side of a ship, 12 m long and 5 m of girth, that faces -x. The plating's middle is at x = 0,
/// y = 0; its upper edge at z = 2.5 m. With weld beads, bays between the frames, an intake
/// behind a grating, a bilge keel and zinc anodes.
pub fn ship_hull(seed: u32) -> AssetModel {
    let hull = Hull {
        tile: Tile {
            size_m: Pattern::HullRed.tile_m(),
            seed,
        },
    };
    let part = |name, mesh, surface| Part {
        name,
        mesh,
        surface,
    };
    AssetModel {
        name: "ship_hull",
        tile: hull.tile,
        pattern: Pattern::HullRed,
        parts: vec![
            part("plating", hull.plating(), Surface::Textured),
            part("bilge_keel", hull.bilge_keel(), Surface::Textured),
            part("grating", hull.grating(), Surface::Plain(BARE_METAL)),
            part("intake", hull.intake(), Surface::Plain(DARK)),
            part("anodes", hull.anodes(), Surface::Plain(ZINC)),
        ],
    }
}

/// Coordinates on the plating: `along_m` to the right as seen from outside, `girth_m` downwards,
/// both from the upper left corner.
struct Hull {
    tile: Tile,
}

impl Hull {
    /// The smooth shape, `out_m` outside the plating.
    fn smooth(&self, along_m: f64, girth_m: f64, out_m: f64) -> Vec3 {
        let from_middle_m = along_m - 0.5 * HULL_M[0];
        // Outside is towards -x, so right as seen from there is towards -y.
        let sheer_m = from_middle_m * from_middle_m / (2.0 * WATERLINE_RADIUS_M);
        let turned_m = girth_m - BILGE_BEGINS_M;
        if turned_m <= 0.0 {
            return [sheer_m - out_m, -from_middle_m, 0.5 * HULL_M[1] - girth_m];
        }
        let (sine, cosine) = quarter_turn(turned_m / BILGE_RADIUS_M);
        let radius_m = BILGE_RADIUS_M + out_m;
        let centre = [sheer_m + BILGE_RADIUS_M, 0.5 * HULL_M[1] - BILGE_BEGINS_M];
        [
            centre[0] - radius_m * cosine,
            -from_middle_m,
            centre[1] - radius_m * sine,
        ]
    }

    /// How far the real plating stands out from the smooth shape, m.
    fn relief_m(&self, along_m: f64, girth_m: f64) -> f64 {
        let plates = plating(&self.tile);
        let at = [along_m as f32, girth_m as f32];
        let to_joint_m = plates
            .from_seam_m(at[1])
            .abs()
            .min(plates.from_butt_m(&self.tile, at).abs());
        let across = (f64::from(to_joint_m) / BEAD_M[1]).min(1.0);
        let bay = along_m / FRAME_M;
        let in_bay = 2.0 * (bay - bay.floor()) - 1.0;
        BEAD_M[0] * (1.0 - across * across) - BAY_DEPTH_M * (1.0 - in_bay * in_bay)
    }

    fn point(&self, along_m: f64, girth_m: f64) -> Vec3 {
        self.smooth(along_m, girth_m, self.relief_m(along_m, girth_m))
    }

    /// Outward unit normal of the smooth shape.
    fn outward(&self, along_m: f64, girth_m: f64) -> Vec3 {
        normalised(minus(
            self.smooth(along_m, girth_m, 1.0),
            self.smooth(along_m, girth_m, 0.0),
        ))
    }

    fn uv(&self, along_m: f64, girth_m: f64) -> [f64; 2] {
        [
            along_m / f64::from(self.tile.size_m),
            girth_m / f64::from(self.tile.size_m),
        ]
    }

    fn plating(&self) -> Mesh {
        let along = grid_lines(HULL_M[0], 0.064, &self.butts_m(), &INTAKE_M[0]);
        let girth = grid_lines(HULL_M[1], 0.064, &self.seams_m(), &INTAKE_M[1]);
        let vertex = |column: u32, row: u32| {
            let (a, g) = (along[column as usize], girth[row as usize]);
            const STEP_M: f64 = 0.002;
            let right = minus(self.point(a + STEP_M, g), self.point(a - STEP_M, g));
            let down = minus(self.point(a, g + STEP_M), self.point(a, g - STEP_M));
            Vertex {
                position: self.point(a, g),
                normal: normalised(cross(down, right)),
                uv: self.uv(a, g),
            }
        };
        let inside = |lines: &[f64], index: u32, [from, to]: [f64; 2]| {
            let middle = 0.5 * (lines[index as usize] + lines[index as usize + 1]);
            (from..to).contains(&middle)
        };
        let solid = |column, row| {
            !(inside(&along, column, INTAKE_M[0]) && inside(&girth, row, INTAKE_M[1]))
        };
        Mesh::grid(along.len() as u32, girth.len() as u32, vertex, solid)
    }

    /// Girths of the seams on the patch, m.
    fn seams_m(&self) -> Vec<f64> {
        let strake_m = f64::from(plating(&self.tile).strake_m);
        (0..)
            .map(|k| (f64::from(k) + 0.5) * strake_m)
            .take_while(|&g| g < HULL_M[1])
            .collect()
    }

    /// Places of the butts of all strakes along the patch, m.
    fn butts_m(&self) -> Vec<f64> {
        let plates = plating(&self.tile);
        let mut butts = Vec::new();
        for strake in 0..=self.seams_m().len() {
            let girth = strake as f32 * plates.strake_m;
            let first_m = -f64::from(plates.from_butt_m(&self.tile, [0.0, girth]));
            let ends_m = (-1..).map(|k| first_m + f64::from(k) * f64::from(plates.plate_m));
            butts.extend(
                ends_m
                    .skip_while(|&m| m < 0.0)
                    .take_while(|&m| m < HULL_M[0]),
            );
        }
        butts
    }

    /// A fin along the turn of the bilge, tapered at its ends.
    fn bilge_keel(&self) -> Mesh {
        const GIRTH_M: f64 = 4.2;
        const HALF_THICKNESS_M: f64 = 0.012;
        let stations: Vec<f64> = (0..=64).map(|i| 2.0 + 8.0 * f64::from(i) / 64.0).collect();
        let width_m = |a: f64| 0.32 * ((a - 2.0) / 0.8).min((10.0 - a) / 0.8).clamp(0.05, 1.0);
        let side = |offset_m: f64, upper: bool| {
            let vertex = |column: u32, row: u32| {
                let a = stations[column as usize];
                let share = if upper {
                    1.0 - f64::from(row) / 4.0
                } else {
                    f64::from(row) / 4.0
                };
                let out_m = width_m(a) * share;
                let position = self.smooth(a, GIRTH_M + offset_m, out_m);
                Vertex {
                    position,
                    normal: [0.0; 3],
                    uv: self.uv(a, GIRTH_M + offset_m + out_m),
                }
            };
            let mut mesh = Mesh::grid(stations.len() as u32, 5, vertex, |_, _| true);
            mesh.smooth_normals();
            mesh
        };
        let edge = |column: u32, row: u32| {
            let a = stations[column as usize];
            let girth = GIRTH_M
                + if row == 0 {
                    -HALF_THICKNESS_M
                } else {
                    HALF_THICKNESS_M
                };
            let position = self.smooth(a, girth, width_m(a));
            Vertex {
                position,
                normal: [0.0; 3],
                uv: self.uv(a, girth),
            }
        };
        let mut rim = Mesh::grid(stations.len() as u32, 2, edge, |_, _| true);
        rim.smooth_normals();
        let mut keel = side(-HALF_THICKNESS_M, false);
        keel.append(&side(HALF_THICKNESS_M, true));
        keel.append(&rim);
        keel
    }

    /// Bars across the intake and the frame around it.
    fn grating(&self) -> Mesh {
        let [[left, right], [upper, lower]] = INTAKE_M;
        let mut mesh = Mesh::default();
        let mut bar = |along: [f64; 2], girth: [f64; 2], half_depth_m: f64, out_m: f64| {
            let middle = (0.5 * (along[0] + along[1]), 0.5 * (girth[0] + girth[1]));
            let centre = self.smooth(middle.0, middle.1, out_m);
            let outward = self.outward(middle.0, middle.1);
            let across = times(
                minus(
                    self.smooth(along[1], middle.1, out_m),
                    self.smooth(along[0], middle.1, out_m),
                ),
                0.5,
            );
            let down = times(
                minus(
                    self.smooth(middle.0, girth[1], out_m),
                    self.smooth(middle.0, girth[0], out_m),
                ),
                0.5,
            );
            mesh.push_box(
                centre,
                [across, times(down, -1.0), times(outward, half_depth_m)],
            );
        };
        const FRAME_WIDTH_M: f64 = 0.05;
        let outer = [left - FRAME_WIDTH_M, right + FRAME_WIDTH_M];
        bar(outer, [upper - FRAME_WIDTH_M, upper], 0.012, 0.012);
        bar(outer, [lower, lower + FRAME_WIDTH_M], 0.012, 0.012);
        bar([left - FRAME_WIDTH_M, left], [upper, lower], 0.012, 0.012);
        bar([right, right + FRAME_WIDTH_M], [upper, lower], 0.012, 0.012);
        let bars = 15;
        for i in 1..bars {
            let middle = left + (right - left) * f64::from(i) / f64::from(bars);
            bar(
                [middle - 0.008, middle + 0.008],
                [upper, lower],
                0.020,
                -0.020,
            );
        }
        mesh
    }

    /// The dark box behind the grating, open to the outside.
    fn intake(&self) -> Mesh {
        let [[left, right], [upper, lower]] = INTAKE_M;
        let front = [(left, lower), (right, lower), (right, upper), (left, upper)]
            .map(|(a, g)| self.smooth(a, g, 0.0));
        let back = front.map(|corner| plus(corner, [INTAKE_DEPTH_M, 0.0, 0.0]));
        let mut mesh = Mesh::default();
        mesh.push_quad(back);
        for i in 0..4 {
            let next = (i + 1) % 4;
            mesh.push_quad([front[i], front[next], back[next], back[i]]);
        }
        mesh
    }

    /// Six zinc anodes in two rows.
    fn anodes(&self) -> Mesh {
        let mut mesh = Mesh::default();
        for (along, girth) in [
            (1.6, 2.3),
            (4.8, 2.3),
            (10.6, 2.3),
            (2.9, 3.7),
            (6.2, 3.7),
            (9.4, 3.7),
        ] {
            let outward = self.outward(along, girth);
            let across = times(
                minus(
                    self.smooth(along + 0.15, girth, 0.0),
                    self.smooth(along - 0.15, girth, 0.0),
                ),
                0.5,
            );
            let up = times(normalised(cross(outward, across)), 0.055);
            mesh.push_box(
                self.smooth(along, girth, 0.02),
                [across, up, times(outward, 0.03)],
            );
        }
        mesh
    }
}

/// Grid lines about `step_m` apart over [0, length_m], with lines at the edges of `opening` and seven
/// lines over each weld bead.
fn grid_lines(length_m: f64, step_m: f64, beads_m: &[f64], opening: &[f64; 2]) -> Vec<f64> {
    let mut fixed: Vec<f64> = beads_m
        .iter()
        .flat_map(|&m| [-1.6, -1.0, -0.5, 0.0, 0.5, 1.0, 1.6].map(|s| m + s * BEAD_M[1]))
        .chain(opening.iter().copied())
        .chain([0.0, length_m])
        .filter(|m| (0.0..=length_m).contains(m))
        .collect();
    fixed.sort_by(f64::total_cmp);
    fixed.dedup_by(|a, b| (*a - *b).abs() < 5e-4);
    let mut lines = Vec::new();
    for pair in fixed.windows(2) {
        // A positive count of steps, a few hundred at most.
        let steps = ((pair[1] - pair[0]) / step_m).ceil().max(1.0) as u32;
        lines.extend(
            (0..steps).map(|i| pair[0] + (pair[1] - pair[0]) * f64::from(i) / f64::from(steps)),
        );
    }
    lines.push(length_m);
    lines
}
