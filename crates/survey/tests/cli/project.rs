//! `uw project`: both ways, through a port, and its refusals.

use super::support::{Folder, SCENE, numbers};

const PORT: &str =
    "hfov_deg = 60.0\nport = { kind = \"flat\", distance_m = 0.02, thickness_m = 0.01 }";

#[test]
fn points_of_rays_return_to_their_pixels() {
    let folder = Folder::new();
    folder.write("scene.toml", SCENE.replace("hfov_deg = 60.0", PORT));
    folder.write("pixels.csv", "px,py\n0,0\n16,9\n31.5,2.25\n");
    folder.good("project scene.toml --pixels pixels.csv -o rays.csv");
    let rays = numbers(&folder.text("rays.csv"));
    assert_eq!(rays.len(), 3);
    let mut points = "what,z_m,y_m,x_m\n".to_owned();
    for row in &rays {
        let [x, y, z] = [0, 1, 2].map(|k| row[2 + k] + 1.5 * row[5 + k]);
        points += &format!("p,{z},{y},{x}\n");
    }
    folder.write("points.csv", points + "behind,0,0,-1\nbeside,0,9,1\n");
    let table = folder.good("project scene.toml --points points.csv").stdout;
    let lines: Vec<&str> = table.lines().collect();
    assert_eq!(lines[0], "x_m,y_m,z_m,px,py,in_picture");
    for (line, ray) in lines[1..4].iter().zip(&rays) {
        let fields: Vec<&str> = line.split(',').collect();
        for (field, pixel) in fields[3..5].iter().zip(&ray[..2]) {
            let found: f64 = field.parse().expect("a number");
            assert!((found - pixel).abs() < 1e-6, "{line}: {pixel}");
        }
    }
    assert!(lines[2].ends_with(",true"), "{}", lines[2]);
    assert_eq!(lines[4], "-1,0,0,,,false");
    assert!(lines[5].ends_with(",false") && !lines[5].contains(",,"));
    // Twice the size has twice the pixels.
    let wide = folder
        .good("project scene.toml --points points.csv --width 64")
        .stdout;
    let fields: Vec<&str> = wide.lines().nth(2).unwrap_or_default().split(',').collect();
    assert!(
        fields[3]
            .parse::<f64>()
            .is_ok_and(|px| (px - 32.0).abs() < 1e-6),
        "{fields:?}"
    );
}

#[test]
fn unusable_input_is_refused() {
    let folder = Folder::with_scene();
    folder.write("points.csv", "x_m,y_m\n1,2\n");
    folder.refused(
        "project scene.toml --points points.csv",
        &["points.csv:1", "z_m"],
    );
    folder.refused("project scene.toml --points none.csv", &["none.csv"]);
    folder.refused("project scene.toml", &["--points"]);
    folder.refused(
        "project scene.toml --points points.csv --pixels points.csv",
        &["--pixels"],
    );
}
