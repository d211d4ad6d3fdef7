//! Reading of the search space of a fit.

use std::path::Path;

use twinrig_document::declaration::{
    Key, Shape, TableReference, TableSpec, Type, contextual, quantity, table,
};
use twinrig_document::{Document, DocumentError, Item, Placed, Range, Reported, Table};
use twinrig_kernel::Unit;

use crate::optimization::space::{SpaceDimension, dimension, dimension_table};
use crate::sweep::SweepValue;
use crate::sweep::overlap;
use crate::sweep::read::{self, SETTINGS, check_dimensions, count};
use fit_table::{
    DIMENSION, GENERATIONS, HUBER, LEAVE_OUT, NAME, PARTICLES, PRIOR, RESIDUAL, SCENARIO, SEARCHES,
    SEED, SET, START, STEPS, TABLE,
};

table! {
    /// Keys of the search space of a fit.
    pub(super) fit_table = TableSpec::new("top level", "search space of a fit");
    NAME: String = "name", Type::TEXT, "name in reports, and of the overlay", r#"name = "xl330""#,
        otherwise("the file's name");
    SCENARIO: Placed<String> = "scenario", Type::PLACED,
        "scenario of the twin, relative to this file", r#"scenario = "servo.toml""#, required();
    SET: Vec<(String, String)> = "set", SETTINGS,
        "keys of the scenario that are the same in all runs",
        r#"set = { plant.file = "xl330" }"#, otherwise("none");
    HUBER: f64 = "huber", quantity(Unit::One, Range::POSITIVE),
        "residual in standard deviations above which the cost grows with its magnitude, not its square",
        "huber = 2", otherwise("squares");
    GENERATIONS: usize = "generations", count(0),
        "generations of CMA-ES that search the start", "generations = 300", default("100");
    PARTICLES: usize = "particles", count(1), "points of a generation", "particles = 30",
        otherwise("4 + 3 ln n for n dimensions");
    SEED: u64 = "seed", Type::NATURAL, "seed of the first search", "seed = 2", default("1");
    SEARCHES: usize = "searches", count(1),
        "searches, each from a seed of its own and followed by least squares; the least of their minima counts",
        "searches = 4", default("1");
    LEAVE_OUT: String = "leave_out", Type::TEXT,
        "value that recordings state: those with the same one are left out together",
        r#"leave_out = "load.mass""#, otherwise("each recording alone");
    STEPS: usize = "steps", count(0), "greatest number of steps of least squares", "steps = 100",
        default("50");
    DIMENSION: () = read::DIMENSION, contextual(Shape::Tables(dimension_table::TABLE)),
        "settings that are fitted",
        r#"dimension = [{ key = "override.motor.resistance", from = "1 ohm", to = "8 ohm" }]"#,
        required();
    PRIOR: () = "prior", contextual(Shape::Tables(prior_table::TABLE)),
        "what is known about dimensions beforehand",
        r#"prior = [{ key = "override.load.offset", mean = "0 rad", deviation = "0.05 rad" }]"#,
        otherwise("none");
    START: () = "start", contextual(Shape::Tables(start_table::TABLE)),
        "state of the twin at the start of a recording",
        r#"start = [{ state = "servo/angle", signal = "servo/position" }]"#,
        otherwise("that of the scenario");
    RESIDUAL: () = "residual", contextual(Shape::Tables(residual_table::TABLE)),
        "signals that are compared",
        r#"residual = [{ signal = "servo/position", twin = "servo/reading", deviation = "5 mrad" }]"#,
        required();
}

table! {
    /// Keys of `[[prior]]`.
    pub(super) prior_table =
        TableSpec::new("[[prior]]", "normal distribution of a dimension; of a logarithmic one, of its logarithm");
    KEY: Placed<String> = "key", Type::PLACED, "key of a dimension",
        r#"key = "override.load.offset""#, required();
    MEAN: Placed<String> = "mean", Type::PLACED, "mean", r#"mean = "0 rad""#, required();
    DEVIATION: Placed<String> = "deviation", Type::PLACED,
        "standard deviation; of a logarithmic dimension, of its ratio to the mean, as in 1.5",
        r#"deviation = "0.05 rad""#, required();
}

table! {
    /// Keys of `[[start]]`.
    pub(super) start_table = TableSpec::new("[[start]]", "value of a state at the start");
    STATE: String = "state", Type::TEXT, "name of a state of the plant",
        r#"state = "servo/angle""#, required();
    SIGNAL_: String = "signal", Type::TEXT, "recorded signal, whose first value it has",
        r#"signal = "servo/position""#, required();
    MINUS: String = "minus", Type::TEXT,
        "value of the signal at which the state is zero, in the unit of the signal",
        r#"signal = "servo/temperature", minus = "302.15 K""#, otherwise("0");
    TIMES: f64 = "times", quantity(Unit::One, Range::ANY),
        "factor of the difference", "times = 4", default("1");
}

table! {
    /// Keys of `[[residual]]`.
    pub(super) residual_table = TableSpec::new("[[residual]]", "signal that is compared");
    SIGNAL: Placed<String> = "signal", Type::PLACED, "recorded signal",
        r#"signal = "servo/position""#, required();
    TWIN: Placed<String> = "twin", Type::PLACED, "output of the twin",
        r#"twin = "servo/reading""#, otherwise("the recorded signal's name");
    COMPONENT: usize = "component", Type::ELEMENT, "element of both, counted from 0",
        r#"signal = "body/position", component = "z", deviation = "1 mm""#,
        otherwise("they have one component");
    DEVIATION_: Placed<String> = "deviation", Type::PLACED,
        "standard deviation of the difference, in the unit of the signal",
        r#"deviation = "5 mrad""#, required();
    SPIKE: Placed<String> = "spike", Type::PLACED,
        "distance from the samples before and after beyond which a sample is a corrupted reading; it is not compared, and counted",
        r#"spike = "0.5 rad""#, otherwise("all are compared");
}

/// What is known about a dimension beforehand.
#[derive(Clone, Debug, PartialEq)]
pub struct Prior {
    /// Index of the dimension.
    pub dimension: usize,
    /// Mean, as a share of the range.
    pub mean: f64,
    /// Standard deviation, as a share of the range.
    pub deviation: f64,
}

/// State of the twin at the start of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct StartSpec {
    /// Name of the state.
    pub state: String,
    /// Recorded signal.
    pub signal: String,
    /// Value of the signal at which the state is zero, as the file has it.
    pub minus: Option<String>,
    /// Factor of the difference to it.
    pub times: f64,
}

/// A signal that is compared.
#[derive(Clone, Debug, PartialEq)]
pub struct ResidualSpec {
    /// Recorded signal.
    pub signal: Placed<String>,
    /// Output of the twin.
    pub twin: Placed<String>,
    /// Element of both; none where they have one component.
    pub component: Option<usize>,
    /// Standard deviation of the difference, as the file has it.
    pub deviation: Placed<String>,
    /// Distance of a corrupted reading from its neighbours, as the file has it.
    pub spike: Option<Placed<String>>,
}

/// Search space of a fit.
#[derive(Clone, Debug, PartialEq)]
pub struct FitSpace {
    /// Name.
    pub name: String,
    /// Name of the file in messages.
    pub file: String,
    /// Scenario of the twin, relative to the file.
    pub scenario: Placed<String>,
    /// Settings of all runs: keys and values in TOML.
    pub set: Vec<(String, String)>,
    /// Dimensions; at least one.
    pub dimensions: Vec<SpaceDimension>,
    /// Priors.
    pub priors: Vec<Prior>,
    /// State at the start.
    pub start: Vec<StartSpec>,
    /// Compared signals; at least one.
    pub residuals: Vec<ResidualSpec>,
    /// Residual above which the cost is linear, in standard deviations; none: squares.
    pub huber: Option<f64>,
    /// Generations of the search of the start.
    pub generations: usize,
    /// Points of a generation.
    pub particles: Option<usize>,
    /// Seed of the first search.
    pub seed: u64,
    /// Searches of the start.
    pub searches: usize,
    /// Value by which recordings are left out together.
    pub leave_out: Option<String>,
    /// Greatest number of steps of least squares.
    pub steps: usize,
}

impl ResidualSpec {
    /// Returns the name of the recorded signal, with its component behind a full stop.
    pub fn name(&self) -> String {
        let name = &self.signal.value;
        self.component
            .map_or(name.clone(), |component| format!("{name}.{component}"))
    }
}

impl FitSpace {
    /// Returns the tables of such a file with their keys, beginning with the top level.
    pub fn tables() -> Vec<TableReference> {
        TableReference::of(TABLE)
    }

    /// Reads a search space from a document.
    ///
    /// # Errors
    /// All problems, each with its position.
    pub fn read(document: &Document) -> Result<Self, DocumentError> {
        document.check(|table| space(document, table))
    }

    /// Returns everything that the result of a search depends on, besides scenario, recordings and
    /// seed; not names, places in the file, and the number of searches.
    pub fn identity(&self) -> String {
        let dimensions: Vec<_> = self
            .dimensions
            .iter()
            .map(|it| (&it.key.value, &it.interval))
            .collect();
        let residuals: Vec<_> = self
            .residuals
            .iter()
            .map(|it| {
                let spike = it.spike.as_ref().map(|spike| &spike.value);
                (it.name(), &it.twin.value, &it.deviation.value, spike)
            })
            .collect();
        let method = (self.huber, self.generations, self.particles, self.steps);
        format!(
            "{dimensions:?} {residuals:?} {:?} {:?} {method:?}",
            self.priors, self.start
        )
    }

    /// Leaves the dimensions of some keys out, with their priors.
    pub fn hold(&mut self, keys: &[&str]) {
        let is_held = |dimension: &SpaceDimension| {
            let mut keys = keys.iter();
            keys.any(|key| overlap(key, &dimension.key.value))
        };
        let mut index = 0;
        let places: Vec<Option<usize>> = self
            .dimensions
            .iter()
            .map(|dimension| {
                let place = (!is_held(dimension)).then_some(index);
                index += usize::from(place.is_some());
                place
            })
            .collect();
        self.dimensions.retain(|dimension| !is_held(dimension));
        let priors = self.priors.drain(..);
        let kept = priors.filter_map(|prior| {
            let dimension = places[prior.dimension]?;
            Some(Prior { dimension, ..prior })
        });
        self.priors = kept.collect();
    }

    /// Returns the values at shares of the ranges.
    pub fn values(&self, shares: &[f64]) -> Vec<SweepValue> {
        let pairs = self.dimensions.iter().zip(shares);
        pairs
            .map(|(dimension, &share)| {
                let interval = &dimension.interval;
                SweepValue::quantity(interval.number_at(share), interval.unit)
            })
            .collect()
    }
}

fn space(document: &Document, table: &Table<'_>) -> Result<FitSpace, Reported> {
    let keys = TABLE.of(table);
    let (name, scenario, set) = (keys.get(&NAME), keys.read(&SCENARIO), keys.get(&SET));
    let (huber, generations) = (keys.get(&HUBER), keys.read(&GENERATIONS));
    let (particles, seed, steps) = (keys.get(&PARTICLES), keys.read(&SEED), keys.read(&STEPS));
    let (searches, leave_out) = (keys.read(&SEARCHES), keys.get(&LEAVE_OUT));
    let dimensions = keys.read_with(&DIMENSION, |item| item.each(dimension));
    let dimensions = dimensions.and_then(|dimensions| {
        check_dimensions(table, dimensions.iter().map(|it| &it.key))?;
        let fixed = set
            .as_ref()
            .ok()
            .and_then(Option::as_deref)
            .unwrap_or_default();
        let is_fixed =
            |it: &&SpaceDimension| fixed.iter().any(|(key, _)| overlap(key, &it.key.value));
        if let Some(both) = dimensions.iter().find(is_fixed) {
            let message = format!("`{}` is set for all runs, by `set`", both.key.value);
            let help = "leave out the dimension or the setting";
            return Err(table.report_at(&both.key.place, message, help));
        }
        Ok(dimensions)
    });
    let known = dimensions.as_deref().unwrap_or_default();
    let priors = keys.get_with(&PRIOR, |item| item.each(|item| prior(item, known)));
    let start = keys.get_with(&START, |item| item.each(start));
    let residuals = keys.read_with(&RESIDUAL, |item| item.each(residual));
    let residuals = residuals.and_then(|residuals| {
        if residuals.is_empty() {
            return Err(keys.report(&RESIDUAL, "no signal is compared", "add a [[residual]]"));
        }
        Ok(residuals)
    });
    let file = document.file();
    let stem = || Path::new(file).file_stem();
    Ok(FitSpace {
        name: name?
            .or_else(|| stem().map(|stem| stem.to_string_lossy().into_owned()))
            .unwrap_or_default(),
        file: file.to_owned(),
        scenario: scenario?,
        set: set?.unwrap_or_default(),
        priors: priors?.unwrap_or_default(),
        start: start?.unwrap_or_default(),
        residuals: residuals?,
        dimensions: dimensions?,
        huber: huber?,
        generations: generations?,
        particles: particles?,
        seed: seed?,
        searches: searches?,
        leave_out: leave_out?,
        steps: steps?,
    })
}

/// Reads a prior, in shares of the range of its dimension.
fn prior(item: &Item<'_>, dimensions: &[SpaceDimension]) -> Result<Prior, Reported> {
    use prior_table::{DEVIATION, KEY, MEAN};
    let table = &item.table()?;
    let keys = prior_table::TABLE.of(table);
    let (key, mean, deviation) = (keys.read(&KEY), keys.read(&MEAN), keys.read(&DEVIATION));
    let (key, mean, deviation) = (key?, mean?, deviation?);
    let mut known = dimensions.iter();
    let Some(dimension) = known.position(|dimension| dimension.key.value == key.value) else {
        let message = format!("`{}` is no dimension", key.value);
        return Err(table.report_at(&key.place, message, "name the key of a [[dimension]]"));
    };
    let interval = &dimensions[dimension].interval;
    let number = |text: &Placed<String>, unit: Unit| {
        twinrig_document::parse_quantity(&text.value, unit).map_err(|error| {
            table.report_at(
                &text.place,
                error.to_string(),
                "write it as the ends of the dimension",
            )
        })
    };
    let middle = number(&mean, interval.unit)?;
    let (mean, deviation) = if interval.logarithmic {
        let ratio = number(&deviation, Unit::One)?;
        let width = libm::log(interval.to / interval.from);
        (
            libm::log(middle / interval.from) / width,
            libm::log(ratio) / width,
        )
    } else {
        let width = interval.to - interval.from;
        (
            (middle - interval.from) / width,
            number(&deviation, interval.unit)? / width,
        )
    };
    if mean.is_finite() && deviation.is_finite() && deviation > 0.0 {
        return Ok(Prior {
            dimension,
            mean,
            deviation,
        });
    }
    let help = "a deviation is positive, of a logarithmic dimension a ratio above 1";
    Err(keys.report(&DEVIATION, "this is no normal distribution", help))
}

fn start(item: &Item<'_>) -> Result<StartSpec, Reported> {
    use start_table::{MINUS, SIGNAL_, STATE, TIMES};
    let table = &item.table()?;
    let keys = start_table::TABLE.of(table);
    let (state, signal) = (keys.read(&STATE), keys.read(&SIGNAL_));
    let (minus, times) = (keys.get(&MINUS), keys.read(&TIMES));
    Ok(StartSpec {
        state: state?,
        signal: signal?,
        minus: minus?,
        times: times?,
    })
}

fn residual(item: &Item<'_>) -> Result<ResidualSpec, Reported> {
    use residual_table::{COMPONENT, DEVIATION_, SIGNAL, SPIKE, TWIN};
    let table = &item.table()?;
    let keys = residual_table::TABLE.of(table);
    let (signal, twin, deviation) = (keys.read(&SIGNAL), keys.get(&TWIN), keys.read(&DEVIATION_));
    let (component, spike) = (keys.get(&COMPONENT), keys.get(&SPIKE));
    let signal = signal?;
    Ok(ResidualSpec {
        twin: twin?.unwrap_or_else(|| signal.clone()),
        signal,
        component: component?,
        deviation: deviation?,
        spike: spike?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn held_dimensions_are_left_out_with_their_priors() {
        let dimension = |key: &str| {
            format!("[[dimension]]\nkey = \"override.{key}\"\nfrom = \"1 ohm\"\nto = \"3 ohm\"\n")
        };
        let prior = |key: &str, mean: &str| {
            format!(
                "[[prior]]\nkey = \"override.{key}\"\nmean = \"{mean} ohm\"\n\
                 deviation = \"1 ohm\"\n"
            )
        };
        let text = [
            "scenario = \"servo.toml\"\n[[residual]]\nsignal = \"x\"\ndeviation = \"1\"\n"
                .to_owned(),
            dimension("a"),
            dimension("b"),
            dimension("c"),
            prior("b", "1"),
            prior("c", "2"),
        ];
        let document = Document::parse("space.toml", &text.concat()).unwrap();
        let mut space = FitSpace::read(&document).unwrap();
        let whole = space.identity();
        space.hold(&["override.b", "another.key", "override.cc"]);
        let keys: Vec<&str> = space
            .dimensions
            .iter()
            .map(|it| it.key.value.as_str())
            .collect();
        assert_eq!(keys, ["override.a", "override.c"]);
        let [prior] = &space.priors[..] else {
            panic!("{:?}", space.priors);
        };
        assert_eq!((prior.dimension, prior.mean), (1, 0.5));
        assert_ne!(space.identity(), whole);
    }
}
