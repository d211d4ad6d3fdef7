//! Driver and board connected by a wire, in a rig.

use crate::FramedDevice;
use crate::rb110::{AnalogInput, PulseMap, Rb110};
use crate::tests::{self, check_missing};
use twinrig_kernel::{Port, SimDuration, SimTime, Unit};
use twinrig_runtime::{Rig, RunEvent};
use twinrig_testing::rig_harness;
use twinrig_testing::rig_harness::{
    RecordingPlant, check_restored, check_zero, diagnostic, index_of, run,
};
use twinrig_wire::{AnalogSource, FaultKind, FaultSchedule};

const LEGS: [(usize, &str); 4] = [(15, "LF"), (13, "RF"), (9, "LH"), (11, "RH")];

pub(super) fn board() -> Rb110 {
    let mut board = Rb110::with_servos("rb110", PulseMap::ONCILLA, &LEGS);
    board.analog = vec![AnalogInput {
        channel: 3,
        analog_source: Some(AnalogSource {
            signal: "battery".into(),
            component: 0,
            scale: 0.1,
            offset: 0.0,
        }),
    }];
    board
}

fn plant() -> RecordingPlant {
    let command = |&(_, leg): &(usize, &str)| {
        Port::input(format!("leg/{leg}/abduction/command"), Unit::Radian, 1)
    };
    let mut ports: Vec<Port> = LEGS.iter().map(command).collect();
    ports.push(Port::output("battery", Unit::Volt, 1));
    RecordingPlant::new(ports, |_, _| 12.0)
}

fn command(step: u64) -> f64 {
    // One in ten is out of range: 0.157 rad are 5000 ticks.
    if step % 10 == 8 {
        0.5
    } else {
        0.01 * (step % 7) as f64
    }
}

fn wired(faults: &FaultSchedule) -> Rig {
    tests::wired(&board(), faults, (10, command), plant())
}

fn fault(kind: FaultKind, from_ms: u64, for_ms: u64) -> FaultSchedule {
    rig_harness::fault("wire/rb110", kind, from_ms, for_ms)
}

#[test]
fn transfer_takes_two_control_periods() {
    let mut rig = wired(&FaultSchedule::default());
    let (log, result) = run(&mut rig, 1000);
    result.unwrap();
    let starts: Vec<SimTime> = log
        .events
        .iter()
        .filter(|(_, event)| matches!(event, RunEvent::TaskBegin { .. }))
        .map(|(at, _)| *at)
        .collect();
    assert!(
        starts
            .windows(2)
            .all(|pair| pair[1] - pair[0] == SimDuration::from_millis(20)),
        "{starts:?}"
    );
    assert_eq!(
        log.count(|event| matches!(event, RunEvent::TaskSkipped { .. })),
        50
    );
    assert_eq!(diagnostic(&rig, &log, "rb110/transfers"), 49.0);
    check_zero(
        &rig,
        &log,
        "rb110",
        &["lost", "replaced", "garbage", "unheard"],
    );
}

#[test]
fn plant_receives_a_command_at_the_end_of_its_pulse() {
    let plant = plant();
    let inputs = plant.input_log.clone();
    let faults = FaultSchedule::default();
    let mut rig = tests::wired(&board(), &faults, (10, command), plant);
    let (log, result) = run(&mut rig, 400);
    result.unwrap();
    // Steps 8, 18, 28 and 38 are out of range, for four servos; the first pulse begins at 20 ms.
    assert_eq!(diagnostic(&rig, &log, "rb110/saturated"), 16.0);
    assert_eq!(diagnostic(&rig, &log, "rb110/pulses"), 4.0 * 19.0);
    let (map, inputs) = (PulseMap::ONCILLA, inputs.lock().unwrap());
    assert!(inputs.len() > 15);
    for (n, (at, angles)) in inputs.iter().enumerate().skip(1) {
        // The plant's time begins at 10 ms, after opening; 0 rad of the first step is no change.
        // Every second step takes effect, by the pulse that begins 10 ms after it.
        let step = u64::try_from(2 * n).unwrap();
        let (ticks, _) = map.ticks(command(step)).unwrap();
        let width = SimDuration::from_nanos(20 * u64::from(ticks));
        let start = SimTime::ZERO + SimDuration::from_millis(10 * (step + 1));
        assert_eq!(
            (*at, angles[0]),
            (start + width, map.angle(ticks).unwrap()),
            "{n}"
        );
        assert!(angles.iter().all(|angle| *angle == angles[0]));
    }
}

#[test]
fn angle_is_exact_to_half_a_tick() {
    let map = PulseMap::ONCILLA;
    for angle in [-0.1, -0.003, 0.0, 0.0402, 0.15] {
        let (ticks, saturated) = map.ticks(angle).unwrap();
        let decoded = map.angle(ticks).unwrap();
        assert!(
            !saturated && (decoded - angle).abs() <= 0.5001 / map.ticks_per_radian,
            "{angle}"
        );
    }
    assert_eq!(map.ticks(1.0), Some((65_000, true)));
    assert_eq!(map.ticks(f64::NAN), None);
    assert_eq!(map.angle(map.off), None);
    assert_eq!(PulseMap::KONDO.angle(PulseMap::KONDO.off), None);
}

#[test]
fn analog_inputs_are_read_to_the_resolution_of_the_converter() {
    let mut rig = wired(&FaultSchedule::default());
    let (log, result) = run(&mut rig, 100);
    result.unwrap();
    let ports = board()
        .driver()
        .map(|driver| twinrig_runtime::Driver::ports(&driver))
        .unwrap();
    let adc = index_of(&ports, "rb110/adc");
    let (_, last) = log.inputs.last().unwrap();
    assert!((1.2 - last[adc]).abs() < 2.5 / 1024.0, "{last:?}");
}

#[test]
fn damaged_frames_are_counted_and_tolerated() {
    for kind in [
        FaultKind::Flip { rate: 0.02 },
        FaultKind::Drop { probability: 0.5 },
    ] {
        let mut rig = wired(&fault(kind, 100, 400));
        let (log, result) = run(&mut rig, 1000);
        result.unwrap();
        let lost = diagnostic(&rig, &log, "rb110/lost");
        assert!((1.0..=20.0).contains(&lost), "{kind:?}: {lost}");
        assert_eq!(
            diagnostic(&rig, &log, "rb110/transfers"),
            49.0,
            "a transfer always takes one period"
        );
    }
}

#[test]
fn missing_board_is_an_error() {
    let unplugged = fault(FaultKind::Unplug { fails: false }, 0, 10_000);
    check_missing(wired(&unplugged), "rb110");
}

#[test]
fn restored_rig_continues_bit_for_bit() {
    let faults = fault(FaultKind::Flip { rate: 0.005 }, 0, 10_000);
    check_restored(|| wired(&faults), &[7, 31, 90, 141], 600);
}

#[test]
fn invalid_configurations_are_rejected() {
    let error = |change: fn(&mut Rb110)| {
        let mut board = board();
        change(&mut board);
        board.driver().unwrap_err().to_string()
    };
    assert!(error(|board| board.period = SimDuration::from_millis(5)).contains("every"));
    assert!(error(|board| board.servos[0].line = 13).contains("line 13"));
    assert!(error(|board| board.analog[0].channel = 8).contains("analog input 8"));
    assert!(error(|board| board.servos[1].pulse.ticks_per_radian = 0.0).contains("RF"));
    assert!(error(|board| board.reference = f64::NAN).contains("reference"));
}

#[test]
fn unplugged_board_is_silent_and_a_plugged_one_is_clean() {
    let mut rig = wired(&FaultSchedule::default());
    run(&mut rig, 1000).1.unwrap();
    let health = rig.bus_health();
    let (name, health) = &health[0];
    assert_eq!(*name, "rb110");
    assert!(health.is_clean() && health.answers >= 48, "{health:?}");
    let mut rig = wired(&fault(FaultKind::Unplug { fails: false }, 500, 10_000));
    run(&mut rig, 1000).1.unwrap();
    let health = rig.bus_health().remove(0).1;
    let silence = health.silence.as_ref().unwrap();
    assert!(silence.is_dead(), "{silence:?}");
    assert_eq!(silence.device, "servo board of rb110");
    assert!(
        silence.length > SimDuration::from_millis(450),
        "{silence:?}"
    );
    assert_eq!(
        (health.errors[0].kind, &*health.errors[0].device),
        ("no answer", "servo board of rb110")
    );
    assert!(health.errors[0].count >= 23, "{health:?}");
}
