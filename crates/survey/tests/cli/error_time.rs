//! `uw error-time` on a tiny picture.

use super::support::{Folder, SCENE};

const MAKE: &str = "error-time --make-references scene.toml --references refs --spp 256 --width 8 --height 6 --quiet";
const RUN: &str = "error-time scene.toml -o out --references refs --backends cpu --spp 4,16 --repeats 2 --threads 1 --width 8 --height 6 --quiet";

/// Cells of a column of `out/error_time.csv`.
fn column(folder: &Folder, name: &str) -> Vec<String> {
    let table = folder.text("out/error_time.csv");
    let mut lines = table.lines();
    let header: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let index = header.iter().position(|column| *column == name);
    let index = index.unwrap_or_else(|| panic!("{name} is not in {header:?}"));
    lines
        .map(|line| line.split(',').nth(index).unwrap_or_default().to_owned())
        .collect()
}

fn numbers(folder: &Folder, name: &str) -> Vec<f64> {
    let cells = column(folder, name);
    cells.iter().map(|cell| cell.parse().expect(name)).collect()
}

#[test]
fn a_ladder_is_measured_once_and_goes_on() {
    let folder = Folder::with_scene();
    let made = folder.good(MAKE);
    assert!(
        made.stdout.contains("scene_8x6.exr: 256 samples per pixel"),
        "{}",
        made.stdout
    );

    let first = folder.good(&format!("{} --json", RUN.replace("4,16", "4")));
    let curves: serde_json::Value = serde_json::from_str(&first.stdout).expect("JSON");
    assert_eq!(curves[0]["rungs"].as_array().map(Vec::len), Some(1));
    let second = folder.good(RUN);
    assert!(
        second
            .stderr
            .contains("2 renders made, 2 found in the table"),
        "{}",
        second.stderr
    );
    assert!(second.stdout.contains("CPU s to 10 %"), "{}", second.stdout);
    let table = folder.text("out/error_time.csv");
    let third = folder.good(RUN);
    assert!(
        third
            .stderr
            .contains("0 renders made, 4 found in the table"),
        "{}",
        third.stderr
    );
    assert_eq!(folder.text("out/error_time.csv"), table);

    let samples = numbers(&folder, "samples_per_pixel");
    assert_eq!(samples, [4.0, 4.0, 16.0, 16.0]);
    let mut seeds = column(&folder, "seed");
    seeds.extend(column(&folder, "reference_seed").into_iter().take(1));
    seeds.sort();
    seeds.dedup();
    assert_eq!(seeds.len(), 5, "{seeds:?}");
    // Four times the samples, a quarter of the error: the mean of two renders is within a factor of 3 of that.
    let errors = numbers(&folder, "rel_mse");
    let ratio = (errors[0] + errors[1]) / (errors[2] + errors[3]);
    assert!((4.0 / 3.0..12.0).contains(&ratio), "{errors:?}");
    for (bias, error) in
        ["r", "g", "b"].map(|k| (format!("bias_{k}"), format!("bias_standard_error_{k}")))
    {
        let biases = numbers(&folder, &bias);
        for (bias, error) in biases.iter().zip(numbers(&folder, &error)) {
            assert!(
                error > 0.0 && (bias / error).abs() < 5.0,
                "{bias} ± {error}"
            );
        }
    }
    assert!(folder.read("out/error_time.png").starts_with(b"\x89PNG"));
    assert!(folder.text("out/error_time.svg").contains("scene (cpu)"));
}

#[test]
fn without_a_wish_the_backends_of_the_processor_are_measured() {
    let folder = Folder::with_scene();
    folder.good(MAKE);
    folder.good(&RUN.replace("--backends cpu ", ""));
    let mut backends = column(&folder, "backend");
    backends.dedup();
    assert_eq!(backends, ["cpu", "cpu-simd", "cpu", "cpu-simd"]);
}

#[test]
fn peers_are_drawn_beside_and_those_of_other_scenes_are_named() {
    let folder = Folder::with_scene();
    folder.good(MAKE);
    folder.write(
        "peers.csv",
        "renderer,scene,spp,cpu_s,rel_mse\nMarcher 1.0,scene,16,1.5,0.9\nMarcher 1.0,reef,16,1.5,0.9\n",
    );
    let run = folder.good(&format!("{RUN} --peers peers.csv"));
    assert!(
        run.stderr
            .contains("peers.csv: reef is not among the scenes"),
        "{}",
        run.stderr
    );
    assert!(folder.text("out/error_time.svg").contains("Marcher 1.0"));
}

#[test]
fn references_of_other_scenes_and_none_at_all_are_refused() {
    let folder = Folder::with_scene();
    folder.refused(
        RUN,
        &[
            "scene_8x6.exr: no such reference",
            "--make-references scene.toml",
        ],
    );
    folder.good(MAKE);
    folder.write(
        "scene.toml",
        SCENE.replace("height_m = 2.0", "height_m = 2.5"),
    );
    folder.refused(RUN, &["scene_8x6.exr: was made from another scene", "hash"]);
    // What does not change the scene does not change its hash.
    folder.write("scene.toml", format!("# The same pool.\n{SCENE}"));
    folder.good(RUN);
}

#[test]
fn arguments_that_do_not_go_together_are_refused() {
    let folder = Folder::with_scene();
    for (line, words) in [
        ("error-time scene.toml", "--output"),
        ("error-time scene.toml -o out --spp 1", "--spp"),
        ("error-time scene.toml -o out --backends abacus", "abacus"),
        (
            "error-time scene.toml -o out --target-error 0.1",
            "--make-references",
        ),
        (
            "error-time --make-references scene.toml --spp 4,8",
            "one number",
        ),
        (
            "error-time --make-references scene.toml --spp 4 --target-error 0.1",
            "cannot be used with",
        ),
        ("error-time scene.toml -o out --width 0 --height 5", "0 × 5"),
        ("error-time missing.toml -o out", "missing.toml"),
    ] {
        folder.refused(line, &[words]);
    }
}

#[test]
fn a_ladder_ends_where_it_is_good_enough() {
    let folder = Folder::with_scene();
    folder.good(MAKE);
    folder.good(&format!("{RUN} --until 1e9"));
    assert_eq!(numbers(&folder, "samples_per_pixel"), [4.0, 4.0]);
    folder.good(&format!("{RUN} --until 1e-9"));
    let mut samples = numbers(&folder, "samples_per_pixel");
    samples.sort_by(f64::total_cmp);
    assert_eq!(samples, [4.0, 4.0, 16.0, 16.0]);
}
