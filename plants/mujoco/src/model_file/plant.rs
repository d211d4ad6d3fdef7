//! The plant as the rig sees it.

use std::ops::Range;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig_legged::{Ledger, Stored};
use twinrig_runtime::interrupt::LongLoop;
use twinrig_runtime::{EnergyBalance, Plant, PlantFault, WorkCounts};

use mujoco_rs::prelude::MjtDisableBit;

use crate::engine::{Engine, EngineFault};
use crate::model_file::bound::Written;
use crate::model_file::contact::Mean;
use crate::model_file::source::Source;

/// What dampers may be said to give, beyond which the step is too long, as a share of what was exchanged, or of a joule where
/// that is less.
const DAMPED: f64 = 0.05;

/// Any model in MuJoCo.
///
/// After every [`Plant::advance`], and so whenever somebody looks, all that MuJoCo derives from the state is that of the
/// present one.
pub struct Mjcf {
    engine: Engine,
    now: SimTime,
    step: SimDuration,
    /// The step that the forces at hand were found for \[s\]; none: they are those of a state before this one.
    found_for: Option<f64>,
    ports: Vec<Port>,
    inputs: Vec<Range<usize>>,
    first: Vec<f64>,
    outputs: Vec<(Written, usize)>,
    means: Vec<Mean>,
    /// Sums over the window of what is a mean, times time.
    sums: Vec<f64>,
    begun: SimTime,
    ledger: Ledger,
    /// What there is of the means now, and forces by degree of freedom: of actuators, dampers, constraints; velocities.
    rates: Vec<f64>,
    powers: [Vec<f64>; 3],
    qvel: Vec<f64>,
}

/// Everything the way ahead depends on.
#[derive(Serialize, Deserialize)]
struct Saved {
    now: SimTime,
    begun: SimTime,
    found_for: Option<f64>,
    sums: Vec<f64>,
    ledger: Ledger,
    state: Vec<f64>,
}

impl Mjcf {
    /// Of an engine whose forces are found.
    pub(crate) fn new(
        engine: Engine,
        step: SimDuration,
        inputs: Vec<(Port, Range<usize>)>,
        outputs: Vec<(Port, Written)>,
    ) -> Self {
        let controls = |range: &Range<usize>| engine.data().ctrl()[range.clone()].to_vec();
        let first = inputs.iter().flat_map(|(_, range)| controls(range));
        let first: Vec<f64> = first.collect();
        let means = outputs.iter().filter_map(|(_, written)| match written {
            Written::Of(Source::Mean(mean)) => Some(mean.clone()),
            _ => None,
        });
        let means: Vec<Mean> = means.collect();
        let numbers: usize = means.iter().map(Mean::size).sum();
        let dofs = engine.data().qvel().len();
        let (ins, inputs): (Vec<Port>, Vec<_>) = inputs.into_iter().unzip();
        let ports = outputs.iter().map(|(port, _)| port.clone());
        let ports = ins.into_iter().chain(ports).collect();
        let outputs = outputs.into_iter();
        let mut plant = Self {
            now: SimTime::ZERO,
            step,
            found_for: None,
            ports,
            inputs,
            first,
            outputs: outputs
                .map(|(port, written)| (written, port.size))
                .collect(),
            means,
            sums: vec![0.0; numbers],
            begun: SimTime::ZERO,
            ledger: Ledger::default(),
            rates: vec![0.0; numbers],
            powers: std::array::from_fn(|_| vec![0.0; dofs]),
            qvel: vec![0.0; dofs],
            engine,
        };
        plant.ledger = Ledger::opened(plant.stored());
        plant
    }

    /// Kinetic, spring and gravity energy of the state that forces were found for \[J\].
    fn stored(&self) -> Stored {
        let (model, data) = (self.engine.model(), self.engine.data());
        let [potential, kinetic] = *data.energy();
        let off = model.opt().disableflags & MjtDisableBit::mjDSBL_GRAVITY as i32 != 0;
        let [x, y, z] = if off { [0.0; 3] } else { model.opt().gravity };
        let bodies = model.body_mass().iter().zip(data.xipos());
        let gravity: f64 = bodies
            .map(|(mass, at)| -mass * (x * at[0] + y * at[1] + z * at[2]))
            .sum();
        [kinetic, potential - gravity, gravity]
    }

    /// Finds the forces of the present state, if they are not at hand, for a step of `seconds`.
    fn find(&mut self, seconds: f64) -> Result<(), EngineFault> {
        if self.found_for == Some(seconds) {
            return Ok(());
        }
        self.engine.set_timestep(seconds);
        self.engine.forward()?;
        self.found_for = Some(seconds);
        let stored = self.stored();
        self.ledger.close_step(stored);
        Ok(())
    }

    fn step_to(&mut self, next: SimTime) -> Result<(), EngineFault> {
        let seconds = (next - self.now).as_secs_f64();
        self.find(seconds)?;
        self.note();
        self.found_for = None;
        self.engine.integrate(seconds)?;
        for (sum, rate) in self.sums.iter_mut().zip(&self.rates) {
            *sum += seconds * rate;
        }
        let after = self.engine.data().qvel();
        // A force that is constant over a step works along its mean velocity, if inertia is constant, too: to second order.
        let mean = |i: usize| 0.5 * (self.qvel[i] + after[i]);
        let work = |force: &[f64]| -> f64 {
            let terms = force.iter().enumerate();
            seconds * terms.map(|(i, force)| force * mean(i)).sum::<f64>()
        };
        let [actuator, damped, held] = [0, 1, 2].map(|i| work(&self.powers[i]));
        self.ledger.actuator += actuator;
        self.ledger.dissipated -= damped;
        self.ledger.impact -= held;
        self.now = next;
        Ok(())
    }

    /// Keeps what the coming step is made with: some integrators put other numbers there.
    fn note(&mut self) {
        let data = self.engine.data();
        let mut rest = self.rates.as_mut_slice();
        for mean in &self.means {
            let (front, back) = rest.split_at_mut(mean.size());
            mean.write(data, front);
            rest = back;
        }
        self.qvel.copy_from_slice(data.qvel());
        let [actuator, damped, held] = &mut self.powers;
        held.copy_from_slice(data.qfrc_constraint());
        for i in 0..self.qvel.len() {
            damped[i] = data.qfrc_damper()[i] + data.qfrc_fluid()[i];
            // What else is passive, and no spring, is compensation of gravity: a force from outside.
            let rest = data.qfrc_passive()[i] - data.qfrc_spring()[i] - damped[i];
            actuator[i] = data.qfrc_actuator()[i] + rest;
        }
    }

    fn fault(&self, why: &impl ToString) -> PlantFault {
        PlantFault {
            time: self.now,
            part: "integrator".to_owned(),
            energy: self.energy().stored(),
            why: why.to_string(),
        }
    }
}

impl Plant for Mjcf {
    fn name(&self) -> &'static str {
        "mjcf"
    }

    fn ports(&self) -> Vec<Port> {
        self.ports.clone()
    }

    fn first_inputs(&self, inputs: &mut [f64]) {
        inputs.copy_from_slice(&self.first);
    }

    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        debug_assert_eq!(inputs.len(), self.first.len());
        let mut rest = inputs;
        for range in &self.inputs {
            let (front, back) = rest.split_at(range.len());
            let control = &mut self.engine.data_mut().ctrl_mut()[range.clone()];
            if *control != *front {
                control.copy_from_slice(front);
                self.found_for = None;
            }
            rest = back;
        }
        let start = self.now;
        let (span, step) = ((to - start).as_nanos(), self.step.as_nanos());
        // As few steps of one length as there is room for.
        let steps = span.div_ceil(step);
        let mut seconds = self.step.as_secs_f64();
        let mut turns = LongLoop::default();
        for k in 1..=steps {
            if turns.is_interrupted() {
                return Err(PlantFault::interrupted(self, self.now));
            }
            let part = u128::from(span) * u128::from(k) / u128::from(steps);
            let next = start + SimDuration::from_nanos(u64::try_from(part).unwrap_or(span));
            seconds = (next - self.now).as_secs_f64();
            let done = self.step_to(next);
            done.map_err(|why| self.fault(&why))?;
        }
        let found = self.find(seconds);
        found.map_err(|why| self.fault(&why))?;
        // A damper's force is that of a step's beginning, and works along its mean velocity.
        let checked = self
            .ledger
            .check_within(DAMPED * self.energy().exchanged.max(1.0));
        checked.map_err(|why| self.fault(&why))
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        let elapsed = (self.now - self.begun).as_secs_f64();
        let balance = self.ledger.balance();
        let (mut rest, mut sums) = (outputs, self.sums.as_slice());
        for (written, size) in &self.outputs {
            let (front, back) = rest.split_at_mut(*size);
            match written {
                Written::Energy(i) => front[0] = energies(&balance)[*i],
                Written::Of(Source::Mean(_)) => {
                    let (sum, others) = sums.split_at(*size);
                    for (out, sum) in front.iter_mut().zip(sum) {
                        *out = if elapsed > 0.0 { sum / elapsed } else { 0.0 };
                    }
                    sums = others;
                }
                Written::Of(source) => source.write(self.engine.data(), front),
            }
            rest = back;
        }
    }

    fn begin_window(&mut self) {
        self.sums.fill(0.0);
        self.begun = self.now;
    }

    fn energy(&self) -> EnergyBalance {
        self.ledger.balance()
    }

    fn work(&self) -> WorkCounts {
        let [steps, evaluations, solver_iterations] = self.engine.counts();
        WorkCounts {
            steps,
            evaluations,
            solver_iterations,
            ..WorkCounts::default()
        }
    }

    /// How deep the worst of the contacts is.
    fn constraint_violation(&self) -> Option<f64> {
        let contacts = self.engine.data().contact().iter();
        Some(contacts.map(|contact| -contact.dist).fold(0.0, f64::max))
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&Saved {
            now: self.now,
            begun: self.begun,
            found_for: self.found_for,
            sums: self.sums.clone(),
            ledger: self.ledger,
            state: self.engine.save(),
        })
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let saved: Saved = snapshot.read()?;
        let other = |found: String| SnapshotError::Mismatch {
            expected: "this model with these outputs".to_owned(),
            found,
        };
        if saved.sums.len() != self.sums.len() {
            return Err(other("the same with other outputs".to_owned()));
        }
        let restored = self.engine.restore(&saved.state);
        restored.map_err(|why| other(why.to_string()))?;
        self.now = saved.now;
        self.begun = saved.begun;
        self.sums = saved.sums;
        self.found_for = None;
        let seconds = saved.found_for.unwrap_or(self.step.as_secs_f64());
        let found = self.find(seconds);
        // Finding the forces strikes a balance, which the books have struck before.
        self.ledger = saved.ledger;
        found.map_err(|why| other(why.to_string()))
    }
}

const fn energies(balance: &EnergyBalance) -> [f64; 8] {
    [
        balance.kinetic,
        balance.spring,
        balance.gravity,
        balance.dissipated,
        balance.actuator,
        balance.impact,
        balance.exchanged,
        balance.residual,
    ]
}
