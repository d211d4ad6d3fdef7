//! Reading `[actuator]`.

use std::f64::consts::PI;

use serde_json::json;
use twinrig_document::{Item, Range, Reported};
use twinrig_kernel::{SimDuration, Unit};

use super::{code, print_duration};
use crate::actuator::{ActuatorKind, ActuatorSpec, FirmwarePlace, ServoOverride, SetPointKind};
use crate::language::{Declared, Key, Shape, TableSpec, choice, contextual, quantity, table};

table! {
    /// Keys of `[actuator]`.
    pub(super) actuator_table = TableSpec::new("[actuator]", "drives of the robot")
        .with(servo_table::TABLE.keys)
        .refined(only_servos_have_parameters);
    KIND: ActuatorKind = "kind", choice(), "kind of drives", r#"kind = "ideal""#,
        default("'servo'");
    FIRMWARE: FirmwarePlace = "firmware", choice(),
        "firmware of serial servos: in the plant, or in the servos of a bus `dynamixel` or `feetech`",
        r#"kind = "serial", firmware = "bus""#, default("'plant'");
    SET_POINT: SetPointKind = "set_point", choice(),
        "set-points between commands: the last command, or a linear approach to it over one control period",
        r#"set_point = "held""#,
        otherwise("linear; held with rigid constraints that the scenario asks for, and without a controller");
    HIP: () = "hip", contextual(Shape::Table(servo_table::TABLE)), "servos of the hips",
        r#"hip = { speed = "20 rad/s" }"#;
    KNEE: () = "knee", contextual(Shape::Table(servo_table::TABLE)), "servos of the knees",
        r#"knee = { torque = "3 N·m" }"#;
}

table! {
    /// Keys of `hip` and `knee`.
    pub(super) servo_table = TableSpec::new("servo", "parameters of the servos of one joint");
    LAG: f64 = "lag", quantity(Unit::Second, Range::positive_to(60.0)), "time constant of a servo",
        r#"lag = "5 ms""#, otherwise("the robot file's");
    SPEED: f64 = "speed", quantity(Unit::RadianPerSecond, Range::positive_to(1e5)),
        "speed limit of a servo", r#"speed = "20 rad/s""#, otherwise("the robot file's");
    TORQUE: f64 = "torque", quantity(Unit::NewtonMeter, Range::positive_to(1e5)), "torque limit of a servo",
        r#"torque = "5 N·m""#, otherwise("the robot file's");
    DEAD_BAND: f64 = "dead_band", quantity(Unit::Radian, Range::between(0.0, PI)),
        "dead band of a servo", r#"dead_band = "0 deg""#, otherwise("the robot file's");
}

fn only_servos_have_parameters(schema: &mut serde_json::Value) {
    use actuator_table::{FIRMWARE, HIP, KIND, KNEE, SET_POINT};
    let others = ["ideal", "none", "motor", "serial"];
    schema["if"] = json!({
        "properties": { KIND.name: { "enum": others } },
        "required": [KIND.name],
    });
    schema["allOf"] = json!([{
        "if": { "required": [FIRMWARE.name] },
        "then": {
            "properties": { KIND.name: { "const": "serial" } },
            "required": [KIND.name],
        },
    }]);
    let empty = json!({ "maxProperties": 0 });
    schema["then"] = json!({
        "propertyNames": { "enum": [KIND.name, FIRMWARE.name, SET_POINT.name, HIP.name, KNEE.name] },
        "properties": { HIP.name: empty, KNEE.name: empty },
        "if": { "properties": { KIND.name: { "enum": ["none", "motor", "serial"] } } },
        "then": { "properties": { SET_POINT.name: false } },
    });
}

/// Reads `[actuator]`.
pub(super) fn actuator(item: &Item<'_>, run: SimDuration) -> Result<ActuatorSpec, Reported> {
    use actuator_table::{FIRMWARE, HIP, KIND, KNEE, SET_POINT};
    let table = &item.table()?;
    let table = actuator_table::TABLE.of(table);
    let kind = table.read(&KIND);
    let firmware = table.read(&FIRMWARE);
    let set_point = table.get(&SET_POINT);
    let both = servo(table, run);
    let servo_in = |item: &Item<'_>| servo(servo_table::TABLE.of(&item.table()?), run);
    let (hip, knee) = (
        table.get_with(&HIP, servo_in),
        table.get_with(&KNEE, servo_in),
    );
    let (kind, firmware, both, set_point) = (kind?, firmware?, both?, set_point?);
    let (hip, knee) = (hip?.unwrap_or_default(), knee?.unwrap_or_default());
    let has_overrides = [both, hip, knee]
        .iter()
        .any(|servo| *servo != ServoOverride::default());
    let subject = match kind {
        ActuatorKind::Servo => None,
        ActuatorKind::Ideal => Some("an ideal actuator has"),
        ActuatorKind::None => Some("a leg without actuators has"),
        ActuatorKind::Motor => Some("a motor has"),
        ActuatorKind::Serial => Some("a serial servo has"),
    };
    if let Some(subject) = subject
        && has_overrides
    {
        let message = format!("{subject} no lag, speed, torque or dead band");
        return Err(table.report(
            &KIND,
            message,
            "write kind = \"servo\", or leave the figures out",
        ));
    }
    if let Some(item) = table.item(&SET_POINT)
        && !kind.has_set_points()
    {
        let why = match kind {
            ActuatorKind::Motor => "a motor has no set-point: its board interpolates commands",
            ActuatorKind::Serial => "a serial servo has no set-point here: its firmware makes it",
            _ => "a leg without actuators has no set-point",
        };
        let help = "leave `set_point` out, or write kind = \"servo\" or kind = \"ideal\"";
        return Err(item.report(why, help));
    }
    if let Some(item) = table.item(&FIRMWARE)
        && kind != ActuatorKind::Serial
    {
        let help = "leave `firmware` out, or write kind = \"serial\"";
        return Err(item.report("only serial servos have a firmware", help));
    }
    Ok(ActuatorSpec {
        kind,
        firmware,
        set_point,
        hip: hip.over(both),
        knee: knee.over(both),
    })
}

impl ServoOverride {
    fn over(self, other: Self) -> Self {
        ServoOverride {
            lag: self.lag.or(other.lag),
            speed: self.speed.or(other.speed),
            torque: self.torque.or(other.torque),
            dead_band: self.dead_band.or(other.dead_band),
        }
    }
}

fn servo(table: Declared<'_, '_>, run: SimDuration) -> Result<ServoOverride, Reported> {
    use servo_table::{DEAD_BAND, LAG, SPEED, TORQUE};
    let lag = table.get(&LAG);
    if let (Ok(Some(lag)), Some(item)) = (&lag, table.item(&LAG))
        && *lag > run.as_secs_f64()
    {
        let run = print_duration(run);
        let help = format!("the run lasts {run}: the servo hardly moves in it");
        item.warn(code::LAG, "the lag is longer than the run", help);
    }
    let (speed, torque) = (table.get(&SPEED), table.get(&TORQUE));
    let dead_band = table.get(&DEAD_BAND);
    Ok(ServoOverride {
        lag: lag?,
        speed: speed?,
        torque: torque?,
        dead_band: dead_band?,
    })
}
