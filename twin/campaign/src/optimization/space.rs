//! Reading of search spaces.

use std::path::Path;

use serde::Serialize;
use twinrig_document::declaration::{
    Accepts, Declared, Key, Shape, TableReference, TableSpec, Type, Words, choice, contextual,
    table,
};
use twinrig_document::{Document, DocumentError, Item, Placed, Reported, Table};

use super::case::{SearchCase, case_table, cases};
use crate::search::{CmaEs, Dimension, Search, SearchError, SwarmSearch};
use crate::sweep::read::{
    self, END, LOGARITHMIC, SETTINGS, check_dimensions, count, interval, refuse, refuse_scenario,
};
use crate::sweep::{SweepValue, ValueInterval};
use space_table::{
    CASE, CONSTRAINTS, DIMENSION, ITERATIONS, MAXIMIZE, METHOD, MINIMIZE, NAME, PARTICLES,
    RESTARTS, SEED, SET, TABLE,
};

table! {
    /// Keys of a search space.
    pub(super) space_table = TableSpec::new("top level", "search space").selected_by("method");
    NAME: String = "name", Type::TEXT, "name in reports", r#"name = "trot""#,
        otherwise("the file's name");
    MAXIMIZE: Placed<String> = "maximize", Type::PLACED,
        "expectation whose measured value is to be great", r#"maximize = "forward speed""#,
        one_of();
    MINIMIZE: Placed<String> = "minimize", Type::PLACED,
        "expectation whose measured value is to be small", r#"minimize = "roll, peak to peak""#,
        one_of();
    CONSTRAINTS: ConstraintChoice = "constraints",
        Type::new(Shape::Either(&[
            Shape::List { of: &Shape::One(Accepts::Name), least: 0, distinct: true },
            Shape::Choice(|| vec!["all"]),
        ]), |item, _| constraints(item)),
        "expectations that have to hold; `all` are all others",
        r#"constraints = ["goes straight"]"#, otherwise("none");
    METHOD: SearchMethod = "method", choice(), "CMA-ES, or a particle swarm", r#"method = "pso""#,
        default("'cma-es'");
    PARTICLES: usize = "particles", count(1), "points of a generation", "particles = 120",
        otherwise("`pso`: 40; `cma-es`: 4 + 3 ln n for n dimensions");
    ITERATIONS: usize = "iterations", count(0), "generations after the first one",
        "iterations = 400", default("100");
    RESTARTS: usize = "restarts", count(0),
        "restarts after convergence, each with twice the particles", "restarts = 4", default("0"),
        only_with(&["cma-es"]);
    SEED: u64 = "seed", Type::NATURAL, "seed of the search", "seed = 2", default("1");
    SET: Vec<(String, String)> = "set", SETTINGS,
        "keys of the scenario that are the same in all runs", r#"set = { duration = "10 s" }"#,
        otherwise("none");
    DIMENSION: () = read::DIMENSION, contextual(Shape::Tables(dimension_table::TABLE)),
        "settings that are searched",
        r#"dimension = [{ key = "frequency", from = "2 Hz", to = "5 Hz" }]"#, required();
    CASE: () = "case", contextual(Shape::Tables(case_table::TABLE)),
        "runs of every point, of which the worst one counts",
        r#"case = [{ name = "lcp", set = { plant.model = "lcp" } }]"#, otherwise("none");
}

table! {
    /// Keys of `[[dimension]]`.
    pub(crate) dimension_table = TableSpec::new("[[dimension]]", "setting that is searched");
    KEY: Placed<String> = "key", Type::PLACED,
        "dotted key of the scenario, or name of a process variable", r#"key = "hip_height/fore""#,
        required();
    FROM: () = "from", contextual(END), "lower bound", r#"from = "11 cm""#, required();
    TO: () = "to", contextual(END), "upper bound, above `from`", r#"to = "14 cm""#, required();
    SCALE: bool = "scale", LOGARITHMIC, "whether differences or ratios count",
        r#"scale = "logarithmic""#, default("'linear'");
}

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

impl Words for SearchMethod {
    const WORDS: &'static [(&'static str, Self)] = &[("cma-es", Self::CmaEs), ("pso", Self::Pso)];
}

impl SearchMethod {
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
            Self::Maximize => MAXIMIZE.name,
            Self::Minimize => MINIMIZE.name,
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
    /// Returns the tables of a search space with their keys, beginning with the top level.
    pub fn tables() -> Vec<TableReference> {
        TableReference::of(TABLE)
    }

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
    let keys = TABLE.of(table);
    let (name, method) = (keys.get(&NAME), keys.read(&METHOD));
    let (particles, iterations) = (keys.get(&PARTICLES), keys.read(&ITERATIONS));
    let (restarts, seed) = (keys.read(&RESTARTS), keys.read(&SEED));
    let set = keys.get(&SET);
    let cases = keys.get_with(&CASE, cases);
    let objective = objective(keys);
    let constraints = keys.get(&CONSTRAINTS);
    let dimensions = keys.read_with(&DIMENSION, |item| item.each(dimension));
    let dimensions = dimensions.and_then(|dimensions| {
        check_dimensions(table, dimensions.iter().map(|it| &it.key))?;
        Ok(dimensions)
    });
    let restarts = match (method, restarts) {
        (Ok(SearchMethod::Pso), Ok(_)) if keys.has(&RESTARTS) => {
            let message = format!("a particle swarm has no `{RESTARTS}`");
            let help = "leave it out, or take method = \"cma-es\"";
            Err(keys.report(&RESTARTS, message, help))
        }
        (_, restarts) => restarts,
    };
    let (method, restarts, dimensions) = (method?, restarts?, dimensions?);
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
        iterations: iterations?,
        restarts,
        seed: seed?,
        set: set?.unwrap_or_default(),
        dimensions,
        cases: cases?.unwrap_or_default(),
        objective,
        direction,
        constraints: constraints?.unwrap_or(ConstraintChoice::Named(Vec::new())),
    };
    match space.search() {
        Ok(_) => Ok(space),
        Err(error) => Err(keys.report(&PARTICLES, error.to_string(), "take more particles")),
    }
}

/// Reads the objective, of which there is exactly one.
fn objective(keys: Declared<'_, '_>) -> Result<(Placed<String>, Direction), Reported> {
    let (great, small) = (keys.get(&MAXIMIZE), keys.get(&MINIMIZE));
    match (great?, small?) {
        (Some(name), None) => Ok((name, Direction::Maximize)),
        (None, Some(name)) => Ok((name, Direction::Minimize)),
        (Some(_), Some(_)) => {
            let message = format!("there are both `{MAXIMIZE}` and `{MINIMIZE}`");
            let help =
                "leave one of them out; an expectation that only has to hold is a constraint";
            Err(keys.report(&MINIMIZE, message, help))
        }
        (None, None) => Err(keys.missing(MAXIMIZE.name)),
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

pub(crate) fn dimension(item: &Item<'_>) -> Result<SpaceDimension, Reported> {
    use dimension_table::{FROM, KEY, SCALE, TO};
    let table = &item.table()?;
    let keys = dimension_table::TABLE.of(table);
    let (key, logarithmic) = (keys.read(&KEY), keys.read(&SCALE));
    table.expect(SWEEP_ONLY);
    let refused = refuse(table, &SWEEP_ONLY, |key| {
        let message = format!("a search has no `{key}`: it searches an interval of quantities");
        let help = format!("write `{FROM}` and `{TO}`; `twin sweep` runs given values");
        (message, help)
    });
    keys.expect(&FROM);
    keys.expect(&TO);
    // An interval is not missed where other keys were given in its place.
    refused?;
    let is_logarithmic = logarithmic.unwrap_or_default();
    let interval = interval(table, None, is_logarithmic);
    let key = key.and_then(|key| {
        if key.value != SEED.name {
            return Ok(key);
        }
        let message = "whole numbers are not searched";
        let help = "the seed of all runs is a key of `set`; `twin sweep` runs many seeds";
        Err(table.report_at(&key.place, message, help))
    });
    let (key, interval, _) = (key?, interval?, logarithmic?);
    Ok(SpaceDimension { key, interval })
}
