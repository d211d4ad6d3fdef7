//! Plant option for the formulation of constraints.

use twinrig_legged::Constraints;
use twinrig_scenario::{OptionSpec, Options};

use crate::parts::option::choice;

/// Plant option with the formulation.
pub(crate) const CONSTRAINTS: &str = "constraints";

pub(crate) fn constraints_choice() -> OptionSpec {
    choice(
        CONSTRAINTS,
        "stops, cables and contact: rigid, or compliant with the stiffness of the robot file",
        &Constraints::ALL.map(|constraints| constraints.name().to_owned()),
    )
}

/// Returns the chosen formulation, the rigid one by default.
pub(crate) fn constraints(options: &Options) -> Constraints {
    let name = options.text(CONSTRAINTS).unwrap_or_default();
    let mut formulations = Constraints::ALL.into_iter();
    formulations
        .find(|formulation| formulation.name() == name)
        .unwrap_or_default()
}
