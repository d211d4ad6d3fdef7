//! Construction of the monitors of expectations.

use twinrig_kernel::{SimDuration, SimTime};

use super::compare::{CompareMeter, Source};
use super::condition::SampledCondition;
use super::cycle::CycleMeter;
use super::footstep::Thresholds;
use super::gait::GaitMeter;
use super::gets_up::GetsUpMeter;
use super::labels::labels;
use super::meter::{Meter, Nearest};
use super::recovery::{QuantitySource, RecoveringQuantity, RecoveryMeter};
use super::sequence::SequenceMeter;
use super::settling::Settling;
use super::steps::StepMeter;
use super::tracker::{Extremes, Window};
use super::trunk::{MeanTwist, Speed, TwistPart, Upright, Yaw};
use super::until::Until;
use super::{Cycle, Group, Layouts, Monitor, MonitorKind};
use crate::body::{Along, BodyClaim, BodyMeasure};
use crate::compare::{CompareClaim, Operand};
use crate::expect::{Claim, Expectation, SignalClaim, SignalMode, TimingClaim};
use crate::glob::matches;
use crate::limits::Limits;
use crate::scenario::Scenario;
use crate::scene::Scene;
use crate::sequence::{Relation, SequenceClaim};
use twinrig_kernel::signal::{BODY_POSITION, BODY_RPY};

/// Returns the monitor of `expectation`. `feet` is the group that contains the signals of feet.
pub(super) fn monitor(
    expectation: &Expectation,
    scene: &Scene,
    layouts: &Layouts<'_>,
    feet: Group,
) -> Monitor {
    let mut window = Window {
        after: expectation.after,
        before: expectation.before.unwrap_or(SimTime::MAX),
    };
    let end = window.before.min(scene.scenario.end());
    let resolved = match &expectation.claim {
        Claim::Body(claim) => body(claim, layouts, end),
        Claim::Signal(claim) => {
            if let SignalMode::Eventually(_, Some(within)) = claim.mode {
                let until = window.after.checked_add(within).unwrap_or(SimTime::MAX);
                window.before = window.before.min(until);
            }
            signal(claim, layouts, end)
        }
        Claim::Compare(claim) => compare(claim, scene, layouts),
        Claim::Sequence(claim) => sequence(claim, scene, layouts),
        Claim::Timing(claim) => cycle(claim, scene, layouts),
        Claim::Footstep(claim) => {
            let meter = StepMeter::new(claim, window, &scene.legs);
            Ok((feet, MonitorKind::Footsteps(meter)))
        }
        Claim::Gait(claim) => GaitMeter::new(claim, scene, layouts, Thresholds::of(scene))
            .map(|(group, meter)| (group, MonitorKind::Gait(Box::new(meter)))),
        Claim::EnergyResidual(_) | Claim::Cost(..) => Ok((Group::Plant, MonitorKind::AtEnd)),
    };
    let (channel, meter) =
        resolved.unwrap_or_else(|reason| (Group::Plant, MonitorKind::Absent(reason)));
    Monitor {
        window,
        channel,
        labels: labels(expectation, channel, layouts),
        meter,
        samples: 0,
        fell: false,
    }
}

/// Returns the monitor of a cycle. The nominal period of a bus is the controller's.
fn cycle(
    claim: &TimingClaim,
    scene: &Scene,
    layouts: &Layouts<'_>,
) -> Result<(Group, MonitorKind), String> {
    let control = scene.scenario.controller.as_ref();
    let control = control.ok_or("there is no controller")?;
    let of = match &claim.of {
        None => Cycle::Control,
        Some(name) => {
            let task = layouts.tasks.iter().position(|task| *task == name.value);
            Cycle::Task(task.ok_or_else(|| format!("there is no bus {}", name.value))?)
        }
    };
    let meter = CycleMeter::new(claim.measure, claim.limits, control.period);
    Ok((Group::Plant, MonitorKind::Cycle(of, meter)))
}

/// Lookup of the signals of the trunk.
struct Trunk<'l>(&'l Layouts<'l>);

impl Trunk<'_> {
    fn vector(&self, name: &str) -> Result<(Group, usize), String> {
        match self.0.find(name) {
            Some((channel, range)) if range.len() == 3 => Ok((channel, range.start)),
            _ => Err(format!("there is no signal {name}")),
        }
    }

    fn position(&self) -> Result<(Group, usize), String> {
        self.vector(BODY_POSITION)
    }

    fn rpy(&self) -> Result<(Group, usize), String> {
        self.vector(BODY_RPY)
    }

    /// Returns both, which must be in one group.
    fn pose(&self) -> Result<(Group, usize, usize), String> {
        let (channel, position) = self.position()?;
        let (other, rpy) = self.rpy()?;
        if channel != other {
            return Err(format!(
                "{BODY_POSITION} and {BODY_RPY} are not observed together"
            ));
        }
        Ok((channel, position, rpy))
    }
}

fn body(
    claim: &BodyClaim,
    layouts: &Layouts<'_>,
    end: SimTime,
) -> Result<(Group, MonitorKind), String> {
    let trunk = Trunk(layouts);
    let (channel, meter) = match claim {
        BodyClaim::Limited(measure, limits) => limited(*measure, *limits, &trunk)?,
        BodyClaim::Upright { height, tilt, end } => {
            let (channel, position, rpy) = trunk.pose()?;
            let upright = Upright::new(position + 2, rpy, *height, *tilt);
            (channel, Meter::Upright(upright, *end))
        }
        BodyClaim::Settles { within, by } => {
            let (channel, position) = trunk.position()?;
            let settling = Settling::new(*within, *by, position..position + 3);
            (channel, Meter::Settles(settling))
        }
        BodyClaim::Recovers(recovery, tolerances) => {
            let (channel, position, rpy) = trunk.pose()?;
            let quantities = tolerances.iter().map(|(quantity, tolerance)| {
                let source = QuantitySource::of_trunk(*quantity, position, rpy);
                RecoveringQuantity::new(quantity.name(), source, *tolerance)
            });
            let meter = RecoveryMeter::new(*recovery, end, quantities.collect());
            (channel, Meter::Recovers(meter))
        }
        BodyClaim::GetsUp(claim) => {
            let (channel, position, rpy) = trunk.pose()?;
            let meter = GetsUpMeter::new(*claim, position + 2, rpy);
            (channel, Meter::GetsUp(meter))
        }
    };
    Ok((channel, MonitorKind::Signal(meter)))
}

fn limited(
    measure: BodyMeasure,
    limits: Limits,
    trunk: &Trunk<'_>,
) -> Result<(Group, Meter), String> {
    let always = |(channel, start): (Group, usize), element, absolute| {
        let meter = Meter::Always {
            elements: vec![start + element],
            absolute,
            limits,
            extremes: Extremes::default(),
            others: None,
        };
        (channel, meter)
    };
    let range = |(channel, start): (Group, usize), element| {
        let meter = Meter::Range {
            element: start + element,
            limits,
            extremes: Extremes::default(),
        };
        (channel, meter)
    };
    Ok(match measure {
        BodyMeasure::Height => always(trunk.position()?, 2, false),
        BodyMeasure::Roll => always(trunk.rpy()?, 0, true),
        BodyMeasure::Pitch => always(trunk.rpy()?, 1, true),
        BodyMeasure::HeightRange => range(trunk.position()?, 2),
        BodyMeasure::RollRange => range(trunk.rpy()?, 0),
        BodyMeasure::PitchRange => range(trunk.rpy()?, 1),
        BodyMeasure::YawDrift => {
            let (channel, rpy) = trunk.rpy()?;
            (channel, Meter::Yaw(Yaw::new(rpy + 2, limits)))
        }
        BodyMeasure::Speed(along @ (Along::Heading | Along::Path)) => {
            let (channel, position, rpy) = trunk.pose()?;
            let speed = Speed::new(position, rpy + 2, along == Along::Path, limits);
            (channel, Meter::Speed(speed))
        }
        BodyMeasure::Speed(Along::Forward) => twist(trunk, TwistPart::Forward, limits)?,
        BodyMeasure::Speed(Along::Left) => twist(trunk, TwistPart::Left, limits)?,
        BodyMeasure::TurnRate => twist(trunk, TwistPart::Turn, limits)?,
    })
}

/// Returns the meter of a part of the trunk's mean twist.
fn twist(trunk: &Trunk<'_>, part: TwistPart, limits: Limits) -> Result<(Group, Meter), String> {
    let (channel, position, rpy) = trunk.pose()?;
    let twist = MeanTwist::new(position, rpy + 2, part, limits);
    Ok((channel, Meter::Twist(twist)))
}

fn signal(
    claim: &SignalClaim,
    layouts: &Layouts<'_>,
    end: SimTime,
) -> Result<(Group, MonitorKind), String> {
    let (channel, elements) = elements(&claim.name.value, claim.component, layouts)
        .ok_or_else(|| format!("there is no signal {}", claim.name.value))?;
    let meter = match &claim.mode {
        SignalMode::Always(limits) => Meter::Always {
            elements,
            absolute: false,
            limits: *limits,
            extremes: Extremes::default(),
            others: None,
        },
        SignalMode::Eventually(limits, _) => Meter::Eventually {
            elements: elements.into_iter().map(Nearest::new).collect(),
            limits: *limits,
        },
        SignalMode::Settles { within, by } => Meter::Settles(Settling::new(*within, *by, elements)),
        SignalMode::Until(limits, until) => {
            let condition = SampledCondition::find(until, layouts)?;
            if condition.group != channel {
                let (a, b) = (&claim.name.value, &until.name.value);
                return Err(format!("{a} and {b} are not observed together"));
            }
            let has_one_unit = until.unit == claim.unit;
            Meter::Until(Until::new(elements, *limits, condition, has_one_unit))
        }
        SignalMode::Recovers(recovery, tolerance) => {
            let quantity =
                |element| RecoveringQuantity::new("", QuantitySource::Element(element), *tolerance);
            let quantities = elements.into_iter().map(quantity).collect();
            Meter::Recovers(RecoveryMeter::new(*recovery, end, quantities))
        }
    };
    Ok((channel, MonitorKind::Signal(meter)))
}

/// Returns the monitor of a comparison.
fn compare(
    claim: &CompareClaim,
    scene: &Scene,
    layouts: &Layouts<'_>,
) -> Result<(Group, MonitorKind), String> {
    let source = |operand: &Operand| {
        let component = operand.component.unwrap_or(0);
        let found = layouts
            .find(&operand.name.value)
            .filter(|(_, range)| component < range.len());
        let (group, range) =
            found.ok_or_else(|| format!("there is no signal {}", operand.name.value))?;
        Ok::<_, String>(Source {
            group,
            element: range.start + component,
            period: period(group, &scene.scenario),
        })
    };
    let (signal, with) = (source(&claim.signal)?, source(&claim.with)?);
    let meter = CompareMeter::new(claim.measure, claim.limits, signal, with);
    Ok((signal.group, MonitorKind::Comparison(meter)))
}

/// Returns the nominal period of the samples of a group.
fn period(group: Group, scenario: &Scenario) -> SimDuration {
    let control = scenario.controller.as_ref().map(|control| control.period);
    let period = match group {
        Group::Plant | Group::Diagnostics => None,
        Group::ProcessInputs | Group::ProcessOutputs => control,
    };
    period.unwrap_or(scenario.observe.period)
}

/// Returns the monitor of a sequence of two conditions.
fn sequence(
    claim: &SequenceClaim,
    scene: &Scene,
    layouts: &Layouts<'_>,
) -> Result<(Group, MonitorKind), String> {
    let whenever = SampledCondition::find(&claim.whenever, layouts)?;
    let other = SampledCondition::find(&claim.other, layouts)?;
    let within = match claim.relation {
        Relation::Then(within) | Relation::Before(Some(within)) => within,
        Relation::Before(None) => SimDuration::ZERO,
    };
    let mut groups = vec![whenever.group, other.group];
    groups.dedup();
    let count = groups.into_iter().map(|group| {
        let period = period(group, &scene.scenario).as_nanos().max(1);
        within.as_nanos() / period + 2
    });
    let count = usize::try_from(count.sum::<u64>().min(RESERVED_MAX)).unwrap_or(0);
    let meter = SequenceMeter::new(whenever, other, claim.relation, count);
    Ok((other.group, MonitorKind::Sequence(Box::new(meter))))
}

/// Greatest number of samples for which memory is reserved in advance.
const RESERVED_MAX: u64 = 65_536;

/// Returns the elements selected by `name` (a name or a pattern) and `component`, in the first
/// group that has any.
fn elements(
    name: &str,
    component: Option<usize>,
    layouts: &Layouts<'_>,
) -> Option<(Group, Vec<usize>)> {
    layouts.groups().into_iter().find_map(|(channel, layout)| {
        let fields = layout
            .fields()
            .filter(|field| matches(name, &field.port.name));
        let elements: Vec<usize> = fields
            .flat_map(|field| {
                let range = field.range();
                match component {
                    Some(component) if component < range.len() => {
                        let element = range.start + component;
                        element..element + 1
                    }
                    Some(_) => range.start..range.start,
                    None => range,
                }
            })
            .collect();
        (!elements.is_empty()).then_some((channel, elements))
    })
}
