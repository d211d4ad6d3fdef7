//! A bus of three servos under a schedule of faults made of arbitrary bytes: no panic, opening and
//! each transfer end, the same twice, and no angle where the joint has not been.

#![no_main]

use libfuzzer_sys::fuzz_target;
use twinrig_dynamixel::x::XL330_M288;
use twinrig_dynamixel::{JointSignals, ReadPattern, ServoBusConfig, ServoConfig};
use twinrig_kernel::{BoardClock, SimDuration, SimTime};
use twinrig_runtime::Driver;
use twinrig_testing::wired_harness::WiredHarness;
use twinrig_wire::{
    DriverPhase, Fault, FaultDirection, FaultKind, FaultSchedule, FaultSelection, FrameChoice,
    FrameCount, UsbPreset, UsbTiming,
};

const SERVOS: u8 = 3;
const TRANSFERS: u32 = 20;
/// Bytes of a fault.
const FAULT: usize = 8;
/// Greatest number of faults: more take time, and act on the same bytes.
const FAULTS_MAX: usize = 6;

fn fault(&[kind, place, at, lasts, amount, frames, number, selection]: &[u8; FAULT]) -> Fault {
    let probability = f64::from(amount) / 255.0;
    let time = SimDuration::from_micros(20 * u64::from(amount));
    let kind = match kind % 10 {
        0 => FaultKind::Drop { probability },
        1 => FaultKind::Flip {
            rate: 1e-2 * probability,
        },
        2 => FaultKind::Delay { by: time },
        3 => FaultKind::Duplicate { probability },
        4 => FaultKind::Reorder { probability },
        5 => FaultKind::Unplug { fails: false },
        6 => FaultKind::Stuck,
        7 => FaultKind::Babble { pause: time },
        8 => FaultKind::BrownOut { boot: Some(time) },
        _ => FaultKind::Drift {
            rate_ppb: (i64::from(amount) - 128) * 1_000,
        },
    };
    let number = u64::from(number).max(1);
    let count = [
        FrameCount::All,
        FrameCount::Nth(number),
        FrameCount::Every(number),
    ];
    let after = [None, Some("ping"), Some("sync read"), Some("write")];
    let directions = [None, Some(FaultDirection::Out), Some(FaultDirection::In)];
    let phases = [
        None,
        Some(DriverPhase::Opening),
        Some(DriverPhase::Transfer),
    ];
    let chosen = FrameChoice {
        after: after[usize::from(frames / 3 % 4)].map(str::to_owned),
        count: count[usize::from(frames % 3)],
    };
    let is_chosen = kind.selects() && selection >= 0x80;
    Fault {
        at: SimTime::ZERO + SimDuration::from_millis(4) * u64::from(at),
        on: match place % (SERVOS + 1) {
            0 => "wire/dxl".to_owned(),
            n => format!("wire/dxl/joint{n}"),
        },
        lasts: SimDuration::from_millis(2) * u64::from(lasts),
        select: FaultSelection {
            direction: directions[usize::from(selection % 3)].filter(|_| !kind.acts_on_boards()),
            phase: phases[usize::from(selection / 3 % 3)].filter(|_| kind.selects()),
            frames: is_chosen.then_some(chosen),
        },
        kind,
    }
}

fn config(faults: Vec<Fault>) -> ServoBusConfig {
    let servo = |n: u8| ServoConfig {
        name: format!("joint{n}"),
        kind: &XL330_M288,
        id: n,
        registers: Vec::new(),
        settings: Vec::new(),
        signals: JointSignals::of_joint(&format!("joint{n}")),
        command: format!("joint{n}/command"),
        voltage: 5.0,
        temperature: 25.0,
        clock: BoardClock::IDEAL,
    };
    ServoBusConfig {
        name: "dxl".to_owned(),
        servos: (1..=SERVOS).map(servo).collect(),
        byte_time: SimDuration::from_micros(10),
        pattern: ReadPattern::SyncRead,
        period: SimDuration::from_millis(20),
        timeout: SimDuration::from_millis(5),
        usb: UsbTiming::preset(UsbPreset::Earliest),
        turnaround: SimDuration::ZERO,
        faults: FaultSchedule { faults, seed: 1 },
        seed: 1,
    }
}

/// Values and diagnostics after each transfer. A bit of a packet that its checksum does not detect
/// is an angle, too, so that angles are judged `by_range` where no bits flip.
fn run(config: &ServoBusConfig, by_range: bool) -> Vec<f64> {
    let joints: Vec<String> = config
        .servos
        .iter()
        .map(|servo| servo.name.clone())
        .collect();
    let (Ok(driver), Ok(wire)) = (config.driver(), config.wire()) else {
        return Vec::new();
    };
    let mut rig = WiredHarness::new(driver, wire, &joints);
    let mut history = Vec::new();
    let mut opened = rig.open().is_ok();
    let mut visited = [(0.0_f64, 0.0_f64); SERVOS as usize];
    for n in 0..TRANSFERS {
        if !opened {
            opened = rig.open().is_ok();
            continue;
        }
        let command = if n % 8 < 4 { 0.3 } else { -0.3 };
        opened = rig.try_transfer(&[command; SERVOS as usize]).is_ok();
        rig.run_until(rig.now + SimDuration::from_millis(15));
        let angles = rig.driver.to_process();
        assert!(angles.iter().all(|angle| angle.is_finite()), "{angles:?}");
        for (n, (least, most)) in visited.iter_mut().enumerate() {
            let at = rig.joints.outputs[2 * n];
            (*least, *most) = (least.min(at), most.max(at));
            // Joints turn by less than 5 rad/s between two transfers; a count is 1.5 mrad.
            let range = *least - 0.3..=*most + 0.3;
            assert!(!by_range || range.contains(&angles[n]), "{n}: {angles:?}");
        }
        history.extend_from_slice(angles);
        history.extend_from_slice(&rig.joints.inputs);
    }
    let mut counts = vec![0.0; rig.driver.diagnostics().len()];
    rig.driver.read_diagnostics(&mut counts);
    history.extend(counts);
    history
}

fuzz_target!(|data: &[u8]| {
    let (faults, _) = data.as_chunks::<FAULT>();
    let faults: Vec<Fault> = faults.iter().take(FAULTS_MAX).map(fault).collect();
    let flips = faults
        .iter()
        .any(|fault| matches!(fault.kind, FaultKind::Flip { .. }));
    let config = config(faults);
    let found = run(&config, !flips);
    assert_eq!(run(&config, !flips), found);
});
