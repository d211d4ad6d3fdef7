//! Command `twin thesis`: printed figures of the thesis beside ours.

use twinrig_experiment::Machine;
use twinrig_scenario::Setting;

use super::{FAILURE, NEGATIVE, SUCCESS, Terminal};
use crate::args::{FlipMoves, ThesisArgs};
use crate::error::TwinError;
use crate::progress::Progress;
use crate::thesis::flips::FlipRun;
use crate::thesis::item::Item;
use crate::thesis::items::items;
use crate::thesis::record::{recorded, recorded_flips};
use crate::thesis::result::ThesisResult;
use crate::thesis::{run, text};
use crate::version::PROFILE;
use twinrig_rig::registry::Registry;

/// Name and version of the program, for the run times.
const BUILD: &str = concat!("twinrig ", env!("CARGO_PKG_VERSION"));

pub(super) fn thesis(registry: &Registry, args: &ThesisArgs, terminal: &mut Terminal<'_>) -> u8 {
    if args.list {
        list(args, terminal);
        return SUCCESS;
    }
    if terminal.interactive {
        crate::interrupt::listen();
    }
    if let Some(moves) = args.flips {
        return match flip(registry, args, moves, terminal) {
            Ok(code) => code,
            Err(error) => {
                terminal.report_error(&error, args.json);
                FAILURE
            }
        };
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

/// Returns the selected items, and the others that were not named.
fn select(args: &ThesisArgs) -> Result<(Vec<&'static Item>, Vec<&'static Item>), TwinError> {
    Ok(match &args.item {
        Some(id) => (vec![run::find(id)?], Vec::new()),
        None => items().partition(|item| args.all || !item.is_long()),
    })
}

/// Moves the numbers that the selected items read, and prints which verdicts flip.
fn flip(
    registry: &Registry,
    args: &ThesisArgs,
    moves: FlipMoves,
    terminal: &mut Terminal<'_>,
) -> Result<u8, TwinError> {
    let (mut selected, _) = select(args)?;
    let recorded = recorded_flips().unwrap_or_default();
    if moves == FlipMoves::Least {
        selected.retain(|item| {
            recorded
                .item(item.id)
                .is_some_and(|it| !it.figures.is_empty())
        });
    }
    let run = FlipRun::new(registry, selected, &args.scenarios);
    let progress = Progress::new("thesis", terminal.interactive && !args.json);
    if moves == FlipMoves::All {
        let flips = run.all(BUILD, progress)?;
        if args.json {
            terminal.print_plain(&serde_json::to_string_pretty(&flips).unwrap_or_default());
        } else {
            terminal.print(&text::flips(&flips));
        }
        return Ok(SUCCESS);
    }
    let (departures, count) = run.repeat(&recorded, progress)?;
    if args.json {
        terminal.print_json(&serde_json::json!({ "moves": count, "departures": departures }));
    } else {
        let departing = departures.len();
        terminal.print(&format!("{count} moves repeated, {departing} departures"));
        for departure in &departures {
            terminal.print(&format!("  {departure}"));
        }
    }
    Ok(if departures.is_empty() && count > 0 {
        SUCCESS
    } else {
        NEGATIVE
    })
}

/// Runs the selected items; also returns the others that were not named.
fn compare(
    registry: &Registry,
    args: &ThesisArgs,
    terminal: &Terminal<'_>,
) -> Result<(ThesisResult, Vec<&'static Item>), TwinError> {
    let (selected, skipped) = select(args)?;
    let settings = args.set.iter().map(|(key, value)| Setting {
        origin: "--set".to_owned(),
        key: key.clone(),
        value: value.clone(),
    });
    let progress = Progress::new("thesis", terminal.interactive && !args.json);
    let machine = Machine::here(BUILD, PROFILE);
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
