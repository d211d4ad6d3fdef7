//! Disturbances that a study knows, and the axes that they have in a scenario.

use twinrig_campaign::radius::{AxisGrid, AxisValues, DisturbanceAxis, KeyChange, KeyRule};
use twinrig_kernel::{SignalKind, Unit};
use twinrig_runtime::Timing;
use twinrig_scenario::{Accepts, Base};

use super::context::{DisturbanceContext, Found};

/// Control periods to which times are disturbed.
const PERIODS: f64 = 5.0;
/// Rate errors to which clocks are disturbed.
const CLOCK: f64 = 0.01;
/// Multiple of its value up to which a parameter is disturbed.
const TIMES: f64 = 3.0;
/// Change of speed by the greatest push \[m/s\].
const PUSH: f64 = 1.0;
/// Greatest noise of forces without a robot \[N\].
const FORCE: f64 = 10.0;
/// Greatest noise of angles \[rad\].
const ANGLE: f64 = 0.5;
/// Greatest noise of rates \[rad/s\].
const RATE: f64 = 10.0;

/// Values and keys of an axis, or the reason for which there is none.
type FoundAxis = Result<(AxisValues, Vec<KeyChange>), String>;

/// A disturbance.
pub(super) struct Disturbance {
    pub(super) name: &'static str,
    about: &'static str,
    /// Finds its axis in a scenario.
    axis: fn(&DisturbanceContext<'_>) -> FoundAxis,
}

/// All disturbances, in the order of reports.
pub(super) const DISTURBANCES: &[Disturbance] = &[
    Disturbance {
        name: "latency",
        about: "duration of an iteration of the controller",
        axis: latency,
    },
    Disturbance {
        name: "transfer",
        about: "duration of a transfer between controller and plant",
        axis: transfer,
    },
    Disturbance {
        name: "jitter",
        about: "greatest delay of what the host reads from its buses, uniform from 0",
        axis: |context| jitter(context, "jitter"),
    },
    Disturbance {
        name: "write-jitter",
        about: "greatest delay of what the host writes to its buses, uniform from 0",
        axis: |context| jitter(context, "write_jitter"),
    },
    Disturbance {
        name: "clocks-fast",
        about: "addition to the rate of the clocks of all boards",
        axis: |context| clocks(context, CLOCK),
    },
    Disturbance {
        name: "clocks-slow",
        about: "addition to the rate of the clocks of all boards",
        axis: |context| clocks(context, -CLOCK),
    },
    Disturbance {
        name: "friction-down",
        about: "coefficient of friction of the ground",
        axis: |context| friction(context, 0.0),
    },
    Disturbance {
        name: "friction-up",
        about: "coefficient of friction of the ground",
        axis: |context| friction(context, TIMES),
    },
    Disturbance {
        name: "stiffness-down",
        about: "factor of the stiffness of all leg springs",
        axis: |context| stiffness(context, 0.0),
    },
    Disturbance {
        name: "stiffness-up",
        about: "factor of the stiffness of all leg springs",
        axis: |context| stiffness(context, TIMES),
    },
    Disturbance {
        name: "payload",
        about: "mass at the centre of the trunk, up to that of the robot",
        axis: payload,
    },
    Disturbance {
        name: "push",
        about: "impulse on the trunk to the left, in 100 ms from the middle of the run",
        axis: push,
    },
    Disturbance {
        name: "pushes-up",
        about: "factor of all pushes of the scenario",
        axis: pushes,
    },
    Disturbance {
        name: "sensor-noise-force",
        about: "standard deviation of white noise of the forces that the controller reads",
        axis: |context| sensor_noise(context, Unit::Newton),
    },
    Disturbance {
        name: "sensor-noise-angle",
        about: "standard deviation of white noise of the angles that the controller reads",
        axis: |context| sensor_noise(context, Unit::Radian),
    },
    Disturbance {
        name: "sensor-noise-rate",
        about: "standard deviation of white noise of the rates that the controller reads",
        axis: |context| sensor_noise(context, Unit::RadianPerSecond),
    },
];

impl Disturbance {
    /// Returns the axis in a scenario, or the reason for which there is none.
    pub(super) fn axis(&self, context: &DisturbanceContext<'_>) -> Result<DisturbanceAxis, String> {
        let (values, keys) = (self.axis)(context)?;
        Ok(DisturbanceAxis {
            name: self.name.to_owned(),
            about: self.about.to_owned(),
            values,
            keys,
        })
    }
}

fn change(key: impl Into<String>, rule: KeyRule) -> KeyChange {
    KeyChange {
        key: key.into(),
        rule,
    }
}

/// Values from 0, of which the limit is a guess.
fn from_zero(limit: f64, unit: Unit) -> AxisValues {
    AxisValues {
        nominal: 0.0,
        limit,
        unit,
        grid: AxisGrid::Geometric,
    }
}

/// Values from a parameter of the scenario to a multiple of it.
fn scaled(nominal: f64, times: f64) -> AxisValues {
    AxisValues {
        nominal,
        limit: times * nominal,
        unit: Unit::One,
        grid: AxisGrid::Linear,
    }
}

fn latency(context: &DisturbanceContext<'_>) -> FoundAxis {
    let controller = context.scenario().controller.as_ref();
    let controller = controller.ok_or("there is no controller")?;
    let values = time(context, &controller.compute_time, "controller.compute_time")?;
    Ok((
        values,
        vec![change("controller.compute_time", KeyRule::Equal)],
    ))
}

fn transfer(context: &DisturbanceContext<'_>) -> FoundAxis {
    let scenario = context.scenario();
    if scenario.controller.is_none() {
        return Err("there is no controller".to_owned());
    }
    if !scenario.buses.is_empty() {
        return Err("signals pass over buses".to_owned());
    }
    let values = time(context, &scenario.io.transfer_time, "io.transfer_time")?;
    Ok((values, vec![change("io.transfer_time", KeyRule::Equal)]))
}

/// Returns values of a duration that grows.
fn time(
    context: &DisturbanceContext<'_>,
    timing: &Timing,
    key: &str,
) -> Result<AxisValues, String> {
    let Timing::Constant(nominal) = timing else {
        return Err(format!("{key} is a distribution"));
    };
    let nominal = nominal.as_secs_f64();
    let greatest = PERIODS * context.period().as_secs_f64();
    Ok(AxisValues {
        nominal,
        ..from_zero(nominal + greatest, Unit::Second)
    })
}

fn jitter(context: &DisturbanceContext<'_>, name: &str) -> FoundAxis {
    let mut keys = context.bus_keys(name, |accepts| matches!(accepts, Accepts::Time));
    if keys.is_empty() {
        return Err(format!("no bus has the key {name}"));
    }
    keys.retain(|key| context.value(key) == Found::Missing);
    if keys.is_empty() {
        return Err(format!("the scenario sets {name}"));
    }
    let rule = KeyRule::Within("{ min = \"0 s\", max = {} }".to_owned());
    let keys = keys.into_iter().map(|key| change(key, rule.clone()));
    let limit = PERIODS * context.period().as_secs_f64();
    Ok((from_zero(limit, Unit::Second), keys.collect()))
}

fn clocks(context: &DisturbanceContext<'_>, limit: f64) -> FoundAxis {
    let is_ratio = |accepts: &Accepts| match accepts {
        Accepts::Each(each) => matches!(
            **each,
            Accepts::Quantity {
                unit: Unit::One,
                ..
            }
        ),
        accepts => matches!(
            accepts,
            Accepts::Quantity {
                unit: Unit::One,
                ..
            }
        ),
    };
    let mut keys = Vec::new();
    for key in context.bus_keys("clock", is_ratio) {
        let members = context.members(&key);
        let mut each: Vec<String> = members.iter().map(|it| format!("{key}.{it}")).collect();
        if each.is_empty() {
            each.push(key);
        }
        for key in each {
            let base = match context.value(&key) {
                Found::Quantity(rate, Unit::One) => rate,
                _ => 0.0,
            };
            keys.push(change(key, KeyRule::Added(base)));
        }
    }
    if keys.is_empty() {
        return Err("no bus has a board with a clock".to_owned());
    }
    Ok((from_zero(limit, Unit::One), keys))
}

fn friction(context: &DisturbanceContext<'_>, times: f64) -> FoundAxis {
    let robot = context.legged()?;
    let ground = context.scenario().plant.ground.as_ref();
    let ground = ground.ok_or("there is no ground")?;
    let nominal = ground.friction.unwrap_or(robot.friction);
    if nominal == 0.0 {
        return Err("the ground has no friction".to_owned());
    }
    let keys = vec![change("plant.ground.friction", KeyRule::Equal)];
    Ok((scaled(nominal, times), keys))
}

fn stiffness(context: &DisturbanceContext<'_>, times: f64) -> FoundAxis {
    context.legged()?;
    let mut keys = Vec::new();
    for leg in context.robot_keys("leg") {
        for spring in ["diagonal", "parallel"] {
            let key = format!("leg.{leg}.{spring}.stiffness");
            if let Found::Quantity(base, unit) = context.robot_value(&key) {
                keys.push(change(
                    format!("override.{key}"),
                    KeyRule::Times(base, unit),
                ));
            }
        }
    }
    if keys.is_empty() {
        return Err("the robot file has no leg springs".to_owned());
    }
    Ok((scaled(1.0, times), keys))
}

fn payload(context: &DisturbanceContext<'_>) -> FoundAxis {
    let mass = context.legged()?.mass();
    let element = "{ mass = {}, at = [\"0 m\", \"0 m\", \"0 m\"] }";
    let keys = appended(context, "payload", vec![element.to_owned()]);
    Ok((from_zero(mass, Unit::Kilogram), keys))
}

fn push(context: &DisturbanceContext<'_>) -> FoundAxis {
    let mass = context.legged()?.mass();
    if !context.scenario().pushes.is_empty() {
        return Err("the scenario has pushes, which pushes-up scales".to_owned());
    }
    let at = context.scenario().duration / 2;
    // A planar robot has no sideways motion.
    let direction = match context.scenario().plant.base {
        Base::Planar => "x",
        Base::Free | Base::Fixed => "y",
    };
    let element = format!(
        "{{ on = \"body\", at = \"{} ns\", for = \"100 ms\", impulse = {{}}, \
         direction = \"{direction}\", shape = \"half-sine\" }}",
        at.as_nanos()
    );
    let keys = appended(context, "push", vec![element]);
    Ok((from_zero(mass * PUSH, Unit::NewtonSecond), keys))
}

fn pushes(context: &DisturbanceContext<'_>) -> FoundAxis {
    let mut keys = Vec::new();
    for index in 0..context.scenario().pushes.len() {
        for name in ["force", "torque", "impulse"] {
            let key = format!("push.{index}.{name}");
            if let Found::Quantity(base, unit) = context.value(&key) {
                keys.push(change(key, KeyRule::Times(base, unit)));
            }
        }
    }
    if keys.is_empty() {
        return Err("the scenario has no pushes".to_owned());
    }
    Ok((scaled(1.0, TIMES), keys))
}

fn sensor_noise(context: &DisturbanceContext<'_>, unit: Unit) -> FoundAxis {
    let inputs = context.inputs();
    // Errors of an attitude are angles.
    let has_unit = |kind: &SignalKind, of: Unit| match kind {
        SignalKind::Rotation => unit == Unit::Radian,
        _ => of == unit,
    };
    let inputs: Vec<_> = inputs
        .into_iter()
        .filter(|it| has_unit(&it.kind, it.unit))
        .collect();
    if inputs.is_empty() {
        return Err(format!("the controller reads nothing in {}", unit.symbol()));
    }
    if context.value("sensor") != Found::Missing {
        let why = "the scenario has sensors; disturb them by --along sensor.0.noise";
        return Err(why.to_owned());
    }
    let limit = match (unit, context.assembly.robot()) {
        (Unit::Newton, Some(robot)) => robot.weight(),
        (Unit::Newton, None) => FORCE,
        (Unit::Radian, _) => ANGLE,
        _ => RATE,
    };
    let elements = inputs.iter();
    let elements = elements.map(|it| format!("{{ of = \"{}\", noise = {{}} }}", it.name));
    let keys = appended(context, "sensor", elements.collect());
    Ok((from_zero(limit, unit), keys))
}

/// Returns changes that append elements with the value of the axis to a list of the scenario.
fn appended(context: &DisturbanceContext<'_>, list: &str, elements: Vec<String>) -> Vec<KeyChange> {
    let Found::List(count) = context.value(list) else {
        let whole = format!("[{}]", elements.join(", "));
        return vec![change(list, KeyRule::Within(whole))];
    };
    let elements = elements.into_iter().enumerate();
    let element =
        |(index, text)| change(format!("{list}.{}", count + index), KeyRule::Within(text));
    elements.map(element).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn documentation_lists_all_disturbances() {
        let page = include_str!("../../../../docs/robustness.md");
        for Disturbance { name, .. } in DISTURBANCES {
            let rows = page.lines().filter(|line| line.starts_with("| `"));
            let cells = rows.filter_map(|row| row.split(" | ").next());
            let count = cells.filter(|cell| cell.contains(&format!("`{name}`")));
            assert_eq!(count.count(), 1, "{name}");
        }
    }
}
