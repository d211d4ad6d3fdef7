//! Reading `[bus]` and `[[fault]]`.

use twinrig_document::{Item, Placed, Range, Reported, suggestion};
use twinrig_kernel::{SimDuration, SimTime, Unit};
use twinrig_runtime::FaultKind;

use super::changes::time_within_run;
use super::code;
use super::names::{distinct_names, kind};
use super::options::options;
use crate::catalogue::Kind;
use crate::language::{
    Accepts, Declared, Key, Part, Shape, Special, TableSpec, Type, Words, choice, contextual,
    quantity, table,
};
use crate::scenario::{BusSpec, FaultSpec};

table! {
    /// Keys of `[bus]` of every kind.
    pub(super) bus_table = TableSpec::new("[bus]", "driver, wire and boards").selected_by("kind");
    NAME: Placed<String> = "name",
        Type::new(Shape::Pattern("^[^/=]+$"), |item, _| item.placed_text()),
        "name in signals and `--port NAME=DEVICE`", r#"name = "left""#, otherwise("the kind");
    KIND: () = "kind", contextual(Shape::Other(Special::Kind(Part::Bus))), "kind of bus", r#"kind = "sbcp""#,
        required();
}

/// Kind of a fault, without its figures.
#[derive(Clone, Copy)]
pub(super) enum FaultName {
    Drop,
    Flip,
    Delay,
    Duplicate,
    Reorder,
    Unplug,
    Stuck,
    Babble,
}

impl Words for FaultName {
    const WORDS: &'static [(&'static str, Self)] = &[
        ("drop", FaultName::Drop),
        ("flip", FaultName::Flip),
        ("delay", FaultName::Delay),
        ("duplicate", FaultName::Duplicate),
        ("reorder", FaultName::Reorder),
        ("unplug", FaultName::Unplug),
        ("stuck", FaultName::Stuck),
        ("babble", FaultName::Babble),
    ];
}

const PROBABILITY: Type<f64> = quantity(Unit::One, Range::between(0.0, 1.0));

table! {
    /// Keys of `[[fault]]`.
    pub(super) fault_table = TableSpec::new("[[fault]]", "fault of a wire").selected_by("kind");
    AT: () = "at", contextual(Shape::One(Accepts::Duration)), "begin", r#"at = "1 s""#, required();
    FOR: SimDuration = "for", Type::POSITIVE_DURATION, "length", r#"for = "90 ms""#,
        otherwise("to the end");
    ON: Placed<String> = "on", Type::new(Shape::Pattern("^wire/"), |item, _| item.placed_text()),
        "the wire: `wire/NAME` of a bus, or a place on it, `wire/NAME/PLACE`",
        r#"on = "wire/sbcp/LF""#, required();
    KIND: FaultName = "kind", choice(), "kind of fault", r#"kind = "drop""#, required();
    PROBABILITY: f64 = "probability", super::PROBABILITY, "share of the affected bursts",
        r#"kind = "drop", probability = 0.1"#, default("1"),
        only_with(&["drop", "duplicate", "reorder"]);
    RATE: f64 = "rate", super::PROBABILITY, "probability of an inversion, of each bit",
        r#"kind = "flip", rate = 1e-4"#, required(), only_with(&["flip"]);
    BY: SimDuration = "by", Type::DURATION, "delay of each burst", r#"kind = "delay", by = "2 ms""#,
        required(), only_with(&["delay"]);
    FAILS: bool = "fails", Type::BOOLEAN, "whether the host notices, which ends the run",
        r#"kind = "unplug", fails = true"#, default("false"), only_with(&["unplug"]);
    PAUSE: SimDuration = "pause", Type::DURATION, "mean pause between bursts",
        r#"kind = "babble", pause = "5 ms""#, default("'0 s'"), only_with(&["babble"]);
}

/// Reads `[bus]`, or all `[[bus]]`.
pub(super) fn buses(item: &Item<'_>, kinds: &[Kind]) -> Result<Vec<BusSpec>, Reported> {
    if kinds.is_empty() {
        if let Ok(table) = item.table() {
            table.give_up();
        }
        let help = "leave [bus] out: signals go straight to the actuators";
        return Err(item.report("this build has no bus", help));
    }
    if !item.is_list() {
        return Ok(vec![bus(item, kinds)?]);
    }
    let items = item.list()?;
    let buses = items
        .iter()
        .map(|item| bus(item, kinds))
        .collect::<Vec<_>>();
    let buses = buses.into_iter().collect::<Result<Vec<_>, _>>()?;
    distinct_names(&items, &buses, |bus| &bus.name.value, "buses")?;
    Ok(buses)
}

fn bus(item: &Item<'_>, kinds: &[Kind]) -> Result<BusSpec, Reported> {
    use bus_table::{KIND, NAME};
    let table = &item.table()?;
    let keys = bus_table::TABLE.of(table);
    let name = keys.get(&NAME);
    let place = keys.item(&KIND).map(|kind| kind.place());
    let kind = keys
        .read_with(&KIND, |item| kind(item, Part::Bus, kinds))
        .inspect_err(|_| table.give_up())?;
    let options = options(table, &kind.options);
    let name = name?.unwrap_or_else(|| Placed {
        value: kind.name.clone(),
        place: place.unwrap_or_else(|| item.place()),
    });
    if name.value.is_empty() || name.value.contains(['/', '=']) {
        let help = "it is part of signal names and of `--port NAME=DEVICE`: not empty, without `/` and `=`";
        return Err(keys.report(&NAME, "this is not a valid name of a bus", help));
    }
    Ok(BusSpec {
        name,
        kind: kind.name.clone(),
        options: options?,
    })
}

/// Reads `[[fault]]`.
pub(super) fn fault(item: &Item<'_>, run: SimDuration) -> Result<FaultSpec, Reported> {
    use fault_table::{AT, BY, FAILS, FOR, KIND, ON, PAUSE, PROBABILITY, RATE};
    let table = &item.table()?;
    let table = fault_table::TABLE.of(table);
    let at = table.read_with(&AT, |item| time_within_run(item, run, code::FAULT));
    let (on, lasts) = (table.read(&ON), table.get(&FOR));
    let name = table.read(&KIND).inspect_err(|_| table.give_up())?;
    let probability = |kind: fn(f64) -> FaultKind| table.read(&PROBABILITY).map(kind);
    let kind = match name {
        FaultName::Drop => probability(|probability| FaultKind::Drop { probability }),
        FaultName::Duplicate => probability(|probability| FaultKind::Duplicate { probability }),
        FaultName::Reorder => probability(|probability| FaultKind::Reorder { probability }),
        FaultName::Flip => table.read(&RATE).map(|rate| FaultKind::Flip { rate }),
        FaultName::Delay => table.read(&BY).map(|by| FaultKind::Delay { by }),
        FaultName::Unplug => table.read(&FAILS).map(|fails| FaultKind::Unplug { fails }),
        FaultName::Stuck => Ok(FaultKind::Stuck),
        FaultName::Babble => table.read(&PAUSE).map(|pause| FaultKind::Babble { pause }),
    };
    Ok(FaultSpec {
        at: SimTime::ZERO + at?,
        lasts: lasts?,
        on: on?,
        kind: kind?,
    })
}

/// Checks that every fault is on the wire of an existing bus. Other sites are known only to the
/// kind of the bus.
pub(super) fn check_sites(
    root: Declared<'_, '_>,
    key: &Key<()>,
    buses: &[BusSpec],
    faults: &[FaultSpec],
) -> Result<(), Reported> {
    let mut checked = Ok(());
    for (n, fault) in faults.iter().enumerate() {
        let on = &fault.on.value;
        let is_on_bus = |bus: &&BusSpec| {
            let rest = on.strip_prefix("wire/");
            let rest = rest.and_then(|rest| rest.strip_prefix(bus.name.value.as_str()));
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
        };
        if buses.iter().any(|bus| is_on_bus(&bus)) {
            continue;
        }
        let wires: Vec<String> = buses
            .iter()
            .map(|bus| format!("wire/{}", bus.name.value))
            .collect();
        let help = if wires.is_empty() {
            "a fault happens on the wire of a bus; this scene has no [bus], signals go straight to the actuators".to_owned()
        } else {
            suggestion(on, "wires", wires.iter().map(String::as_str))
        };
        let message = format!("there is no wire `{on}` in this scene");
        let item = root
            .item(key)
            .and_then(|item| item.list().ok()?.into_iter().nth(n));
        let item = item.and_then(|item| item.peek(fault_table::ON.name));
        checked = Err(match item {
            Some(item) => item.report(message, help),
            None => root.report(key, message, help),
        });
    }
    checked
}
