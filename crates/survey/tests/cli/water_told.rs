//! `uw water` from what a water holds and from how far one sees, and what is done with the answers.

use serde_json::Value;

use super::support::Folder;

fn json(text: &str) -> Value {
    serde_json::from_str(text).expect("JSON")
}

/// The table of a water with chlorophyll is what a scene and `uw water --spectrum` read.
#[test]
fn water_with_chlorophyll_is_a_table_for_scenes() {
    let folder = Folder::with_scene();
    folder.good("water --chlorophyll-mg-m3 1 -o sea.csv");
    let text = folder.text("sea.csv");
    assert!(
        text.starts_with(
            "# chlorophyll 1 mg/m3, CDOM 0.012 1/m at 440 nm, minerals 0 g/m3\n# phase = { model = \"fournier-forand\", n = 1.10, \
             backscatter_fraction = 0.00"
        ),
        "{text}"
    );
    let read = folder.good("water --spectrum sea.csv").stdout;
    // a and b; c = a + b is rounded anew.
    let coefficients = |text: &str| -> Vec<String> {
        let rows = text.lines().filter_map(|line| line.rsplit_once(','));
        rows.filter(|row| !row.0.contains(' '))
            .map(|row| row.0.to_owned())
            .collect()
    };
    assert_eq!(coefficients(&text), coefficients(&read));
    assert_eq!(coefficients(&read).len(), 32);
    // The reference is by hand: water 0.00635, phytoplankton 0.06 and a fifth of it.
    let at_440 = read.lines().find(|line| line.starts_with("440,"));
    assert!(
        at_440.expect("440 nm").starts_with("440,0.07835,"),
        "{read}"
    );

    let scene = folder.text("scene.toml");
    folder.write(
        "sea.toml",
        scene.replace("jerlov = \"IB\"", "spectrum = \"sea.csv\""),
    );
    folder.good("render sea.toml -o sea.exr --spp 1 --quiet");
    // A shipped scene takes it from the working directory, where a name of its own folder is still that.
    let shipped = "render clear_lamp --width 32 -o shipped.exr --spp 1 --quiet";
    folder.good(&format!("{shipped} --set water.spectrum=sea.csv"));
    folder.good(&format!(
        "{shipped} --set object.0.reflectance.texture=../textures/gravel.png"
    ));
    let lost = format!("{shipped} --set water.spectrum=lake.csv");
    folder.refused(&lost, &["--set water.spectrum=lake.csv", "scenes/lake.csv"]);
}

#[test]
fn harbours_have_minerals_and_yellow_substance() {
    let folder = Folder::new();
    let harbour = "water --chlorophyll-mg-m3 3 --cdom-440-per-m 0.5 --minerals-g-m3 8";
    let told = json(&folder.good(&format!("{harbour} --json")).stdout);
    let backwards = told["backscatter_fraction"].as_f64().expect("a share");
    assert!((0.015..0.024).contains(&backwards), "{backwards}");
    assert_eq!(told["wavelength_nm"].as_array().map(Vec::len), Some(31));
    // What is left after a range is told beside a table that goes to a file, and is no part of it.
    let beside = folder.good(&format!("{harbour} --range-m 1 -o harbour.csv"));
    assert!(
        beside.stdout.starts_with("channel,c_per_m,range_m,"),
        "{}",
        beside.stdout
    );
    assert!(!folder.text("harbour.csv").contains("channel"));
    // Water alone, or nearly so, scatters as molecules do.
    for chlorophyll in ["0", "1e-6"] {
        let pure = folder.good(&format!("water --chlorophyll-mg-m3 {chlorophyll}"));
        let told = "\n# phase = { model = \"rayleigh\" }\n";
        assert!(pure.stdout.contains(told), "{}", pure.stdout);
    }
}

#[test]
fn how_far_one_sees_finds_the_waters_of_ocean_and_coast() {
    let folder = Folder::new();
    let run = folder.good("water --secchi-m 8");
    assert_eq!(
        run.stdout,
        "jerlov,secchi_m,visibility_m,wavelength_nm,c_per_m\nIII,9,4.46,532,1.09\n1C-3C@0.2,7.96,7.71,532,0.603\n"
    );
    // Every type, and what was found lies between its neighbours.
    let all = folder.good("water --sight").stdout;
    let types = folder.good("water --list").stdout;
    let names = all.lines().skip(1).filter_map(|row| row.split(',').next());
    assert!(names.eq(types.lines()), "{all}");
    assert!(
        all.contains("\n1C,9,9.93,532,") && all.contains("\n3C,5.77,4.07,532,"),
        "{all}"
    );
    // The answer is the name of a water, of which the tables hold what was told.
    let c = |name: &str, nm: f64| {
        let table = folder.good(&format!("water --jerlov {name} --bands spectral"));
        let row = table.rows().into_iter().find(|row| row[0] == nm);
        row.expect("a wavelength")[3]
    };
    for per_m in [0.8, 2.0] {
        let found = folder
            .good(&format!("water --attenuation-per-m {per_m}@650"))
            .stdout;
        for row in found.lines().skip(1) {
            let name = row.split(',').next().expect("a name");
            assert!((c(name, 650.0) / per_m - 1.0).abs() < 0.15, "{found}");
        }
    }
    let clear = json(&folder.good("water --visibility-m 30 --json").stdout);
    assert_eq!(
        clear.as_array().map(Vec::len),
        Some(1),
        "no coast is so clear"
    );
    assert_eq!(clear[0]["jerlov"], "IB");
}

/// A water between two types has one name in all programs.
#[test]
fn a_water_between_types_goes_by_one_name() {
    let folder = Folder::with_scene();
    let told = json(&folder.good("water --jerlov 1C-3C@0.2 --json").stdout);
    assert_eq!(told["jerlov"], "1C-3C@0.2");
    let mean = |name: &str| {
        let rows = folder.good(&format!("water --jerlov {name}")).rows();
        rows[1][1]
    };
    let expected = 0.8 * mean("1C") + 0.2 * mean("3C");
    assert!((mean("1C-3C@0.2") / expected - 1.0).abs() < 1e-7);
    let render = |set: &str, to: &str| {
        folder.write(
            "set.toml",
            folder.text("scene.toml").replace("jerlov = \"IB\"", set),
        );
        folder.good(&format!(
            "render set.toml -o {to} --spp 1 --backend cpu --quiet"
        ));
        folder.read(to)
    };
    let one = render("jerlov = \"1C-3C@0.2\"", "one.png");
    let other = render(
        "jerlov = { between = [\"1C\", \"3C\"], share = 0.2 }",
        "other.png",
    );
    assert!(one == other);
}

#[test]
fn water_tables_are_made_of_a_table_by_wavelength() {
    let folder = Folder::new();
    let tables = "--distances-m 0.8 1.5 --views 2 --depths-m 3 --kilo-paths 8";
    folder.good("water --jerlov II --bands spectral -o ii.csv");
    folder.good(&format!(
        "water-tables --spectrum ii.csv {tables} -o of_table.json"
    ));
    let made = json(&folder.text("of_table.json"));
    let bands = json(&folder.good("water --spectrum ii.csv --json").stdout);
    for field in ["a_per_m", "b_per_m"] {
        for k in 0..3 {
            let [own, other] = [&made["water"], &bands["wideband"]].map(|of| of[field][k].as_f64());
            let ratio = own.expect("a number") / other.expect("a number");
            // The file keeps single precision.
            assert!((ratio - 1.0).abs() < 1e-7, "{field} {k}: {ratio}");
        }
    }
    folder.write(
        "red.csv",
        "wavelength_nm,a_per_m,b_per_m\n590,0.2,0.1\n640,0.2,0.1\n690,0.2,0.1\n",
    );
    folder.refused(
        &format!("water-tables --spectrum red.csv {tables} -o w.json"),
        &["red.csv: must cover 400 to 700 nm", "channel"],
    );
}

#[test]
fn what_cannot_be_is_refused() {
    let folder = Folder::new();
    for (line, told) in [
        ("--chlorophyll-mg-m3 -2", "in [0, 100] mg/m3, got -2"),
        (
            "--chlorophyll-mg-m3 1 --minerals-g-m3 1e5",
            "in [0, 2000] g/m3",
        ),
        (
            "--secchi-m 8 --minerals-g-m3 3",
            "--minerals-g-m3 goes with --chlorophyll-mg-m3",
        ),
        (
            "--jerlov 3C --cdom-440-per-m 1",
            "--cdom-440-per-m goes with --chlorophyll-mg-m3",
        ),
        ("--chlorophyll-mg-m3 1 --bands mean", "cannot be used with"),
        (
            "--secchi-m 0.4",
            "--secchi-m must be within what is found on Jerlov's scale, 1.74 to 56.2 m, got 0.4",
        ),
        ("--visibility-m -1", "must be a finite number > 0"),
        ("--attenuation-per-m 0.8", "such as 0.8@650"),
        ("--attenuation-per-m 0.8@900", "from 400 to 700 nm"),
        ("--secchi-m 8 --range-m 2", "--range-m goes with"),
        ("--jerlov IB-II", "IB-II"),
    ] {
        folder.refused(&format!("water {line}"), &[told]);
    }
}
