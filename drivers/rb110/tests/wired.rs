//! Driver and board with a wire between them, in a rig.

#[path = "../../toys.rs"]
mod toys;

use toys::{PlantAccess, diagnostic, place, rig, run};
use twinrig_kernel::{Port, SimDuration, SimTime, Unit};
use twinrig_rb110::{AnalogInput, PulseMap, Rb110};
use twinrig_runtime::{Rig, RunEvent};
use twinrig_wire::{AnalogSource, Fault, FaultKind, FaultSchedule};

const LEGS: [(usize, &str); 4] = [(15, "LF"), (13, "RF"), (9, "LH"), (11, "RH")];

fn board() -> Rb110 {
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

fn plant() -> PlantAccess {
    let command = |&(_, leg): &(usize, &str)| {
        Port::input(format!("leg/{leg}/abduction/command"), Unit::Radian, 1)
    };
    let mut ports: Vec<Port> = LEGS.iter().map(command).collect();
    ports.push(Port::output("battery", Unit::Volt, 1));
    PlantAccess::new(ports, |_, _| 12.0)
}

fn command(step: u64) -> f64 {
    // One in ten is out of reach: 0.157 rad are 5000 ticks.
    if step % 10 == 8 {
        0.5
    } else {
        0.01 * (step % 7) as f64
    }
}

fn wired(faults: &FaultSchedule) -> Rig {
    let wire = board().wire(faults).unwrap();
    rig(board().driver().unwrap(), wire, (10, command), plant())
}

fn fault(kind: FaultKind, from_ms: u64, for_ms: u64) -> FaultSchedule {
    FaultSchedule {
        faults: vec![Fault {
            at: SimTime::ZERO + SimDuration::from_millis(from_ms),
            on: "wire/rb110".into(),
            kind,
            lasts: SimDuration::from_millis(for_ms),
        }],
        seed: 1,
    }
}

#[test]
fn a_transfer_takes_two_control_periods() {
    let mut rig = wired(&FaultSchedule::default());
    let (log, ended) = run(&mut rig, 1000);
    ended.unwrap();
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
    for nothing in ["lost", "replaced", "garbage", "unheard"] {
        assert_eq!(
            diagnostic(&rig, &log, &format!("rb110/{nothing}")),
            0.0,
            "{nothing}"
        );
    }
}

#[test]
fn the_plant_hears_of_a_pulse_when_it_ends() {
    let plant = plant();
    let heard = plant.heard.clone();
    let wire = board().wire(&FaultSchedule::default()).unwrap();
    let mut rig = rig(board().driver().unwrap(), wire, (10, command), plant);
    let (log, ended) = run(&mut rig, 400);
    ended.unwrap();
    // Steps 8, 18, 28 and 38 are out of reach, for four servos; the first pulse begins at 20 ms.
    assert_eq!(diagnostic(&rig, &log, "rb110/saturated"), 16.0);
    assert_eq!(diagnostic(&rig, &log, "rb110/pulses"), 4.0 * 19.0);
    let (map, heard) = (PulseMap::ONCILLA, heard.lock().unwrap());
    assert!(heard.len() > 15);
    for (n, (at, angles)) in heard.iter().enumerate().skip(1) {
        // Opening has moved the first step, whose 0 rad are no news, to 10 ms, where the plant's time begins; every second
        // step is heard, by the pulse that begins 10 ms later.
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
fn angles_come_back_within_half_a_tick() {
    let map = PulseMap::ONCILLA;
    for angle in [-0.1, -0.003, 0.0, 0.0402, 0.15] {
        let (ticks, saturated) = map.ticks(angle).unwrap();
        let heard = map.angle(ticks).unwrap();
        assert!(
            !saturated && (heard - angle).abs() <= 0.5001 / map.ticks_per_radian,
            "{angle}"
        );
    }
    assert_eq!(map.ticks(1.0), Some((65_000, true)));
    assert_eq!(map.ticks(f64::NAN), None);
    assert_eq!(map.angle(map.off), None);
    assert_eq!(PulseMap::KONDO.angle(PulseMap::KONDO.off), None);
}

#[test]
fn analog_inputs_are_read_in_steps_of_the_converter() {
    let mut rig = wired(&FaultSchedule::default());
    let (log, ended) = run(&mut rig, 100);
    ended.unwrap();
    let ports = board()
        .driver()
        .map(|driver| twinrig_runtime::Driver::ports(&driver))
        .unwrap();
    let adc = place(&ports, "rb110/adc");
    let (_, last) = log.inputs.last().unwrap();
    assert!((1.2 - last[adc]).abs() < 2.5 / 1024.0, "{last:?}");
}

#[test]
fn damage_is_counted_and_survived() {
    for kind in [
        FaultKind::Flip { rate: 0.02 },
        FaultKind::Drop { probability: 0.5 },
    ] {
        let mut rig = wired(&fault(kind.clone(), 100, 400));
        let (log, ended) = run(&mut rig, 1000);
        ended.unwrap();
        let lost = diagnostic(&rig, &log, "rb110/lost");
        assert!((1.0..=20.0).contains(&lost), "{kind:?}: {lost}");
        assert_eq!(
            diagnostic(&rig, &log, "rb110/transfers"),
            49.0,
            "a transfer takes a period, come what may"
        );
    }
}

#[test]
fn a_board_that_is_not_there_is_an_error_in_the_end() {
    let mut rig = wired(&fault(FaultKind::Unplug { fails: false }, 0, 10_000));
    let (_, ended) = run(&mut rig, 1000);
    let why = ended.unwrap_err().to_string();
    assert!(
        why.contains("rb110") && why.contains("is it there"),
        "{why}"
    );
}

#[test]
fn a_restored_rig_goes_on_bit_for_bit() {
    let faults = fault(FaultKind::Flip { rate: 0.005 }, 0, 10_000);
    for saved_at in [7, 31, 90, 141] {
        let mut rig = wired(&faults);
        run(&mut rig, saved_at).1.unwrap();
        let saved = rig.save();
        let rest = run(&mut rig, 600);
        let mut again = wired(&faults);
        again.restore(&saved).unwrap();
        assert_eq!(run(&mut again, 600), rest, "{saved_at} ms");
    }
}

#[test]
fn boards_that_cannot_be_are_refused() {
    let refused = |change: fn(&mut Rb110)| {
        let mut board = board();
        change(&mut board);
        board.driver().unwrap_err().to_string()
    };
    assert!(refused(|board| board.period = SimDuration::from_millis(5)).contains("every"));
    assert!(refused(|board| board.servos[0].line = 13).contains("line 13"));
    assert!(refused(|board| board.analog[0].channel = 8).contains("analog input 8"));
    assert!(refused(|board| board.servos[1].pulse.ticks_per_radian = 0.0).contains("RF"));
    assert!(refused(|board| board.reference = f64::NAN).contains("reference"));
}
