//! Constants of the compliant model, of four legs side by side.

use twinrig_compliant::lanes::{LANES, Lanes, Quad, Simd};
use twinrig_compliant::{
    AbductionJoints, BodyPoints, DriveLaws, Element, LegFrame, PantographConstants, Pantographs,
    Sole, StepControl, TrunkMotion,
};
use twinrig_legged::{Base, Friction};
use twinrig_robot::{Compliance, GRAVITY, Payload};

use super::state::State;
use crate::model::Model;
use crate::model::constants::Constants;

/// Constants of the legs; `T` is [`Quad`] in memory, or lanes. Symbols as in
/// [`Constants`](crate::model::constants::Constants).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Legs<T, const N: usize, const A: usize> {
    pub(crate) pantographs: Pantographs<T, N>,
    /// Hip in the trunk frame \[m\].
    pub(crate) hip: [T; 3],
    /// M, and M times the hip.
    pub(crate) mass: T,
    pub(crate) mass_hip: [T; 3],
    /// bⱼ, and bⱼ times the hip.
    pub(crate) moments: [T; N],
    pub(crate) moments_hip: [[T; 3]; N],
    /// Aᵢⱼ.
    pub(crate) inertias: [[T; N]; N],
    pub(crate) sole: Sole<T>,
    /// Joints of abduction; positions of hips are relative to their axes.
    pub(crate) joints: [AbductionJoints<T>; A],
}

/// Constants of the compliant model.
#[derive(Debug, Clone)]
pub(crate) struct CompliantModel<const N: usize, const A: usize> {
    pub(crate) rigid: Model<N>,
    pub(crate) base: Base,
    /// Mass of trunk, payloads and legs, and of trunk and payloads \[kg\]; principal moments of the
    /// trunk alone \[kg·m²\].
    pub(crate) mass: f64,
    pub(crate) trunk_mass: f64,
    pub(crate) inertia: [f64; 3],
    /// Payloads of the trunk.
    pub(crate) payload: Option<Payload>,
    pub(crate) legs: Legs<Quad, N, A>,
    pub(crate) drives: DriveLaws,
    /// Contact points of trunk, knees and ankles, if they have contact.
    pub(crate) body: Option<BodyPoints<Quad>>,
    /// Radius of an angle in the error \[m\].
    pub(crate) radius: f64,
    /// Height by which a unit of work lifts the robot, times its weight in the error \[m/J\].
    pub(crate) work_to_length: f64,
}

impl<const N: usize, const A: usize> CompliantModel<N, A> {
    /// Adds the compliances of the legs, their joints of abduction, and contact points to the rigid
    /// model.
    pub(crate) fn new(
        model: Model<N>,
        compliances: &[Compliance],
        joints: [AbductionJoints<Quad>; A],
        body: &[BodyPoints<Quad>],
    ) -> Self {
        let friction = model.ground.as_ref().map_or(0.0, |ground| ground.friction);
        let mut constants: Vec<_> = model.legs.iter().map(|leg| leg.constants).collect();
        for joints in &joints {
            let [left, up] = joints.axis;
            for (i, leg) in constants.iter_mut().enumerate() {
                leg.hip[1] -= left.0[i];
                leg.hip[2] -= up.0[i];
            }
        }
        Self {
            base: model.base,
            mass: model.trunk.mass,
            trunk_mass: model.trunk.mass - constants.iter().map(|leg| leg.mass).sum::<f64>(),
            inertia: model.trunk.inertia,
            payload: model.trunk.payload,
            legs: Legs::side_by_side(&constants, compliances, friction, joints),
            drives: DriveLaws::from(model.drives.as_ref()),
            body: body.first().copied(),
            radius: 0.5 * model.reach,
            work_to_length: StepControl::WORK_WEIGHT / (GRAVITY * model.trunk.mass),
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

impl<const N: usize, const A: usize> Legs<Quad, N, A> {
    fn side_by_side(
        legs: &[Constants<f64, N>],
        compliances: &[Compliance],
        friction: f64,
        joints: [AbductionJoints<Quad>; A],
    ) -> Self {
        let pantographs: Vec<_> = legs.iter().map(Constants::pantograph).collect();
        let absent = Constants::absent();
        let legs: [Constants<f64, N>; LANES] =
            std::array::from_fn(|lane| legs.get(lane).copied().unwrap_or(absent));
        let quad = |of: &dyn Fn(&Constants<f64, N>) -> f64| Quad(legs.each_ref().map(of));
        let many = |of: &dyn Fn(&Constants<f64, N>, usize) -> f64| {
            std::array::from_fn(|j| quad(&|leg| of(leg, j)))
        };
        let deflections: Vec<f64> = compliances.iter().map(|c| c.slip_deflection).collect();
        Self {
            pantographs: Pantographs::side_by_side(&pantographs, compliances),
            hip: std::array::from_fn(|i| quad(&|leg| leg.hip[i])),
            mass: quad(&|leg| leg.mass),
            mass_hip: std::array::from_fn(|i| quad(&|leg| leg.mass * leg.hip[i])),
            moments: many(&|leg, j| leg.moments[j]),
            moments_hip: std::array::from_fn(|j| {
                std::array::from_fn(|i| quad(&|leg| leg.moments[j] * leg.hip[i]))
            }),
            inertias: std::array::from_fn(|i| many(&|leg, j| leg.inertias[i][j])),
            sole: Sole::new(
                Element::side_by_side(compliances.iter().map(|c| c.sole)),
                friction,
                &deflections,
            ),
            joints,
        }
    }

    #[inline(always)]
    pub(crate) fn load<S: Simd>(&self, simd: S) -> Legs<S::Lanes, N, A> {
        let mut moments_hip = [simd.load_all(&self.moments_hip[0]); N];
        let mut inertias = [simd.load_all(&self.inertias[0]); N];
        for j in 1..N {
            moments_hip[j] = simd.load_all(&self.moments_hip[j]);
            inertias[j] = simd.load_all(&self.inertias[j]);
        }
        Legs {
            pantographs: self.pantographs.load(simd),
            hip: simd.load_all(&self.hip),
            mass: simd.load(self.mass),
            mass_hip: simd.load_all(&self.mass_hip),
            moments: simd.load_all(&self.moments),
            moments_hip,
            inertias,
            sole: self.sole.load(simd),
            joints: self.joints.each_ref().map(|joints| joints.load(simd)),
        }
    }
}

impl<L: Lanes, const N: usize, const A: usize> Legs<L, N, A> {
    /// Returns the frames that carry the legs, if they have joints of abduction.
    #[inline(always)]
    pub(crate) fn frame<const P: usize, const B: usize>(
        &self,
        state: &State<L, N, P, A, B>,
        trunk: &TrunkMotion,
    ) -> Option<LegFrame<L>> {
        let (joints, motion) = (self.joints.first()?, state.abduction.first()?);
        Some(joints.frame(motion.angle, motion.rate, trunk))
    }
}

impl<const N: usize> Constants<f64, N> {
    fn pantograph(&self) -> PantographConstants<N> {
        PantographConstants {
            links: self.links,
            friction: self.friction,
            l_delta: self.l_delta,
            diagonal: self.diagonal,
            parallel: self.parallel,
            toe: self.toe,
            diagonal_range: [self.diagonal_min, self.diagonal_max],
            parallel_max: self.parallel_max,
            cable_max: self.cable_max,
            pulley_radius: self.pulley_radius,
        }
    }
}

/// Equations of legs with `N` links and `P` contact points.
#[derive(Debug, Clone)]
pub(crate) struct CompliantEquations<const N: usize, const P: usize, const A: usize, const B: usize>
{
    pub(crate) model: CompliantModel<N, A>,
    /// Angles of the hips at the input zero \[rad\].
    pub(super) hip_references: Vec<f64>,
}

impl<const N: usize, const P: usize, const A: usize, const B: usize>
    CompliantEquations<N, P, A, B>
{
    pub(crate) fn new(model: CompliantModel<N, A>) -> Self {
        let legs = model.rigid.legs.iter();
        Self {
            hip_references: legs.map(|leg| leg.pantograph.hip_reference()).collect(),
            model,
        }
    }
}
