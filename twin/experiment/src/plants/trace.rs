//! Sampled positions of feet and trunk.

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Direction, Layout, SimTime, signal};
use twinrig_runtime::{Plant, PlantEvent, WorkCounts};

use crate::plants::frame::in_trunk;
use crate::plants::plant_run::{Ending, PlantRun, SampleVerdict};
use crate::plants::stencil::Stencil;

/// Samples and totals of a run.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Trace {
    /// Times of the samples \[s\].
    pub(crate) at_s: Vec<f64>,
    /// Names of the foot position signals.
    pub(crate) feet: Vec<String>,
    /// Foot positions, sample by sample, foot by foot \[m\].
    feet_at: Vec<[f64; 3]>,
    /// The same in the frame of the trunk; empty without attitude of the trunk \[m\].
    feet_in_trunk: Vec<[f64; 3]>,
    /// Trunk positions, sample by sample; empty if the plant has no such output \[m\].
    trunk_at: Vec<[f64; 3]>,
    /// Number of trusted samples, for a trace that is a reference.
    trusted: usize,
    /// Greatest stored energy, and least stored energy other than kinetic \[J\].
    stored_greatest: f64,
    nonkinetic_least: f64,
    /// Kinetic energy, sample by sample \[J\].
    pub(crate) kinetic: Vec<f64>,
    /// Residual of the energy balance at the end \[J\].
    pub(crate) residual: f64,
    /// Maximum constraint violation \[m\].
    pub(crate) violation: Option<f64>,
    pub(crate) events: Vec<PlantEvent>,
    pub(crate) least_substep_s: Option<f64>,
    pub(crate) work: WorkCounts,
    /// Run time, sampling included \[s\].
    pub(crate) run_s: f64,
}

/// Distance between two traces \[m\].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Errors {
    pub(crate) foot_rms: f64,
    pub(crate) foot_max: f64,
    /// Greatest RMS distance of a foot relative to its hip, in the frame of the trunk; `None`
    /// without the attitude of the trunk.
    pub(crate) foot_to_hip: Option<f64>,
    /// RMS and maximum; `None` if one of the plants has no trunk output.
    pub(crate) trunk: Option<(f64, f64)>,
}

/// Returns whether a signal is a foot position.
pub(crate) fn is_foot(name: &str) -> bool {
    signal::parse_leg(name).is_some_and(|(_, of_leg)| of_leg == signal::FOOT_POSITION)
}

/// Offsets of the compared signals in the output vector of a plant.
struct SignalOffsets {
    feet: Vec<(String, usize)>,
    trunk: Option<usize>,
    attitude: Option<usize>,
    outputs: Vec<f64>,
}

impl SignalOffsets {
    fn of(plant: &dyn Plant) -> Self {
        let ports = plant.ports();
        let layout = Layout::of(&ports, Direction::Output);
        let vectors = || layout.fields().filter(|field| field.port.size == 3);
        let feet = vectors().filter(|field| is_foot(&field.port.name));
        let attitude = layout
            .fields()
            .find(|field| field.port.name == signal::BODY_ORIENTATION && field.port.size == 4);
        let trunk = vectors().find(|field| field.port.name == signal::BODY_POSITION);
        Self {
            feet: feet
                .map(|field| (field.port.name.clone(), field.offset))
                .collect(),
            trunk: trunk.map(|field| field.offset),
            attitude: attitude.map(|field| field.offset),
            outputs: vec![0.0; layout.len()],
        }
    }
}

impl Trace {
    /// Creates a trace from given samples, ordered by sample, then by foot.
    pub(crate) fn from_samples(
        feet: Vec<String>,
        at_s: Vec<f64>,
        feet_at: Vec<[f64; 3]>,
        trunk_at: Vec<[f64; 3]>,
    ) -> Self {
        Self {
            at_s,
            feet,
            feet_at,
            trunk_at,
            ..Self::empty()
        }
    }

    fn empty() -> Self {
        Self {
            at_s: Vec::new(),
            feet: Vec::new(),
            feet_at: Vec::new(),
            feet_in_trunk: Vec::new(),
            trunk_at: Vec::new(),
            trusted: usize::MAX,
            stored_greatest: f64::MIN,
            nonkinetic_least: f64::MAX,
            kinetic: Vec::new(),
            residual: 0.0,
            violation: None,
            events: Vec::new(),
            work: WorkCounts::default(),
            least_substep_s: None,
            run_s: 0.0,
        }
    }

    /// Runs `plant` and records its samples. `stop` receives the kinetic energy at every sample and
    /// returns whether to end the run.
    pub(crate) fn record(
        plant: &mut dyn Plant,
        plant_run: &PlantRun<'_>,
        mut stop: impl FnMut(f64) -> bool,
    ) -> (Self, Ending) {
        let mut signals = SignalOffsets::of(plant);
        let mut trace = Self {
            feet: signals.feet.iter().map(|(name, _)| name.clone()).collect(),
            ..Self::empty()
        };
        plant.log_events(true);
        let stopwatch = crate::stopwatch::RunStopwatch::start();
        let ending = plant_run.run(plant, |now, plant| {
            trace.sample(now, plant, &mut signals, &mut stop)
        });
        trace.run_s = stopwatch.elapsed_s();
        trace.residual = plant.energy().residual;
        trace.events = plant.events().to_vec();
        trace.work = plant.work();
        trace.least_substep_s = plant.least_substep_s();
        plant.log_events(false);
        (trace, ending)
    }

    fn sample(
        &mut self,
        now: SimTime,
        plant: &mut dyn Plant,
        signals: &mut SignalOffsets,
        stop: &mut impl FnMut(f64) -> bool,
    ) -> SampleVerdict {
        plant.observe(&mut signals.outputs);
        let energy = plant.energy();
        let kinetic = energy.kinetic;
        if !kinetic.is_finite() || signals.outputs.iter().any(|output| !output.is_finite()) {
            return SampleVerdict::NotFinite;
        }
        let position = |offset: usize| {
            let outputs = &signals.outputs;
            [outputs[offset], outputs[offset + 1], outputs[offset + 2]]
        };
        self.at_s.push(now.as_secs_f64());
        self.feet_at
            .extend(signals.feet.iter().map(|&(_, offset)| position(offset)));
        self.trunk_at.extend(signals.trunk.map(position));
        if let (Some(trunk), Some(attitude)) = (signals.trunk, signals.attitude) {
            let attitude = core::array::from_fn(|n| signals.outputs[attitude + n]);
            let feet = signals.feet.iter();
            self.feet_in_trunk
                .extend(feet.map(|&(_, foot)| in_trunk(position(foot), position(trunk), attitude)));
        }
        self.kinetic.push(kinetic);
        self.stored_greatest = self.stored_greatest.max(energy.stored());
        self.nonkinetic_least = self.nonkinetic_least.min(energy.stored() - kinetic);
        self.violation = match (self.violation, plant.constraint_violation()) {
            (Some(a), Some(b)) => Some(a.max(b)),
            (a, b) => a.or(b),
        };
        if stop(kinetic) {
            SampleVerdict::Stop
        } else {
            SampleVerdict::Continue
        }
    }

    /// Returns the simulated time reached \[s\].
    pub(crate) fn reached_s(&self) -> f64 {
        self.at_s.last().copied().unwrap_or(0.0)
    }

    /// Returns the greatest sampled kinetic energy \[J\].
    pub(crate) fn kinetic_peak(&self) -> f64 {
        self.kinetic.iter().copied().fold(0.0, f64::max)
    }

    /// Returns an upper bound of the kinetic energy between samples: greatest stored energy less
    /// least stored energy other than kinetic \[J\].
    pub(crate) fn kinetic_bound(&self) -> f64 {
        self.kinetic_peak()
            .max(self.stored_greatest - self.nonkinetic_least)
    }

    /// Returns the greatest kinetic energy in each quarter of the time up to `end_s` \[J\].
    pub(crate) fn kinetic_by_quarter(&self, end_s: f64) -> [f64; 4] {
        let mut peaks = [0.0_f64; 4];
        let until = self.at_s.partition_point(|&at| at <= end_s * (1.0 + 1e-9));
        for (&at, &kinetic) in self.at_s[..until].iter().zip(&self.kinetic) {
            let quarter = (1..4).filter(|&n| 4.0 * at >= f64::from(n) * end_s).count();
            peaks[quarter] = peaks[quarter].max(kinetic);
        }
        peaks
    }

    /// Limits the trusted samples to those before the first at which a foot or the trunk is further
    /// than `apart_m` from its position in `other`, which has the same sampling instants. Returns
    /// the time of the last trusted sample if the trace is truncated \[s\].
    pub(crate) fn trust_while_near(&mut self, other: &Self, apart_m: f64) -> Option<f64> {
        let near = |n: &usize| {
            let errors = self.errors_against(other, core::iter::once(Some((*n, Stencil::at(*n)))));
            errors.is_some_and(|errors| {
                errors.foot_max <= apart_m && errors.trunk.is_none_or(|(_, max)| max <= apart_m)
            })
        };
        let samples = self.at_s.len().min(other.at_s.len());
        let count = (0..samples).take_while(near).count();
        self.trusted = count;
        (count < self.at_s.len()).then(|| self.trusted_s())
    }

    /// Removes this limit.
    pub(crate) fn trust_all(&mut self) {
        self.trusted = usize::MAX;
    }

    /// Returns the time of the last trusted sample \[s\].
    pub(crate) fn trusted_s(&self) -> f64 {
        let last = self.trusted.min(self.at_s.len()).checked_sub(1);
        last.map_or(0.0, |last| self.at_s[last])
    }

    /// Returns the events up to `until_s`.
    pub(crate) fn events_until(&self, until_s: f64) -> &[PlantEvent] {
        let count = self.events.partition_point(|event| event.at_s <= until_s);
        &self.events[..count]
    }

    /// Returns the distance from `reference`, which has the same sampling instants, over the common
    /// duration; `None` if the two have no foot in common.
    pub(crate) fn errors(&self, reference: &Self) -> Option<Errors> {
        let samples = self.at_s.len().min(reference.at_s.len());
        let samples = samples.min(reference.trusted);
        self.errors_against(reference, (0..samples).map(|n| Some((n, Stencil::at(n)))))
    }

    /// Returns the distance from `reference`, which has the same sampling instants, up to
    /// `until_s`.
    pub(crate) fn errors_until(&self, reference: &Self, until_s: f64) -> Option<Errors> {
        let samples = self.at_s.len().min(reference.at_s.len());
        let until = self.at_s.partition_point(|&at| at <= until_s);
        let samples = samples.min(until);
        self.errors_against(reference, (0..samples).map(|n| Some((n, Stencil::at(n)))))
    }

    /// Returns the distance from `reference` by cubic interpolation of its evenly spaced samples at
    /// the instants of this trace.
    pub(crate) fn errors_between(&self, reference: &Self) -> Option<Errors> {
        let known = &reference.at_s[..reference.at_s.len().min(reference.trusted)];
        let at = self.at_s.iter().enumerate();
        self.errors_against(
            reference,
            at.map(|(n, &at_s)| Some((n, Stencil::between(known, at_s)?))),
        )
    }

    fn errors_against(
        &self,
        reference: &Self,
        pairs: impl Iterator<Item = Option<(usize, Stencil)>>,
    ) -> Option<Errors> {
        let pairs: Vec<(usize, Stencil)> = pairs.flatten().collect();
        let feet: Vec<(usize, usize)> = self
            .feet
            .iter()
            .enumerate()
            .filter_map(|(own, name)| {
                let other = reference.feet.iter().position(|known| known == name)?;
                Some((own, other))
            })
            .collect();
        if feet.is_empty() || pairs.is_empty() {
            return None;
        }
        let has_hips = !self.feet_in_trunk.is_empty() && !reference.feet_in_trunk.is_empty();
        let mut to_hip = vec![Spread::default(); feet.len()];
        let mut foot = Spread::default();
        let mut trunk = Spread::default();
        for (own, stencil) in &pairs {
            for (&(foot_own, foot_other), to_hip) in feet.iter().zip(&mut to_hip) {
                let own = own * self.feet.len() + foot_own;
                let other = |n| n * reference.feet.len() + foot_other;
                let b = stencil.of(|n| reference.feet_at[other(n)]);
                foot.add(distance(self.feet_at[own], b));
                if has_hips {
                    let b = stencil.of(|n| reference.feet_in_trunk[other(n)]);
                    to_hip.add(distance(self.feet_in_trunk[own], b));
                }
            }
            if !self.trunk_at.is_empty() && !reference.trunk_at.is_empty() {
                let b = stencil.of(|n| reference.trunk_at[n]);
                trunk.add(distance(self.trunk_at[*own], b));
            }
        }
        Some(Errors {
            foot_rms: foot.rms(),
            foot_max: foot.max,
            foot_to_hip: has_hips.then(|| to_hip.iter().map(|foot| foot.rms()).fold(0.0, f64::max)),
            trunk: (trunk.count > 0).then(|| (trunk.rms(), trunk.max)),
        })
    }
}

/// Mean square and maximum of distances.
#[derive(Clone, Copy, Debug, Default)]
struct Spread {
    squares: f64,
    max: f64,
    count: usize,
}

impl Spread {
    fn add(&mut self, distance: f64) {
        self.squares += distance * distance;
        self.max = self.max.max(distance);
        self.count += 1;
    }

    fn rms(self) -> f64 {
        (self.squares / self.count.max(1) as f64).sqrt()
    }
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b));
    squares.sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_against_the_hip_is_that_of_the_worst_foot_without_the_trunk() {
        let feet = ["leg/LF/foot/position", "leg/RF/foot/position"].map(str::to_owned);
        let mut reference = Trace::from_samples(
            feet.into(),
            vec![0.0, 1.0],
            vec![[0.0; 3]; 4],
            vec![[0.0; 3]; 2],
        );
        reference.feet_in_trunk = vec![[0.0; 3]; 4];
        let mut moved = reference.clone();
        // All of it is moved by 1 m; the second foot by 3 mm and 4 mm within the trunk, too.
        moved.trunk_at = vec![[1.0, 0.0, 0.0]; 2];
        moved.feet_at = vec![[1.0, 0.0, 0.0]; 4];
        moved.feet_in_trunk[1] = [3e-3, 0.0, 0.0];
        moved.feet_in_trunk[3] = [0.0, 4e-3, 0.0];
        let errors = moved.errors(&reference).unwrap();
        let rms = (12.5e-6_f64).sqrt();
        assert!((errors.foot_to_hip.unwrap() - rms).abs() < 1e-15);
        assert_eq!((errors.foot_rms, errors.trunk), (1.0, Some((1.0, 1.0))));
        moved.feet_in_trunk.clear();
        assert_eq!(moved.errors(&reference).unwrap().foot_to_hip, None);
    }
}
