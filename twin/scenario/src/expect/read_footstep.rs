//! Reading expectations of footsteps.

use std::collections::BTreeSet;
use std::ops::Bound;

use twinrig_document::{Item, Range, Reported, Table};
use twinrig_kernel::Unit;

use super::read::{one_of, placed_text};
use super::{Axis, FootstepClaim, FootstepMeasure, LegChoice, Pattern};
use crate::limits::{Domain, Limits};
use crate::scenario::Placed;

pub(crate) const FOOTSTEP_MEASURES: [&str; 14] = [
    "slip",
    "duty_factor",
    "stance",
    "swing",
    "frequency",
    "stride",
    "impulse",
    "peak_load",
    "position",
    "count",
    "phase",
    "phase_spread",
    "order",
    "displacement",
];

const AXES: [(&str, Axis); 4] = [
    ("x", Axis::X),
    ("y", Axis::Y),
    ("z", Axis::Z),
    ("horizontal", Axis::Horizontal),
];

/// Reads `footstep = { … }`.
pub(super) fn claim(item: &Item<'_>) -> Result<FootstepClaim, Reported> {
    let table = item.table()?;
    let legs = table.optional("leg", legs);
    let key = one_of(
        item,
        &table,
        &FOOTSTEP_MEASURES,
        "no measure of the footsteps is given",
    )?;
    let measure = measure(&table, key);
    Ok(FootstepClaim {
        legs: legs?.unwrap_or(LegChoice::All),
        measure: measure?,
    })
}

fn measure(table: &Table<'_>, key: &str) -> Result<FootstepMeasure, Reported> {
    let limits = |unit, domain| table.required(key, |item| Limits::read(item, unit, &domain));
    let positive = |unit| limits(unit, Domain::POSITIVE);
    let length = || limits(Unit::Meter, Domain::NOT_NEGATIVE);
    Ok(match key {
        "slip" => FootstepMeasure::Slip(length()?),
        "duty_factor" => FootstepMeasure::DutyFactor(limits(Unit::One, Domain::SHARE)?),
        "stance" => FootstepMeasure::StanceTime(positive(Unit::Second)?),
        "swing" => FootstepMeasure::SwingTime(positive(Unit::Second)?),
        "frequency" => FootstepMeasure::Frequency(positive(Unit::Hertz)?),
        "stride" => FootstepMeasure::StrideLength(length()?),
        "impulse" => FootstepMeasure::Impulse(positive(Unit::NewtonSecond)?),
        "peak_load" => FootstepMeasure::PeakLoad(positive(Unit::Newton)?),
        "position" => {
            let axis = table.optional("axis", |item| item.choice(&AXES[..3]));
            let limits = limits(Unit::Meter, Domain::ANY)?;
            FootstepMeasure::Position(axis?.unwrap_or(Axis::X), limits)
        }
        "count" => FootstepMeasure::Count(limits(Unit::One, Domain::COUNT)?),
        "phase" => {
            let pattern = table.required("phase", pattern);
            // The greatest possible deviation is half a cycle, which accepts every phase.
            let below_half = Range {
                min: Bound::Included(0.0),
                max: Bound::Excluded(0.5),
            };
            let tolerance = table.required("tolerance", |item| item.number(&below_half));
            FootstepMeasure::Phase {
                pattern: pattern?,
                tolerance: tolerance?,
            }
        }
        "phase_spread" => FootstepMeasure::PhaseSpread(limits(Unit::One, Domain::NOT_NEGATIVE)?),
        "order" => FootstepMeasure::Order(table.required("order", order)?),
        _ => displacement(table)?,
    })
}

fn legs(item: &Item<'_>) -> Result<LegChoice, Reported> {
    if item.is_list() {
        let named = item.each(placed_text)?;
        if named.is_empty() {
            return Err(item.report("no leg is named", "leave `leg` out for all of them"));
        }
        reject_duplicates(item, named.iter())?;
        return Ok(LegChoice::Named(named));
    }
    Ok(match item.text()? {
        "all" => LegChoice::All,
        "fore" => LegChoice::Fore,
        "hind" => LegChoice::Hind,
        _ => LegChoice::Named(vec![placed_text(item)?]),
    })
}

fn pattern(item: &Item<'_>) -> Result<Pattern, Reported> {
    if !item.is_table() {
        return item.choice(&[
            ("trot", Pattern::Trot),
            ("pace", Pattern::Pace),
            ("walk", Pattern::Walk),
            ("bound", Pattern::Bound),
        ]);
    }
    let table = item.table()?;
    let legs: Vec<_> = table
        .keys()
        .map(|leg| {
            let share = table.required(leg, |item| item.number(&Range::between(0.0, 1.0)))?;
            let name = Placed {
                value: leg.to_owned(),
                place: table.key_place(leg),
            };
            Ok((name, share))
        })
        .collect();
    Ok(Pattern::Given(legs.into_iter().collect::<Result<_, _>>()?))
}

fn order(item: &Item<'_>) -> Result<Vec<Vec<Placed<String>>>, Reported> {
    let groups = item.each(|item| {
        if item.is_list() {
            item.each(placed_text)
        } else {
            Ok(vec![placed_text(item)?])
        }
    })?;
    if groups.len() < 2 || groups.iter().any(Vec::is_empty) {
        let help = "as in [\"LF\", \"RH\"] or [[\"LF\", \"RH\"], [\"RF\", \"LH\"]]";
        return Err(item.report("an order requires at least two groups of legs", help));
    }
    reject_duplicates(item, groups.iter().flatten())?;
    Ok(groups)
}

/// Rejects a leg that occurs twice in a list, which makes an order ambiguous or unattainable.
fn reject_duplicates<'l>(
    item: &Item<'_>,
    legs: impl Iterator<Item = &'l Placed<String>>,
) -> Result<(), Reported> {
    let mut named = BTreeSet::new();
    let mut result = Ok(());
    for leg in legs {
        if !named.insert(&leg.value) {
            let message = format!("leg `{}` is named twice", leg.value);
            result = Err(item.report_at(&leg.place, message, "name each leg once"));
        }
    }
    result
}

fn displacement(table: &Table<'_>) -> Result<FootstepMeasure, Reported> {
    const REFERENCE: &str = "without changes";
    let against = table.required("against", |item| item.choice(&[(REFERENCE, ())]));
    let axis = table.optional("axis", |item| item.choice(&AXES));
    let cycle = table.optional("cycle", |item| {
        let cycle = item.natural()?;
        match u32::try_from(cycle) {
            Ok(cycle) if cycle > 0 => Ok(cycle),
            _ => Err(item.report("cycles count from 1", "")),
        }
    });
    let domain = match axis {
        Ok(Some(Axis::Horizontal)) => Domain::NOT_NEGATIVE,
        _ => Domain::ANY,
    };
    let limits = table.required("displacement", |item| {
        Limits::read(item, Unit::Meter, &domain)
    });
    against?;
    Ok(FootstepMeasure::Displacement {
        axis: axis?.unwrap_or(Axis::X),
        cycle: cycle?.unwrap_or(1),
        limits: limits?,
    })
}
