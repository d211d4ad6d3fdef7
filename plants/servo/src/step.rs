//! Steps of motor and arm within a period of the controller.

use twinrig_actuator::serial::Bridge;

use crate::model::{Model, State};
use crate::shaft::{Forces, Shaft};

/// Parts of a substep: a shaft turns round once and teeth part and meet; the bound is for one that
/// oscillates at rounding.
const EVENTS_MAX: usize = 6;

/// Works of a step \[J\].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Works {
    pub motor: f64,
    pub friction: f64,
}

impl Works {
    pub(crate) fn add(&mut self, forces: &Forces, turned: f64) {
        self.motor += forces.motor * turned;
        self.friction += forces.friction * turned.abs();
    }
}

/// A part of a substep.
pub(crate) struct Stepped {
    /// Duration \[s\].
    pub taken: f64,
    /// Current in its middle \[A\].
    pub current: f64,
}

/// Counts of a step.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Counts {
    pub steps: u64,
    pub events: u64,
}

impl Model {
    /// Advances by a period of the controller, or a part of it \[s\].
    pub(crate) fn advance(
        &self,
        bridge: Bridge,
        state: &mut State,
        seconds: f64,
    ) -> (Works, Counts) {
        let (mut works, mut counts) = (Works::default(), Counts::default());
        let step = seconds / f64::from(self.substeps);
        for _ in 0..self.substeps {
            self.substep(bridge, state, step, &mut works, &mut counts);
        }
        (works, counts)
    }

    /// Advances by a step of the midpoint rule, or by several if the shaft comes to rest, or teeth
    /// meet within it.
    fn substep(
        &self,
        bridge: Bridge,
        state: &mut State,
        seconds: f64,
        works: &mut Works,
        counts: &mut Counts,
    ) {
        let mut left = seconds;
        for _ in 0..EVENTS_MAX {
            if self.half_gap > 0.0 {
                self.part(bridge, state);
            }
            let stepped = if let Some(rate) = state.loose {
                Some(self.loose_step(bridge, state, rate, left, works))
            } else {
                self.joint_step(bridge, state, left, works)
            };
            let Some(Stepped { taken, current }) = stepped else {
                break;
            };
            counts.steps += 1;
            state.rise = self.winding.warmed(state.rise, current, taken);
            if taken == left {
                return;
            }
            counts.events += 1;
            left -= taken;
        }
        // After too many events motor and arm go on together, so that no time is lost.
        if let Some(rate) = state.loose {
            works.friction += self.meet(state, rate);
            if let Some(Stepped { taken, current }) = self.joint_step(bridge, state, left, works) {
                state.rise = self.winding.warmed(state.rise, current, taken);
                left -= taken;
            }
        }
        let current = self
            .winding
            .electric(bridge, state.rate, state.rise)
            .current;
        state.rise = self.winding.warmed(state.rise, current, left);
    }

    /// A step of motor and arm together, at most to where they come to rest. None where friction
    /// holds them.
    fn joint_step(
        &self,
        bridge: Bridge,
        state: &mut State,
        seconds: f64,
        works: &mut Works,
    ) -> Option<Stepped> {
        let shaft = Shaft::whole(self, bridge, state.rise);
        let direction = shaft.direction(state.angle, state.rate)?;
        let step = shaft.midpoint([state.angle, state.rate], direction, seconds);
        let turned = step.end[0] - state.angle;
        works.add(&step.forces, turned);
        [state.angle, state.rate] = step.end;
        Some(Stepped {
            taken: step.taken,
            current: step.forces.current,
        })
    }
}
