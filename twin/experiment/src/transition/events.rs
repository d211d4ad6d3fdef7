//! Transitions between established classes of gaits.

use serde::Serialize;

use super::classify::{GaitCycle, MIXED, STANDING};
use crate::gait::run::GaitRun;

/// Direction of the variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum RampDirection {
    /// Its last change was an increase, or there was none.
    Up,
    /// Its last change was a decrease.
    Down,
}

/// Transition from one class to another.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Transition {
    /// Class before.
    pub from: String,
    /// Class after; [`MIXED`] if none is established up to the end.
    pub to: String,
    /// End of the last cycle of the class before \[s\].
    pub begin_s: f64,
    /// Begin of the first cycle of the class after, which lasts; none for [`MIXED`] \[s\].
    pub established_s: Option<f64>,
    /// Value of the variable when the transition begins.
    pub value: f64,
    /// Direction of the variable then.
    pub way: RampDirection,
    /// Path of the feet on the ground from the begin to the establishment, or to the end of the run
    /// \[m\].
    pub slip_m: f64,
}

/// Values of the variable at which one pair of classes changes, on the way up and down.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Hysteresis {
    /// The two classes, in the order of the first transition.
    pub classes: [String; 2],
    /// Values of all transitions between them on the way up.
    pub up: Vec<f64>,
    /// And on the way down.
    pub down: Vec<f64>,
}

/// Part of a run in one established class.
#[derive(Clone, Debug, PartialEq)]
struct Established<'c> {
    class: &'c str,
    begin_s: f64,
    end_s: f64,
}

/// Returns the transitions of a run between classes that last `lasting` cycles in a row.
pub(crate) fn transitions(
    run: &GaitRun,
    cycles: &[GaitCycle],
    lasting: usize,
    values: &[[f64; 2]],
) -> Vec<Transition> {
    let parts = established(cycles, lasting);
    let mut found: Vec<Transition> = parts
        .windows(2)
        .filter(|pair| pair[0].class != pair[1].class)
        .map(|pair| {
            let [before, after] = [&pair[0], &pair[1]];
            transition(run, values, before, after.class, Some(after.begin_s))
        })
        .collect();
    // A gait that is lost for good.
    if let Some(last) = parts.last() {
        let rest = cycles.iter().filter(|cycle| cycle.begin_s >= last.end_s);
        if rest.count() >= lasting {
            found.push(transition(run, values, last, MIXED, None));
        }
    }
    found
}

fn transition(
    run: &GaitRun,
    values: &[[f64; 2]],
    before: &Established<'_>,
    to: &str,
    established_s: Option<f64>,
) -> Transition {
    let begin_s = before.end_s;
    let until_s = established_s.unwrap_or(run.end_s);
    Transition {
        from: before.class.to_owned(),
        to: to.to_owned(),
        begin_s,
        established_s,
        value: value_at(values, begin_s),
        way: way_at(values, begin_s),
        slip_m: run.slip_m([begin_s, until_s]),
    }
}

/// Returns the parts of a run in which a class lasts; parts of one class are one unless another
/// class lasts between them.
fn established(cycles: &[GaitCycle], lasting: usize) -> Vec<Established<'_>> {
    let mut parts: Vec<Established<'_>> = Vec::new();
    let mut rest = cycles;
    while let Some(first) = rest.first() {
        let length = rest.iter().take_while(|it| it.class == first.class).count();
        let (run, after) = rest.split_at(length);
        rest = after;
        // One time of standing is long enough by itself.
        let lasts = length >= lasting || first.class == STANDING;
        if !lasts || first.class == MIXED {
            continue;
        }
        let end_s = run.last().map_or(first.end_s, |cycle| cycle.end_s);
        match parts.last_mut() {
            Some(last) if last.class == first.class => last.end_s = end_s,
            _ => parts.push(Established {
                class: &first.class,
                begin_s: first.begin_s,
                end_s,
            }),
        }
    }
    parts
}

/// Returns the values at which pairs of classes change, on both ways.
pub(crate) fn hysteresis(transitions: &[Transition]) -> Vec<Hysteresis> {
    let mut pairs: Vec<Hysteresis> = Vec::new();
    for one in transitions.iter().filter(|one| one.to != MIXED) {
        let is_pair = |pair: &Hysteresis| {
            let [a, b] = &pair.classes;
            [[a, b], [b, a]].contains(&[&one.from, &one.to])
        };
        let known = pairs.iter().position(is_pair);
        let place = known.unwrap_or_else(|| {
            pairs.push(Hysteresis {
                classes: [one.from.clone(), one.to.clone()],
                up: Vec::new(),
                down: Vec::new(),
            });
            pairs.len() - 1
        });
        match one.way {
            RampDirection::Up => pairs[place].up.push(one.value),
            RampDirection::Down => pairs[place].down.push(one.value),
        }
    }
    pairs
}

/// Returns the value of a variable that has `values` from their times on.
pub(crate) fn value_at(values: &[[f64; 2]], at_s: f64) -> f64 {
    let past = values.partition_point(|[from, _]| *from <= at_s);
    values.get(past.saturating_sub(1)).map_or(0.0, |it| it[1])
}

fn way_at(values: &[[f64; 2]], at_s: f64) -> RampDirection {
    let past = values.partition_point(|[from, _]| *from <= at_s);
    match values[..past] {
        [.., [_, before], [_, now]] if now < before => RampDirection::Down,
        _ => RampDirection::Up,
    }
}
