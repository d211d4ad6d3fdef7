//! Plants of a study, built from a scenario.

use std::path::Path;

use twinrig_kernel::{SimDuration, SimTime, signal};
use twinrig_robot::Robot;
use twinrig_runtime::{Plant, catch_panic};
use twinrig_scenario::{ActuatorKind, ActuatorSpec, PlantSpec, Setting};
use twinrig_study::{
    CommandRecorder, Commands, MethodOffer, MethodSetting, PlantFactory, PlantOffer, STROLL,
    Scales, SettingKind, Study, StudyInput, Variant,
};

use crate::assembly::Assembly;
use crate::assembly::registry::Registry;
use crate::error::NO_ROBOT;
use crate::error::{TwinError, guarded};
use crate::parts::method::Method;

/// Reason for excluding standalone plants from these studies.
const STANDS_ALONE: &str = "studies of precision and stability vary the robot file, and this plant has a standalone model: only \
                            `twin study coupling` applies to it";

/// Step at which every method can be built.
const TRIED_STEP: SimDuration = SimDuration::from_millis(1);
/// Tolerance at which every error-controlled method can be built.
const TRIED_TOLERANCE: f64 = 1e-6;

/// Builds the plants of a study from a scenario.
pub(crate) struct StudyBuilder<'r> {
    scene: StudyInput,
    offers: Vec<PlantOffer>,
    /// Plants whose model an offer solves, for its reference.
    bystanders: Vec<PlantOffer>,
    /// Plants of the offers, then of the bystanders.
    benches: Vec<PlantUnderStudy<'r>>,
    /// Unselected plants that cannot simulate the scenario, with the reason.
    left_out: Vec<String>,
    /// Panics of plants that were built to check them.
    panics: Vec<String>,
}

/// Plant of a study.
struct PlantUnderStudy<'r> {
    methods: Vec<Method>,
    /// The scenario with this plant; otherwise the reason of the failure, a row of the study.
    assembly: Result<Assembly<'r>, String>,
}

impl<'r> StudyBuilder<'r> {
    /// Selects the plants called `names`, or all, in the scenario at `path` with `settings`.
    ///
    /// # Errors
    /// Errors of the scenario, or of a plant selected by name.
    pub(crate) fn new(
        registry: &'r Registry,
        path: &Path,
        settings: &[Setting],
        names: &[String],
        duration: Option<SimDuration>,
    ) -> Result<Self, TwinError> {
        let own = Assembly::of_file(registry, path, settings)?;
        let spec = &own.scenario().plant;
        if spec.is_standalone {
            return Err(TwinError::not_built(
                own.scenario(),
                "plant",
                &spec.model,
                STANDS_ALONE.into(),
            ));
        }
        let plants = || registry.plants_on_robots();
        if let Some(standalone) = names.iter().find(|name| {
            registry.offer(name).is_some() && plants().all(|plant| plant != name.as_str())
        }) {
            return Err(TwinError::not_built(
                own.scenario(),
                "plant",
                standalone,
                STANDS_ALONE.into(),
            ));
        }
        let all: Vec<String> = match names {
            [] => registry.plants_on_robots().map(str::to_owned).collect(),
            names => names.to_vec(),
        };
        let (mut offers, mut benches, mut panics) = (Vec::new(), Vec::new(), Vec::new());
        let (mut left_out, mut refused) = (Vec::new(), None);
        for name in all {
            let Some((offer, methods)) = registry.offer(&name) else {
                // A scenario is read against the same plants, and refuses others.
                of_plant(registry, path, settings, &name)?;
                continue;
            };
            let bench = match of_plant(registry, path, settings, &name) {
                Err(TwinError::Panic { source, .. }) => {
                    panics.push(source.to_string());
                    PlantUnderStudy {
                        methods,
                        assembly: Err(source.to_string()),
                    }
                }
                Err(error) if !names.is_empty() => return Err(error),
                Err(error) => {
                    left_out.push(format!("{name}: {}", first_line(&error.to_string())));
                    refused.get_or_insert(error);
                    continue;
                }
                Ok(assembly) => PlantUnderStudy {
                    methods,
                    assembly: Ok(assembly),
                },
            };
            let panicked = bench.assembly.is_err();
            if let (Some(why), false) = (bench.refusal(&offer), panicked) {
                left_out.push(format!("{name}: {why}"));
                let error = TwinError::not_built(own.scenario(), "plant", &name, why.into());
                if !names.is_empty() {
                    return Err(error);
                }
                refused.get_or_insert(error);
                continue;
            }
            offers.push(offer);
            benches.push(bench);
        }
        // Where none can be in the scene, the scene is at fault.
        if let (Some(error), true) = (refused, offers.is_empty()) {
            return Err(error);
        }
        let mut bystanders: Vec<PlantOffer> = Vec::new();
        for model in models_beside(&offers) {
            if let Some((offer, methods)) = registry.offer(&model) {
                let assembly = of_plant(registry, path, settings, &model);
                let assembly = assembly.map_err(|error| first_line(&error.to_string()));
                bystanders.push(offer);
                benches.push(PlantUnderStudy { methods, assembly });
            }
        }
        Ok(Self {
            scene: scene(registry, &own, duration)?,
            offers,
            bystanders,
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
        let mut offers = self.offers.iter().chain(&self.bystanders);
        let place = offers.position(|offer| offer.name == variant.plant);
        let bench = place.and_then(|place| self.benches.get(place));
        let bench = bench.ok_or_else(|| format!("there is no plant `{}`", variant.plant))?;
        bench.built(variant, wanted)
    }
}

impl PlantUnderStudy<'_> {
    /// Returns the reason why no method can simulate the scenario; `None` if one can, or panics,
    /// which its rows report.
    fn refusal(&self, offer: &PlantOffer) -> Option<String> {
        let built = |method: &MethodOffer| {
            let variant = Variant {
                plant: offer.name.clone(),
                method: method.name.clone(),
                setting: match method.set_by {
                    SettingKind::Step => MethodSetting::Step(TRIED_STEP),
                    SettingKind::Tolerance => MethodSetting::Tolerance(TRIED_TOLERANCE),
                },
                scales: Scales::AS_IS,
            };
            match catch_panic(|| self.built(&variant, &is_compared)) {
                Ok(built) => built.map(drop),
                Err(_) => Ok(()),
            }
        };
        let mut refused = None;
        for method in &offer.methods {
            refused = Some(built(method).err()?);
        }
        refused
    }

    fn built(
        &self,
        variant: &Variant,
        wanted: &dyn Fn(&str) -> bool,
    ) -> Result<Box<dyn Plant>, String> {
        let assembly = self.assembly.as_ref().map_err(Clone::clone)?;
        let methods = self.methods.iter();
        let method = methods
            .into_iter()
            .find(|method| method.is_meant_by(variant));
        let method = method.ok_or_else(|| format!("there is no method `{}`", variant.method))?;
        let scenario = assembly.scenario();
        let robot = assembly.robot().ok_or(NO_ROBOT)?;
        let robot = scaled_robot(robot, &variant.scales);
        let plant = scaled_plant(
            method.set(&scenario.plant, variant.setting),
            &variant.scales,
        );
        let actuator = scaled_actuator(&scenario.actuator, variant.scales.gain);
        assembly
            .plant_of(&robot, &plant, &actuator, wanted)
            .map_err(|error| first_line(&error.to_string()))
    }
}

/// Reads the scenario at `path` with the plant `name`.
pub(crate) fn of_plant<'r>(
    registry: &'r Registry,
    path: &Path,
    settings: &[Setting],
    name: &str,
) -> Result<Assembly<'r>, TwinError> {
    let mut settings = settings.to_vec();
    settings.push(Setting::plant(name));
    guarded(&path.display().to_string(), || {
        Assembly::of_file(registry, path, &settings)
    })
}

/// Returns the plants whose models `offers` solve and that are not among them.
fn models_beside(offers: &[PlantOffer]) -> Vec<String> {
    let mut models: Vec<String> = Vec::new();
    for model in offers.iter().filter_map(|offer| offer.model_of.as_ref()) {
        if !models.contains(model) && offers.iter().all(|offer| offer.name != *model) {
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

    fn bystanders(&self) -> &[PlantOffer] {
        &self.bystanders
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
}

/// Whether studies compare the signal.
fn is_compared(name: &str) -> bool {
    let of_leg = signal::parse_leg(name).map(|(_, of_leg)| of_leg);
    name == signal::BODY_POSITION
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

pub(crate) fn first_line(error: &str) -> String {
    let line = error.lines().next().unwrap_or_default();
    line.trim_start_matches("error: ").to_owned()
}

fn scene(
    registry: &Registry,
    assembly: &Assembly<'_>,
    duration: Option<SimDuration>,
) -> Result<StudyInput, TwinError> {
    let scenario = assembly.scenario();
    let step = registry.plant_step(&scenario.plant);
    Ok(StudyInput {
        name: scenario.name.clone(),
        file: scenario.file.clone(),
        duration: scenario.duration,
        ground: scenario.plant.ground.is_some(),
        servos: scenario.actuator.kind == ActuatorKind::Servo,
        commands: commands(
            assembly,
            duration.map_or(STROLL, |duration| duration.max(STROLL)),
        )?,
        step: step.unwrap_or(scenario.io.step),
        weight: assembly.robot().map_or(0.0, Robot::weight),
    })
}

/// Records the controller's commands in a run with the scenario's plant.
fn commands(assembly: &Assembly<'_>, duration: SimDuration) -> Result<Commands, TwinError> {
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

fn scaled_robot(robot: &Robot, scales: &Scales) -> Robot {
    let mut robot = robot.clone();
    for mount in &mut robot.legs {
        let leg = &mut mount.leg;
        leg.diagonal.stiffness *= scales.stiffness;
        leg.parallel.stiffness *= scales.stiffness;
        if let Some(toe) = &mut leg.toe {
            toe.stiffness *= scales.stiffness;
        }
        let friction = &mut leg.joint_friction;
        for joint in [
            &mut friction.hip,
            &mut friction.knee,
            &mut friction.ankle,
            &mut friction.toe,
        ] {
            *joint *= scales.damping;
        }
        let mass = &mut leg.mass;
        for segment in [&mut mass.l1, &mut mass.l2, &mut mass.l3] {
            *segment *= scales.mass;
        }
        if scales.bare_foot {
            mass.lumped_foot = mass.foot;
        }
        // What a leg lumps into its foot it must have.
        mass.lumped_foot = mass.lumped_foot.min(mass.total());
    }
    for servo in [&mut robot.actuators.hip, &mut robot.actuators.knee] {
        servo.lag /= scales.gain;
    }
    robot
}

fn scaled_plant(mut plant: PlantSpec, scales: &Scales) -> PlantSpec {
    if let Some(ground) = &mut plant.ground {
        ground.friction = scales.friction.or(ground.friction);
        ground.restitution = scales.restitution.unwrap_or(ground.restitution);
    }
    plant
}

/// Divides the lag of the position loops, the reciprocal of their gain.
fn scaled_actuator(actuator: &ActuatorSpec, gain: f64) -> ActuatorSpec {
    let mut actuator = actuator.clone();
    for servo in [&mut actuator.hip, &mut actuator.knee] {
        servo.lag = servo.lag.map(|lag| lag / gain);
    }
    actuator
}

#[cfg(test)]
mod tests {
    use twinrig_robot::RobotFile;
    use twinrig_study::{PrecisionPlan, RowKind, precision};

    use super::*;

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

    #[test]
    fn scales_reach_what_they_are_of_and_nothing_else() {
        let robot = RobotFile::find("cheetah-cub", Path::new(""))
            .unwrap()
            .robot()
            .unwrap();
        assert_eq!(scaled_robot(&robot, &Scales::AS_IS), robot);
        let scales = Scales {
            stiffness: 2.0,
            mass: 0.5,
            damping: 3.0,
            gain: 4.0,
            ..Scales::AS_IS
        };
        let scaled = scaled_robot(&robot, &scales);
        let (own, new) = (&robot.legs[0].leg, &scaled.legs[0].leg);
        assert_eq!(new.diagonal.stiffness, 2.0 * own.diagonal.stiffness);
        assert_eq!(new.parallel.stiffness, 2.0 * own.parallel.stiffness);
        assert_eq!(new.diagonal.preload, own.diagonal.preload);
        assert_eq!(new.mass.l3, 0.5 * own.mass.l3);
        assert_eq!(new.mass.foot, own.mass.foot);
        assert_eq!(new.joint_friction.ankle, 3.0 * own.joint_friction.ankle);
        assert_eq!(scaled.actuators.hip.lag, robot.actuators.hip.lag / 4.0);
        assert_eq!(scaled.trunk, robot.trunk);
        // A leg of less than its lumped foot lumps what it has.
        let light = scaled_robot(
            &robot,
            &Scales {
                mass: 0.0,
                ..Scales::AS_IS
            },
        );
        assert_eq!(light.legs[0].leg.mass.lumped_foot, own.mass.foot);
    }
}
