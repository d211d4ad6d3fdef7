//! Tolerances of a baseline.

use std::path::Path;

use twinrig_document::{Document, DocumentError, Item, Range, Reported, Table};
use twinrig_kernel::{SimDuration, Unit};
use twinrig_record::SignalDrift;
use twinrig_scenario::matches;

use super::super::compare::Bounds;
use crate::error::TwinError;

/// Text of the file that `twin accept` makes.
pub const TEMPLATE: &str = "\
# Tolerances within which a run equals the recordings of this folder (twin run --against).

time = \"5 ms\"    # of touch-downs and lift-offs
place = \"5 mm\"   # of footsteps

# Of signals, as a share of their range (\"1 %\") or in their unit (\"2 mm\"); `*` and `**` are
# wildcards, and the first pattern that matches counts. Signals without one are not judged.
[signals]
";

/// Tolerances.
#[derive(Debug, Clone, PartialEq)]
pub struct Tolerances {
    bounds: Bounds,
    /// Patterns of signals with their limits.
    signals: Vec<(String, Limit)>,
}

/// Limit of the difference of a signal.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Limit {
    /// As a share of its range.
    Share(f64),
    /// In its unit.
    Absolute(f64, Unit),
}

impl Tolerances {
    /// Reads a file; the defaults if there is none.
    pub(super) fn read(path: &Path) -> Result<Self, DocumentError> {
        if !path.exists() {
            return Ok(Self {
                bounds: Bounds::default(),
                signals: Vec::new(),
            });
        }
        Document::read(path)?.check(tolerances)
    }

    /// Returns the tolerances of footsteps.
    pub(super) fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// Checks that each pattern of `file` has signals with a fitting unit.
    pub(super) fn check(&self, signals: &[SignalDrift], file: &Path) -> Result<(), TwinError> {
        for (pattern, limit) in &self.signals {
            let named = signals.iter().filter(|it| matches(pattern, &it.signal));
            let mut units: Vec<&str> = named.map(|it| it.unit.as_str()).collect();
            if units.iter().any(|unit| limit.fits(unit)) {
                continue;
            }
            units.dedup();
            let why = match &*units {
                [] => format!("no signal of the recordings matches `{pattern}`"),
                units => format!("`{pattern}` is in {}", units.join(", ")),
            };
            return Err(TwinError::Refused {
                path: file.to_owned(),
                why,
                help: "name signals of both recordings, with limits in their units or in %"
                    .to_owned(),
            });
        }
        Ok(())
    }

    /// Returns the components of signals that are beyond their tolerances. Of a pattern for signals
    /// of several units, the limit is that of those in its unit.
    pub(super) fn beyond<'s>(&self, signals: &'s [SignalDrift]) -> Vec<&'s SignalDrift> {
        let beyond = signals.iter().filter(|drift| {
            let mut limits = self.signals.iter();
            let limit = limits.find(|(pattern, limit)| {
                matches(pattern, &drift.signal) && limit.fits(&drift.unit)
            });
            match limit {
                Some((_, Limit::Share(most))) => {
                    drift.aligned.share.is_some_and(|share| share > *most)
                }
                Some((_, Limit::Absolute(most, _))) => drift.aligned.max > *most,
                None => false,
            }
        });
        beyond.collect()
    }
}

impl Limit {
    /// Returns whether it limits signals in the unit with this symbol.
    fn fits(self, unit: &str) -> bool {
        match self {
            Self::Share(_) => true,
            Self::Absolute(_, of) => of.symbol() == unit,
        }
    }
}

fn tolerances(table: &Table<'_>) -> Result<Tolerances, Reported> {
    let defaults = Bounds::default();
    let time = table.optional("time", Item::duration);
    let place = table.optional("place", |item| {
        item.quantity(Unit::Meter, &Range::NOT_NEGATIVE)
    });
    let signals = table.optional("signals", |item| {
        item.by_name(|item| {
            let unit = item.any_unit()?;
            let most = item.quantity(unit, &Range::NOT_NEGATIVE)?;
            Ok(match unit {
                Unit::One => Limit::Share(most),
                unit => Limit::Absolute(most, unit),
            })
        })
    });
    let (time, place, signals) = (time?, place?, signals?);
    Ok(Tolerances {
        bounds: Bounds {
            time_s: time.map_or(defaults.time_s, SimDuration::as_secs_f64),
            place_m: place.unwrap_or(defaults.place_m),
            share: None,
        },
        signals: signals
            .unwrap_or_default()
            .into_iter()
            .map(|(name, limit)| (name.value, limit))
            .collect(),
    })
}
