//! Selection of the plants of a study that suit a scenario.

use std::path::Path;
use std::rc::Rc;

use twinrig_kernel::SimDuration;
use twinrig_rig::assembly::Assembly;
use twinrig_rig::error::{Error as RigError, NO_ROBOT, guarded};
use twinrig_rig::parts::constraints::CONSTRAINTS;
use twinrig_rig::parts::method::Method;
use twinrig_rig::parts::plant_kind::SOFT;
use twinrig_rig::registry::Registry;
use twinrig_rig::{MethodOffer, MethodSetting, PlantOffer, Scales, SettingKind, Variant};
use twinrig_runtime::{Plant, catch_panic};
use twinrig_scenario::{Scenario, Setting};

use crate::error::first_line;
use crate::plants::builder::is_compared;
use crate::plants::scaled::{scaled_actuator, scaled_plant, scaled_robot};

/// Step at which every method can be built.
const TRIED_STEP: SimDuration = SimDuration::from_millis(1);
/// Tolerance at which every error-controlled method can be built.
const TRIED_TOLERANCE: f64 = 1e-6;

/// Plant of a study.
pub(crate) struct PlantUnderStudy<'r> {
    pub(crate) methods: Vec<Method>,
    /// The scenario with this plant; otherwise the reason of the failure, a row of the study.
    pub(crate) assembly: Rc<Result<Assembly<'r>, String>>,
}

/// Plants that can simulate the scenario, and the reasons against the others.
#[derive(Default)]
pub(crate) struct Selection<'r> {
    pub(crate) offers: Vec<PlantOffer>,
    pub(crate) benches: Vec<PlantUnderStudy<'r>>,
    pub(crate) left_out: Vec<String>,
    pub(crate) panics: Vec<String>,
    /// Error of the first unsuitable plant.
    pub(crate) refused: Option<RigError>,
}

impl<'r> Selection<'r> {
    /// Adds the plant `name`, once for each formulation of its constraints.
    ///
    /// # Errors
    /// If a `requested` plant does not suit the scenario in any formulation.
    pub(crate) fn add(
        &mut self,
        registry: &'r Registry,
        path: &Path,
        settings: &[Setting],
        name: &str,
        requested: bool,
        scenario: &Scenario,
    ) -> Result<(), RigError> {
        let assembly = match with_any_constraints(registry, path, settings, name) {
            Err(RigError::Panic { source, .. }) => {
                self.panics.push(source.to_string());
                Err(source.to_string())
            }
            Err(error) if requested => return Err(error),
            Err(error) => {
                self.left_out
                    .push(format!("{name}: {}", first_line(&error.to_string())));
                self.refused.get_or_insert(error);
                return Ok(());
            }
            Ok(assembly) => Ok(assembly),
        };
        let panicked = assembly.is_err();
        let assembly = Rc::new(assembly);
        let (mut refused, before) = (None, self.offers.len());
        for (mut offer, methods) in registry.offers(name) {
            // Without contact an engine's soft constraints add nothing to its others.
            let is_soft = offer.plant.constraints.as_deref() == Some(SOFT);
            if is_soft && scenario.plant.ground.is_none() {
                continue;
            }
            let bench = PlantUnderStudy {
                methods,
                assembly: Rc::clone(&assembly),
            };
            if let (Some(why), false) = (bench.refusal(&offer), panicked) {
                self.left_out.push(format!("{}: {why}", offer.plant));
                refused.get_or_insert(why);
                continue;
            }
            bench.without_unsuitable_steps(&mut offer, &mut self.left_out);
            self.offers.push(offer);
            self.benches.push(bench);
        }
        if let (Some(why), true) = (refused, self.offers.len() == before) {
            let error = RigError::not_built(scenario, "plant", name, why.into());
            if requested {
                return Err(error);
            }
            self.refused.get_or_insert(error);
        }
        Ok(())
    }
}

impl PlantUnderStudy<'_> {
    /// Returns the reason why no method can simulate the scenario; `None` if one can, or panics,
    /// which its rows report.
    fn refusal(&self, offer: &PlantOffer) -> Option<String> {
        let mut refused = None;
        for method in &offer.methods {
            refused = Some(self.refusal_of(offer, method)?);
        }
        refused
    }

    /// Returns the reason why the method cannot simulate the scenario; `None` if it can, or panics.
    fn refusal_of(&self, offer: &PlantOffer, method: &MethodOffer) -> Option<String> {
        let variant = Variant {
            plant: offer.plant.clone(),
            method: method.name.clone(),
            setting: match method.set_by {
                SettingKind::Step => MethodSetting::Step(TRIED_STEP),
                SettingKind::Tolerance => MethodSetting::Tolerance(TRIED_TOLERANCE),
            },
            scales: Scales::AS_IS,
        };
        let built = catch_panic(|| self.built(&variant, &is_compared));
        built.ok()?.err()
    }

    /// Removes the methods that are steps of an engine alone where these do not suit the scenario,
    /// and adds the reasons to `left_out`.
    fn without_unsuitable_steps(&self, offer: &mut PlantOffer, left_out: &mut Vec<String>) {
        let methods = std::mem::take(&mut offer.methods);
        for method in methods {
            let steps = method.step_only;
            let refusal = if steps {
                self.refusal_of(offer, &method)
            } else {
                None
            };
            match refusal {
                Some(why) => left_out.push(format!("{} {}: {why}", offer.plant, method.name)),
                None => offer.methods.push(method),
            }
        }
    }

    pub(crate) fn built(
        &self,
        variant: &Variant,
        wanted: &dyn Fn(&str) -> bool,
    ) -> Result<Box<dyn Plant>, String> {
        let assembly = (*self.assembly).as_ref().map_err(Clone::clone)?;
        let methods = self.methods.iter();
        let method = methods.into_iter().find(|method| method.matches(variant));
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

/// Reads the scenario at `path` with the plant `name`, whatever constraints the scenario has for
/// other plants.
pub(crate) fn of_plant<'r>(
    registry: &'r Registry,
    path: &Path,
    settings: &[Setting],
    name: &str,
) -> Result<Assembly<'r>, RigError> {
    guarded(&path.display().to_string(), || {
        Assembly::builder(registry)
            .settings(settings)
            .plant(name)
            .file(path)
    })
}

/// Reads the scenario at `path` with the plant `name`, with other constraints if it cannot have the
/// scenario's: its methods set them.
///
/// # Errors
/// The error with the scenario's constraints.
pub(crate) fn with_any_constraints<'r>(
    registry: &'r Registry,
    path: &Path,
    settings: &[Setting],
    name: &str,
) -> Result<Assembly<'r>, RigError> {
    let own = of_plant(registry, path, settings, name);
    if matches!(own, Ok(_) | Err(RigError::Panic { .. })) {
        return own;
    }
    let offers = registry.offers(name).into_iter();
    let mut others = offers.filter_map(|(offer, _)| {
        let mut settings = settings.to_vec();
        settings.push(Setting {
            origin: "--set".to_owned(),
            key: format!("plant.{CONSTRAINTS}"),
            value: offer.plant.constraints?,
        });
        of_plant(registry, path, &settings, name).ok()
    });
    others.next().map_or(own, Ok)
}
