//! Trajectories: poses between rows, and what is refused.

use super::*;

#[test]
fn a_line_of_tum_and_a_row_of_csv_are_one_pose() {
    let tum = Trajectory::parse("# a comment\n1.5 1 2 -3 0 0 0 1\n").expect("a pose");
    let csv = "qw,qx,qy,qz,time_s,tz,ty,tx\n1,0,0,0,1.5,-3,2,1\n";
    assert_eq!(tum, Trajectory::parse(csv).expect("a pose"));
    assert_eq!(tum.poses()[0].position_m, DVec3::new(1.0, 2.0, -3.0));
}

#[test]
fn a_direction_of_view_turns_the_axes_of_the_camera() {
    let csv = "time_s,tx,ty,tz,forward_x,forward_y,forward_z\n0,0,0,0,2,0,0\n";
    let rotation = Trajectory::parse(csv).expect("a pose").poses()[0].rotation;
    for (own, world) in [
        (DVec3::Z, DVec3::X),
        (DVec3::X, -DVec3::Y),
        (DVec3::Y, -DVec3::Z),
    ] {
        assert!((rotation * own - world).length() < 1e-12, "{own}");
    }
}

#[test]
fn poses_in_between_lie_on_lines_and_great_circles() {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let text = format!("0 0 0 0 0 0 0 1\n2 4 0 0 0 0 {half} {half}\n");
    let trajectory = Trajectory::parse(&text).expect("poses");
    let resampled = trajectory.at_rate(2.0).expect("few");
    let times: Vec<f64> = resampled.poses().iter().map(|pose| pose.time_s).collect();
    assert_eq!(times, [0.0, 0.5, 1.0, 1.5, 2.0]);
    let middle = resampled.poses()[2];
    assert!((middle.position_m - DVec3::new(2.0, 0.0, 0.0)).length() < 1e-12);
    // A quarter turn about z, halfway.
    assert!((middle.rotation * DVec3::X - DVec3::new(half, half, 0.0)).length() < 1e-12);
    assert!((resampled.velocity_m_s(2) - DVec3::new(2.0, 0.0, 0.0)).length() < 1e-12);
    assert_eq!(trajectory.at(9.0).position_m, DVec3::new(4.0, 0.0, 0.0));
}

#[test]
fn lamps_are_dimmed_on_the_way() {
    let header = "time_s,tx,ty,tz,forward_x,forward_y,forward_z,level_pct";
    let text = format!("{header}\n0,0,0,0,1,0,0,20\n2,1,0,0,1,0,0,100\n");
    let trajectory = Trajectory::parse(&text).expect("poses");
    let levels = |trajectory: &Trajectory| -> Vec<_> {
        trajectory
            .poses()
            .iter()
            .map(|pose| pose.level_pct)
            .collect()
    };
    let at_rate = trajectory.at_rate(1.0).expect("few");
    assert_eq!(levels(&at_rate), [Some(20.0), Some(60.0), Some(100.0)]);
    let tum = Trajectory::parse("0 0 0 0 0 0 0 1\n").expect("a pose");
    assert_eq!(levels(&tum), [None]);
    let wrong = format!("{header}\n0,0,0,0,1,0,0,101\n");
    let (line, reason) = Trajectory::parse(&wrong).expect_err("refused");
    assert_eq!(line, Some(2));
    assert!(reason.contains("[0, 100]"), "{reason}");
}

#[test]
fn what_is_no_trajectory_is_refused_with_its_line() {
    for (text, line, words) in [
        ("", None, "got none"),
        ("0 0 0 0 0 0 1\n", Some(1), "got 7 numbers"),
        ("0 0 0 0 0 0 0 1\n\n0 1 0 0 0 0 0 1\n", Some(3), "must grow"),
        ("0 0 0 0 0 0 0 2\n", Some(1), "length 1"),
        ("0 0 nan 0 0 0 0 1\n", Some(1), "finite number"),
        ("0 0 0 0 0 0 0 1\n1 0 0 x 0 0 0 1\n", Some(2), "\"x\""),
        ("time_s,tx,ty\n", Some(1), "tz"),
        ("time_s,tx,ty,tz\n", Some(1), "either"),
        ("time_s,tx,ty,tz,yaw\n", Some(1), "unknown column \"yaw\""),
        (
            "time_s,tx,ty,tz,forward_x,forward_y,forward_z\n0,0,0,0,0,0,1\n",
            Some(2),
            "parallel",
        ),
        (
            "time_s,tx,ty,tz,forward_x,forward_y,forward_z\n0,0,0,0,1,0\n",
            Some(2),
            "6 fields",
        ),
    ] {
        let (found, reason) = Trajectory::parse(text).expect_err("refused");
        assert_eq!(found, line, "{text:?}: {reason}");
        assert!(reason.contains(words), "{text:?}: {reason}");
    }
}
