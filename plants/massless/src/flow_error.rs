//! Reasons why a step fails.

use twinrig_contact::SolveError;
use twinrig_legged::NegativeDissipation;

use crate::midpoint::NoPose;

/// Reason why a step fails.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum FlowError {
    #[error(transparent)]
    NoPose(#[from] NoPose),
    #[error(transparent)]
    SolveError(#[from] SolveError),
    #[error("the state is not a number")]
    NotFinite,
    #[error(
        "the step of {seconds:e} s does not converge: the energy of its springs is off by {energy:e} J, its feet by {metres:e} m; take compliant constraints, or the plant lcp"
    )]
    NotConverged {
        seconds: f64,
        energy: f64,
        metres: f64,
    },
    #[error("a step of {seconds:e} s is too long: a foot penetrates the ground by {metres:e} m")]
    Penetration { seconds: f64, metres: f64 },
    #[error(
        "impacts give {given:.3e} J, but can only dissipate; shorten the steps, or take compliant constraints or the plant lcp"
    )]
    ImpactGivesEnergy { leg: usize, given: f64 },
    #[error("a step of {seconds:e} s is too long: {why}")]
    Dissipation {
        seconds: f64,
        why: NegativeDissipation,
    },
}
