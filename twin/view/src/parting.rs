//! The difference by which two runs part: that which came first, and so is next to its cause.
//!
//! Two runs of one scenario are equal bit for bit up to their cause. Within one sample of it, much
//! else differs a little; what differs by a hundredth of its range first, then by a tenth, is the
//! nearest. Timing and events come before signals, since they change them.

use std::cmp::Ordering;

use twinrig_kernel::{SimTime, Unit, signal};
use twinrig_record::{
    EventComparison, EventMessage, PartingPoint, Recording, SignalDrift, group_name,
};
use twinrig_report::number::{precise, quantity};
use twinrig_runtime::Group;

/// Time after the first difference within which a signal has left with it \[s\].
const TOGETHER: f64 = 5e-3;

/// Signals that are sums of errors, or totals that every other signal changes.
const EFFECTS: [&str; 1] = [signal::ENERGY_PREFIX];

/// The difference by which two runs part.
#[derive(Debug, Clone, PartialEq)]
pub struct Parting {
    /// Instant \[s\].
    pub at_s: f64,
    /// In words: `in the drives: LF knee/torque at 0.004 s: 782 mN·m, 919 mN·m in A`.
    pub text: String,
    /// Name of the signal and of its component, if it is one.
    pub signal: Option<(String, usize)>,
}

/// Returns the difference by which a new run parts from an old one, which is called `old_name`;
/// none of runs that are equal to a millionth as far as both go.
pub fn parting(
    old: &Recording,
    new: &Recording,
    comparison: &EventComparison,
    old_name: &str,
) -> Option<Parting> {
    let signals = signals(&comparison.signals, old_name);
    let before_signals = |it: &Parting| {
        let from = signals.as_ref().map(|it| it.at_s);
        from.is_none_or(|from| it.at_s <= from + TOGETHER)
    };
    let timing = timing(old, new, old_name).filter(&before_signals);
    let event = event(old, new, old_name).filter(&before_signals);
    timing.or(event).or(signals)
}

/// Parts of a rig, in the order of cause and effect within an instant.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Part {
    Bus,
    Controller,
    Drives,
    Ground,
    Legs,
    Trunk,
    Plant,
}

impl Part {
    /// Returns the part that a signal is of.
    fn of(drift: &SignalDrift) -> Self {
        if drift.group == group_name(Group::Diagnostics) {
            return Self::Bus;
        }
        if drift.group == group_name(Group::ProcessOutputs) {
            return Self::Controller;
        }
        match signal::parse_leg(&drift.signal) {
            Some((_, signal::FOOT_FORCE | signal::FOOT_LOAD)) => Self::Ground,
            Some((_, name)) if ["hip/", "knee/"].iter().any(|it| name.starts_with(it)) => {
                Self::Drives
            }
            Some(_) => Self::Legs,
            None if drift.signal.starts_with("body/") => Self::Trunk,
            None => Self::Plant,
        }
    }

    fn place(self) -> &'static str {
        match self {
            Self::Bus => "on the bus",
            Self::Controller => "in the controller",
            Self::Drives => "in the drives",
            Self::Ground => "at the ground",
            Self::Legs => "in the legs",
            Self::Trunk => "at the trunk",
            Self::Plant => "in the plant",
        }
    }
}

/// Returns up to when the commands are those of the baseline; empty if that says nothing.
fn commands(drifts: &[SignalDrift], of: &SignalDrift) -> String {
    let mut commands = drifts
        .iter()
        .filter(|it| Part::of(it) == Part::Controller)
        .peekable();
    if Part::of(of) <= Part::Controller || commands.peek().is_none() {
        return String::new();
    }
    let parts = commands.filter_map(|drift| drift.plain.parts);
    match parts.map(|point| point.at_s).reduce(f64::min) {
        Some(at) => format!("; commands are equal up to {at:.3} s"),
        None => "; all commands are equal".to_owned(),
    }
}

/// Returns the first control step whose outputs have another time.
fn timing(old: &Recording, new: &Recording, old_name: &str) -> Option<Parting> {
    let times = |recording: &Recording| -> Option<Vec<f64>> {
        let group = recording.group(group_name(Group::ProcessOutputs))?;
        let samples = recording.samples(group);
        Some(samples.map(|sample| sample.time.as_secs_f64()).collect())
    };
    let (old, new) = (times(old)?, times(new)?);
    let mut pairs = old.iter().zip(&new).enumerate();
    let (step, (was, is)) = pairs.find(|(_, (was, is))| was != is)?;
    Some(Parting {
        at_s: was.min(*is),
        text: format!(
            "in the timing: control step {} ends at {is:.6} s, at {was:.6} s in {old_name}",
            step + 1
        ),
        signal: None,
    })
}

/// Returns the first event that is in one of the runs only.
fn event(old: &Recording, new: &Recording, old_name: &str) -> Option<Parting> {
    let events = |recording: &Recording| recording.messages::<EventMessage>().unwrap_or_default();
    let end = |recording: &Recording| recording.reached().unwrap_or(SimTime::MAX);
    let end = end(old).min(end(new));
    let (old, new) = (events(old), events(new));
    let equal = old.iter().zip(&new).take_while(|(old, new)| old == new);
    let equal = equal.count();
    let reached = |it: &&(SimTime, EventMessage)| it.0 < end;
    let (was, is) = (
        old.get(equal).filter(reached),
        new.get(equal).filter(reached),
    );
    let parting = |(at, event): &(SimTime, EventMessage), how: &str| {
        let part = event.part.as_ref();
        let of = part.map_or_else(String::new, |part| format!(" of {part}"));
        let at_s = at.as_secs_f64();
        Parting {
            at_s,
            text: format!(
                "in the timing: \"{}\"{of} at {at_s:.3} s, {how}",
                event.event
            ),
            signal: None,
        }
    };
    match (was, is) {
        (Some(was), Some(is)) if is.0 <= was.0 => Some(is),
        (Some(_), _) => None,
        (None, is) => is,
    }
    .map(|is| parting(is, &format!("which is not in {old_name}")))
    .or_else(|| was.map(|was| parting(was, &format!("which is in {old_name} alone"))))
}

/// Order of the signals that leave together, by which the nearest to the cause is first.
struct Rank {
    is_downstream: bool,
    /// Instant from which it differs, or of what is downstream differs by a hundredth of its range
    /// \[s\].
    from: f64,
    part: Part,
    unlikely: [bool; 3],
    /// Instant from which it differs by a tenth of its range \[s\].
    much: f64,
}

impl Rank {
    fn compare(&self, other: &Self) -> Ordering {
        let downstream = self.is_downstream.cmp(&other.is_downstream);
        let from = self.from.total_cmp(&other.from);
        let part = self.part.cmp(&other.part);
        let unlikely = self.unlikely.cmp(&other.unlikely);
        let much = self.much.total_cmp(&other.much);
        let bus = unlikely.then(much);
        // Of the plant, the size of an effect says more than its place.
        let rest = if self.is_downstream {
            much.then(part).then(unlikely)
        } else {
            part.then(bus)
        };
        downstream.then(from).then(rest)
    }
}

/// Returns which of the marks of a cause a signal of a bus lacks: it counts, it counted nothing in
/// the old run, it is of one board.
fn unlikely(drift: &SignalDrift, point: PartingPoint) -> [bool; 3] {
    if Part::of(drift) != Part::Bus {
        return [false; 3];
    }
    let counts = drift.unit == Unit::One.symbol();
    let is_of_board = drift
        .signal
        .split('/')
        .nth(1)
        .is_some_and(|it| it.chars().all(char::is_uppercase));
    [!counts, point.a != 0.0, !is_of_board]
}

/// Returns the signal that leaves first, and the legs of which it does.
fn signals(drifts: &[SignalDrift], old_name: &str) -> Option<Parting> {
    let is_cause = |drift: &&SignalDrift| !EFFECTS.iter().any(|it| drift.signal.starts_with(it));
    let left = drifts.iter().filter(is_cause);
    let left = left.filter_map(|drift| Some((drift, drift.plain.parts?)));
    let first = left.clone().map(|(_, point)| point.at_s);
    let first = first.reduce(f64::min)?;
    let together = left.filter(|(_, point)| point.at_s <= first + TOGETHER);
    let never = f64::INFINITY;
    let soonest = |drift: &SignalDrift| {
        let [little, much] = drift.plain.exceeds_at_s;
        [much.unwrap_or(never), little.unwrap_or(never)]
    };
    // What is upstream of the plant and parts before it is the cause, however small; commands, and
    // errors that a board begins to count, also in the same sample.
    let of_plant = together
        .clone()
        .filter(|(drift, _)| Part::of(drift) > Part::Controller);
    let of_plant = of_plant.map(|(_, point)| point.at_s).fold(never, f64::min);
    let upstream = |drift: &SignalDrift, point: PartingPoint| match Part::of(drift) {
        Part::Bus if unlikely(drift, point) == [false; 3] => point.at_s <= of_plant,
        Part::Bus => point.at_s < of_plant,
        Part::Controller => point.at_s <= of_plant,
        _ => false,
    };
    let rank = |(drift, point): &(&SignalDrift, PartingPoint)| {
        let [much, little] = soonest(drift);
        let is_downstream = !upstream(drift, *point);
        Rank {
            is_downstream,
            from: if is_downstream { little } else { point.at_s },
            part: Part::of(drift),
            unlikely: unlikely(drift, *point),
            much,
        }
    };
    let ranked = together.clone().map(|it| (rank(&it), it));
    let first_of_all = ranked.min_by(|(a, _), (b, _)| a.compare(b));
    let (_, (drift, point)) = first_of_all?;
    let mut values = [point.b, point.a].map(|value| quantity(value, &drift.unit));
    if values[0] == values[1] {
        values = [point.b, point.a].map(|value| precise(value, &drift.unit));
    }
    let [is, was] = values;
    let (leg, name) = match signal::parse_leg(&drift.signal) {
        Some((leg, name)) => (Some(leg), name),
        None => (None, drift.signal.as_str()),
    };
    let component = match drift.components {
        1 => String::new(),
        3 => format!(" {}", ["x", "y", "z"][drift.component.min(2)]),
        _ => format!(" {}", drift.component),
    };
    let mut others: Vec<&str> = Vec::new();
    for (other, _) in together {
        if let Some((of, other_name)) = signal::parse_leg(&other.signal)
            && other_name == name
            && Some(of) != leg
            && !others.contains(&of)
        {
            others.push(of);
        }
    }
    let others = match others.len() {
        0 => String::new(),
        3 => "; the other legs likewise".to_owned(),
        _ => format!("; likewise {}", others.join(", ")),
    };
    let leg = leg.map_or_else(String::new, |leg| format!("{leg} "));
    let at = point.at_s;
    let (part, commands) = (Part::of(drift).place(), commands(drifts, drift));
    Some(Parting {
        at_s: first,
        text: format!(
            "{part}: {leg}{name}{component} at {at:.3} s: {is}, {was} in {old_name}{others}{commands}"
        ),
        signal: Some((drift.signal.clone(), drift.component)),
    })
}

#[cfg(test)]
mod tests {
    use twinrig_record::Drift;

    use super::*;

    /// Returns a signal that parts at 6 s from 0 to 1, and differs by much `later` \[s\].
    fn drift(group: Group, signal: &str, unit: &str, later: f64) -> SignalDrift {
        let plain = Drift {
            parts: Some(PartingPoint {
                at_s: 6.0,
                a: 0.0,
                b: 1.0,
            }),
            exceeds_at_s: [Some(6.0), Some(6.0 + later)],
            ..Drift::default()
        };
        SignalDrift {
            group: group_name(group).to_owned(),
            signal: signal.to_owned(),
            unit: unit.to_owned(),
            component: 0,
            components: 1,
            by_leg: None,
            aligned: plain.clone(),
            plain,
            ends: None,
        }
    }

    #[test]
    fn nearest_to_the_cause_is_first() {
        let torque = drift(Group::Plant, "leg/LF/knee/torque", "N·m", 0.002);
        let other = drift(Group::Plant, "leg/RH/knee/torque", "N·m", 0.1);
        let force = drift(Group::Plant, "leg/LH/foot/force", "N", 0.01);
        let energy = drift(Group::Plant, "energy/gravity", "J", 0.0);
        let command = drift(Group::ProcessOutputs, "leg/LF/knee/command", "rad", 0.5);
        let spread = drift(Group::Diagnostics, "sbcp/RF/request/half_range", "s", 0.01);
        let missed = drift(Group::Diagnostics, "sbcp/LF/missed_points", "1", 0.5);
        let mut later = command.clone();
        later.plain.parts = later.plain.parts.map(|it| PartingPoint { at_s: 7.0, ..it });
        for (drifts, text) in [
            (
                vec![&energy, &force, &torque, &other],
                "in the drives: LF knee/torque at 6.000 s: 1 N·m, 0 N·m in A; likewise RH",
            ),
            (
                vec![&torque, &later],
                "in the drives: LF knee/torque at 6.000 s: 1 N·m, 0 N·m in A; commands are equal up to 7.000 s",
            ),
            (
                vec![&force, &other],
                "at the ground: LH foot/force at 6.000 s: 1 N, 0 N in A",
            ),
            // Commands are equally early, and upstream.
            (
                vec![&torque, &command],
                "in the controller: LF knee/command at 6.000 s: 57.3°, 0° in A",
            ),
            // Errors that a board begins to count are; times of others are not.
            (vec![&spread, &torque], "in the drives: LF"),
            (
                vec![&spread, &missed, &torque],
                "on the bus: sbcp/LF/missed_points at 6.000 s: 1, 0 in A",
            ),
        ] {
            let drifts: Vec<SignalDrift> = drifts.into_iter().cloned().collect();
            let found = signals(&drifts, "A").unwrap();
            assert!(found.text.starts_with(text), "{}", found.text);
            assert_eq!(found.at_s, 6.0);
        }
        assert_eq!(signals(&[energy], "A"), None);
    }
}
