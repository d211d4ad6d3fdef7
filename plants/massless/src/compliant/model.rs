//! Constants of the compliant model, of four legs side by side.

use twinrig_compliant::lanes::{LANES, Quad, Simd};
use twinrig_compliant::{DriveLaws, Element, PantographConstants, Pantographs, Sole, StepControl};
use twinrig_robot::{Compliance, GRAVITY};

use super::trunk::TrunkConstants;
use crate::model::Model;

/// Constants of the legs; `T` is [`Quad`] in memory, or lanes. An absent leg has no mass and no
/// force, and its links have no rates.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Legs<T> {
    pub(crate) pantographs: Pantographs<T, 3>,
    /// Reciprocal lengths of the second and the third link \[1/m\].
    pub(crate) per_links: [T; 2],
    /// Hip in the trunk frame, relative to the centre of mass \[m\].
    pub(crate) hip: [T; 3],
    /// Mass of the foot \[kg\], and its reciprocal.
    pub(crate) mass: T,
    pub(crate) per_mass: T,
    pub(crate) sole: Sole<T>,
}

/// Constants of the compliant model.
#[derive(Debug, Clone)]
pub(crate) struct CompliantModel {
    pub(crate) rigid: Model,
    pub(crate) legs: Legs<Quad>,
    pub(crate) drives: DriveLaws,
    pub(crate) trunk: TrunkConstants,
    /// Mass of trunk and feet \[kg\].
    pub(crate) mass: f64,
    /// Radius of an angle of the trunk in the error \[m\].
    pub(crate) radius: f64,
    /// Height by which a unit of work lifts the robot, times its weight in the error \[m/J\].
    pub(crate) work_to_length: f64,
}

impl CompliantModel {
    /// Adds the compliances of the legs to the rigid model.
    pub(crate) fn new(
        model: Model,
        pantographs: &[PantographConstants<3>],
        compliances: &[Compliance],
    ) -> Self {
        let feet = model.legs.iter().map(|leg| leg.mass).sum::<f64>();
        Self {
            legs: Legs::side_by_side(&model, pantographs, compliances),
            drives: DriveLaws::from(model.drives.as_ref()),
            trunk: TrunkConstants::new(&model, feet),
            mass: model.mass + feet,
            work_to_length: StepControl::WORK_WEIGHT / (GRAVITY * (model.mass + feet)),
            radius: 0.5 * model.reach,
            rigid: model,
        }
    }
}

impl Legs<Quad> {
    fn side_by_side(
        model: &Model,
        pantographs: &[PantographConstants<3>],
        compliances: &[Compliance],
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
            hip: [0, 1, 2].map(|i| quad(&|leg| model.legs[leg].hip[i])),
            mass: quad(&|leg| model.legs[leg].mass),
            per_mass: quad(&|leg| 1.0 / model.legs[leg].mass),
            sole: Sole::new(
                Element::side_by_side(compliances.iter().map(|c| c.sole)),
                friction,
                &deflections,
            ),
        }
    }

    #[inline(always)]
    pub(crate) fn load<S: Simd>(&self, simd: S) -> Legs<S::Lanes> {
        Legs {
            pantographs: self.pantographs.load(simd),
            per_links: simd.load_all(&self.per_links),
            hip: simd.load_all(&self.hip),
            mass: simd.load(self.mass),
            per_mass: simd.load(self.per_mass),
            sole: self.sole.load(simd),
        }
    }
}

/// Equations of motion.
#[derive(Debug, Clone)]
pub(crate) struct CompliantEquations {
    pub(crate) model: CompliantModel,
    /// Angles of the hips at the input zero \[rad\].
    pub(super) hip_references: Vec<f64>,
}

impl CompliantEquations {
    pub(crate) fn new(model: CompliantModel) -> Self {
        let legs = model.rigid.legs.iter();
        Self {
            hip_references: legs.map(|leg| leg.pantograph.hip_reference()).collect(),
            model,
        }
    }
}
