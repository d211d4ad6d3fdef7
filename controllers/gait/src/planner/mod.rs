//! The controller `planner`: a gait whose step length is planned, so that no foot lands in an
//! obstacle.

mod footfalls;
mod odometry;
mod state;
#[cfg(test)]
mod tests;

use twinrig_kernel::{Port, SimDuration, Snapshot, SnapshotError, Unit, signal};
use twinrig_robot::Robot;
use twinrig_runtime::{Bound, LimitViolation, Process, ProcessVariable, VariableError};

use crate::limb::Limb;
use crate::load_signal::LoadSignal;
use crate::variables::index;
use crate::{Cpg, Gait, GaitError};

use footfalls::{NextFootfall, Obstacle};
use odometry::Foot;
use state::{Plan, State};

/// Number of segments of a leg.
const SEGMENTS: usize = 3;

/// Gait of [`Cpg`] that knows the distance of an obstacle at its start, and changes the step length
/// of all legs so that no foot lands in it (thesis, figure 3.1, and the outlook of section 3.4).
///
/// Inputs: the joint angles `leg/X/angles` \[rad\] of each selected leg, then the load \[N\] of
/// each, by default `leg/X/foot/load` ([`Planner::with_load`]). No other part of the plant's state
/// enters the plan; the gait may have inputs of its own ([`crate::Abduction::Capture`]). Outputs:
/// those of the gait, then `planner/distance` \[m\], the distance travelled by its own estimate,
/// and `planner/step_change` \[m\].
///
/// 1. *Odometry.* The feet that carry load do not move on the ground, so the trunk travels as far
///    as they move back relative to it. In flight it keeps its speed.
/// 2. *Footfalls.* At each take-off of the first leg the next footfalls of all legs are predicted.
///    A foot lands where it landed last relative to the trunk, a cycle later. A change Δ of the
///    step length changes the stride by `modulation_slope` Δ, the slope that `twin study
///    modulation` measures, and the place of landing by Δ/2.
/// 3. *Choice.* The Δ up to `step_change_max` that keeps the footfalls of the next eight cycles
///    `obstacle_margin` away from the obstacle, and that alters the present one least. A missing
///    margin counts twice an alteration. Beyond the obstacle Δ is 0.
///
/// # Process variables
///
/// Those of [`Cpg`] and
///
/// | name | unit | range | meaning |
/// |---|---|---|---|
/// | `obstacle_distance` | m | ≥ 0 | near edge in front of the trunk's centre of mass at the start |
/// | `obstacle_length` | m | ≥ 0 | extent of the obstacle along x; 0 for none |
/// | `obstacle_margin` | m | ≥ 0 | distance of the footfalls from both edges |
/// | `step_change_max` | m | ≥ 0 | greatest change of the step length; 0 walks blindly |
/// | `modulation_slope` | 1 | ≥ 0 | change of the stride over change of the step length |
/// | `odometry_scale` | 1 | above 0 | distance travelled over that without slip |
/// | `odometry_offset` | m | all | part of the estimate that is slip while the gait starts |
///
/// Nothing is planned before two cycles with the same stride, within 3 %, so the obstacle has to be
/// some cycles away from the start. The path is taken as straight and the trunk as level: heading
/// and pitch do not enter the plan. `odometry_offset` is best calibrated by footfalls, as it then
/// includes the mean pitch.
#[derive(Debug, Clone)]
pub struct Planner {
    gait: Cpg,
    /// Commanded legs, with their indices in the robot.
    limbs: Vec<(usize, Limb)>,
    load: LoadSignal,
    /// Variables of the gait as they are set, without the plan, and those of the planner.
    variables: Vec<ProcessVariable>,
    /// Indices of the offsets of the step lengths of the commanded legs.
    offsets: Vec<usize>,
    /// Index of the first variable of the planner.
    own: usize,
    /// Number of outputs of the gait.
    outputs: usize,
    state: State,
    /// Values of an iteration, kept to allocate nothing.
    feet: Vec<Foot>,
    next: Vec<NextFootfall>,
}

/// Variables of the planner, in their order.
fn own_variables() -> [ProcessVariable; 7] {
    let length = |name, default| ProcessVariable::new(name, Unit::Meter, 0.0.., default);
    let positive = (Bound::Excluded(0.0), Bound::Unbounded);
    [
        length("obstacle_distance", 0.0),
        length("obstacle_length", 0.0),
        length("obstacle_margin", 0.01),
        length("step_change_max", 0.02),
        ProcessVariable::new("modulation_slope", Unit::One, 0.0.., 2.0),
        ProcessVariable::new("odometry_scale", Unit::One, positive, 1.0),
        ProcessVariable::new("odometry_offset", Unit::Meter, .., 0.0),
    ]
}

impl Planner {
    /// Name in scenarios.
    pub const NAME: &'static str = "planner";
    /// Output with the distance travelled \[m\].
    pub const DISTANCE: &'static str = "planner/distance";
    /// Output with the change of the step length \[m\].
    pub const STEP_CHANGE: &'static str = "planner/step_change";

    /// Creates a planner of the steps of `gait`, a controller of `legs` of `robot`.
    ///
    /// # Errors
    /// An unknown leg, or a leg with an impossible geometry.
    pub fn new(robot: &Robot, legs: &[&str], gait: Cpg) -> Result<Self, GaitError> {
        let limbs = Limb::of_robot(robot, legs)?;
        let of_robot = gait.variables();
        let first = index(of_robot, "step_length_offset");
        let mut variables = of_robot.to_vec();
        let own = variables.len();
        variables.extend(own_variables());
        let limbs: Vec<(usize, Limb)> = limbs
            .into_iter()
            .enumerate()
            .filter(|(_, limb)| limb.active)
            .collect();
        Ok(Self {
            outputs: gait.output_count(),
            gait,
            offsets: limbs.iter().map(|(leg, _)| first + leg).collect(),
            state: State::new(limbs.len()),
            feet: vec![Foot::default(); limbs.len()],
            next: Vec::with_capacity(limbs.len()),
            limbs,
            load: LoadSignal::default(),
            variables,
            own,
        })
    }

    /// The process variables of a controller for `robot`, at their defaults.
    ///
    /// # Errors
    /// A leg whose geometry is impossible.
    pub fn variables_of(robot: &Robot, gait: Gait) -> Result<Vec<ProcessVariable>, GaitError> {
        let mut variables = Cpg::variables_of(robot, gait)?;
        variables.extend(own_variables());
        Ok(variables)
    }

    /// Reads the load of each leg from the signal of this name, as
    /// [`crate::Tegotae::with_load`].
    ///
    /// # Errors
    /// A name without `*` for several legs, or a component above 2.
    pub fn with_load(mut self, name: &str, component: Option<usize>) -> Result<Self, GaitError> {
        self.load = LoadSignal::new(name, component, self.limbs.len())?;
        Ok(self)
    }

    /// Values of the planner's variables.
    fn own_values(&self) -> [f64; 7] {
        std::array::from_fn(|n| self.variables[self.own + n].value())
    }

    fn plan(&self) -> Plan {
        let [distance, length, margin, most, slope, scale, offset] = self.own_values();
        Plan {
            obstacle: (length > 0.0 && most > 0.0).then_some(Obstacle {
                near: distance,
                far: distance + length,
            }),
            margin,
            most,
            slope,
            scale,
            offset,
        }
    }

    /// Sets the step lengths of the gait for a change of all of them.
    fn change_steps(&mut self, change: f64) {
        for &offset in &self.offsets {
            let variable = &self.variables[offset];
            let (min, max) = variable.range();
            let limit = |bound, open: f64| match bound {
                Bound::Included(limit) | Bound::Excluded(limit) => limit,
                Bound::Unbounded => open,
            };
            let [min, max] = [limit(min, f64::NEG_INFINITY), limit(max, f64::INFINITY)];
            let value = (variable.value() + change).clamp(min, max);
            // Any offset within its range is accepted.
            let _ = self.gait.set_variable(offset, value);
        }
    }
}

impl Process for Planner {
    fn name(&self) -> &str {
        Self::NAME
    }

    fn ports(&self) -> Vec<Port> {
        let angles = self.limbs.iter().map(|(_, limb)| {
            let name = signal::of_leg(&limb.name, signal::ANGLES);
            Port::input(name, Unit::Radian, SEGMENTS)
        });
        let loads = self.limbs.iter();
        let loads = loads.map(|(_, limb)| self.load.port(&limb.name));
        let own = [Self::DISTANCE, Self::STEP_CHANGE];
        let own = own.map(|name| Port::output(name, Unit::Meter, 1));
        let inputs = angles.chain(loads);
        inputs.chain(self.gait.ports()).chain(own).collect()
    }

    fn is_monitor(&self, output: &str) -> bool {
        [Self::DISTANCE, Self::STEP_CHANGE].contains(&output) || self.gait.is_monitor(output)
    }

    fn limit_violations(&self) -> Vec<LimitViolation> {
        self.gait.limit_violations()
    }

    fn variables(&self) -> &[ProcessVariable] {
        &self.variables
    }

    fn set_variable(&mut self, index: usize, value: f64) -> Result<(), VariableError> {
        let count = self.variables.len();
        let variable = self.variables.get_mut(index);
        let variable = variable.ok_or(VariableError::NoSuchIndex { index, count })?;
        if index < self.own {
            self.gait.set_variable(index, value)?;
        }
        variable.set(value)?;
        if self.offsets.contains(&index) {
            self.change_steps(self.state.change());
        }
        Ok(())
    }

    fn step(&mut self, elapsed: SimDuration, inputs: &[f64], outputs: &mut [f64]) {
        let (angles, inputs) = inputs.split_at(SEGMENTS * self.limbs.len());
        let (loads, of_gait) = inputs.split_at(self.load.size() * self.limbs.len());
        let angles = angles.chunks_exact(SEGMENTS);
        let legs = self.limbs.iter().zip(angles).zip(self.load.values(loads));
        for (foot, (((_, limb), angles), load)) in self.feet.iter_mut().zip(legs) {
            let angles = [angles[0], angles[1], angles[2]];
            *foot = Foot::measured(limb.place_of(angles), load);
        }
        let phases = self.limbs.iter().map(|(leg, _)| self.gait.phase(*leg));
        let (before, plan) = (self.state.change(), self.plan());
        let seconds = elapsed.as_secs_f64();
        if let Some(duration) = self.state.step(seconds, &self.feet, phases) {
            self.state.plan(duration, &plan, &mut self.next);
        }
        let change = self.state.change();
        if change != before {
            self.change_steps(change);
        }
        let (commands, own) = outputs.split_at_mut(self.outputs);
        self.gait.step(elapsed, of_gait, commands);
        own.copy_from_slice(&[self.state.travelled(&plan), change]);
    }

    fn save(&self) -> Snapshot {
        let values: Vec<f64> = self.variables.iter().map(ProcessVariable::value).collect();
        Snapshot::of(&(self.gait.save(), values, &self.state))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (gait, values, state): (Snapshot, Vec<f64>, State) = snapshot.read()?;
        let mismatch = |found: String| SnapshotError::Mismatch {
            expected: format!("a planner of the steps of {} legs", self.limbs.len()),
            found,
        };
        if values.len() != self.variables.len() || state.legs() != self.limbs.len() {
            let (legs, variables) = (state.legs(), values.len());
            return Err(mismatch(format!("{legs} legs with {variables} variables")));
        }
        let mut variables = self.variables.clone();
        for (variable, value) in variables.iter_mut().zip(values) {
            let set = variable.set(value);
            set.map_err(|error| mismatch(error.to_string()))?;
        }
        self.gait.restore(&gait)?;
        self.variables = variables;
        self.state = state;
        Ok(())
    }
}
