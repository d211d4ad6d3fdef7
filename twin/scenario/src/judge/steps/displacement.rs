//! How far footsteps stand from those of the run without changes.

use twinrig_kernel::SimTime;

use super::worst::Worst;
use crate::expect::Axis;
use crate::judge::footstep::Footstep;
use crate::limits::Limits;

/// A footstep of the run without changes that one of this run is compared with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::judge) struct Counterpart {
    step: Footstep,
    /// Time to the footstep beside it \[ns\].
    stride: u64,
}

/// One cycle of one leg, in this run and in the one without changes.
#[derive(Clone, Copy, Debug)]
pub(super) struct CycleOfLeg {
    /// Which touch-down after `after` it is, counted from 1.
    cycle: u64,
    after: SimTime,
    before: SimTime,
    /// How many were so far.
    count: u64,
    /// The touch-downs before it, of it and after it.
    around: [Option<Footstep>; 3],
    /// What it is compared with.
    with: Option<Counterpart>,
    /// The footstep that is nearest to that in time.
    nearest: Option<Footstep>,
}

impl CycleOfLeg {
    pub fn new(cycle: u32, after: SimTime, before: SimTime) -> Self {
        CycleOfLeg {
            cycle: u64::from(cycle),
            after,
            before,
            count: 0,
            around: [None; 3],
            with: None,
            nearest: None,
        }
    }

    pub fn compare_with(&mut self, counterpart: Option<Counterpart>) {
        self.with = counterpart;
    }

    /// Takes the footsteps of its leg.
    pub fn add(&mut self, step: &Footstep) {
        if let Some(with) = &self.with {
            let off = |step: &Footstep| nanos_between(step, &with.step);
            if self.nearest.is_none_or(|nearest| off(step) < off(&nearest)) {
                self.nearest = Some(*step);
            }
        }
        if step.touch_down > self.after {
            self.count += 1;
            // Of the first cycle there is none before.
            let place = (self.count + 1).checked_sub(self.cycle);
            let place = place.and_then(|place| usize::try_from(place).ok());
            if let Some(around) = place.and_then(|place| self.around.get_mut(place)) {
                *around = Some(*step);
            }
        }
    }

    /// As the run without changes: the footstep of the cycle.
    pub fn counterpart(&self) -> Option<Counterpart> {
        let [earlier, step, later] = self.around;
        let step = step.filter(|step| step.touch_down <= self.before)?;
        let beside = later.or(earlier)?;
        let stride = nanos_between(&step, &beside);
        Some(Counterpart { step, stride })
    }

    /// How far the footstep of this run that belongs to the counterpart, the nearest in time within
    /// half a cycle, stands from it. (Counting the touch-downs of both runs would compare different
    /// cycles as soon as one of them stumbles.)
    pub fn moved(&self, axis: Axis, limits: &Limits) -> Worst {
        let mut worst = Worst::default();
        if let (Some(mine), Some(with)) = (self.nearest, self.with)
            && 2 * nanos_between(&mine, &with.step) < with.stride
        {
            let moved = axis.along(minus(mine.position, with.step.position));
            worst.add(mine.touch_down, moved, limits);
        }
        worst
    }
}

fn nanos_between(a: &Footstep, b: &Footstep) -> u64 {
    a.touch_down.as_nanos().abs_diff(b.touch_down.as_nanos())
}

pub(super) fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}
