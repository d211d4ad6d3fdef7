//! First difference between two runs.

use std::cmp::Ordering;

use twinrig_kernel::SimTime;

use crate::index::Wire;
use crate::{Recording, Sample, SampledGroup};

/// Result of comparing two recordings signal by signal.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Comparison {
    /// First differing sample; `None` if all are equal.
    pub first: Option<Divergence>,
    /// Number of signals in both recordings.
    pub signals: usize,
    /// Number of samples of a group that are equal in both, up to the first difference of that
    /// group.
    pub equal_samples: u64,
    /// Signals, as `group: name`, that only the first recording has, or that differ in size or
    /// unit; and wires, as `wire: name`.
    pub only_in_a: Vec<String>,
    /// The same for the second recording.
    pub only_in_b: Vec<String>,
}

/// First difference between two recordings.
#[derive(Debug, Clone, PartialEq)]
pub struct Divergence {
    /// Time of the difference.
    pub time: SimTime,
    /// Group of the signal.
    pub group: String,
    /// Name of the signal.
    pub signal: String,
    /// Component of the signal, from 0.
    pub component: usize,
    /// Value in the first recording; `None` if it has no sample at that time.
    pub a: Option<f64>,
    /// Value in the second recording.
    pub b: Option<f64>,
}

/// A signal of both recordings, with its offsets in the samples of each.
struct Pair<'a> {
    name: &'a str,
    size: usize,
    a: usize,
    b: usize,
}

/// Compares `a` and `b` bit for bit, signal by signal, and returns the first differing sample in
/// order of time. At equal times the order is that of the groups and signals in `a`, then wires;
/// for a wire, the signal is its name and the component the index of the first differing byte of a
/// piece.
///
/// A signal in only one of the recordings is listed and is not a difference. A sample in only one
/// of them is a difference: that run lasted longer, or was sampled at other times.
pub fn first_divergence(a: &Recording, b: &Recording) -> Comparison {
    divergence_within(a, b, [false; 2])
}

/// As [`first_divergence`] for recordings that may be truncated, as `cut_off` states for `a` and
/// `b`: the end of a group in a truncated recording is not a difference.
pub fn divergence_within(a: &Recording, b: &Recording, cut_off: [bool; 2]) -> Comparison {
    let mut comparison = Comparison::default();
    for group in a.groups() {
        match b.group(&group.name) {
            Some(other) => compare_group((a, group), (b, other), cut_off, &mut comparison),
            None => comparison.only_in_a.extend(names(group)),
        }
    }
    for group in b
        .groups()
        .iter()
        .filter(|group| a.group(&group.name).is_none())
    {
        comparison.only_in_b.extend(names(group));
    }
    for wire in a.wires() {
        match b.wire(&wire.name) {
            Some(other) => compare_wire((a, wire), (b, other), cut_off, &mut comparison),
            None => comparison.only_in_a.push(format!("{WIRE}: {}", wire.name)),
        }
    }
    for wire in b.wires().iter().filter(|wire| a.wire(&wire.name).is_none()) {
        comparison.only_in_b.push(format!("{WIRE}: {}", wire.name));
    }
    comparison
}

/// Group name of a difference between bytes on wires.
const WIRE: &str = "wire";

fn names(group: &SampledGroup) -> impl Iterator<Item = String> {
    group
        .signals
        .iter()
        .map(|signal| format!("{}: {}", group.name, signal.name))
}

fn compare_group(
    (a, in_a): (&Recording, &SampledGroup),
    (b, in_b): (&Recording, &SampledGroup),
    cut_off: [bool; 2],
    into: &mut Comparison,
) {
    let pairs = pair_up(in_a, in_b, into);
    into.signals += pairs.len();
    let Some(first) = pairs.first() else { return };
    for (time, x, y) in paired(a.samples(in_a), b.samples(in_b), |one| one.time, cut_off) {
        let found = pairs.iter().find_map(|pair| {
            let of = |start: usize| start..start + pair.size;
            let (x, y) = (x?.values(of(pair.a)), y?.values(of(pair.b)));
            let component = x.zip(y).position(|(x, y)| x.to_bits() != y.to_bits())?;
            Some((pair, component))
        });
        if x.is_some() && y.is_some() && found.is_none() {
            into.equal_samples += 1;
            continue;
        }
        let (pair, component) = found.unwrap_or((first, 0));
        let value = |sample: Option<Sample<'_>>, start: usize| {
            let one = start + component;
            sample.and_then(|sample| sample.values(one..one + 1).next())
        };
        into.keep_first(Divergence {
            time,
            group: in_a.name.clone(),
            signal: pair.name.to_owned(),
            component,
            a: value(x, pair.a),
            b: value(y, pair.b),
        });
        return;
    }
}

/// Compares pieces of bytes; they differ also if their lengths differ.
fn compare_wire(
    (a, in_a): (&Recording, &Wire),
    (b, in_b): (&Recording, &Wire),
    cut_off: [bool; 2],
    into: &mut Comparison,
) {
    for (time, x, y) in paired(a.pieces(in_a), b.pieces(in_b), |one| one.0, cut_off) {
        let [x, y] = [x, y].map(|piece| piece.map_or(&[][..], |(_, bytes)| bytes));
        let same = x.iter().zip(y).take_while(|(x, y)| x == y).count();
        if same == x.len() && same == y.len() {
            continue;
        }
        let byte = |bytes: &[u8]| bytes.get(same).map(|byte| f64::from(*byte));
        into.keep_first(Divergence {
            time,
            group: WIRE.to_owned(),
            signal: in_a.name.clone(),
            component: same,
            a: byte(x),
            b: byte(y),
        });
        return;
    }
}

/// Merges the items of two recordings in order of time, with items of equal time together; stops at
/// the end of a truncated recording.
fn paired<T: Copy>(
    left: impl Iterator<Item = T>,
    right: impl Iterator<Item = T>,
    time: impl Fn(&T) -> SimTime,
    [left_cut_off, right_cut_off]: [bool; 2],
) -> impl Iterator<Item = (SimTime, Option<T>, Option<T>)> {
    let (mut left, mut right) = (left.peekable(), right.peekable());
    std::iter::from_fn(move || {
        let order = match (left.peek(), right.peek()) {
            (None, None) => return None,
            (None, Some(_)) if left_cut_off => return None,
            (Some(_), None) if right_cut_off => return None,
            (Some(_), None) => Ordering::Less,
            (None, Some(_)) => Ordering::Greater,
            (Some(x), Some(y)) => time(x).cmp(&time(y)),
        };
        let x = if order.is_le() { left.next() } else { None };
        let y = if order.is_ge() { right.next() } else { None };
        let at = x.or(y).map(|one| time(&one))?;
        Some((at, x, y))
    })
}

impl Comparison {
    /// Keeps the divergence if it is earlier than the present one.
    fn keep_first(&mut self, divergence: Divergence) {
        let earlier = self.first.as_ref().map(|first| first.time);
        if earlier.is_none_or(|earlier| divergence.time < earlier) {
            self.first = Some(divergence);
        }
    }
}

/// Returns the signals of both groups with equal size and unit; lists the others.
fn pair_up<'a>(
    in_a: &'a SampledGroup,
    in_b: &'a SampledGroup,
    into: &mut Comparison,
) -> Vec<Pair<'a>> {
    let mut pairs = Vec::new();
    let mut start = 0;
    for signal in &in_a.signals {
        let other = in_b
            .find(&signal.name)
            .filter(|(other, _)| other.size == signal.size && other.unit == signal.unit);
        match other {
            Some((_, range)) => {
                pairs.push(Pair {
                    name: &signal.name,
                    size: signal.size,
                    a: start,
                    b: range.start,
                });
            }
            None => into
                .only_in_a
                .push(format!("{}: {}", in_a.name, signal.name)),
        }
        start += signal.size;
    }
    for signal in &in_b.signals {
        if !pairs.iter().any(|pair| pair.name == signal.name) {
            into.only_in_b
                .push(format!("{}: {}", in_b.name, signal.name));
        }
    }
    pairs
}
