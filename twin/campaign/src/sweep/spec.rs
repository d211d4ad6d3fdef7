//! Reading specifications of sweeps.

use std::ops::Bound;
use std::path::Path;

use twinrig_document::{Document, DocumentError, Item, Range, Reported, Table};
use twinrig_kernel::Unit;

use super::design::{Design, DesignKind};
use super::dimension::{DimensionValues, SweepDimension, ValueInterval};
use super::keys::{
    CONFIDENCE, COUNT, DESIGN, DIMENSION, FROM, KEY, MAX, MIN, NAME, OF, POINTS, SCALE, SEED, SET,
    SHARE, TO, VALUES, WHOLE,
};
use super::share::{ShareSpec, percent};
use super::value::{SweepValue, toml};

/// Greatest number of points.
const POINTS_MOST: usize = 1_000_000;
/// Greatest number of dimensions.
const DIMENSIONS_MOST: usize = 100;
/// Key of a scenario whose values are whole numbers.
const SCENARIO_SEED: &str = "seed";

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
    /// Dimensions; at least one.
    pub dimensions: Vec<SweepDimension>,
    /// Asserted shares.
    pub shares: Vec<ShareSpec>,
}

impl SweepSpec {
    /// Reads a specification from a document.
    ///
    /// # Errors
    /// All problems, each with its position.
    pub fn read(document: &Document) -> Result<Self, DocumentError> {
        document.check(|table| spec(document, table))
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

    /// Returns the points: a value for each dimension.
    pub fn points(&self) -> Vec<Vec<SweepValue>> {
        self.design.points(&self.dimensions)
    }
}

fn spec(document: &Document, table: &Table<'_>) -> Result<SweepSpec, Reported> {
    let name = table.optional(NAME, |item| item.text().map(str::to_owned));
    let kind = table.optional(DESIGN, |item| item.choice(DesignKind::WORDS));
    let kind = kind.map(|kind| kind.unwrap_or(DesignKind::Grid));
    let points = table.optional(POINTS, |item| natural(item, 1));
    let seed = table.optional(SEED, Item::natural);
    let set = table.optional(SET, |item| {
        let mut settings = Vec::new();
        leaves(item, &mut Vec::new(), &mut settings)?;
        Ok(settings)
    });
    let is_grid = kind == Ok(DesignKind::Grid);
    let dimensions = table.required(DIMENSION, |item| item.each(|item| dimension(item, is_grid)));
    let shares = table.optional(SHARE, |item| item.each(share));
    let (kind, points, seed, dimensions) = (kind?, points?, seed?, dimensions?);
    if dimensions.is_empty() {
        return Err(table.report(DIMENSION, "there is no dimension", "add a [[dimension]]"));
    }
    if dimensions.len() > DIMENSIONS_MOST {
        let message = format!("there are more than {DIMENSIONS_MOST} dimensions");
        return Err(table.report(DIMENSION, message, "leave some of them out"));
    }
    check_distinct(table, &dimensions)?;
    let points = if is_grid {
        for key in [POINTS, SEED] {
            if table.keys().any(|known| known == key) {
                let help = "leave it out, or choose another `design`";
                return Err(table.report(key, format!("a grid has no `{key}`"), help));
            }
        }
        grid_points(table, &dimensions)?
    } else {
        points.ok_or_else(|| table.missing(POINTS))?
    };
    let file = document.file();
    let stem = || Path::new(file).file_stem();
    Ok(SweepSpec {
        name: name?
            .or_else(|| stem().map(|stem| stem.to_string_lossy().into_owned()))
            .unwrap_or_default(),
        file: file.to_owned(),
        text: document.text().to_owned(),
        design: Design {
            kind,
            points,
            seed: seed.unwrap_or(1),
        },
        set: set?.unwrap_or_default(),
        dimensions,
        shares: shares?.unwrap_or_default(),
    })
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

/// Reports a key of which another dimension sets the same or a part.
fn check_distinct(table: &Table<'_>, dimensions: &[SweepDimension]) -> Result<(), Reported> {
    for (index, later) in dimensions.iter().enumerate() {
        for earlier in &dimensions[..index] {
            let (key, other) = (&later.key.value, &earlier.key.value);
            if overlap(key, other) {
                let message = format!("`{key}` is set by the dimension `{other}` already");
                let help = "one dimension for each key";
                return Err(table.report_at(&later.key.place, message, help));
            }
        }
    }
    Ok(())
}

/// Whether one of two dotted keys is the other, or a table that contains it.
pub fn overlap(one: &str, other: &str) -> bool {
    let contains = |table: &str, key: &str| {
        let rest = key.strip_prefix(table);
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    };
    contains(one, other) || contains(other, one)
}

fn natural(item: &Item<'_>, least: usize) -> Result<usize, Reported> {
    let number = usize::try_from(item.natural()?).unwrap_or(usize::MAX);
    if (least..=POINTS_MOST).contains(&number) {
        return Ok(number);
    }
    let message = format!("`{}` is {number}", item.key());
    Err(item.report(message, format!("expected {least} to {POINTS_MOST}")))
}

/// Collects the values below a table with their dotted keys.
fn leaves(
    item: &Item<'_>,
    path: &mut Vec<String>,
    settings: &mut Vec<(String, String)>,
) -> Result<(), Reported> {
    let Some(keys) = item.keys() else {
        if path.is_empty() {
            return item.table().map(drop);
        }
        check_line(item)?;
        settings.push((path.join("."), toml(item)));
        return Ok(());
    };
    for key in keys {
        if let Some(value) = item.peek(key) {
            path.push(key.to_owned());
            let read = leaves(&value, path, settings);
            path.pop();
            read?;
        }
    }
    Ok(())
}

/// Checks that a value is written in one line, which a setting requires.
fn check_line(item: &Item<'_>) -> Result<(), Reported> {
    if !item.is_text() && item.toml().contains('\n') {
        return Err(item.report("a value of a setting is one line", "write it in one line"));
    }
    Ok(())
}

fn dimension(item: &Item<'_>, is_grid: bool) -> Result<SweepDimension, Reported> {
    let table = &item.table()?;
    let key = table.required(KEY, Item::placed_text);
    let listed = table.optional(VALUES, listed);
    let is_seed = key.as_ref().is_ok_and(|key| key.value == SCENARIO_SEED);
    let whole = table.optional(WHOLE, Item::boolean)?.unwrap_or(is_seed);
    let logarithmic = table.optional(SCALE, |item| {
        item.choice(&[("linear", false), ("logarithmic", true)])
    });
    let count = table.optional(COUNT, |item| natural(item, 2));
    table.expect([FROM, TO]);
    let given = |key: &str| table.keys().any(|known| known == key);
    if let Some(values) = listed? {
        for key in [FROM, TO, COUNT, SCALE, WHOLE] {
            if given(key) {
                let message = format!("`{key}` has no meaning beside `{VALUES}`");
                return Err(table.report(key, message, "leave one of them out"));
            }
        }
        return Ok(SweepDimension {
            key: key?,
            values: DimensionValues::Listed(values),
        });
    }
    if !given(FROM) && !given(TO) {
        let message = "the dimension has no values";
        let help = "add `values = [ … ]`, or `from` and `to`";
        return Err(item.report(message, help));
    }
    let values = if whole {
        for key in [COUNT, SCALE] {
            if given(key) {
                let message =
                    format!("`{key}` has no meaning for whole numbers, all of which count");
                let help = format!("leave it out, or list the numbers in `{VALUES}`");
                return Err(table.report(key, message, help));
            }
        }
        whole_numbers(table)
    } else {
        interval(table, count?, logarithmic?.unwrap_or(false), is_grid)
    };
    Ok(SweepDimension {
        key: key?,
        values: values?,
    })
}

fn listed(item: &Item<'_>) -> Result<Vec<SweepValue>, Reported> {
    let values = item.each(|item| {
        check_line(item)?;
        Ok((SweepValue::of(item), item.place()))
    })?;
    if values.is_empty() {
        return Err(item.report("the list has no values", "add one"));
    }
    for (index, (value, place)) in values.iter().enumerate() {
        if values[..index].iter().any(|(other, _)| other == value) {
            let message = format!("{} is listed twice", value.toml);
            return Err(item.report_at(place, message, "leave one of them out"));
        }
    }
    Ok(values.into_iter().map(|(value, _)| value).collect())
}

fn whole_numbers(table: &Table<'_>) -> Result<DimensionValues, Reported> {
    let from = table.required(FROM, Item::natural);
    let to = table.required(TO, Item::natural);
    let (from, to) = (from?, to?);
    if from > to {
        return Err(not_ascending(table));
    }
    Ok(DimensionValues::Whole { from, to })
}

fn not_ascending(table: &Table<'_>) -> Reported {
    let message = format!("`{TO}` has to be above `{FROM}`");
    table.report(TO, message, "exchange them")
}

fn interval(
    table: &Table<'_>,
    count: Option<usize>,
    logarithmic: bool,
    is_grid: bool,
) -> Result<DimensionValues, Reported> {
    let from = table.required(FROM, |item| {
        let unit = item.any_unit()?;
        Ok((item.quantity(unit, &SweepValue::RANGE)?, unit))
    });
    let unit = from.as_ref().map_or(Unit::One, |(_, unit)| *unit);
    let to = table.required(TO, |item| item.quantity(unit, &SweepValue::RANGE));
    let ((from, unit), to) = (from?, to?);
    if from >= to {
        return Err(not_ascending(table));
    }
    if logarithmic && from <= 0.0 {
        let message = format!("`{FROM}` is {from}; a logarithmic scale has positive values only");
        return Err(table.report(FROM, message, "take a linear scale"));
    }
    match (count, is_grid) {
        (None, true) => Err(table.missing(COUNT)),
        (Some(_), false) => {
            let message = format!("`{COUNT}` has no meaning where values are drawn");
            Err(table.report(COUNT, message, "leave it out; `points` counts the draws"))
        }
        _ => Ok(DimensionValues::Interval(ValueInterval {
            from,
            to,
            unit,
            count,
            logarithmic,
        })),
    }
}

fn share(item: &Item<'_>) -> Result<ShareSpec, Reported> {
    let table = &item.table()?;
    let of = table.required(OF, Item::placed_text);
    // No number of runs shows a share of exactly 0 or 1.
    let bound = |key: &str, excluded: f64, help: &str| {
        table.optional(key, |item| {
            let share = item.number(&Range::between(0.0, 1.0))?;
            if share == excluded {
                let message = format!("no number of runs shows a `{key}` of {}", percent(share));
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
