//! Load of pushes at one instant, and over a step.

use std::ops::{Add, Mul, Sub};

use crate::LEGS;
use crate::push::PushShape;

/// Load on trunk and feet at one instant, world axes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ExternalLoad {
    /// Force on the trunk \[N\].
    pub force: [f64; 3],
    /// Torque on the trunk, without that of forces beside its centre of mass \[N·m\].
    pub torque: [f64; 3],
    /// Σ p fᵀ of the forces f on the trunk at p, in trunk axes from its centre of mass \[N·m\].
    pub moment: [[f64; 3]; 3],
    /// Forces on the feet \[N\].
    pub feet: [[f64; 3]; LEGS],
}

impl ExternalLoad {
    /// Returns force and torque on the trunk about its centre of mass, trunk axes; `rotation` is
    /// that from trunk to world, `of` converts to its number type.
    #[inline]
    pub fn wrench<T>(&self, rotation: &[[T; 3]; 3], of: impl Fn(f64) -> T) -> [T; 6]
    where
        T: Copy + Add<Output = T> + Sub<Output = T> + Mul<Output = T>,
    {
        let [x, y, z] = in_trunk(rotation, self.force.map(&of));
        let [roll, pitch, yaw] = in_trunk(rotation, self.torque.map(&of));
        // Row j is Σ pⱼ f, in trunk axes.
        let [px, py, pz] = self.moment.map(|row| in_trunk(rotation, row.map(&of)));
        let roll = roll + (py[2] - pz[1]);
        let pitch = pitch + (pz[0] - px[2]);
        let yaw = yaw + (px[1] - py[0]);
        [x, y, z, roll, pitch, yaw]
    }

    /// Adds `share` times the peak of a pulse.
    pub(crate) fn add(&mut self, pulse: &Pulse, share: f64) {
        let value = pulse.peak.map(|peak| share * peak);
        let sum = match pulse.target {
            PulseTarget::Trunk(point) => {
                for (row, p) in self.moment.iter_mut().zip(point) {
                    add(row, value.map(|force| p * force));
                }
                &mut self.force
            }
            PulseTarget::TrunkTorque => &mut self.torque,
            PulseTarget::Foot(leg) => &mut self.feet[leg],
        };
        add(sum, value);
    }
}

fn add(sum: &mut [f64; 3], value: [f64; 3]) {
    for (sum, value) in sum.iter_mut().zip(value) {
        *sum += value;
    }
}

/// Transforms a vector from world to trunk axes.
fn in_trunk<T>(rotation: &[[T; 3]; 3], world: [T; 3]) -> [T; 3]
where
    T: Copy + Add<Output = T> + Mul<Output = T>,
{
    std::array::from_fn(|i| {
        rotation[0][i] * world[0] + rotation[1][i] * world[1] + rotation[2][i] * world[2]
    })
}

/// Part of a push within a step.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Pulse {
    pub(crate) target: PulseTarget,
    pub(crate) shape: PushShape,
    pub(crate) peak: [f64; 3],
    pub(crate) duration_s: f64,
    /// Time from the begin of the push to that of the step \[s\].
    pub(crate) elapsed_s: f64,
}

/// Target of a pulse.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum PulseTarget {
    Trunk([f64; 3]),
    TrunkTorque,
    Foot(usize),
}

impl Pulse {
    /// Returns the share of the duration at a time of the step.
    fn share(&self, seconds: f64) -> f64 {
        (self.elapsed_s + seconds) / self.duration_s
    }
}

/// Load of pushes over a step, smooth in the time since the begin of the step.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StepLoad {
    pub(crate) pulses: Vec<Pulse>,
}

impl StepLoad {
    /// Returns whether nothing is pushed in the step.
    pub fn is_empty(&self) -> bool {
        self.pulses.is_empty()
    }

    /// Returns the load after some time \[s\].
    pub fn at(&self, seconds: f64) -> ExternalLoad {
        self.sum(|pulse| pulse.shape.value(pulse.share(seconds)))
    }

    /// Returns the mean load between two times \[s\].
    pub fn mean(&self, from: f64, to: f64) -> ExternalLoad {
        self.sum(|pulse| {
            let (from, to) = (pulse.share(from), pulse.share(to));
            if to > from {
                pulse.shape.integral(from, to) / (to - from)
            } else {
                pulse.shape.value(from)
            }
        })
    }

    fn sum(&self, share: impl Fn(&Pulse) -> f64) -> ExternalLoad {
        let mut load = ExternalLoad::default();
        for pulse in &self.pulses {
            load.add(pulse, share(pulse));
        }
        load
    }

    /// Becomes a copy of another load, in the same memory.
    pub fn copy_from(&mut self, other: &Self) {
        self.pulses.clone_from(&other.pulses);
    }
}
