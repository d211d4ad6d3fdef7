//! Inertia of the robot at both ends of a step and in its middle.

use super::momentum::Geometry;
use crate::constraints::mode::Mode;
use crate::model::Model;
use crate::model::articulated::Articulated;
use crate::model::elimination::ConstraintSet;
use crate::model::leg_constraints::DriveAction;
use crate::model::real::{Lanes, Real};
use crate::model::state::State;

/// Inertia of the robot at one end of a step.
#[derive(Debug, Clone)]
pub(super) struct Node<const N: usize> {
    pub(super) angles: [Lanes; N],
    /// Mask of the hips that follow their commands, and inertia of the motors at the others.
    pub(super) hips: [Lanes; 2],
    pub(super) inertia: Articulated<Lanes, N>,
    pub(super) geometry: Geometry<N>,
    /// Whether it is computed.
    known: bool,
}

/// Memory of a step: large values that are swapped instead of copied.
#[derive(Debug, Clone)]
pub(super) struct Memory<const N: usize> {
    pub(super) start: Box<Node<N>>,
    pub(super) end: Box<Node<N>>,
    pub(super) middle: Articulated<Lanes, N>,
}

impl<const N: usize> Node<N> {
    fn blank() -> Self {
        Self {
            angles: [Lanes::zero(); N],
            hips: [Lanes::zero(); 2],
            inertia: Articulated::blank(),
            geometry: Geometry::blank(),
            known: false,
        }
    }

    /// Computes the inertia with links at these angles, in the present mode of the motors.
    pub(super) fn update(&mut self, model: &Model<N>, mode: &Mode, angles: &[Lanes; N]) {
        let mut drive = DriveAction::none();
        // Hips that follow their commands impose a unit rate of 1 rad/s.
        drive.hip_acceleration = Lanes::splat(1.0);
        if let Some(drives) = &model.drives {
            let saturated = mode.commands.hip_saturated;
            drive.hip_inertia = saturated * saturated * Lanes::splat(drives.inertias()[0]);
        }
        let mut mode = mode.drives_only();
        let hips = [mode.active.hip, drive.hip_inertia];
        if self.known && self.angles == *angles && self.hips == hips {
            return;
        }
        mode.update_any();
        let constraint_set = ConstraintSet {
            active: &mode.active,
            drive: &drive,
            recovery: Lanes::zero(),
            implicit_seconds: 0.0,
            any: mode.any,
        };
        let zero_rates = [Lanes::zero(); N];
        let inertia = &mut self.inertia;
        inertia.unload(
            model,
            &model.side_by_side,
            [angles, &zero_rates],
            &constraint_set,
        );
        self.geometry = Geometry::of(model, inertia);
        (self.angles, self.hips, self.known) = (*angles, hips, true);
    }
}

impl<const N: usize> Default for Memory<N> {
    fn default() -> Self {
        Self {
            start: Box::new(Node::blank()),
            end: Box::new(Node::blank()),
            middle: Articulated::blank(),
        }
    }
}

/// Computes the inertia in the middle of a step, with the drives as constraints.
pub(super) fn compute_midpoint_inertia<const N: usize>(
    inertia: &mut Articulated<Lanes, N>,
    model: &Model<N>,
    mode: &Mode,
    middle: &State<Lanes, N>,
    drive: &DriveAction<Lanes>,
    half: f64,
) {
    let mut mode = mode.drives_only();
    mode.update_any();
    let constraint_set = ConstraintSet {
        active: &mode.active,
        drive,
        recovery: Lanes::zero(),
        implicit_seconds: half,
        any: mode.any,
    };
    let moving = [&middle.angles, &middle.rates];
    inertia.unload(model, &model.side_by_side, moving, &constraint_set);
}
