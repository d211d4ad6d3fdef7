use serde::{Deserialize, Serialize};
use thiserror::Error;
use twinrig_kernel::{
    Direction, Field, Layout, Port, SimDuration, SimTime, Snapshot, SnapshotError,
};

use crate::input_average::InputAverage;
use crate::interrupt::LongLoop;
use crate::output_interpolator::{OutputInterpolator, Rows, integral_of};
use crate::plant::{EnergyBalance, Plant, PlantEvent, PlantFault, WorkCounts};
use crate::plant_state::PlantState;

/// A plant that keeps its step, whenever boards sample and actuate: *grid* coupling.
///
/// The plant is moved from one instant of a grid to the next, H later, and to nowhere else. At an instant of the grid itself
/// nothing is late and nothing is made up: where everybody meets the plant there and nowhere else, it goes the same way as by
/// itself, bit for bit. Between two instants it is either behind those who meet it or ahead of them ([`GridInputs`]).
///
/// # Behind
/// The plant takes a step when that is over, under the mean of what was commanded in it, so that no impulse is lost
/// and none is late. A command that changes by Δu at θH into a step leaves the velocity at its end right and the position wrong by
/// ½θ(1 − θ) H² Δu/m: H²/8 Δu/m at most. The changes of a command add up to no more than where it goes, so the error of the
/// motion is O(H²), however many boards there are and however often they tick. What is sampled is extrapolated over less than a
/// step and does not know of commands given in it, which is O(H²), too. It is of second order. Pure numbers (switches) have no
/// mean: what holds in the middle of the step holds in all of it.
///
/// # Ahead
/// The plant takes a step as soon as somebody wants to know of the time in it, under the commands of then. What is sampled is
/// interpolated by cubics, of fourth order; a command acts from the next instant on, (1 − θ)H late. At phases that have nothing to do
/// with the grid that is ½H in the mean, as if all boards were so much slower. With the delay τ of a loop its motion x(τ) changes by
/// ½H ∂x/∂τ + O(H²): it is of first order, whatever the orders of the plant and of the curves. Good for a plant that only sensors
/// look at; loops that are near their limit lose what phase they have left.
///
/// # What is told of it
/// Energy, work, drift and state are those of the instant of the grid where the plant is, less than H from now. Events are told
/// once their time has come. A window that begins between two instants begins where the plant is.
pub struct FixedStepCoupling {
    plant: Box<dyn Plant>,
    ports: Vec<Port>,
    step: SimDuration,
    rule: GridInputs,
    between: OutputInterpolator,
    shown: Vec<Shown>,
    /// What the plant is held to, and where it writes its outputs.
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
    /// The plant steps at the end of an interval, under the mean of the commands given in it; samples within the interval
    /// are extrapolated.
    #[default]
    Mean,
    /// The plant steps ahead at the first sample of an interval; a command acts from the next instant of the grid on, samples
    /// within the interval are interpolated.
    Held,
}

/// Steps of no length lead nowhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("a grid has steps longer than 0 s")]
pub struct ZeroGridStep;

/// An output that is passed on: which field it is of the plant, and its place there and here.
#[derive(Clone, Debug)]
struct Shown {
    field: usize,
    from: std::ops::Range<usize>,
    to: std::ops::Range<usize>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct State {
    now: SimTime,
    /// The instant of the grid where the plant is.
    reached: SimTime,
    given: InputAverage,
    rows: Rows,
}

#[derive(Serialize, Deserialize)]
struct Saved {
    step: SimDuration,
    rule: GridInputs,
    state: State,
    plant: Snapshot,
}

impl FixedStepCoupling {
    /// Puts `plant`, which is at its start, on a grid of `step` from there on. Of its outputs those are passed on that `shown`
    /// says; the others may be rates that only curves need, see [`FixedStepCoupling::needs`].
    ///
    /// # Errors
    /// [`ZeroGridStep`] if the step is none.
    pub fn new(
        plant: Box<dyn Plant>,
        step: SimDuration,
        rule: GridInputs,
        shown: &dyn Fn(&str) -> bool,
    ) -> Result<Self, ZeroGridStep> {
        if step.is_zero() {
            return Err(ZeroGridStep);
        }
        let all = plant.ports();
        let inputs = Layout::of(&all, Direction::Input);
        let outputs = Layout::of(&all, Direction::Output);
        let is_shown =
            |port: &&Port| port.direction == Direction::Input || shown(port.name.as_str());
        let fields: Vec<Field> = outputs.fields().cloned().collect();
        let between = OutputInterpolator::new(step.as_secs_f64(), outputs.len(), &fields);
        Ok(Self {
            ports: all.iter().filter(is_shown).cloned().collect(),
            shown: placed(&fields, shown),
            applied: vec![0.0; inputs.len()],
            outputs: vec![0.0; outputs.len()],
            state: State {
                now: SimTime::ZERO,
                reached: SimTime::ZERO,
                given: InputAverage::new(&inputs, step),
                rows: between.rows(),
            },
            between,
            step,
            rule,
            plant,
        })
    }

    /// Whether a plant on a grid, of which the outputs that are `wanted` are, has to tell `name`: those, and their rates, so
    /// that a signal is the same between two instants whether anybody wants its rate or not.
    pub fn needs(name: &str, wanted: &dyn Fn(&str) -> bool) -> bool {
        wanted(name) || integral_of(name).is_some_and(|integral| wanted(&integral))
    }

    /// Moves the plant to the next instant of the grid, under what is to be applied.
    fn go_on(&mut self) -> Result<(), PlantFault> {
        let next = self.state.reached + self.step;
        self.plant.advance(next, &self.applied)?;
        self.plant.observe(self.state.rows.push());
        self.state.reached = next;
        Ok(())
    }

    /// Takes the steps that are over by `to`.
    fn follow(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        self.state.given.change(self.state.now, inputs);
        let mut steps = LongLoop::default();
        while to.since_start() - self.state.reached.since_start() >= self.step {
            if steps.is_interrupted() {
                return Err(PlantFault::interrupted(self, self.state.now));
            }
            let over = self.state.reached + self.step;
            self.state.given.mean(over, &mut self.applied);
            self.go_on()?;
            self.state.now = over;
            self.state.given.begin(over, inputs);
        }
        Ok(())
    }

    /// Takes the steps that have begun by `to`.
    fn lead(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        let mut steps = LongLoop::default();
        while self.state.reached < to {
            if steps.is_interrupted() {
                return Err(PlantFault::interrupted(self, self.state.reached));
            }
            self.state.now = self.state.reached;
            self.applied.copy_from_slice(inputs);
            self.go_on()?;
        }
        Ok(())
    }
}

fn placed(fields: &[Field], shown: &dyn Fn(&str) -> bool) -> Vec<Shown> {
    let mut end = 0;
    let fields = fields.iter().enumerate();
    fields
        .filter(|(_, field)| shown(&field.port.name))
        .map(|(number, field)| {
            let start = end;
            end += field.port.size;
            Shown {
                field: number,
                from: field.range(),
                to: start..end,
            }
        })
        .collect()
}

impl Plant for FixedStepCoupling {
    fn name(&self) -> &str {
        self.plant.name()
    }

    fn ports(&self) -> Vec<Port> {
        self.ports.clone()
    }

    fn first_inputs(&self, inputs: &mut [f64]) {
        self.plant.first_inputs(inputs);
    }

    /// If the plant fails, it is where the last step of the grid ended.
    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        if self.state.rows.is_empty() {
            self.plant.observe(self.state.rows.push());
        }
        match self.rule {
            GridInputs::Mean => self.follow(to, inputs)?,
            GridInputs::Held => self.lead(to, inputs)?,
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
            for shown in &self.shown {
                outputs[shown.to.clone()].copy_from_slice(&self.outputs[shown.from.clone()]);
            }
            return;
        }
        let step_s = self.step.as_secs_f64();
        for shown in &self.shown {
            let out = &mut outputs[shown.to.clone()];
            match self.rule {
                GridInputs::Mean => {
                    let at = (*now - *reached).as_secs_f64() / step_s;
                    self.between.extrapolate(rows, at, shown.field, out);
                }
                GridInputs::Held => {
                    let at = 1.0 - (*reached - *now).as_secs_f64() / step_s;
                    self.between.interpolate(rows, at, shown.field, out);
                }
            }
        }
    }

    fn begin_window(&mut self) {
        self.plant.begin_window();
    }

    fn energy(&self) -> EnergyBalance {
        self.plant.energy()
    }

    fn work(&self) -> WorkCounts {
        self.plant.work()
    }

    fn constraint_violation(&self) -> Option<f64> {
        self.plant.constraint_violation()
    }

    fn log_events(&mut self, wanted: bool) {
        self.plant.log_events(wanted);
    }

    fn events(&self) -> &[PlantEvent] {
        let events = self.plant.events();
        let now_s = self.state.now.as_secs_f64();
        let come = events.partition_point(|event| event.at_s <= now_s);
        &events[..come]
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&Saved {
            step: self.step,
            rule: self.rule,
            state: self.state.clone(),
            plant: self.plant.save(),
        })
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let saved: Saved = snapshot.read()?;
        let make = |step: SimDuration, rule: GridInputs, state: &State| {
            format!(
                "a plant {rule:?} on a grid of {step}, with {} inputs and {} outputs",
                state.given.len(),
                state.rows.width()
            )
        };
        let expected = make(self.step, self.rule, &self.state);
        let found = make(saved.step, saved.rule, &saved.state);
        if expected != found || !saved.state.rows.is_sound() || !saved.state.given.is_sound() {
            return Err(SnapshotError::Mismatch { expected, found });
        }
        self.plant.restore(&saved.plant)?;
        self.state = saved.state;
        Ok(())
    }

    fn state(&self) -> Option<PlantState> {
        self.plant.state()
    }

    /// The grid begins anew there.
    fn resume_from(&mut self, from: &PlantState) -> Result<Vec<String>, PlantFault> {
        let lost = self.plant.resume_from(from)?;
        (self.state.now, self.state.reached) = (from.time, from.time);
        self.state.given.reset(from.time);
        self.state.rows.clear();
        Ok(lost)
    }
}
