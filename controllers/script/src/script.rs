//! The controller `script`.

use std::f64::consts::{FRAC_PI_2, TAU};

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Port, SimDuration, Snapshot, SnapshotError, Unit, signal};
use twinrig_robot::Robot;
use twinrig_runtime::{Process, ProcessVariable, VariableError};

use crate::{Plan, ScriptError, Shape};

/// Drives of a leg that follow a shape.
const DRIVES: [&str; 2] = ["hip", "knee"];
/// Default offsets \[rad\]: hip straight, knee bent enough to oscillate in both directions.
const DEFAULT_OFFSETS: [f64; 2] = [0.0, 0.5];
/// Default amplitude \[rad\].
const DEFAULT_AMPLITUDE: f64 = 0.1;
/// Limits of angles \[rad\] and frequencies \[Hz\]: beyond any drive, and small enough to prevent
/// overflows.
const ANGLE_MAX: f64 = signal::COMMAND_ANGLE_MAX;
const FREQUENCY_MAX: f64 = 1000.0;

/// Indices of the variables: pairs for hip and knee, then the abduction of all legs.
const OFFSET: usize = 0;
const AMPLITUDE: usize = 2;
const FREQUENCY: usize = 4;
const SPLAY: usize = 6;

/// Commands of a [`Shape`] for the hips and one for the knees.
///
/// No inputs. Outputs `leg/X/hip/command` and `leg/X/knee/command` \[rad\] for the selected legs,
/// in the robot's order; then, with [`Plan::abduction`], `leg/X/abduction/command` \[rad\] for each
/// of them. Only hips, or only knees, if [`Script::for_plant`] finds that the plant has no others;
/// the variables of the others then have no effect.
///
/// # Process variables
///
/// | name | unit | range | default | meaning |
/// |---|---|---|---|---|
/// | `offset/hip`, `/knee` | rad | −100 to 100 | 0, 0.5 | command at the value 0 of the shape |
/// | `amplitude/hip`, `/knee` | rad | −100 to 100 | 0.1 | factor of the shape's value |
/// | `frequency/hip`, `/knee` | Hz | 0 to 1000 | 1 | cycle frequency; 0 holds the phase |
/// | `splay` | rad | −π/2 to π/2 | 0 | angle of the legs outwards, with abduction servos |
///
/// A change takes full effect at the next step; a new frequency continues from the present phase,
/// and applies from the step before. Until a frequency is changed, commands are a pure function of
/// the sum of the elapsed times.
///
/// An abduction angle is about the trunk's x axis, which points forward: positive swings the foot
/// to the left. Legs on the left are commanded +`splay`, those on the right −`splay`. Without
/// [`Plan::abduction`], any value other than 0 is rejected.
#[derive(Debug, Clone)]
pub struct Script {
    legs: Vec<Leg>,
    /// Commanded drives of every leg, as indices of [`DRIVES`].
    drives: Vec<usize>,
    shapes: [Shape; 2],
    abduction: bool,
    variables: Vec<ProcessVariable>,
    state: State,
}

/// A commanded leg.
#[derive(Debug, Clone)]
struct Leg {
    name: String,
    /// Lag relative to the robot's first leg \[cycles\].
    lag: f64,
    /// 1 on the left or in the middle plane, −1 on the right.
    side: f64,
}

impl Leg {
    fn command(&self, joint: &str) -> String {
        signal::command(&self.name, joint)
    }
}

/// State of the controller without its variables.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
struct State {
    /// Sum of the elapsed times since the start.
    now: SimDuration,
    /// Of hips and of knees.
    marks: [Mark; 2],
}

/// Phase of a drive at the last change of its frequency.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
struct Mark {
    at: SimDuration,
    /// Cycles completed by then \[1\].
    cycles: f64,
}

impl Mark {
    /// Cycles completed at `now`, at `frequency` \[Hz\] since the mark \[1\].
    fn cycles(self, now: SimDuration, frequency: f64) -> f64 {
        let elapsed = now.checked_sub(self.at).unwrap_or_default();
        self.cycles + frequency * elapsed.as_secs_f64()
    }
}

impl Script {
    /// Name in scenarios.
    pub const NAME: &'static str = "script";

    /// Creates a controller for `legs` of `robot`.
    ///
    /// # Errors
    /// An unknown leg, or a phase lag out of range.
    pub fn new(robot: &Robot, legs: &[&str], plan: &Plan) -> Result<Self, ScriptError> {
        let known = || robot.legs.iter().map(|mount| mount.name.as_str());
        if let Some(&name) = legs
            .iter()
            .find(|&&name| known().all(|known| known != name))
        {
            return Err(ScriptError::UnknownLeg {
                name: name.to_owned(),
                known: known().collect::<Vec<_>>().join(", "),
            });
        }
        let mounts = robot.legs.iter();
        let all = mounts.map(|mount| (mount.name.as_str(), mount.hip[1] >= 0.0));
        let mut script = Self::of_legs(&all.collect::<Vec<_>>(), plan)?;
        script.legs.retain(|leg| legs.contains(&leg.name.as_str()));
        Ok(script)
    }

    /// Creates a controller for `legs` without a robot file: the name of each, and whether it is on
    /// the left, in the order of increasing lag.
    ///
    /// # Errors
    /// A phase lag out of range.
    pub fn of_legs(legs: &[(&str, bool)], plan: &Plan) -> Result<Self, ScriptError> {
        let lags = -Plan::PHASE_LAG_MAX..=Plan::PHASE_LAG_MAX;
        if !lags.contains(&plan.phase_lag) {
            return Err(ScriptError::OutOfRange {
                what: "phase_lag",
                value: plan.phase_lag,
                min: *lags.start(),
                max: *lags.end(),
            });
        }
        let leg = |(index, (name, left)): (usize, &(&str, bool))| Leg {
            name: (*name).to_owned(),
            lag: index as f64 * plan.phase_lag / TAU,
            side: if *left { 1.0 } else { -1.0 },
        };
        Ok(Self {
            legs: legs.iter().enumerate().map(leg).collect(),
            drives: (0..DRIVES.len()).collect(),
            shapes: [plan.hip, plan.knee],
            abduction: plan.abduction,
            variables: declare(),
            state: State::default(),
        })
    }

    /// The process variables of a script, at their defaults.
    pub fn variables_of() -> Vec<ProcessVariable> {
        declare()
    }

    /// Omits the commands of knees, or of hips, if a plant with the inputs `plant_inputs` has none
    /// of them for any leg: legs may have one joint only. If some legs have them, the signals of
    /// the others are missing, which is a wiring error.
    #[must_use]
    pub fn for_plant(mut self, plant_inputs: &[String]) -> Self {
        let has_input = |drive: usize| {
            let mut names = self.legs.iter().map(|leg| leg.command(DRIVES[drive]));
            names.any(|name| plant_inputs.contains(&name))
        };
        let drives: Vec<usize> = (0..DRIVES.len())
            .filter(|&drive| has_input(drive))
            .collect();
        if !drives.is_empty() {
            self.drives = drives;
        }
        self
    }

    /// Command of `drive` (0: hip, 1: knee) of a leg with a lag of `lag` cycles \[rad\].
    fn command(&self, drive: usize, lag: f64) -> f64 {
        let [offset, amplitude, frequency] =
            [OFFSET, AMPLITUDE, FREQUENCY].map(|first| self.variables[first + drive].value());
        let cycles = self.state.marks[drive].cycles(self.state.now, frequency) - lag;
        offset + amplitude * self.shapes[drive].at(cycles)
    }

    /// Sets the mark of the drive whose frequency is variable `index` to its present phase; has no
    /// effect for other variables.
    fn set_mark(&mut self, index: usize) {
        let Some(drive) = index.checked_sub(FREQUENCY).filter(|&drive| drive < 2) else {
            return;
        };
        let State { now, marks } = &mut self.state;
        let cycles = marks[drive].cycles(*now, self.variables[index].value());
        marks[drive] = Mark { at: *now, cycles };
    }
}

fn declare() -> Vec<ProcessVariable> {
    let of = |what: &str| DRIVES.map(|drive| format!("{what}/{drive}"));
    let angle =
        |name, default| ProcessVariable::new(name, Unit::Radian, -ANGLE_MAX..=ANGLE_MAX, default);
    let rate = |name| ProcessVariable::new(name, Unit::Hertz, 0.0..=FREQUENCY_MAX, 1.0);
    let offsets = of("offset").into_iter().zip(DEFAULT_OFFSETS);
    let mut variables: Vec<_> = offsets.map(|(name, at)| angle(name, at)).collect();
    variables.extend(of("amplitude").map(|name| angle(name, DEFAULT_AMPLITUDE)));
    variables.extend(of("frequency").map(rate));
    let upright = -FRAC_PI_2..=FRAC_PI_2;
    variables.push(ProcessVariable::new("splay", Unit::Radian, upright, 0.0));
    variables
}

impl Process for Script {
    fn name(&self) -> &str {
        Self::NAME
    }

    fn ports(&self) -> Vec<Port> {
        let port = |leg: &Leg, joint| Port::output(leg.command(joint), Unit::Radian, 1);
        let of = |leg| {
            self.drives
                .iter()
                .map(move |&drive| port(leg, DRIVES[drive]))
        };
        let drives = self.legs.iter().flat_map(of);
        let abducted = self.legs.iter().filter(|_| self.abduction);
        drives
            .chain(abducted.map(|leg| port(leg, "abduction")))
            .collect()
    }

    fn variables(&self) -> &[ProcessVariable] {
        &self.variables
    }

    fn set_variable(&mut self, index: usize, value: f64) -> Result<(), VariableError> {
        let count = self.variables.len();
        let variable = self
            .variables
            .get(index)
            .ok_or(VariableError::NoSuchIndex { index, count })?;
        variable.check(value)?;
        if index == SPLAY && value != 0.0 && !self.abduction {
            return Err(VariableError::Refused {
                name: variable.name().to_owned(),
                value,
                why: "this script does not command abduction".to_owned(),
            });
        }
        self.set_mark(index);
        self.variables[index].set(value)
    }

    fn step(&mut self, elapsed: SimDuration, _inputs: &[f64], outputs: &mut [f64]) {
        self.state.now += elapsed;
        let drives_per_leg = self.drives.len();
        let (drives, abductions) = outputs.split_at_mut(drives_per_leg * self.legs.len());
        for (leg, outputs) in self
            .legs
            .iter()
            .zip(drives.chunks_exact_mut(drives_per_leg))
        {
            for (&drive, output) in self.drives.iter().zip(outputs) {
                *output = self.command(drive, leg.lag);
            }
        }
        let splay = self.variables[SPLAY].value();
        for (leg, output) in self.legs.iter().zip(abductions) {
            *output = leg.side * splay;
        }
    }

    fn save(&self) -> Snapshot {
        let values: Vec<f64> = self.variables.iter().map(ProcessVariable::value).collect();
        Snapshot::of(&(values, self.state))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (values, state): (Vec<f64>, State) = snapshot.read()?;
        let mismatch = |found: String| SnapshotError::Mismatch {
            expected: format!("a script of {} variables", self.variables.len()),
            found,
        };
        if values.len() != self.variables.len() {
            return Err(mismatch(format!("a script of {} variables", values.len())));
        }
        let mut variables = self.variables.clone();
        for (variable, value) in variables.iter_mut().zip(values) {
            let set = variable.set(value);
            set.map_err(|error| mismatch(error.to_string()))?;
        }
        self.variables = variables;
        self.state = state;
        Ok(())
    }
}
