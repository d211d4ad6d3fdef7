//! Construction of a plant from a robot and options.

use twinrig_compliant::lanes::Quad;
use twinrig_compliant::{AbductionJoints, BodyPoints};
use twinrig_legged::{Abduction, Constraints, Contacts, FromRobot, Setup};
use twinrig_robot::Robot;

use super::rigid::initial_flow;
use crate::compliant;
use crate::formulation::Formulation;
use crate::options::{LcpError, Method, Options};

impl FromRobot for dyn Formulation {
    type Options = Options;
    type Error = LcpError;

    fn setup(options: &Options) -> &Setup {
        &options.setup
    }

    fn from_robot(robot: &Robot, options: &Options) -> Result<Box<Self>, LcpError> {
        if options.tolerance.is_nan() || options.tolerance <= 0.0 {
            return Err(LcpError::Tolerance(options.tolerance));
        }
        if options.constraints == Constraints::Compliant && options.method != Method::Rk4 {
            return Err(LcpError::CompliantMethod(options.method.name()));
        }
        if options.setup.drives.have_motors() && options.method == Method::Thesis {
            return Err(LcpError::Motors);
        }
        let selected_mounts = options.setup.selected_mounts(robot)?;
        let toes = options.toe && selected_mounts.iter().any(|mount| mount.leg.toe.is_some());
        if let Some(mount) = selected_mounts
            .iter()
            .find(|mount| toes && mount.leg.toe.is_none())
        {
            let leg = mount.name.clone();
            return Err(LcpError::Toe { leg });
        }
        if options.constraints == Constraints::Rigid {
            options.setup.check_locked("`lcp` with rigid constraints")?;
        } else if toes {
            options.setup.check_locked("`lcp` with toe joints")?;
        }
        if options.constraints == Constraints::Rigid {
            options
                .setup
                .check_feet_only("`lcp` with rigid constraints")?;
        } else if toes {
            options.setup.check_feet_only("`lcp` with toe joints")?;
        }
        Ok(match (options.constraints, toes) {
            (Constraints::Rigid, false) => Box::new(initial_flow::<3>(robot, options)?),
            (Constraints::Rigid, true) => Box::new(initial_flow::<4>(robot, options)?),
            (Constraints::Compliant, false) => compliant_flow(robot, options)?,
            (Constraints::Compliant, true) => initial::<4, 2, 0, 0>(robot, options, [], [])?,
        })
    }
}

/// Builds a robot without toe joints, of those parts that it has.
fn compliant_flow(robot: &Robot, options: &Options) -> Result<Box<dyn Formulation>, LcpError> {
    let setup = &options.setup;
    let joints = || AbductionJoints::new(robot, setup);
    let body = || BodyPoints::new(robot, setup);
    let is_abducting = setup.abduction != Abduction::Locked;
    let has_body = setup.reaching_contacts(robot)? != Contacts::Feet;
    match (is_abducting, has_body) {
        (false, false) => initial::<3, 1, 0, 0>(robot, options, [], []),
        (true, false) => initial::<3, 1, 1, 0>(robot, options, [joints()?], []),
        (false, true) => initial::<3, 1, 0, 1>(robot, options, [], [body()?]),
        (true, true) => initial::<3, 1, 1, 1>(robot, options, [joints()?], [body()?]),
    }
}

/// Builds a plant with compliant constraints.
fn initial<const N: usize, const P: usize, const A: usize, const B: usize>(
    robot: &Robot,
    options: &Options,
    joints: [AbductionJoints<Quad>; A],
    body: [BodyPoints<Quad>; B],
) -> Result<Box<dyn Formulation>, LcpError> {
    let flow = compliant::initial::<N, P, A, B>(robot, options, joints, body)?;
    Ok(Box::new(flow))
}
