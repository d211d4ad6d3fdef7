//! Cases of a plan: settings of a part of its runs.

use twinrig_campaign::optimization::SearchCase;
use twinrig_campaign::sweep::overlap;
use twinrig_document::{DocumentError, Place, Placed, Problem};
use twinrig_scenario::Setting;

use crate::error::Error;
use crate::runs::plan::RunRequest;

/// Case of a plan.
#[derive(Clone, Debug, Default)]
pub(crate) struct RunCase {
    /// Its name; none of the only case of a plan without cases.
    pub(crate) name: Option<String>,
    /// Its settings.
    pub(crate) settings: Vec<Setting>,
    /// Places of the first of its settings, in the file of the points.
    places: Vec<Place>,
}

impl RunCase {
    /// Returns a case of a search space.
    pub(crate) fn new(case: &SearchCase) -> Self {
        let name = &case.name.value;
        let setting = |(key, value): &(Placed<String>, String)| Setting {
            origin: format!("[[case]] {name}: {}", key.value),
            key: key.value.clone(),
            value: value.clone(),
        };
        Self {
            name: Some(name.clone()),
            settings: case.set.iter().map(setting).collect(),
            places: case.set.iter().map(|(key, _)| key.place.clone()).collect(),
        }
    }

    /// Returns a case without a name.
    pub(crate) fn of_settings(settings: Vec<Setting>) -> Self {
        Self {
            settings,
            ..Self::default()
        }
    }

    /// Returns the settings that have a place, with it.
    fn placed(&self) -> impl Iterator<Item = (&Setting, &Place)> {
        self.settings.iter().zip(&self.places)
    }

    /// Returns a problem at the place of the setting that it is about; of another one with the name
    /// of the case.
    pub(super) fn named(&self, problem: Problem) -> Problem {
        let mut placed = self.placed();
        if let Some((_, place)) = placed.find(|(setting, _)| setting.origin == problem.file) {
            return Problem::at(place, problem.message, problem.help);
        }
        let Some(name) = &self.name else {
            return problem;
        };
        Problem {
            message: format!("{}, in the case `{name}`", problem.message),
            ..problem
        }
    }

    /// Returns the word of messages if the case sets `key`, or a part of it.
    pub(super) fn sets(&self, key: &str) -> Option<String> {
        let set = self.settings.iter().any(|it| overlap(&it.key, key));
        set.then(|| format!("the case `{}`", self.name.as_deref().unwrap_or_default()))
    }
}

/// Checks that no case sets a key that a setting of all runs has, too.
pub(super) fn check(request: &RunRequest<'_>) -> Result<(), Error> {
    let of_all = request.set.iter().map(|(key, _)| (key.as_str(), "`set`"));
    let of_all = of_all.chain(
        request
            .settings
            .iter()
            .map(|it| (it.key.as_str(), it.origin.as_str())),
    );
    let of_all: Vec<(&str, &str)> = of_all.collect();
    let settings = request.cases.iter().flat_map(RunCase::placed);
    let problem = |(setting, place): (&Setting, &Place)| {
        let mut of_all = of_all.iter();
        let (_, by) = of_all.find(|(key, _)| overlap(key, &setting.key))?;
        let message = format!("`{}` is set for all runs, by {by}", setting.key);
        Some(Problem::at(
            place,
            message,
            "leave out one of both settings",
        ))
    };
    let problems: Vec<Problem> = settings.filter_map(problem).collect();
    if problems.is_empty() {
        Ok(())
    } else {
        Err(DocumentError { problems }.into())
    }
}
