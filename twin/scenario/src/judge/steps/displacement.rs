//! Displacement of footsteps from those of the run without changes.

use twinrig_kernel::SimTime;

use super::worst::Worst;
use crate::expect::Axis;
use crate::judge::footstep::Footstep;
use crate::limits::Limits;

/// Footstep of the run without changes that a displacement refers to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ReferenceStep {
    step: Footstep,
    /// Time to the adjacent footstep \[ns\].
    stride: u64,
}

/// One cycle of one leg, in this run and in the run without changes.
#[derive(Clone, Copy, Debug)]
pub(super) struct CycleOfLeg {
    /// Index of its touch-down after `after`, from 1.
    cycle: u64,
    after: SimTime,
    before: SimTime,
    /// Number of touch-downs after `after`.
    count: u64,
    /// Footsteps before, of and after the cycle.
    adjacent_steps: [Option<Footstep>; 3],
    /// Footstep of the run without changes.
    reference: Option<ReferenceStep>,
    /// Footstep of this run closest to it in time.
    nearest: Option<Footstep>,
}

impl CycleOfLeg {
    pub fn new(cycle: u32, after: SimTime, before: SimTime) -> Self {
        CycleOfLeg {
            cycle: u64::from(cycle),
            after,
            before,
            count: 0,
            adjacent_steps: [None; 3],
            reference: None,
            nearest: None,
        }
    }

    pub fn set_reference(&mut self, reference_step: Option<ReferenceStep>) {
        self.reference = reference_step;
    }

    /// Adds a footstep of the leg.
    pub fn add(&mut self, step: &Footstep) {
        if let Some(reference) = &self.reference {
            let time_offset = |step: &Footstep| nanos_between(step, &reference.step);
            if self
                .nearest
                .is_none_or(|nearest| time_offset(step) < time_offset(&nearest))
            {
                self.nearest = Some(*step);
            }
        }
        if step.touch_down > self.after {
            self.count += 1;
            // The first cycle has no predecessor.
            let index = (self.count + 1).checked_sub(self.cycle);
            let index = index.and_then(|index| usize::try_from(index).ok());
            if let Some(adjacent_steps) = index.and_then(|index| self.adjacent_steps.get_mut(index))
            {
                *adjacent_steps = Some(*step);
            }
        }
    }

    /// Returns the footstep of the cycle, if this is the run without changes.
    pub fn reference_step(&self) -> Option<ReferenceStep> {
        let [earlier, step, later] = self.adjacent_steps;
        let step = step.filter(|step| step.touch_down <= self.before)?;
        let neighbour = later.or(earlier)?;
        let stride = nanos_between(&step, &neighbour);
        Some(ReferenceStep { step, stride })
    }

    /// Returns the displacement of the footstep of this run that is closest in time to the
    /// reference footstep, within half a cycle. Counting the touch-downs of both runs would compare
    /// different cycles after a stumble.
    pub fn displacement(&self, axis: Axis, limits: &Limits) -> Worst {
        let mut worst = Worst::default();
        if let (Some(footstep), Some(reference)) = (self.nearest, self.reference)
            && 2 * nanos_between(&footstep, &reference.step) < reference.stride
        {
            let displacement = axis.along(minus(footstep.position, reference.step.position));
            worst.add(footstep.touch_down, displacement, limits);
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
