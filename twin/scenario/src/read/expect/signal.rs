//! Reading expectations of signals.

use twinrig_document::{Item, Placed, Reported};
use twinrig_kernel::SimDuration;

use super::condition::CONDITION;
use super::context::Context;
use super::one_of::one_of;
use super::recovery::{self, signal_recovers_table};
use super::settles::{settles, settles_table};
use crate::domain::Domain;
use crate::expect::{SignalClaim, SignalMode};
use crate::language::{Key, Shape, TableSpec, Type, contextual, table};
use crate::read::limits::{limits_table, read, unit_of};
use crate::sequence::Condition;

table! {
    /// Keys of `signal`.
    pub(super) signal_table = TableSpec::new("signal", "claim about signals");
    NAME: Placed<String> = "name", Type::PLACED,
        "name, or pattern of names with the wildcards `*` and `**`", r#"name = "leg/*/hip/rate""#,
        required(), qualifier();
    COMPONENT: usize = "component", Type::ELEMENT, "element of the signal, counted from 0",
        r#"name = "body/position", component = "z", always = { min = "5 cm" }"#, otherwise("all"),
        qualifier();
    WITHIN: SimDuration = "within", Type::POSITIVE_DURATION, "time from the start of the window",
        r#"name = "leg/LF/hip/rate", eventually = { max = "-12 rad/s" }, within = "1 s""#,
        otherwise("the window"), needs("eventually");
    UNTIL: Condition = "until", CONDITION,
        "end of the condition, when another signal is first within its limits",
        r#"always = { max = 1 }, until = { name = "energy/kinetic", max = "1 mJ" }"#,
        needs("always");
    ALWAYS: () = "always", contextual(LIMITS), "within limits in every observation",
        "always = { max = 0 }", one_of();
    EVENTUALLY: () = "eventually", contextual(LIMITS), "within limits in at least one observation",
        r#"eventually = { max = "-12 rad/s" }"#, one_of();
    SETTLES: () = "settles", contextual(Shape::TableIn(None, settles_table::TABLE)),
        "settling to the final value", r#"settles = { within = "1 deg", by = "5 s" }"#, one_of();
    RECOVERS: () = "recovers", contextual(Shape::TableIn(None, signal_recovers_table::TABLE)),
        "recovery from a disturbance",
        r#"recovers = { after = "3 s", within = "2 s", tolerance = "2 deg" }"#, one_of();
}

pub(super) const LIMITS: Shape = Shape::TableIn(None, limits_table::TABLE);

/// Reads `signal = { … }`.
pub(super) fn claim(item: &Item<'_>, context: &Context<'_>) -> Result<SignalClaim, Reported> {
    use signal_table::{ALWAYS, COMPONENT, EVENTUALLY, NAME, RECOVERS, SETTLES, UNTIL, WITHIN};
    let table = &item.table()?;
    let table = signal_table::TABLE.of(table);
    let (name, component) = (table.read(&NAME), table.get(&COMPONENT));
    let (within, until) = (table.get(&WITHIN), table.get(&UNTIL));
    let mode = one_of(table, item, "no condition on the signal is given")?;
    let (within, until) = (within?, until?);
    let key = [ALWAYS, EVENTUALLY, SETTLES, RECOVERS]
        .into_iter()
        .find(|key| key.name == mode);
    let (unit, mode) = table.read_with(&key.unwrap_or(ALWAYS), |item| {
        if mode == RECOVERS.name {
            return recovery::of_signal(item, context);
        }
        // The unit of the signal is only known to the scene, which compares the two.
        let unit = unit_of(item)?;
        if mode == SETTLES.name {
            let (within, by) = settles(item, unit)?;
            return Ok((unit, SignalMode::Settles { within, by }));
        }
        let limits = read(item, unit, &Domain::ANY)?;
        let mode = match until {
            _ if mode == EVENTUALLY.name => SignalMode::Eventually(limits, within),
            None => SignalMode::Always(limits),
            Some(until) => SignalMode::Until(limits, until),
        };
        Ok((unit, mode))
    })?;
    Ok(SignalClaim {
        name: name?,
        component: component?,
        unit,
        mode,
    })
}
