//! Inputs of a study of coupling, and the interface by which it builds rigs.

use serde::{Deserialize, Serialize};
use twinrig_kernel::SimDuration;
use twinrig_runtime::{Coupling, GridInputs, Rig};

/// Builds complete rigs of one scenario with a given plant and coupling. The caller, who knows the
/// parts, implements it.
pub trait RigFactory {
    /// Returns the properties of the scenario.
    fn input(&self) -> &CouplingInput;

    /// Returns the names of the plants to compare.
    fn plants(&self) -> &[String];

    /// Returns the plants that were not selected by name and cannot simulate the scenario, each
    /// with the reason.
    fn left_out(&self) -> &[String] {
        &[]
    }

    /// Builds a rig at time zero. Its plant outputs `leg/*/foot/position`, and `body/position` if
    /// available \[m\], every `observe`.
    ///
    /// # Errors
    /// The reason in plain text; it becomes a row of the study.
    fn rig(&self, variant: &RigVariant<'_>) -> Result<Rig, String>;
}

/// Properties of the simulated scenario that do not depend on plant and coupling.
#[derive(Clone, Debug)]
pub struct CouplingInput {
    /// Name of the scenario.
    pub name: String,
    /// Path of the scenario file.
    pub file: String,
    /// Duration of the scenario.
    pub duration: SimDuration,
    /// Control period.
    pub period: SimDuration,
    /// Names of the buses; without a bus, only the controller's transfers access the plant.
    pub buses: Vec<String>,
}

/// Parameters of a rig variant.
#[derive(Clone, Copy, Debug)]
pub struct RigVariant<'a> {
    /// Name of the plant.
    pub plant: &'a str,
    /// Coupling of plant and boards.
    pub coupling: Coupling,
    /// Step of the plant.
    pub step: SimDuration,
    /// Observation period.
    pub observe: SimDuration,
    /// Simulated duration.
    pub duration: SimDuration,
}

/// Coupling method of a series of rows. The serialised words are part of the output format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CouplingMethod {
    /// Exact coupling.
    Exact,
    /// Communication grid; commands act by their mean over an interval.
    Grid,
    /// Communication grid; commands act from the next grid instant on.
    GridHeld,
}

impl CouplingMethod {
    /// All methods, in display order.
    pub const ALL: [Self; 3] = [Self::Exact, Self::Grid, Self::GridHeld];

    /// Returns the serialised word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Grid => "grid",
            Self::GridHeld => "grid-held",
        }
    }

    /// Returns a one-line description.
    pub fn about(self) -> &'static str {
        match self {
            Self::Exact => "the plant is advanced to every instant of sampling or actuation",
            Self::Grid => {
                "the plant keeps its step: commands act by their mean over an interval, samples \
                 within it are extrapolated"
            }
            Self::GridHeld => {
                "the plant keeps its step: commands act from the next grid instant on, samples \
                 within an interval are interpolated"
            }
        }
    }

    /// Returns the coupling with a grid of `step`.
    pub(crate) fn choice(self, step: SimDuration) -> Coupling {
        match self {
            Self::Exact => Coupling::Exact,
            Self::Grid => Coupling::Grid {
                step,
                inputs: GridInputs::Mean,
            },
            Self::GridHeld => Coupling::Grid {
                step,
                inputs: GridInputs::Held,
            },
        }
    }
}
