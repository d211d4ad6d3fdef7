//! Reading and validation of a robot file.

use std::f64::consts::PI;
use std::ops::Bound;

use twinrig_document::{Item, Range, Reported, Table};
use twinrig_kernel::Unit;

use crate::leg::third_side;
use crate::parameters::{
    Actuators, Compliance, JointFriction, Leg, LegMass, LegMount, Motor, Motors, OneSided, Robot,
    Servo, Spring, Toe, Trunk,
};
use crate::ranges;

/// Reads the robot of a file.
pub(crate) fn robot(table: &Table<'_>) -> Result<Robot, Reported> {
    let name = table.required("name", |item| item.text().map(str::to_owned));
    let trunk = table.required("trunk", |item| trunk(&item.table()?));
    let mut names = Vec::new();
    let kinds = table.required("leg", |item| {
        let kinds = item.table()?;
        names = kinds.keys().map(str::to_owned).collect();
        leg_kinds(&kinds)
    });
    let mounts = table.required("mount", |item| mounts(item, &names));
    let actuators = table.required("actuator", |item| actuators(&item.table()?));
    let motors = table.optional("motor", |item| motors(&item.table()?));
    let friction = table.required("ground", |item| {
        let ground = item.table()?;
        ground.required("friction", |item| item.number(&ranges::FRICTION))
    });
    let (kinds, mounts) = (kinds?, mounts?);
    for (kind, _) in &kinds {
        if !mounts.iter().any(|mount| mount.kind == *kind) {
            let message = format!("leg `{kind}` is not mounted");
            let help = format!("give a [[mount]] leg = \"{kind}\", or remove the table");
            table.report("leg", message, help);
        }
    }
    let legs = mounts.into_iter().filter_map(|mount| {
        let (_, leg) = kinds.iter().find(|(kind, _)| *kind == mount.kind)?;
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
        friction: friction?,
    })
}

fn trunk(table: &Table<'_>) -> Result<Trunk, Reported> {
    let mass = within(table, "mass", Unit::Kilogram, &ranges::MASS);
    let inertia = table.required("inertia", |item| {
        let inertia = three(item, Unit::KilogramSquareMeter, &ranges::INERTIA)?;
        let [x, y, z] = inertia;
        // A moment of inertia never exceeds the sum of the two others.
        if x > y + z || y > z + x || z > x + y {
            let message =
                "these moments of inertia are impossible: one exceeds the sum of the two others";
            return Err(item.report(
                message,
                "for a box: m/12 (w² + h²), m/12 (l² + h²), m/12 (l² + w²)",
            ));
        }
        Ok(inertia)
    });
    let size = table.required("size", |item| three(item, Unit::Meter, &ranges::LENGTH));
    Ok(Trunk {
        mass: mass?,
        inertia: inertia?,
        size: size?,
        payloads: Vec::new(),
    })
}

fn leg_kinds(table: &Table<'_>) -> Result<Vec<(String, Leg)>, Reported> {
    let kinds: Vec<_> = table
        .keys()
        .map(|kind| {
            let leg = table.required(kind, |item| leg(&item.table()?))?;
            Ok((kind.to_owned(), leg))
        })
        .collect();
    kinds.into_iter().collect()
}

fn leg(table: &Table<'_>) -> Result<Leg, Reported> {
    let l1 = within(table, "l1", Unit::Meter, &ranges::LENGTH);
    let l2 = within(table, "l2", Unit::Meter, &ranges::LENGTH);
    let l3 = within(table, "l3", Unit::Meter, &ranges::LENGTH);
    let l_delta = within(table, "l_delta", Unit::Meter, &ranges::LENGTH);
    let open_interval = Range {
        min: Bound::Excluded(0.0),
        max: Bound::Excluded(PI),
    };
    let q2_ref = table.required("q2_ref", |item| item.quantity(Unit::Radian, &open_interval));
    let diagonal = table.required("diagonal", |item| spring(&item.table()?));
    let parallel = table.required("parallel", |item| spring(&item.table()?));
    let parallel_travel = within(table, "parallel_travel", Unit::Meter, &ranges::DEFLECTION);
    let diagonal_min = within(table, "diagonal_min", Unit::Meter, &ranges::LENGTH);
    let joint_friction = table.required("joint_friction", |item| joint_friction(&item.table()?));
    let mass = table.required("mass", |item| leg_mass(&item.table()?));
    let pulley_radius = within(table, "pulley_radius", Unit::Meter, &ranges::LENGTH);
    let toe = table.optional("toe", |item| toe(&item.table()?));
    let compliance = table.optional("compliance", |item| compliance(&item.table()?));
    let leg = Leg {
        l1: l1?,
        l2: l2?,
        l3: l3?,
        l_delta: l_delta?,
        q2_ref: q2_ref?,
        diagonal: diagonal?,
        parallel: parallel?,
        parallel_travel: parallel_travel?,
        diagonal_min: diagonal_min?,
        joint_friction: joint_friction?,
        mass: mass?,
        pulley_radius: pulley_radius?,
        toe: toe?,
        compliance: compliance?,
    };
    check_geometry(table, &leg)?;
    Ok(leg)
}

/// Validates that the pantograph can be built and moved.
fn check_geometry(table: &Table<'_>, leg: &Leg) -> Result<(), Reported> {
    let mm = |length: f64| {
        let fixed = format!("{:.2}", length * 1e3);
        format!("{} mm", fixed.trim_end_matches('0').trim_end_matches('.'))
    };
    let mut result = Ok(());
    for (key, length) in [("l1", leg.l1), ("l2", leg.l2), ("l3", leg.l3)] {
        if leg.l_delta >= length {
            let message = format!(
                "`l_delta` is not shorter than `{key}`: the pantograph does not fit on the leg"
            );
            let help = format!("l_delta must be less than {}", mm(length));
            result = Err(table.report("l_delta", message, help));
        }
    }
    result?;
    let diagonal_max = third_side(leg.l2, leg.l_delta, leg.q2_ref);
    let diagonal_flat = leg.l2 - leg.l_delta;
    if leg.diagonal_min <= diagonal_flat || leg.diagonal_min >= diagonal_max {
        let message = format!(
            "`diagonal_min` is {}, outside the range of the diagonal",
            mm(leg.diagonal_min)
        );
        let help = format!(
            "it must be between {} (folded flat) and {} (extended)",
            mm(diagonal_flat),
            mm(diagonal_max)
        );
        result = Err(table.report("diagonal_min", message, help));
    }
    // Triangle inequality for rod, diagonal and offset.
    let travel_max = diagonal_max + leg.l_delta - leg.l2;
    if leg.parallel_travel >= travel_max {
        let message = "`parallel_travel` is more than the parallel rod can open";
        let help = format!("it must be less than {}", mm(travel_max));
        result = Err(table.report("parallel_travel", message, help));
    }
    if leg.parallel.preload >= leg.l2 {
        let message =
            "the preload of `parallel` is not shorter than `l2`: the spring would have no length";
        let help = format!("it must be less than {}", mm(leg.l2));
        result = Err(report_preload(table, "parallel", message, help));
    }
    if leg.diagonal_min < diagonal_max && -leg.diagonal.preload > diagonal_max - leg.diagonal_min {
        let message = "the preload of `diagonal` makes the unloaded leg bottom out";
        let help = format!(
            "it must not be less than {}, the travel from extended to bottomed out",
            mm(leg.diagonal_min - diagonal_max)
        );
        result = Err(report_preload(table, "diagonal", message, help));
    }
    if -leg.parallel.preload > leg.parallel_travel {
        let message = "the preload of `parallel` opens the unloaded pantograph beyond its stop";
        let help = format!(
            "it must not be less than {}, its travel to the stop",
            mm(-leg.parallel_travel)
        );
        result = Err(report_preload(table, "parallel", message, help));
    }
    result
}

/// Reports a problem at the preload of a spring.
fn report_preload(table: &Table<'_>, spring: &str, message: &str, help: String) -> Reported {
    let preload = table.get(spring).and_then(|spring| spring.peek("preload"));
    let place = preload.map_or_else(|| table.key_place(spring), |preload| preload.place());
    table.report_at(&place, message, help)
}

fn spring(table: &Table<'_>) -> Result<Spring, Reported> {
    let stiffness = within(table, "stiffness", Unit::NewtonPerMeter, &ranges::STIFFNESS);
    let preload = table.required("preload", |item| {
        item.quantity(Unit::Meter, &ranges::PRELOAD)
    });
    Ok(Spring {
        stiffness: stiffness?,
        preload: preload?,
    })
}

fn joint_friction(table: &Table<'_>) -> Result<JointFriction, Reported> {
    let read = |key| {
        within(
            table,
            key,
            Unit::NewtonMeterSecondPerRadian,
            &ranges::JOINT_FRICTION,
        )
    };
    let (hip, knee, ankle, toe) = (read("hip"), read("knee"), read("ankle"), read("toe"));
    Ok(JointFriction {
        hip: hip?,
        knee: knee?,
        ankle: ankle?,
        toe: toe?,
    })
}

fn leg_mass(table: &Table<'_>) -> Result<LegMass, Reported> {
    let read = |key| within(table, key, Unit::Kilogram, &ranges::MASS);
    let (l1, l2, l3, foot) = (read("l1"), read("l2"), read("l3"), read("foot"));
    let lumped_foot = read("lumped_foot");
    let mass = LegMass {
        l1: l1?,
        l2: l2?,
        l3: l3?,
        foot: foot?,
        lumped_foot: lumped_foot?,
    };
    if mass.lumped_foot > mass.total() {
        let message = "`lumped_foot` weighs more than the whole leg";
        let help = format!("the leg weighs {:.4} kg", mass.total());
        return Err(table.report("lumped_foot", message, help));
    }
    Ok(mass)
}

fn toe(table: &Table<'_>) -> Result<Toe, Reported> {
    let length = within(table, "length", Unit::Meter, &ranges::LENGTH);
    let stiffness = within(
        table,
        "stiffness",
        Unit::NewtonMeterPerRadian,
        &ranges::TORSIONAL_STIFFNESS,
    );
    let half_turn = Range::between(-PI, PI);
    let rest = table.required("rest", |item| item.quantity(Unit::Radian, &half_turn));
    Ok(Toe {
        length: length?,
        stiffness: stiffness?,
        rest: rest?,
    })
}

fn compliance(table: &Table<'_>) -> Result<Compliance, Reported> {
    let read = |key| table.required(key, |item| one_sided(&item.table()?));
    let (stops, cable, sole) = (read("stops"), read("cable"), read("sole"));
    let slip_deflection = within(table, "slip_deflection", Unit::Meter, &ranges::DEFLECTION);
    Ok(Compliance {
        stops: stops?,
        cable: cable?,
        sole: sole?,
        slip_deflection: slip_deflection?,
    })
}

fn one_sided(table: &Table<'_>) -> Result<OneSided, Reported> {
    let stiffness = within(table, "stiffness", Unit::NewtonPerMeter, &ranges::STIFFNESS);
    let damping = within(
        table,
        "damping",
        Unit::NewtonSecondPerMeter,
        &ranges::DAMPING,
    );
    let toe_region = within(table, "toe_region", Unit::Meter, &ranges::DEFLECTION);
    Ok(OneSided {
        stiffness: stiffness?,
        damping: damping?,
        toe_region: toe_region?,
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
    let name = table.required("name", |item| {
        let name = item.text()?;
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
        if name.is_empty() || !name.chars().all(plain) {
            let message = format!("`{name}` is not a valid name of a leg");
            return Err(item.report(message, "use letters, digits, `_` and `-`"));
        }
        Ok(name.to_owned())
    });
    let kind = table.required("leg", |item| {
        let kind = item.text()?;
        if !kinds.iter().any(|known| known == kind) {
            let known = kinds.iter().map(String::as_str);
            let message = format!("there is no leg `{kind}` in this file");
            return Err(item.report_word(message, kind, "legs", known));
        }
        Ok(kind.to_owned())
    });
    let hip = table.required("hip", |item| three(item, Unit::Meter, &ranges::PLACE));
    Ok(Mount {
        name: name?,
        kind: kind?,
        hip: hip?,
    })
}

fn actuators(table: &Table<'_>) -> Result<Actuators, Reported> {
    let hip = table.required("hip", |item| servo(&item.table()?));
    let knee = table.required("knee", |item| servo(&item.table()?));
    let abduction = table.optional("abduction", |item| servo(&item.table()?));
    Ok(Actuators {
        hip: hip?,
        knee: knee?,
        abduction: abduction?,
    })
}

fn motors(table: &Table<'_>) -> Result<Motors, Reported> {
    let hip = table.required("hip", |item| Motor::read(&item.table()?));
    let knee = table.required("knee", |item| Motor::read(&item.table()?));
    Ok(Motors {
        hip: hip?,
        knee: knee?,
    })
}

impl Motor {
    /// Reads the table of a motor.
    ///
    /// # Errors
    /// For a parameter that is missing or not positive, reported at its place.
    pub fn read(table: &Table<'_>) -> Result<Self, Reported> {
        let resistance = within(table, "resistance", Unit::Ohm, &ranges::RESISTANCE);
        let torque_constant = within(
            table,
            "torque_constant",
            Unit::NewtonMeterPerAmpere,
            &ranges::TORQUE_CONSTANT,
        );
        let gear = within(table, "gear", Unit::One, &ranges::GEAR);
        let inertia = within(
            table,
            "inertia",
            Unit::KilogramSquareMeter,
            &ranges::INERTIA,
        );
        let voltage = within(table, "voltage", Unit::Volt, &ranges::VOLTAGE);
        Ok(Self {
            resistance: resistance?,
            torque_constant: torque_constant?,
            gear: gear?,
            inertia: inertia?,
            voltage: voltage?,
        })
    }
}

fn servo(table: &Table<'_>) -> Result<Servo, Reported> {
    let torque = within(table, "torque", Unit::NewtonMeter, &ranges::TORQUE);
    let speed = within(table, "speed", Unit::RadianPerSecond, &ranges::SPEED);
    let lag = within(table, "lag", Unit::Second, &ranges::LAG);
    let dead_band = within(table, "dead_band", Unit::Radian, &ranges::DEAD_BAND);
    let inertia = within(
        table,
        "inertia",
        Unit::KilogramSquareMeter,
        &ranges::INERTIA,
    );
    Ok(Servo {
        lag: lag?,
        speed: speed?,
        torque: torque?,
        dead_band: dead_band?,
        inertia: inertia?,
    })
}

fn within(table: &Table<'_>, key: &str, unit: Unit, range: &Range) -> Result<f64, Reported> {
    table.required(key, |item| item.quantity(unit, range))
}

fn three(item: &Item<'_>, unit: Unit, range: &Range) -> Result<[f64; 3], Reported> {
    item.quantities(unit, range, "three entries are required")
}
