//! Driver and emulated servos on a bus in virtual time: preparation, transfers by each pattern,
//! their durations, missing servos, faults, and the cost of many servos.

use proptest::prelude::*;
use twinrig_dynamixel::ax::AX12A;
use twinrig_dynamixel::x::{XL330_M288, register as r};
use twinrig_dynamixel::{
    DynamixelDriver, JointSignals, ReadPattern, ServoBusConfig, ServoBusWire, ServoConfig,
};
use twinrig_kernel::{BoardClock, LocalDuration, SimDuration, SimTime};
use twinrig_runtime::{BusHealth, Driver, Part, Plant};
use twinrig_testing::wired_harness::WiredHarness;
use twinrig_wire::{
    DriverPhase, Fault, FaultDirection, FaultKind, FaultSchedule, FaultSelection, FrameChoice,
    FrameCount, UsbPreset, UsbTiming,
};

const PATTERNS: [ReadPattern; 4] = [
    ReadPattern::Read,
    ReadPattern::SyncRead,
    ReadPattern::BulkRead,
    ReadPattern::FastSyncRead,
];
const PERIOD: SimDuration = SimDuration::from_millis(20);

fn config(count: u8, pattern: ReadPattern) -> ServoBusConfig {
    let servo = |n: u8| ServoConfig {
        name: format!("joint{n}"),
        kind: &XL330_M288,
        id: n + 1,
        registers: Vec::new(),
        settings: vec![(r::POSITION_P_GAIN, 800)],
        signals: JointSignals::of_joint(&format!("joint{n}")),
        command: format!("joint{n}/command"),
        voltage: 5.0,
        temperature: 25.0,
        clock: BoardClock::IDEAL,
    };
    ServoBusConfig {
        name: "dxl".to_owned(),
        servos: (0..count).map(servo).collect(),
        byte_time: SimDuration::from_micros(10),
        pattern,
        period: PERIOD,
        timeout: SimDuration::from_millis(5),
        usb: UsbTiming::preset(UsbPreset::Earliest),
        turnaround: SimDuration::ZERO,
        faults: FaultSchedule::default(),
        seed: 1,
    }
}

/// Faults of the bus: one from `at_ms` on, for `lasts_ms`.
fn faults(on: &str, at_ms: u64, kind: FaultKind, lasts_ms: u64) -> FaultSchedule {
    let fault = Fault {
        at: SimTime::ZERO + SimDuration::from_millis(at_ms),
        on: on.to_owned(),
        kind,
        lasts: SimDuration::from_millis(lasts_ms),
        select: FaultSelection::default(),
    };
    FaultSchedule {
        faults: vec![fault],
        seed: 1,
    }
}

type Harness = WiredHarness<DynamixelDriver, ServoBusWire>;

fn harness(config: &ServoBusConfig) -> Harness {
    let joints: Vec<String> = config
        .servos
        .iter()
        .map(|servo| servo.name.clone())
        .collect();
    WiredHarness::new(config.driver().unwrap(), config.wire().unwrap(), &joints)
}

/// Returns a counter of the driver.
fn count(rig: &Harness, name: &str) -> f64 {
    rig.diagnostic(&format!("dxl/{name}"))
}

#[test]
fn joints_reach_their_commands_by_each_pattern() {
    for pattern in PATTERNS {
        let mut rig = harness(&config(3, pattern));
        rig.open().unwrap();
        let commands = [0.5, -0.25, 0.0];
        rig.transfers(50, PERIOD, &commands);
        // Within a count, 1.5 mrad.
        for (found, command) in rig.driver.to_process().iter().zip(commands) {
            assert!(
                (found - command).abs() < 1.6e-3,
                "{pattern:?} {found} {command}"
            );
        }
        assert_eq!(count(&rig, "answers"), 3.0 * (6.0 + 50.0), "{pattern:?}");
        let errors = [
            "lost",
            "refused",
            "damaged",
            "unexpected",
            "saturated",
            "garbage",
        ];
        assert!(
            errors.iter().all(|name| count(&rig, name) == 0.0),
            "{pattern:?}"
        );
        rig.close().unwrap();
        assert!(
            rig.joints.inputs.iter().all(|input| *input == 0.0),
            "{pattern:?}"
        );
    }
}

/// Servos of protocol 1.0, which are read one after the other only.
#[test]
fn joints_of_the_ax_series_reach_their_commands() {
    let mut config = config(3, ReadPattern::Read);
    for servo in &mut config.servos {
        servo.kind = &AX12A;
        servo.settings.clear();
        servo.voltage = 11.1;
    }
    let mut rig = harness(&config);
    rig.open().unwrap();
    let commands = [0.5, -0.25, 0.0];
    rig.transfers(50, PERIOD, &commands);
    // Within the compliance margin and a half count: 1.5 of 360°/1228.8.
    for (found, command) in rig.driver.to_process().iter().zip(commands) {
        assert!((found - command).abs() < 7.7e-3, "{found} {command}");
    }
    for name in ["lost", "refused", "damaged", "unexpected", "garbage"] {
        assert_eq!(count(&rig, name), 0.0, "{name}");
    }
    config.pattern = ReadPattern::SyncRead;
    let error = config.driver().err().unwrap().to_string();
    assert!(
        error.ends_with("the servos do not have the instruction `sync read`"),
        "{error}"
    );
}

/// Bytes of a transfer of n servos on the bus, of 10 µs each, return delays of 0, and USB in steps
/// of 125 µs: a read of 14 bytes and an answer of 15 for each servo alone; one instruction and n
/// answers of a sync or bulk read; one answer of 11 + 8 n bytes of a fast sync read.
#[test]
fn durations_are_those_of_their_bytes() {
    for servos in [1, 6, 12] {
        let n = u64::from(servos);
        let write = 14 + 5 * n;
        for (pattern, bytes, trips) in [
            (ReadPattern::Read, write + n * (14 + 15), n),
            (ReadPattern::SyncRead, write + 14 + n + 15 * n, 1),
            (ReadPattern::BulkRead, write + 10 + 5 * n + 15 * n, 1),
            (ReadPattern::FastSyncRead, write + 14 + n + 8 + 8 * n, 1),
        ] {
            let mut rig = harness(&config(servos, pattern));
            rig.open().unwrap();
            let found = rig.transfer(&vec![0.0; servos.into()]);
            let least = SimDuration::from_micros(10) * bytes;
            // A trip ends in the microframe after its bytes, and begins in the next one.
            let most = least + SimDuration::from_micros(3 * 125 + 20) * trips;
            assert!(
                (least..=most).contains(&found),
                "{servos} {pattern:?}: {found} {least}"
            );
        }
    }
}

#[test]
fn a_missing_servo_is_counted_and_the_others_are_read_where_they_answer() {
    for (pattern, lost) in [
        (ReadPattern::Read, 1.0),
        // Those behind it remain silent.
        (ReadPattern::SyncRead, 2.0),
        (ReadPattern::BulkRead, 2.0),
        (ReadPattern::FastSyncRead, 3.0),
    ] {
        let mut config = config(3, pattern);
        config.faults = faults(
            "wire/dxl/joint1",
            2_000,
            FaultKind::Unplug { fails: false },
            1_000,
        );
        let mut rig = harness(&config);
        rig.open().unwrap();
        rig.run_until(SimTime::ZERO + SimDuration::from_secs(2));
        rig.transfers(1, PERIOD, &[0.0; 3]);
        assert_eq!(count(&rig, "lost"), lost, "{pattern:?}");
        rig.run_until(SimTime::ZERO + SimDuration::from_secs(4));
        rig.transfers(3, PERIOD, &[0.0; 3]);
        assert_eq!(count(&rig, "lost"), lost, "{pattern:?}");
    }
}

#[test]
fn opening_fails_with_the_servo_and_the_reason() {
    let failure = |change: fn(&mut ServoBusConfig)| {
        let emulated = config(2, ReadPattern::SyncRead);
        let mut rig = harness(&emulated);
        let mut believed = emulated;
        change(&mut believed);
        rig.driver = believed.driver().unwrap();
        rig.open().unwrap_err()
    };
    let absent = failure(|config| config.servos[1].id = 9);
    assert_eq!(
        absent,
        "joint1 (id 9) answered none of 3 instructions: check power, cable, baud rate and identifier"
    );
    let refused = failure(|config| config.servos[0].settings = vec![(r::OPERATING_MODE, 17)]);
    assert_eq!(
        refused,
        "joint0 (id 1): it refuses 17 as `operating_mode`: data range error"
    );
}

/// Closing turns off the torque of the other servos, too, and reports the one that is absent. The
/// answer to a read that was begun does not confirm it.
#[test]
fn closing_turns_off_all_servos_that_are_there() {
    let mut config = config(3, ReadPattern::SyncRead);
    config.faults = faults(
        "wire/dxl/joint0",
        1_000,
        FaultKind::Unplug { fails: false },
        9_000,
    );
    let mut rig = harness(&config);
    rig.open().unwrap();
    rig.run_until(SimTime::ZERO + SimDuration::from_secs(1));
    let error = rig.close().unwrap_err();
    assert!(
        error.starts_with("joint0 (id 1) did not confirm"),
        "{error}"
    );
    rig.run_until(rig.now + SimDuration::from_millis(5));
    let bridges = [0, 1, 2].map(|n| rig.joints.inputs[2 * n + 1]);
    assert_eq!(bridges, [1.0, 0.0, 0.0]);
}

/// The part of a servo that is damaged on its way is found by its own checksum, although those of
/// the servos behind it are computed over the damage.
#[test]
fn a_damaged_part_of_a_fast_read_is_not_a_position() {
    let mut config = config(3, ReadPattern::FastSyncRead);
    config.faults = faults(
        "wire/dxl/joint0",
        1_000,
        FaultKind::Flip { rate: 5e-3 },
        9_000,
    );
    let mut rig = harness(&config);
    rig.open().unwrap();
    rig.run_until(SimTime::ZERO + SimDuration::from_secs(1));
    for _ in 0..200 {
        rig.transfers(1, PERIOD, &[0.0; 3]);
        let angles = rig.driver.to_process();
        assert!(angles.iter().all(|angle| *angle == 0.0), "{angles:?}");
    }
    assert!(count(&rig, "damaged") > 5.0 && count(&rig, "lost") > 5.0);
}

#[test]
fn servos_that_cannot_be_told_apart_or_are_too_many_are_refused() {
    let mut twice = config(2, ReadPattern::SyncRead);
    twice.servos[1].id = 1;
    let error = twice.driver().err().unwrap().to_string();
    assert!(
        error.contains("joint0") && error.contains("joint1"),
        "{error}"
    );
    let mut unknown = config(1, ReadPattern::SyncRead);
    unknown.servos[0].settings = vec![(14, 1)];
    let error = unknown.driver().err().unwrap().to_string();
    assert_eq!(error, "the servo `joint0` has no register at 14");
    let many = config(200, ReadPattern::SyncRead);
    let error = many.driver().err().unwrap().to_string();
    assert!(
        error.starts_with("a bus of 200 servos: a packet of"),
        "{error}"
    );
    assert!(config(120, ReadPattern::FastSyncRead).driver().is_ok());
    assert!(config(140, ReadPattern::FastSyncRead).driver().is_err());
}

#[test]
fn a_command_that_is_not_a_number_leaves_the_last_goal() {
    let mut rig = harness(&config(2, ReadPattern::SyncRead));
    rig.open().unwrap();
    rig.transfers(60, PERIOD, &[0.3, f64::NAN]);
    rig.transfers(20, PERIOD, &[f64::NAN; 2]);
    let [one, two] = [0, 1].map(|n| rig.driver.to_process()[n]);
    assert!((one - 0.3).abs() < 1.6e-3 && two == 0.0, "{one} {two}");
    assert_eq!(count(&rig, "saturated"), 60.0 + 40.0);
}

/// The instants, transmissions and receptions of a transfer grow in proportion to the servos; in a
/// fast read all servos receive the parts of all those before them.
#[test]
fn work_grows_linearly_with_the_servos() {
    for pattern in [
        ReadPattern::Read,
        ReadPattern::SyncRead,
        ReadPattern::BulkRead,
    ] {
        let work = |servos: u8| {
            let mut config = config(servos, pattern);
            config.period = SimDuration::from_millis(40);
            let mut rig = harness(&config);
            rig.open().unwrap();
            let before = rig.work();
            rig.transfers(10, config.period, &vec![0.1; servos.into()]);
            let after = rig.work();
            (
                after.transmissions - before.transmissions,
                after.instants - before.instants,
                after.received - before.received,
            )
        };
        let [few, many] = [5, 50].map(work);
        assert_eq!([few.0, many.0], [50, 500], "{pattern:?}");
        assert!(many.1 < 10 * few.1, "{pattern:?}: {few:?}, {many:?}");
        // All servos receive the goals, and the entries of a bulk read: of 5 servos in four pieces
        // of USB each, of 50 in seven.
        assert!(many.2 < 20 * few.2, "{pattern:?}: {few:?}, {many:?}");
    }
}

#[test]
fn transfers_do_not_allocate() {
    for pattern in PATTERNS {
        let mut rig = harness(&config(4, pattern));
        rig.open().unwrap();
        let commands = [0.3, -0.3, 0.1, 0.0];
        rig.transfers(50, PERIOD, &commands);
        let run = || rig.transfers(100, PERIOD, &commands);
        let found = allocation_counter::measure(run).count_total;
        assert_eq!(found, 0, "{pattern:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// With noise on the wires nothing panics or hangs, what is lost is counted, and afterwards all
    /// servos answer again.
    #[test]
    fn noise_is_survived(
        rate in 1e-4..2e-2_f64, seed in any::<u64>(), pattern in 0_usize..4, on in 0_usize..3,
        ppb in -40_000_i64..40_000,
    ) {
        let mut config = config(4, PATTERNS[pattern]);
        config.seed = seed;
        for (n, servo) in config.servos.iter_mut().enumerate() {
            let offset = LocalDuration::from_nanos(170_000 * i64::try_from(n).unwrap());
            servo.clock = BoardClock::new(offset, ppb).unwrap();
        }
        config.faults = FaultSchedule {
            faults: vec![Fault {
                at: SimTime::ZERO + SimDuration::from_secs(1),
                on: ["wire/dxl", "wire/dxl/joint0", "wire/dxl/joint2"][on].to_owned(),
                kind: FaultKind::Flip { rate },
                lasts: SimDuration::from_secs(1),
                select: FaultSelection::default(),
            }],
            seed,
        };
        let mut rig = harness(&config);
        rig.open().unwrap();
        rig.run_until(SimTime::ZERO + SimDuration::from_secs(1));
        let transfers = |rig: &mut Harness, transfers| {
            let before = ["answers", "lost", "refused"].map(|name| count(rig, name));
            rig.transfers(transfers, PERIOD, &[0.1, -0.1, 0.2, 0.0]);
            let after = ["answers", "lost", "refused"].map(|name| count(rig, name));
            [0, 1, 2].map(|n| after[n] - before[n])
        };
        let [answers, lost, _] = transfers(&mut rig, 60);
        prop_assert_eq!(answers + lost, 240.0);
        rig.run_until(SimTime::ZERO + SimDuration::from_secs(3));
        rig.transfers(1, PERIOD, &[0.1, -0.1, 0.2, 0.0]);
        prop_assert_eq!(transfers(&mut rig, 10), [40.0, 0.0, 0.0]);
    }
}

/// Returns the numbers of the transfers in which an answer was lost, of 12, and 0 for the opening,
/// where the driver requests it again. Faults drop the answers of `joint1` that `frames` chooses in
/// a phase. The second result is that of a wire that is restored after each transfer.
fn lost_transfers(phase: DriverPhase, frames: FrameChoice) -> [Vec<usize>; 2] {
    let mut config = config(3, ReadPattern::Read);
    config.faults = FaultSchedule {
        faults: vec![Fault {
            at: SimTime::ZERO,
            on: "wire/dxl/joint1".to_owned(),
            kind: FaultKind::Drop { probability: 1.0 },
            lasts: SimDuration::MAX,
            select: FaultSelection {
                direction: Some(FaultDirection::In),
                phase: Some(phase),
                frames: Some(frames),
            },
        }],
        seed: 1,
    };
    let run = |restores: bool| {
        let mut rig = harness(&config);
        rig.open().unwrap();
        let mut health = BusHealth::default();
        rig.wire.report_health(&mut health);
        let mut lost = Vec::new();
        if health.fault_effects.iter().any(|effect| effect.harmed > 0) {
            lost.push(0);
        }
        let mut before = count(&rig, "lost");
        for transfer in 1..=12 {
            rig.transfers(1, PERIOD, &[0.1; 3]);
            if restores {
                let mut other = harness(&config);
                other.wire.restore(&rig.wire.save()).unwrap();
                rig.wire = other.wire;
            }
            if count(&rig, "lost") > before {
                lost.push(transfer);
            }
            before = count(&rig, "lost");
        }
        lost
    };
    [run(false), run(true)]
}

#[test]
fn answers_are_lost_by_their_number_and_by_the_message_before_them() {
    let lost = |after: Option<&str>, count| {
        let after = after.map(str::to_owned);
        let [lost, restored] = lost_transfers(DriverPhase::Transfer, FrameChoice { after, count });
        assert_eq!(lost, restored);
        lost
    };
    // A servo answers one read of each transfer.
    assert_eq!(lost(None, FrameCount::Nth(5)), [5]);
    assert_eq!(lost(Some("read"), FrameCount::Every(4)), [4, 8, 12]);
    assert_eq!(lost(Some("ping"), FrameCount::All), [0; 0]);
}

#[test]
fn transfers_are_complete_after_a_fault_of_the_opening() {
    let frames = FrameChoice {
        after: Some("write".to_owned()),
        count: FrameCount::Nth(1),
    };
    let lost = lost_transfers(DriverPhase::Opening, frames);
    assert_eq!(lost, [[0], [0]]);
}

/// A servo whose supply fails is silent until it has booted, and then without torque until the bus
/// is opened again; the others go on.
#[test]
fn a_brown_out_costs_the_answers_until_the_boot_and_the_torque_beyond() {
    let second = |n: u64| SimTime::ZERO + SimDuration::from_secs(n);
    for (on, boot, struck) in [
        ("wire/dxl/joint0", Some(200), [true, false]),
        ("wire/dxl/joint0", None, [true, false]),
        ("wire/dxl", Some(200), [true, true]),
    ] {
        let mut config = config(2, ReadPattern::Read);
        let boot = boot.map(SimDuration::from_millis);
        config.faults = faults(on, 1_010, FaultKind::BrownOut { boot }, 40);
        let mut rig = harness(&config);
        rig.open().unwrap();
        rig.run_until(second(1));
        rig.transfers(1, PERIOD, &[0.2; 2]);
        let bridges = |rig: &Harness| [0, 1].map(|n| rig.joints.inputs[2 * n + 1] != 0.0);
        rig.run_until(second(1) + SimDuration::from_millis(15));
        assert_eq!(bridges(&rig), struck.map(|struck| !struck), "{on}");
        rig.transfers(100, PERIOD, &[0.2; 2]);
        // Transfers begin 15 ms after a multiple of 20 ms; the first is at 1.015 s.
        let silent = 40 + boot.map_or(500, |boot| boot.as_nanos() / 1_000_000);
        let lost = silent.div_ceil(20) * struck.iter().filter(|struck| **struck).count() as u64;
        assert_eq!(count(&rig, "lost"), lost as f64, "{on} {boot:?}");
        assert_eq!(bridges(&rig), struck.map(|struck| !struck), "{on}");
        rig.open().unwrap();
        rig.transfers(50, PERIOD, &[-0.1; 2]);
        assert!(
            rig.driver
                .to_process()
                .iter()
                .all(|it| (it + 0.1).abs() < 1.6e-3)
        );
    }
}

/// The state of a bus that is saved during an outage, or after it and a new opening, goes on as the
/// bus does.
#[test]
fn an_outage_is_restored() {
    let mut config = config(2, ReadPattern::Read);
    let kind = FaultKind::BrownOut { boot: None };
    config.faults = faults("wire/dxl/joint1", 1_010, kind, 40);
    for (saved_ms, reopened) in [(1_200, false), (1_700, true)] {
        let [mut rig, mut restored] = [(), ()].map(|()| harness(&config));
        rig.open().unwrap();
        rig.run_until(SimTime::ZERO + SimDuration::from_millis(saved_ms));
        if reopened {
            rig.open().unwrap();
        }
        restored.driver.restore(&rig.driver.save()).unwrap();
        restored.wire.restore(&rig.wire.save()).unwrap();
        restored.joints.restore(&rig.joints.save()).unwrap();
        restored.now = rig.now;
        for rig in [&mut rig, &mut restored] {
            rig.transfers(40, PERIOD, &[0.2, -0.2]);
        }
        assert_eq!(rig.joints.inputs, restored.joints.inputs, "{saved_ms}");
        assert_eq!(rig.driver.to_process(), restored.driver.to_process());
        let [lost, again] = [&rig, &restored].map(|rig| count(rig, "lost"));
        assert_eq!((lost, lost > 10.0), (again, !reopened), "{saved_ms}");
    }
}

#[test]
fn two_faults_of_one_clock_are_refused() {
    let mut config = config(2, ReadPattern::Read);
    config.faults = faults("wire/dxl", 0, FaultKind::Drift { rate_ppb: 1_000 }, 10);
    assert!(config.wire().is_ok());
    let mut second = config.faults.faults[0].clone();
    second.on += "/joint1";
    config.faults.faults.push(second);
    let error = config.wire().err().unwrap().to_string();
    assert_eq!(
        error,
        "two faults `drift` act on the clock of wire/dxl/joint1; give one"
    );
}
