//! Reading `[bus]`.

use twinrig_document::{Item, Placed, Reported};

use super::names::{distinct_names, kind};
use super::options::options;
use crate::catalogue::Kind;
use crate::language::{Key, Part, Shape, Special, TableSpec, Type, contextual, table};
use crate::scenario::BusSpec;

table! {
    /// Keys of `[bus]` of every kind.
    pub(super) bus_table = TableSpec::new("[bus]", "driver, wire and boards").selected_by("kind");
    NAME: Placed<String> = "name",
        Type::new(Shape::Pattern("^[^/=]+$"), |item, _| item.placed_text()),
        "name in signals and `--port NAME=DEVICE`", r#"name = "left""#, otherwise("the kind");
    KIND: () = "kind", contextual(Shape::Other(Special::Kind(Part::Bus))), "kind of bus", r#"kind = "sbcp""#,
        required();
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
