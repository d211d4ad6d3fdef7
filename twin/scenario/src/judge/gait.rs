//! Judging footsteps when the run is over.

use super::footstep::Footstep;
use super::outcome::{Finding, Verdict};
use super::phase;
use super::tracker::Window;
use crate::expect::{Axis, FootstepClaim, FootstepMeasure, LegChoice};
use crate::limits::Limits;
use crate::scene::LegFact;

/// All there is to know about the footsteps of a run.
pub(super) struct Gait<'g> {
    pub legs: &'g [LegFact],
    /// Sorted by touch-down.
    pub footsteps: &'g [Footstep],
    /// Of the run without changes.
    pub reference: Option<&'g [Footstep]>,
    pub window: Window,
    /// Whether the footsteps of a leg could be seen at all.
    pub seen: &'g dyn Fn(usize) -> bool,
}

impl Gait<'_> {
    pub fn finding(&self, claim: &FootstepClaim) -> Finding {
        let legs = self.chosen(&claim.legs);
        if legs.is_empty() {
            return Finding::unobserved("the scene has no such leg");
        }
        if let Some(leg) = legs.iter().find(|leg| !(self.seen)(**leg)) {
            let name = &self.legs[*leg].name;
            return Finding::unobserved(format!("nothing tells load and place of foot {name}"));
        }
        match &claim.measure {
            FootstepMeasure::Slip(limits) => self.each(&legs, limits, |step| Some(step.slip)),
            FootstepMeasure::Impulse(limits) => {
                self.each(&legs, limits, |step| step.lift_off.map(|_| step.impulse))
            }
            FootstepMeasure::PeakLoad(limits) => {
                self.each(&legs, limits, |step| Some(step.peak_load))
            }
            FootstepMeasure::Position(axis, limits) => {
                self.each(&legs, limits, |step| Some(along(*axis, step.position)))
            }
            FootstepMeasure::StanceTime(limits) => self.each(&legs, limits, stance),
            FootstepMeasure::SwingTime(limits) => self.between(&legs, limits, |step, next| {
                let lift_off = step.lift_off?;
                Some((next.touch_down - lift_off).as_secs_f64())
            }),
            FootstepMeasure::StrideLength(limits) => self.between(&legs, limits, |step, next| {
                Some(along(Axis::Horizontal, minus(next.position, step.position)))
            }),
            FootstepMeasure::DutyFactor(limits) => self.per_leg(&legs, limits, duty_factor),
            FootstepMeasure::Frequency(limits) => self.per_leg(&legs, limits, frequency),
            FootstepMeasure::Count(limits) => {
                self.per_leg(&legs, limits, |steps| Some(steps.len() as f64))
            }
            FootstepMeasure::Phase { pattern, tolerance } => {
                phase::finding(self, &legs, pattern, *tolerance)
            }
            FootstepMeasure::PhaseSpread(limits) => phase::spread(self, &legs, limits),
            FootstepMeasure::Order(groups) => {
                let index = |name: &str| self.legs.iter().position(|leg| leg.name == name);
                let groups = groups.iter().map(|group| {
                    let legs = group.iter().filter_map(|leg| index(&leg.value));
                    legs.collect::<Vec<_>>()
                });
                self.order(&groups.collect::<Vec<_>>())
            }
            FootstepMeasure::Displacement {
                axis,
                cycle,
                limits,
            } => self.displacement(&legs, *axis, *cycle, limits),
        }
    }

    /// The footsteps of `leg` that touch down within the window.
    pub fn of_leg(&self, leg: usize) -> Vec<&Footstep> {
        let mine = |step: &&Footstep| step.leg == leg && self.window.contains(step.touch_down);
        self.footsteps.iter().filter(mine).collect()
    }

    fn chosen(&self, choice: &LegChoice) -> Vec<usize> {
        let chosen = |leg: &LegFact| match choice {
            LegChoice::All => true,
            LegChoice::Fore => leg.fore,
            LegChoice::Hind => !leg.fore,
            LegChoice::Named(names) => names.iter().any(|name| name.value == leg.name),
        };
        let legs = self.legs.iter().enumerate();
        legs.filter(|(_, leg)| chosen(leg))
            .map(|(index, _)| index)
            .collect()
    }

    /// Every footstep's number is within limits; footsteps without a number do not count, but a leg must have one with.
    fn each(
        &self,
        legs: &[usize],
        limits: &Limits,
        number: impl Fn(&Footstep) -> Option<f64>,
    ) -> Finding {
        let of_leg = |leg: usize| {
            let steps = self.of_leg(leg).into_iter();
            steps
                .filter_map(|step| Some((*step, number(step)?)))
                .collect()
        };
        self.worst(legs, limits, of_leg)
    }

    /// As [`Gait::each`], for numbers of a footstep and the next one of the same leg.
    fn between(
        &self,
        legs: &[usize],
        limits: &Limits,
        number: impl Fn(&Footstep, &Footstep) -> Option<f64>,
    ) -> Finding {
        let of_leg = |leg: usize| {
            let steps = self.of_leg(leg);
            let pairs = steps.windows(2);
            pairs
                .filter_map(|pair| Some((*pair[0], number(pair[0], pair[1])?)))
                .collect()
        };
        self.worst(legs, limits, of_leg)
    }

    fn worst(
        &self,
        legs: &[usize],
        limits: &Limits,
        of_leg: impl Fn(usize) -> Vec<(Footstep, f64)>,
    ) -> Finding {
        let mut worst: Option<(Finding, f64)> = None;
        let mut first_violation = None;
        for &leg in legs {
            let steps = of_leg(leg);
            if steps.is_empty() {
                return self.no_footstep(leg);
            }
            for (step, number) in steps {
                let margin = limits.margin(number);
                let holds = margin >= 0.0;
                if !holds && first_violation.is_none_or(|first| step.touch_down < first) {
                    first_violation = Some(step.touch_down);
                }
                let worse = worst.as_ref().is_none_or(|(_, least)| {
                    margin.is_nan() || (!least.is_nan() && margin < *least)
                });
                if worse {
                    let detail = format!(
                        "worst: {} at {:.3} s",
                        self.legs[leg].name,
                        step.touch_down.as_secs_f64()
                    );
                    let finding = Finding::of(limits.compare(number, number), None, detail);
                    worst = Some((finding, margin));
                }
            }
        }
        match worst {
            Some((finding, _)) => Finding {
                first_violation,
                ..finding
            },
            None => Finding::unobserved("no footstep"),
        }
    }

    /// A number of all footsteps of a leg.
    fn per_leg(
        &self,
        legs: &[usize],
        limits: &Limits,
        number: impl Fn(&[&Footstep]) -> Option<f64>,
    ) -> Finding {
        let mut worst: Option<(Finding, f64)> = None;
        for &leg in legs {
            let steps = self.of_leg(leg);
            let Some(number) = number(&steps) else {
                return self.no_footstep(leg);
            };
            let margin = limits.margin(number);
            if worst
                .as_ref()
                .is_none_or(|(_, least)| margin.is_nan() || margin < *least)
            {
                let name = format!("worst: {}", self.legs[leg].name);
                let finding = Finding::of(limits.compare(number, number), None, name);
                worst = Some((finding, margin));
            }
        }
        worst.map_or_else(|| Finding::unobserved("no leg"), |(finding, _)| finding)
    }

    /// What is said about a leg that gives no number.
    pub fn no_footstep(&self, leg: usize) -> Finding {
        let steps = self.of_leg(leg).len();
        let name = &self.legs[leg].name;
        Finding::unobserved(match steps {
            0 => format!("{name} never touched down"),
            1 => format!("{name} touched down once"),
            steps => format!("{name} touched down {steps} times"),
        })
    }

    fn order(&self, groups: &[Vec<usize>]) -> Finding {
        let concerned = |leg: usize| groups.iter().position(|group| group.contains(&leg));
        let mut out_of_order = 0_u32;
        let mut first_violation = None;
        let mut total = 0_usize;
        // The group that is touching down, and who of it has.
        let mut current: Option<(usize, Vec<usize>)> = None;
        for step in self.footsteps {
            let (true, Some(group)) = (self.window.contains(step.touch_down), concerned(step.leg))
            else {
                continue;
            };
            total += 1;
            let in_order = match &mut current {
                None => true,
                Some((now, done)) if *now == group && !done.contains(&step.leg) => {
                    done.push(step.leg);
                    continue;
                }
                Some((now, done)) => {
                    group == (*now + 1) % groups.len() && done.len() == groups[*now].len()
                }
            };
            // The window may begin in the middle of a group: its first turn may be incomplete.
            let in_order = in_order || (total <= groups.iter().map(Vec::len).max().unwrap_or(1));
            if !in_order {
                out_of_order += 1;
                first_violation = first_violation.or(Some(step.touch_down));
            }
            current = Some((group, vec![step.leg]));
        }
        if total < 2 * groups.iter().map(Vec::len).sum::<usize>() {
            return Finding::unobserved(format!("{total} touch-downs are not two rounds"));
        }
        let count = f64::from(out_of_order);
        let detail = format!("of {total} touch-downs");
        Finding::of(
            Limits::at_most(0.0).compare(count, count),
            first_violation,
            detail,
        )
    }

    fn displacement(&self, legs: &[usize], axis: Axis, cycle: u32, limits: &Limits) -> Finding {
        let Some(reference) = self.reference else {
            return Finding::unobserved("there was no run without changes");
        };
        let of_leg = |leg: usize| -> Vec<(Footstep, f64)> {
            let moved = || {
                let (mine, theirs) = self.same_cycle(reference, leg, cycle)?;
                let moved = minus(mine.position, theirs.position);
                Some((*mine, along(axis, moved)))
            };
            moved().into_iter().collect()
        };
        let finding = self.worst(legs, limits, of_leg);
        if finding.verdict == Verdict::Unobserved {
            let detail = format!("cycle {cycle} is missing here or in the run without changes");
            return Finding::unobserved(detail);
        }
        finding
    }

    /// The footstep of `leg` in the cycle `cycle` of the reference run, counted from the window's start, and the one of
    /// this run that belongs to it: the nearest in time, within half a cycle. (Counting both runs' touch-downs would
    /// compare different cycles as soon as one of them stumbles.)
    fn same_cycle<'r>(
        &'r self,
        reference: &'r [Footstep],
        leg: usize,
        cycle: u32,
    ) -> Option<(&'r Footstep, &'r Footstep)> {
        let theirs: Vec<&Footstep> = reference
            .iter()
            .filter(|step| step.leg == leg && step.touch_down > self.window.after)
            .collect();
        let index = usize::try_from(cycle).ok()?.checked_sub(1)?;
        let step = *theirs.get(index)?;
        let beside = theirs
            .get(index + 1)
            .or_else(|| theirs.get(index.checked_sub(1)?))?;
        let stride = nanos_between(step, beside);
        let mine = self.footsteps.iter().filter(|step| step.leg == leg);
        let mine = mine.min_by_key(|mine| nanos_between(mine, step))?;
        (2 * nanos_between(mine, step) < stride).then_some((mine, step))
    }
}

fn nanos_between(a: &Footstep, b: &Footstep) -> u64 {
    a.touch_down.as_nanos().abs_diff(b.touch_down.as_nanos())
}

fn stance(step: &Footstep) -> Option<f64> {
    let lift_off = step.lift_off?;
    Some((lift_off - step.touch_down).as_secs_f64())
}

/// Mean over the cycles, touch-down to touch-down.
fn duty_factor(steps: &[&Footstep]) -> Option<f64> {
    let mut sum = 0.0;
    let mut cycles = 0_u32;
    for pair in steps.windows(2) {
        let cycle = (pair[1].touch_down - pair[0].touch_down).as_secs_f64();
        sum += stance(pair[0])? / cycle;
        cycles += 1;
    }
    (cycles > 0).then(|| sum / f64::from(cycles))
}

fn frequency(steps: &[&Footstep]) -> Option<f64> {
    let (first, last) = (steps.first()?, steps.last()?);
    let time = (last.touch_down - first.touch_down).as_secs_f64();
    (steps.len() > 1).then(|| (steps.len() - 1) as f64 / time)
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn along(axis: Axis, v: [f64; 3]) -> f64 {
    match axis {
        Axis::X => v[0],
        Axis::Y => v[1],
        Axis::Z => v[2],
        Axis::Horizontal => (v[0] * v[0] + v[1] * v[1]).sqrt(),
    }
}
