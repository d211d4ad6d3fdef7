//! Errors of a step.

use twinrig_contact::SolveError;
use twinrig_legged::NegativeDissipation;

use crate::constraints::events::{ImpactError, ImpactGivesEnergy};

/// Integration errors.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum StepError {
    #[error(transparent)]
    SolveError(#[from] SolveError),
    #[error("a foot jams under its own friction, and no impulse releases it: {0}")]
    Jammed(SolveError),
    #[error(transparent)]
    ImpactGivesEnergy(#[from] ImpactGivesEnergy),
    #[error("leg {} sinks by {depth:.3e} m into a constraint within {seconds:e} s", leg + 1)]
    Overlap {
        leg: usize,
        depth: f64,
        seconds: f64,
    },
    #[error("the state is not a number")]
    NotFinite,
    #[error("active constraints are violated by {by:.3e} m, which no forces can correct")]
    ConstraintViolation { by: f64 },
    #[error(
        "the foot of leg {} is {depth:.3e} m below the ground and sinks without a ground force",
        leg + 1
    )]
    FootSinks { leg: usize, depth: f64 },
    #[error("the tolerance requires substeps below 1e-12 s, at present {seconds:e} s")]
    TooStiff { seconds: f64 },
    #[error(
        "the iteration for the rates of a step of {seconds:e} s does not converge: links rotate too far"
    )]
    NotConverged { seconds: f64 },
    #[error(
        "steps of {:.3} ms are unstable: they gained {gained:.3e} J of numerical energy",
        1e3 * seconds
    )]
    EnergyGain { seconds: f64, gained: f64 },
    #[error("steps of {:.3} ms are unstable: {why}", 1e3 * seconds)]
    Dissipation {
        seconds: f64,
        why: NegativeDissipation,
    },
    #[error(
        "steps of {:.3} ms are too long: they lost {lost:.3e} J of numerical energy",
        1e3 * seconds
    )]
    EnergyLoss { seconds: f64, lost: f64 },
}

impl From<ImpactError> for StepError {
    fn from(error: ImpactError) -> Self {
        match error {
            ImpactError::SolveError(error) => error.into(),
            ImpactError::GivesEnergy(error) => error.into(),
        }
    }
}
