//! Leaving out what nothing needs changes no other byte of the run.

use twinrig::Registry;
use twinrig_record::{Comparison, Recording, first_divergence};
use twinrig_tests::{Scene, record};

fn recording(scene: &Scene, name: &str) -> Recording {
    let registry = Registry::standard();
    let (report, bytes) = record(&scene.assembly(&registry), name);
    assert_eq!(report.error, None);
    Recording::from_bytes(bytes).unwrap()
}

fn compare(whole: &Scene, lean: &Scene, name: &str) -> Comparison {
    let whole = recording(whole, &format!("{name}-whole"));
    let lean = recording(lean, &format!("{name}-lean"));
    let comparison = first_divergence(&whole, &lean);
    assert!(comparison.equal_samples > 0 && comparison.signals > 0);
    assert!(!comparison.only_in_a.is_empty(), "nothing was left out");
    assert_eq!(comparison.only_in_b, Vec::<String>::new());
    comparison
}

/// Signals that are not recorded, sensors that nobody reads among them.
const LEAN: &str = "signals = [\"body/*\", \"leg/LF/hip/*\"]\nframes = \"0 Hz\"";

#[test]
fn signals_that_nobody_needs_are_not_computed_and_no_other_changes() {
    let whole = Scene::default();
    let lean = Scene {
        record: LEAN,
        ..whole.clone()
    };
    let registry = Registry::standard();
    let [full, lean_full] = [whole.clone(), lean.clone()].map(Scene::of_full_legs);
    assert_eq!(
        compare(&full, &lean_full, "signals-of-full-legs").first,
        None
    );
    let wanted = lean.assembly(&registry).scene().wanted.clone();
    assert!(
        wanted
            .iter()
            .all(|name| name.starts_with("body/") || name.starts_with("leg/LF/hip/")),
        "{wanted:?}"
    );
    assert_eq!(compare(&whole, &lean, "signals").first, None);
}

#[test]
fn a_ground_sensor_that_nobody_reads_is_left_out_and_says_so() {
    let whole = Scene::default();
    let signals = "signals = [\"body/*\", \"energy/*\", \"leg/*/angles\", \"leg/*/hip/*\", \"leg/*/foot/position\"]";
    let lean = Scene {
        record: signals,
        ..whole.clone()
    };
    let registry = Registry::standard();
    let assembly = lean.assembly(&registry);
    let left_out = &assembly.scene().left_out;
    let sensor = left_out
        .iter()
        .find(|part| part.part == "leg/*/foot/load")
        .unwrap();
    assert!(
        sensor.why.contains("no controller reads it"),
        "{}",
        sensor.why
    );
    assert!(
        !assembly
            .scene()
            .wanted
            .iter()
            .any(|name| name.ends_with("foot/load"))
    );
    let comparison = compare(&whole, &lean, "sensor");
    assert_eq!(comparison.first, None);
    assert!(
        comparison
            .only_in_a
            .contains(&"plant: leg/LF/foot/load".to_owned())
    );
}

#[test]
fn a_leg_that_is_taken_out_changes_no_byte_of_the_others() {
    // Legs of a held trunk meet nowhere, on the ground neither. Energies are sums over all of them.
    let record = "signals = [\"body/*\", \"leg/**\"]";
    let whole = Scene {
        base: "fixed",
        record,
        ..Scene::default()
    };
    let lean = Scene {
        legs: &["LF", "LH", "RH"],
        ..whole.clone()
    };
    let registry = Registry::standard();
    let left_out = lean.assembly(&registry).scene().left_out.clone();
    assert!(
        left_out.iter().any(|part| part.part.contains("leg")),
        "{left_out:?}"
    );
    let comparison = compare(&whole, &lean, "leg");
    assert_eq!(comparison.first, None);
    assert!(
        comparison
            .only_in_a
            .iter()
            .all(|name| name.contains("leg/RF/")),
        "{:?}",
        comparison.only_in_a
    );
}

#[test]
fn poses_that_are_not_recorded_change_no_byte() {
    let whole = Scene::default();
    let lean = Scene {
        record: "frames = \"0 Hz\"",
        ..whole.clone()
    };
    let (whole, lean) = (
        recording(&whole, "poses-whole"),
        recording(&lean, "poses-lean"),
    );
    let comparison = first_divergence(&whole, &lean);
    assert_eq!((comparison.first, comparison.only_in_a.len()), (None, 0));
    assert_eq!(whole.fingerprint(), lean.fingerprint());
}
