//! What a study of coupling is told, and what it asks for.

use serde::Serialize;
use twinrig_kernel::SimDuration;
use twinrig_runtime::{GridInputs, Rig};

/// Builds whole rigs of one scenario, plant and coupling as asked. Whoever knows the parts implements it.
pub trait RigFactory {
    /// The scene.
    fn scene(&self) -> &RigScene;

    /// The plants to compare, by name.
    fn plants(&self) -> &[String];

    /// The plants that were not asked for and cannot be in the scene, each with the reason.
    fn left_out(&self) -> &[String] {
        &[]
    }

    /// Builds a rig at its start. Its plant tells `leg/*/foot/position`, and `body/position` if it can \[m\], every
    /// `observe`.
    ///
    /// # Errors
    /// Why there is none, for a person: it becomes a row of the study.
    fn rig(&self, make: &RigVariant<'_>) -> Result<Rig, String>;
}

/// What is simulated, whichever plant does it.
#[derive(Clone, Debug)]
pub struct RigScene {
    /// What the scenario calls itself.
    pub name: String,
    /// Its file.
    pub file: String,
    /// How long it lasts.
    pub duration: SimDuration,
    /// The control period.
    pub period: SimDuration,
    /// The names of its buses: without any, nobody meets the plant but at transfers of the controller.
    pub buses: Vec<String>,
}

/// Which rig.
#[derive(Clone, Copy, Debug)]
pub struct RigVariant<'a> {
    /// Name of its plant.
    pub plant: &'a str,
    /// How that meets the others.
    pub way: CouplingChoice,
    /// The plant's own step.
    pub step: SimDuration,
    /// The observation period.
    pub observe: SimDuration,
    /// How long it is run.
    pub duration: SimDuration,
}

/// How a plant meets those who sample and actuate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CouplingChoice {
    /// It is moved to each of their instants.
    Exact,
    /// On a grid of so much.
    Grid(SimDuration, GridInputs),
}

/// What the rows of one line have in common, besides the plant. Scripts rely on the words.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum CouplingMethod {
    /// Exact coupling.
    Exact,
    /// A grid, commands acting by their means.
    Grid,
    /// A grid, commands held until its next instant.
    GridHeld,
}

impl CouplingMethod {
    /// All, in the order in which they are shown.
    pub const ALL: [Self; 3] = [Self::Exact, Self::Grid, Self::GridHeld];

    /// The word for it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Grid => "grid",
            Self::GridHeld => "grid-held",
        }
    }

    /// A line on it.
    pub fn about(self) -> &'static str {
        match self {
            Self::Exact => {
                "the plant is moved to every instant at which somebody samples or actuates"
            }
            Self::Grid => {
                "the plant keeps its step: commands act by their mean over it, samples in it are extrapolated"
            }
            Self::GridHeld => {
                "the plant keeps its step: commands act from the next on, samples in it are interpolated"
            }
        }
    }

    /// The same with a grid of `step`.
    pub(crate) fn way(self, step: SimDuration) -> CouplingChoice {
        match self {
            Self::Exact => CouplingChoice::Exact,
            Self::Grid => CouplingChoice::Grid(step, GridInputs::Mean),
            Self::GridHeld => CouplingChoice::Grid(step, GridInputs::Held),
        }
    }
}
