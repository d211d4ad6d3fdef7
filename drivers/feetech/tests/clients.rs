//! Libraries of others, unmodified, on a PTY behind which emulated servos run in real time: scans,
//! registers, goals by one instruction, reads of all kinds, refused writes. No assertion depends on
//! the speed of the machine.

#![cfg(target_os = "linux")]

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use serde_json::{Value, json};
use twinrig_dynamixel::ax::AX12A;
use twinrig_dynamixel::x::XL330_M288;
use twinrig_dynamixel::{
    JointSignals, ReadPattern, Registers, ServoBusConfig, ServoConfig, ServoKind, Span,
};
use twinrig_feetech::STS3215;
use twinrig_kernel::{BoardClock, SimDuration};
use twinrig_runtime::real_time::{EndReason, Hold, Serve, ServeOptions, ServedWire};
use twinrig_testing::python;
use twinrig_testing::wired_harness::Joints;
use twinrig_wire::{FaultSchedule, Pty, UsbPreset, UsbTiming};

fn config(kind: &'static ServoKind) -> ServoBusConfig {
    let servo = |id: u8| {
        let name = format!("joint{id}");
        ServoConfig {
            kind,
            id,
            registers: Vec::new(),
            settings: Vec::new(),
            signals: JointSignals::of_joint(&name),
            command: format!("{name}/command"),
            voltage: 7.0,
            temperature: 25.0,
            clock: BoardClock::IDEAL,
            name,
        }
    };
    ServoBusConfig {
        name: "bus".to_owned(),
        servos: (1..=3).map(servo).collect(),
        byte_time: SimDuration::from_micros(10),
        pattern: ReadPattern::SyncRead,
        period: SimDuration::from_millis(20),
        timeout: SimDuration::from_millis(5),
        usb: UsbTiming::preset(UsbPreset::Earliest),
        turnaround: SimDuration::ZERO,
        faults: FaultSchedule::default(),
        seed: 1,
    }
}

/// Serves servos of a model to a client, and returns what it prints.
fn serve(kind: &'static ServoKind, client: &str, module: &str) -> Option<Value> {
    let python = python::python(module)?;
    let config = config(kind);
    let joints: Vec<String> = config
        .servos
        .iter()
        .map(|servo| servo.name.clone())
        .collect();
    let pty = Pty::open().unwrap();
    let path = pty.path().to_path_buf();
    let wire = ServedWire {
        name: "bus".to_owned(),
        wire: Box::new(config.wire().unwrap()),
        device: Box::new(pty),
    };
    let options = ServeOptions {
        hold: Hold::Never,
        ..ServeOptions::default()
    };
    let (joints, _) = Joints::new(&joints);
    let serve = Serve::new(options, Box::new(joints), vec![wire]).unwrap();
    let stop = Arc::new(AtomicBool::new(false));
    let flag = stop.clone();
    let thread = thread::Builder::new().spawn(move || serve.run(&mut (), &flag));
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/clients.py");
    let words = [Path::new(client), &path];
    let found = python::run(&python, &script, &words, &json!(null));
    stop.store(true, Ordering::SeqCst);
    let (ended, _) = thread.unwrap().join().unwrap();
    assert_eq!(ended, Ok(EndReason::Stopped));
    Some(found)
}

/// The first registers at power-on, bit for bit.
fn table(kind: &'static ServoKind, length: u16) -> Vec<u8> {
    let mut registers = Registers::new(kind.model);
    registers.set(kind.model.roles.id, 1);
    let mut bytes = Vec::new();
    let span = Span { address: 0, length };
    registers.read(span, &mut bytes).unwrap();
    bytes
}

fn models(number: u16) -> Value {
    json!({"1": number, "2": number, "3": number})
}

/// 100 counts, 0.15 rad, and so on, from the middle.
const GOALS: [u16; 3] = [2_148, 1_998, 2_048];

#[test]
fn dynamixel_sdk_finds_commands_and_reads_xl330() {
    let Some(found) = serve(&XL330_M288, "dynamixel_sdk", "dynamixel_sdk") else {
        return;
    };
    assert_eq!(found["found"], models(1_200));
    assert_eq!(found["all"], models(1_200));
    assert_eq!(found["absent"], "[TxRxResult] There is no status packet!");
    assert_eq!(found["table"], json!(table(&XL330_M288, 64)));
    // Data range, and access.
    assert_eq!(found["refused"], json!([4, 7]));
    for positions in ["positions", "fast", "bulk"] {
        assert_eq!(found[positions], json!(GOALS), "{positions}");
    }
    assert_eq!(found["registered"], json!([0, 1]));
    assert_eq!(found["executed"], 1);
}

#[test]
fn dynamixel_sdk_finds_commands_and_reads_ax12a() {
    let Some(found) = serve(&AX12A, "dynamixel_sdk_ax", "dynamixel_sdk") else {
        return;
    };
    assert_eq!(found["found"], models(12));
    assert_eq!(found["absent"], "[TxRxResult] There is no status packet!");
    assert_eq!(found["table"], json!(table(&AX12A, 36)));
    // Range, and angle limit.
    assert_eq!(found["refused"], json!([8, 2]));
    assert_reached(&found["single"], [612, 462, 512]);
}

#[test]
fn rustypot_finds_commands_and_reads_xl330() {
    let Some(found) = serve(&XL330_M288, "rustypot_xl330", "rustypot") else {
        return;
    };
    assert_eq!(found["found"], models(1_200));
    assert_eq!(found["all"], models(1_200));
    for positions in ["positions", "single", "fast"] {
        assert_eq!(found[positions], json!(GOALS), "{positions}");
    }
}

/// Positions within the dead zone of one count.
fn assert_reached(positions: &Value, goals: [u16; 3]) {
    for (found, goal) in positions.as_array().unwrap().iter().zip(goals) {
        let distance = found.as_i64().unwrap() - i64::from(goal);
        assert!(distance.abs() <= 1, "{positions}");
    }
}

#[test]
fn scservo_sdk_finds_commands_and_reads_sts3215() {
    let Some(found) = serve(&STS3215, "scservo_sdk", "scservo_sdk") else {
        return;
    };
    assert_eq!(found["found"], models(777));
    assert_eq!(found["absent"], "[TxRxResult] There is no status packet!");
    assert_eq!(found["table"], json!(table(&STS3215, 40)));
    for positions in ["positions", "single"] {
        assert_reached(&found[positions], GOALS);
    }
}

#[test]
fn rustypot_finds_commands_and_reads_sts3215() {
    let Some(found) = serve(&STS3215, "rustypot_sts3215", "rustypot") else {
        return;
    };
    assert_eq!(found["found"], models(777));
    for positions in ["positions", "single"] {
        assert_reached(&found[positions], GOALS);
    }
}
