//! Plan of an optimisation: its search space, its runs and their order.

use std::f64::consts::PI;
use std::path::Path;

use twinrig_campaign::optimization::{ConstraintChoice, CostRule, JudgedExpectation, SearchSpace};
use twinrig_document::{Document, DocumentError, Item, Placed, Problem, suggestion};
use twinrig_kernel::SimTime;
use twinrig_rig::registry::Registry;
use twinrig_rig::report::seconds;
use twinrig_scenario::{BodyClaim, Claim, CostMeasure, Expectation, Scenario, Setting};

use crate::error::Error;
use crate::runs::cases::RunCase;
use crate::runs::plan::{RunPlan, RunRequest};

/// Whether a fall ends the run.
const FALL_END: (&str, &str) = ("fall.end", "true");
/// Key of the duration.
const DURATION: &str = "duration";

/// A planned optimisation.
pub(crate) struct OptimizationPlan<'r> {
    pub(crate) space: SearchSpace,
    pub(crate) runs: RunPlan<'r>,
    /// Order of runs, for each case.
    pub(crate) rules: Vec<CostRule>,
    /// Symbol of the unit of the objective.
    pub(crate) unit: String,
    /// Simulated time of a point without a fall \[s\], in all cases; none if it is searched.
    pub(crate) duration_s: Option<f64>,
    /// Scenario file.
    pub(crate) document: Document,
    /// Settings of all runs that belong to the scenario: without those that save time.
    pub(crate) set: Vec<Setting>,
}

impl<'r> OptimizationPlan<'r> {
    /// Reads all files, and checks them as far as that is possible without a run.
    pub(crate) fn new(
        registry: &'r Registry,
        scenario: &Path,
        space: SearchSpace,
        settings: &[Setting],
    ) -> Result<Self, Error> {
        let document = Document::read(scenario)?;
        let cases = cases(&space, &document, settings);
        let request = RunRequest {
            scenario,
            file: &space.file,
            set: &space.set,
            settings,
            keys: space.dimensions.iter().map(|it| it.key.clone()).collect(),
            cases,
            recorded: false,
        };
        let (mut runs, _) = RunPlan::new(registry, request)?;
        let scenarios = runs.read_files()?;
        runs.check_scenario()?;
        for case in 0..scenarios.len() {
            for (index, dimension) in space.dimensions.iter().enumerate() {
                for value in dimension.interval.ends() {
                    runs.check_value(case, index, &value)?;
                }
            }
        }
        let (rules, unit) = cost_rules(&space, &scenarios)?;
        let durations = scenarios.iter().map(|it| seconds(it.duration.as_nanos()));
        let is_searched = runs.keys.iter().any(|key| key == DURATION);
        let own = space.set.iter().map(|(key, value)| Setting {
            origin: space.file.clone(),
            key: key.clone(),
            value: value.clone(),
        });
        Ok(Self {
            rules,
            unit,
            duration_s: (!is_searched).then(|| durations.sum()),
            document,
            set: own.chain(settings.iter().cloned()).collect(),
            runs,
            space,
        })
    }
}

impl OptimizationPlan<'_> {
    /// Returns the names of the constraints of all cases.
    pub(super) fn constraint_names(&self) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for one in self.rules.iter().flat_map(|rule| &rule.constraints) {
            if !names.contains(&one.name) {
                names.push(one.name.clone());
            }
        }
        names
    }
}

/// Returns the cases of a plan; one without a name for a space without cases. Falls end all runs of
/// which nothing else decides it.
fn cases(space: &SearchSpace, document: &Document, settings: &[Setting]) -> Vec<RunCase> {
    let mut cases: Vec<RunCase> = space.cases.iter().map(RunCase::new).collect();
    if cases.is_empty() {
        cases.push(RunCase::default());
    }
    for case in &mut cases {
        let all: Vec<Setting> = settings.iter().chain(&case.settings).cloned().collect();
        if !sets_end(document, &space.set, &all) {
            // After the others, which may set the table `fall`.
            let (key, value) = FALL_END;
            case.settings.push(Setting {
                origin: space.file.clone(),
                key: key.to_owned(),
                value: value.to_owned(),
            });
        }
    }
    cases
}

/// Returns whether scenario or settings decide themselves if a fall ends a run.
fn sets_end(document: &Document, set: &[(String, String)], settings: &[Setting]) -> bool {
    let mut document = document.clone();
    let set = set.iter().map(|(key, value)| (key, value));
    for (key, value) in set.chain(settings.iter().map(|it| (&it.key, &it.value))) {
        // A setting that cannot be is reported when the scenario is read.
        let _ = document.set("", key, value);
    }
    let mut sets = false;
    let _ = document.check(|table| {
        let end = |fall: Item<'_>| fall.peek("end").is_some();
        sets = table.get("fall").is_some_and(end);
        Ok(())
    });
    sets
}

/// Returns the order of runs in each case, and the symbol of the unit of the objective.
fn cost_rules(
    space: &SearchSpace,
    scenarios: &[Scenario],
) -> Result<(Vec<CostRule>, String), Error> {
    let rules = scenarios.iter().map(|scenario| cost_rule(space, scenario));
    let (mut rules, units): (Vec<CostRule>, Vec<String>) = rules
        .collect::<Result<Vec<_>, Error>>()?
        .into_iter()
        .unzip();
    let most = rules.iter().map(|rule| rule.constraints.len()).max();
    for rule in &mut rules {
        rule.constraints_most = most.unwrap_or_default();
    }
    Ok((rules, units.into_iter().next().unwrap_or_default()))
}

/// Returns the order of runs of a case, and the symbol of the unit of the objective.
fn cost_rule(space: &SearchSpace, scenario: &Scenario) -> Result<(CostRule, String), Error> {
    let mut problems = Vec::new();
    let mut known = |name: &Placed<String>| match named(name, scenario) {
        Ok(expectation) => Some(expectation),
        Err(problem) => {
            problems.push(problem);
            None
        }
    };
    let objective = known(&space.objective);
    let constraints: Vec<(&Expectation, &Placed<String>)> = match &space.constraints {
        ConstraintChoice::Named(names) => names
            .iter()
            .filter_map(|name| Some((known(name)?, name)))
            .collect(),
        ConstraintChoice::All(word) => {
            let others = scenario.expectations.iter();
            let others = others.filter(|one| one.name != space.objective.value);
            others.map(|one| (one, word)).collect()
        }
    };
    problems.extend(objective.and_then(|one| no_objective(one, &space.objective)));
    problems.extend(
        constraints
            .iter()
            .filter_map(|(one, name)| no_function_of_the_run(one, name)),
    );
    let objective_named = objective.map(|one| (one, &space.objective));
    let all = constraints.iter().copied().chain(objective_named);
    problems.extend(all.filter_map(|(one, name)| discarded_by_fall(one, name, scenario)));
    match objective {
        Some(objective) if problems.is_empty() => {
            let rule = CostRule {
                objective: judged(objective),
                direction: space.direction,
                constraints: constraints.iter().map(|(one, _)| judged(one)).collect(),
                constraints_most: constraints.len(),
            };
            Ok((rule, objective.unit().symbol().to_owned()))
        }
        _ => Err(DocumentError { problems }.into()),
    }
}

fn judged(expectation: &Expectation) -> JudgedExpectation {
    let before = expectation.changed_by_falls_before();
    JudgedExpectation {
        name: expectation.name.clone(),
        before_s: before.map(SimTime::as_secs_f64),
        rates_falls: expectation.rates_falls(),
    }
}

/// Returns the expectation of that name.
fn named<'s>(name: &Placed<String>, scenario: &'s Scenario) -> Result<&'s Expectation, Problem> {
    let of = |expectations: &'s [Expectation]| {
        let mut expectations = expectations.iter();
        expectations.find(|one| one.name == name.value)
    };
    if let Some(expectation) = of(&scenario.expectations) {
        return Ok(expectation);
    }
    let Placed { value, place } = name;
    let plant = &scenario.plant.model;
    if let Some(other) = of(&scenario.of_other_plants) {
        let message = format!("the expectation `{value}` is not about {plant}");
        let help = format!("it is about {}", other.plants.join(", "));
        return Err(Problem::at(place, message, help));
    }
    let names = scenario.expectations.iter().map(|one| one.name.as_str());
    let message = format!("{} has no expectation `{value}`", scenario.file);
    Err(Problem::at(
        place,
        message,
        suggestion(value, "expectations", names),
    ))
}

/// Returns the problem of an expectation that is no objective.
fn no_objective(expectation: &Expectation, name: &Placed<String>) -> Option<Problem> {
    if let Claim::Body(BodyClaim::Upright { .. }) = expectation.claim {
        let message = format!("`{}` is about a fall, which has no one measure", name.value);
        let help =
            "make it a constraint; runs that fall are ordered by the time of the fall anyway";
        return Some(Problem::at(&name.place, message, help));
    }
    no_function_of_the_run(expectation, name)
}

/// Returns the problem of an expectation about the time after a fall.
fn discarded_by_fall(
    expectation: &Expectation,
    name: &Placed<String>,
    scenario: &Scenario,
) -> Option<Problem> {
    let is_reached = scenario.fall.height > 0.0 || scenario.fall.tilt < PI;
    let Claim::Body(BodyClaim::GetsUp(_)) = expectation.claim else {
        return None;
    };
    let message = format!(
        "a run in which the robot falls has no value of `{}`",
        expectation.name
    );
    let help = "set thresholds that nothing crosses, `fall = { height = 0, tilt = \"180 deg\" }`, \
                with contact of the trunk";
    is_reached.then(|| Problem::at(&name.place, message, help))
}

/// Returns the problem of an expectation whose value depends on the machine.
fn no_function_of_the_run(expectation: &Expectation, name: &Placed<String>) -> Option<Problem> {
    let Claim::Cost(CostMeasure::RealTimeFactor, _) = expectation.claim else {
        return None;
    };
    let message = format!("`{}` depends on the machine and its load", expectation.name);
    let help = "take a count of the plant, such as `steps`, or list the constraints without it";
    Some(Problem::at(&name.place, message, help))
}
