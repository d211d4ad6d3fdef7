use serde::{Deserialize, Serialize};
use thiserror::Error;
use twinrig_kernel::{
    Direction, Field, Layout, Port, SignalKind, SimDuration, SimTime, Snapshot, SnapshotError,
};

use crate::input_average::InputAverage;
use crate::interrupt::LongLoop;
use crate::output_interpolator::{OutputInterpolator, Rows};
use crate::plant::{Plant, PlantEvent, PlantFault};
use crate::plant_state::PlantState;

/// A plant with its own fixed step, independent of the instants at which boards sample and actuate:
/// *grid* coupling.
///
/// The plant is advanced from one instant of a communication grid to the next, H later, and to no
/// other. At the instants of the grid there is no delay and no interpolation: if all sampling and
/// actuation occurs there, the plant moves as it does without coupling, bit for bit. Between two
/// instants the plant is either behind or ahead of the time of the run ([`GridInputs`]). With exact
/// coupling, four boards with unrelated phases divide its steps some four thousand times a second.
///
/// # Mean inputs
/// The plant takes a step at its end, under the mean of the commands applied in it, so that impulse
/// is neither lost nor delayed. A command that changes by Δu at θH into a step leaves the velocity
/// at the end exact and the position wrong by ½θ(1 − θ) H² Δu/m: H²/8 Δu/m at most. The sum of a
/// command's changes is bounded by its range, so the error of the motion is O(H²), independent of
/// the number of boards and of their rates. Samples are extrapolated over less than a step and do
/// not contain the effect of commands applied in it, which is O(H²), too. The coupling is of second
/// order. Dimensionless inputs (switches) have no mean: their value at the middle of the step
/// applies to all of it.
///
/// # Held inputs
/// The plant takes a step at the first sample within it, under the commands at that time. Samples
/// are interpolated by cubics, of fourth order; a command acts from the next instant on, (1 − θ)H
/// late. If phases are unrelated to the grid, that is ½H in the mean, equivalent to a delay of all
/// boards. With the delay τ of a loop its motion x(τ) changes by ½H ∂x/∂τ + O(H²): the coupling is
/// of first order, whatever the orders of plant and interpolation. Suited to a plant that is only
/// sampled; a loop near its stability limit loses phase margin.
///
/// # Observation
/// Energy, work, constraint violation and state are those at the instant of the grid where the
/// plant is, less than H from the present time. Events are reported once their time has passed. A
/// window that begins between two instants begins at the plant's instant.
pub struct FixedStepCoupling {
    plant: Box<dyn Plant>,
    ports: Vec<Port>,
    step: SimDuration,
    grid_inputs: GridInputs,
    interpolator: OutputInterpolator,
    exposed: Vec<ExposedOutput>,
    /// Inputs applied to the plant, and buffer of its outputs.
    applied: Vec<f64>,
    outputs: Vec<f64>,
    state: State,
}

/// Coupling of a plant with the parts that sample and actuate it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Coupling {
    /// The plant is advanced to every instant of access.
    #[default]
    Exact,
    /// The plant keeps a fixed step ([`FixedStepCoupling`]).
    Grid {
        /// Step of the communication grid.
        step: SimDuration,
        /// Treatment of commands and samples within a step.
        inputs: GridInputs,
    },
}

/// Treatment of commands and samples between two instants of the communication grid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum GridInputs {
    /// The plant steps at the end of an interval, under the mean of the commands applied in it;
    /// samples within the interval are extrapolated.
    #[default]
    Mean,
    /// The plant steps ahead at the first sample of an interval; a command acts from the next
    /// instant of the grid on, samples within the interval are interpolated.
    Held,
}

/// A communication grid with a step of zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("the step of a communication grid must be longer than 0 s")]
pub struct ZeroGridStep;

/// An output visible outside: its field in the plant, and its range there and here.
#[derive(Clone, Debug)]
struct ExposedOutput {
    field: usize,
    from: std::ops::Range<usize>,
    to: std::ops::Range<usize>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct State {
    now: SimTime,
    /// Grid instant of the plant.
    reached: SimTime,
    average: InputAverage,
    rows: Rows,
}

#[derive(Serialize, Deserialize)]
struct Saved {
    step: SimDuration,
    grid_inputs: GridInputs,
    state: State,
    plant: Snapshot,
}

impl FixedStepCoupling {
    /// Couples `plant`, which is at its start, to a grid of `step` that begins there. Only the
    /// outputs selected by `exposed` are visible; the others may be rates used for interpolation,
    /// see [`FixedStepCoupling::needs`].
    ///
    /// # Errors
    /// [`ZeroGridStep`] if the step is zero.
    pub fn new(
        plant: Box<dyn Plant>,
        step: SimDuration,
        grid_inputs: GridInputs,
        exposed: &dyn Fn(&str) -> bool,
    ) -> Result<Self, ZeroGridStep> {
        if step.is_zero() {
            return Err(ZeroGridStep);
        }
        let all = plant.ports();
        let inputs = Layout::of(&all, Direction::Input);
        let outputs = Layout::of(&all, Direction::Output);
        let is_exposed =
            |port: &&Port| port.direction == Direction::Input || exposed(port.name.as_str());
        let fields: Vec<Field> = outputs.fields().cloned().collect();
        let interpolator = OutputInterpolator::new(step.as_secs_f64(), outputs.len(), &fields);
        Ok(Self {
            ports: all.iter().filter(is_exposed).cloned().collect(),
            exposed: exposed_outputs(&fields, exposed),
            applied: vec![0.0; inputs.len()],
            outputs: vec![0.0; outputs.len()],
            state: State {
                now: SimTime::ZERO,
                reached: SimTime::ZERO,
                average: InputAverage::new(&inputs, step),
                rows: interpolator.rows(),
            },
            interpolator,
            step,
            grid_inputs,
            plant,
        })
    }

    /// Returns whether a plant on a grid must have the `output`, given the `selected` outputs:
    /// those and their rates, so that the interpolation of a signal does not depend on whether its
    /// rate is selected.
    pub fn needs(output: &Port, selected: &dyn Fn(&str) -> bool) -> bool {
        let of_selected = matches!(&output.kind, SignalKind::RateOf(of) if selected(of));
        of_selected || selected(&output.name)
    }

    /// Advances the plant to the next instant of the grid, under the applied inputs.
    fn step_plant(&mut self) -> Result<(), PlantFault> {
        let next = self.state.reached + self.step;
        self.plant.advance(next, &self.applied)?;
        self.plant.observe(self.state.rows.push());
        self.state.reached = next;
        Ok(())
    }

    /// Takes the steps that have ended by `to`.
    fn advance_mean(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        self.state.average.change(self.state.now, inputs);
        let mut steps = LongLoop::default();
        while to.since_start() - self.state.reached.since_start() >= self.step {
            if steps.is_interrupted() {
                return Err(PlantFault::interrupted(self, self.state.now));
            }
            let step_end = self.state.reached + self.step;
            self.state.average.mean(step_end, &mut self.applied);
            self.step_plant()?;
            self.state.now = step_end;
            self.state.average.begin(step_end, inputs);
        }
        Ok(())
    }

    /// Takes the steps that have begun by `to`.
    fn advance_held(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        let mut steps = LongLoop::default();
        while self.state.reached < to {
            if steps.is_interrupted() {
                return Err(PlantFault::interrupted(self, self.state.reached));
            }
            self.state.now = self.state.reached;
            self.applied.copy_from_slice(inputs);
            self.step_plant()?;
        }
        Ok(())
    }
}

fn exposed_outputs(fields: &[Field], exposed: &dyn Fn(&str) -> bool) -> Vec<ExposedOutput> {
    let mut end = 0;
    let fields = fields.iter().enumerate();
    fields
        .filter(|(_, field)| exposed(&field.port.name))
        .map(|(number, field)| {
            let start = end;
            end += field.port.size;
            ExposedOutput {
                field: number,
                from: field.range(),
                to: start..end,
            }
        })
        .collect()
}

impl Plant for FixedStepCoupling {
    fn inner(&self) -> Option<&dyn Plant> {
        Some(&*self.plant)
    }

    fn inner_mut(&mut self) -> Option<&mut dyn Plant> {
        Some(&mut *self.plant)
    }

    fn name(&self) -> &str {
        self.plant.name()
    }

    fn ports(&self) -> Vec<Port> {
        self.ports.clone()
    }

    /// Advances to `to`. After a failure the plant is at the end of the last step of the grid.
    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        if self.state.rows.is_empty() {
            self.plant.observe(self.state.rows.push());
        }
        match self.grid_inputs {
            GridInputs::Mean => self.advance_mean(to, inputs)?,
            GridInputs::Held => self.advance_held(to, inputs)?,
        }
        self.state.now = to;
        Ok(())
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        let State {
            now, reached, rows, ..
        } = &self.state;
        if now == reached {
            self.plant.observe(&mut self.outputs);
            for exposed in &self.exposed {
                outputs[exposed.to.clone()].copy_from_slice(&self.outputs[exposed.from.clone()]);
            }
            return;
        }
        let step_s = self.step.as_secs_f64();
        for exposed in &self.exposed {
            let out = &mut outputs[exposed.to.clone()];
            match self.grid_inputs {
                GridInputs::Mean => {
                    let at = (*now - *reached).as_secs_f64() / step_s;
                    self.interpolator.extrapolate(rows, at, exposed.field, out);
                }
                GridInputs::Held => {
                    let at = 1.0 - (*reached - *now).as_secs_f64() / step_s;
                    self.interpolator.interpolate(rows, at, exposed.field, out);
                }
            }
        }
    }

    fn events(&self) -> &[PlantEvent] {
        let events = self.plant.events();
        let now_s = self.state.now.as_secs_f64();
        let past = events.partition_point(|event| event.at_s <= now_s);
        &events[..past]
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&Saved {
            step: self.step,
            grid_inputs: self.grid_inputs,
            state: self.state.clone(),
            plant: self.plant.save(),
        })
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let saved: Saved = snapshot.read()?;
        let describe = |step: SimDuration, grid_inputs: GridInputs, state: &State| {
            format!(
                "a plant with inputs {grid_inputs:?} on a grid of {step}, with {} inputs and {} outputs",
                state.average.len(),
                state.rows.width()
            )
        };
        let expected = describe(self.step, self.grid_inputs, &self.state);
        let found = describe(saved.step, saved.grid_inputs, &saved.state);
        if expected != found
            || !saved.state.rows.is_consistent()
            || !saved.state.average.is_consistent()
        {
            return Err(SnapshotError::Mismatch { expected, found });
        }
        self.plant.restore(&saved.plant)?;
        self.state = saved.state;
        Ok(())
    }

    /// Resumes from `from`, where the grid is restarted.
    fn resume_from(&mut self, from: &PlantState) -> Result<Vec<String>, PlantFault> {
        let omitted = self.plant.resume_from(from)?;
        (self.state.now, self.state.reached) = (from.time, from.time);
        self.state.average.reset(from.time);
        self.state.rows.clear();
        Ok(omitted)
    }
}
