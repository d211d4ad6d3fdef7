//! The robot in Rapier as the dynamics of a plant.

use serde::{Deserialize, Serialize};
use twinrig_kernel::SimTime;
use twinrig_legged::{
    DriveModels, Dynamics, Friction, FromRobot, LegPosture, LeggedPlant, PartFault, Posture, Setup,
    StepInputs, StepLoad, abduction_entry, adopt_abduction,
};
use twinrig_robot::Robot;
use twinrig_runtime::{PlantState, WorkCounts};

use crate::assembly::Handles;
use crate::conversion::{to_nalgebra, wxyz};
use crate::options::{Options, RapierError};
use crate::robot::{Machine, State};
use crate::world::Sets;

/// A robot in Rapier.
pub type Rapier = LeggedPlant<Machine>;

/// Serialised state.
#[derive(Serialize, Deserialize)]
pub struct SavedMachine {
    state: State,
    handles: Handles,
    sets: Sets,
}

impl FromRobot for Machine {
    type Options = Options;
    type Error = RapierError;

    fn setup(options: &Options) -> &Setup {
        &options.setup
    }

    fn from_robot(robot: &Robot, options: &Options) -> Result<Box<Self>, RapierError> {
        Self::new(robot, options).map(Box::new)
    }
}

impl Dynamics for Machine {
    type Saved = SavedMachine;

    fn name(&self) -> &'static str {
        "rapier"
    }

    fn initial_inputs(&self, inputs: &mut [f64]) {
        inputs.fill(0.0);
        if let Some(DriveModels::Servos(_)) = self.model.drives {
            let legs = self.state.legs.iter().zip(&self.model.legs);
            for ((leg_state, leg), command) in legs.zip(inputs.chunks_exact_mut(2)) {
                command[0] = leg_state.drives[0].command[0] - leg.pantograph.hip_reference();
                command[1] = leg_state.drives[1].command[0];
            }
        }
        let of_drives = self.options.setup.drives.inputs() * self.state.legs.len();
        for (command, leg_state) in inputs[of_drives..].iter_mut().zip(&self.state.legs) {
            *command = leg_state.abduction.command[0];
        }
    }

    fn set_inputs(&mut self, inputs: &StepInputs<'_>) {
        let legs = self.state.legs.iter_mut().zip(&self.model.legs);
        match &self.model.drives {
            None => {}
            Some(DriveModels::Servos(_)) => {
                for ((leg_state, leg), command) in legs.zip(inputs.mean.chunks_exact(2)) {
                    leg_state.drives[0].command[0] = command[0] + leg.pantograph.hip_reference();
                    leg_state.drives[1].command[0] = command[1];
                }
            }
            Some(DriveModels::Motors(_)) => {
                for ((leg_state, _), command) in legs.zip(inputs.mean.chunks_exact(4)) {
                    leg_state.drives[0].command = [command[0], command[1]];
                    leg_state.drives[1].command = [command[2], command[3]];
                }
            }
        }
        let of_drives = self.options.setup.drives.inputs() * self.state.legs.len();
        for (leg_state, command) in self.state.legs.iter_mut().zip(&inputs.mean[of_drives..]) {
            leg_state.abduction.command[0] = *command;
        }
    }

    fn set_friction(&mut self, friction: &Friction) {
        for (leg, of_leg) in self.handles.legs.iter().zip(friction.legs) {
            for collider in leg.contact.iter().flatten() {
                if let Some(collider) = self.world.sets.colliders.get_mut(*collider) {
                    collider.set_friction(of_leg);
                }
            }
        }
        self.set_body_friction(&friction.legs, friction.trunk);
    }

    fn set_load(&mut self, load: &StepLoad) {
        self.set_push_load(load);
    }

    /// Advances by one step of the plant, divided into substeps.
    fn advance(&mut self, _from: SimTime, seconds: f64) -> Result<(), PartFault> {
        self.push_load.elapsed_s = 0.0;
        let substeps = self.options.solver.substeps;
        let each = seconds / f64::from(substeps);
        let mut substeps = 0..substeps;
        let advanced = substeps.try_for_each(|_| self.step(each));
        advanced.map_err(|divergence| PartFault::new(divergence.part, divergence.why))
    }

    fn update_readings(&mut self) {
        if self.options.step_only {
            self.read_engine();
        }
    }

    fn counts(&self) -> WorkCounts {
        self.state.counts
    }

    fn constraint_violation(&self) -> Option<f64> {
        Some(self.violation().max(self.body_depth()))
    }

    fn save(&self) -> SavedMachine {
        SavedMachine {
            state: self.state.clone(),
            handles: self.handles.clone(),
            sets: self.world.sets.clone(),
        }
    }

    fn restore(&mut self, saved: SavedMachine) -> Result<(), String> {
        let legs = self.state.legs.len();
        if saved.state.legs.len() != legs || saved.handles.legs.len() != legs {
            return Err(format!("{} legs, expected {legs}", saved.state.legs.len()));
        }
        let carriers = saved.handles.legs.iter().zip(&self.handles.legs);
        if carriers
            .into_iter()
            .any(|(a, b)| a.carrier.is_some() != b.carrier.is_some())
        {
            return Err("its joints of abduction are others".to_owned());
        }
        self.state = saved.state;
        self.handles = saved.handles;
        self.world.replace(saved.sets);
        Ok(())
    }

    fn posture(&self) -> Posture {
        let trunk = self.trunk();
        let legs = self.model.legs.iter().enumerate().map(|(i, leg)| {
            let leg_state = &self.state.legs[i];
            let posture = LegPosture {
                angles: leg_state.angles,
                rates: self.view(i).rates(),
                pulley: leg_state.drives[1].angle,
                pulley_rate: leg_state.drives[1].rate,
            };
            (leg.name.clone(), posture)
        });
        Posture {
            position: to_nalgebra(trunk.pose.translation),
            attitude: wxyz(trunk.pose.rotation),
            velocity: to_nalgebra(trunk.velocity),
            angular_velocity: to_nalgebra(trunk.pose.rotation.inverse() * trunk.turning),
            legs: legs.collect(),
        }
    }

    fn extra_state(&self) -> Vec<(String, Vec<f64>)> {
        let legs = self.model.legs.iter().zip(&self.state.legs);
        legs.filter(|(leg, _)| leg.carrier.is_some())
            .map(|(leg, at)| abduction_entry(&leg.name, [at.abduction.angle, at.abduction.rate]))
            .collect()
    }

    fn resume_from(
        &mut self,
        posture: &Posture,
        extra: &PlantState,
    ) -> Result<Vec<String>, PartFault> {
        let mut lines = Vec::new();
        let legs = self.model.legs.iter();
        let abduction = legs.map(|leg| match leg.carrier {
            Some(_) => adopt_abduction(extra, &leg.name, &mut lines),
            None => [0.0; 2],
        });
        let abduction: Vec<_> = abduction.collect();
        *self = Self::at(
            self.model.clone(),
            self.options.clone(),
            posture,
            &abduction,
        );
        self.hold_commands();
        Ok(lines)
    }
}
