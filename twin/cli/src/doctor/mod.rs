//! Check of the machine: what runs, real boards, real time and builds need of it, and the remedy
//! for what is missing.

mod build;
mod environment;
mod item;
#[cfg(target_os = "linux")]
mod linux;
mod machine;
mod ports;
mod programs;
mod real_time;
mod system;
#[cfg(test)]
mod tests;

use twinrig_rig::registry::Registry;

pub(crate) use item::{Item, State};
pub(crate) use machine::Machine;
pub(crate) use system::System;

/// Returns the findings, in the order of the report.
pub(crate) fn examine(registry: &Registry, system: &dyn System) -> Vec<Item> {
    let mut items = build::items(registry);
    items.extend(programs::items(system));
    if system.is_linux() {
        items.extend(ports::items(system));
        items.extend(real_time::items(system));
    } else {
        let found = format!("not checked on {}", std::env::consts::OS);
        let item = Item::notice("serial ports, real time", found);
        items.push(item.affecting(
            "boards at serial ports and runs in real time, which are made for Linux",
            "run in virtual time, which is the same on every system",
        ));
    }
    items.extend(environment::items(system));
    items
}
