//! Files that the viewer writes by itself.

use std::sync::Arc;

use uw_viewer::export;
use uw_viewer::guidance::Guidance;

use crate::support::{profile, recording, repository, small};

#[test]
fn plots_hold_what_is_known_and_only_numbers() {
    let folder = tempfile::tempdir().expect("folder");
    let (_, settings) = small();
    let assets = Some(repository().join("assets"));
    let mut guidance = Guidance::new(assets, egui::Context::default());
    let path = folder.path().join("plots.svg");
    let text = || std::fs::read_to_string(&path).expect("written");
    export::plots(&settings, &guidance, &path).expect("water to plot");
    assert!(text().contains("Jerlov IB") && text().contains("Phase function"));
    assert!(!text().contains("K_z"));
    let record = folder.path().join("operation.jsonl");
    std::fs::write(&record, recording(1.0)).expect("written");
    guidance.profile = Some(Arc::new(profile()));
    guidance.open_record(&record).expect("a recording");
    guidance.poll(&mut uw_viewer::ui::toasts::Toasts::default());
    export::plots(&settings, &guidance, &path).expect("more to plot");
    for title in [
        "Jerlov IB",
        "K_z",
        "K_c, lamps on",
        "K_c, lamps off",
        "Objective",
    ] {
        assert!(text().contains(title), "{title}");
    }
    assert!(!text().contains("NaN") && !text().contains("inf"));
    let picture = folder.path().join("plots.PNG");
    export::plots(&settings, &guidance, &picture).expect("the same as pixels");
    let frame = uw_render::image::read_frame(&picture).expect("a picture");
    assert_eq!((frame.width, frame.height), (640, 6 * 380));
    let other = folder.path().join("plots.pdf");
    let refused = export::plots(&settings, &guidance, &other).expect_err("another format");
    assert!(refused.contains(".svg or .png"), "{refused}");
}

#[test]
fn without_anything_to_plot_the_message_says_so() {
    let folder = tempfile::tempdir().expect("folder");
    let (_, mut settings) = small();
    settings.water = None;
    let guidance = Guidance::new(None, egui::Context::default());
    let path = folder.path().join("plots.svg");
    let refused = export::plots(&settings, &guidance, &path).expect_err("nothing");
    assert!(refused.contains("nothing to plot"), "{refused}");
    assert!(!path.exists());
    settings.water = Some(uw_viewer::model::Water::default());
    let nowhere = folder.path().join("none/plots.svg");
    let refused = export::plots(&settings, &guidance, &nowhere).expect_err("no folder");
    assert!(refused.contains("none/plots.svg"), "{refused}");
}
