//! Reading expectations of the sequence of two conditions.

use twinrig_document::{Item, Reported};
use twinrig_kernel::SimDuration;

use super::condition::CONDITION;
use crate::language::{Key, TableSpec, Type, table};
use crate::sequence::{Condition, Relation, SequenceClaim};

table! {
    /// Keys of `response`.
    pub(super) response_table = TableSpec::new("response", "claim that one condition follows another");
    WHENEVER: Condition = "whenever", CONDITION, "condition that requires the other one",
        r#"whenever = { name = "body/rpy", component = "x", min = "5 deg" }"#, required(),
        qualifier();
    THEN: Condition = "then", CONDITION, "condition that holds at the same time or later",
        r#"then = { name = "body/rpy", component = "x", max = "3 deg" }"#, required(), qualifier();
    WITHIN: SimDuration = "within", Type::POSITIVE_DURATION, "greatest time from one to the other",
        r#"within = "200 ms""#, required(), qualifier();
}

table! {
    /// Keys of `precedence`.
    pub(super) precedence_table =
        TableSpec::new("precedence", "claim that one condition precedes another");
    WHENEVER: Condition = "whenever", CONDITION, "condition that requires the other one",
        r#"whenever = { name = "leg/LF/hip/rate", min = "5 rad/s" }"#, required(), qualifier();
    BEFORE: Condition = "before", CONDITION, "condition that holds at the same time or earlier",
        r#"before = { name = "leg/LF/hip/command", min = "5 deg" }"#, required(), qualifier();
    WITHIN: SimDuration = "within", Type::POSITIVE_DURATION, "greatest time from one to the other",
        r#"within = "200 ms""#, otherwise("since the start of the window"), qualifier();
}

/// Reads `response = { … }`.
pub(super) fn response(item: &Item<'_>) -> Result<SequenceClaim, Reported> {
    use response_table::{THEN, WHENEVER, WITHIN};
    let table = &item.table()?;
    let table = response_table::TABLE.of(table);
    let (whenever, other) = (table.read(&WHENEVER), table.read(&THEN));
    let within = table.read(&WITHIN);
    Ok(SequenceClaim {
        whenever: whenever?,
        other: other?,
        relation: Relation::Then(within?),
    })
}

/// Reads `precedence = { … }`.
pub(super) fn precedence(item: &Item<'_>) -> Result<SequenceClaim, Reported> {
    use precedence_table::{BEFORE, WHENEVER, WITHIN};
    let table = &item.table()?;
    let table = precedence_table::TABLE.of(table);
    let (whenever, other) = (table.read(&WHENEVER), table.read(&BEFORE));
    let within = table.get(&WITHIN);
    Ok(SequenceClaim {
        whenever: whenever?,
        other: other?,
        relation: Relation::Before(within?),
    })
}
