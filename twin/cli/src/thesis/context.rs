//! Runs and studies from which items are measured.

use std::cell::{Cell, RefCell};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use twinrig_document::Document;
use twinrig_experiment::options::CommonOptions;
use twinrig_experiment::{
    BenchRecorder, Error, EstimatePlan, EstimateStudy, Factor, ModulationOptions, ModulationPlan,
    ModulationStudy, PlantFactory, SearchSize, StabilityPlan, Study, StudyBuilder, StudyInput,
    TransitionOptions, TransitionPlan, TransitionStudy, estimate, stability,
};
use twinrig_rig::assembly::Assembly;
use twinrig_rig::registry::Registry;
use twinrig_rig::report::{Report, Status};
use twinrig_rig::run::execute::execute_until;
use twinrig_rig::run::execution::Execution;
use twinrig_rig::{PlantOffer, Variant};
use twinrig_scenario::{Outcome, Setting};

use crate::error::ThesisError;
use crate::error::TwinError;
use crate::thesis::gaits;
use crate::thesis::progress::ItemProgress;
use crate::thesis::verdict::Measurement;

/// Budget of studies: none, as a truncated study depends on the machine \[s\].
const NO_BUDGET: f64 = 1e9;

/// Registry, scenarios and settings of the measurements, and studies that several items share.
pub(crate) struct Context<'r> {
    registry: &'r Registry,
    /// Folder of the scenarios.
    scenarios: PathBuf,
    /// Settings of all scenarios.
    settings: Vec<Setting>,
    /// Whether they were read.
    reads_settings: Cell<bool>,
    progress: RefCell<ItemProgress<'r>>,
    stability: RefCell<Option<Rc<Study>>>,
    free_stability: RefCell<Option<Rc<Study>>>,
    identification: RefCell<Option<Rc<EstimateStudy>>>,
}

impl<'r> Context<'r> {
    pub(crate) fn new(
        registry: &'r Registry,
        scenarios: &Path,
        settings: Vec<Setting>,
        progress: ItemProgress<'r>,
    ) -> Self {
        Self {
            registry,
            scenarios: scenarios.to_owned(),
            settings,
            reads_settings: Cell::new(false),
            progress: RefCell::new(progress),
            stability: RefCell::default(),
            free_stability: RefCell::default(),
            identification: RefCell::default(),
        }
    }

    /// Shows that the item with this index begins.
    pub(crate) fn begin(&self, index: usize) {
        self.progress.borrow_mut().begin(index);
    }

    pub(crate) fn registry(&self) -> &'r Registry {
        self.registry
    }

    /// Returns the settings of all scenarios.
    pub(crate) fn settings(&self) -> &[Setting] {
        self.reads_settings.set(true);
        &self.settings
    }

    /// Returns whether the settings had no effect, as no scenario was read.
    pub(crate) fn ignores_settings(&self) -> bool {
        !self.settings.is_empty() && !self.reads_settings.get()
    }

    /// Returns the path of a scenario or specification.
    ///
    /// # Errors
    /// [`ThesisError::NoScenario`] if there is no such file.
    pub(crate) fn path(&self, file: &str) -> Result<PathBuf, TwinError> {
        let path = self.scenarios.join(file);
        if path.is_file() {
            Ok(path)
        } else {
            Err(ThesisError::NoScenario { path }.into())
        }
    }

    /// Reads a scenario.
    ///
    /// # Errors
    /// As [`AssemblyBuilder::file`](twinrig_rig::AssemblyBuilder::file).
    pub(crate) fn assembly(&self, file: &str) -> Result<Assembly<'r>, TwinError> {
        self.assembly_with(file, &[], "")
    }

    /// Runs a scenario.
    ///
    /// # Errors
    /// Errors of the scenario, and of a run that does not complete.
    pub(crate) fn run(&self, file: &str) -> Result<RunReport, TwinError> {
        self.run_with(file, &[], "")
    }

    /// Runs a scenario with settings, each a key and a value, and further expectations in TOML.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub(crate) fn run_with(
        &self,
        file: &str,
        settings: &[(&str, &str)],
        expectations: &str,
    ) -> Result<RunReport, TwinError> {
        let assembly = self.assembly_with(file, settings, expectations)?;
        let report = execute_until(&assembly, &Execution::default(), assembly.end())?;
        match (report.verdict, &report.error) {
            (Status::Error, error) => Err(ThesisError::Run {
                file: report.file.clone(),
                reason: error.clone().unwrap_or_default(),
            }
            .into()),
            _ => Ok(RunReport(report)),
        }
    }

    /// Reads a scenario as [`Self::run_with`] does.
    ///
    /// # Errors
    /// As [`AssemblyBuilder::file`](twinrig_rig::AssemblyBuilder::file).
    pub(crate) fn assembly_with(
        &self,
        file: &str,
        settings: &[(&str, &str)],
        expectations: &str,
    ) -> Result<Assembly<'r>, TwinError> {
        let path = self.path(file)?;
        let mut all: Vec<Setting> = settings
            .iter()
            .map(|(key, value)| Setting {
                origin: "thesis".to_owned(),
                key: (*key).to_owned(),
                value: (*value).to_owned(),
            })
            .collect();
        all.extend(self.settings().iter().cloned());
        if expectations.is_empty() {
            return Ok(Assembly::builder(self.registry)
                .settings(&all)
                .file(&path)?);
        }
        let text = format!("{}\n{expectations}", Document::read(&path)?.text());
        let folder = path.parent().unwrap_or(Path::new(""));
        let name = path.display().to_string();
        Ok(Assembly::builder(self.registry)
            .settings(&all)
            .text(&name, &text, folder)?)
    }

    /// Returns the study of the stable steps of both models of the leg (section 2.5.1), with all
    /// of the stiffness and with a quarter of it.
    ///
    /// # Errors
    /// Errors of the scenario or of the study.
    pub(crate) fn stability(&self) -> Result<Rc<Study>, TwinError> {
        self.stable_steps(&self.stability, "passive-legs.toml", &[1.0, 0.25])
    }

    /// Returns the same of legs that reach no stop.
    ///
    /// # Errors
    /// As [`Self::stability`].
    pub(crate) fn free_stability(&self) -> Result<Rc<Study>, TwinError> {
        self.stable_steps(&self.free_stability, "passive-legs-free.toml", &[1.0])
    }

    fn stable_steps(
        &self,
        known: &RefCell<Option<Rc<Study>>>,
        file: &str,
        stiffnesses: &[f64],
    ) -> Result<Rc<Study>, TwinError> {
        if let Some(study) = &*known.borrow() {
            return Ok(Rc::clone(study));
        }
        let path = self.path(file)?;
        let plants = ["lcp", "massless"].map(str::to_owned);
        let builder = StudyBuilder::new(self.registry, &path, self.settings(), &plants, None)?;
        let selected = Selected::of(&builder, &["rodas4", "rk4", "explicit-euler", "midpoint"]);
        let plan = StabilityPlan {
            factors: vec![Factor::Stiffness],
            values: Some(stiffnesses.into()),
            budget_s: NO_BUDGET,
            ..StabilityPlan::default()
        };
        let study = stability(&selected, &plan, &mut *self.progress.borrow_mut());
        let study = Rc::new(study.map_err(|source| of_study(&path, source))?);
        *known.borrow_mut() = Some(Rc::clone(&study));
        Ok(study)
    }

    /// Returns the study of load filters with the least search, for its identification of the
    /// cells.
    ///
    /// # Errors
    /// Errors of the scenario or of the study.
    pub(crate) fn identification(&self) -> Result<Rc<EstimateStudy>, TwinError> {
        if let Some(study) = &*self.identification.borrow() {
            return Ok(Rc::clone(study));
        }
        let least = SearchSize {
            particles: 1,
            iterations: 1,
        };
        let study = Rc::new(self.estimate(least)?);
        *self.identification.borrow_mut() = Some(Rc::clone(&study));
        Ok(study)
    }

    /// Returns the complete study of load filters.
    ///
    /// # Errors
    /// Errors of the scenario or of the study.
    pub(crate) fn tuning(&self) -> Result<EstimateStudy, TwinError> {
        self.estimate(EstimatePlan::default().search)
    }

    /// Returns the studies of footstep modulation of a scenario with each of the gaits that
    /// searches of a `space` found, on its own plant.
    ///
    /// # Errors
    /// Errors of the space and its gaits, of the scenario or of a study.
    pub(crate) fn modulations(
        &self,
        file: &str,
        space: &str,
    ) -> Result<Vec<ModulationStudy>, TwinError> {
        let (file, space) = (self.path(file)?, self.path(space)?);
        let gaits = gaits::read(&space)?.into_iter();
        gaits.map(|gait| self.modulation(&file, gait)).collect()
    }

    fn modulation(
        &self,
        path: &Path,
        mut settings: Vec<Setting>,
    ) -> Result<ModulationStudy, TwinError> {
        settings.extend(self.settings().iter().cloned());
        let ModulationPlan { points, steps, .. } = ModulationPlan::default();
        let options = ModulationOptions {
            scenarios: vec![path.to_owned()],
            variable: None,
            by: Vec::new(),
            after: None,
            points,
            steps,
            factors: false,
            common: CommonOptions::default(),
        };
        let progress = &mut *self.progress.borrow_mut();
        Ok(options.study(self.registry, &settings, progress)?)
    }

    /// Returns the study of gait transitions of a scenario, on its own plant.
    ///
    /// # Errors
    /// Errors of the scenario or of the study.
    pub(crate) fn transition(&self, file: &str) -> Result<TransitionStudy, TwinError> {
        let path = self.path(file)?;
        let plan = TransitionPlan::default();
        let options = TransitionOptions {
            scenario: path.clone(),
            variable: None,
            plateau: Vec::new(),
            tolerance: plan.tolerance,
            cycles: plan.lasting,
            common: CommonOptions::default(),
        };
        let progress = &mut *self.progress.borrow_mut();
        Ok(options.study(self.registry, self.settings(), progress)?)
    }

    fn estimate(&self, search: SearchSize) -> Result<EstimateStudy, TwinError> {
        let path = self.path("thesis/fig-4-11.toml")?;
        let bench = BenchRecorder::new(self.registry, &path, self.settings())?;
        let plan = EstimatePlan {
            search,
            budget_s: NO_BUDGET,
        };
        let study = estimate(&bench, &plan, &mut *self.progress.borrow_mut());
        study.map_err(|source| of_study(&path, source))
    }
}

fn of_study(path: &Path, source: twinrig_experiment::StudyError) -> TwinError {
    Error::of_study(&path.display().to_string(), source).into()
}

/// Report of a completed run.
pub(crate) struct RunReport(Report);

impl RunReport {
    /// Returns what an expectation measured, in SI units; none if it was not observed.
    ///
    /// # Errors
    /// [`ThesisError::NoExpectation`] if the scenario has none of that name.
    pub(crate) fn measured(&self, expectation: &str) -> Result<Option<Measurement>, TwinError> {
        let measured = self.outcome(expectation)?.measured;
        Ok(measured.map(Measurement::exact))
    }

    fn outcome(&self, expectation: &str) -> Result<&Outcome, TwinError> {
        let mut outcomes = self.0.expectations.iter().map(|line| &line.outcome);
        let found = outcomes.find(|outcome| outcome.name == expectation);
        found.ok_or_else(|| {
            ThesisError::NoExpectation {
                file: self.0.file.clone(),
                name: expectation.to_owned(),
            }
            .into()
        })
    }
}

/// Plants of a study with some of their methods.
struct Selected<'b, 'r> {
    builder: &'b StudyBuilder<'r>,
    offers: Vec<PlantOffer>,
}

impl<'b, 'r> Selected<'b, 'r> {
    fn of(builder: &'b StudyBuilder<'r>, methods: &[&str]) -> Self {
        let mut offers = builder.plants().to_vec();
        offers.retain(|offer| !offer.plant.is_compliant());
        for offer in &mut offers {
            let of_name = |name: &str| methods.contains(&name);
            offer.methods.retain(|method| of_name(&method.name));
        }
        Self { builder, offers }
    }
}

impl PlantFactory for Selected<'_, '_> {
    fn input(&self) -> &StudyInput {
        self.builder.input()
    }

    fn plants(&self) -> &[PlantOffer] {
        &self.offers
    }

    fn build(&self, variant: &Variant) -> Result<Box<dyn twinrig_runtime::Plant>, String> {
        self.builder.build(variant)
    }
}
