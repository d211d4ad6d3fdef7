//! Reading expectations of footsteps.

use std::collections::BTreeSet;
use std::ops::Bound;

use serde_json::json;
use twinrig_document::{Item, Placed, Range, Reported};
use twinrig_kernel::Unit;

use super::one_of::one_of;
use crate::domain::Domain;
use crate::expect::{Axis, CycleMark, FootstepClaim, FootstepMeasure, LegChoice};
use crate::language::{
    Accepts, Declared, Key, Shape, Special, TableSpec, Type, Words, choice, contextual, quantity,
    table,
};
use crate::pattern::Pattern;
use crate::read::limits::{limits_of, read};

const NAME: Shape = Shape::One(Accepts::Text);
const LEG_OR_LEGS: Shape = Shape::Either(&[
    NAME,
    Shape::List {
        of: &NAME,
        least: 1,
        distinct: true,
    },
]);
const GROUPS: Shape = Shape::List {
    of: &LEG_OR_LEGS,
    least: 2,
    distinct: true,
};
const SHARE: Shape = Shape::One(Accepts::Quantity {
    unit: Unit::One,
    range: Range::between(0.0, 1.0),
});
/// The greatest possible deviation is half a cycle, which accepts every phase.
const BELOW_HALF: Range = Range {
    min: Bound::Included(0.0),
    max: Bound::Excluded(0.5),
};
const FOOTSTEP_NUMBER: Type<u32> = Type::new(
    Shape::One(Accepts::Natural(1..=u32::MAX as u64)),
    |item, _| cycle(item),
);

table! {
    /// Keys of `footstep`.
    pub(super) footstep_table = TableSpec::new("footstep", "claim about footsteps")
        .refined(|schema| {
            axis_of_position_or_displacement(schema);
            mark_of_cycle(schema);
        });
    LEG: LegChoice = "leg", Type::new(LEG_OR_LEGS, |item, _| legs(item)),
        "a name, a list of names, `fore`, `hind` or `all`",
        r#"leg = "fore", slip = { max = "40 mm" }"#, default("'all'"), qualifier();
    SLIP: FootstepMeasure = "slip",
        limits_of!(Unit::Meter, Domain::NOT_NEGATIVE, FootstepMeasure::Slip),
        "each: greatest horizontal distance from the place of touch-down in contact",
        r#"slip = { max = "40 mm" }"#, one_of();
    SLIP_SHARE: FootstepMeasure = "slip_share",
        limits_of!(Unit::One, Domain::NOT_NEGATIVE, FootstepMeasure::SlipShare),
        "mean: slip over the travel in stance, stride by stance share",
        r#"slip_share = { near = "20 %", within = 0.05 }"#, one_of();
    DUTY_FACTOR: () = "duty_factor", contextual(Shape::Other(Special::Limits(Unit::One, Domain::SHARE))),
        "mean: share of the cycle on the ground",
        r#"leg = "fore", duty_factor = { near = 0.515, within = 0.05 }"#, one_of();
    STANCE: FootstepMeasure = "stance",
        limits_of!(Unit::Second, Domain::POSITIVE, FootstepMeasure::StanceTime), "each: duration",
        r#"stance = { max = "0.3 s" }"#, one_of();
    SWING: FootstepMeasure = "swing",
        limits_of!(Unit::Second, Domain::POSITIVE, FootstepMeasure::SwingTime),
        "each: duration to the next", r#"swing = { min = "80 ms" }"#, one_of();
    FREQUENCY: FootstepMeasure = "frequency",
        limits_of!(Unit::Hertz, Domain::POSITIVE, FootstepMeasure::Frequency),
        "mean: touch-downs per second", r#"frequency = { near = "3.64 Hz", within = "1 %" }"#,
        one_of();
    STRIDE: FootstepMeasure = "stride",
        limits_of!(Unit::Meter, Domain::NOT_NEGATIVE, FootstepMeasure::StrideLength),
        "each: horizontal distance to the leg's next footstep",
        r#"leg = "LF", stride = { min = "10 cm" }"#, one_of();
    IMPULSE: FootstepMeasure = "impulse",
        limits_of!(Unit::NewtonSecond, Domain::POSITIVE, FootstepMeasure::Impulse),
        "each: impulse of the ground", r#"impulse = { max = "2 N·s" }"#, one_of();
    PEAK_LOAD: FootstepMeasure = "peak_load",
        limits_of!(Unit::Newton, Domain::POSITIVE, FootstepMeasure::PeakLoad),
        "each: greatest load", r#"peak_load = { max = "20 N" }"#, one_of();
    POSITION: () = "position", contextual(Shape::Other(Special::Limits(Unit::Meter, Domain::ANY))),
        "each: coordinate of touch-down along `axis`",
        r#"position = { max = "20 cm" }, axis = "y""#, one_of();
    COUNT: FootstepMeasure = "count", limits_of!(Unit::One, Domain::COUNT, FootstepMeasure::Count),
        "number of touch-downs of every leg", "count = { near = 54.5, within = 2.5 }", one_of();
    CONTACTS: FootstepMeasure = "contacts",
        limits_of!(Unit::One, Domain::NOT_NEGATIVE, FootstepMeasure::Contacts),
        "mean: contacts in a cycle, bounces included", "contacts = { max = 1.2 }", one_of();
    PHASE: Pattern = "phase",
        Type::new(
            Shape::Either(&[Shape::Choice(Pattern::words), Shape::ByName(&SHARE)]),
            |item, _| pattern(item),
        ),
        "mean (circular) phase in the first leg's cycle, or a share for each leg",
        r#"phase = "trot", tolerance = 0.05"#, one_of(), needs("tolerance");
    TOLERANCE: f64 = "tolerance", quantity(Unit::One, BELOW_HALF),
        "greatest deviation from `phase`",
        "phase = { LF = 0, RF = 0.5, LH = 0.5, RH = 0 }, tolerance = 0.05", needs("phase"),
        qualifier();
    PHASE_SPREAD: () = "phase_spread", contextual(Shape::Other(Special::Limits(Unit::One, Domain::NOT_NEGATIVE))),
        "circular standard deviation of the phase", "phase_spread = { max = 0.03 }", one_of();
    BY: CycleMark = "by", choice(),
        "mark of the cycles of `phase`, `phase_spread` and `duty_factor`: circular mean of the load, \
         or touch-down", r#"phase_spread = { max = 0.05 }, by = "touch-down""#, default("'load'"),
        qualifier();
    ORDER: FootstepMeasure = "order",
        Type::new(GROUPS, |item, _| order(item).map(FootstepMeasure::Order)),
        "sequence of touch-downs, repeated; any order within a group",
        r#"order = [["LF", "RH"], ["RF", "LH"]]"#, one_of();
    DISPLACEMENT: () = "displacement", contextual(Shape::Other(Special::Limits(Unit::Meter, Domain::ANY))),
        "distance from the same footstep of a run without changes, along `axis`",
        r#"displacement = { max = "5 mm" }, against = "without changes", axis = "horizontal""#,
        one_of(), needs("against");
    AGAINST: () = "against",
        Type::new(Shape::Choice(|| vec![REFERENCE]), |item, _| { item.choice(&[(REFERENCE, ())]) }),
        "other run of a displacement",
        r#"displacement = { max = "5 mm" }, against = "without changes""#, needs("displacement"),
        qualifier();
    CYCLE: u32 = "cycle", FOOTSTEP_NUMBER, "number of the footstep, counted from 1 at `after`",
        r#"displacement = { max = "5 mm" }, against = "without changes", cycle = 3"#, default("1"),
        needs("displacement"), qualifier();
    AXIS: Axis = "axis", choice(),
        "axis of a position or displacement; `horizontal` of the latter only",
        r#"position = { max = "20 cm" }, axis = "y""#, default("'x'"), qualifier();
}

const REFERENCE: &str = "without changes";

/// Adds the condition that a measure along an axis has `axis`, and a position one of its three.
fn axis_of_position_or_displacement(schema: &mut serde_json::Value) {
    use footstep_table::{AXIS, DISPLACEMENT, POSITION};
    let words = &Axis::words()[..3];
    let position = json!({
        "required": [POSITION.name],
        "properties": { AXIS.name: { "enum": words } },
    });
    let of_either = json!({ "anyOf": [{ "required": [DISPLACEMENT.name] }, position] });
    schema["dependentSchemas"] = json!({ AXIS.name: of_either });
}

/// Adds the condition that a measure of cycles has `by`.
fn mark_of_cycle(schema: &mut serde_json::Value) {
    use footstep_table::{BY, DUTY_FACTOR, PHASE, PHASE_SPREAD};
    let of_cycle = [PHASE.name, PHASE_SPREAD.name, DUTY_FACTOR.name];
    let required = of_cycle.map(|key| json!({ "required": [key] }));
    schema["dependentSchemas"][BY.name] = json!({ "anyOf": required });
}

/// Reads `footstep = { … }`.
pub(super) fn claim(item: &Item<'_>) -> Result<FootstepClaim, Reported> {
    let table = &item.table()?;
    let table = footstep_table::TABLE.of(table);
    let legs = table.read(&footstep_table::LEG);
    let measure = one_of(table, item, "no measure of the footsteps is given")?;
    let measure = self::measure(table, measure);
    Ok(FootstepClaim {
        legs: legs?,
        measure: measure?,
    })
}

fn measure(table: Declared<'_, '_>, name: &str) -> Result<FootstepMeasure, Reported> {
    use footstep_table::{
        AXIS, BY, DISPLACEMENT, DUTY_FACTOR, PHASE, PHASE_SPREAD, POSITION, TOLERANCE,
    };
    if name == POSITION.name {
        let axis = table.get_with(&AXIS, |item| item.choice(&Axis::WORDS[..3]));
        let limits = table.read_with(&POSITION, |item| read(item, Unit::Meter, &Domain::ANY))?;
        return Ok(FootstepMeasure::Position(axis?.unwrap_or(Axis::X), limits));
    }
    if name == PHASE.name {
        let (pattern, tolerance) = (table.read(&PHASE), table.read(&TOLERANCE));
        return Ok(FootstepMeasure::Phase {
            by: table.read(&BY)?,
            pattern: pattern?,
            tolerance: tolerance?,
        });
    }
    if name == PHASE_SPREAD.name {
        let limits = |item: &Item<'_>| read(item, Unit::One, &Domain::NOT_NEGATIVE);
        let (by, limits) = (table.read(&BY), table.read_with(&PHASE_SPREAD, limits));
        return Ok(FootstepMeasure::PhaseSpread(by?, limits?));
    }
    if name == DUTY_FACTOR.name {
        let limits = |item: &Item<'_>| read(item, Unit::One, &Domain::SHARE);
        let (by, limits) = (table.read(&BY), table.read_with(&DUTY_FACTOR, limits));
        return Ok(FootstepMeasure::DutyFactor(by?, limits?));
    }
    if name == DISPLACEMENT.name {
        return displacement(table);
    }
    table.read_named(name)
}

fn displacement(table: Declared<'_, '_>) -> Result<FootstepMeasure, Reported> {
    use footstep_table::{AGAINST, AXIS, CYCLE, DISPLACEMENT};
    let (against, axis) = (table.read(&AGAINST), table.read(&AXIS));
    let cycle = table.read(&CYCLE);
    let domain = match axis {
        Ok(Axis::Horizontal) => Domain::NOT_NEGATIVE,
        _ => Domain::ANY,
    };
    let limits = table.read_with(&DISPLACEMENT, |item| read(item, Unit::Meter, &domain));
    against?;
    Ok(FootstepMeasure::Displacement {
        axis: axis?,
        cycle: cycle?,
        limits: limits?,
    })
}

fn cycle(item: &Item<'_>) -> Result<u32, Reported> {
    match u32::try_from(item.natural()?) {
        Ok(cycle) if cycle > 0 => Ok(cycle),
        _ => Err(item.report("cycles count from 1", "")),
    }
}

fn legs(item: &Item<'_>) -> Result<LegChoice, Reported> {
    if item.is_list() {
        let named = item.each(Item::placed_text)?;
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
        _ => LegChoice::Named(vec![item.placed_text()?]),
    })
}

fn pattern(item: &Item<'_>) -> Result<Pattern, Reported> {
    if !item.is_table() {
        return item.choice(Pattern::WORDS);
    }
    let share = |item: &Item<'_>| item.number(&Range::between(0.0, 1.0));
    Ok(Pattern::Given(item.by_name(share)?))
}

fn order(item: &Item<'_>) -> Result<Vec<Vec<Placed<String>>>, Reported> {
    let groups = item.each(|item| {
        if item.is_list() {
            item.each(Item::placed_text)
        } else {
            Ok(vec![item.placed_text()?])
        }
    })?;
    if let Some(empty) = groups.iter().position(Vec::is_empty) {
        let message = format!("group {} of the order is empty", empty + 1);
        return Err(item.report(message, "name its legs, or remove it"));
    }
    if groups.len() < 2 {
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
