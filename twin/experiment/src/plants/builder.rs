//! Plants of a study, built from a scenario.

use std::path::Path;
use std::rc::Rc;

use twinrig_kernel::{SimDuration, SimTime, signal};
use twinrig_rig::assembly::Assembly;
use twinrig_rig::error::Error as RigError;
use twinrig_rig::registry::Registry;
use twinrig_rig::{PlantOffer, Variant};
use twinrig_robot::Robot;
use twinrig_runtime::Plant;
use twinrig_scenario::{ActuatorKind, Setting};

use crate::error::{Error, first_line};
use crate::plants::selection::{PlantUnderStudy, Selection, with_any_constraints};
use crate::{CommandRecorder, Commands, PlantFactory, Study, StudyInput, TRANSPORT_DURATION};

/// Reason for excluding standalone plants from these studies.
const STANDS_ALONE: &str = "studies of precision and stability vary the robot file, and this plant has a standalone model: only \
                            `twin study coupling` applies to it";

/// Builds the plants of a study from a scenario.
pub struct StudyBuilder<'r> {
    scene: StudyInput,
    offers: Vec<PlantOffer>,
    /// Plants whose model an offer solves, for its reference.
    reference_plants: Vec<PlantOffer>,
    /// Plants of the offers, then those that serve as references only.
    benches: Vec<PlantUnderStudy<'r>>,
    /// Unselected plants that cannot simulate the scenario, with the reason.
    left_out: Vec<String>,
    /// Panics of plants that were built to check them.
    panics: Vec<String>,
}

impl<'r> StudyBuilder<'r> {
    /// Selects the plants called `names`, or all, in the scenario at `path` with `settings`.
    ///
    /// # Errors
    /// Errors of the scenario, or of a plant selected by name.
    pub fn new(
        registry: &'r Registry,
        path: &Path,
        settings: &[Setting],
        names: &[String],
        duration: Option<SimDuration>,
    ) -> Result<Self, Error> {
        let own = Assembly::builder(registry).settings(settings).file(path)?;
        let spec = &own.scenario().plant;
        if spec.is_standalone {
            return Err(RigError::not_built(
                own.scenario(),
                "plant",
                &spec.model,
                STANDS_ALONE.into(),
            )
            .into());
        }
        let plants = || registry.plants_on_robots();
        if let Some(standalone) = names.iter().find(|name| {
            !registry.offers(name).is_empty() && plants().all(|plant| plant != name.as_str())
        }) {
            return Err(RigError::not_built(
                own.scenario(),
                "plant",
                standalone,
                STANDS_ALONE.into(),
            )
            .into());
        }
        let all: Vec<String> = match names {
            [] => registry.plants_on_robots().map(str::to_owned).collect(),
            names => names.to_vec(),
        };
        let mut selection = Selection::default();
        for name in all {
            let requested = !names.is_empty();
            selection.add(registry, path, settings, &name, requested, own.scenario())?;
        }
        // Where none can be in the scene, the scene is at fault.
        if let (Some(error), true) = (selection.refused.take(), selection.offers.is_empty()) {
            return Err(error.into());
        }
        let Selection {
            offers,
            mut benches,
            left_out,
            panics,
            ..
        } = selection;
        let mut reference_plants: Vec<PlantOffer> = Vec::new();
        for model in models_beside(&offers) {
            for (offer, methods) in registry.offers(&model) {
                if offer.plant == *model {
                    let assembly = with_any_constraints(registry, path, settings, &model);
                    let assembly = assembly.map_err(|error| first_line(&error.to_string()));
                    reference_plants.push(offer);
                    benches.push(PlantUnderStudy {
                        methods,
                        assembly: Rc::new(assembly),
                    });
                }
            }
        }
        Ok(Self {
            scene: scene(registry, &own, duration)?,
            offers,
            reference_plants,
            benches,
            left_out,
            panics,
        })
    }

    /// Adds the panics from before the study.
    pub(crate) fn with_panics(&self, mut study: Study) -> Study {
        study.panics.splice(..0, self.panics.iter().cloned());
        study
    }

    fn built(
        &self,
        variant: &Variant,
        wanted: &dyn Fn(&str) -> bool,
    ) -> Result<Box<dyn Plant>, String> {
        let mut offers = self.offers.iter().chain(&self.reference_plants);
        let place = offers.position(|offer| offer.plant == variant.plant);
        let bench = place.and_then(|place| self.benches.get(place));
        let bench = bench.ok_or_else(|| format!("there is no plant `{}`", variant.plant))?;
        bench.built(variant, wanted)
    }
}

/// Returns the plants whose models `offers` solve and that are not among them.
fn models_beside(offers: &[PlantOffer]) -> Vec<String> {
    let mut models: Vec<String> = Vec::new();
    for model in offers.iter().filter_map(|offer| offer.model_of.as_ref()) {
        if !models.contains(model) && offers.iter().all(|offer| offer.plant != **model) {
            models.push(model.clone());
        }
    }
    models
}

impl PlantFactory for StudyBuilder<'_> {
    fn input(&self) -> &StudyInput {
        &self.scene
    }

    fn plants(&self) -> &[PlantOffer] {
        &self.offers
    }

    fn reference_plants(&self) -> &[PlantOffer] {
        &self.reference_plants
    }

    fn left_out(&self) -> &[String] {
        &self.left_out
    }

    fn build(&self, variant: &Variant) -> Result<Box<dyn Plant>, String> {
        self.built(variant, &is_compared)
    }

    fn build_with_drives(&self, variant: &Variant) -> Result<Box<dyn Plant>, String> {
        self.built(variant, &|signal| {
            is_compared(signal) || is_of_a_drive(signal)
        })
    }

    fn build_with_contacts(&self, variant: &Variant) -> Result<Box<dyn Plant>, String> {
        self.built(variant, &|signal| {
            is_compared(signal) || is_of_a_contact(signal)
        })
    }
}

/// Whether studies compare the signal.
pub(super) fn is_compared(name: &str) -> bool {
    let of_leg = signal::parse_leg(name).map(|(_, of_leg)| of_leg);
    [signal::BODY_POSITION, signal::BODY_ORIENTATION].contains(&name)
        || of_leg.is_some_and(|it| [signal::FOOT_POSITION, signal::FOOT_LOAD].contains(&it))
}

fn is_of_a_drive(name: &str) -> bool {
    let of_drive = |of_leg| {
        signal::DRIVES
            .iter()
            .any(|it| [it.0, it.1].contains(&of_leg))
    };
    signal::parse_leg(name).is_some_and(|(_, of_leg)| of_drive(of_leg))
}

fn is_of_a_contact(name: &str) -> bool {
    let of_leg = signal::parse_leg(name).map(|(_, of_leg)| of_leg);
    of_leg.is_some_and(|it| [signal::FOOT_FORCE, signal::FOOT_CLEARANCE].contains(&it))
}

fn scene(
    registry: &Registry,
    assembly: &Assembly<'_>,
    duration: Option<SimDuration>,
) -> Result<StudyInput, Error> {
    let scenario = assembly.scenario();
    let step = registry.plant_step(&scenario.plant);
    let (ground, robot) = (scenario.plant.ground.as_ref(), assembly.robot());
    let sole = robot.and_then(|robot| robot.legs.first()?.leg.compliance);
    Ok(StudyInput {
        name: scenario.name.clone(),
        file: scenario.file.clone(),
        duration: scenario.duration,
        ground: scenario.plant.ground.is_some(),
        servos: scenario.actuator.kind == ActuatorKind::Servo,
        commands: commands(
            assembly,
            duration.map_or(TRANSPORT_DURATION, |duration| {
                duration.max(TRANSPORT_DURATION)
            }),
        )?,
        step: step.unwrap_or(scenario.io.step),
        // One coefficient describes a ground without surfaces only.
        friction: ground
            .filter(|ground| ground.surfaces.is_empty())
            .and_then(|ground| ground.friction.or(robot.map(|robot| robot.friction))),
        sole_stiffness: sole.map(|sole| sole.sole.stiffness),
        weight: assembly.robot().map_or(0.0, Robot::weight),
    })
}

/// Records the controller's commands in a run with the scenario's plant.
fn commands(assembly: &Assembly<'_>, duration: SimDuration) -> Result<Commands, Error> {
    let scenario = assembly.scenario();
    if scenario.controller.is_none() || scenario.actuator.kind == ActuatorKind::None {
        return Ok(Commands::none());
    }
    let mut tape = None;
    let mut rig = assembly.rig_around(|plant| {
        let (tapped, its_tape) = CommandRecorder::new(plant);
        tape = Some(its_tape);
        Box::new(tapped)
    })?;
    let end = assembly.end().min(SimTime::ZERO + duration);
    rig.run_until(end, &mut ())
        .map_err(|error| assembly.rig_error(error))?;
    Ok(tape.map_or_else(Commands::none, |tape| tape.commands()))
}

#[cfg(test)]
mod tests {
    use twinrig_rig::{MethodSetting, Scales};

    use super::*;
    use crate::incidents::Incidents;
    use crate::measured::Measured as _;
    use crate::plants::plant_run::{Ending, PlantRun};
    use crate::plants::precision::TimedRow;
    use crate::plants::row::Row;
    use crate::stopwatch::Deadline;
    use crate::{PrecisionPlan, RowKind, precision};

    /// The models differ by the mass of the segments, and therefore in proportion to it.
    #[test]
    fn the_full_legs_become_the_mass_less_ones_as_their_segments_lose_their_mass() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios/passive-legs.toml");
        let registry = Registry::standard();
        let duration = Some(SimDuration::from_millis(40));
        let builder = StudyBuilder::new(&registry, &path, &[], &[], duration).unwrap();
        let plan = PrecisionPlan {
            duration,
            steps: vec![SimDuration::from_millis(2)],
            tolerances: Vec::new(),
            masses: vec![0.3, 0.1, 0.03, 0.01],
            ensemble: 0,
            repetitions: 1,
            budget_s: 1e9,
        };
        let study = precision(&builder, &plan, &mut ()).unwrap();
        let limits = study.rows.iter().filter(|row| row.kind == RowKind::Limit);
        let errors: Vec<f64> = limits.map(|row| row.error_rms_m.unwrap()).collect();
        assert_eq!(errors.len(), 4);
        for pair in errors.windows(2) {
            let fell = pair[0] / pair[1];
            assert!((2.0..5.0).contains(&fell), "{errors:?}");
        }
    }

    /// Returns the plants that a study of `scenario` offers and those that it leaves out.
    fn offered(
        scenario: &str,
        names: &[&str],
        settings: &[(&str, &str)],
    ) -> (Vec<String>, Vec<String>) {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios");
        let settings = settings.iter().map(|(key, value)| Setting {
            origin: "--set".to_owned(),
            key: (*key).to_owned(),
            value: (*value).to_owned(),
        });
        let settings: Vec<Setting> = settings.collect();
        let names: Vec<String> = names.iter().map(|&name| name.to_owned()).collect();
        let registry = Registry::standard();
        let duration = Some(SimDuration::from_millis(10));
        let path = path.join(scenario);
        let builder = StudyBuilder::new(&registry, &path, &settings, &names, duration).unwrap();
        let labels = builder.plants().iter().map(|offer| offer.plant.label());
        (labels.collect(), builder.left_out().to_vec())
    }

    #[test]
    fn both_formulations_of_constraints_are_offered_whatever_the_scenario_says() {
        let both = ["massless", "massless, compliant", "lcp", "lcp, compliant"];
        let names = ["massless", "lcp"];
        assert_eq!(offered("trot.toml", &names, &[]).0, both);
        let compliant = [
            ("plant.constraints", "\"compliant\""),
            ("plant.tolerance", "\"1 um\""),
        ];
        assert_eq!(offered("trot.toml", &names, &compliant).0, both);
        // A plant without constraints is not left out for those of the scenario.
        let (_, left_out) = offered("trot.toml", &[], &compliant);
        let drives = left_out.iter().find(|why| why.starts_with("drives: "));
        assert!(
            drives.unwrap().contains("simulates motors only"),
            "{left_out:?}"
        );
        let legs = offered("passive-legs.toml", &["massless", "lcp"], &compliant[..1]).0;
        assert_eq!(legs, ["massless", "lcp", "lcp, compliant"]);
        let lookup = [("plant.force", "\"lookup\""), ("plant.cells", "16")];
        assert_eq!(offered("trot.toml", &["massless"], &lookup).0, both[..2]);
    }

    /// Also where only a part of a share has passed, and the result is complete by other runs.
    #[test]
    fn run_over_budget_is_an_incident_and_a_skipped_row_is_cut() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios/passive-legs.toml");
        let (registry, names) = (Registry::standard(), ["massless".to_owned()]);
        let builder = StudyBuilder::new(&registry, &path, &[], &names, None).unwrap();
        let offer = &builder.plants()[0];
        let variant = Variant {
            plant: offer.plant.clone(),
            method: offer.methods[0].name.clone(),
            setting: MethodSetting::Step(SimDuration::from_millis(1)),
            scales: Scales::AS_IS,
        };
        let mut plant = builder.build(&variant).unwrap();
        let incidents = Incidents::default();
        let run = PlantRun {
            commands: &Commands::none(),
            end: SimTime::ZERO + SimDuration::from_millis(10),
            grid: SimDuration::from_millis(1),
            deadline: Deadline::within(0.0),
            incidents: &incidents,
        };
        let (ending, _) = run.timed(&mut *plant);
        assert_eq!(
            (ending, incidents.count()),
            (Ending::OverBudget(SimTime::ZERO), 1)
        );
        let row = Row::new(RowKind::Integration, &variant).cut_off("too slow");
        assert!(TimedRow { row, run_s: 0.0 }.is_cut());
    }

    /// Without drives a massless leg has no inertia about its hip.
    #[test]
    fn unsuitable_formulation_is_left_out_with_its_reason() {
        let (labels, left_out) = offered("passive-legs.toml", &["massless", "lcp"], &[]);
        assert_eq!(labels, ["massless", "lcp", "lcp, compliant"]);
        let [why] = &left_out[..] else {
            panic!("{left_out:?}");
        };
        assert!(why.starts_with("massless, compliant: "), "{why}");
    }
}
