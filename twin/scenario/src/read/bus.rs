//! Reading `[bus]` and `[[fault]]`.

use twinrig_document::{Item, Range, Reported, Table, suggestion};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::FaultKind;

use super::changes::before_the_end;
use super::{code, kind};
use crate::catalogue::Kind;
use crate::expect::placed_text;
use crate::options::Options;
use crate::scenario::{BusSpec, FaultSpec, Placed};

/// `[bus]`, or every `[[bus]]`.
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
            let message = format!("two buses are called `{name}`");
            return Err(item.report(message, "give one of them a `name` of its own"));
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
        let help = "it stands in names of signals and in `--port NAME=DEVICE`";
        return Err(table.report("name", "a bus cannot be called so", help));
    }
    Ok(BusSpec {
        name,
        kind: kind.name.clone(),
        options: options?,
    })
}

/// `[[fault]]`
pub(super) fn fault(item: &Item<'_>, run: SimDuration) -> Result<FaultSpec, Reported> {
    #[derive(Clone, Copy)]
    enum Word {
        Drop,
        Flip,
        Delay,
        Duplicate,
        Reorder,
        Unplug,
        Stuck,
        Babble,
    }
    const WORDS: [(&str, Word); 8] = [
        ("drop", Word::Drop),
        ("flip", Word::Flip),
        ("delay", Word::Delay),
        ("duplicate", Word::Duplicate),
        ("reorder", Word::Reorder),
        ("unplug", Word::Unplug),
        ("stuck", Word::Stuck),
        ("babble", Word::Babble),
    ];
    let table = item.table()?;
    let at = table.required("at", |item| before_the_end(item, run, code::FAULT));
    let on = table.required("on", placed_text);
    let lasts = table.optional("for", Item::positive_duration);
    let word = table
        .required("kind", |item| item.choice(&WORDS))
        .inspect_err(|_| table.give_up())?;
    let probability = || {
        let range = Range::between(0.0, 1.0);
        let given = table.optional("probability", |item| item.number(&range))?;
        Ok(given.unwrap_or(1.0))
    };
    let kind = match word {
        Word::Drop => probability().map(|probability| FaultKind::Drop { probability }),
        Word::Duplicate => probability().map(|probability| FaultKind::Duplicate { probability }),
        Word::Reorder => probability().map(|probability| FaultKind::Reorder { probability }),
        Word::Flip => table
            .required("rate", |item| item.number(&Range::between(0.0, 1.0)))
            .map(|rate| FaultKind::Flip { rate }),
        Word::Delay => table
            .required("by", Item::duration)
            .map(|by: SimDuration| FaultKind::Delay { by }),
        Word::Unplug => table
            .optional("fails", Item::boolean)
            .map(|fails| FaultKind::Unplug {
                fails: fails.unwrap_or(false),
            }),
        Word::Stuck => Ok(FaultKind::Stuck),
        Word::Babble => table
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

/// Every fault is on a wire of a bus that is there. Which places a bus has besides is known only to its kind.
pub(super) fn check_sites(
    table: &Table<'_>,
    buses: &[BusSpec],
    faults: &[FaultSpec],
) -> Result<(), Reported> {
    let mut checked = Ok(());
    for (n, fault) in faults.iter().enumerate() {
        let on = &fault.on.value;
        let known = |bus: &&BusSpec| {
            let rest = on.strip_prefix("wire/");
            let rest = rest.and_then(|rest| rest.strip_prefix(bus.name.value.as_str()));
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
        };
        if buses.iter().any(|bus| known(&bus)) {
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
