//! The independent parts of the robot as the dynamics of a plant.

use std::fmt::Debug;
use std::ops::Add;

use twinrig_compliant::lanes::Quad;
use twinrig_compliant::{AbductionJoints, BodyPoints};
use twinrig_kernel::{SimTime, signal};
use twinrig_legged::{
    Abduction, Base, Constraints, Contacts, Dynamics, Friction, FromRobot, LeggedError,
    LeggedPlant, PartFault, Posture, Setup, StepInputs, StepLoad,
};
use twinrig_robot::Robot;
use twinrig_runtime::{PlantState, WorkCounts};

use crate::compliant;
use crate::flow::{Flow, SavedFlow};
use crate::flow_error::FlowError;
use crate::formulation::{Formulation, SavedFormulation};
use crate::model::{MasslessError, Model, Options};
use crate::start::start;

/// Plant of a robot whose legs have mass at the foot only.
pub type Massless = LeggedPlant<dyn Formulation>;

impl FromRobot for dyn Formulation {
    type Options = Options;
    type Error = MasslessError;

    fn setup(options: &Options) -> &Setup {
        &options.setup
    }

    fn from_robot(robot: &Robot, options: &Options) -> Result<Box<Self>, MasslessError> {
        match options.constraints {
            Constraints::Rigid => Ok(Islands::from_robot(robot, options)?),
            Constraints::Compliant => compliant_flow(robot, options),
        }
    }
}

/// Builds a robot with compliant constraints, of those parts that it has.
fn compliant_flow(robot: &Robot, options: &Options) -> Result<Box<dyn Formulation>, MasslessError> {
    let setup = &options.setup;
    let has_body = match setup.contacts {
        Contacts::Feet => false,
        Contacts::Trunk => setup.reaching_contacts(robot)? != Contacts::Feet,
        Contacts::All => {
            let plant = "`massless`";
            return Err(LeggedError::WithoutSegments { plant }.into());
        }
    };
    let joints = || AbductionJoints::new(robot, setup);
    let body = || BodyPoints::new(robot, setup);
    let is_abducting = setup.abduction != Abduction::Locked;
    match (is_abducting, has_body) {
        (false, false) => initial::<0, 0>(robot, options, [], []),
        (true, false) => initial::<1, 0>(robot, options, [joints()?], []),
        (false, true) => initial::<0, 1>(robot, options, [], [body()?]),
        (true, true) => initial::<1, 1>(robot, options, [joints()?], [body()?]),
    }
}

/// Builds a plant with compliant constraints.
fn initial<const A: usize, const B: usize>(
    robot: &Robot,
    options: &Options,
    joints: [AbductionJoints<Quad>; A],
    body: [BodyPoints<Quad>; B],
) -> Result<Box<dyn Formulation>, MasslessError> {
    let flow = compliant::initial::<A, B>(robot, options, joints, body)?;
    Ok(Box::new(flow))
}

impl Formulation for Islands {}

/// Independent parts: the whole robot, or each leg where the trunk is fixed. Removing a leg then
/// changes no bit of the others.
#[derive(Debug, Clone)]
pub struct Islands {
    pub(crate) flows: Vec<Flow>,
    /// Flows at the start of the present step, for the case that one fails after others have
    /// advanced.
    step_start: Vec<SavedFlow>,
}

impl FromRobot for Islands {
    type Options = Options;
    type Error = MasslessError;

    fn setup(options: &Options) -> &Setup {
        &options.setup
    }

    fn from_robot(robot: &Robot, options: &Options) -> Result<Box<Self>, MasslessError> {
        options
            .setup
            .check_locked("`massless` with rigid constraints")?;
        options
            .setup
            .check_feet_only("`massless` with rigid constraints")?;
        let flows = islands(robot, options)?
            .iter()
            .map(|island| {
                let model = Model::new(robot, island)?;
                let (state, inputs) = start(robot, &model, &island.setup)?;
                Flow::new(model, &state, inputs)
                    .map_err(|error| MasslessError::Start(error.to_string()))
            })
            .collect::<Result<Vec<_>, _>>()?;
        Ok(Box::new(Self {
            step_start: Vec::with_capacity(flows.len()),
            flows,
        }))
    }
}

impl Islands {
    /// Restores the state at the start of the step: other flows may have advanced.
    fn roll_back(&mut self) {
        for (flow, saved) in self.flows.iter_mut().zip(&self.step_start) {
            flow.restore(saved)
                .expect("the legs have a pose in every state that was saved");
        }
    }
}

impl FlowError {
    /// Fault of the part of the robot that failed.
    fn of(&self, model: &Model) -> PartFault {
        let part = match self {
            Self::NoPose(no_pose) => signal::leg_path(&model.legs[no_pose.leg].name),
            Self::ImpactGivesEnergy { leg, .. } => signal::leg_path(&model.legs[*leg].name),
            Self::SolveError(_) => "contact".to_owned(),
            Self::NotFinite
            | Self::NotConverged { .. }
            | Self::Penetration { .. }
            | Self::Dissipation { .. } => "integrator".to_owned(),
        };
        PartFault::new(part, self.to_string())
    }
}

/// Options of the independent parts: the robot, or each of its legs where the trunk is fixed.
fn islands(robot: &Robot, options: &Options) -> Result<Vec<Options>, MasslessError> {
    let setup = &options.setup;
    let selected_mounts = setup.selected_mounts(robot)?;
    if setup.base != Base::Fixed || selected_mounts.is_empty() {
        return Ok(vec![options.clone()]);
    }
    let single_leg = |name: &String| Options {
        setup: Setup {
            legs: vec![name.clone()],
            ..setup.clone()
        },
        ..options.clone()
    };
    Ok(selected_mounts
        .iter()
        .map(|mount| single_leg(&mount.name))
        .collect())
}

impl Dynamics for Islands {
    type Saved = SavedFormulation;

    fn name(&self) -> &'static str {
        "massless"
    }

    fn initial_inputs(&self, inputs: &mut [f64]) {
        let initial_inputs = self.flows.iter().flat_map(Flow::port_inputs);
        for (input, first) in inputs.iter_mut().zip(initial_inputs) {
            *input = *first;
        }
    }

    fn set_inputs(&mut self, inputs: &StepInputs<'_>) {
        let port_inputs = self.flows.iter_mut().flat_map(Flow::port_inputs_mut);
        for (port_input, input) in port_inputs.zip(inputs.mean) {
            *port_input = *input;
        }
    }

    fn set_friction(&mut self, friction: &Friction) {
        let mut legs = friction.legs.iter();
        for flow in &mut self.flows {
            let of_flow = flow.model.friction.iter_mut().take(flow.model.legs.len());
            of_flow
                .zip(legs.by_ref())
                .for_each(|(to, from)| *to = *from);
        }
    }

    fn set_load(&mut self, load: &StepLoad) {
        let mut first_leg = 0;
        for flow in &mut self.flows {
            flow.set_load(load, first_leg);
            first_leg += flow.model.legs.len();
        }
    }

    fn advance(&mut self, _from: SimTime, seconds: f64) -> Result<(), PartFault> {
        if self.flows.len() > 1 {
            self.step_start.clear();
            self.step_start.extend(self.flows.iter().map(Flow::save));
        }
        for i in 0..self.flows.len() {
            if let Err(error) = self.flows[i].run(seconds) {
                self.roll_back();
                return Err(error.of(&self.flows[i].model));
            }
        }
        Ok(())
    }

    fn counts(&self) -> WorkCounts {
        let counts = self.flows.iter().map(|flow| flow.counts);
        counts.fold(WorkCounts::default(), Add::add)
    }

    fn save(&self) -> SavedFormulation {
        SavedFormulation::Rigid(self.flows.iter().map(Flow::save).collect())
    }

    fn restore(&mut self, saved: SavedFormulation) -> Result<(), String> {
        let SavedFormulation::Rigid(saved) = saved else {
            return Err("compliant constraints".to_owned());
        };
        if saved.len() != self.flows.len() {
            return Err(format!("{} independent parts", saved.len()));
        }
        for (flow, saved) in self.flows.iter_mut().zip(&saved) {
            flow.restore(saved).map_err(|no_pose| no_pose.to_string())?;
        }
        Ok(())
    }

    fn posture(&self) -> Posture {
        self.shared_posture()
    }

    fn resume_from(
        &mut self,
        posture: &Posture,
        _extra: &PlantState,
    ) -> Result<Vec<String>, PartFault> {
        self.flows = self.flows_at(posture)?;
        Ok(Vec::new())
    }
}

#[cfg(test)]
mod tests;
