//! A scene: what is left of a scenario when everything that nothing needs is left out.

use std::collections::BTreeSet;

use serde::Serialize;
use twinrig_document::{DocumentError, Problem, quantity_name, suggestion};
use twinrig_kernel::{Direction, Port, Unit};

use crate::expect::{
    Claim, Expectation, FootstepMeasure, LegChoice, Pattern, SignalClaim, SignalMode, TimingClaim,
};
use crate::glob::{is_pattern, matches};
use crate::ground_below::GroundBelow;
use crate::scenario::{ActuatorKind, Base, Placed, Scenario};

/// A leg of the robot.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LegFact {
    /// Its name: `LF`.
    pub name: String,
    /// Whether it stands before the centre of mass.
    pub fore: bool,
    /// Whether it stands on the left.
    pub left: bool,
}

/// What a scenario must be told to become a scene: what only the robot, the plant and the controller know.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Facts {
    /// The legs that [`Scenario::legs`] keeps.
    pub legs: Vec<LegFact>,
    /// The robot's weight \[N\].
    pub weight: f64,
    /// Every output that the plant could give for these legs.
    pub plant_outputs: Vec<Port>,
    /// Inputs and outputs of the controller; empty without one.
    pub process_ports: Vec<Port>,
    /// What drivers and boards count; empty without a bus.
    pub diagnostics: Vec<Port>,
    /// The plant outputs that boards measure.
    pub measured: Vec<String>,
    /// Patterns of the plant outputs that a recording of poses needs.
    pub frame_signals: Vec<String>,
    /// The ground that a fall is seen against.
    pub ground: GroundBelow,
}

/// What is left of a scenario.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// The scenario.
    pub scenario: Scenario,
    /// The legs that are simulated, in the robot's order.
    pub legs: Vec<LegFact>,
    /// The robot's weight \[N\].
    pub weight: f64,
    /// The plant outputs that something needs, in the plant's order: only these are computed.
    pub wanted: Vec<String>,
    /// The signals that are written down, of plant and controller.
    pub recorded: Vec<String>,
    /// What is left out.
    pub left_out: Vec<LeftOut>,
    /// The ground that a fall is seen against.
    pub ground: GroundBelow,
}

/// A part that is left out.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct LeftOut {
    /// What.
    pub part: String,
    /// Why nothing needs it.
    pub why: String,
}

impl Scenario {
    /// The legs of `robot` that the scenario simulates, in the robot's order.
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
                problems.push(no_leg(leg, "the robot", robot));
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

    /// The scene.
    ///
    /// # Errors
    /// The scenario names a leg or a signal that the scene does not have, or gives a limit in another unit than the
    /// signal's.
    pub fn scene(&self, facts: &Facts) -> Result<Scene, DocumentError> {
        let mut problems = Vec::new();
        let needs = self.needs(facts, &mut problems);
        let recorded = self.recorded(facts, &mut problems);
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
        let wanted = facts.plant_outputs.iter().filter(|port| {
            read(port)
                || facts.measured.contains(&port.name)
                || needs.contains(&port.name)
                || recorded.contains(&port.name)
                || frames(&port.name)
        });
        let wanted: Vec<String> = wanted.map(|port| port.name.clone()).collect();
        let left_out = self.left_out(facts, &wanted, &recorded);
        Ok(Scene {
            scenario: self.clone(),
            legs: facts.legs.clone(),
            weight: facts.weight,
            wanted,
            recorded,
            left_out,
            ground: facts.ground.clone(),
        })
    }

    /// The names of the signals that the expectations need.
    fn needs(&self, facts: &Facts, problems: &mut Vec<Problem>) -> BTreeSet<String> {
        let mut needs = BTreeSet::new();
        let falls = |expectation: &Expectation| expectation.claim.is_of_an_upright_robot();
        if self.fall.end || self.expectations.iter().any(falls) {
            needs.extend([BODY_POSITION, BODY_RPY].map(str::to_owned));
        }
        for expectation in &self.expectations {
            match &expectation.claim {
                Claim::Footstep(claim) => {
                    check_legs(&claim.legs, &claim.measure, facts, problems);
                    for leg in &facts.legs {
                        needs.extend([foot_load(&leg.name), foot_position(&leg.name)]);
                    }
                }
                Claim::Body(_) => {
                    needs.extend([BODY_POSITION, BODY_RPY].map(str::to_owned));
                }
                Claim::Signal(claim) => {
                    let optional = expectation.optional;
                    needs.extend(check_signal(claim, optional, facts, problems));
                }
                Claim::Timing(claim) => problems.extend(self.no_such_bus(claim)),
                Claim::EnergyResidual(_) | Claim::Cost(..) => {}
            }
        }
        needs
    }

    /// What is wrong with the name of a bus in a claim about its cycle.
    fn no_such_bus(&self, claim: &TimingClaim) -> Option<Problem> {
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

    /// The names of the signals to write down.
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
                    problems.push(no_signal(pattern, facts));
                }
            }
            names.retain(|name| patterns.iter().any(|pattern| matches(&pattern.value, name)));
        }
        names.into_iter().map(str::to_owned).collect()
    }

    fn left_out(&self, facts: &Facts, wanted: &[String], recorded: &[String]) -> Vec<LeftOut> {
        let mut left_out = Vec::new();
        let mut leave = |part: &str, why: &str| {
            left_out.push(LeftOut {
                part: part.to_owned(),
                why: why.to_owned(),
            });
        };
        for (part, why) in self.left_out_of_the_robot() {
            leave(part, why);
        }
        for expectation in &self.of_other_plants {
            let about = expectation.plants.join(", ");
            let part = format!("expectation that {}", expectation.name);
            leave(
                &part,
                &format!("it is about {about}, not {}", self.plant.model),
            );
        }
        if self.controller.is_none() {
            leave("controller", "there is no [controller]");
        }
        if self.buses.is_empty() {
            leave(
                "bus, packets and boards",
                "there is no [bus]: signals go straight to the actuators",
            );
        }
        let outputs = facts.plant_outputs.iter().map(|port| &port.name);
        let computed = |name: &&String| wanted.contains(name);
        for part in families(outputs.clone().filter(|name| !computed(name)), &facts.legs) {
            let why = "no controller reads it, no board measures it, no expectation needs it and [record] does not name it";
            leave(&part, why);
        }
        let unwritten = signals(facts).map(|port| &port.name).filter(|name| {
            let gone = outputs.clone().any(|output| output == *name) && !computed(name);
            !recorded.contains(name) && !gone
        });
        for part in families(unwritten, &facts.legs) {
            leave(&format!("recording of {part}"), "[record] does not name it");
        }
        if self.record.frames.is_none() {
            leave("recording of poses", "[record] frames is 0 Hz");
        }
        left_out
    }
}

impl Scenario {
    /// What of a robot the plant leaves out, and why; nothing of a model that is none of our robots.
    fn left_out_of_the_robot(&self) -> Vec<(&'static str, &'static str)> {
        let mut left_out = Vec::new();
        if self.plant.is_standalone {
            return left_out;
        }
        if self.plant.ground.is_none() {
            left_out.push(("ground, contacts and their solver", "[plant] has no ground"));
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
            ActuatorKind::Servo => {}
            ActuatorKind::Motor => left_out.push(("servos", "[actuator] kind = \"motor\"")),
            ActuatorKind::Ideal => left_out.push(("servos", "[actuator] kind = \"ideal\"")),
            ActuatorKind::None => {
                left_out.push(("drives and knee cables", "[actuator] kind = \"none\""));
            }
        }
        left_out
    }
}

/// World position of the trunk's centre of mass \[m\].
pub(crate) const BODY_POSITION: &str = "body/position";
/// Roll, pitch and yaw of the trunk \[rad\].
pub(crate) const BODY_RPY: &str = "body/rpy";

/// The signal with a foot's load \[N\].
pub(crate) fn foot_load(leg: &str) -> String {
    format!("leg/{leg}/foot/load")
}

/// The signal with a foot's place in the world \[m\].
pub(crate) fn foot_position(leg: &str) -> String {
    format!("leg/{leg}/foot/position")
}

fn signals(facts: &Facts) -> impl Iterator<Item = &Port> {
    let inside = facts.plant_outputs.iter().chain(&facts.process_ports);
    inside.chain(&facts.diagnostics)
}

/// Names, those that differ only by the leg as one: `leg/*/cable/tension`.
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
    for leg in named {
        if !facts.legs.iter().any(|known| known.name == leg.value) {
            problems.push(no_leg(leg, "the scene", &facts.legs));
        }
    }
}

/// The signals of a claim, which must be there unless the claim is optional, and be in the unit of its limits.
fn check_signal(
    claim: &SignalClaim,
    optional: bool,
    facts: &Facts,
    problems: &mut Vec<Problem>,
) -> Vec<String> {
    let mut asked = vec![(&claim.name, claim.unit, claim.component)];
    if let SignalMode::Until(_, until) = &claim.mode {
        asked.push((&until.name, until.unit, Some(until.component)));
    }
    let mut needs = Vec::new();
    for (name, unit, component) in asked {
        let found: Vec<&Port> = signals(facts)
            .filter(|port| matches(&name.value, &port.name))
            .collect();
        if found.is_empty() && !optional {
            problems.push(no_signal(name, facts));
        }
        for port in found {
            if port.unit != unit {
                problems.push(wrong_unit(name, port, unit));
                break;
            }
            if component.is_some_and(|component| component >= port.size) {
                let message = format!("`{}` has {} elements", port.name, port.size);
                problems.push(Problem::at(&name.place, message, "elements count from 0"));
                break;
            }
            needs.push(port.name.clone());
        }
    }
    needs
}

fn wrong_unit(name: &Placed<String>, port: &Port, unit: Unit) -> Problem {
    let message = format!(
        "`{}` is in {}, its limits are {}",
        port.name,
        port.unit,
        quantity_name(unit)
    );
    let help = format!("give {} as a limit", quantity_name(port.unit));
    Problem::at(&name.place, message, help)
}

fn no_signal(name: &Placed<String>, facts: &Facts) -> Problem {
    let known = signals(facts).map(|port| port.name.as_str());
    let message = if is_pattern(&name.value) {
        format!("no signal matches `{}`", name.value)
    } else {
        format!("there is no signal `{}` in this scene", name.value)
    };
    Problem::at(
        &name.place,
        message,
        suggestion(&name.value, "signals", known),
    )
}

fn no_leg(leg: &Placed<String>, whose: &str, legs: &[LegFact]) -> Problem {
    let known = legs.iter().map(|leg| leg.name.as_str());
    let message = format!("{whose} has no leg `{}`", leg.value);
    Problem::at(&leg.place, message, suggestion(&leg.value, "legs", known))
}
