//! The plant of the rig: signals, steps, faults and snapshots.

use std::ops::Range;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig_legged::{Ledger, Stored};
use twinrig_runtime::interrupt::LongLoop;
use twinrig_runtime::{EnergyBalance, Plant, PlantFault, WorkCounts};

use mujoco_rs::prelude::MjtDisableBit;

use crate::engine::{Engine, EngineFault};
use crate::model_file::contact::Mean;
use crate::model_file::source::{OutputSource, Source};

/// Limit of the energy gain by dampers, above which the step is too long, as a share of the energy
/// exchanged, or of a joule if that is more.
const GAIN_SHARE: f64 = 0.05;

/// A plant from any MuJoCo model.
///
/// After every [`Plant::advance`], all quantities that MuJoCo derives from the state are those of
/// the present state.
pub struct Mjcf {
    engine: Engine,
    now: SimTime,
    step: SimDuration,
    /// Step for which the present forces were computed \[s\]; none if they belong to an earlier
    /// state.
    forces_step: Option<f64>,
    ports: Vec<Port>,
    inputs: Vec<Range<usize>>,
    initial_inputs: Vec<f64>,
    outputs: Vec<(OutputSource, usize)>,
    means: Vec<Mean>,
    /// Time integrals of the means over the window.
    sums: Vec<f64>,
    window_start: SimTime,
    ledger: Ledger,
    /// Present values of the means.
    rates: Vec<f64>,
    /// Generalised forces of actuators, dampers and constraints at the beginning of the step, and
    /// velocities.
    forces: [Vec<f64>; 3],
    qvel: Vec<f64>,
}

/// Saved state.
#[derive(Serialize, Deserialize)]
struct Saved {
    now: SimTime,
    window_start: SimTime,
    forces_step: Option<f64>,
    sums: Vec<f64>,
    ledger: Ledger,
    state: Vec<f64>,
}

impl Mjcf {
    /// Builds the plant from an engine with computed forces.
    pub(crate) fn new(
        engine: Engine,
        step: SimDuration,
        inputs: Vec<(Port, Range<usize>)>,
        outputs: Vec<(Port, OutputSource)>,
    ) -> Self {
        let controls = |range: &Range<usize>| engine.data().ctrl()[range.clone()].to_vec();
        let initial_inputs = inputs.iter().flat_map(|(_, range)| controls(range));
        let initial_inputs: Vec<f64> = initial_inputs.collect();
        let means = outputs
            .iter()
            .filter_map(|(_, source_of_output)| match source_of_output {
                OutputSource::Model(Source::Mean(mean)) => Some(mean.clone()),
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
            forces_step: None,
            ports,
            inputs,
            initial_inputs,
            outputs: outputs
                .map(|(port, source_of_output)| (source_of_output, port.size))
                .collect(),
            means,
            sums: vec![0.0; numbers],
            window_start: SimTime::ZERO,
            ledger: Ledger::default(),
            rates: vec![0.0; numbers],
            forces: std::array::from_fn(|_| vec![0.0; dofs]),
            qvel: vec![0.0; dofs],
            engine,
        };
        plant.ledger = Ledger::opened(plant.stored());
        plant
    }

    /// Returns kinetic, spring and gravity energy of the state of the last force computation \[J\].
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

    /// Computes the forces of the present state for a step of `seconds`, if they are not up to
    /// date.
    fn update_forces(&mut self, seconds: f64) -> Result<(), EngineFault> {
        if self.forces_step == Some(seconds) {
            return Ok(());
        }
        self.engine.set_timestep(seconds);
        self.engine.forward()?;
        self.forces_step = Some(seconds);
        let stored = self.stored();
        self.ledger.close_step(stored);
        Ok(())
    }

    fn step_to(&mut self, next: SimTime) -> Result<(), EngineFault> {
        let seconds = (next - self.now).as_secs_f64();
        self.update_forces(seconds)?;
        self.record_forces();
        self.forces_step = None;
        self.engine.integrate(seconds)?;
        for (sum, rate) in self.sums.iter_mut().zip(&self.rates) {
            *sum += seconds * rate;
        }
        let after = self.engine.data().qvel();
        // Second order for constant inertia: the work of a constant force is force times mean
        // velocity.
        let mean = |i: usize| 0.5 * (self.qvel[i] + after[i]);
        let work = |force: &[f64]| -> f64 {
            let terms = force.iter().enumerate();
            seconds * terms.map(|(i, force)| force * mean(i)).sum::<f64>()
        };
        let [actuator, damper, constraint] = [0, 1, 2].map(|i| work(&self.forces[i]));
        self.ledger.actuator += actuator;
        self.ledger.dissipated -= damper;
        self.ledger.impact -= constraint;
        self.now = next;
        Ok(())
    }

    /// Stores the values at the beginning of the step, which some integrators overwrite.
    fn record_forces(&mut self) {
        let data = self.engine.data();
        let mut remaining = self.rates.as_mut_slice();
        for mean in &self.means {
            let (front, back) = remaining.split_at_mut(mean.size());
            mean.write(data, front);
            remaining = back;
        }
        self.qvel.copy_from_slice(data.qvel());
        let [actuator, damper, constraint] = &mut self.forces;
        constraint.copy_from_slice(data.qfrc_constraint());
        for i in 0..self.qvel.len() {
            damper[i] = data.qfrc_damper()[i] + data.qfrc_fluid()[i];
            // The remaining passive force is gravity compensation, an external force.
            let remaining = data.qfrc_passive()[i] - data.qfrc_spring()[i] - damper[i];
            actuator[i] = data.qfrc_actuator()[i] + remaining;
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

    fn initial_inputs(&self, inputs: &mut [f64]) {
        inputs.copy_from_slice(&self.initial_inputs);
    }

    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        debug_assert_eq!(inputs.len(), self.initial_inputs.len());
        let mut remaining = inputs;
        for range in &self.inputs {
            let (front, back) = remaining.split_at(range.len());
            let control = &mut self.engine.data_mut().ctrl_mut()[range.clone()];
            if *control != *front {
                control.copy_from_slice(front);
                self.forces_step = None;
            }
            remaining = back;
        }
        let start = self.now;
        let (span, step) = ((to - start).as_nanos(), self.step.as_nanos());
        // The fewest steps of equal length.
        let steps = span.div_ceil(step);
        let mut seconds = self.step.as_secs_f64();
        let mut interruption = LongLoop::default();
        for k in 1..=steps {
            if interruption.is_interrupted() {
                return Err(PlantFault::interrupted(self, self.now));
            }
            let part = u128::from(span) * u128::from(k) / u128::from(steps);
            let next = start + SimDuration::from_nanos(u64::try_from(part).unwrap_or(span));
            seconds = (next - self.now).as_secs_f64();
            let completed = self.step_to(next);
            completed.map_err(|why| self.fault(&why))?;
        }
        let found = self.update_forces(seconds);
        found.map_err(|why| self.fault(&why))?;
        // Work of dampers is the initial force of the step times the mean velocity, and may be
        // negative. Soft constraints store energy: their work has no sign.
        let allowed = GAIN_SHARE * self.energy().exchanged.max(1.0);
        let checked = self.ledger.check_within([allowed, f64::INFINITY]);
        checked.map_err(|why| self.fault(&why))
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        let elapsed = (self.now - self.window_start).as_secs_f64();
        let balance = self.ledger.balance().values();
        let (mut remaining, mut sums) = (outputs, self.sums.as_slice());
        for (source_of_output, size) in &self.outputs {
            let (front, back) = remaining.split_at_mut(*size);
            match source_of_output {
                OutputSource::Energy(i) => front[0] = balance[*i],
                OutputSource::Model(Source::Mean(_)) => {
                    let (sum, others) = sums.split_at(*size);
                    for (out, sum) in front.iter_mut().zip(sum) {
                        *out = if elapsed > 0.0 { sum / elapsed } else { 0.0 };
                    }
                    sums = others;
                }
                OutputSource::Model(source) => source.write(self.engine.data(), front),
            }
            remaining = back;
        }
    }

    fn begin_window(&mut self) {
        self.sums.fill(0.0);
        self.window_start = self.now;
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

    /// Returns the largest penetration of a contact.
    fn constraint_violation(&self) -> Option<f64> {
        let contacts = self.engine.data().contact().iter();
        Some(contacts.map(|contact| -contact.dist).fold(0.0, f64::max))
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&Saved {
            now: self.now,
            window_start: self.window_start,
            forces_step: self.forces_step,
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
            return Err(other("this model with other outputs".to_owned()));
        }
        let restored = self.engine.restore(&saved.state);
        restored.map_err(|why| other(why.to_string()))?;
        self.now = saved.now;
        self.window_start = saved.window_start;
        self.sums = saved.sums;
        self.forces_step = None;
        let seconds = saved.forces_step.unwrap_or(self.step.as_secs_f64());
        let found = self.update_forces(seconds);
        // Computing the forces closes a step of the energy balance, which the saved ledger contains
        // already.
        self.ledger = saved.ledger;
        found.map_err(|why| other(why.to_string()))
    }
}
