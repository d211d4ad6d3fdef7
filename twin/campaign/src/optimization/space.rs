//! Reading of search spaces.

use std::path::Path;

use serde::Serialize;
use twinrig_document::{Document, DocumentError, Item, Placed, Reported, Table};

use super::case::{SearchCase, cases};
use super::keys::{
    CASE, CONSTRAINTS, DIMENSION, FROM, ITERATIONS, KEY, MAXIMIZE, METHOD, MINIMIZE, NAME,
    PARTICLES, RESTARTS, SCALE, SEED, SET, TO,
};
use crate::search::{CmaEs, Dimension, Search, SearchError, SwarmSearch};
use crate::sweep::read::{
    check_dimensions, interval, natural, refuse, refuse_scenario, scale, settings,
};
use crate::sweep::{SweepValue, ValueInterval};

/// Keys of a sweep's dimension that a search does not have.
const SWEEP_ONLY: [&str; 3] = ["values", "count", "whole"];
/// Standard deviation at which CMA-ES has converged, as a share of a range: below the resolution
/// of the values.
const TOLERANCE: f64 = 1e-7;

/// Method of a search.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum SearchMethod {
    /// Covariance matrix adaptation.
    CmaEs,
    /// Particle swarm.
    Pso,
}

impl SearchMethod {
    const WORDS: &'static [(&'static str, Self)] = &[("cma-es", Self::CmaEs), ("pso", Self::Pso)];

    /// Returns the word of a search space.
    pub fn word(self) -> &'static str {
        let word = Self::WORDS.iter().find(|(_, method)| *method == self);
        word.map_or("", |(word, _)| word)
    }
}

/// Whether great or small values of the objective are sought.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Direction {
    /// Great values.
    Maximize,
    /// Small values.
    Minimize,
}

impl Direction {
    /// Returns the key of a search space.
    pub fn word(self) -> &'static str {
        match self {
            Self::Maximize => MAXIMIZE,
            Self::Minimize => MINIMIZE,
        }
    }
}

/// Choice of the expectations that have to hold.
#[derive(Clone, Debug, PartialEq)]
pub enum ConstraintChoice {
    /// All but the objective; with the place of the word.
    All(Placed<String>),
    /// These; none of them by default.
    Named(Vec<Placed<String>>),
}

/// A setting that is searched.
#[derive(Clone, Debug, PartialEq)]
pub struct SpaceDimension {
    /// The key as the file has it: a dotted key of the scenario, or the name of a process variable.
    pub key: Placed<String>,
    /// Its range.
    pub interval: ValueInterval,
}

/// Space of a search: what is varied, what is sought, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct SearchSpace {
    /// Name in reports.
    pub name: String,
    /// Name of the file in messages.
    pub file: String,
    /// Method.
    pub method: SearchMethod,
    /// Points of a generation; none: the usual number of the method.
    pub particles: Option<usize>,
    /// Generations after the first one.
    pub iterations: usize,
    /// Restarts of CMA-ES.
    pub restarts: usize,
    /// Seed of the search.
    pub seed: u64,
    /// Settings of all runs: keys and values in TOML.
    pub set: Vec<(String, String)>,
    /// Dimensions; at least one.
    pub dimensions: Vec<SpaceDimension>,
    /// Cases; none: a point has one run, of the scenario.
    pub cases: Vec<SearchCase>,
    /// Name of the expectation whose measured value is the objective.
    pub objective: Placed<String>,
    /// Which values of it are sought.
    pub direction: Direction,
    /// Expectations that have to hold.
    pub constraints: ConstraintChoice,
}

impl SearchSpace {
    /// Reads a search space from a document.
    ///
    /// # Errors
    /// All problems, each with its position.
    pub fn read(document: &Document) -> Result<Self, DocumentError> {
        refuse_scenario(document, "a search space")?;
        document.check(|table| space(document, table))
    }

    /// Starts the search.
    ///
    /// # Errors
    /// [`SearchError`] if there are too few particles.
    pub fn search(&self) -> Result<Box<dyn Search>, SearchError> {
        let count = self.dimensions.len();
        Ok(match self.method {
            SearchMethod::Pso => {
                const PARTICLES: usize = 40;
                let particles = self.particles.unwrap_or(PARTICLES);
                Box::new(SwarmSearch::new(
                    count,
                    particles,
                    self.iterations,
                    self.seed,
                )?)
            }
            SearchMethod::CmaEs => Box::new(
                CmaEs {
                    dimensions: vec![Dimension::linear(0.0, 1.0); count],
                    population: self.particles,
                    iterations: self.iterations,
                    restarts: self.restarts,
                    tolerance: TOLERANCE,
                    seed: self.seed,
                    threads: 1,
                }
                .search()?,
            ),
        })
    }

    /// Returns the values at shares of the ranges, with as few decimals as a millionth of a range
    /// takes.
    pub fn point(&self, shares: &[f64]) -> Vec<SweepValue> {
        let pairs = self.dimensions.iter().zip(shares);
        pairs
            .map(|(dimension, &share)| dimension.interval.legible_at(share))
            .collect()
    }
}

fn space(document: &Document, table: &Table<'_>) -> Result<SearchSpace, Reported> {
    let name = table.optional(NAME, |item| item.text().map(str::to_owned));
    let method = table.optional(METHOD, |item| item.choice(SearchMethod::WORDS));
    let particles = table.optional(PARTICLES, |item| natural(item, 1));
    let iterations = table.optional(ITERATIONS, |item| natural(item, 0));
    let restarts = table.optional(RESTARTS, |item| natural(item, 0));
    let seed = table.optional(SEED, Item::natural);
    let set = table.optional(SET, settings);
    let cases = table.optional(CASE, cases);
    let objective = objective(table);
    let constraints = table.optional(CONSTRAINTS, constraints);
    let dimensions = table.required(DIMENSION, |item| item.each(dimension));
    let dimensions = dimensions.and_then(|dimensions| {
        check_dimensions(table, dimensions.iter().map(|it| &it.key))?;
        Ok(dimensions)
    });
    let restarts = match (method, restarts) {
        (Ok(Some(SearchMethod::Pso)), Ok(Some(_))) => {
            let message = format!("a particle swarm has no `{RESTARTS}`");
            let help = "leave it out, or take method = \"cma-es\"";
            Err(table.report(RESTARTS, message, help))
        }
        (_, restarts) => restarts,
    };
    let (method, restarts, dimensions) = (method?, restarts?, dimensions?);
    let method = method.unwrap_or(SearchMethod::CmaEs);
    let (objective, direction) = objective?;
    let file = document.file();
    let stem = || Path::new(file).file_stem();
    let space = SearchSpace {
        name: name?
            .or_else(|| stem().map(|stem| stem.to_string_lossy().into_owned()))
            .unwrap_or_default(),
        file: file.to_owned(),
        method,
        particles: particles?,
        iterations: iterations?.unwrap_or(100),
        restarts: restarts.unwrap_or(0),
        seed: seed?.unwrap_or(1),
        set: set?.unwrap_or_default(),
        dimensions,
        cases: cases?.unwrap_or_default(),
        objective,
        direction,
        constraints: constraints?.unwrap_or(ConstraintChoice::Named(Vec::new())),
    };
    match space.search() {
        Ok(_) => Ok(space),
        Err(error) => Err(table.report(PARTICLES, error.to_string(), "take more particles")),
    }
}

/// Reads the objective, of which there is exactly one.
fn objective(table: &Table<'_>) -> Result<(Placed<String>, Direction), Reported> {
    let great = table.optional(MAXIMIZE, Item::placed_text);
    let small = table.optional(MINIMIZE, Item::placed_text);
    match (great?, small?) {
        (Some(name), None) => Ok((name, Direction::Maximize)),
        (None, Some(name)) => Ok((name, Direction::Minimize)),
        (Some(_), Some(_)) => {
            let message = format!("there are both `{MAXIMIZE}` and `{MINIMIZE}`");
            let help =
                "leave one of them out; an expectation that only has to hold is a constraint";
            Err(table.report(MINIMIZE, message, help))
        }
        (None, None) => Err(table.missing(MAXIMIZE)),
    }
}

fn constraints(item: &Item<'_>) -> Result<ConstraintChoice, Reported> {
    if !item.is_text() {
        let names = item.each(Item::placed_text)?;
        let mut distinct = Ok(());
        for (index, name) in names.iter().enumerate() {
            if names[..index].iter().any(|other| other.value == name.value) {
                let message = format!("`{}` is listed twice", name.value);
                distinct = Err(item.report_at(&name.place, message, "leave one of them out"));
            }
        }
        return distinct.map(|()| ConstraintChoice::Named(names));
    }
    let word = item.placed_text()?;
    if word.value == "all" {
        return Ok(ConstraintChoice::All(word));
    }
    let message = format!("`{}` is neither `all` nor a list of names", word.value);
    Err(item.report(message, format!("write {CONSTRAINTS} = [{:?}]", word.value)))
}

fn dimension(item: &Item<'_>) -> Result<SpaceDimension, Reported> {
    let table = &item.table()?;
    let key = table.required(KEY, Item::placed_text);
    let logarithmic = table.optional(SCALE, scale);
    table.expect(SWEEP_ONLY);
    let refused = refuse(table, &SWEEP_ONLY, |key| {
        let message = format!("a search has no `{key}`: it searches an interval of quantities");
        let help = format!("write `{FROM}` and `{TO}`; `twin sweep` runs given values");
        (message, help)
    });
    table.expect([FROM, TO]);
    // An interval is not missed where other keys were given in its place.
    refused?;
    let is_logarithmic = logarithmic.is_ok_and(Option::unwrap_or_default);
    let interval = interval(table, None, is_logarithmic);
    let key = key.and_then(|key| {
        if key.value != SEED {
            return Ok(key);
        }
        let message = "whole numbers are not searched";
        let help = "the seed of all runs is a key of `set`; `twin sweep` runs many seeds";
        Err(table.report_at(&key.place, message, help))
    });
    let (key, interval, _) = (key?, interval?, logarithmic?);
    Ok(SpaceDimension { key, interval })
}
