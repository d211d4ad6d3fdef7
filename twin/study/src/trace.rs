//! Where the feet and the trunk were, on the grid of a study.

use twinrig_kernel::{Direction, Layout, SimTime};
use twinrig_runtime::{Plant, PlantEvent, WorkCounts};

use crate::plant_run::{Ending, Go, PlantRun};

pub(crate) const TRUNK: &str = "body/position";
const FOOT: (&str, &str) = ("leg/", "/foot/position");

/// What was seen of a run.
#[derive(Clone, Debug)]
pub(crate) struct Trace {
    /// Times of the samples \[s\].
    pub(crate) at_s: Vec<f64>,
    /// Names of the signals of the feet.
    pub(crate) feet: Vec<String>,
    /// Where the feet were, sample by sample, foot by foot \[m\].
    feet_at: Vec<[f64; 3]>,
    /// Where the trunk was, sample by sample; empty if the plant does not tell \[m\].
    trunk_at: Vec<[f64; 3]>,
    /// So many samples are trusted, where this is what others are compared with.
    trusted: usize,
    /// The greatest energy stored, and the least of it that was not kinetic \[J\].
    stored_most: f64,
    resting_least: f64,
    /// Kinetic energy, sample by sample \[J\].
    pub(crate) kinetic: Vec<f64>,
    /// What the energy books lacked at the end \[J\].
    pub(crate) residual: f64,
    /// The greatest drift of the constraints \[m\].
    pub(crate) drift: Option<f64>,
    pub(crate) events: Vec<PlantEvent>,
    pub(crate) work: WorkCounts,
    /// How long it took, looking included \[s\].
    pub(crate) took_s: f64,
}

/// How far a trace is from another \[m\].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Errors {
    pub(crate) foot_rms: f64,
    pub(crate) foot_max: f64,
    /// None if one of the plants does not tell where its trunk is.
    pub(crate) trunk: Option<(f64, f64)>,
}

/// Whether a signal is where a foot is.
pub(crate) fn is_foot(name: &str) -> bool {
    name.starts_with(FOOT.0) && name.ends_with(FOOT.1)
}

/// Where what is compared lies among the outputs of a plant.
struct Places {
    feet: Vec<(String, usize)>,
    trunk: Option<usize>,
    outputs: Vec<f64>,
}

impl Places {
    fn of(plant: &dyn Plant) -> Self {
        let ports = plant.ports();
        let layout = Layout::of(&ports, Direction::Output);
        let vectors = || layout.fields().filter(|field| field.port.size == 3);
        let feet = vectors().filter(|field| is_foot(&field.port.name));
        let trunk = vectors().find(|field| field.port.name == TRUNK);
        Self {
            feet: feet
                .map(|field| (field.port.name.clone(), field.offset))
                .collect(),
            trunk: trunk.map(|field| field.offset),
            outputs: vec![0.0; layout.len()],
        }
    }
}

impl Trace {
    /// Of what somebody else saw: where feet and trunk were, sample by sample, foot by foot.
    pub(crate) fn seen(
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
            trunk_at: Vec::new(),
            trusted: usize::MAX,
            stored_most: f64::NEG_INFINITY,
            resting_least: f64::INFINITY,
            kinetic: Vec::new(),
            residual: 0.0,
            drift: None,
            events: Vec::new(),
            work: WorkCounts::default(),
            took_s: 0.0,
        }
    }

    /// Leads `plant` through a scene and sees where it goes. `enough` is asked with the kinetic energy at every sample and
    /// ends the run if it says so.
    pub(crate) fn record(
        plant: &mut dyn Plant,
        plant_run: &PlantRun<'_>,
        mut enough: impl FnMut(f64) -> bool,
    ) -> (Self, Ending) {
        let mut places = Places::of(plant);
        let mut trace = Self {
            feet: places.feet.iter().map(|(name, _)| name.clone()).collect(),
            ..Self::empty()
        };
        plant.log_events(true);
        let watch = crate::stopwatch::Stopwatch::start();
        let ending = plant_run.lead(plant, |now, plant| {
            trace.look(now, plant, &mut places, &mut enough)
        });
        trace.took_s = watch.elapsed_s();
        trace.residual = plant.energy().residual;
        trace.events = plant.events().to_vec();
        trace.work = plant.work();
        plant.log_events(false);
        (trace, ending)
    }

    fn look(
        &mut self,
        now: SimTime,
        plant: &mut dyn Plant,
        places: &mut Places,
        enough: &mut impl FnMut(f64) -> bool,
    ) -> Go {
        plant.observe(&mut places.outputs);
        let energy = plant.energy();
        let kinetic = energy.kinetic;
        if !kinetic.is_finite() || places.outputs.iter().any(|output| !output.is_finite()) {
            return Go::NotFinite;
        }
        let place = |offset: usize| {
            let outputs = &places.outputs;
            [outputs[offset], outputs[offset + 1], outputs[offset + 2]]
        };
        self.at_s.push(now.as_secs_f64());
        self.feet_at
            .extend(places.feet.iter().map(|&(_, offset)| place(offset)));
        self.trunk_at.extend(places.trunk.map(place));
        self.kinetic.push(kinetic);
        self.stored_most = self.stored_most.max(energy.stored());
        self.resting_least = self.resting_least.min(energy.stored() - kinetic);
        self.drift = match (self.drift, plant.constraint_violation()) {
            (Some(a), Some(b)) => Some(a.max(b)),
            (a, b) => a.or(b),
        };
        if enough(kinetic) { Go::Enough } else { Go::On }
    }

    /// Simulated time reached \[s\].
    pub(crate) fn reached_s(&self) -> f64 {
        self.at_s.last().copied().unwrap_or(0.0)
    }

    /// The greatest kinetic energy \[J\].
    pub(crate) fn kinetic_peak(&self) -> f64 {
        self.kinetic.iter().copied().fold(0.0, f64::max)
    }

    /// What its kinetic energy could have come to between samples: all that was stored less what was not given up \[J\].
    pub(crate) fn kinetic_bound(&self) -> f64 {
        self.kinetic_peak()
            .max(self.stored_most - self.resting_least)
    }

    /// The greatest kinetic energy in each quarter of the time up to `end_s` \[J\].
    pub(crate) fn kinetic_by_quarter(&self, end_s: f64) -> [f64; 4] {
        let mut peaks = [0.0_f64; 4];
        let until = self.at_s.partition_point(|&at| at <= end_s * (1.0 + 1e-9));
        for (&at, &kinetic) in self.at_s[..until].iter().zip(&self.kinetic) {
            let quarter = (1..4).filter(|&n| 4.0 * at >= f64::from(n) * end_s).count();
            peaks[quarter] = peaks[quarter].max(kinetic);
        }
        peaks
    }

    /// Compares nothing with what is after the first sample at which a foot or the trunk is further than `apart_m` from
    /// where it is in `other`, which was sampled on the same grid. The time of the last sample before, if there is one \[s\].
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

    /// Takes that back.
    pub(crate) fn trust_all(&mut self) {
        self.trusted = usize::MAX;
    }

    /// The time up to which it is compared with others \[s\].
    pub(crate) fn trusted_s(&self) -> f64 {
        let last = self.trusted.min(self.at_s.len()).checked_sub(1);
        last.map_or(0.0, |last| self.at_s[last])
    }

    /// The discontinuities up to then.
    pub(crate) fn events_until(&self, until_s: f64) -> &[PlantEvent] {
        let count = self.events.partition_point(|event| event.at_s <= until_s);
        &self.events[..count]
    }

    /// How far this is from `reference`, which was sampled on the same grid, as far as both go; none if they have no foot in
    /// common.
    pub(crate) fn errors(&self, reference: &Self) -> Option<Errors> {
        let samples = self.at_s.len().min(reference.at_s.len());
        let samples = samples.min(reference.trusted);
        self.errors_against(reference, (0..samples).map(|n| Some((n, Stencil::at(n)))))
    }

    /// The same where the samples of `reference` are evenly spaced and between those of this: it is interpolated by cubics.
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
        let mut foot = Spread::default();
        let mut trunk = Spread::default();
        for (own, stencil) in &pairs {
            for &(foot_own, foot_other) in &feet {
                let a = self.feet_at[own * self.feet.len() + foot_own];
                let b = stencil.of(|n| reference.feet_at[n * reference.feet.len() + foot_other]);
                foot.add(distance(a, b));
            }
            if !self.trunk_at.is_empty() && !reference.trunk_at.is_empty() {
                let b = stencil.of(|n| reference.trunk_at[n]);
                trunk.add(distance(self.trunk_at[*own], b));
            }
        }
        Some(Errors {
            foot_rms: foot.rms(),
            foot_max: foot.max,
            trunk: (trunk.count > 0).then(|| (trunk.rms(), trunk.max)),
        })
    }
}

/// Four neighbouring samples and their weights.
#[derive(Clone, Copy, Debug)]
struct Stencil {
    first: usize,
    weights: [f64; 4],
}

impl Stencil {
    /// A sample itself.
    fn at(n: usize) -> Self {
        Self {
            first: n,
            weights: [1.0, 0.0, 0.0, 0.0],
        }
    }

    /// Lagrange's cubic through the samples around `at_s`; none beyond the last.
    fn between(times: &[f64], at_s: f64) -> Option<Self> {
        let count = times.len();
        if count < 4 || at_s > times[count - 1] * (1.0 + 1e-12) {
            return None;
        }
        let spacing = times[1] - times[0];
        let after = times.partition_point(|&time| time <= at_s);
        let first = after.saturating_sub(2).min(count - 4);
        let x = (at_s - times[first]) / spacing;
        let weight = |n: usize| {
            let others = (0..4).filter(|&m| m != n);
            others
                .map(|m| (x - m as f64) / (n as f64 - m as f64))
                .product()
        };
        Some(Self {
            first,
            weights: [weight(0), weight(1), weight(2), weight(3)],
        })
    }

    fn of(&self, value: impl Fn(usize) -> [f64; 3]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (n, &weight) in self.weights.iter().enumerate() {
            if weight != 0.0 {
                let value = value(self.first + n);
                for (sum, value) in sum.iter_mut().zip(value) {
                    *sum += weight * value;
                }
            }
        }
        sum
    }
}

/// Mean square and greatest of some distances.
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
    fn a_cubic_is_interpolated_exactly_and_nothing_beyond_the_last_sample() {
        let times: Vec<f64> = (0..8).map(|n| 0.5 * f64::from(n)).collect();
        let cubic = |x: f64| 1.0 - 2.0 * x + x * x * x;
        for at in [0.0, 0.1, 0.7, 2.3, 3.4, 3.5] {
            let stencil = Stencil::between(&times, at).unwrap();
            let [value, ..] = stencil.of(|n| [cubic(times[n]), 0.0, 0.0]);
            assert!((value - cubic(at)).abs() < 1e-12, "{at}: {value}");
        }
        assert!(Stencil::between(&times, 3.6).is_none());
    }
}
