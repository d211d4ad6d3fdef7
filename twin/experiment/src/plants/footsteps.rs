//! Differences of the touch-downs of a gait between two models.

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Direction, Layout, SimDuration, SimTime, signal};
use twinrig_record::{Pairing, RecordedFootstep, pair_footsteps};
use twinrig_rig::PlantId;
use twinrig_runtime::Plant;

use crate::measured::Measured;
use crate::plants::plant_run::{Ending, PlantRun, SampleVerdict};

/// Duration of the walk compared.
pub const GAIT_DURATION: SimDuration = SimDuration::from_secs(3);
/// Sampling period of the feet: the resolution of touch-down times.
pub(crate) const SAMPLE_PERIOD: SimDuration = SimDuration::from_micros(400);
/// Least swing duration; a shorter loss of contact is a bounce.
const SWING: SimDuration = SimDuration::from_millis(40);

/// Touch-down of a leg in two models.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Footstep {
    /// Plant that is compared with the one with segment masses.
    #[serde(flatten)]
    pub plant: PlantId,
    /// Name of the leg.
    pub leg: String,
    /// Number of the touch-down of this leg, from 1.
    pub number: usize,
    /// Time in the model with segment masses; `None` if only the other model has this touch-down
    /// \[s\].
    pub at_s: Option<f64>,
    /// Delay in the other model; `None` if only one model has this touch-down \[s\].
    pub later_s: Option<f64>,
    /// Distance between the two positions \[m\].
    pub apart_m: Option<f64>,
    /// Uncertainty of the delay due to the methods: greater change of the time in either model at a
    /// coarser setting \[s\].
    pub unsure_s: Option<f64>,
    /// Uncertainty of the distance, likewise \[m\].
    pub unsure_m: Option<f64>,
}

/// Touch-down of one run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct TouchDown {
    pub(crate) at_s: f64,
    pub(crate) place: [f64; 3],
}

/// Touch-downs by leg.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct TouchDowns(Vec<(String, Vec<TouchDown>)>);

/// Touch-downs of a walk at two settings.
impl Measured for [TouchDowns; 2] {}

/// Contact state of a foot.
struct Foot {
    load: usize,
    place: usize,
    off_since: Option<SimTime>,
}

/// Detector of touch-downs in sampled outputs.
pub(crate) struct TouchDownRecorder {
    feet: Vec<Foot>,
    touch_downs: TouchDowns,
}

impl TouchDownRecorder {
    /// Creates the detector for the feet with a position and a load in `layout`.
    pub(crate) fn of(layout: &Layout) -> Self {
        let mut recorder = Self {
            feet: Vec::new(),
            touch_downs: TouchDowns::default(),
        };
        for field in layout.fields() {
            let of_leg = signal::parse_leg(&field.port.name);
            let leg = of_leg.and_then(|(leg, name)| (name == signal::FOOT_LOAD).then_some(leg));
            let place = |leg| layout.find(&signal::of_leg(leg, signal::FOOT_POSITION));
            let place = leg.and_then(place);
            if let (Some(leg), Some(place)) = (leg, place) {
                recorder.feet.push(Foot {
                    load: field.offset,
                    place: place.start,
                    off_since: None,
                });
                recorder.touch_downs.0.push((leg.to_owned(), Vec::new()));
            }
        }
        recorder
    }

    /// Adds the touch-downs in a sample.
    pub(crate) fn sample(&mut self, now: SimTime, outputs: &[f64]) {
        for (foot, (_, touched)) in self.feet.iter_mut().zip(&mut self.touch_downs.0) {
            if outputs[foot.load] <= 0.0 {
                foot.off_since.get_or_insert(now);
                continue;
            }
            let off_since = foot.off_since.take();
            if off_since.is_some_and(|since| now - since >= SWING) {
                touched.push(TouchDown {
                    at_s: now.as_secs_f64(),
                    place: core::array::from_fn(|n| outputs[foot.place + n]),
                });
            }
        }
    }

    /// Returns the number of feet.
    pub(crate) fn count(&self) -> usize {
        self.feet.len()
    }

    /// Returns the number of feet on the ground in the last sample.
    pub(crate) fn loaded(&self) -> usize {
        let loaded = self.feet.iter().filter(|foot| foot.off_since.is_none());
        loaded.count()
    }

    pub(crate) fn touch_downs(self) -> TouchDowns {
        self.touch_downs
    }
}

impl TouchDowns {
    /// Runs `plant` and records the touch-downs of its feet; `None` if the run does not complete.
    pub(crate) fn record(plant: &mut dyn Plant, plant_run: &PlantRun<'_>) -> Option<Self> {
        let ports = plant.ports();
        let layout = Layout::of(&ports, Direction::Output);
        let mut outputs = vec![0.0; layout.len()];
        let mut recorder = TouchDownRecorder::of(&layout);
        let ending = plant_run.run(plant, |now, plant| {
            plant.observe(&mut outputs);
            plant.begin_window();
            recorder.sample(now, &outputs);
            SampleVerdict::Continue
        });
        (ending == Ending::Completed).then_some(recorder.touch_downs)
    }

    /// Iterates over the legs and their touch-downs.
    pub(crate) fn legs(&self) -> impl Iterator<Item = (&str, &[TouchDown])> {
        self.0
            .iter()
            .map(|(leg, touched)| (leg.as_str(), &touched[..]))
    }

    fn of(&self, leg: &str) -> &[TouchDown] {
        let found = self.0.iter().find(|(name, _)| name == leg);
        found.map_or(&[], |(_, steps)| steps)
    }

    /// Pairs the touch-downs of each leg with those of another walk from the same start; both last
    /// until `end_s`.
    fn paired(&self, other: &Self, end_s: f64) -> Vec<Pairing> {
        let footsteps = |touch_downs: &[TouchDown]| -> Vec<RecordedFootstep> {
            let footsteps = touch_downs.iter().map(|touched| RecordedFootstep {
                touch_down_s: touched.at_s,
                lift_off_s: touched.at_s,
                position_m: Some(touched.place),
            });
            footsteps.collect()
        };
        let legs = self.0.iter();
        let legs = legs.map(|(leg, own)| [footsteps(own), footsteps(other.of(leg))]);
        let legs: Vec<[Vec<RecordedFootstep>; 2]> = legs.collect();
        let legs: Vec<_> = legs.iter().map(|[a, b]| [&a[..], &b[..]]).collect();
        pair_footsteps(&legs, [end_s; 2]).legs
    }

    /// Returns the distance of each touch-down from its counterpart in another walk \[s, m\], by
    /// leg; `None` without a counterpart.
    fn changes(&self, other: &Self, end_s: f64) -> Vec<Vec<Option<(f64, f64)>>> {
        let legs = self.0.iter().zip(self.paired(other, end_s));
        let changes = legs.map(|((leg, own), pairing)| {
            let mut changes = vec![None; own.len()];
            for (i, j) in pairing.pairs {
                changes[i] = Some(apart(own[i], other.of(leg)[j]));
            }
            changes
        });
        changes.collect()
    }
}

/// Returns time difference and distance of two touch-downs.
fn apart(a: TouchDown, b: TouchDown) -> (f64, f64) {
    let squares = a.place.iter().zip(b.place).map(|(a, b)| (a - b) * (a - b));
    (b.at_s - a.at_s, squares.sum::<f64>().sqrt())
}

/// Compares the model with segment masses with another, leg by leg; each is given at a fine and at
/// a coarser setting. All four walks last until `end_s`.
pub(crate) fn compare(
    plant: &PlantId,
    [full, full_coarse]: [&TouchDowns; 2],
    [other, other_coarse]: [&TouchDowns; 2],
    end_s: f64,
) -> Vec<Footstep> {
    let own = full.changes(full_coarse, end_s);
    let others = other.changes(other_coarse, end_s);
    let mut footsteps = Vec::new();
    for (n, pairing) in full.paired(other, end_s).into_iter().enumerate() {
        let (leg, steps) = &full.0[n];
        let theirs = other.of(leg);
        let place = other.0.iter().position(|(name, _)| name == leg);
        let change = |i: usize, j: usize| {
            let own = own[n].get(i).copied().flatten()?;
            let other = others.get(place?)?.get(j).copied().flatten()?;
            Some((own.0.abs().max(other.0.abs()), own.1.max(other.1)))
        };
        let pairs = pairing.pairs.into_iter().map(|(i, j)| (Some(i), Some(j)));
        let only_full = pairing.only_in_a.into_iter().map(|i| (Some(i), None));
        let only_other = pairing.only_in_b.into_iter().map(|j| (None, Some(j)));
        let mut all: Vec<_> = pairs.chain(only_full).chain(only_other).collect();
        let at = |&(i, j): &(Option<usize>, Option<usize>)| match (i, j) {
            (Some(i), _) => steps[i].at_s,
            (None, Some(j)) => theirs[j].at_s,
            (None, None) => 0.0,
        };
        all.sort_by(|a, b| at(a).total_cmp(&at(b)));
        for (number, (i, j)) in all.into_iter().enumerate() {
            let pair = i.zip(j);
            let between = pair.map(|(i, j)| apart(steps[i], theirs[j]));
            let unsure = pair.and_then(|(i, j)| change(i, j));
            footsteps.push(Footstep {
                plant: plant.clone(),
                leg: leg.clone(),
                number: number + 1,
                at_s: i.map(|i| steps[i].at_s),
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

    fn steps(times: &[f64]) -> TouchDowns {
        let touched = times.iter().map(|&at_s| TouchDown {
            at_s,
            place: [at_s, 0.0, 0.0],
        });
        TouchDowns(vec![("LF".to_owned(), touched.collect())])
    }

    type Shown = (usize, Option<f64>, Option<f64>, Option<f64>);

    fn shown(full: [&TouchDowns; 2], other: [&TouchDowns; 2]) -> Vec<Shown> {
        let found = compare(&PlantId::new("other"), full, other, 10.0);
        let shown = |step: &Footstep| (step.number, step.at_s, step.later_s, step.unsure_s);
        found.iter().map(shown).collect()
    }

    #[test]
    fn touch_downs_are_paired_and_surplus_ones_stay_unpaired() {
        let (full, coarse) = (steps(&[1.0, 2.0, 3.0]), steps(&[1.0, 2.25, 3.0]));
        let (other, others) = (
            steps(&[1.25, 2.25, 3.25, 4.25]),
            steps(&[1.25, 2.0, 3.25, 4.25]),
        );
        assert_eq!(
            shown([&full, &coarse], [&other, &others]),
            [
                (1, Some(1.0), Some(0.25), Some(0.0)),
                (2, Some(2.0), Some(0.25), Some(0.25)),
                (3, Some(3.0), Some(0.25), Some(0.0)),
                (4, None, None, None),
            ]
        );
    }

    #[test]
    fn bounce_does_not_shift_other_touch_downs() {
        let full = steps(&[1.0, 2.0, 3.0, 4.0]);
        let coarse = steps(&[1.0, 1.5, 2.0, 3.0, 4.0]);
        let other = steps(&[0.5, 1.0, 2.0, 3.0, 4.0]);
        let unmoved = |number: usize| (number, Some(number as f64 - 1.0), Some(0.0), Some(0.0));
        assert_eq!(
            shown([&full, &coarse], [&other, &other]),
            [
                (1, None, None, None),
                unmoved(2),
                unmoved(3),
                unmoved(4),
                unmoved(5)
            ]
        );
    }
}
