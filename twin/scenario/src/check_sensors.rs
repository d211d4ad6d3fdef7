//! Checks of the signals that `[[sensor]]` names.

use twinrig_document::{Problem, quantity_name, suggestion};
use twinrig_kernel::{Direction, Port, SignalKind, Unit};

use crate::facts::Facts;
use crate::glob::matches;
use crate::scenario::{Scenario, SensorSpec};
use crate::scene::SensedSignal;

impl Scenario {
    /// Returns the inputs of the controller that have a sensor, in the order of the sensors.
    pub(crate) fn sensed_signals(
        &self,
        facts: &Facts,
        problems: &mut Vec<Problem>,
    ) -> Vec<SensedSignal> {
        let mut sensed: Vec<SensedSignal> = Vec::new();
        for (sensor, spec) in self.sensors.iter().enumerate() {
            let inputs = inputs(facts).filter(|port| matches(&spec.of.value, &port.name));
            let before = sensed.len();
            let mut problem = None;
            for port in inputs {
                let rotation = is_rotation(port, facts);
                let unit = if rotation { Unit::Radian } else { port.unit };
                let twice = sensed.iter().find(|one| one.signal == port.name);
                // The other signals of a pattern would have the same one.
                problem = problem
                    .or_else(|| {
                        twice.map(|one| second_sensor(spec, port, &self.sensors[one.sensor]))
                    })
                    .or_else(|| wrong_unit(spec, port, unit))
                    .or_else(|| rotation.then(|| of_rotation(spec, port)).flatten());
                sensed.push(SensedSignal {
                    sensor,
                    signal: port.name.clone(),
                    unit,
                });
            }
            problems.extend(problem);
            if sensed.len() == before {
                problems.push(unread(spec, facts));
            }
        }
        sensed
    }
}

fn inputs(facts: &Facts) -> impl Iterator<Item = &Port> {
    let ports = facts.process_ports.iter();
    ports.filter(|port| port.direction == Direction::Input)
}

/// Returns whether the controller or the plant declares an input to be a rotation.
fn is_rotation(input: &Port, facts: &Facts) -> bool {
    const QUATERNION: usize = 4;
    let outputs = facts.plant_outputs.iter();
    let mut ports = outputs
        .filter(|port| port.name == input.name)
        .chain([input]);
    input.size == QUATERNION && ports.any(|port| port.kind == SignalKind::Rotation)
}

fn unread(spec: &SensorSpec, facts: &Facts) -> Problem {
    let of = &spec.of.value;
    let known: Vec<&str> = inputs(facts).map(|port| port.name.as_str()).collect();
    let (message, help) = if known.is_empty() {
        let help = "a sensor is at a signal that the controller reads: remove it, or choose a controller with feedback";
        (
            format!("the controller reads no signal, so `{of}` has no effect"),
            help.to_owned(),
        )
    } else {
        let message = format!("the controller reads no signal `{of}`");
        (message, suggestion(of, "signals that it reads", known))
    };
    Problem::at(&spec.of.place, message, help)
}

fn second_sensor(spec: &SensorSpec, port: &Port, first: &SensorSpec) -> Problem {
    let (signal, of) = (&port.name, &first.of.value);
    let message = format!("`{signal}` has the sensor of `{of}` already");
    Problem::at(
        &spec.of.place,
        message,
        "a signal has one sensor: combine their keys",
    )
}

fn wrong_unit(spec: &SensorSpec, port: &Port, unit: Unit) -> Option<Problem> {
    let given = spec.unit.as_ref().filter(|given| given.value != unit)?;
    let name = &port.name;
    let signal = if port.unit == unit {
        format!("`{name}` is in {unit}")
    } else {
        format!("`{name}` is a rotation, with errors in {unit}")
    };
    let values = quantity_name(given.value);
    let message = format!("{signal}; the values of its sensor are {values}");
    let help = format!("give {}", quantity_name(unit));
    Some(Problem::at(&given.place, message, help))
}

fn of_rotation(spec: &SensorSpec, port: &Port) -> Option<Problem> {
    let key = if spec.model.range.is_some() {
        "range"
    } else if spec.model.resolution > 0.0 {
        "resolution"
    } else {
        return None;
    };
    let message = format!("`{}` is a rotation, which has no `{key}`", port.name);
    let help = "noise, bias and random walk turn it about each axis";
    Some(Problem::at(&spec.of.place, message, help))
}
