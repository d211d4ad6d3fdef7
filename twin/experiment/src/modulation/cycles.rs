//! Footsteps of a leg by cycle of its oscillator, and their displacements from a reference run.

use crate::error::StudyError;
use crate::gait::run::{FootContact, GaitRun, median};

/// Footstep of one cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CycleStep {
    /// Number of the cycle after the change, from 1.
    pub(crate) cycle: usize,
    /// Contact with the largest impulse.
    pub(crate) contact: FootContact,
}

/// Returns one footstep for each cycle of a leg after `after_s`, of its contacts in order of time.
///
/// A contact closer to the cycle's first one than half a period is a bounce, and the contact with
/// the largest impulse stays. After a cycle without a contact the number of the next one is larger
/// by two, as the times show. Each cycle is counted from the one before it, so that a period that
/// drifts in the course of the run shifts no number.
pub(crate) fn cycles(contacts: &[FootContact], after_s: f64, period_s: f64) -> Vec<CycleStep> {
    let begun = contacts.partition_point(|contact| contact.touch_down_s <= after_s);
    let Some(last) = begun.checked_sub(1).and_then(|last| contacts.get(last)) else {
        return Vec::new();
    };
    let (mut begin_s, mut cycle) = (last.touch_down_s, 0);
    let mut found: Vec<CycleStep> = Vec::new();
    for contact in &contacts[begun..] {
        let elapsed = libm::round((contact.touch_down_s - begin_s) / period_s);
        if elapsed >= 1.0 {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a positive number of cycles; a cast saturates"
            )]
            let elapsed = elapsed as usize;
            cycle += elapsed;
            begin_s = contact.touch_down_s;
            let contact = *contact;
            found.push(CycleStep { cycle, contact });
        } else if let Some(step) = found.last_mut()
            && contact.impulse_n_s > step.contact.impulse_n_s
        {
            step.contact = *contact;
        }
    }
    found
}

/// Footsteps of a run without the change, to which others are compared.
#[derive(Clone, Debug)]
pub(crate) struct Reference {
    pub(crate) run: GaitRun,
    /// Period of each leg \[s\].
    pub(crate) periods_s: Vec<f64>,
    /// Mean distance between the footsteps of a leg \[m\].
    pub(crate) stride_m: f64,
    /// Mean share of the contact in the period.
    pub(crate) duty: f64,
}

/// Displacements of one footstep or touch-down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Shift {
    pub(crate) leg: usize,
    /// Number after the change, from 1.
    pub(crate) step: usize,
    /// Displacement along the heading; none if one of the runs lacks the footstep \[m\].
    pub(crate) along_m: Option<f64>,
}

impl Reference {
    /// Creates the reference of `run`, whose legs step periodically from `after_s` on.
    ///
    /// # Errors
    /// [`StudyError::FewFootsteps`] of a leg with fewer than `required` footsteps from there on.
    pub(crate) fn new(run: GaitRun, after_s: f64, required: usize) -> Result<Self, StudyError> {
        let (mut periods_s, mut strides, mut duties) = (Vec::new(), Vec::new(), Vec::new());
        for leg in 0..run.legs.len() {
            let steps = run.footsteps_of(leg);
            let steps: Vec<FootContact> = steps
                .into_iter()
                .filter(|step| step.touch_down_s >= after_s)
                .collect();
            let pairs = || steps.windows(2).map(|pair| (pair[0], pair[1]));
            let intervals = pairs().map(|(a, b)| b.touch_down_s - a.touch_down_s);
            let period_s = median(intervals.collect()).filter(|_| steps.len() >= required);
            let Some(period_s) = period_s else {
                return Err(StudyError::FewFootsteps {
                    leg: run.legs[leg].clone(),
                    after_s,
                    found: steps.len(),
                    required,
                });
            };
            periods_s.push(period_s);
            strides.extend(pairs().map(|(a, b)| length(between(&a, &b))));
            let stances = steps
                .iter()
                .filter_map(|it| Some(it.lift_off_s? - it.touch_down_s));
            duties.extend(stances.map(|stance_s| stance_s / period_s));
        }
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
        Ok(Self {
            run,
            periods_s,
            stride_m: mean(&strides),
            duty: mean(&duties),
        })
    }

    /// Returns instants at equal distances in the first cycle of the first leg after `after_s`,
    /// each in the middle of its part.
    pub(crate) fn points_s(&self, after_s: f64, count: usize) -> Vec<f64> {
        let steps = self.run.footsteps_of(0);
        let mut later = steps.iter().filter(|step| step.touch_down_s >= after_s);
        let begin_s = later.next().map_or(after_s, |step| step.touch_down_s);
        let share = |point: usize| (point as f64 + 0.5) / count as f64;
        (0..count)
            .map(|point| begin_s + share(point) * self.periods_s[0])
            .collect()
    }

    /// Returns the displacements of `run`, which differs from `at_s` on, by cycle: `steps` of each
    /// leg.
    pub(crate) fn by_cycle(&self, run: &GaitRun, at_s: f64, steps: usize) -> Vec<Shift> {
        self.shifts(|leg| {
            let own = self.cycles_of(leg, at_s);
            let other = cycles(&run.footsteps_of(leg), at_s, self.periods_s[leg]);
            let find = |of: &[CycleStep], cycle: usize| {
                let found = of.iter().find(|step| step.cycle == cycle);
                found.map(|step| step.contact)
            };
            let pair = |step| Some((find(&own, step)?, find(&other, step)?));
            (1..=steps).map(pair).collect()
        })
    }

    /// Returns the displacements by number of the touch-down, each bounce by itself.
    pub(crate) fn by_touch_down(&self, run: &GaitRun, at_s: f64, steps: usize) -> Vec<Shift> {
        self.shifts(|leg| {
            let after = |run: &GaitRun| {
                let mut contacts = run.contacts_of(leg);
                contacts.retain(|contact| contact.touch_down_s > at_s);
                contacts
            };
            let (own, other) = (after(&self.run), after(run));
            let pair = |step| Some((*own.get(step)?, *other.get(step)?));
            (0..steps).map(pair).collect()
        })
    }

    fn shifts(
        &self,
        pairs: impl Fn(usize) -> Vec<Option<(FootContact, FootContact)>>,
    ) -> Vec<Shift> {
        let legs = 0..self.run.legs.len();
        legs.flat_map(|leg| {
            let steps = self.run.footsteps_of(leg);
            let pairs = pairs(leg).into_iter().enumerate();
            let shift = |(place, pair): (usize, Option<(FootContact, FootContact)>)| Shift {
                leg,
                step: place + 1,
                along_m: pair.map(|(own, other)| {
                    let [x, y] = heading(&steps, own.touch_down_s);
                    let [dx, dy] = between(&own, &other);
                    dx * x + dy * y
                }),
            };
            pairs.map(shift).collect::<Vec<_>>()
        })
        .collect()
    }

    fn cycles_of(&self, leg: usize, after_s: f64) -> Vec<CycleStep> {
        cycles(&self.run.footsteps_of(leg), after_s, self.periods_s[leg])
    }
}

/// Returns the direction in which a leg with these footsteps travels at `at_s`: from the footstep
/// before the present one to the one after it.
fn heading(steps: &[FootContact], at_s: f64) -> [f64; 2] {
    let next = steps.partition_point(|step| step.touch_down_s <= at_s);
    let from = steps.get(next.saturating_sub(2));
    let to = steps.get(next).or_else(|| steps.last());
    let way = from
        .zip(to)
        .map_or([0.0; 2], |(from, to)| between(from, to));
    let length = length(way);
    if length > 0.0 {
        way.map(|part| part / length)
    } else {
        [1.0, 0.0]
    }
}

fn between(from: &FootContact, to: &FootContact) -> [f64; 2] {
    [0, 1].map(|axis| to.position_m[axis] - from.position_m[axis])
}

fn length([x, y]: [f64; 2]) -> f64 {
    (x * x + y * y).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn contact(touch_down_s: f64, impulse_n_s: f64) -> FootContact {
        FootContact {
            leg: 0,
            touch_down_s,
            lift_off_s: None,
            position_m: [touch_down_s, 0.0, 0.0],
            impulse_n_s,
            slip_m: 0.0,
        }
    }

    #[test]
    fn bounces_share_a_cycle_and_a_missing_footstep_leaves_its_number_out() {
        let contacts = [
            contact(0.0, 1.0),
            // A bounce of the footstep before the change.
            contact(0.2, 2.0),
            contact(1.0, 0.1),
            contact(1.2, 0.9),
            contact(1.3, 0.2),
            // Cycle 2 has no contact; cycle 3 is early.
            contact(2.8, 1.0),
            contact(3.9, 1.0),
        ];
        let found = cycles(&contacts, 0.1, 1.0);
        let found: Vec<(usize, f64)> = found
            .iter()
            .map(|step| (step.cycle, step.contact.touch_down_s))
            .collect();
        assert_eq!(found, [(1, 1.2), (3, 2.8), (4, 3.9)]);
        assert_eq!(cycles(&contacts, -1.0, 1.0), []);
    }
}
