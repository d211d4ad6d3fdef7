//! The controller `script`.

use std::f64::consts::{FRAC_PI_2, TAU};

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Port, SimDuration, Snapshot, SnapshotError, Unit};
use twinrig_robot::Robot;
use twinrig_runtime::{Process, ProcessVariable, VariableError};

use crate::{Plan, ScriptError, Shape};

/// The drives of a leg that play a shape.
const DRIVES: [&str; 2] = ["hip", "knee"];
/// Where the drives hold by default \[rad\]: hip straight, knee bent enough to swing either way.
const OFFSETS: [f64; 2] = [0.0, 0.5];
/// How far they swing by default \[rad\].
const AMPLITUDE: f64 = 0.1;
/// Beyond what any drive does, and small enough that nothing overflows: angles \[rad\] and frequencies \[Hz\].
const ANGLE_MAX: f64 = 100.0;
const FREQUENCY_MAX: f64 = 1000.0;

/// Variables in their order: of hip and knee each, then the one of all abductions.
const SHIFT: usize = 0;
const SWING: usize = 2;
const FREQUENCY: usize = 4;
const SPLAY: usize = 6;

/// Plays a [`Shape`] on the hips and one on the knees.
///
/// No inputs. Outputs `leg/X/hip/command` and `leg/X/knee/command` \[rad\] for the legs it is given, in the robot's order;
/// then, with [`Plan::abduction`], `leg/X/abduction/command` \[rad\] for each of them. Only hips, or only knees, where
/// [`Script::for_plant`] finds that there is nothing else; variables of the others then do nothing.
///
/// # Process variables
///
/// | name | unit | range | default | is |
/// |---|---|---|---|---|
/// | `offset/hip`, `/knee` | rad | −100 to 100 | 0, 0.5 | the command where the shape is 0 |
/// | `amplitude/hip`, `/knee` | rad | −100 to 100 | 0.1 | how far the shape goes from there |
/// | `frequency/hip`, `/knee` | Hz | 0 to 1000 | 1 | cycles a second; 0 stays where it is in its cycle |
/// | `splay` | rad | −π/2 to π/2 | 0 | angle of the legs outwards, where there are abduction servos |
///
/// A change takes effect at the next step, at once; but a new frequency goes on from where the cycle is, and counts from the
/// step before. Until a frequency is changed, commands are a pure function of the sum of the elapsed times.
///
/// An abduction angle turns about the trunk's x axis, which points forward: positive swings the foot to the left. So the
/// legs on the left are commanded +`splay` and those on the right −`splay`. Without [`Plan::abduction`] there is nothing
/// to splay, and any other value than 0 is refused.
#[derive(Debug, Clone)]
pub struct Script {
    legs: Vec<Leg>,
    /// Which of [`DRIVES`] it commands, of every leg.
    drives: Vec<usize>,
    shapes: [Shape; 2],
    abduction: bool,
    variables: Vec<ProcessVariable>,
    state: State,
}

/// A leg that is commanded.
#[derive(Debug, Clone)]
struct Leg {
    name: String,
    /// By how much it is behind the robot's first leg \[cycles\].
    behind: f64,
    /// 1 on the left, or in the middle plane, −1 on the right.
    side: f64,
}

impl Leg {
    fn command(&self, joint: &str) -> String {
        format!("leg/{}/{joint}/command", self.name)
    }
}

/// What a step depends on, beside the variables.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
struct State {
    /// The sum of the elapsed times: since the start.
    now: SimDuration,
    /// Of hips and of knees.
    since: [Mark; 2],
}

/// Where a drive was in its cycle when its frequency was last changed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
struct Mark {
    at: SimDuration,
    /// Cycles that were done by then \[1\].
    cycles: f64,
}

impl Mark {
    /// Cycles that are done \[1\] at `now`, at `frequency` \[Hz\] since the mark.
    fn cycles(self, now: SimDuration, frequency: f64) -> f64 {
        let since = now.checked_sub(self.at).unwrap_or_default();
        self.cycles + frequency * since.as_secs_f64()
    }
}

impl Script {
    /// The name under which a scenario asks for it.
    pub const NAME: &'static str = "script";

    /// A controller for `legs` of `robot`.
    ///
    /// # Errors
    /// A leg that the robot does not have, or a phase lag out of range.
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

    /// A controller for `legs` of no robot file: the name of each, and whether it is on the left, in the order in which one
    /// is behind the other.
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
            behind: index as f64 * plan.phase_lag / TAU,
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

    /// Leaves knees, or hips, alone if a plant that takes the signals in `taken` takes that of no leg: legs may have one
    /// joint only. If only some legs have it, the signals of the others are missing, and that is an error of the wiring.
    #[must_use]
    pub fn for_plant(mut self, taken: &[String]) -> Self {
        let takes = |drive: usize| {
            let mut names = self.legs.iter().map(|leg| leg.command(DRIVES[drive]));
            names.any(|name| taken.contains(&name))
        };
        let drives: Vec<usize> = (0..DRIVES.len()).filter(|&drive| takes(drive)).collect();
        if !drives.is_empty() {
            self.drives = drives;
        }
        self
    }

    /// What `drive` (0 hip, 1 knee) of a leg so many cycles `behind` is commanded now \[rad\].
    fn command(&self, drive: usize, behind: f64) -> f64 {
        let [offset, amplitude, frequency] =
            [SHIFT, SWING, FREQUENCY].map(|first| self.variables[first + drive].value());
        let cycles = self.state.since[drive].cycles(self.state.now, frequency) - behind;
        offset + amplitude * self.shapes[drive].at(cycles)
    }

    /// From now on the drive whose frequency is variable `index` counts cycles anew, from where it is; nothing for others.
    fn mark(&mut self, index: usize) {
        let Some(drive) = index.checked_sub(FREQUENCY).filter(|&drive| drive < 2) else {
            return;
        };
        let State { now, since } = &mut self.state;
        let cycles = since[drive].cycles(*now, self.variables[index].value());
        since[drive] = Mark { at: *now, cycles };
    }
}

fn declare() -> Vec<ProcessVariable> {
    let of = |what: &str| DRIVES.map(|drive| format!("{what}/{drive}"));
    let angle =
        |name, default| ProcessVariable::new(name, Unit::Radian, -ANGLE_MAX..=ANGLE_MAX, default);
    let rate = |name| ProcessVariable::new(name, Unit::Hertz, 0.0..=FREQUENCY_MAX, 1.0);
    let offsets = of("offset").into_iter().zip(OFFSETS);
    let mut variables: Vec<_> = offsets.map(|(name, at)| angle(name, at)).collect();
    variables.extend(of("amplitude").map(|name| angle(name, AMPLITUDE)));
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
        self.mark(index);
        self.variables[index].set(value)
    }

    fn step(&mut self, elapsed: SimDuration, _inputs: &[f64], outputs: &mut [f64]) {
        self.state.now += elapsed;
        let each = self.drives.len();
        let (drives, abductions) = outputs.split_at_mut(each * self.legs.len());
        for (leg, outputs) in self.legs.iter().zip(drives.chunks_exact_mut(each)) {
            for (&drive, output) in self.drives.iter().zip(outputs) {
                *output = self.command(drive, leg.behind);
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
            return Err(mismatch(format!("one of {} variables", values.len())));
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
