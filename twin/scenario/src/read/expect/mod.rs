//! Reading expectations.

mod beyond_end;
mod beyond_horizon;
mod body;
mod compare;
mod condition;
mod context;
mod footstep;
mod gait;
mod gets_up;
mod one_of;
mod recovery;
mod sequence;
mod settles;
mod signal;
mod timing;

use twinrig_document::{Item, Reported};
use twinrig_kernel::{SimTime, Unit};

use super::limits::limits;
use crate::domain::Domain;
use crate::expect::{Claim, Expectation};
use crate::language::{Accepts, Key, Shape, Special, TableSpec, Type, contextual, table};
use crate::limits::Limits;
use context::instant;
use one_of::one_of;

pub(super) use context::Context;

table! {
    /// Keys of `[[expect]]`.
    pub(super) expect_table = TableSpec::new("[[expect]]", "one expectation of the run");
    NAME: String = "name", Type::TEXT, "name in the verdict",
        r#"name = "walks", body = { fall = false }"#, otherwise("subject and measure");
    AFTER: () = "after", contextual(Shape::One(Accepts::Duration)), "start of the window",
        r#"after = "2 s", body = { fall = false }"#,
        otherwise("the start; with `displacement` the first change");
    BEFORE: () = "before", contextual(Shape::One(Accepts::Duration)), "end of the window",
        r#"before = "8 s", body = { fall = false }"#, otherwise("the end of the run");
    OPTIONAL: bool = "optional", Type::BOOLEAN, "whether it passes if it is unobserved",
        "optional = true, body = { fall = false }", default("false");
    THROUGH_SILENCE: bool = "through_silence", Type::BOOLEAN,
        "whether it is judged although a bus that it reads is dead for a time",
        "through_silence = true, signal = { name = \"sbcp/errors\", eventually = { min = 9 } }",
        default("false");
    PLANTS: () = "plants", contextual(PLANTS_OF_BUILD), "plants to which it applies",
        r#"plants = ["massless"], body = { fall = false }"#, otherwise("all");
    FOOTSTEP: Claim = "footstep",
        Type::new(Shape::Table(footstep::footstep_table::TABLE), |item, _| {
            footstep::claim(item).map(Claim::Footstep)
        }),
        "claim about footsteps", r#"footstep = { slip = { max = "40 mm" } }"#, one_of();
    GAIT: Claim = "gait",
        Type::new(Shape::Table(gait::gait_table::TABLE), |item, _| {
            gait::claim(item).map(Claim::Gait)
        }),
        "claim about the gait as a whole", "gait = { flight_share = { max = 0.1 } }", one_of();
    BODY: () = "body", contextual(Shape::Table(body::body_table::TABLE)), "claim about the trunk", "body = { fall = false }", one_of();
    TIMING: Claim = "timing",
        Type::new(Shape::Table(timing::timing_table::TABLE), |item, _| timing::claim(item)),
        "claim about the cycle of the controller or of a bus",
        r#"timing = { of = "control", jitter = { max = "50 us" } }"#, one_of();
    SIGNAL: () = "signal", contextual(Shape::Table(signal::signal_table::TABLE)),
        "claim about signals", r#"signal = { name = "sbcp/errors", always = { max = 0 } }"#,
        one_of();
    COMPARE: Claim = "compare",
        Type::new(Shape::Table(compare::compare_table::TABLE), |item, _| {
            compare::claim(item).map(Claim::Compare)
        }),
        "claim about a signal compared with another",
        r#"compare = { signal = "leg/LF/hip/position", with = "leg/LF/hip/command", delay = { max = "20 ms" } }"#,
        one_of();
    RESPONSE: Claim = "response",
        Type::new(Shape::Table(sequence::response_table::TABLE), |item, _| {
            sequence::response(item).map(Claim::Sequence)
        }),
        "claim that one condition follows another",
        r#"response = { whenever = { name = "body/rpy", component = "x", min = "5 deg" }, then = { name = "body/rpy", component = "x", max = "3 deg" }, within = "200 ms" }"#,
        one_of();
    PRECEDENCE: Claim = "precedence",
        Type::new(Shape::Table(sequence::precedence_table::TABLE), |item, _| {
            sequence::precedence(item).map(Claim::Sequence)
        }),
        "claim that one condition precedes another",
        r#"precedence = { whenever = { name = "leg/LF/hip/rate", min = "5 rad/s" }, before = { name = "leg/LF/hip/command", min = "5 deg" } }"#,
        one_of();
    ENERGY: Claim = "energy", Type::new(Shape::Table(energy_table::TABLE), |item, _| energy(item)),
        "claim about the energy balance", "energy = { residual = { max = 1e-6 } }", one_of();
    COST: Claim = "cost",
        Type::new(Shape::Table(timing::cost_table::TABLE), |item, _| timing::cost(item)),
        "claim about the computational work", "cost = { steps = { max = 20000 } }", one_of();
}

const PLANTS_OF_BUILD: Shape = Shape::list(&Shape::Other(Special::Plant), 1);

table! {
    /// Keys of `energy`.
    pub(super) energy_table = TableSpec::new("energy", "claim about the energy balance");
    RESIDUAL: Limits = "residual", limits(Unit::One, Domain::NOT_NEGATIVE),
        "residual at the end of the run, over the energy exchanged", "residual = { max = 1e-6 }",
        required();
}

/// Reads one `[[expect]]`.
pub(super) fn expectation(item: &Item<'_>, context: &Context<'_>) -> Result<Expectation, Reported> {
    use expect_table::{AFTER, BEFORE, BODY, NAME, OPTIONAL, PLANTS, SIGNAL, THROUGH_SILENCE};
    let table = &item.table()?;
    let table = expect_table::TABLE.of(table);
    let name = table.get(&NAME);
    let place = item
        .peek(NAME.name)
        .map_or_else(|| item.place(), |name| name.place());
    let after = table.get_with(&AFTER, |item| instant(item, context));
    let before = table.get_with(&BEFORE, |item| instant(item, context));
    let optional = table.read(&OPTIONAL);
    let through_silence = table.read(&THROUGH_SILENCE);
    let plants = table.get_with(&PLANTS, |item| {
        let plants = item.each(|item| plant(item, context))?;
        if plants.is_empty() {
            return Err(item.report("no plant is named", "leave `plants` out for all of them"));
        }
        Ok(plants)
    });
    let subject = one_of(table, item, "nothing is expected")?;
    let claim = if subject == BODY.name {
        table.read_with(&BODY, |item| body::claim(item, context).map(Claim::Body))
    } else if subject == SIGNAL.name {
        table.read_with(&SIGNAL, |item| {
            signal::claim(item, context).map(Claim::Signal)
        })
    } else {
        table.read_named(subject)
    };
    let (explicit_after, before, claim) = (after?, before?, claim?);
    let mut expectation = Expectation {
        name: String::new(),
        place,
        after: explicit_after.unwrap_or(SimTime::ZERO),
        before,
        optional: optional?,
        through_silence: through_silence?,
        plants: plants?.unwrap_or_default(),
        claim,
    };
    if expectation.needs_reference() {
        match (explicit_after, context.first_change) {
            (None, Some(first)) => expectation.after = first,
            (_, None) => {
                let message =
                    "a displacement against the run without changes requires a [[change]]";
                return Err(item.report(message, "add a [[change]]"));
            }
            _ => {}
        }
    }
    if before.is_some_and(|before| before <= expectation.after) {
        return Err(table.report(&BEFORE, "`before` is not later than `after`", ""));
    }
    let measured = item.peek(subject);
    if let Some(measured) = &measured {
        recovery::check(measured, &expectation, context)?;
        beyond_end::warn(measured, &expectation, context.duration);
        if let Some(horizon) = context.horizon {
            beyond_horizon::warn(measured, &expectation, horizon, context.duration);
        }
    }
    expectation.name = name?.unwrap_or_else(|| {
        let measure = measured.map_or(String::new(), |item| measure_name(subject, &item));
        format!("{subject} {measure}").trim_end().replace('_', " ")
    });
    Ok(expectation)
}

/// Reads the name of a plant.
fn plant(item: &Item<'_>, context: &Context<'_>) -> Result<String, Reported> {
    let name = item.text()?;
    let mut plants = context.plants.iter().copied();
    if plants.clone().any(|known| known == name) {
        return Ok(name.to_owned());
    }
    let message = format!("there is no plant `{name}`");
    Err(item.report_word(message, name, "plants", &mut plants))
}

/// Returns the keys that name the measure of `subject`, for an expectation without a name.
fn measure_name(subject: &str, item: &Item<'_>) -> String {
    let subjects = expect_table::TABLE.all_keys().into_iter();
    let tables = subjects
        .filter(|key| key.name == subject)
        .flat_map(|key| key.shape.tables());
    let keys: Vec<_> = tables.flat_map(TableSpec::all_keys).collect();
    let is_qualifier = |name: &&str| keys.iter().any(|key| key.name == *name && key.is_qualifier);
    let present = item.keys().into_iter().flatten();
    let names: Vec<_> = present.filter(|name| !is_qualifier(name)).collect();
    names.join(" ")
}

fn energy(item: &Item<'_>) -> Result<Claim, Reported> {
    let table = &item.table()?;
    let residual = energy_table::TABLE.of(table).read(&energy_table::RESIDUAL);
    residual.map(Claim::EnergyResidual)
}
