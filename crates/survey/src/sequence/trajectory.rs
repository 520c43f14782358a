//! Where a camera is and when: poses of a TUM or CSV file, and those in between.

use std::fs;
use std::path::Path;

use glam::{DMat3, DQuat, DVec3};

/// Most poses of a trajectory.
const MOST_POSES: usize = 1_000_000;
/// Largest departure of a quaternion's length from 1 that rounding explains.
const QUATERNION_ROUNDING: f64 = 1e-2;
/// Sine of the smallest angle between a direction of view and `up`.
const LEAST_SINE: f64 = 1e-6;
/// Columns of a TUM file, in their order; a CSV file has them by name, at any place.
const TUM: [&str; 8] = ["time_s", "tx", "ty", "tz", "qx", "qy", "qz", "qw"];
const FORWARD: [&str; 3] = ["forward_x", "forward_y", "forward_z"];
const UP: [&str; 3] = ["up_x", "up_y", "up_z"];
/// Column of the lamps' level.
const LEVEL: &str = "level_pct";

/// Where a camera is at a moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Time, s.
    pub time_s: f64,
    /// Centre of projection in the world, m.
    pub position_m: DVec3,
    /// Turns right, down and forward of the camera (its x, y, z) into the world.
    pub rotation: DQuat,
    /// Level of the lamps that move along, percent, in [0, 100]; `None`: that of the scene.
    pub level_pct: Option<f64>,
}

/// A trajectory that cannot be used. The message names the file, the line and what would be right.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{file}{}: {reason}", line.map(|line| format!(":{line}")).unwrap_or_default())]
pub struct TrajectoryError {
    file: String,
    line: Option<usize>,
    reason: String,
}

/// Poses in the order of their times, which grow.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    poses: Vec<Pose>,
}

impl Trajectory {
    /// Reads a file: TUM (`time_s tx ty tz qx qy qz qw`, the quaternion turning the camera's right, down, forward into the
    /// world), or CSV with a header, with those names or, in the place of the quaternion, `forward_x,forward_y,forward_z`
    /// and perhaps `up_x,up_y,up_z` (+z); perhaps with `level_pct` of the lamps.
    ///
    /// # Errors
    /// A file that cannot be read, a line that is no pose, times that do not grow.
    pub fn read(path: &Path) -> Result<Self, TrajectoryError> {
        let file = path.display().to_string();
        let text = fs::read_to_string(path).map_err(|e| TrajectoryError {
            file: file.clone(),
            line: None,
            reason: format!("cannot be read: {e}"),
        })?;
        Self::parse(&text).map_err(|(line, reason)| TrajectoryError { file, line, reason })
    }

    /// The poses, at least one.
    pub fn poses(&self) -> &[Pose] {
        &self.poses
    }

    /// Poses at equal times, `rate_hz` in a second, from the first one to the last: positions on straight lines in between,
    /// rotations on great circles, levels of lamps between those of their ends.
    ///
    /// # Errors
    /// A rate that gives more than a million poses.
    pub fn at_rate(&self, rate_hz: f64) -> Result<Self, String> {
        let (first, last) = (self.poses[0].time_s, self.last().time_s);
        // What rounding takes off the last moment is given back.
        let count = ((last - first) * rate_hz + 1e-6).floor() + 1.0;
        if count > MOST_POSES as f64 {
            return Err(format!(
                "{rate_hz} poses in a second make {count:.0} from {first} s to {last} s, at most {MOST_POSES} are possible"
            ));
        }
        let times = (0..count as usize).map(|k| first + k as f64 / rate_hz);
        let poses = times.map(|t| self.at(t)).collect();
        Ok(Self { poses })
    }

    /// The pose at a time, that of the nearer end outside.
    pub fn at(&self, time_s: f64) -> Pose {
        let after = self.poses.partition_point(|pose| pose.time_s <= time_s);
        let (Some(before), Some(next)) = (
            after.checked_sub(1).map(|k| self.poses[k]),
            self.poses.get(after),
        ) else {
            let end = if after == 0 {
                self.poses[0]
            } else {
                self.last()
            };
            return Pose { time_s, ..end };
        };
        let share = (time_s - before.time_s) / (next.time_s - before.time_s);
        Pose {
            time_s,
            position_m: before.position_m.lerp(next.position_m, share),
            rotation: before.rotation.slerp(next.rotation, share),
            level_pct: (before.level_pct.zip(next.level_pct)).map(|(a, b)| a + share * (b - a)),
        }
    }

    /// Velocity of pose number `k`, m/s: of the line from the one before to the one behind; 0 where there is one alone.
    pub fn velocity_m_s(&self, k: usize) -> DVec3 {
        let before = self.poses[k.saturating_sub(1)];
        let behind = self.poses[(k + 1).min(self.poses.len() - 1)];
        let time_s = behind.time_s - before.time_s;
        if time_s > 0.0 {
            (behind.position_m - before.position_m) / time_s
        } else {
            DVec3::ZERO
        }
    }

    fn last(&self) -> Pose {
        self.poses[self.poses.len() - 1]
    }

    fn parse(text: &str) -> Result<Self, (Option<usize>, String)> {
        let text = text.trim_start_matches('\u{feff}');
        let lines = text
            .lines()
            .enumerate()
            .map(|(k, line)| (k + 1, line.trim()));
        let mut lines = lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
        let mut rows = lines.clone().peekable();
        let columns = match rows.peek() {
            Some(&(number, header)) if header.contains(',') => {
                lines.next();
                Some(Columns::of(header).map_err(|reason| (Some(number), reason))?)
            }
            _ => None,
        };
        let mut poses: Vec<Pose> = Vec::new();
        for (number, line) in lines {
            let refuse = |reason: String| (Some(number), reason);
            let pose = match &columns {
                Some(columns) => columns.pose(line),
                None => tum_pose(line),
            };
            let pose = pose.map_err(refuse)?;
            if let Some(before) = poses.last()
                && pose.time_s <= before.time_s
            {
                return Err(refuse(format!(
                    "time_s must grow from line to line, got {} after {}",
                    pose.time_s, before.time_s
                )));
            }
            if poses.len() == MOST_POSES {
                return Err(refuse(format!("more than {MOST_POSES} poses")));
            }
            poses.push(pose);
        }
        if poses.is_empty() {
            let expected = format!("must hold a pose per line, `{}`, got none", TUM.join(" "));
            return Err((None, expected));
        }
        Ok(Self { poses })
    }
}

/// Places of the columns of a CSV file.
struct Columns {
    count: usize,
    place: [usize; 4],
    turned: Turned,
    level: Option<usize>,
}

/// How a file says where a camera looks.
enum Turned {
    Quaternion([usize; 4]),
    Forward([usize; 3], Option<[usize; 3]>),
}

impl Columns {
    fn of(header: &str) -> Result<Self, String> {
        let names: Vec<&str> = header
            .split(',')
            .map(|name| name.trim().trim_matches('"'))
            .collect();
        let find = |name: &str| names.iter().position(|found| *found == name);
        fn all<const N: usize>(
            find: &impl Fn(&str) -> Option<usize>,
            wanted: &[&str],
        ) -> Option<[usize; N]> {
            let found: Option<Vec<usize>> = wanted.iter().map(|name| find(name)).collect();
            found?.try_into().ok()
        }
        let known = TUM.iter().chain(&FORWARD).chain(&UP).chain([&LEVEL]);
        let known: Vec<&str> = known.copied().collect();
        if let Some(unknown) = names.iter().find(|name| !known.contains(name)) {
            return Err(format!(
                "unknown column {unknown:?}; columns are {}",
                known.join(", ")
            ));
        }
        let place = all(&find, &TUM[..4]).ok_or_else(|| {
            format!(
                "a CSV file needs a header with {}, got {header:?}",
                TUM[..4].join(", ")
            )
        })?;
        let turned = match (all(&find, &TUM[4..]), all(&find, &FORWARD)) {
            (Some(quaternion), None) => Turned::Quaternion(quaternion),
            (None, Some(forward)) => Turned::Forward(forward, all(&find, &UP)),
            _ => {
                return Err(format!(
                    "needs either {} or {} among its columns, got {header:?}",
                    TUM[4..].join(", "),
                    FORWARD.join(", ")
                ));
            }
        };
        Ok(Self {
            count: names.len(),
            place,
            turned,
            level: find(LEVEL),
        })
    }

    fn pose(&self, line: &str) -> Result<Pose, String> {
        let fields: Vec<&str> = line.split(',').map(str::trim).collect();
        if fields.len() != self.count {
            return Err(format!(
                "{} fields where the header has {}",
                fields.len(),
                self.count
            ));
        }
        let number = |k: usize| number(fields[k]);
        let vector = |k: [usize; 3]| -> Result<DVec3, String> {
            Ok(DVec3::new(number(k[0])?, number(k[1])?, number(k[2])?))
        };
        let [time, x, y, z] = self.place;
        let rotation = match &self.turned {
            Turned::Quaternion([x, y, z, w]) => {
                unit([number(*x)?, number(*y)?, number(*z)?, number(*w)?])?
            }
            Turned::Forward(forward, up) => {
                let up = up.map_or(Ok(DVec3::Z), vector)?;
                looking(vector(*forward)?, up)?
            }
        };
        Ok(Pose {
            time_s: number(time)?,
            position_m: vector([x, y, z])?,
            rotation,
            level_pct: self.level.map(|k| level(fields[k])).transpose()?,
        })
    }
}

fn tum_pose(line: &str) -> Result<Pose, String> {
    let fields: Vec<&str> = line.split_whitespace().collect();
    let Ok(fields) = <[&str; 8]>::try_from(fields) else {
        let count = line.split_whitespace().count();
        return Err(format!(
            "a pose is `{}`, got {count} numbers",
            TUM.join(" ")
        ));
    };
    let mut values = [0.0; 8];
    for (value, field) in values.iter_mut().zip(fields) {
        *value = number(field)?;
    }
    let [time_s, x, y, z, qx, qy, qz, qw] = values;
    Ok(Pose {
        time_s,
        position_m: DVec3::new(x, y, z),
        rotation: unit([qx, qy, qz, qw])?,
        level_pct: None,
    })
}

fn level(field: &str) -> Result<f64, String> {
    let value = number(field)?;
    match (0.0..=100.0).contains(&value) {
        true => Ok(value),
        false => Err(format!("level_pct must be in [0, 100], got {field:?}")),
    }
}

fn number(field: &str) -> Result<f64, String> {
    let value = field.parse::<f64>().ok().filter(|value| value.is_finite());
    value.ok_or_else(|| format!("must be a finite number, got {field:?}"))
}

fn unit(quaternion: [f64; 4]) -> Result<DQuat, String> {
    let found = DQuat::from_array(quaternion);
    let length = found.length();
    if (length - 1.0).abs() > QUATERNION_ROUNDING {
        return Err(format!(
            "qx, qy, qz, qw must be a quaternion of length 1, got {quaternion:?} of length {length}"
        ));
    }
    Ok(found.normalize())
}

fn looking(forward: DVec3, up: DVec3) -> Result<DQuat, String> {
    let directions = forward.try_normalize().zip(up.try_normalize());
    let right = directions.and_then(|(forward, up)| {
        let right = forward.cross(up);
        (right.length() > LEAST_SINE).then(|| (right.normalize(), forward))
    });
    let Some((right, forward)) = right else {
        return Err(format!(
            "forward and up must have a length and not be parallel, got {forward} and {up}"
        ));
    };
    let axes = DMat3::from_cols(right, forward.cross(right), forward);
    Ok(DQuat::from_mat3(&axes))
}

#[cfg(test)]
mod tests;
