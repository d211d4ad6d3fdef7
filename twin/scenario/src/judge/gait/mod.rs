//! Statistics for one expectation of the gait as a whole, updated sample by sample without
//! allocation.

mod contacts;
mod cycles;
mod mismatch;
mod work;

use twinrig_kernel::{SimTime, signal};
use twinrig_runtime::Group;

use super::Layouts;
use super::footstep::{Footstep, Thresholds};
use super::outcome::Finding;
use super::resolve::find;
use super::tracker::{Extremes, seconds};
use super::trunk::PlanarPath;
use crate::expect::Along;
use crate::gait::{Fitness, FitnessScales, FitnessTerms, GaitClaim, GaitMeasure};
use crate::scene::{Scene, foot_load};
use contacts::Contacts;
use cycles::{Cycles, GRAVITY};
use mismatch::{Mismatch, Phase};
use work::Work;

/// Statistics of a gait.
#[derive(Clone, Debug)]
pub(super) struct GaitMeter {
    claim: GaitClaim,
    /// Index of x of the trunk's position; y and z follow.
    position: usize,
    /// Index of the roll; pitch and yaw follow.
    roll: usize,
    contacts: Contacts,
    mismatch: Option<Mismatch>,
    work: Option<Work>,
    cycles: Cycles,
    path: Option<PlanarPath>,
    rolls: Extremes,
    pitches: Extremes,
    /// Sum of the slips of all footsteps \[m\].
    slip: f64,
    /// Observed time, and time without a contact \[s\].
    observed: f64,
    flight: f64,
    /// Integral of the trunk's height over the observed time \[m·s\].
    heights: f64,
    last: Option<SimTime>,
    weight: f64,
}

/// Touch-down of the first leg, which begins a cycle. Its impulse confirms it at an observation
/// that depends on the load, by which states of the trunk cannot be compared.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct FirstLeg {
    /// Whether it touches down in this observation, if that is confirmed.
    pub touched_down: bool,
    /// Whether this observation confirms its last touch-down.
    pub confirmed: bool,
}

impl GaitMeter {
    /// Returns the meter with the group of trunk and feet, or the reason for which the gait cannot
    /// be observed.
    pub fn new(
        claim: &GaitClaim,
        scene: &Scene,
        layouts: &Layouts<'_>,
        thresholds: Thresholds,
    ) -> Result<(Group, Self), String> {
        let missing = |name: &str| format!("there is no signal {name}");
        let observed = |name: &str| find(layouts, name).ok_or_else(|| missing(name));
        let (group, position) = observed(signal::BODY_POSITION)?;
        let together = |name: &str| match observed(name)? {
            (other, range) if other == group => Ok(range.start),
            _ => Err(format!("{name} is not observed together with the trunk")),
        };
        let legs = || scene.legs.iter().map(|leg| leg.name.as_str());
        let loads = legs().map(|leg| together(&foot_load(leg)));
        let loads: Vec<usize> = loads.collect::<Result<_, String>>()?;
        if loads.is_empty() {
            return Err("the scene has no legs".to_owned());
        }
        let mismatch = claim.measure.requires_phases().then(|| {
            let phases = legs().map(|leg| Phase::find(layouts, leg));
            phases.collect::<Result<_, String>>().map(Mismatch::new)
        });
        let work = (claim.measure == GaitMeasure::CostOfTransport).then(|| {
            let drives = legs().flat_map(|leg| {
                signal::DRIVES.map(|(angle, torque)| {
                    let index = |name| together(&signal::of_leg(leg, name));
                    Ok((index(angle)?, index(torque)?))
                })
            });
            drives.collect::<Result<_, String>>().map(Work::new)
        });
        let meter = Self {
            position: position.start,
            roll: together(signal::BODY_RPY)?,
            contacts: Contacts::new(loads, thresholds),
            mismatch: mismatch.transpose()?,
            work: work.transpose()?,
            cycles: Cycles::default(),
            path: None,
            rolls: Extremes::default(),
            pitches: Extremes::default(),
            slip: 0.0,
            observed: 0.0,
            flight: 0.0,
            heights: 0.0,
            last: None,
            weight: scene.weight,
            claim: claim.clone(),
        };
        Ok((group, meter))
    }

    /// Returns whether the meter evaluates samples of a group besides its own.
    pub fn reads(&self, group: Group) -> bool {
        self.mismatch.as_ref().is_some_and(|it| it.reads(group))
    }

    /// Returns whether a fall is a part of the measured value.
    pub fn includes_falls(&self) -> bool {
        self.claim.measure.includes_falls()
    }

    /// Takes the phases over, which are samples of another group.
    pub fn phases(&mut self, now: SimTime, group: Group, values: &[f64]) {
        if let Some(mismatch) = &mut self.mismatch {
            mismatch.phases(now, group, values);
        }
    }

    /// Evaluates an observation of trunk and feet within the window.
    pub fn sample(&mut self, now: SimTime, values: &[f64], first_leg: FirstLeg) {
        let [x, y, z] = [0, 1, 2].map(|axis| values[self.position + axis]);
        let [roll, pitch, yaw] = [0, 1, 2].map(|axis| values[self.roll + axis]);
        let elapsed = self.last.map_or(0.0, |last| seconds(now - last));
        self.last = Some(now);
        self.observed += elapsed;
        self.heights += elapsed * z;
        self.rolls.add(now, roll);
        self.pitches.add(now, pitch);
        let path = self
            .path
            .get_or_insert_with(|| PlanarPath::new(now, [x, y], yaw));
        let speed = path.advance(now, [x, y]);
        self.contacts.sample(values);
        if !self.contacts.any() {
            self.flight += elapsed;
        }
        if let Some(mismatch) = &mut self.mismatch {
            mismatch.sample(now, elapsed, self.contacts.all());
        }
        if let Some(work) = &mut self.work {
            work.sample(values);
        }
        // The first observation has no speed.
        if first_leg.touched_down && elapsed > 0.0 {
            self.cycles.propose(now, [z, roll, pitch, speed]);
        }
    }

    /// Begins a cycle at the last touch-down of the first leg, if it is within the window.
    pub fn confirm_cycle(&mut self) {
        self.cycles.confirm();
    }

    /// Adds a completed footstep within the window.
    pub fn step(&mut self, step: &Footstep) {
        self.slip += step.slip;
    }

    /// Returns the finding. `survived`: time of a fall over that of the window's end.
    pub fn finding(&self, survived: f64) -> Finding {
        let Some(path) = self.path.as_ref().filter(|_| self.observed > 0.0) else {
            return Finding::unobserved("there is no observation in its window");
        };
        let non_finite_at = self.rolls.non_finite_at.or(self.pitches.non_finite_at);
        let non_finite_at = non_finite_at.or(path.non_finite_at());
        if non_finite_at.is_some() {
            return Finding::not_a_number(non_finite_at);
        }
        let (measured, detail) = match self.claim.measure {
            GaitMeasure::Fitness(scales) => self.fitness(path, survived, &scales),
            GaitMeasure::Mismatch => (self.mismatch_share(), String::new()),
            GaitMeasure::Slip => (Some(self.slip), String::new()),
            GaitMeasure::FlightShare => (Some(self.flight / self.observed), String::new()),
            GaitMeasure::CostOfTransport => {
                let distance = path.distance(Along::Heading);
                if distance <= 0.0 {
                    return Finding::unobserved("the robot did not advance");
                }
                let work = self.work.as_ref().map(Work::positive);
                let cost = work.map(|work| work / (self.weight * distance));
                (cost, String::new())
            }
            GaitMeasure::Froude | GaitMeasure::Strouhal => {
                match self.similarity(path.speed(Along::Heading).unwrap_or(0.0)) {
                    Ok(number) => (Some(number), String::new()),
                    Err(reason) => return Finding::unobserved(reason),
                }
            }
            GaitMeasure::CycleResidual => match self.cycles.residual() {
                Some(residual) => (Some(residual), self.cycles.detail()),
                None => return Finding::unobserved("there is no whole cycle in its window"),
            },
        };
        match measured {
            Some(value) if value.is_finite() => {
                Finding::of(self.claim.limits.compare(value, value), None, detail)
            }
            Some(_) => Finding::not_a_number(None),
            None => Finding::unobserved("no phase was observed"),
        }
    }

    /// Returns the Froude or the Strouhal number at a speed \[m/s\], or why there is none.
    fn similarity(&self, speed: f64) -> Result<f64, &'static str> {
        let height = self.heights / self.observed;
        if height <= 0.0 {
            return Err("the trunk is not above the ground");
        }
        if self.claim.measure == GaitMeasure::Froude {
            return Ok(speed * speed / (GRAVITY * height));
        }
        if speed <= 0.0 {
            return Err("the robot did not advance");
        }
        let frequency = self.cycles.frequency();
        let frequency = frequency.ok_or("there is no whole cycle in its window")?;
        Ok(frequency * height / speed)
    }

    fn mismatch_share(&self) -> Option<f64> {
        self.mismatch.as_ref().and_then(Mismatch::share)
    }

    fn fitness(
        &self,
        path: &PlanarPath,
        survived: f64,
        scales: &FitnessScales,
    ) -> (Option<f64>, String) {
        let Some(mismatch) = self.mismatch_share() else {
            return (None, String::new());
        };
        let terms = FitnessTerms {
            speed: path.speed(Along::Heading).unwrap_or(0.0),
            survived,
            mismatch,
            slip: self.slip,
            roll: self.rolls.range(),
            pitch: self.pitches.range(),
            residual: self.cycles.residual(),
        };
        let fitness = Fitness::of(&terms, scales);
        let (stage, value) = (fitness.stage, fitness.value);
        let detail = format!("stage {stage}, weighted speed {value:.3} m/s");
        (Some(fitness.number()), detail)
    }
}
