//! The engine: its sets of bodies, joints and contacts, and its step.

use rapier3d_f64::dynamics::{
    CCDSolver, FrictionModel, ImpulseJointSet, IntegrationParameters, IslandManager,
    MultibodyJointSet, RigidBodySet, SoftBodySet,
};
use rapier3d_f64::geometry::{BroadPhaseBvh, ColliderSet, NarrowPhase};
use rapier3d_f64::math::Vector;
use rapier3d_f64::pipeline::PhysicsPipeline;
use serde::{Deserialize, Serialize};
use twinrig_robot::GRAVITY;

use crate::options::Solver;

/// Bodies, joints and contacts: the part of the engine's state that determines further motion.
#[derive(Clone, Serialize, Deserialize)]
pub(crate) struct Sets {
    pub(crate) bodies: RigidBodySet,
    pub(crate) colliders: ColliderSet,
    pub(crate) impulse_joints: ImpulseJointSet,
    pub(crate) multibody_joints: MultibodyJointSet,
    pub(crate) islands: IslandManager,
    broad_phase: BroadPhaseBvh,
    pub(crate) narrow_phase: NarrowPhase,
}

/// The engine with its working memory.
pub(crate) struct World {
    pub(crate) sets: Sets,
    soft_bodies: SoftBodySet,
    ccd: CCDSolver,
    pipeline: PhysicsPipeline,
    pub(crate) parameters: IntegrationParameters,
}

impl Sets {
    pub(crate) fn new() -> Self {
        Self {
            bodies: RigidBodySet::new(),
            colliders: ColliderSet::new(),
            impulse_joints: ImpulseJointSet::new(),
            multibody_joints: MultibodyJointSet::new(),
            islands: IslandManager::new(),
            broad_phase: BroadPhaseBvh::new(),
            narrow_phase: NarrowPhase::new(),
        }
    }
}

impl World {
    pub(crate) fn new(sets: Sets, solver: &Solver) -> Self {
        let contacts = solver.contact_softness.coefficients();
        let parameters = IntegrationParameters {
            num_solver_iterations: solver.solver_iterations as usize,
            num_internal_pgs_iterations: solver.pgs_iterations as usize,
            num_internal_stabilization_iterations: solver.stabilization_iterations as usize,
            contact_softness: contacts,
            static_contact_softness: contacts,
            // The engine treats the winding of a cable as a correction, whose velocity must not be
            // limited.
            normalized_max_corrective_velocity: f64::MAX,
            // A foot is a point: its contact is detected anew in each step and has one point.
            contact_recycling: false,
            contact_clustering: false,
            max_ccd_substeps: 0,
            friction_model: FrictionModel::Coulomb,
            ..IntegrationParameters::default()
        };
        Self {
            sets,
            soft_bodies: SoftBodySet::new(),
            ccd: CCDSolver::new(),
            pipeline: PhysicsPipeline::new(),
            parameters,
        }
    }

    /// Advances by `seconds` with gravity times `share`. Returns whether all bodies are still
    /// finite.
    pub(crate) fn step(&mut self, seconds: f64, share: f64) -> bool {
        self.parameters.dt = seconds;
        let sets = &mut self.sets;
        self.pipeline.step(
            Vector::new(0.0, 0.0, -GRAVITY * share),
            &self.parameters,
            &mut sets.islands,
            &mut sets.broad_phase,
            &mut sets.narrow_phase,
            &mut sets.bodies,
            &mut sets.colliders,
            &mut sets.impulse_joints,
            &mut sets.multibody_joints,
            &mut self.soft_bodies,
            &mut self.ccd,
            &(),
            &(),
        );
        self.pipeline.quarantine().is_empty()
    }

    /// Replaces the sets by saved ones and clears the working memory.
    pub(crate) fn replace(&mut self, sets: Sets) {
        self.sets = sets;
        self.soft_bodies = SoftBodySet::new();
        self.ccd = CCDSolver::new();
        self.pipeline = PhysicsPipeline::new();
    }
}
