//! Construction of a plant from a robot and options.

use twinrig_compliant::AbductionJoints;
use twinrig_legged::{Abduction, Constraints, FromRobot, Setup};
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
        let abducts = options.setup.abduction != Abduction::Locked;
        if options.constraints == Constraints::Rigid {
            options.setup.check_locked("`lcp` with rigid constraints")?;
        } else if toes {
            options.setup.check_locked("`lcp` with toe joints")?;
        }
        Ok(match (options.constraints, toes) {
            (Constraints::Rigid, false) => Box::new(initial_flow::<3>(robot, options)?),
            (Constraints::Rigid, true) => Box::new(initial_flow::<4>(robot, options)?),
            (Constraints::Compliant, false) if abducts => {
                let joints = AbductionJoints::new(robot, &options.setup)?;
                Box::new(compliant::initial::<3, 1, 1>(robot, options, [joints])?)
            }
            (Constraints::Compliant, false) => {
                Box::new(compliant::initial::<3, 1, 0>(robot, options, [])?)
            }
            (Constraints::Compliant, true) => {
                Box::new(compliant::initial::<4, 2, 0>(robot, options, [])?)
            }
        })
    }
}
