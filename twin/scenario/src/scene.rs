//! A scene: a scenario reduced to the required signals, with a list of the omitted parts.

use std::collections::BTreeSet;

use twinrig_document::{DocumentError, Placed, Problem, suggestion};
use twinrig_kernel::signal::{BODY_POSITION, BODY_RPY};
use twinrig_kernel::{Direction, Port, Unit, signal};

use crate::actuator::ActuatorKind;
use crate::check_signals::{
    check_comparison, check_gait, check_sequence, check_signal, signals, unknown_signal,
};
use crate::expect::{Claim, Expectation, FootstepMeasure, LegChoice, TimingClaim};
use crate::facts::{Facts, LegFact};
use crate::glob::matches;
use crate::ground_below::GroundBelow;
use crate::left_out::LeftOut;
use crate::pattern::Pattern;
use crate::scenario::{Base, Contacts, PushSite, Scenario};

/// A scenario reduced to its required parts.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// The scenario.
    pub scenario: Scenario,
    /// Simulated legs, in the robot's order.
    pub legs: Vec<LegFact>,
    /// The robot's weight \[N\].
    pub weight: f64,
    /// Required plant outputs, in the plant's order: only these are computed.
    pub wanted: Vec<String>,
    /// Inputs of the controller that have a sensor.
    pub sensed: Vec<SensedSignal>,
    /// Recorded signals of plant and controller.
    pub recorded: Vec<String>,
    /// Omitted parts.
    pub left_out: Vec<LeftOut>,
    /// Ground for the detection of falls.
    pub ground: GroundBelow,
}

/// An input of the controller that has a sensor.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SensedSignal {
    /// Index of the sensor in [`Scenario::sensors`].
    pub sensor: usize,
    /// Name of the input.
    pub signal: String,
    /// Unit of the sensor's errors: that of the signal, or radians for a rotation.
    pub unit: Unit,
}

impl Scenario {
    /// Returns the legs of `robot` that the scenario simulates, in the robot's order.
    ///
    /// # Errors
    /// It names a leg that the robot does not have, or one twice, or none.
    pub fn legs(&self, robot: &[LegFact]) -> Result<Vec<LegFact>, DocumentError> {
        let Some(named) = &self.plant.legs else {
            return Ok(robot.to_vec());
        };
        let mut problems = Vec::new();
        for (index, leg) in named.iter().enumerate() {
            if !robot.iter().any(|known| known.name == leg.value) {
                problems.push(unknown_leg(leg, "the robot", robot));
            } else if named[..index].iter().any(|other| other.value == leg.value) {
                let message = format!("leg `{}` is named twice", leg.value);
                problems.push(Problem::at(&leg.place, message, ""));
            }
        }
        if problems.is_empty() {
            let kept = |leg: &&LegFact| named.iter().any(|name| name.value == leg.name);
            return Ok(robot.iter().filter(kept).cloned().collect());
        }
        Err(DocumentError { problems })
    }

    /// Returns the scene.
    ///
    /// # Errors
    /// The scenario names a leg or a signal that the scene does not have, or gives a limit in
    /// another unit than the signal's.
    pub fn scene(&self, facts: &Facts) -> Result<Scene, DocumentError> {
        let mut problems = Vec::new();
        let required_signals = self.required_signals(facts, &mut problems);
        let sensed = self.sensed_signals(facts, &mut problems);
        let recorded = self.recorded(facts, &mut problems);
        for push in &self.pushes {
            if let PushSite::Foot(leg) = &push.on
                && !facts.legs.iter().any(|known| known.name == leg.value)
            {
                problems.push(unknown_leg(leg, "the scene", &facts.legs));
            }
        }
        if !problems.is_empty() {
            return Err(DocumentError { problems });
        }
        let read = |port: &Port| {
            let mut inputs = facts.process_ports.iter();
            inputs.any(|input| input.direction == Direction::Input && input.name == port.name)
        };
        let frames = |name: &str| {
            let mut patterns = facts.frame_signals.iter();
            self.record.frames.is_some() && patterns.any(|pattern| matches(pattern, name))
        };
        let required = facts.plant_outputs.iter().filter(|port| {
            read(port)
                || facts.measured.contains(&port.name)
                || required_signals.contains(&port.name)
                || recorded.contains(&port.name)
                || frames(&port.name)
        });
        let required: Vec<String> = required.map(|port| port.name.clone()).collect();
        let left_out = self.left_out(facts, &required, &recorded);
        Ok(Scene {
            scenario: self.clone(),
            legs: facts.legs.clone(),
            weight: facts.weight,
            wanted: required,
            sensed,
            recorded,
            left_out,
            ground: facts.ground.clone(),
        })
    }

    /// Returns the names of the signals that the expectations require.
    fn required_signals(&self, facts: &Facts, problems: &mut Vec<Problem>) -> BTreeSet<String> {
        let mut required_signals = BTreeSet::new();
        let falls = |expectation: &Expectation| expectation.claim.requires_upright_robot();
        if self.fall.end || self.expectations.iter().any(falls) {
            required_signals.extend([BODY_POSITION, BODY_RPY].map(str::to_owned));
        }
        for expectation in &self.expectations {
            match &expectation.claim {
                Claim::Footstep(claim) => {
                    check_legs(&claim.legs, &claim.measure, facts, problems);
                    for leg in &facts.legs {
                        required_signals.extend([foot_load(&leg.name), foot_position(&leg.name)]);
                    }
                }
                Claim::Gait(claim) => {
                    required_signals.extend(check_gait(
                        claim,
                        expectation.optional,
                        facts,
                        problems,
                    ));
                }
                Claim::Body(_) => {
                    required_signals.extend([BODY_POSITION, BODY_RPY].map(str::to_owned));
                }
                Claim::Signal(claim) => {
                    let optional = expectation.optional;
                    required_signals.extend(check_signal(claim, optional, facts, problems));
                }
                Claim::Compare(claim) => {
                    let optional = expectation.optional;
                    required_signals.extend(check_comparison(claim, optional, facts, problems));
                }
                Claim::Sequence(claim) => {
                    let optional = expectation.optional;
                    required_signals.extend(check_sequence(claim, optional, facts, problems));
                }
                Claim::Timing(claim) => problems.extend(self.unknown_bus(claim)),
                Claim::EnergyResidual(_) | Claim::Cost(..) => {}
            }
        }
        required_signals
    }

    /// Returns the problem of a timing claim that names an unknown bus.
    fn unknown_bus(&self, claim: &TimingClaim) -> Option<Problem> {
        let of = claim.of.as_ref()?;
        if self.bus(&of.value).is_some() {
            return None;
        }
        let buses = self.buses.iter().map(|bus| bus.name.value.as_str());
        let known = std::iter::once("control").chain(buses);
        let message = format!("there is no cycle of `{}` in this scene", of.value);
        let help = suggestion(&of.value, "cycles", known);
        Some(Problem::at(&of.place, message, help))
    }

    /// Returns the names of the recorded signals.
    fn recorded(&self, facts: &Facts, problems: &mut Vec<Problem>) -> Vec<String> {
        let mut names: Vec<&str> = Vec::new();
        for port in signals(facts) {
            if !names.contains(&port.name.as_str()) {
                names.push(&port.name);
            }
        }
        if let Some(patterns) = &self.record.signals {
            for pattern in patterns {
                if !names.iter().any(|name| matches(&pattern.value, name)) {
                    problems.push(unknown_signal(pattern, facts));
                }
            }
            names.retain(|name| patterns.iter().any(|pattern| matches(&pattern.value, name)));
        }
        names.into_iter().map(str::to_owned).collect()
    }

    fn left_out(&self, facts: &Facts, required: &[String], recorded: &[String]) -> Vec<LeftOut> {
        let mut left_out = Vec::new();
        let mut omit = |part: &str, why: &str| {
            left_out.push(LeftOut {
                part: part.to_owned(),
                why: why.to_owned(),
            });
        };
        for LeftOut { part, why } in &self.beyond_end {
            omit(part, why);
        }
        for (part, why) in self.omitted_robot_parts() {
            omit(part, why);
        }
        for expectation in &self.of_other_plants {
            let plants = expectation.plants.join(", ");
            let why = format!("it is about {plants}, not {}", self.plant.model);
            omit(&expectation.part(), &why);
        }
        if self.controller.is_none() {
            omit("controller", "there is no [controller]");
        }
        if self.buses.is_empty() {
            omit(
                "bus, packets and boards",
                "there is no [bus]: signals go straight to the actuators",
            );
        }
        let outputs = facts.plant_outputs.iter().map(|port| &port.name);
        let computed = |name: &&String| required.contains(name);
        for part in families(outputs.clone().filter(|name| !computed(name)), &facts.legs) {
            let why = "no controller reads it, no board measures it, no expectation needs it and [record] does not name it";
            omit(&part, why);
        }
        let unwritten = signals(facts).map(|port| &port.name).filter(|name| {
            let omitted = outputs.clone().any(|output| output == *name) && !computed(name);
            !recorded.contains(name) && !omitted
        });
        for part in families(unwritten, &facts.legs) {
            omit(&format!("recording of {part}"), "[record] does not name it");
        }
        if self.record.frames.is_none() {
            omit("recording of poses", "[record] frames is 0 Hz");
        }
        left_out
    }
}

impl Scenario {
    /// Returns the omitted parts of the robot with the reasons; none for a standalone model.
    fn omitted_robot_parts(&self) -> Vec<(&'static str, &'static str)> {
        let mut left_out = Vec::new();
        if self.plant.is_standalone {
            return left_out;
        }
        if self.plant.ground.is_none() {
            left_out.push(("ground, contacts and their solver", "[plant] has no ground"));
        } else {
            match self.plant.contacts {
                Contacts::Feet => left_out.push((
                    "contacts of trunk, knees and ankles",
                    "[plant] contacts = \"feet\"",
                )),
                Contacts::Trunk => left_out.push((
                    "contacts of knees and ankles",
                    "[plant] contacts = \"trunk\"",
                )),
                Contacts::All => {}
            }
        }
        match self.plant.base {
            Base::Free => {}
            Base::Planar => left_out.push(("sway, roll and yaw of the trunk", "base = \"planar\"")),
            Base::Fixed => left_out.push(("motion of the trunk", "base = \"fixed\"")),
        }
        if self.plant.legs.is_some() {
            left_out.push((
                "every leg but the named ones",
                "[plant] legs does not name them",
            ));
        }
        match self.actuator.kind {
            ActuatorKind::Servo | ActuatorKind::Serial => {}
            ActuatorKind::Motor => left_out.push(("servos", "[actuator] kind = \"motor\"")),
            ActuatorKind::Ideal => left_out.push(("servos", "[actuator] kind = \"ideal\"")),
            ActuatorKind::None => {
                left_out.push(("drives and knee cables", "[actuator] kind = \"none\""));
            }
        }
        left_out
    }
}

/// Returns the name of the signal with a foot's load \[N\].
pub(crate) fn foot_load(leg: &str) -> String {
    signal::of_leg(leg, signal::FOOT_LOAD)
}

/// Returns the name of the signal with a foot's world position \[m\].
pub(crate) fn foot_position(leg: &str) -> String {
    signal::of_leg(leg, signal::FOOT_POSITION)
}

/// Returns the names, with those that differ only in the leg merged: `leg/*/cable/tension`.
fn families<'n>(names: impl Iterator<Item = &'n String>, legs: &[LegFact]) -> Vec<String> {
    let mut families: Vec<String> = Vec::new();
    for name in names {
        let parts: Vec<&str> = name
            .split('/')
            .map(|part| {
                if legs.iter().any(|leg| leg.name == part) {
                    "*"
                } else {
                    part
                }
            })
            .collect();
        let family = parts.join("/");
        if !families.contains(&family) {
            families.push(family);
        }
    }
    families
}

fn check_legs(
    legs: &LegChoice,
    measure: &FootstepMeasure,
    facts: &Facts,
    problems: &mut Vec<Problem>,
) {
    let mut named: Vec<&Placed<String>> = Vec::new();
    if let LegChoice::Named(legs) = legs {
        named.extend(legs);
    }
    match measure {
        FootstepMeasure::Phase {
            pattern: Pattern::Given(legs),
            ..
        } => named.extend(legs.iter().map(|(leg, _)| leg)),
        FootstepMeasure::Order(groups) => named.extend(groups.iter().flatten()),
        _ => {}
    }
    forgotten_leg(legs, measure, facts, problems);
    for leg in named {
        if !facts.legs.iter().any(|known| known.name == leg.value) {
            problems.push(unknown_leg(leg, "the scene", &facts.legs));
        }
    }
}

/// Reports a leg that a pattern or an order of all legs does not name: its footsteps would not be
/// judged.
fn forgotten_leg(
    legs: &LegChoice,
    measure: &FootstepMeasure,
    facts: &Facts,
    problems: &mut Vec<Problem>,
) {
    let (what, named): (_, Vec<&Placed<String>>) = match measure {
        FootstepMeasure::Phase {
            pattern: Pattern::Given(legs),
            ..
        } => ("pattern", legs.iter().map(|(leg, _)| leg).collect()),
        FootstepMeasure::Order(groups) => ("order", groups.iter().flatten().collect()),
        _ => return,
    };
    let (LegChoice::All, Some(first)) = (legs, named.first()) else {
        return;
    };
    let is_named = |leg: &&LegFact| named.iter().any(|named| named.value == leg.name);
    for leg in facts.legs.iter().filter(|leg| !is_named(leg)) {
        let message = format!("the {what} does not name leg `{}`", leg.name);
        let help = "name it, or choose the legs that are judged by `leg`";
        problems.push(Problem::at(&first.place, message, help));
    }
}

fn unknown_leg(leg: &Placed<String>, owner: &str, legs: &[LegFact]) -> Problem {
    let known = legs.iter().map(|leg| leg.name.as_str());
    let message = format!("{owner} has no leg `{}`", leg.value);
    let help = match leg.value.as_str() {
        "front" => "did you mean `fore`?".to_owned(),
        "rear" | "back" => "did you mean `hind`?".to_owned(),
        value => suggestion(value, "legs", known),
    };
    Problem::at(&leg.place, message, help)
}
