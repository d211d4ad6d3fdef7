//! Libraries of others, unmodified, on the PTY of `twin serve`, behind which the servos of a
//! hanging leg run in real time: scans, registers, goals by one instruction, reads of all kinds,
//! refused writes. No assertion depends on the speed of the machine.

use std::path::Path;

use serde_json::{Value, json};
use twinrig_dynamixel::ax::AX12A;
use twinrig_dynamixel::x::XL330_M288;
use twinrig_dynamixel::{Registers, ServoKind, Span};
use twinrig_feetech::{SCS0009, STS3215};
use twinrig_testing::python;

use super::Running;
use crate::common::Folder;

/// A leg with servos 1, 2 and 3 at hip, knee and joint of abduction.
const LEG: &str = r#"
name = "leg"
robot = "half-cub-xl330"
duration = "1000000 s"
seed = 1
override.serial.supply.voltage = "VOLTAGE"

[plant]
model = "massless"
base = "fixed"
legs = ["LF"]
abduction = "free"

[actuator]
kind = "serial"
firmware = "bus"

[[bus]]
kind = "KIND"
name = "servos"
model = "MODEL"

[controller]
kind = "stand"
period = "20 ms"
hip_height = "95 mm"
abduction = "hold"
"#;

/// Serves the leg with servos of a model, and returns what a client prints.
fn client(name: &str, module: &str, kind: &str, model: &str) -> Option<Value> {
    let python = python::python(module)?;
    let folder = Folder::new(&format!("{name}-{model}"));
    // Servos of the AX series refuse to move below 6 V.
    let voltage = if model == "ax-12a" { "11.1 V" } else { "5 V" };
    let scenario = LEG.replace("KIND", kind).replace("MODEL", model);
    let scenario = scenario.replace("VOLTAGE", voltage);
    let scenario = folder.file("leg.toml", &scenario);
    let link = folder.join("servos");
    let served = Running::serve_bus(&folder, &scenario, "servos", &link, &["--keep"]);
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cli/hardware/servos.py");
    let words = [Path::new(name), Path::new(&link)];
    let found = python::run(&python, &script, &words, &json!(null));
    served.signal("-INT");
    Some(found)
}

/// The first registers at power-on, bit for bit, with the value of 1 Mbit/s.
fn table(kind: &'static ServoKind, baud: i32, length: u16) -> Value {
    let mut registers = Registers::new(kind.model);
    registers.set(kind.model.roles.id, 1);
    registers.set(kind.model.roles.baud_rate, baud);
    let mut bytes = Vec::new();
    let span = Span { address: 0, length };
    registers.read(span, &mut bytes).unwrap();
    json!(bytes)
}

fn models(number: u16) -> Value {
    json!({"1": number, "2": number, "3": number})
}

/// Joints move to the goals of hip and knee, 100 and −50 counts from the middle, but for friction
/// and weight.
fn assert_reached(positions: &Value, goals: [i64; 3], within: i64) {
    let positions = positions.as_array().unwrap();
    assert_eq!(positions.len(), 3);
    for (found, goal) in positions.iter().zip(goals) {
        let distance = found.as_i64().unwrap() - goal;
        assert!(distance.abs() <= within, "{positions:?}");
    }
}

const GOALS: [i64; 3] = [2_148, 1_998, 2_048];
const WITHIN: i64 = 60;
const ABSENT: &str = "[TxRxResult] There is no status packet!";

#[test]
fn dynamixel_sdk_finds_commands_and_reads_xl330() {
    let module = "dynamixel_sdk";
    let Some(found) = client("dynamixel_sdk", module, "dynamixel", "xl330-m288") else {
        return;
    };
    assert_eq!(found["found"], models(1_200));
    assert_eq!(found["all"], models(1_200));
    assert_eq!(found["absent"], ABSENT);
    assert_eq!(found["table"], table(&XL330_M288, 3, 64));
    // Data range, and access.
    assert_eq!(found["refused"], json!([4, 7]));
    for positions in ["positions", "fast", "bulk"] {
        assert_reached(&found[positions], GOALS, WITHIN);
    }
    assert_eq!(found["registered"], json!([0, 1]));
    assert_eq!(found["executed"], 1);
}

#[test]
fn dynamixel_sdk_finds_commands_and_reads_ax12a() {
    let module = "dynamixel_sdk";
    let Some(found) = client("dynamixel_sdk_ax", module, "dynamixel", "ax-12a") else {
        return;
    };
    assert_eq!(found["found"], models(12));
    assert_eq!(found["absent"], ABSENT);
    assert_eq!(found["table"], table(&AX12A, 1, 36));
    // Range, and angle limit.
    assert_eq!(found["refused"], json!([8, 2]));
    assert_reached(&found["single"], [612, 462, 512], WITHIN / 3);
}

#[test]
fn rustypot_finds_commands_and_reads_xl330() {
    let Some(found) = client("rustypot_xl330", "rustypot", "dynamixel", "xl330-m288") else {
        return;
    };
    assert_eq!(found["found"], models(1_200));
    assert_eq!(found["all"], models(1_200));
    for positions in ["positions", "single", "fast"] {
        assert_reached(&found[positions], GOALS, WITHIN);
    }
}

#[test]
fn scservo_sdk_finds_commands_and_reads_sts3215() {
    let Some(found) = client("scservo_sdk", "scservo_sdk", "feetech", "sts3215") else {
        return;
    };
    assert_eq!(found["found"], models(777));
    assert_eq!(found["absent"], ABSENT);
    assert_eq!(found["table"], table(&STS3215, 0, 40));
    for positions in ["positions", "single"] {
        assert_reached(&found[positions], GOALS, WITHIN);
    }
}

/// Numbers of the SCS series have the high byte first, by the option of the library.
#[test]
fn scservo_sdk_finds_commands_and_reads_scs0009() {
    let Some(found) = client("scservo_sdk_scs", "scservo_sdk", "feetech", "scs0009") else {
        return;
    };
    assert_eq!(found["found"], models(1_284));
    assert_eq!(found["table"], table(&SCS0009, 0, 40));
    assert_reached(&found["single"], [611, 461, 511], WITHIN / 3);
}

#[test]
fn rustypot_finds_commands_and_reads_sts3215() {
    let Some(found) = client("rustypot_sts3215", "rustypot", "feetech", "sts3215") else {
        return;
    };
    assert_eq!(found["found"], models(777));
    for positions in ["positions", "single"] {
        assert_reached(&found[positions], GOALS, WITHIN);
    }
}
