//! Buses and faults of a scenario.

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::{
    DriverPhase, FaultDirection, FaultKind, FaultSelection, FrameChoice, FrameCount, Timing,
};
use twinrig_scenario::{OptionValue, Verdict};

fn bus(more: &str) -> String {
    crate::common::text(&format!("[bus]\nkind = \"sbcp\"\n{more}"))
}

#[test]
fn bus_name_defaults_to_its_kind() {
    let one = crate::common::parse(&bus("")).unwrap();
    assert_eq!(one.buses[0].name.value, "sbcp");
    let two =
        "[[bus]]\nkind = \"sbcp\"\nname = \"left\"\n[[bus]]\nkind = \"sbcp\"\nname = \"right\"\n";
    let two = crate::common::parse(&crate::common::text(two)).unwrap();
    let names: Vec<_> = two
        .buses
        .iter()
        .map(|bus| bus.name.value.as_str())
        .collect();
    assert_eq!(names, ["left", "right"]);
    assert!(two.bus("right").is_some() && two.bus("sbcp").is_none());
}

#[test]
fn board_options_apply_to_all_boards_or_to_named_ones() {
    let number = |text: &str, board: &str| {
        let scenario = crate::common::parse(&bus(text)).unwrap();
        let value = scenario.buses[0].options.of_member("clock", board).cloned();
        value.map(|value| match value {
            OptionValue::Number(value) => value,
            other => panic!("{other:?}"),
        })
    };
    assert_eq!(number("clock = \"764 ppm\"", "RH"), Some(764e-6));
    assert_eq!(number("clock = { LF = \"-764 ppm\" }", "LF"), Some(-764e-6));
    assert_eq!(number("clock = { LF = \"-764 ppm\" }", "RH"), None);
}

#[test]
fn tables_of_a_bus_are_read() {
    let scenario = crate::common::parse(&bus(
        "usb = { jitter = { min = \"0 us\", max = \"50 us\" } }",
    ))
    .unwrap();
    let usb = scenario.buses[0].options.group("usb").unwrap();
    assert_eq!(usb.duration("latency_timer"), None);
    let Some(Timing::Uniform { max, .. }) = usb.time("jitter") else {
        panic!("{usb:?}");
    };
    assert_eq!(*max, SimDuration::from_micros(50));
}

#[test]
fn fault_lasts_for_its_duration_or_to_the_end() {
    let faults = "[[fault]]\nat = \"9 s\"\non = \"wire/sbcp\"\nkind = \"drop\"\nfor = \"20 ms\"\n\
                  [[fault]]\nat = \"9 s\"\non = \"wire/sbcp/LF\"\nkind = \"flip\"\nrate = 1e-4\n";
    let scenario = crate::common::parse(&bus(faults)).unwrap();
    let [drop, flip] = &scenario.faults[..] else {
        panic!("{:?}", scenario.faults);
    };
    assert_eq!(drop.at, SimTime::ZERO + SimDuration::from_secs(9));
    assert_eq!(drop.lasts, Some(SimDuration::from_millis(20)));
    assert_eq!(drop.kind, FaultKind::Drop { probability: 1.0 });
    assert_eq!(
        (flip.lasts, flip.kind),
        (None, FaultKind::Flip { rate: 1e-4 })
    );
}

#[test]
fn fault_of_chosen_frames_begins_with_the_run() {
    let faults = "[[fault]]\non = \"wire/sbcp/LF\"\nkind = \"drop\"\ndirection = \"in\"\n\
                  phase = \"opening\"\non_frame = { after = \"ping\", nth = 3 }\n";
    let scenario = crate::common::parse(&bus(faults)).unwrap();
    let fault = &scenario.faults[0];
    let select = FaultSelection {
        direction: Some(FaultDirection::In),
        phase: Some(DriverPhase::Opening),
        frames: Some(FrameChoice {
            after: Some("ping".to_owned()),
            count: FrameCount::Nth(3),
        }),
    };
    assert_eq!(
        (fault.at, fault.lasts, &fault.select),
        (SimTime::ZERO, None, &select)
    );
    assert_eq!(
        fault.after.as_ref().map(|it| it.value.as_str()),
        Some("ping")
    );
}

#[test]
fn choices_without_a_frame_are_refused() {
    for (keys, message) in [
        ("kind = \"drop\"\non_frame = {}", "this chooses no frames"),
        (
            "kind = \"drop\"\non_frame = { nth = 0 }",
            "there is no frame 0",
        ),
        (
            "kind = \"drop\"\non_frame = { nth = 2, every = 2 }",
            "`nth` and `every` are two choices",
        ),
        (
            "kind = \"stuck\"\non_frame = { nth = 2 }",
            "a fault `stuck` acts in a window of time only",
        ),
        (
            "kind = \"babble\"\nphase = \"opening\"",
            "a fault `babble` acts in a window of time only",
        ),
    ] {
        let text = bus(&format!("[[fault]]\non = \"wire/sbcp\"\n{keys}\n"));
        let error = crate::common::parse(&text).unwrap_err().to_string();
        assert!(error.contains(message), "{keys}: {error}");
    }
}

#[test]
fn free_running_cycle_has_rate_longest_cycle_and_half_range() {
    let begins = [0, 4_000, 8_100, 12_000, 16_500];
    let events: Vec<_> = begins.map(|at| (at, crate::common::run::BEGIN)).into();
    let outcome = |expect: &str| {
        crate::common::run::cycles(
            &format!("timing = {{ of = \"control\", {expect} }}"),
            &events,
        )
    };
    let measured = |expect: &str| outcome(expect).measured.unwrap();
    assert!((measured("cycle_rate = { min = \"1 Hz\" }") - 4.0 / 16.5e-3).abs() < 1e-9);
    assert!((measured("longest_cycle = { max = \"1 s\" }") - 4.5e-3).abs() < 1e-12);
    assert!((measured("half_range = { max = \"1 s\" }") - 0.3e-3).abs() < 1e-12);
    assert_eq!(
        outcome("longest_cycle = { max = \"4.4 ms\" }").verdict,
        Verdict::Fail
    );
}

#[test]
fn bus_in_a_build_without_buses_is_rejected() {
    let catalogue = twinrig_scenario::Catalogue {
        buses: Vec::new(),
        ..crate::common::catalogue()
    };
    let parsed = twinrig_scenario::Scenario::parse(
        "run.toml",
        &bus(""),
        std::path::Path::new("."),
        &[],
        &catalogue,
    );
    let error = parsed.unwrap_err().to_string();
    assert!(error.contains("this build has no bus"), "{error}");
}
