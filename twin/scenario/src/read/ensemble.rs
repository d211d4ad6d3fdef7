//! Reading `ensemble`: the number of runs from perturbed starts, with other seeds, or with other
//! values of a fit.

use twinrig_document::{Item, Placed, Range, Reported};
use twinrig_kernel::Unit;

use crate::language::{Accepts, Key, Shape, TableSpec, Type, choice, quantity, table};
use crate::read::options::natural;
use crate::scenario::{EnsembleSpec, Varied};

/// Runs of which one differs from another.
const LEAST: u64 = 2;
/// More runs are a sweep.
const MOST: u64 = 10_000;
/// Share from which an expectation holds in the ensemble.
const SHARE: f64 = 0.95;

const COUNT: Shape = Shape::One(Accepts::Natural(LEAST..=MOST));

/// A number of runs, or the table.
pub(super) const ENSEMBLE: Type<EnsembleSpec> = Type::new(
    Shape::Either(&[COUNT, Shape::Table(ensemble_table::TABLE)]),
    |item, _| ensemble(item),
);

const RUNS: Type<u64> = Type::new(COUNT, |item, _| natural(item, &(LEAST..=MOST)));

table! {
    /// Keys of `ensemble`.
    pub(super) ensemble_table = TableSpec::new("ensemble", "runs from perturbed starts, with other seeds, or other values of a fit");
    RUNS: u64 = "runs", super::RUNS, "number of runs, that of the file included", "runs = 32",
        required();
    SHARE: f64 = "share", quantity(Unit::One, Range::between(0.0, 1.0)),
        "least share of the runs in which an expectation holds", "runs = 32, share = 0.9",
        default("0.95");
    VARY: Varied = "vary", choice(), "difference between the runs",
        r#"runs = 20, vary = "seed""#, otherwise("'fit' with `fit`, or else 'start'");
    FIT: Placed<String> = "fit", Type::PLACED,
        "overlay that `twin fit` wrote, relative to the scenario; values are drawn from its distribution",
        r#"runs = 200, fit = "xl330.fit.toml""#, otherwise("none");
}

fn ensemble(item: &Item<'_>) -> Result<EnsembleSpec, Reported> {
    use ensemble_table::{FIT, RUNS, SHARE, TABLE, VARY};
    if !item.is_table() {
        let runs = natural(item, &(LEAST..=MOST))?;
        return Ok(spec(runs, self::SHARE, Varied::Start, None));
    }
    let table = &item.table()?;
    let table = TABLE.of(table);
    let (runs, share) = (table.read(&RUNS), table.read(&SHARE));
    let (vary, fit) = (table.get(&VARY)?, table.get(&FIT)?);
    let otherwise = if fit.is_some() {
        Varied::Fit
    } else {
        Varied::Start
    };
    let vary = vary.unwrap_or(otherwise);
    if vary == Varied::Fit && fit.is_none() {
        let help = "write fit = \"NAME.fit.toml\"";
        return Err(item.report("there is no `fit` whose values vary", help));
    }
    // `--seeds` replaces what varies, and leaves the rest of the table.
    let fit = fit.filter(|_| vary == Varied::Fit);
    Ok(spec(runs?, share?, vary, fit))
}

fn spec(runs: u64, share: f64, vary: Varied, fit: Option<Placed<String>>) -> EnsembleSpec {
    EnsembleSpec {
        runs: usize::try_from(runs).unwrap_or(usize::MAX),
        share,
        vary,
        fit,
    }
}
