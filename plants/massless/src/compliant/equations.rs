//! The compliant model as the equations of motion of a plant.

use nalgebra::{Matrix3, Vector3};
use twinrig_compliant::events::{BODY_NAMES, ELEMENTS, ElementMotion, INSIDE_NAMES};
use twinrig_compliant::frame::{into_world, rotation};
use twinrig_compliant::lanes::{Features, Quad, dispatch};
use twinrig_compliant::{
    AbductionJoints, AbductionState, BodyContact, BodyPoints, DriveLaws, DriveState, Equations,
    Flow, PantographConstants, SavedCompliant, Step, StepError, TrunkState,
};
use twinrig_contact::Surface;
use twinrig_kernel::signal;
use twinrig_legged::{
    Base, DriveModels, FootMotion, Friction, LEGS, LegPosture, PartFault, Posture, Stored,
    surfaces_below,
};
use twinrig_robot::leg::Planar;
use twinrig_robot::{GRAVITY, Robot};
use twinrig_runtime::PlantState;

use super::energy::{Elements, LegMotions, Motion, StoredEnergy};
use super::model::{CompliantEquations, CompliantModel};
use super::motion::Advance;
use super::state::{Slope, State};
use crate::formulation::{Formulation, SavedFormulation};
use crate::model::{MasslessError, Model, Options};
use crate::start::start;

/// Equations and state of the plant.
pub(crate) type CompliantFlow<const A: usize = 0, const B: usize = 0> =
    Flow<CompliantEquations<A, B>>;

impl<const A: usize, const B: usize> Formulation for CompliantFlow<A, B> {}

impl From<SavedCompliant> for SavedFormulation {
    fn from(saved: SavedCompliant) -> Self {
        Self::Compliant(saved)
    }
}

impl TryFrom<SavedFormulation> for SavedCompliant {
    type Error = String;

    fn try_from(saved: SavedFormulation) -> Result<Self, String> {
        match saved {
            SavedFormulation::Compliant(saved) => Ok(saved),
            SavedFormulation::Rigid(_) => Err("rigid constraints".to_owned()),
        }
    }
}

/// Builds the compliant flow in the start state.
pub(crate) fn initial<const A: usize, const B: usize>(
    robot: &Robot,
    options: &Options,
    joints: [AbductionJoints<Quad>; A],
    body: [BodyPoints<Quad>; B],
) -> Result<CompliantFlow<A, B>, MasslessError> {
    if options.tolerance.is_nan() || options.tolerance <= 0.0 {
        return Err(MasslessError::Tolerance(options.tolerance));
    }
    let setup = &options.setup;
    let model = Model::new(robot, options)?;
    if model.drives.is_none() {
        return Err(MasslessError::WithoutDrives);
    }
    let (rigid, _) = start(robot, &model, setup)?;
    let mut angles = Vec::new();
    for leg in &model.legs {
        angles.push(setup.start.of_leg(&leg.name, &leg.pantograph)?.angles);
    }
    let mounts = setup.selected_mounts(robot)?.into_iter().zip(&model.legs);
    let pantographs: Vec<_> = mounts
        .map(|(mount, leg)| PantographConstants::new(&mount.leg, &leg.pantograph))
        .collect();
    let compliances = setup.compliances(robot)?;
    let model = CompliantModel::new(model, &pantographs, &compliances, joints, &body);
    let mut state = State::at_rest();
    state.position = Quad::of_three(rigid.position().into());
    for (i, angles) in angles.iter().enumerate() {
        let velocity = rigid.foot_velocity(i);
        for (quad, angle) in state.angles.iter_mut().zip(angles) {
            quad.0[i] = *angle;
        }
        state.hip_rate.0[i] = rigid.hip_rate(i);
        state.pulley.0[i] = rigid.pulley(i);
        (state.foot[0].0[i], state.foot[1].0[i]) = (velocity.x, velocity.y);
    }
    Ok(Flow::new(
        CompliantEquations::new(model),
        state,
        options.tolerance,
        options.features,
    ))
}

/// Returns the matrix of an attitude.
fn matrix(attitude: [f64; 4]) -> Matrix3<f64> {
    let rows = rotation(attitude);
    Matrix3::from_fn(|i, j| rows[i][j])
}

impl<const A: usize, const B: usize> CompliantEquations<A, B> {
    /// Returns the velocities of the feet within their legs, forward and up \[m/s\].
    pub(super) fn relative(&self, state: &State<Quad, A, B>) -> [Quad; 2] {
        self.motion(state).relative
    }

    fn motion(&self, state: &State<Quad, A, B>) -> Motion {
        let model = &self.model;
        dispatch(Features::Detected, LegMotions { model, state })
    }
}

impl<const A: usize, const B: usize> Equations for CompliantEquations<A, B> {
    type State = State<Quad, A, B>;
    type Slope = Slope<Quad, A, B>;
    type Saved = SavedFormulation;

    fn name(&self) -> &'static str {
        "massless"
    }

    fn drives(&self) -> Option<&DriveModels> {
        self.model.rigid.drives.as_ref()
    }

    #[inline]
    fn laws(&self) -> &DriveLaws {
        &self.model.drives
    }

    #[inline]
    fn hip_references(&self) -> &[f64] {
        &self.hip_references
    }

    fn centre_of_trunk(&self) -> Option<[f64; 3]> {
        self.model.rigid.centre_of_trunk().map(Into::into)
    }

    fn set_friction(&mut self, friction: &Friction) {
        self.model.set_friction(friction);
    }

    fn step(&self, features: Features, step: Step<'_, Self>) -> Result<(), StepError> {
        let model = &self.model;
        dispatch(features, Advance { model, step })
    }

    fn stored(&self, features: Features, state: &Self::State) -> Stored {
        let model = &self.model;
        dispatch(features, StoredEnergy { model, state })
    }

    fn energy_scale(&self) -> f64 {
        let CompliantModel { rigid, mass, .. } = &self.model;
        let held = if rigid.base == Base::Fixed {
            rigid.mass
        } else {
            0.0
        };
        (mass - held) * GRAVITY * rigid.reach
    }

    fn elements(&self, features: Features, state: &Self::State) -> ElementMotion {
        let model = &self.model;
        dispatch(features, Elements { model, state })
    }

    fn element_names(&self) -> [&'static str; ELEMENTS] {
        let [a, b, c, d, e, f] = INSIDE_NAMES;
        let [knee, ankle, lower, upper] = BODY_NAMES;
        [
            a,
            b,
            c,
            d,
            e,
            f,
            "ground",
            "ankle",
            "abduction",
            knee,
            ankle,
            lower,
            upper,
        ]
    }

    fn leg_name(&self, leg: usize) -> &str {
        &self.model.rigid.legs[leg].name
    }

    fn trunk(&self, state: &Self::State) -> TrunkState {
        TrunkState::from(state.trunk())
    }

    #[inline]
    fn driven(&self, state: &Self::State) -> DriveState {
        DriveState {
            hip: state.angles[0],
            hip_rate: state.hip_rate,
            pulley: state.pulley,
            pulley_rate: state.pulley_rate,
        }
    }

    fn body_contact<'a>(&self, state: &'a Self::State) -> Option<&'a BodyContact<Quad>> {
        state.body.first()
    }

    #[inline]
    fn angles(&self, state: &Self::State, leg: usize) -> [f64; 3] {
        state.angles.map(|quad| quad.0[leg])
    }

    fn feet(&self, state: &Self::State) -> [FootMotion; LEGS] {
        let (trunk, motion) = (self.trunk(state), self.motion(state));
        let upright = rotation(trunk.attitude);
        let mut feet = [FootMotion::default(); LEGS];
        for (leg, foot) in feet
            .iter_mut()
            .enumerate()
            .take(self.model.rigid.legs.len())
        {
            let place = into_world(&upright, motion.place.map(|quad| quad.0[leg]));
            let velocity = into_world(&upright, motion.velocity.map(|quad| quad.0[leg]));
            foot.position = Vector3::from(trunk.position) + Vector3::from(place);
            foot.velocity = velocity.into();
        }
        feet
    }

    fn surfaces(&self, _: &Self::State, feet: &[FootMotion; LEGS]) -> [Surface; LEGS] {
        surfaces_below(self.model.rigid.ground.as_ref(), feet)
    }

    fn visit(&self, state: &mut Self::State, to: &mut dyn FnMut(&mut Quad)) {
        *state = state.map(|quad| {
            let mut quad = quad;
            to(&mut quad);
            quad
        });
    }

    fn posture(&self, state: &Self::State) -> Posture {
        let motion = self.motion(state);
        let legs = self.model.rigid.legs.iter().enumerate();
        let legs = legs.map(|(i, leg)| {
            let posture = LegPosture {
                angles: self.angles(state, i),
                rates: motion.rates.map(|quad| quad.0[i]),
                pulley: state.pulley.0[i],
                pulley_rate: state.pulley_rate.0[i],
            };
            (leg.name.clone(), posture)
        });
        let mut posture = self.trunk(state).posture(legs.collect());
        let (upright, arm) = (matrix(state.attitude.0), -self.model.rigid.centre);
        posture.position += upright * arm;
        posture.velocity += upright * posture.angular_velocity.cross(&arm);
        posture
    }

    fn abduction(&self, state: &Self::State) -> Option<AbductionState> {
        let (joints, state) = (self.model.legs.joints.first()?, state.abduction.first()?);
        Some(joints.state(state))
    }

    fn extra_state(&self, state: &Self::State) -> Vec<(String, Vec<f64>)> {
        let names = self.model.rigid.legs.iter().map(|leg| leg.name.as_str());
        state
            .abduction
            .iter()
            .flat_map(|joints| joints.entries(names.clone()))
            .collect()
    }

    fn state_of(
        &self,
        posture: &Posture,
        extra: &PlantState,
    ) -> Result<(Self::State, Vec<String>), PartFault> {
        let rigid = &self.model.rigid;
        let upright = matrix(posture.attitude);
        let turning = posture.angular_velocity;
        let velocity = upright.tr_mul(&posture.velocity) + turning.cross(&rigid.centre);
        let position = posture.position + upright * rigid.centre;
        let mut state = State::at_rest();
        state.position = Quad::of_three(position.into());
        state.attitude = Quad(posture.attitude);
        state.velocity = Quad::of_three(velocity.into());
        state.turning = Quad::of_three(turning.into());
        let mut within = [Quad::splat(0.0); 2];
        for (i, (leg, (_, from))) in rigid.legs.iter().zip(&posture.legs).enumerate() {
            let foot = leg.foot_and_velocity(from);
            let (foot, relative) =
                foot.map_err(|why| PartFault::new(signal::leg_path(&leg.name), why))?;
            (within[0].0[i], within[1].0[i]) = (relative.x, relative.y);
            let foot: Planar = relative + leg.carried(foot, velocity, turning);
            for k in 0..3 {
                state.angles[k].0[i] = from.angles[k];
            }
            state.hip_rate.0[i] = from.rates[0];
            state.pulley.0[i] = from.pulley;
            state.pulley_rate.0[i] = from.pulley_rate;
            (state.foot[0].0[i], state.foot[1].0[i]) = (foot.x, foot.y);
        }
        let mut lines = Vec::new();
        for i in 0..A {
            let names = rigid.legs.iter().map(|leg| leg.name.as_str());
            state.abduction[i].adopt(names, extra, &mut lines);
            // The frame carries the foot.
            let relative = self.relative(&state);
            for (foot, (wanted, found)) in state.foot.iter_mut().zip(within.iter().zip(relative)) {
                for leg in 0..LEGS {
                    foot.0[leg] += wanted.0[leg] - found.0[leg];
                }
            }
        }
        Ok((state, lines))
    }
}
