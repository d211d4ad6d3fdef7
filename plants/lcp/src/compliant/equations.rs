//! The compliant model as the equations of motion of a plant.

use twinrig_compliant::events::{BODY_NAMES, ELEMENTS, ElementMotion, INSIDE_NAMES};
use twinrig_compliant::frame::{into_trunk, rotation};
use twinrig_compliant::lanes::{Features, Quad, dispatch};
use twinrig_compliant::{
    AbductionJoints, AbductionState, BodyContact, BodyPoints, DriveLaws, DriveState, Equations,
    Flow, JointState, SavedCompliant, Step, StepError, TrunkState,
};
use twinrig_contact::Surface;
use twinrig_kernel::signal;
use twinrig_legged::{
    DriveModels, FootMotion, Friction, LEGS, LegPosture, PartFault, Posture, Stored, surfaces_below,
};
use twinrig_robot::Robot;
use twinrig_runtime::PlantState;

use super::contact::Ends;
use super::energy::{Elements, StoredEnergy};
use super::model::{CompliantEquations, CompliantModel};
use super::motion::Advance;
use super::state::{Slope, State};
use crate::formulation::{Formulation, SavedFormulation};
use crate::model::Model;
use crate::model::real::Lanes;
use crate::model::start::start_state;
use crate::model::state::State as RigidState;
use crate::options::{LcpError, Options};

/// Equations and state of the plant.
pub(crate) type CompliantFlow<const N: usize, const P: usize, const A: usize, const B: usize> =
    Flow<CompliantEquations<N, P, A, B>>;

impl<const N: usize, const P: usize, const A: usize, const B: usize> Formulation
    for CompliantFlow<N, P, A, B>
{
}

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
pub(crate) fn initial<const N: usize, const P: usize, const A: usize, const B: usize>(
    robot: &Robot,
    options: &Options,
    joints: [AbductionJoints<Quad>; A],
    body: [BodyPoints<Quad>; B],
) -> Result<CompliantFlow<N, P, A, B>, LcpError> {
    let model = Model::<N>::new(robot, &options.setup)?;
    let state = start_state(&model, robot, options)?;
    let compliances = options.setup.compliances(robot)?;
    let model = CompliantModel::new(model, &compliances, joints, &body);
    Ok(Flow::new(
        CompliantEquations::new(model),
        compliant_state(&state),
        options.tolerance,
        options.features,
    ))
}

fn quad(lanes: Lanes) -> Quad {
    Quad(lanes.to_array())
}

/// Returns a state of the rigid model with relaxed soles.
pub(crate) fn compliant_state<const N: usize, const P: usize, const A: usize, const B: usize>(
    rigid: &RigidState<Lanes, N>,
) -> State<Quad, N, P, A, B> {
    State {
        position: Quad::of_three(rigid.position),
        attitude: Quad(rigid.attitude),
        velocity: Quad::of_three(rigid.velocity),
        turning: Quad::of_three(rigid.turning),
        angles: rigid.angles.map(quad),
        rates: rigid.rates.map(quad),
        pulley: quad(rigid.pulley),
        pulley_rate: quad(rigid.pulley_rate),
        bristles: [[Quad::splat(0.0); 2]; P],
        abduction: [JointState::AT_REST; A],
        body: [BodyContact::RELAXED; B],
    }
}

impl<const N: usize, const P: usize, const A: usize, const B: usize>
    CompliantEquations<N, P, A, B>
{
    /// Returns the motion of the ends of the first `links` links.
    fn ends(&self, state: &State<Quad, N, P, A, B>, links: usize) -> [FootMotion; LEGS] {
        let model = &self.model;
        let ends = Ends {
            model,
            state,
            links,
        };
        let [position, velocity] = dispatch(Features::Detected, ends);
        std::array::from_fn(|leg| FootMotion {
            position: position.map(|quad| quad.0[leg]).into(),
            velocity: velocity.map(|quad| quad.0[leg]).into(),
        })
    }

    /// Returns the state in a posture, with toes without load.
    fn with_relaxed_toes(&self, posture: &Posture) -> State<Quad, N, P, A, B> {
        let zero = Quad::splat(0.0);
        let upright = rotation(posture.attitude);
        let mut state = State {
            position: Quad::of_three(posture.position.into()),
            attitude: Quad(posture.attitude),
            velocity: Quad::of_three(into_trunk(&upright, posture.velocity.into())),
            turning: Quad::of_three(posture.angular_velocity.into()),
            angles: [zero; N],
            rates: [zero; N],
            pulley: zero,
            pulley_rate: zero,
            bristles: [[zero; 2]; P],
            abduction: [JointState::AT_REST; A],
            body: [BodyContact::RELAXED; B],
        };
        let legs = self.model.rigid.legs.iter().zip(&posture.legs);
        for (i, (leg, (_, from))) in legs.enumerate() {
            for k in 0..N {
                let toe = if k > 2 { leg.constants.toe[1] } else { 0.0 };
                state.angles[k].0[i] = from.angles[k.min(2)] + toe;
                state.rates[k].0[i] = from.rates[k.min(2)];
            }
            state.pulley.0[i] = from.pulley;
            state.pulley_rate.0[i] = from.pulley_rate;
        }
        state
    }
}

impl<const N: usize, const P: usize, const A: usize, const B: usize> Equations
    for CompliantEquations<N, P, A, B>
{
    type State = State<Quad, N, P, A, B>;
    type Slope = Slope<Quad, N, P, A, B>;
    type Saved = SavedFormulation;

    fn name(&self) -> &'static str {
        "lcp"
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
        let Model { moving_energy, .. } = &self.model.rigid;
        *moving_energy
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
            "toe",
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
            hip_rate: state.rates[0],
            pulley: state.pulley,
            pulley_rate: state.pulley_rate,
        }
    }

    fn abduction(&self, state: &Self::State) -> Option<AbductionState> {
        let (joints, state) = (self.model.legs.joints.first()?, state.abduction.first()?);
        Some(joints.state(state))
    }

    fn body_contact<'a>(&self, state: &'a Self::State) -> Option<&'a BodyContact<Quad>> {
        state.body.first()
    }

    #[inline]
    fn angles(&self, state: &Self::State, leg: usize) -> [f64; 3] {
        std::array::from_fn(|i| state.angles[i].0[leg])
    }

    fn feet(&self, state: &Self::State) -> [FootMotion; LEGS] {
        self.ends(state, 3)
    }

    fn surfaces(&self, state: &Self::State, feet: &[FootMotion; LEGS]) -> [Surface; LEGS] {
        let ground = self.model.rigid.ground.as_ref();
        let mut surfaces = surfaces_below(ground, feet);
        // Of foot and toe, the point nearer to the ground is the contact point.
        for links in 4..=N {
            let tips = self.ends(state, links);
            for (surface, below) in surfaces.iter_mut().zip(surfaces_below(ground, &tips)) {
                if below.gap < surface.gap {
                    *surface = below;
                }
            }
        }
        surfaces
    }

    fn visit(&self, state: &mut Self::State, to: &mut dyn FnMut(&mut Quad)) {
        *state = state.map(|quad| {
            let mut quad = quad;
            to(&mut quad);
            quad
        });
    }

    fn posture(&self, state: &Self::State) -> Posture {
        let legs = self.model.rigid.legs.iter().enumerate();
        let legs = legs.map(|(i, leg)| {
            let posture = LegPosture {
                angles: self.angles(state, i),
                rates: std::array::from_fn(|k| state.rates[k].0[i]),
                pulley: state.pulley.0[i],
                pulley_rate: state.pulley_rate.0[i],
            };
            (leg.name.clone(), posture)
        });
        self.trunk(state).posture(legs.collect())
    }

    fn extra_state(&self, state: &Self::State) -> Vec<(String, Vec<f64>)> {
        let toe = |(i, leg): (usize, &crate::model::LegModel<N>)| {
            let (angle, rate) = (state.angles[N - 1], state.rates[N - 1]);
            (
                signal::of_leg(&leg.name, "toe"),
                vec![angle.0[i], rate.0[i]],
            )
        };
        let legs = self.model.rigid.legs.iter();
        let names = legs.clone().map(|leg| leg.name.as_str());
        let joints = state
            .abduction
            .iter()
            .flat_map(|joints| joints.entries(names.clone()));
        legs.enumerate()
            .filter(|_| N > 3)
            .map(toe)
            .chain(joints)
            .collect()
    }

    fn state_of(
        &self,
        posture: &Posture,
        extra: &PlantState,
    ) -> Result<(Self::State, Vec<String>), PartFault> {
        let mut lines = Vec::new();
        let mut state = self.with_relaxed_toes(posture);
        let legs = self.model.rigid.legs.iter().map(|leg| leg.name.as_str());
        for (i, leg) in legs.clone().enumerate().filter(|_| N > 3) {
            let name = signal::of_leg(leg, "toe");
            let values = extra.get(&name).filter(|values| values.len() == 2);
            if let Some(values) = values.filter(|values| values.iter().all(|x| x.is_finite())) {
                state.angles[N - 1].0[i] = values[0];
                state.rates[N - 1].0[i] = values[1];
            } else {
                lines.push(format!(
                    "{name} is missing; the toe follows the third segment"
                ));
            }
        }
        for joints in &mut state.abduction {
            joints.adopt(legs.clone(), extra, &mut lines);
        }
        Ok((state, lines))
    }
}
