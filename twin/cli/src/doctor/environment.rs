//! The present folder and the terminal.

use super::item::Item;
use super::system::System;

/// Space below which the check speaks of it, and below which recordings are at risk \[byte\].
const LITTLE: u64 = 10_000_000_000;
const LEAST: u64 = 1_000_000_000;

pub(super) fn items(system: &dyn System) -> Vec<Item> {
    vec![folder(system), space(system), terminal(system)]
}

fn folder(system: &dyn System) -> Item {
    const NAME: &str = "present folder";
    if system.is_writable() {
        return Item::ok(NAME, "files can be created");
    }
    Item::problem(NAME, "files cannot be created").affecting(
        "recordings and reports, which are written here unless --out names a folder",
        "cd to a folder of yours, or add --out DIR or --no-record",
    )
}

fn space(system: &dyn System) -> Item {
    const NAME: &str = "space for recordings";
    let Some(free) = system.free_space() else {
        return Item::notice(NAME, "the system does not say").affecting(
            "long runs may fill the disk",
            "look at its free space yourself",
        );
    };
    let found = format!("{:.1} GB", free as f64 / 1e9);
    let item = match free {
        free if free < LEAST => Item::problem(NAME, found),
        free if free < LITTLE => Item::notice(NAME, found),
        _ => return Item::ok(NAME, found),
    };
    item.affecting(
        "recordings of long runs: a run whose disk is full ends with an error",
        "delete recordings, or add --out DIR on another disk or --no-record",
    )
}

fn terminal(system: &dyn System) -> Item {
    const NAME: &str = "terminal";
    if !system.is_terminal() {
        return Item::ok(NAME, "none: output without colours");
    }
    let language = ["LC_ALL", "LC_CTYPE", "LANG"];
    let language = language.iter().find_map(|name| system.variable(name));
    let language = language.unwrap_or_else(|| "C".to_owned());
    let plain = language.to_lowercase().replace('-', "");
    if !plain.contains("utf8") && system.is_linux() {
        let finding = format!("locale {language}, not UTF-8");
        return Item::notice(NAME, finding).affecting(
            "signs such as ✓, ≤ and ° may be shown wrong",
            "export LC_CTYPE=C.UTF-8",
        );
    }
    let colours = match system.variable("NO_COLOR") {
        Some(_) => "without colours (NO_COLOR)",
        None => "with colours",
    };
    Item::ok(NAME, format!("UTF-8, {colours}"))
}
