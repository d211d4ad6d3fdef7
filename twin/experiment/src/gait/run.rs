//! Footsteps of a run of a gait, as studies of gaits receive them.

use serde::{Deserialize, Serialize};

/// Contact of a foot with the ground.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FootContact {
    /// Index of the leg in [`GaitRun::legs`].
    pub leg: usize,
    /// Time of touch-down \[s\].
    pub touch_down_s: f64,
    /// Time of lift-off; none if the run ended before \[s\].
    pub lift_off_s: Option<f64>,
    /// Position of the foot at touch-down, world frame \[m\].
    pub position_m: [f64; 3],
    /// Integral of the load \[N·s\].
    pub impulse_n_s: f64,
    /// Distance that the foot slipped \[m\].
    pub slip_m: f64,
}

/// Trunk and feet at an instant.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MotionSample {
    /// Time \[s\].
    pub at_s: f64,
    /// Position of the trunk, x and y in the world frame \[m\].
    pub trunk_m: [f64; 2],
    /// Yaw of the trunk \[rad\].
    pub yaw_rad: f64,
    /// Horizontal path of all feet on the ground since the start \[m\].
    pub slip_m: f64,
}

/// Cycle of the loads of all legs; the `LoadCycle` of the judge defines it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeasuredCycle {
    /// Time of the mean load of the first leg \[s\].
    pub centre_s: f64,
    /// Period \[s\].
    pub period_s: f64,
    /// Phase of each leg as a share of the period; none if its load has no first harmonic.
    pub phases: Vec<Option<f64>>,
    /// Number of contacts of each leg, bounces included.
    pub contacts: Vec<f64>,
}

/// Phases of the oscillators of a controller at an instant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PhaseSample {
    /// Time \[s\].
    pub at_s: f64,
    /// Phase of each leg's oscillator \[rad\].
    pub phases_rad: Vec<f64>,
}

/// Footsteps of a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GaitRun {
    /// Names of the legs.
    pub legs: Vec<String>,
    /// Footsteps in order of touch-down; contacts with a short gap between them are one footstep.
    pub footsteps: Vec<FootContact>,
    /// Contacts in order of touch-down, each bounce by itself.
    pub contacts: Vec<FootContact>,
    /// Cycles of the loads, in order.
    pub cycles: Vec<MeasuredCycle>,
    /// Phases of the oscillators over time; empty if the controller does not output them.
    pub oscillators: Vec<PhaseSample>,
    /// Trunk and slip of the feet over time.
    pub motion: Vec<MotionSample>,
    /// Time of a fall \[s\].
    pub fell_at_s: Option<f64>,
    /// Time at which the run ended \[s\].
    pub end_s: f64,
}

impl GaitRun {
    /// Returns the footsteps of a leg before a fall.
    pub(crate) fn footsteps_of(&self, leg: usize) -> Vec<FootContact> {
        self.of(&self.footsteps, leg)
    }

    /// Returns the contacts of a leg before a fall.
    pub(crate) fn contacts_of(&self, leg: usize) -> Vec<FootContact> {
        self.of(&self.contacts, leg)
    }

    /// Returns the horizontal path of all feet on the ground in a span of time \[m\].
    pub fn slip_m(&self, [from_s, to_s]: [f64; 2]) -> f64 {
        self.slip_until(to_s) - self.slip_until(from_s)
    }

    /// Returns the slip since the start, linear between two samples.
    fn slip_until(&self, at_s: f64) -> f64 {
        let past = self.motion.partition_point(|sample| sample.at_s <= at_s);
        let Some(before) = past.checked_sub(1).map(|last| self.motion[last]) else {
            return 0.0;
        };
        let Some(after) = self.motion.get(past) else {
            return before.slip_m;
        };
        let share = (at_s - before.at_s) / (after.at_s - before.at_s);
        before.slip_m + share * (after.slip_m - before.slip_m)
    }

    fn of(&self, contacts: &[FootContact], leg: usize) -> Vec<FootContact> {
        let end_s = self.fell_at_s.unwrap_or(f64::INFINITY);
        let of_leg = contacts.iter().filter(|contact| contact.leg == leg);
        let mut found: Vec<FootContact> = of_leg
            .filter(|contact| contact.touch_down_s < end_s)
            .copied()
            .collect();
        found.sort_by(|a, b| a.touch_down_s.total_cmp(&b.touch_down_s));
        found
    }
}

/// Returns the median; none without values.
pub(crate) fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let middle = values.get(values.len() / 2).copied()?;
    if values.len() % 2 == 1 {
        return Some(middle);
    }
    Some(f64::midpoint(values[values.len() / 2 - 1], middle))
}
