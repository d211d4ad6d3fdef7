//! Reading specifications of sweeps.

use std::ops::Bound;
use std::path::Path;

use twinrig_document::{
    AssumedValue, Document, DocumentError, Item, Placed, Problem, Range, Reported, Table,
    suggestion,
};

use super::design::{Design, DesignKind};
use super::dimension::{DimensionValues, SweepDimension, ValueInterval};
use super::keys::{
    ASSUMED, CONFIDENCE, DESIGN, DIMENSION, LEVELS, MAX, MEASURES, MIN, NAME, OF, POINTS, SEED,
    SET, SHARE, TRAJECTORIES,
};
use super::read::{
    DIMENSIONS_MOST, POINTS_MOST, check_dimensions, dimension, natural, overlap, refuse,
    refuse_scenario, settings,
};
use super::share::ShareSpec;
use super::value::SweepValue;

/// Specification of a sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepSpec {
    /// Name in reports.
    pub name: String,
    /// Name of the file in messages.
    pub file: String,
    /// Text of the file.
    pub text: String,
    /// Design.
    pub design: Design,
    /// Settings of all runs: keys and values in TOML.
    pub set: Vec<(String, String)>,
    /// Dimensions; at least one, once those of `assumed` are added.
    pub dimensions: Vec<SweepDimension>,
    /// Keys and tables of the robot file whose assumed values are dimensions, too; see
    /// [`SweepSpec::add_assumed`].
    pub assumed: Vec<Placed<String>>,
    /// Expectations with elementary effects; none for all.
    pub measures: Vec<Placed<String>>,
    /// Number of trajectories of the design; 0 if it has none.
    trajectories: usize,
    /// Asserted shares.
    pub shares: Vec<ShareSpec>,
}

impl SweepSpec {
    /// Reads a specification from a document.
    ///
    /// # Errors
    /// All problems, each with its position.
    pub fn read(document: &Document) -> Result<Self, DocumentError> {
        refuse_scenario(document, "the specification of a sweep")?;
        document.check(|table| spec(document, table))
    }

    /// Returns the number of points of a trajectory; none for a design without.
    pub fn trajectory_points(&self) -> Option<usize> {
        self.design.levels.map(|_| self.dimensions.len() + 1)
    }

    fn count_trajectories(&mut self) {
        if let Some(length) = self.trajectory_points() {
            self.design.points = self.trajectories.saturating_mul(length);
        }
    }

    /// Adds a dimension for each of the robot's assumed values `known` that `assumed` names, or a
    /// table of which it names, by the intervals of the robot file. A value that a dimension sets
    /// already is left to it.
    ///
    /// # Errors
    /// Names that no assumed value has, and too many dimensions or points.
    pub fn add_assumed(&mut self, known: &[AssumedValue]) -> Result<(), DocumentError> {
        let mut problems = Vec::new();
        for name in &self.assumed {
            let named = known.iter();
            let named: Vec<_> = named
                .filter(|one| is_below(&name.value, &one.key))
                .collect();
            if named.is_empty() {
                let message = format!("the robot has no assumed value `{}`", name.value);
                let keys = known.iter().map(|one| one.key.as_str());
                let help = suggestion(&name.value, "assumed values", keys);
                problems.push(Problem::at(&name.place, message, help));
            }
            for one in named {
                let key = format!("{OVERRIDE}{}", one.key);
                let is_set = |it: &SweepDimension| it.keys().any(|set| overlap(&set.value, &key));
                if self.dimensions.iter().any(is_set) {
                    continue;
                }
                self.dimensions.push(SweepDimension {
                    key: Placed {
                        value: key,
                        place: name.place.clone(),
                    },
                    also: Vec::new(),
                    values: DimensionValues::Interval(ValueInterval {
                        from: one.from,
                        to: one.to,
                        unit: one.unit,
                        count: None,
                        logarithmic: false,
                    }),
                });
            }
        }
        self.count_trajectories();
        let is_many = self.dimensions.len() > DIMENSIONS_MOST || self.design.points > POINTS_MOST;
        if let Some(last) = self.assumed.last().filter(|_| is_many) {
            let message =
                format!("there are more than {DIMENSIONS_MOST} dimensions or {POINTS_MOST} points");
            problems.push(Problem::at(
                &last.place,
                message,
                "name fewer assumed values",
            ));
        }
        if problems.is_empty() {
            Ok(())
        } else {
            Err(DocumentError { problems })
        }
    }

    /// Returns the names of the shares that cannot pass, whichever runs hold: the intervals of so
    /// few points are too wide.
    pub fn undecidable_shares(&self) -> Vec<&str> {
        let points = self.design.points;
        let shares = self.shares.iter().filter(|share| !share.can_pass(points));
        shares.map(|share| share.of.value.as_str()).collect()
    }

    /// Returns the warning about shares that cannot pass.
    pub fn warning(&self) -> Option<String> {
        let names = self.undecidable_shares();
        let names: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
        let points = self.design.points;
        (!names.is_empty()).then(|| {
            format!(
                "the share of {} cannot pass with {points} points, whichever of them hold: take \
                 more points, a bound that is further from the expected share, or a lower \
                 confidence",
                names.join(" and of ")
            )
        })
    }

    /// Returns the keys of all dimensions, further keys included.
    pub fn keys(&self) -> impl Iterator<Item = &Placed<String>> {
        self.dimensions.iter().flat_map(SweepDimension::keys)
    }

    /// Returns the points: a value for each of the keys.
    pub fn points(&self) -> Vec<Vec<SweepValue>> {
        let counts = self.dimensions.iter().map(|it| it.keys().count());
        let counts: Vec<usize> = counts.collect();
        let of_keys = |values: Vec<SweepValue>| {
            // Of many points, spare capacity would be most of the memory.
            let mut of_keys = Vec::with_capacity(counts.iter().sum());
            for (value, &count) in values.into_iter().zip(&counts) {
                of_keys.extend(std::iter::repeat_n(value, count));
            }
            of_keys
        };
        let points = self.design.points(&self.dimensions).into_iter();
        points.map(of_keys).collect()
    }
}

/// Table of a scenario with values of the robot.
const OVERRIDE: &str = "override.";

/// Whether a dotted key is `table` or below it.
fn is_below(table: &str, key: &str) -> bool {
    let rest = key.strip_prefix(table);
    rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
}

/// Numbers of a design. A grid has none.
#[derive(Default)]
struct Numbers {
    points: usize,
    seed: u64,
    trajectories: usize,
    levels: Option<usize>,
}

fn numbers(table: &Table<'_>, kind: DesignKind) -> Result<Numbers, Reported> {
    let points = table.optional(POINTS, |item| natural(item, 1));
    let seed = table.optional(SEED, Item::natural);
    let trajectories = table.optional(TRAJECTORIES, |item| natural(item, 1));
    let levels = table.optional(LEVELS, |item| {
        let levels = natural(item, 2)?;
        if levels % 2 == 1 {
            let message = format!("`{LEVELS}` is {levels}, which is odd");
            return Err(item.report(message, "take an even number: a change is of half of them"));
        }
        Ok(levels)
    });
    let word = kind.word();
    let (foreign, required): (&[&str], _) = match kind {
        DesignKind::Grid => (
            &[POINTS, SEED, TRAJECTORIES, LEVELS, MEASURES, ASSUMED],
            None,
        ),
        DesignKind::Morris => (&[POINTS], Some(TRAJECTORIES)),
        _ => (&[TRAJECTORIES, LEVELS, MEASURES], Some(POINTS)),
    };
    let refused = refuse(table, foreign, |key| {
        let design = match kind {
            DesignKind::Grid => "a grid".to_owned(),
            _ => format!("the design `{word}`"),
        };
        let help = "leave it out, or choose another `design`";
        (format!("{design} has no `{key}`"), help.to_owned())
    });
    let (points, seed, trajectories, levels) = (points?, seed?, trajectories?, levels?);
    if let Some(key) = required.filter(|_| points.or(trajectories).is_none()) {
        return Err(table.missing(key));
    }
    refused?;
    Ok(Numbers {
        points: points.unwrap_or(0),
        seed: seed.unwrap_or(1),
        trajectories: trajectories.unwrap_or(0),
        levels: (kind == DesignKind::Morris).then(|| levels.unwrap_or(4)),
    })
}

/// Reads the dimensions; there may be none beside assumed values.
fn dimensions(table: &Table<'_>, kind: DesignKind) -> Result<Vec<SweepDimension>, Reported> {
    let read = |item: &Item<'_>| item.each(|item| dimension(item, kind == DesignKind::Grid));
    let has_assumed = table.keys().any(|key| key == ASSUMED);
    let dimensions = if has_assumed {
        table.optional(DIMENSION, read)?.unwrap_or_default()
    } else {
        table.required(DIMENSION, read)?
    };
    if !(has_assumed && dimensions.is_empty()) {
        check_dimensions(table, dimensions.iter().flat_map(SweepDimension::keys))?;
    }
    let mut checked = Ok(());
    for one in &dimensions {
        if kind == DesignKind::Morris && !matches!(one.values, DimensionValues::Interval(_)) {
            let message = format!("the values of `{}` are no interval", one.key.value);
            let help = "elementary effects require `from` and `to`, and no whole numbers";
            checked = Err(table.report_at(&one.key.place, message, help));
        }
    }
    checked.map(|()| dimensions)
}

fn spec(document: &Document, table: &Table<'_>) -> Result<SweepSpec, Reported> {
    let name = table.optional(NAME, |item| item.text().map(str::to_owned));
    let kind = table.optional(DESIGN, |item| item.choice(DesignKind::WORDS));
    // Without a valid design, keys of all designs are accepted.
    let read = kind.map(|kind| kind.unwrap_or(DesignKind::Grid));
    let kind = read.unwrap_or(DesignKind::Random);
    let numbers = match read {
        Ok(kind) => numbers(table, kind),
        Err(reported) => {
            table.expect([POINTS, SEED, TRAJECTORIES, LEVELS]);
            Err(reported)
        }
    };
    let texts = |key| table.optional(key, |item| item.each(Item::placed_text));
    let (assumed, measures) = (texts(ASSUMED), texts(MEASURES));
    let set = table.optional(SET, settings);
    let dimensions = dimensions(table, kind);
    let shares = table.optional(SHARE, |item| item.each(share));
    let (numbers, dimensions) = (numbers?, dimensions?);
    let points = match kind {
        DesignKind::Grid => grid_points(table, &dimensions)?,
        _ => numbers.points,
    };
    let file = document.file();
    let stem = || Path::new(file).file_stem();
    let mut spec = SweepSpec {
        name: name?
            .or_else(|| stem().map(|stem| stem.to_string_lossy().into_owned()))
            .unwrap_or_default(),
        file: file.to_owned(),
        text: document.text().to_owned(),
        design: Design {
            kind,
            points,
            seed: numbers.seed,
            levels: numbers.levels,
        },
        trajectories: numbers.trajectories,
        set: set?.unwrap_or_default(),
        dimensions,
        assumed: assumed?.unwrap_or_default(),
        measures: measures?.unwrap_or_default(),
        shares: shares?.unwrap_or_default(),
    };
    spec.count_trajectories();
    Ok(spec)
}

/// Number of points of a grid.
fn grid_points(table: &Table<'_>, dimensions: &[SweepDimension]) -> Result<usize, Reported> {
    let counts = dimensions.iter().map(|dimension| dimension.values.count());
    let product = counts.into_iter().try_fold(1_usize, |product, count| {
        product
            .checked_mul(count?)
            .filter(|product| *product <= POINTS_MOST)
    });
    product.ok_or_else(|| {
        let message = format!("the grid has more than {POINTS_MOST} points");
        let help = "take fewer values, or design = \"latin-hypercube\" with a number of points";
        table.report(DIMENSION, message, help)
    })
}

fn share(item: &Item<'_>) -> Result<ShareSpec, Reported> {
    let table = &item.table()?;
    let of = table.required(OF, Item::placed_text);
    // No number of runs shows a share of exactly 0 or 1.
    let bound = |key: &str, excluded: f64, help: &str| {
        table.optional(key, |item| {
            let share = item.number(&Range::between(0.0, 1.0))?;
            if share == excluded {
                let percent = 100.0 * share;
                let message = format!("no number of runs shows a `{key}` of {percent:.1} %");
                return Err(item.report(message, help));
            }
            Ok(share)
        })
    };
    let all = "take less, as `min = \"99 %\"`; without shares, every run has to pass";
    let none = "take more, as `max = \"1 %\"`, which runs without one can show";
    let (min, max) = (bound(MIN, 1.0, all), bound(MAX, 0.0, none));
    let inner = Range {
        min: Bound::Excluded(0.0),
        max: Bound::Excluded(1.0),
    };
    let confidence = table.optional(CONFIDENCE, |item| item.number(&inner));
    let (min, max) = (min?, max?);
    match (min, max) {
        (None, None) => {
            let help = format!("add `{MIN} = …` or `{MAX} = …`");
            Err(item.report("the share has no bound", help))
        }
        (Some(least), Some(most)) if least > most => {
            let message = format!("`{MIN}` is above `{MAX}`");
            Err(table.report(MIN, message, "exchange them"))
        }
        _ => Ok(ShareSpec {
            of: of?,
            min,
            max,
            confidence: confidence?.unwrap_or(0.95),
        }),
    }
}
