//! Checks of the signals that expectations name.

use twinrig_document::{Placed, Problem, quantity_name, suggestion};
use twinrig_kernel::{Port, Unit, signal};

use crate::compare::{CompareClaim, Operand};
use crate::expect::{SignalClaim, SignalMode};
use crate::facts::Facts;
use crate::gait::{GaitClaim, GaitMeasure};
use crate::glob::{is_pattern, matches};
use crate::sequence::{Condition, SequenceClaim};

/// Returns all signals of a scene.
pub(crate) fn signals(facts: &Facts) -> impl Iterator<Item = &Port> {
    let inside = facts.plant_outputs.iter().chain(&facts.process_ports);
    inside.chain(&facts.diagnostics)
}

/// Returns the signals of a claim. Checks that they exist, unless the claim is optional, and that
/// they have the unit of its limits.
pub(crate) fn check_signal(
    claim: &SignalClaim,
    optional: bool,
    facts: &Facts,
    problems: &mut Vec<Problem>,
) -> Vec<String> {
    let checks = Checks { optional, facts };
    let mut names = checks.matching(&claim.name, claim.unit, claim.component, problems);
    if let SignalMode::Until(_, until) = &claim.mode {
        names.extend(checks.condition(until, problems));
    }
    names
}

/// Returns the signals of the conditions of a sequence, after the checks of [`check_signal`].
pub(crate) fn check_sequence(
    claim: &SequenceClaim,
    optional: bool,
    facts: &Facts,
    problems: &mut Vec<Problem>,
) -> Vec<String> {
    let checks = Checks { optional, facts };
    let conditions = [&claim.whenever, &claim.other];
    let names = conditions.map(|condition| checks.condition(condition, problems));
    names.concat()
}

/// Checks of the signals of one claim.
struct Checks<'f> {
    /// Whether a signal may be absent.
    optional: bool,
    facts: &'f Facts,
}

impl Checks<'_> {
    /// Returns the signal of a condition.
    fn condition(&self, condition: &Condition, problems: &mut Vec<Problem>) -> Vec<String> {
        let name = &condition.name;
        if is_pattern(&name.value) {
            let message = format!("`{}` is a pattern", name.value);
            let help = "a condition is of one signal";
            problems.push(Problem::at(&name.place, message, help));
            return Vec::new();
        }
        self.matching(name, condition.unit, Some(condition.component), problems)
    }

    /// Returns the signals that match a name.
    fn matching(
        &self,
        name: &Placed<String>,
        unit: Unit,
        component: Option<usize>,
        problems: &mut Vec<Problem>,
    ) -> Vec<String> {
        let found: Vec<&Port> = signals(self.facts)
            .filter(|port| matches(&name.value, &port.name))
            .collect();
        if found.is_empty() && !self.optional {
            problems.push(unknown_signal(name, self.facts));
        }
        let mut names = Vec::new();
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
            names.push(port.name.clone());
        }
        names
    }
}

/// Returns the signals of a comparison. Checks that they exist, unless the claim is optional, that
/// each is one element, and that they and the limits have one unit.
pub(crate) fn check_comparison(
    claim: &CompareClaim,
    optional: bool,
    facts: &Facts,
    problems: &mut Vec<Problem>,
) -> Vec<String> {
    let operands = [&claim.signal, &claim.with];
    let mut found = Vec::new();
    for operand in operands {
        let name = &operand.name;
        let port = signals(facts).find(|port| port.name == name.value);
        match port.map(|port| (port, wrong_element(operand, port))) {
            Some((port, None)) => found.push(port),
            Some((_, Some(problem))) => problems.push(problem),
            None if is_pattern(&name.value) => {
                let message = format!("`{}` is a pattern", name.value);
                let help = "a comparison is of one signal with one other";
                problems.push(Problem::at(&name.place, message, help));
            }
            None if !optional => problems.push(unknown_signal(name, facts)),
            None => {}
        }
    }
    if let [signal, with] = found[..] {
        problems.extend(incomparable(claim, signal, with));
    }
    found.into_iter().map(|port| port.name.clone()).collect()
}

/// Returns the signals of a claim about the gait. Checks that the controller outputs its phases
/// where the claim compares them with contacts, unless it is optional.
pub(crate) fn check_gait(
    claim: &GaitClaim,
    optional: bool,
    facts: &Facts,
    problems: &mut Vec<Problem>,
) -> Vec<String> {
    let mut names = [signal::BODY_POSITION, signal::BODY_RPY]
        .map(str::to_owned)
        .to_vec();
    for leg in &facts.legs {
        let of_leg = |name: &&str| signal::of_leg(&leg.name, name);
        names.extend(
            [signal::FOOT_LOAD, signal::FOOT_POSITION]
                .iter()
                .map(of_leg),
        );
        if claim.measure == GaitMeasure::CostOfTransport {
            let drives = signal::DRIVES
                .iter()
                .flat_map(|(angle, torque)| [*angle, *torque]);
            names.extend(drives.map(|name| of_leg(&name)));
        }
        if claim.measure.requires_phases() {
            let phase = of_leg(&signal::PHASE);
            if !optional && signals(facts).all(|port| port.name != phase) {
                let message = format!("there is no signal `{phase}` in this scene");
                let help = "set `phase_output = true` in [controller], if the controller has it";
                problems.push(Problem::at(&claim.place, message, help));
                break;
            }
            names.push(phase);
        }
    }
    names
}

/// Returns the problem of an operand that is not one element of its signal.
fn wrong_element(operand: &Operand, port: &Port) -> Option<Problem> {
    let problem = |help: &str| {
        let message = format!("`{}` has {} elements", port.name, port.size);
        Some(Problem::at(&operand.name.place, message, help))
    };
    match operand.component {
        None if port.size > 1 => problem("a comparison is of one of them: name it"),
        Some(component) if component >= port.size => problem("elements count from 0"),
        _ => None,
    }
}

/// Returns the problem of two signals that cannot be compared.
fn incomparable(claim: &CompareClaim, signal: &Port, with: &Port) -> Option<Problem> {
    let element = |operand: &Operand| operand.component.unwrap_or(0);
    if signal.unit != with.unit {
        let message = format!(
            "`{}` is in {}, `{}` in {}",
            with.name, with.unit, signal.name, signal.unit
        );
        let help = "only signals with the same unit can be compared";
        return Some(Problem::at(&claim.with.name.place, message, help));
    }
    if signal.name == with.name && element(&claim.signal) == element(&claim.with) {
        let message = format!("`{}` is compared with itself", signal.name);
        return Some(Problem::at(
            &claim.with.name.place,
            message,
            "name another signal",
        ));
    }
    let is_wrong = claim.measure.unit().is_none() && claim.unit != signal.unit;
    is_wrong.then(|| wrong_unit(&claim.signal.name, signal, claim.unit))
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

/// Returns the problem of a name or pattern without signal.
pub(crate) fn unknown_signal(name: &Placed<String>, facts: &Facts) -> Problem {
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
