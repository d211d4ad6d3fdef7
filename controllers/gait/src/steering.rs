//! Steps to the side, of legs that abduct.

use std::f64::consts::PI;

use crate::FootLocus;
use crate::capture::{Shift, swing_share};
use crate::limb::Limb;
use crate::phases::Phases;

/// Motion that steps give the trunk besides that of the straight gait, and the servos of abduction.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Steering {
    /// Angle of abduction outwards at mid-stance \[rad\].
    pub(crate) splay: f64,
    /// Rate of yaw \[rad/s\].
    pub(crate) turn: f64,
    /// Velocity to the left \[m/s\].
    pub(crate) sidestep: f64,
    /// Half-width of the dead band of a servo \[rad\].
    pub(crate) dead_band: f64,
    /// Time by which a servo lags behind its command \[s\].
    pub(crate) lead: f64,
    /// Shift of feet that swing, to the left \[m\].
    pub(crate) capture_m: f64,
}

/// Place of a foot to the side, beside that of its steps.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LateralPlace {
    /// Constant, to the left of the place of `splay` \[m\].
    pub(crate) offset: f64,
    /// By the motion of the trunk.
    pub(crate) shift: Shift,
}

/// Target of a foot that steps to the side.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Placement {
    /// Command of abduction \[rad\].
    pub(crate) angle: f64,
    /// Target in the plane of the leg, from the hip \[m\].
    pub(crate) target: [f64; 2],
    /// Distance of the target from the stops of the joint, zero between them \[m\].
    pub(crate) beyond_m: f64,
}

impl Steering {
    /// Returns the placement of the foot of the leg with this index. Straight steps follow `locus`
    /// with `step_length`.
    #[inline(never)]
    pub(crate) fn placement(
        &self,
        leg: usize,
        limb: &Limb,
        phases: &impl Phases,
        locus: &FootLocus,
        step_length: f64,
        aside: LateralPlace,
    ) -> Placement {
        let (end, frequency) = (limb.corner.end(), phases.frequency());
        let stance_s = phases.stance_share(end) / frequency;
        // A foot that does not pass its cycle does not step.
        let stance_s = if stance_s.is_finite() { stance_s } else { 0.0 };
        let step = self.step(limb, locus.mid_stance(), aside, stance_s);
        let phase = phases.phase(leg, end);
        let locus = locus.with_step_length(step_length + step.lengthening);
        let [x, height] = locus.point(phase);
        let [angle, z] = limb.abducted(step.place(phase), height);
        let ahead = phases.phase_after(leg, end, self.lead);
        let [command, _] = limb.abducted(step.place(ahead), height);
        // A servo stops at the border of its dead band before the command.
        let command = command + step.direction(ahead) * frequency.signum() * self.dead_band;
        Placement {
            angle: limb.within_stops(command),
            target: [x, z],
            beyond_m: limb.beyond_stops(angle, z),
        }
    }

    /// Returns the step of a foot that is at [x, z] from the hip at mid-stance, and stands for a
    /// time \[s\].
    fn step(&self, limb: &Limb, [x, z]: [f64; 2], aside: LateralPlace, stance_s: f64) -> Step {
        let outwards = if limb.corner.left { 1.0 } else { -1.0 };
        let middle = limb.place_aside(outwards * self.splay, z) + aside.offset;
        let [hip_x, hip_y, _] = limb.hip;
        Step {
            middle,
            lengthening: -(self.turn * (hip_y + middle) * stance_s),
            width: (self.sidestep + self.turn * (hip_x + x)) * stance_s,
            shift: aside.shift,
        }
    }
}

/// Step of a foot.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Step {
    /// Place at mid-stance, to the left of its place with an upright leg \[m\].
    middle: f64,
    /// Length that turning adds, and width \[m\].
    lengthening: f64,
    width: f64,
    shift: Shift,
}

impl Step {
    /// Returns the place of the foot at phase Θ, to the left of its place with an upright leg
    /// \[m\]: in stance it moves at constant speed.
    fn place(&self, phase: f64) -> f64 {
        let half_turns = phase * (1.0 / PI);
        let share = if half_turns < 1.0 {
            swing_share(phase) - 0.5
        } else {
            1.5 - half_turns
        };
        self.middle + self.width * share + self.shift.at(phase)
    }

    /// Returns the direction in which the foot moves as phase Θ increases: 1 to the left, −1 to the
    /// right, 0 for a step without width.
    fn direction(&self, phase: f64) -> f64 {
        let way = if phase < PI {
            self.width + self.shift.change()
        } else {
            -self.width
        };
        if way == 0.0 { 0.0 } else { way.signum() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn feet_swing_from_rest_to_rest_between_the_ends_of_stance() {
        let step = Step {
            middle: 0.01,
            lengthening: 0.0,
            width: 0.04,
            shift: Shift::default(),
        };
        let ends = [0.0, PI, 2.0 * PI].map(|phase| step.place(phase));
        for (end, expected) in ends.into_iter().zip([-0.01, 0.03, -0.01]) {
            assert!((end - expected).abs() < 1e-15, "{end} {expected}");
        }
        let by = 1e-4;
        for (end, inner) in [(0.0, by), (PI, PI - by)] {
            // Of second order in the phase.
            let moved = step.place(inner) - step.place(end);
            assert!(moved.abs() < 0.04 * by * by, "{moved}");
        }
        assert_eq!([0.1, 4.0].map(|phase| step.direction(phase)), [1.0, -1.0]);
    }
}
