//! Which footsteps of a gait differ between two models, and by how much.

use serde::Serialize;
use twinrig_kernel::{Direction, Layout, SimDuration, SimTime};
use twinrig_runtime::Plant;

use crate::outing::{Ending, Go, Outing};

/// So much of a walk is compared.
pub const WALK: SimDuration = SimDuration::from_secs(3);
/// Feet are looked at so often: no touch-down is known better.
pub(crate) const LOOK: SimDuration = SimDuration::from_micros(400);
/// A foot that was off the ground for less has not stepped, but bounced.
const SWING: SimDuration = SimDuration::from_millis(40);

const LOAD: &str = "/foot/load";
const PLACE: &str = "/foot/position";

/// The n-th touch-down of a leg, in one model and in another.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Footstep {
    /// The plant that is compared with the one whose segments have mass.
    pub plant: String,
    /// Name of the leg.
    pub leg: String,
    /// Which of its touch-downs, from 1.
    pub number: usize,
    /// When it is in the model whose segments have mass; none if it has not so many \[s\].
    pub at_s: Option<f64>,
    /// How much later it is in the other; none if either has not so many \[s\].
    pub later_s: Option<f64>,
    /// How far from there it is \[m\].
    pub apart_m: Option<f64>,
    /// So much of that may be the methods': what either model changes by at a coarser setting \[s\].
    pub unsure_s: Option<f64>,
    /// The same of the place \[m\].
    pub unsure_m: Option<f64>,
}

/// A touch-down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TouchDown {
    at_s: f64,
    place: [f64; 3],
}

/// The touch-downs of each leg.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Steps(Vec<(String, Vec<TouchDown>)>);

/// A foot on its way.
struct Foot {
    load: usize,
    place: usize,
    off_since: Option<SimTime>,
}

impl Steps {
    /// Leads `plant` through a scene and sees where its feet touch down; none if it did not come to the end.
    pub(crate) fn record(plant: &mut dyn Plant, outing: &Outing<'_>) -> Option<Self> {
        let ports = plant.ports();
        let layout = Layout::of(&ports, Direction::Output);
        let mut outputs = vec![0.0; layout.len()];
        let mut feet = Vec::new();
        let mut steps = Self::default();
        for field in layout.fields() {
            let name = &field.port.name;
            let leg = name
                .strip_prefix("leg/")
                .and_then(|name| name.strip_suffix(LOAD));
            let place = leg.and_then(|leg| layout.find(&format!("leg/{leg}{PLACE}")));
            if let (Some(leg), Some(place)) = (leg, place) {
                feet.push(Foot {
                    load: field.offset,
                    place: place.start,
                    off_since: None,
                });
                steps.0.push((leg.to_owned(), Vec::new()));
            }
        }
        let ending = outing.lead(plant, |now, plant| {
            plant.observe(&mut outputs);
            plant.begin_window();
            for (foot, (_, touched)) in feet.iter_mut().zip(&mut steps.0) {
                if outputs[foot.load] <= 0.0 {
                    foot.off_since.get_or_insert(now);
                    continue;
                }
                if foot
                    .off_since
                    .take()
                    .is_some_and(|since| now - since >= SWING)
                {
                    touched.push(TouchDown {
                        at_s: now.as_secs_f64(),
                        place: core::array::from_fn(|n| outputs[foot.place + n]),
                    });
                }
            }
            Go::On
        });
        (ending == Ending::Whole).then_some(steps)
    }

    fn of(&self, leg: &str, number: usize) -> Option<TouchDown> {
        let (_, steps) = self.0.iter().find(|(name, _)| name == leg)?;
        steps.get(number).copied()
    }
}

/// How far a touch-down is from its like.
fn apart(a: TouchDown, b: TouchDown) -> (f64, f64) {
    let squares = a.place.iter().zip(b.place).map(|(a, b)| (a - b) * (a - b));
    (b.at_s - a.at_s, squares.sum::<f64>().sqrt())
}

/// Compares the model whose segments have mass with another, leg by leg, each with itself at a coarser setting beside it.
pub(crate) fn compare(plant: &str, full: [&Steps; 2], other: [&Steps; 2]) -> Vec<Footstep> {
    let mut footsteps = Vec::new();
    for (leg, steps) in &full[0].0 {
        let others = other[0].0.iter().find(|(name, _)| name == leg);
        let count = others.map_or(0, |(_, steps)| steps.len()).max(steps.len());
        for number in 0..count {
            let of = |steps: &Steps| steps.of(leg, number);
            let difference = |a: &Steps, b: &Steps| Some(apart(of(a)?, of(b)?));
            let between = difference(full[0], other[0]);
            let own = [full, other].map(|pair| difference(pair[0], pair[1]));
            let unsure = match own {
                [Some(a), Some(b)] => Some((a.0.abs().max(b.0.abs()), a.1.max(b.1))),
                _ => None,
            };
            footsteps.push(Footstep {
                plant: plant.to_owned(),
                leg: leg.clone(),
                number: number + 1,
                at_s: of(full[0]).map(|step| step.at_s),
                later_s: between.map(|(later, _)| later),
                apart_m: between.map(|(_, apart)| apart),
                unsure_s: unsure.map(|(time, _)| time),
                unsure_m: unsure.map(|(_, place)| place),
            });
        }
    }
    footsteps
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steps(times: &[f64]) -> Steps {
        let touched = times.iter().map(|&at_s| TouchDown {
            at_s,
            place: [at_s, 0.0, 0.0],
        });
        Steps(vec![("LF".to_owned(), touched.collect())])
    }

    #[test]
    fn the_nth_is_compared_with_the_nth_and_one_too_many_with_nothing() {
        let (full, coarse) = (steps(&[1.0, 2.0]), steps(&[1.0, 2.25]));
        let (other, others) = (steps(&[1.5, 2.5, 3.5]), steps(&[1.5, 2.0, 3.5]));
        let found = compare("other", [&full, &coarse], [&other, &others]);
        let shown: Vec<_> = found
            .iter()
            .map(|step| (step.number, step.at_s, step.later_s, step.unsure_s))
            .collect();
        assert_eq!(
            shown,
            [
                (1, Some(1.0), Some(0.5), Some(0.0)),
                (2, Some(2.0), Some(0.5), Some(0.5)),
                (3, None, None, None),
            ]
        );
    }
}
