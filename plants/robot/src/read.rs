//! Reading and validation of a robot file.

use twinrig_document::declaration::{
    Accepts, Key, Shape, TableSpec, Type, contextual, quantity, record, table,
};
use twinrig_document::{Item, Reported, Table};
use twinrig_kernel::Unit;

use crate::parameters::{Actuators, Contact, Leg, LegMount, Motors, Robot, Trunk, three};
use crate::ranges;
use crate::serial::SerialServo;

table! {
    /// Keys of a robot file.
    pub(crate) robot_table = TableSpec::new("robot file", "a quadruped");
    NAME: String = "name", Type::TEXT, "name of the robot", "", required();
    TRUNK: Trunk = "trunk", Trunk::TYPE, "body that carries the legs", "", required();
    LEG: () = "leg", contextual(Shape::ByName(&Shape::Table(Leg::TABLE))),
        "kinds of legs, and their parameters", "", required();
    MOUNT: () = "mount", contextual(Shape::Tables(mount_table::TABLE)),
        "the legs and the positions of their hips", "", required();
    ACTUATOR: Actuators = "actuator", Actuators::TYPE, "servos of the legs", "", required();
    MOTOR: Motors = "motor", Motors::TYPE, "motors of hip and knee, if known", "";
    SERIAL: SerialServo = "serial", SerialServo::TYPE,
        "serial servos of hip and knee, if known", "";
    GROUND: Ground = "ground", Ground::TYPE, "ground, unless a scenario has another", "",
        required();
    CONTACT: Contact = "contact", Contact::TYPE,
        "contact of trunk, knees and ankles with the ground, if known", "";
}

table! {
    /// Keys of `[[mount]]`.
    mount_table = TableSpec::new("[[mount]]", "a leg and the position of its hip");
    NAME: String = "name", Type::new(Shape::One(Accepts::Text), |item, _| name(item)),
        "name of the leg, of letters, digits, `_` and `-`", "", required();
    LEG: () = "leg", contextual(Shape::One(Accepts::Name)), "kind of leg: its table below `leg`",
        "", required();
    HIP: [f64; 3] = "hip",
        Type::new(Shape::list(&Shape::One(Accepts::Quantity {
            unit: Unit::Meter, range: ranges::PLACE,
        }), 3), three),
        "hip joint in the trunk frame: origin at the centre of mass, x forward, y left, z up", "",
        required();
}

record! {
    /// Ground under a robot.
    struct Ground = "[ground]" {
        /// Coulomb coefficient between foot and ground \[1\].
        friction: f64 = quantity(Unit::One, ranges::FRICTION),
    }
}

/// Reads the robot of a file.
pub(crate) fn robot(table: &Table<'_>) -> Result<Robot, Reported> {
    use robot_table::{ACTUATOR, CONTACT, GROUND, LEG, MOTOR, MOUNT, NAME, SERIAL, TABLE, TRUNK};
    let keys = TABLE.of(table);
    let (name, trunk) = (keys.read(&NAME), keys.read(&TRUNK));
    let mut names = Vec::new();
    let kinds = keys.read_with(&LEG, |item| {
        names.extend(item.keys().into_iter().flatten().map(str::to_owned));
        item.by_name(|item| Leg::read_from(&item.table()?))
    });
    let mounts = keys.read_with(&MOUNT, |item| mounts(item, &names));
    let (actuators, motors) = (keys.read(&ACTUATOR), keys.get(&MOTOR));
    let serial = keys.get(&SERIAL);
    let (ground, contact) = (keys.read(&GROUND), keys.get(&CONTACT));
    let (kinds, mounts) = (kinds?, mounts?);
    for (kind, _) in &kinds {
        if !mounts.iter().any(|mount| mount.kind == kind.value) {
            let message = format!("leg `{}` is not mounted", kind.value);
            let help = format!(
                "give a [[mount]] leg = \"{}\", or remove the table",
                kind.value
            );
            keys.report(&LEG, message, help);
        }
    }
    let legs = mounts.into_iter().filter_map(|mount| {
        let (_, leg) = kinds.iter().find(|(kind, _)| kind.value == mount.kind)?;
        Some(LegMount {
            name: mount.name,
            hip: mount.hip,
            kind: mount.kind,
            leg: leg.clone(),
        })
    });
    Ok(Robot {
        name: name?,
        trunk: trunk?,
        legs: legs.collect(),
        actuators: actuators?,
        motors: motors?,
        serial: serial?,
        friction: ground?.friction,
        contact: contact?,
    })
}

/// Axes of the trunk.
const AXES: &str = "x is forward, y to the left, z up";

struct Mount {
    name: String,
    kind: String,
    hip: [f64; 3],
}

fn mounts(item: &Item<'_>, kinds: &[String]) -> Result<Vec<Mount>, Reported> {
    let mounts = item.each(|item| mount(&item.table()?, kinds))?;
    if mounts.is_empty() {
        return Err(item.report("the robot has no legs", "add a [[mount]]"));
    }
    for (index, mount) in mounts.iter().enumerate() {
        if mounts[..index].iter().any(|other| other.name == mount.name) {
            let message = format!("two mounts are named `{}`", mount.name);
            let second = &item.list()?[index];
            return Err(second.report(message, "the names of legs must be unique"));
        }
        if let Some(other) = mounts[..index].iter().find(|other| other.hip == mount.hip) {
            let message = format!("`{}` and `{}` have the same hip", other.name, mount.name);
            let second = &item.list()?[index];
            return Err(second.report(message, "give each leg a place of its own"));
        }
        let side = match mount.name.as_str() {
            "LF" | "LH" if mount.hip[1] < 0.0 => "right",
            "RF" | "RH" if mount.hip[1] > 0.0 => "left",
            _ => continue,
        };
        let message = format!("the hip of `{}` is on the {side}", mount.name);
        let second = &item.list()?[index];
        return Err(second.report(message, AXES));
    }
    for side in ["L", "R"] {
        let hip = |end: &str| {
            mounts
                .iter()
                .position(|mount| mount.name == format!("{side}{end}"))
        };
        if let (Some(fore), Some(hind)) = (hip("F"), hip("H"))
            && mounts[fore].hip[0] < mounts[hind].hip[0]
        {
            let message = format!("the hip of `{side}F` is behind that of `{side}H`");
            return Err(item.list()?[fore].report(message, AXES));
        }
    }
    Ok(mounts)
}

fn mount(table: &Table<'_>, kinds: &[String]) -> Result<Mount, Reported> {
    use mount_table::{HIP, LEG, NAME, TABLE};
    let keys = TABLE.of(table);
    let name = keys.read(&NAME);
    let kind = keys.read_with(&LEG, |item| {
        let kind = item.text()?;
        if !kinds.iter().any(|known| known == kind) {
            let known = kinds.iter().map(String::as_str);
            let message = format!("there is no leg `{kind}` in this file");
            return Err(item.report_word(message, kind, "legs", known));
        }
        Ok(kind.to_owned())
    });
    let hip = keys.read(&HIP);
    Ok(Mount {
        name: name?,
        kind: kind?,
        hip: hip?,
    })
}

fn name(item: &Item<'_>) -> Result<String, Reported> {
    let name = item.text()?;
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if name.is_empty() || !name.chars().all(plain) {
        let message = format!("`{name}` is not a valid name of a leg");
        return Err(item.report(message, "use letters, digits, `_` and `-`"));
    }
    Ok(name.to_owned())
}
