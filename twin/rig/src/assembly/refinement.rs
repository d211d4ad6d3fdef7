//! The same scene with a smaller numerical error.

use twinrig_kernel::SimDuration;
use twinrig_runtime::Coupling;
use twinrig_scenario::OptionValue;

use crate::assembly::Assembly;
use crate::error::Error;
use crate::parts::accuracy::Accuracy;
use crate::parts::method::TOLERANCE;

/// Quotient of the tolerances, and of the steps, of two successive refinements.
const TOLERANCES: u64 = 10;
const STEPS: u64 = 2;

/// A scene whose numerical error is smaller.
pub struct Refined<'r> {
    /// The scene.
    pub assembly: Assembly<'r>,
    /// Expected ratio of its error to that of the refinement before: that of the tolerances or, of
    /// a method without error control, of the steps, as of a method of order 1.
    pub ratio: f64,
}

impl<'r> Assembly<'r> {
    /// Returns the same scene refined `times` times: each time to a tenth of the tolerance and half
    /// the step of the plant, and of the grid of its coupling. None of a plant without numerical
    /// error.
    ///
    /// # Errors
    /// [`Error::Accuracy`], and those of the plant.
    pub fn refined(&self, times: u32) -> Result<Option<Refined<'r>>, Error> {
        let scenario = self.scenario();
        let finer = |step: SimDuration| {
            let nanos = step.as_nanos() / STEPS.pow(times);
            SimDuration::from_nanos(nanos.max(1))
        };
        let accuracy = match self.body().standalone_model() {
            Some(model) => model.accuracy(&scenario.plant),
            None => self.registry().accuracy(&scenario.plant),
        };
        let mut refined = scenario.clone();
        let plant = &mut refined.plant;
        let mut ratio = 1.0 / STEPS as f64;
        match (accuracy, plant.coupling) {
            (Accuracy::Unknown, _) => {
                return Err(Error::Accuracy {
                    file: scenario.file.clone(),
                    plant: plant.model.clone(),
                });
            }
            (Accuracy::Exact, Coupling::Exact) => return Ok(None),
            (Accuracy::Exact, Coupling::Grid { .. }) => {}
            (Accuracy::Set { step, tolerance }, coupling) => {
                plant.step = Some(finer(step));
                if let Some(tolerance) = tolerance {
                    let tolerance = tolerance / TOLERANCES.pow(times) as f64;
                    let options = std::mem::take(&mut plant.options);
                    plant.options = options.with(TOLERANCE, OptionValue::Number(tolerance));
                    if coupling == Coupling::Exact {
                        ratio = 1.0 / TOLERANCES as f64;
                    }
                }
            }
        }
        if let Coupling::Grid { step, inputs } = plant.coupling {
            let step = finer(step);
            plant.coupling = Coupling::Grid { step, inputs };
        }
        let assembly = self.with_scenario(&refined, &[])?;
        Ok(Some(Refined { assembly, ratio }))
    }
}
