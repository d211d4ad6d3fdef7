//! Command `twin thesis`: printed figures of the thesis beside ours.

use twinrig_scenario::Setting;
use twinrig_study::Machine;

use super::{FAILURE, NEGATIVE, SUCCESS, Terminal};
use crate::args::ThesisArgs;
use crate::assembly::registry::Registry;
use crate::error::TwinError;
use crate::run::interrupt;
use crate::run::progress::Progress;
use crate::thesis::item::Item;
use crate::thesis::items::items;
use crate::thesis::record::recorded;
use crate::thesis::result::ThesisResult;
use crate::thesis::{run, text};

/// Name and version of the program, for the run times.
const BUILD: &str = concat!("twinrig ", env!("CARGO_PKG_VERSION"));

pub(super) fn thesis(registry: &Registry, args: &ThesisArgs, terminal: &mut Terminal<'_>) -> u8 {
    if args.list {
        list(args, terminal);
        return SUCCESS;
    }
    if terminal.interactive {
        interrupt::listen();
    }
    match compare(registry, args, terminal) {
        Ok((result, skipped)) => show(args, &result, &skipped, terminal),
        Err(error) => {
            terminal.report_error(&error, args.json);
            FAILURE
        }
    }
}

fn list(args: &ThesisArgs, terminal: &mut Terminal<'_>) {
    if args.json {
        let listed = items().map(|item| {
            let Item {
                id,
                title,
                place,
                run_s,
                ..
            } = item;
            serde_json::json!({ "id": id, "title": title, "place": place, "run_s": run_s })
        });
        terminal.print_json(&listed.collect::<Vec<_>>());
    } else {
        terminal.print(&text::list(items()));
    }
}

/// Runs the selected items; also returns the others that were not named.
fn compare(
    registry: &Registry,
    args: &ThesisArgs,
    terminal: &Terminal<'_>,
) -> Result<(ThesisResult, Vec<&'static Item>), TwinError> {
    let (selected, skipped): (Vec<_>, Vec<_>) = match &args.item {
        Some(id) => (vec![run::find(id)?], Vec::new()),
        None => items().partition(|item| args.all || !item.is_long()),
    };
    let settings = args.set.iter().map(|(key, value)| Setting {
        origin: "--set".to_owned(),
        key: key.clone(),
        value: value.clone(),
    });
    let progress = Progress::of_parts("thesis", terminal.interactive && !args.json);
    let machine = Machine::here(BUILD);
    let settings = settings.collect();
    let result = run::run(
        registry,
        &selected,
        &args.scenarios,
        settings,
        &machine,
        progress,
    )?;
    Ok((result, skipped))
}

/// Prints the result and returns the exit code.
fn show(
    args: &ThesisArgs,
    result: &ThesisResult,
    skipped: &[&Item],
    terminal: &mut Terminal<'_>,
) -> u8 {
    let departures = result.departures(recorded().as_ref());
    if args.json {
        // In several lines, as the output of all items is a file of the documentation.
        let json = serde_json::to_string_pretty(result).unwrap_or_default();
        terminal.print_plain(&json);
        for departure in &departures {
            terminal.note(departure);
        }
    } else {
        let results = match (&args.item, result.items.as_slice()) {
            (Some(_), [item]) => text::item(item),
            _ => text::table(result),
        };
        terminal.print(&results);
        terminal.print("");
        terminal.print(&text::summary(result, skipped, &departures));
    }
    if departures.is_empty() {
        SUCCESS
    } else {
        NEGATIVE
    }
}
