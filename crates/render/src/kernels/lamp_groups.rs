//! Many lamps in groups that lie together, so that a walk looks at few of them.

use std::cmp::Ordering;

use glam::DVec3;

use super::layout::LampGroup;
use crate::prepare::Prepared;

/// Fewest lamps that are put into groups: with 100 looking at groups and at some of their lamps still takes a tenth longer than looking at
/// all, with 225 a tenth less.
const FEWEST: usize = 128;

/// The lamps in an order in which groups are runs, and the groups, whose places are relative to the camera; few lamps stay as they
/// are, in no groups.
pub(super) fn arranged(scene: &Prepared, mut lamps: Vec<usize>) -> (Vec<usize>, Vec<LampGroup>) {
    if lamps.len() < FEWEST {
        return (lamps, Vec::new());
    }
    // A walk looks at all groups twice and at the lamps of about four, twice: least work for as many as this.
    let most = (0.5 * (lamps.len() as f64).sqrt()).ceil() as usize;
    let mut groups = Vec::new();
    part(scene, &mut lamps, 0, most, &mut groups);
    (lamps, groups)
}

/// Parts lamps at the middle of the longest side until there are at most so many in a group.
fn part(
    scene: &Prepared,
    lamps: &mut [usize],
    first: usize,
    most: usize,
    groups: &mut Vec<LampGroup>,
) {
    let position = |&i: &usize| scene.lamps[i].position;
    if lamps.len() <= most {
        groups.push(group(scene, lamps, first));
        return;
    }
    let lower = lamps.iter().map(position).fold(DVec3::INFINITY, DVec3::min);
    let upper = lamps
        .iter()
        .map(position)
        .fold(DVec3::NEG_INFINITY, DVec3::max);
    let axis = (upper - lower).max_position();
    let middle = lamps.len() / 2;
    // Lamps at one place go by their number, so that the order is the same everywhere.
    let order = |a: &usize, b: &usize| -> Ordering {
        let along = position(a)[axis].total_cmp(&position(b)[axis]);
        along.then(a.cmp(b))
    };
    lamps.select_nth_unstable_by(middle, order);
    let (left, right) = lamps.split_at_mut(middle);
    part(scene, left, first, most, groups);
    part(scene, right, first + middle, most, groups);
}

fn group(scene: &Prepared, lamps: &mut [usize], first: usize) -> LampGroup {
    lamps.sort_unstable();
    let lamps = lamps.iter().map(|&i| &scene.lamps[i]);
    let count = lamps.len();
    let share = 1.0 / count as f64;
    let centre = share * lamps.clone().map(|lamp| lamp.position).sum::<DVec3>();
    let away = |lamp: &crate::prepare::PreparedLamp| lamp.position.distance(centre);
    LampGroup {
        centre: (centre - scene.camera.position_m).to_array(),
        reach: lamps
            .clone()
            .map(|lamp| away(lamp) + lamp.radius)
            .fold(0.0, f64::max),
        intensity: lamps
            .clone()
            .map(|lamp| lamp.intensity.into_iter().fold(0.0, f64::max))
            .sum(),
        spread2: share * lamps.map(|lamp| away(lamp).powi(2)).sum::<f64>(),
        first: first as u32,
        count: count as u32,
    }
}
