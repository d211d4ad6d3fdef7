//! Serial ports: rights, latency timers.

use super::item::Item;
use super::system::System;

/// Latency timers of USB serial chips.
const TIMERS: &str = "/sys/bus/usb-serial/devices";

pub(super) fn items(system: &dyn System) -> Vec<Item> {
    let names = system.names("/dev").into_iter();
    let is_port = |name: &String| name.starts_with("ttyUSB") || name.starts_with("ttyACM");
    let ports: Vec<_> = names.filter(is_port).collect();
    if ports.is_empty() {
        return vec![Item::ok(
            "serial ports",
            "none at USB; `twin serve` emulates them",
        )];
    }
    ports
        .iter()
        .flat_map(|port| [Some(rights(system, port)), timer(system, port)])
        .flatten()
        .collect()
}

fn rights(system: &dyn System, port: &str) -> Item {
    let path = format!("/dev/{port}");
    let access = system.access(&path);
    if access.is_granted {
        return Item::ok(path, "may be read and written");
    }
    let affects = "runs at this port: `twin run --port BUS=DEVICE`";
    match access.group.as_deref() {
        // The group of a port that only root may use.
        None | Some("root") => Item::problem(&path, "may not be read and written")
            .affecting(affects, format!("sudo chmod a+rw {path}")),
        Some(group) => {
            let finding = format!("may not be read and written; its group {group} may");
            let remedy = format!("sudo usermod -aG {group} $USER, then log in again");
            Item::problem(path, finding).affecting(affects, remedy)
        }
    }
}

/// Returns an item for a port whose chip has a latency timer.
fn timer(system: &dyn System, port: &str) -> Option<Item> {
    let file = format!("{TIMERS}/{port}/latency_timer");
    let text = system.text(&file)?;
    let name = format!("latency timer of {port}");
    let Ok(timer) = text.parse::<u32>() else {
        let item = Item::notice(name, format!("`{text}` is not a number"));
        return Some(item.affecting("the delay of short answers", format!("cat {file}")));
    };
    Some(if timer <= 1 {
        Item::ok(name, format!("{timer} ms"))
    } else {
        Item::notice(name, format!("{timer} ms")).affecting(
            "answers that do not fill a packet of USB arrive later by that time",
            format!("echo 1 | sudo tee {file}"),
        )
    })
}
