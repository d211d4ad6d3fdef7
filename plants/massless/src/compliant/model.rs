//! Constants of the compliant model, of four legs side by side.

use twinrig_compliant::lanes::{LANES, Lanes, Quad, Simd};
use twinrig_compliant::{
    AbductionJoints, BodyPoints, DriveLaws, Element, LegFrame, PantographConstants, Pantographs,
    Sole, StepControl, TrunkMotion,
};
use twinrig_legged::Friction;
use twinrig_robot::{Compliance, GRAVITY};

use super::state::State;
use super::trunk::TrunkConstants;
use crate::model::Model;

/// Constants of the legs; `T` is [`Quad`] in memory, or lanes. An absent leg has no mass and no
/// force, and its links have no rates.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Legs<T, const A: usize> {
    pub(crate) pantographs: Pantographs<T, 3>,
    /// Reciprocal lengths of the second and the third link \[1/m\].
    pub(crate) per_links: [T; 2],
    /// Hip in the trunk frame, relative to the centre of mass \[m\].
    pub(crate) hip: [T; 3],
    /// Mass of the foot \[kg\], and its reciprocal.
    pub(crate) mass: T,
    pub(crate) per_mass: T,
    pub(crate) sole: Sole<T>,
    /// Joints of abduction; positions of hips are relative to their axes.
    pub(crate) joints: [AbductionJoints<T>; A],
}

/// Constants of the compliant model.
#[derive(Debug, Clone)]
pub(crate) struct CompliantModel<const A: usize = 0> {
    pub(crate) rigid: Model,
    pub(crate) legs: Legs<Quad, A>,
    pub(crate) drives: DriveLaws,
    pub(crate) trunk: TrunkConstants,
    /// Corners of the trunk, if they have contact.
    pub(crate) body: Option<BodyPoints<Quad>>,
    /// Mass of trunk and feet \[kg\].
    pub(crate) mass: f64,
    /// Radius of an angle of the trunk in the error \[m\].
    pub(crate) radius: f64,
    /// Height by which a unit of work lifts the robot, times its weight in the error \[m/J\].
    pub(crate) work_to_length: f64,
}

impl<const A: usize> CompliantModel<A> {
    /// Adds the compliances of the legs, and their joints of abduction, to the rigid model.
    pub(crate) fn new(
        model: Model,
        pantographs: &[PantographConstants<3>],
        compliances: &[Compliance],
        joints: [AbductionJoints<Quad>; A],
        body: &[BodyPoints<Quad>],
    ) -> Self {
        let joints = joints.map(|joints| joints.about(model.centre.into()));
        let feet = model.legs.iter().map(|leg| leg.mass).sum::<f64>();
        Self {
            legs: Legs::side_by_side(&model, pantographs, compliances, joints),
            drives: DriveLaws::from(model.drives.as_ref()),
            trunk: TrunkConstants::new(&model, feet),
            body: body.first().map(|points| points.about(model.centre.into())),
            mass: model.mass + feet,
            work_to_length: StepControl::WORK_WEIGHT / (GRAVITY * (model.mass + feet)),
            radius: 0.5 * model.reach,
            rigid: model,
        }
    }

    /// Sets the coefficients of friction.
    pub(crate) fn set_friction(&mut self, friction: &Friction) {
        self.legs.sole.set_friction(&friction.legs);
        if let Some(body) = &mut self.body {
            body.set_friction(&friction.legs, friction.trunk);
        }
    }
}

impl<const A: usize> Legs<Quad, A> {
    fn side_by_side(
        model: &Model,
        pantographs: &[PantographConstants<3>],
        compliances: &[Compliance],
        joints: [AbductionJoints<Quad>; A],
    ) -> Self {
        let quad = |of: &dyn Fn(usize) -> f64| {
            let present = |lane| lane < model.legs.len();
            let value = |lane| if present(lane) { of(lane) } else { 0.0 };
            Quad(std::array::from_fn::<_, LANES, _>(value))
        };
        let friction = model.ground.as_ref().map_or(0.0, |ground| ground.friction);
        let deflections: Vec<f64> = compliances.iter().map(|c| c.slip_deflection).collect();
        Self {
            pantographs: Pantographs::side_by_side(pantographs, compliances),
            per_links: [1, 2].map(|j| quad(&|leg| 1.0 / pantographs[leg].links[j])),
            hip: [0_usize, 1, 2].map(|i| {
                let axis = joints
                    .first()
                    .and_then(|joints| joints.axis.get(i.checked_sub(1)?));
                quad(&|leg| model.legs[leg].hip[i] - axis.map_or(0.0, |axis| axis.0[leg]))
            }),
            mass: quad(&|leg| model.legs[leg].mass),
            per_mass: quad(&|leg| 1.0 / model.legs[leg].mass),
            sole: Sole::new(
                Element::side_by_side(compliances.iter().map(|c| c.sole)),
                friction,
                &deflections,
            ),
            joints,
        }
    }

    #[inline(always)]
    pub(crate) fn load<S: Simd>(&self, simd: S) -> Legs<S::Lanes, A> {
        Legs {
            pantographs: self.pantographs.load(simd),
            per_links: simd.load_all(&self.per_links),
            hip: simd.load_all(&self.hip),
            mass: simd.load(self.mass),
            per_mass: simd.load(self.per_mass),
            sole: self.sole.load(simd),
            joints: self.joints.each_ref().map(|joints| joints.load(simd)),
        }
    }
}

impl<L: Lanes, const A: usize> Legs<L, A> {
    /// Returns the frames that carry the legs, if they have joints of abduction.
    #[inline(always)]
    pub(crate) fn frame<const B: usize>(
        &self,
        state: &State<L, A, B>,
        trunk: &TrunkMotion,
    ) -> Option<LegFrame<L>> {
        let (joints, motion) = (self.joints.first()?, state.abduction.first()?);
        Some(joints.frame(motion.angle, motion.rate, trunk))
    }
}

/// Equations of motion.
#[derive(Debug, Clone)]
pub(crate) struct CompliantEquations<const A: usize = 0, const B: usize = 0> {
    pub(crate) model: CompliantModel<A>,
    /// Angles of the hips at the input zero \[rad\].
    pub(super) hip_references: Vec<f64>,
}

impl<const A: usize, const B: usize> CompliantEquations<A, B> {
    pub(crate) fn new(model: CompliantModel<A>) -> Self {
        let legs = model.rigid.legs.iter();
        Self {
            hip_references: legs.map(|leg| leg.pantograph.hip_reference()).collect(),
            model,
        }
    }
}
