//! Reading expectations of footsteps.

use twinrig_document::{Item, Range, Reported, Table};
use twinrig_kernel::Unit;

use super::read::{one_of, placed_text};
use super::{Axis, FootstepClaim, FootstepMeasure, LegChoice, Pattern};
use crate::limits::Limits;
use crate::scenario::Placed;

const MEASURES: [&str; 14] = [
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

/// `footstep = { … }`
pub(super) fn claim(item: &Item<'_>) -> Result<FootstepClaim, Reported> {
    let table = item.table()?;
    let legs = table.optional("leg", legs);
    let key = one_of(
        item,
        &table,
        &MEASURES,
        "nothing of the footsteps is expected",
    )?;
    let measure = measure(&table, key);
    Ok(FootstepClaim {
        legs: legs?.unwrap_or(LegChoice::All),
        measure: measure?,
    })
}

fn measure(table: &Table<'_>, key: &str) -> Result<FootstepMeasure, Reported> {
    let limits = |unit| table.required(key, |item| Limits::read(item, unit));
    Ok(match key {
        "slip" => FootstepMeasure::Slip(limits(Unit::Meter)?),
        "duty_factor" => FootstepMeasure::DutyFactor(limits(Unit::One)?),
        "stance" => FootstepMeasure::StanceTime(limits(Unit::Second)?),
        "swing" => FootstepMeasure::SwingTime(limits(Unit::Second)?),
        "frequency" => FootstepMeasure::Frequency(limits(Unit::Hertz)?),
        "stride" => FootstepMeasure::StrideLength(limits(Unit::Meter)?),
        "impulse" => FootstepMeasure::Impulse(limits(Unit::NewtonSecond)?),
        "peak_load" => FootstepMeasure::PeakLoad(limits(Unit::Newton)?),
        "position" => {
            let axis = table.optional("axis", |item| item.choice(&AXES[..3]));
            let limits = limits(Unit::Meter)?;
            FootstepMeasure::Position(axis?.unwrap_or(Axis::X), limits)
        }
        "count" => FootstepMeasure::Count(limits(Unit::One)?),
        "phase" => {
            let pattern = table.required("phase", pattern);
            let half = Range::between(0.0, 0.5);
            let tolerance = table.required("tolerance", |item| item.number(&half));
            FootstepMeasure::Phase {
                pattern: pattern?,
                tolerance: tolerance?,
            }
        }
        "phase_spread" => FootstepMeasure::PhaseSpread(limits(Unit::One)?),
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
        return Err(item.report("an order has two groups of legs or more", help));
    }
    Ok(groups)
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
    let limits = table.required("displacement", |item| Limits::read(item, Unit::Meter));
    against?;
    Ok(FootstepMeasure::Displacement {
        axis: axis?.unwrap_or(Axis::X),
        cycle: cycle?.unwrap_or(1),
        limits: limits?,
    })
}
