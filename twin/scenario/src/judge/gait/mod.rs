//! Statistics for one expectation of the gait as a whole, updated sample by sample without
//! allocation.

mod contacts;
mod cycles;
mod mismatch;
mod transport;
mod work;

use twinrig_kernel::{SimTime, signal};
use twinrig_runtime::Group;

use super::Layouts;
use super::footstep::{Footstep, Thresholds};
use super::outcome::Finding;
use super::tracker::Extremes;
use crate::gait::{Fitness, FitnessScales, FitnessTerms, GaitClaim, GaitMeasure};
use crate::scene::{Scene, foot_load};
use contacts::Contacts;
use cycles::Cycles;
use mismatch::{Mismatch, Phase};
use transport::Passage;
pub(super) use transport::Transport;
pub(super) use work::Work;

/// Statistics of a gait.
#[derive(Clone, Debug)]
pub(super) struct GaitMeter {
    claim: GaitClaim,
    /// Index of the roll; pitch and yaw follow.
    roll: usize,
    contacts: Contacts,
    mismatch: Option<Mismatch>,
    transport: Transport,
    cycles: Cycles,
    rolls: Extremes,
    pitches: Extremes,
    /// Sum of the slips of all footsteps \[m\].
    slip: f64,
    /// Time without a contact \[s\].
    flight: f64,
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
        let observed = |name: &str| layouts.find(name).ok_or_else(|| missing(name));
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
        let work = (claim.measure == GaitMeasure::CostOfTransport)
            .then(|| Work::of_legs(legs(), |name| together(name)));
        let roll = together(signal::BODY_RPY)?;
        let meter = Self {
            transport: Transport::new(position.start, roll + 2, work.transpose()?),
            roll,
            contacts: Contacts::new(loads, thresholds),
            mismatch: mismatch.transpose()?,
            cycles: Cycles::default(),
            rolls: Extremes::default(),
            pitches: Extremes::default(),
            slip: 0.0,
            flight: 0.0,
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
        let [roll, pitch] = [0, 1].map(|axis| values[self.roll + axis]);
        let Passage {
            elapsed,
            speed,
            height,
        } = self.transport.sample(now, values);
        self.rolls.add(now, roll);
        self.pitches.add(now, pitch);
        self.contacts.sample(values);
        if !self.contacts.any() {
            self.flight += elapsed;
        }
        if let Some(mismatch) = &mut self.mismatch {
            mismatch.sample(now, elapsed, self.contacts.all());
        }
        // The first observation has no speed.
        if first_leg.touched_down && elapsed > 0.0 {
            self.cycles.propose(now, [height, roll, pitch, speed]);
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
        let Some(path) = self.transport.path() else {
            return Finding::unobserved("there is no observation in its window");
        };
        let non_finite_at = self.rolls.non_finite_at.or(self.pitches.non_finite_at);
        let non_finite_at = non_finite_at.or(path.non_finite_at());
        if non_finite_at.is_some() {
            return Finding::not_a_number(non_finite_at);
        }
        let (measured, detail) = match self.claim.measure {
            GaitMeasure::Fitness(scales) => self.fitness(survived, &scales),
            GaitMeasure::Mismatch => (self.mismatch_share(), String::new()),
            GaitMeasure::Slip => (Some(self.slip), String::new()),
            GaitMeasure::FlightShare => {
                (Some(self.flight / self.transport.observed()), String::new())
            }
            GaitMeasure::CostOfTransport | GaitMeasure::Froude | GaitMeasure::Strouhal => {
                let number = match self.claim.measure {
                    GaitMeasure::Froude => self.transport.froude(),
                    GaitMeasure::Strouhal => self.transport.strouhal(self.cycles.frequency()),
                    _ => self.transport.cost(self.weight),
                };
                match number {
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

    fn mismatch_share(&self) -> Option<f64> {
        self.mismatch.as_ref().and_then(Mismatch::share)
    }

    fn fitness(&self, survived: f64, scales: &FitnessScales) -> (Option<f64>, String) {
        let Some(mismatch) = self.mismatch_share() else {
            return (None, String::new());
        };
        let terms = FitnessTerms {
            speed: self.transport.speed(),
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
