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

#[cfg(test)]
mod tests {
    use std::path::Path;

    use twinrig_scenario::{PlantSpec, Setting};

    use super::*;
    use crate::registry::Registry;

    /// A scenario with settings, and the plant table of its refinement; none without one.
    fn refined(file: &str, settings: &[(&str, &str)], times: u32) -> Option<(PlantSpec, f64)> {
        let registry = Registry::standard();
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios");
        let settings: Vec<Setting> = settings
            .iter()
            .map(|&(key, value)| Setting {
                origin: "the test".to_owned(),
                key: key.to_owned(),
                value: value.to_owned(),
            })
            .collect();
        let builder = Assembly::builder(&registry).settings(&settings);
        let assembly = builder.file(&path.join(file)).unwrap();
        let refined = assembly.refined(times).unwrap()?;
        let plant = refined.assembly.scenario().plant.clone();
        Some((plant, refined.ratio))
    }

    fn tolerance(plant: &PlantSpec) -> Option<f64> {
        plant.options.number(TOLERANCE)
    }

    #[test]
    fn tolerance_and_step_are_divided() {
        let micros = SimDuration::from_micros;
        // Of the scenario, of the defaults of the constraints, of a method without tolerance.
        let own = [
            ("plant.tolerance", "\"1e-5 m\""),
            ("plant.step", "\"1 ms\""),
        ];
        let lcp = [("plant.model", "\"lcp\""), ("plant.step", "\"1 ms\"")];
        let rigid = [
            ("plant.constraints", "\"rigid\""),
            ("plant.step", "\"1 ms\""),
        ];
        for (file, settings, expected, ratio) in [
            ("trot.toml", &own[..], Some(1e-5), 0.1),
            ("trot.toml", &lcp, Some(4e-6), 0.1),
            ("leg-drop.toml", &lcp[1..], Some(3e-7), 0.1),
            ("trot.toml", &rigid, None, 0.5),
        ] {
            for times in [1, 2, 3] {
                let (plant, found) = refined(file, settings, times).unwrap();
                assert_eq!(plant.step, Some(micros(1000) / 2_u64.pow(times)), "{file}");
                let expected = expected.map(|it| it / 10_u64.pow(times) as f64);
                let apart = tolerance(&plant).zip(expected).map(|(a, b)| a / b - 1.0);
                assert_eq!(tolerance(&plant).is_some(), expected.is_some(), "{file}");
                assert!(apart.is_none_or(|apart| apart.abs() < 1e-12), "{file}");
                assert!((found - ratio).abs() < 1e-15, "{file}: {found}");
            }
        }
    }

    #[test]
    fn grid_of_a_coupling_is_refined_and_closed_forms_are_not() {
        let grid = [("plant.coupling", "{ grid = \"2 ms\" }")];
        let (plant, ratio) = refined("trot.toml", &grid, 1).unwrap();
        let Coupling::Grid { step, .. } = plant.coupling else {
            panic!("{:?}", plant.coupling);
        };
        // The error of the coupling is of first order.
        assert_eq!((step, ratio), (SimDuration::from_millis(1), 0.5));
        assert!(refined("first-contact.toml", &[], 1).is_none());
    }

    #[test]
    fn step_of_a_bench_is_its_own_substep() {
        let (servo, _) = refined("servo.toml", &[], 1).unwrap();
        let coarse = refined("servo.toml", &[("plant.step", "\"10 ms\"")], 1)
            .unwrap()
            .0;
        assert_eq!(servo.step, coarse.step);
        assert!(servo.step.unwrap() <= SimDuration::from_micros(500));
        let (bench, _) = refined("bench.toml", &[], 2).unwrap();
        assert_eq!(bench.step, Some(twinrig_bench::STEP / 4));
    }
}
