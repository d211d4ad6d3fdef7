//! Reading `[bus]` and `[[fault]]`.

use twinrig_document::{Item, Range, Reported, Table, suggestion};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::FaultKind;

use super::changes::time_within_run;
use super::{code, kind};
use crate::catalogue::Kind;
use crate::expect::placed_text;
use crate::options::Options;
use crate::scenario::{BusSpec, FaultSpec, Placed};

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
    let buses = item.each(|item| bus(item, kinds))?;
    for (n, bus) in buses.iter().enumerate() {
        let name = &bus.name.value;
        if buses[..n].iter().any(|other| other.name.value == *name) {
            let message = format!("two buses have the name `{name}`");
            return Err(item.report(message, "give each bus a distinct `name`"));
        }
    }
    Ok(buses)
}

fn bus(item: &Item<'_>, kinds: &[Kind]) -> Result<BusSpec, Reported> {
    let table = item.table()?;
    let name = table.optional("name", placed_text);
    let place = table.get("kind").map(|kind| kind.place());
    let kind = table
        .required("kind", |item| kind(item, "bus", kinds))
        .inspect_err(|_| table.give_up())?;
    let options = Options::read(&table, &kind.options);
    let name = name?.unwrap_or_else(|| Placed {
        value: kind.name.clone(),
        place: place.unwrap_or_else(|| item.place()),
    });
    if name.value.is_empty() || name.value.contains(['/', '=']) {
        let help = "it is part of signal names and of `--port NAME=DEVICE`: not empty, without `/` and `=`";
        return Err(table.report("name", "this is not a valid name of a bus", help));
    }
    Ok(BusSpec {
        name,
        kind: kind.name.clone(),
        options: options?,
    })
}

/// Reads `[[fault]]`.
pub(super) fn fault(item: &Item<'_>, run: SimDuration) -> Result<FaultSpec, Reported> {
    #[derive(Clone, Copy)]
    enum Name {
        Drop,
        Flip,
        Delay,
        Duplicate,
        Reorder,
        Unplug,
        Stuck,
        Babble,
    }
    const NAMES: [(&str, Name); 8] = [
        ("drop", Name::Drop),
        ("flip", Name::Flip),
        ("delay", Name::Delay),
        ("duplicate", Name::Duplicate),
        ("reorder", Name::Reorder),
        ("unplug", Name::Unplug),
        ("stuck", Name::Stuck),
        ("babble", Name::Babble),
    ];
    let table = item.table()?;
    let at = table.required("at", |item| time_within_run(item, run, code::FAULT));
    let on = table.required("on", placed_text);
    let lasts = table.optional("for", Item::positive_duration);
    let name = table
        .required("kind", |item| item.choice(&NAMES))
        .inspect_err(|_| table.give_up())?;
    let probability = || {
        let range = Range::between(0.0, 1.0);
        let probability = table.optional("probability", |item| item.number(&range))?;
        Ok(probability.unwrap_or(1.0))
    };
    let kind = match name {
        Name::Drop => probability().map(|probability| FaultKind::Drop { probability }),
        Name::Duplicate => probability().map(|probability| FaultKind::Duplicate { probability }),
        Name::Reorder => probability().map(|probability| FaultKind::Reorder { probability }),
        Name::Flip => table
            .required("rate", |item| item.number(&Range::between(0.0, 1.0)))
            .map(|rate| FaultKind::Flip { rate }),
        Name::Delay => table
            .required("by", Item::duration)
            .map(|by: SimDuration| FaultKind::Delay { by }),
        Name::Unplug => table
            .optional("fails", Item::boolean)
            .map(|fails| FaultKind::Unplug {
                fails: fails.unwrap_or(false),
            }),
        Name::Stuck => Ok(FaultKind::Stuck),
        Name::Babble => table
            .optional("pause", Item::duration)
            .map(|pause| FaultKind::Babble {
                pause: pause.unwrap_or(SimDuration::ZERO),
            }),
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
    table: &Table<'_>,
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
        let item = table
            .get("fault")
            .and_then(|item| item.list().ok()?.into_iter().nth(n));
        let item = item.and_then(|item| item.peek("on"));
        checked = Err(match item {
            Some(item) => item.report(message, help),
            None => table.report("fault", message, help),
        });
    }
    checked
}
