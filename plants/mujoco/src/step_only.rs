//! Steps of MuJoCo alone: the loop that a user of the engine writes without this crate.

use twinrig_legged::Ledger;

use crate::drives::{self, DriveStates};
use crate::flow::Flow;
use crate::options::Coordinates;

impl Flow {
    /// Advances by a step of MuJoCo, bit for bit `mj_step`, and by nothing else. Commands are
    /// written before it.
    pub(crate) fn step_alone(&mut self, seconds: f64) {
        for leg in 0..self.at.legs.len() {
            self.command(leg, seconds);
        }
        self.engine.step_unchecked(seconds);
    }

    /// Writes the commands of a leg to its position actuators, or the rates that its servos request
    /// to their flywheels.
    fn command(&mut self, leg: usize, seconds: f64) {
        let inputs = self.inputs[leg];
        for (actuator, command) in self.at.legs[leg].actuators.iter().zip(inputs.commands()) {
            if let Some(actuator) = actuator {
                self.engine.data_mut().ctrl_mut()[*actuator] = command;
            }
        }
        let states = self.drive_states_of_leg(leg);
        drives::set_flywheels(
            &mut self.engine,
            &self.model,
            &self.at.legs[leg],
            &inputs,
            &states,
            seconds,
        );
    }

    /// Returns angles and rates of a leg's drives, from MuJoCo's coordinates.
    fn drive_states_of_leg(&self, leg: usize) -> DriveStates {
        let (leg_model, at) = (&self.model.legs[leg], &self.at.legs[leg]);
        let (qpos, qvel) = (self.engine.data().qpos(), self.engine.data().qvel());
        let reference = leg_model.pantograph.hip_reference();
        let [place, dof] = at.segments[0][2];
        let angle = match self.model.coordinates {
            Coordinates::Minimal => qpos[place] + reference,
            Coordinates::Maximal => qpos[place],
        };
        let hip = [angle - reference, qvel[dof]];
        let radius = leg_model.pulley_radius;
        let pulley = at.pulley.map_or([0.0; 2], |[place, dof]| {
            [qpos[place] / radius, qvel[dof] / radius]
        });
        let abduction = at.abduction;
        let abduction = abduction.map_or([0.0; 2], |[place, dof]| [qpos[place], qvel[dof]]);
        [hip, pulley, abduction]
    }

    /// Updates the readings after steps of the engine alone; its energy balance is the stored
    /// energy, without an account of its changes.
    pub(crate) fn read_engine(&mut self) {
        self.update_kinematics();
        self.ledger = Ledger::opened(self.stored());
    }
}

#[cfg(test)]
mod tests {
    use twinrig_testing::robots::{LEGS, pose, robot, suspended};

    use crate::engine::Engine;
    use crate::flow::Flow;
    use crate::mjcf::mjcf;
    use crate::options::{Coordinates, Integrator, Options};

    #[test]
    fn step_is_that_of_mujoco() {
        for integrator in Integrator::ALL {
            let setup = suspended(&LEGS, pose([10.0, -9.5, 9.5], [0.0; 3]), 2000);
            let mut options = Options::new(setup, Coordinates::Minimal);
            options.numerics.integrator = integrator;
            options.step_only = true;
            let mut flow = Flow::new(&robot(), &options).unwrap();
            let mut engine = Engine::compile(&mjcf(&robot(), &options).unwrap()).unwrap();
            engine.restore(&flow.engine.save()).unwrap();
            for _ in 0..150 {
                flow.run(2e-3).unwrap();
                engine.data_mut().step();
            }
            assert_eq!(flow.engine.save(), engine.save(), "{integrator:?}");
        }
    }
}
