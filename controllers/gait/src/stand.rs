//! The controller `stand`: a constant pose.

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Port, SimDuration, Snapshot, SnapshotError, Unit};
use twinrig_robot::Robot;
use twinrig_runtime::{Process, ProcessVariable, VariableError};

use crate::limb::Limb;
use crate::{Abduction, GaitError};

/// Holds every foot at a constant position relative to its hip.
///
/// Outputs as of [`crate::Cpg`]; variables `hip_height/fore`, `hip_height/hind`,
/// `mid_stance_offset/fore` and `mid_stance_offset/hind` \[m\] and `splay` \[rad\], with the same
/// ranges. A new value takes effect at the next step.
#[derive(Debug, Clone)]
pub struct Stand {
    limbs: Vec<Limb>,
    variables: Vec<ProcessVariable>,
    abduction: Abduction,
    state: State,
}

/// Index of the variable `splay`.
const SPLAY: usize = 4;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct State {
    /// Commands of the active legs, computed when a variable changes \[rad\].
    commands: Vec<[f64; 2]>,
}

impl Stand {
    /// Name in scenarios.
    pub const NAME: &'static str = "stand";

    /// Creates a controller for `legs` of `robot`.
    ///
    /// # Errors
    /// An unknown leg, or a leg with an impossible geometry.
    pub fn new(robot: &Robot, legs: &[&str]) -> Result<Self, GaitError> {
        let mut limbs = Limb::of_robot(robot, legs)?;
        let variables = declare(&limbs);
        limbs.retain(|limb| limb.active);
        let mut stand = Self {
            state: State {
                commands: vec![[0.0; 2]; limbs.len()],
            },
            limbs,
            variables,
            abduction: Abduction::None,
        };
        stand.update_commands();
        Ok(stand)
    }

    /// The process variables of a controller for `robot`, at their defaults.
    ///
    /// # Errors
    /// A leg whose geometry is impossible.
    pub fn variables_of(robot: &Robot) -> Result<Vec<ProcessVariable>, GaitError> {
        Ok(declare(&Limb::of_robot(robot, &[])?))
    }

    /// Enables abduction commands.
    #[must_use]
    pub fn with_abduction(mut self, abduction: Abduction) -> Self {
        self.abduction = abduction;
        self
    }

    fn update_commands(&mut self) {
        for (limb, command) in self.limbs.iter().zip(&mut self.state.commands) {
            let end = limb.corner.end();
            let target = [
                self.variables[2 + end].value(),
                -self.variables[end].value(),
            ];
            (*command, _) = limb.command(target);
        }
    }
}

fn declare(limbs: &[Limb]) -> Vec<ProcessVariable> {
    let lengths = Limb::lengths_max(limbs);
    let mut variables = Vec::new();
    for (end, reach) in ["fore", "hind"].into_iter().zip(Limb::reaches(limbs)) {
        let height = 0.93 * reach.end();
        let name = format!("hip_height/{end}");
        variables.push(ProcessVariable::new(name, Unit::Meter, reach, height));
    }
    for (end, length) in ["fore", "hind"].into_iter().zip(lengths) {
        variables.push(ProcessVariable::new(
            format!("mid_stance_offset/{end}"),
            Unit::Meter,
            -length..=length,
            0.0,
        ));
    }
    variables.push(Abduction::variable());
    variables
}

impl Process for Stand {
    fn name(&self) -> &str {
        Self::NAME
    }

    fn ports(&self) -> Vec<Port> {
        let abducted = self.abduction.of(&self.limbs);
        let drives = self.limbs.iter().flat_map(Limb::ports);
        drives
            .chain(abducted.map(|limb| limb.port("abduction")))
            .collect()
    }

    fn variables(&self) -> &[ProcessVariable] {
        &self.variables
    }

    fn set_variable(&mut self, index: usize, value: f64) -> Result<(), VariableError> {
        let count = self.variables.len();
        let variable = self
            .variables
            .get_mut(index)
            .ok_or(VariableError::NoSuchIndex { index, count })?;
        if index == SPLAY {
            self.abduction.check(variable, value)?;
        }
        variable.set(value)?;
        self.update_commands();
        Ok(())
    }

    fn step(&mut self, _elapsed: SimDuration, _inputs: &[f64], outputs: &mut [f64]) {
        let (drives, abductions) = outputs.split_at_mut(2 * self.limbs.len());
        for (output, command) in drives.chunks_exact_mut(2).zip(&self.state.commands) {
            output.copy_from_slice(command);
        }
        let splay = self.variables[SPLAY].value();
        self.abduction.command(&self.limbs, splay, abductions);
    }

    fn save(&self) -> Snapshot {
        let values: Vec<f64> = self.variables.iter().map(ProcessVariable::value).collect();
        Snapshot::of(&(values, &self.state))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (values, state): (Vec<f64>, State) = snapshot.read()?;
        let mismatch = |found: String| SnapshotError::Mismatch {
            expected: format!("a stand on {} legs", self.limbs.len()),
            found,
        };
        if values.len() != self.variables.len() || state.commands.len() != self.limbs.len() {
            return Err(mismatch(format!(
                "a stand on {} legs",
                state.commands.len()
            )));
        }
        let mut variables = self.variables.clone();
        for (variable, value) in variables.iter_mut().zip(values) {
            variable
                .set(value)
                .map_err(|error| mismatch(error.to_string()))?;
        }
        self.variables = variables;
        self.state = state;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn feet_are_at_the_positions_of_the_variables() {
        let robot = Robot::example();
        let mut stand = Stand::new(&robot, &["LF", "RH"]).unwrap();
        stand.set_variable(1, 0.12).unwrap();
        stand.set_variable(3, -0.01).unwrap();
        let mut outputs = [0.0; 4];
        stand.step(SimDuration::ZERO, &[], &mut outputs);
        let leg = twinrig_robot::leg::Pantograph::new(&robot.legs[3].leg).unwrap();
        let expected = leg
            .inverse_closed(twinrig_robot::leg::Planar::new(-0.01, -0.12))
            .unwrap();
        assert_eq!(outputs[2..], [expected.hip, expected.knee]);
        let names: Vec<_> = stand.ports().into_iter().map(|port| port.name).collect();
        assert_eq!(
            names,
            [
                "leg/LF/hip/command",
                "leg/LF/knee/command",
                "leg/RH/hip/command",
                "leg/RH/knee/command"
            ]
        );
    }

    #[test]
    fn commands_are_constant_and_restored_bit_for_bit() {
        let mut stand = Stand::new(&Robot::example(), &["LF", "RF"]).unwrap();
        let mut first = [0.0; 4];
        stand.step(SimDuration::ZERO, &[], &mut first);
        let saved = stand.save();
        stand.set_variable(0, 0.1).unwrap();
        stand.restore(&saved).unwrap();
        let mut later = [0.0; 4];
        stand.step(SimDuration::from_secs(5), &[], &mut later);
        assert_eq!(first.map(f64::to_bits), later.map(f64::to_bits));
    }
}
