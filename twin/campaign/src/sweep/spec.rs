//! Reading specifications of sweeps.

use std::ops::Bound;
use std::path::Path;

use twinrig_document::{Document, DocumentError, Item, Placed, Range, Reported, Table};

use super::design::{Design, DesignKind};
use super::dimension::SweepDimension;
use super::keys::{CONFIDENCE, DESIGN, DIMENSION, MAX, MIN, NAME, OF, POINTS, SEED, SET, SHARE};
use super::read::{
    POINTS_MOST, check_dimensions, dimension, natural, refuse, refuse_scenario, settings,
};
use super::share::{ShareSpec, percent};
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
        refuse_scenario(document, "the specification of a sweep")?;
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

    /// Returns the keys of all dimensions, further keys included.
    pub fn keys(&self) -> impl Iterator<Item = &Placed<String>> {
        self.dimensions.iter().flat_map(SweepDimension::keys)
    }

    /// Returns the points: a value for each of the keys.
    pub fn points(&self) -> Vec<Vec<SweepValue>> {
        let counts = self.dimensions.iter().map(|it| it.keys().count());
        let counts: Vec<usize> = counts.collect();
        let of_keys = |values: Vec<SweepValue>| {
            let values = values.into_iter().zip(&counts);
            let values = values.flat_map(|(value, &count)| std::iter::repeat_n(value, count));
            values.collect()
        };
        let points = self.design.points(&self.dimensions).into_iter();
        points.map(of_keys).collect()
    }
}

fn spec(document: &Document, table: &Table<'_>) -> Result<SweepSpec, Reported> {
    let name = table.optional(NAME, |item| item.text().map(str::to_owned));
    let kind = table.optional(DESIGN, |item| item.choice(DesignKind::WORDS));
    let kind = kind.map(|kind| kind.unwrap_or(DesignKind::Grid));
    let points = table.optional(POINTS, |item| natural(item, 1));
    let seed = table.optional(SEED, Item::natural);
    let set = table.optional(SET, settings);
    let is_grid = kind == Ok(DesignKind::Grid);
    let dimensions = table.required(DIMENSION, |item| item.each(|item| dimension(item, is_grid)));
    let shares = table.optional(SHARE, |item| item.each(share));
    let of_draws = if is_grid {
        refuse(table, &[POINTS, SEED], |key| {
            let help = "leave it out, or choose another `design`";
            (format!("a grid has no `{key}`"), help.to_owned())
        })
    } else {
        Ok(())
    };
    let points = match points {
        Ok(None) if !is_grid && kind.is_ok() => Err(table.missing(POINTS)),
        points => points,
    };
    let dimensions = dimensions.and_then(|dimensions| {
        check_dimensions(table, dimensions.iter().flat_map(SweepDimension::keys))?;
        Ok(dimensions)
    });
    let (kind, points, seed, dimensions) = (kind?, points?, seed?, dimensions?);
    of_draws?;
    let points = match points {
        Some(points) if !is_grid => points,
        _ => grid_points(table, &dimensions)?,
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
