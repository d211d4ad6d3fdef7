//! Names of the elements that an expectation observes.

use twinrig_kernel::Field;
use twinrig_kernel::signal::{BODY_POSITION, BODY_RPY, of_leg, parse_leg};
use twinrig_runtime::Group;

use super::Layouts;
use crate::body::{BodyClaim, BodyMeasure};
use crate::compare::{CompareClaim, Operand};
use crate::expect::{Claim, Expectation};
use crate::glob::{is_pattern, matches};
use crate::sequence::SequenceClaim;

/// Name of an element of the samples.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Label {
    /// Index of the element.
    pub element: usize,
    pub signal: String,
    /// Component of the signal; none if it has one only.
    pub component: Option<usize>,
    /// Short name in details; empty if the claim names the element itself.
    pub short: String,
}

/// Returns the names of the elements that a claim about signals or the trunk is of.
pub(super) fn labels(
    expectation: &Expectation,
    channel: Group,
    layouts: &Layouts<'_>,
) -> Vec<Label> {
    let label = |name: &str, size: usize, element: usize, component: usize, short: String| Label {
        element,
        signal: name.to_owned(),
        component: (size > 1).then_some(component),
        short,
    };
    let only = |name: &str, component: usize| {
        let field = layouts.layout(channel).field(name).into_iter();
        let labelled = field.map(|field| {
            let element = field.offset + component;
            label(name, field.port.size, element, component, String::new())
        });
        labelled.collect::<Vec<_>>()
    };
    match &expectation.claim {
        Claim::Signal(claim) => {
            let pattern = claim.name.value.as_str();
            let several = is_pattern(pattern);
            let fields = layouts.layout(channel).fields();
            let fields = fields.filter(|field| matches(pattern, &field.port.name));
            let of_field = |field: &Field| {
                let (name, size) = (field.port.name.clone(), field.port.size);
                let range = match claim.component {
                    Some(component) => component..size.min(component + 1),
                    None => 0..size,
                };
                let offset = field.offset;
                let one = size == 1 || claim.component.is_some();
                let labelled = range.map(move |component| {
                    let of_signal = several.then(|| short_name(pattern, &name));
                    let of_element = (!one).then(|| component_name(size, component));
                    let short = [of_signal, of_element].into_iter().flatten();
                    let short = short.collect::<Vec<_>>().join(" ");
                    label(&name, size, offset + component, component, short)
                });
                labelled.collect::<Vec<_>>()
            };
            fields.flat_map(of_field).collect()
        }
        Claim::Body(claim) => {
            let short = matches!(claim, BodyClaim::Settles { .. });
            let of_trunk = |(name, component): &(&str, usize)| {
                let field = layouts.layout(channel).field(name)?;
                let short = short.then(|| component_name(3, *component));
                let element = field.offset + component;
                let short = short.unwrap_or_default();
                Some(label(name, 3, element, *component, short))
            };
            trunk_elements(claim).iter().filter_map(of_trunk).collect()
        }
        Claim::Compare(CompareClaim { signal, .. }) => {
            let Operand { name, component } = signal;
            only(&name.value, component.unwrap_or(0))
        }
        Claim::Sequence(SequenceClaim { other, .. }) => only(&other.name.value, other.component),
        Claim::Footstep(_)
        | Claim::Gait(_)
        | Claim::Timing(_)
        | Claim::EnergyResidual(_)
        | Claim::Cost(..) => Vec::new(),
    }
}

/// Returns the elements that a claim about the trunk observes one by one.
fn trunk_elements(claim: &BodyClaim) -> &'static [(&'static str, usize)] {
    const ROLL: (&str, usize) = (BODY_RPY, 0);
    const PITCH: (&str, usize) = (BODY_RPY, 1);
    const YAW: (&str, usize) = (BODY_RPY, 2);
    const HEIGHT: (&str, usize) = (BODY_POSITION, 2);
    match claim {
        BodyClaim::Limited(measure, _) => match measure {
            BodyMeasure::Speed(_) | BodyMeasure::TurnRate => &[],
            BodyMeasure::Height | BodyMeasure::HeightRange => &[HEIGHT],
            BodyMeasure::Roll | BodyMeasure::RollRange => &[ROLL],
            BodyMeasure::Pitch | BodyMeasure::PitchRange => &[PITCH],
            BodyMeasure::YawDrift => &[YAW],
        },
        BodyClaim::Upright { .. } => &[HEIGHT, ROLL, PITCH],
        BodyClaim::Settles { .. } => &[(BODY_POSITION, 0), (BODY_POSITION, 1), HEIGHT],
        BodyClaim::Recovers(..) => &[HEIGHT, ROLL, PITCH, YAW],
        BodyClaim::GetsUp(_) => &[],
    }
}

/// Returns the leg of a signal if a pattern differs from it in nothing else, or else its name.
fn short_name(pattern: &str, name: &str) -> String {
    let in_leg = parse_leg(name).filter(|(_, rest)| pattern == of_leg("*", rest));
    in_leg.map_or(name, |(leg, _)| leg).to_owned()
}

/// Returns the name of a component in details.
fn component_name(size: usize, component: usize) -> String {
    match (size, component) {
        (3, 0) => "x".to_owned(),
        (3, 1) => "y".to_owned(),
        (3, 2) => "z".to_owned(),
        _ => format!("component {component}"),
    }
}
