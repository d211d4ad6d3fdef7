//! Recorded data are read back completely and bit for bit.

use super::common::*;
use twinrig_kernel::SimTime;
use twinrig_record::{
    ChangeMessage, EventMessage, FootstepMessage, Recorder, Recording, VerdictMessage,
};
use twinrig_runtime::Group;

#[test]
fn samples_round_trip_bit_for_bit() {
    let recording = read(&recorded(100));
    assert!(recording.is_complete());
    let plant = recording.group("plant").unwrap();
    assert_eq!(plant.len(), 100);
    for (step, sample) in (0..).zip(recording.samples(plant)) {
        assert_eq!(sample.time, SimTime::from_nanos(step * PERIOD_NS));
        let bits: Vec<u64> = sample.all().map(f64::to_bits).collect();
        let expected: Vec<u64> = plant_values(step).into_iter().map(f64::to_bits).collect();
        assert_eq!(bits, expected);
    }
}

#[test]
fn special_floats_round_trip_bit_for_bit() {
    let odd = [
        f64::from_bits(0x7ff8_0000_dead_beef),
        f64::NEG_INFINITY,
        f64::MIN_POSITIVE / 3.0,
    ];
    let bytes = record(Vec::new(), 1, &|_| true, &|group, _, values| {
        if group == Group::Plant {
            values[..3].copy_from_slice(&odd);
        }
    })
    .unwrap();
    let series = read(&bytes).series("body/position").unwrap();
    assert_eq!(
        series
            .values
            .iter()
            .map(|v| v.to_bits())
            .collect::<Vec<_>>(),
        odd.map(f64::to_bits)
    );
}

#[test]
fn only_selected_signals_are_recorded_with_name_and_unit() {
    let keep = |name: &str| name != "body/orientation";
    let recording = read(&record(Vec::new(), 30, &keep, &|_, _, _| ()).unwrap());
    let signals: Vec<_> = recording
        .groups()
        .iter()
        .flat_map(|group| &group.signals)
        .collect();
    let names: Vec<_> = signals
        .iter()
        .map(|signal| (signal.name.as_str(), signal.unit.as_str()))
        .collect();
    assert_eq!(
        names,
        [
            ("body/position", "m"),
            ("leg/LF/angles", "rad"),
            ("leg/LF/foot/load", "N"),
            ("body/velocity", "m/s"),
            ("body/angular_velocity", "rad/s"),
            ("leg/LF/hip/position", "rad"),
            ("leg/LF/hip/torque", "N·m"),
            ("leg/LF/hip/command", "rad")
        ]
    );
    let load = recording.series("leg/LF/foot/load").unwrap();
    assert_eq!(load.values[3], plant_values(3)[10]);
    let error = recording.series("leg/LF/foot/lod").unwrap_err();
    assert_eq!(
        error.to_string(),
        "no signal `leg/LF/foot/lod` in this recording; did you mean `leg/LF/foot/load`?"
    );
}

#[test]
fn files_notes_messages_and_result_round_trip() {
    let recording = read(&recorded(100));
    assert_eq!(
        recording.attachment("scenario.toml"),
        Some(&b"name = \"test\"\n"[..])
    );
    assert_eq!(recording.attachments().count(), 2);
    assert_eq!(recording.seed(), Some(7));
    assert_eq!(recording.note("build"), Some("0.1.0 (abc)"));
    assert_eq!(recording.note("plant"), Some("massless"));
    assert_eq!(
        recording.reached(),
        Some(SimTime::from_nanos(100 * PERIOD_NS))
    );
    assert_eq!(recording.fingerprint().map(str::len), Some(64));
    let steps: Vec<(SimTime, FootstepMessage)> = recording.messages().unwrap();
    assert_eq!(steps.len(), 4);
    assert_eq!(
        steps[1],
        (SimTime::from_nanos(49 * PERIOD_NS), footstep(49))
    );
    let at = SimTime::from_nanos(40 * PERIOD_NS);
    let change = ChangeMessage {
        variable: "step_length".to_owned(),
        value: 0.11,
    };
    assert_eq!(recording.messages().unwrap(), [(at, change)]);
    let skipped = EventMessage {
        event: "task skipped".to_owned(),
        part: Some("direct".to_owned()),
        count: None,
    };
    assert_eq!(recording.messages().unwrap(), [(at, skipped)]);
    assert_eq!(recording.messages::<VerdictMessage>().unwrap(), []);
}

#[test]
fn equal_runs_yield_equal_bytes() {
    assert_eq!(recorded(200), recorded(200));
}

#[test]
fn deselecting_a_signal_changes_no_other_signal() {
    let all = read(&recorded(50));
    let fewer = read(
        &record(
            Vec::new(),
            50,
            &|name| !name.contains("angles"),
            &|_, _, _| (),
        )
        .unwrap(),
    );
    for name in [
        "body/position",
        "body/orientation",
        "leg/LF/foot/load",
        "leg/LF/hip/command",
    ] {
        assert_eq!(all.series(name).unwrap(), fewer.series(name).unwrap());
    }
    assert_eq!(all.fingerprint(), fewer.fingerprint());
}

#[test]
fn full_disk_is_an_error_of_finish() {
    struct Small(usize);
    impl std::io::Write for Small {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            self.0 = self
                .0
                .checked_sub(bytes.len())
                .ok_or_else(|| std::io::Error::other("disk full"))?;
            Ok(bytes.len())
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    let result = record(Small(40_000), 5_000, &|_| true, &|_, _, _| ());
    assert!(matches!(result, Err(twinrig_record::RecordError::Write(_))));
}

#[test]
fn run_without_recorded_signals_contains_its_files() {
    let recording = read(&record(Vec::new(), 10, &|_| false, &|_, _, _| ()).unwrap());
    assert!(recording.group("plant").unwrap().is_empty());
    assert_eq!(recording.seed(), Some(7));
}

#[test]
fn missing_file_is_named() {
    let error = Recording::open(std::path::Path::new("/nowhere/run.mcap")).unwrap_err();
    assert!(error.to_string().contains("/nowhere/run.mcap"));
}

#[test]
fn attachments_are_on_disk_before_the_first_sample() {
    let file = std::env::temp_dir().join(format!("twinrig-early-{}.mcap", std::process::id()));
    let recorder = Recorder::create(&file, &info(), &[], &skeleton(), cadence()).unwrap();
    let recording = Recording::open(&file).unwrap();
    drop(recorder);
    std::fs::remove_file(&file).unwrap();
    assert!(!recording.is_complete());
    assert_eq!(recording.seed(), Some(7));
    assert_eq!(recording.attachments().count(), 2);
}
