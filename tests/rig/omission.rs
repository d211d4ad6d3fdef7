//! Omitting unneeded parts changes no other byte of the run.

use twinrig::Registry;
use twinrig_record::{Comparison, Recording, first_divergence};
use twinrig_tests::{TrotFixture, record};

fn recording(fixture: &TrotFixture, name: &str) -> Recording {
    let registry = Registry::standard();
    let (report, bytes) = record(&fixture.assembly(&registry), name);
    assert_eq!(report.error, None);
    Recording::from_bytes(bytes).unwrap()
}

fn compare(complete: &TrotFixture, reduced: &TrotFixture, name: &str) -> Comparison {
    let complete = recording(complete, &format!("{name}-whole"));
    let reduced = recording(reduced, &format!("{name}-lean"));
    let comparison = first_divergence(&complete, &reduced);
    assert!(comparison.equal_samples > 0 && comparison.signals > 0);
    assert!(!comparison.only_in_a.is_empty(), "nothing was omitted");
    assert_eq!(comparison.only_in_b, Vec::<String>::new());
    comparison
}

/// Records few signals and no frames; the sensors without a reader are not recorded.
const REDUCED: &str = "signals = [\"body/*\", \"leg/LF/hip/*\"]\nframes = \"0 Hz\"";

/// With compliant constraints the legs share the substeps of the error control.
const RIGID: &str = "constraints = \"rigid\"";

#[test]
fn unneeded_signals_are_not_computed_and_others_unchanged() {
    let complete = TrotFixture::default();
    let reduced = TrotFixture {
        record: REDUCED,
        ..complete.clone()
    };
    let registry = Registry::standard();
    let [complete_legs, reduced_legs] =
        [complete.clone(), reduced.clone()].map(TrotFixture::with_leg_inertia);
    assert_eq!(
        compare(&complete_legs, &reduced_legs, "signals-of-full-legs").first,
        None
    );
    let wanted = reduced.assembly(&registry).scene().wanted.clone();
    assert!(
        wanted
            .iter()
            .all(|name| name.starts_with("body/") || name.starts_with("leg/LF/hip/")),
        "{wanted:?}"
    );
    assert_eq!(compare(&complete, &reduced, "signals").first, None);
}

#[test]
fn unread_ground_sensor_is_omitted_and_reported() {
    let complete = TrotFixture::default();
    let signals = "signals = [\"body/*\", \"energy/*\", \"leg/*/angles\", \"leg/*/hip/*\", \"leg/*/foot/position\"]";
    let reduced = TrotFixture {
        record: signals,
        ..complete.clone()
    };
    let registry = Registry::standard();
    let assembly = reduced.assembly(&registry);
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
    let comparison = compare(&complete, &reduced, "sensor");
    assert_eq!(comparison.first, None);
    assert!(
        comparison
            .only_in_a
            .contains(&"plant: leg/LF/foot/load".to_owned())
    );
}

#[test]
fn omitted_leg_changes_no_byte_of_the_others() {
    // Legs of a fixed trunk without ground contact do not interact. Energies are sums over all
    // legs.
    let record = "signals = [\"body/*\", \"leg/**\"]";
    let complete = TrotFixture {
        base: "fixed",
        plant: RIGID,
        record,
        ..TrotFixture::default()
    };
    let reduced = TrotFixture {
        legs: &["LF", "LH", "RH"],
        ..complete.clone()
    };
    let registry = Registry::standard();
    let left_out = reduced.assembly(&registry).scene().left_out.clone();
    assert!(
        left_out.iter().any(|part| part.part.contains("leg")),
        "{left_out:?}"
    );
    let comparison = compare(&complete, &reduced, "leg");
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
fn omitted_leg_changes_no_byte_of_linear_set_points() {
    let complete = TrotFixture {
        base: "fixed",
        plant: RIGID,
        record: "signals = [\"leg/**\"]",
        actuator: "set_point = \"linear\"",
        ..TrotFixture::default()
    };
    let reduced = TrotFixture {
        legs: &["LF", "LH"],
        ..complete.clone()
    };
    assert_eq!(compare(&complete, &reduced, "linear-leg").first, None);
}

#[test]
fn unrecorded_poses_change_no_byte() {
    let complete = TrotFixture::default();
    let reduced = TrotFixture {
        record: "frames = \"0 Hz\"",
        ..complete.clone()
    };
    let (complete, reduced) = (
        recording(&complete, "poses-whole"),
        recording(&reduced, "poses-lean"),
    );
    let comparison = first_divergence(&complete, &reduced);
    assert_eq!((comparison.first, comparison.only_in_a.len()), (None, 0));
    assert_eq!(complete.fingerprint(), reduced.fingerprint());
}
