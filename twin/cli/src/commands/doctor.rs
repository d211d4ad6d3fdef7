//! Command `twin doctor`: check of the machine.

use serde::Serialize;

use super::{NEGATIVE, SUCCESS, Terminal};
use crate::args::DoctorArgs;
use crate::doctor::{Item, Machine, State, examine};
use twinrig_report::text::grid::{Cell, Grid, Left};
use twinrig_report::text::style::{DIM, GREEN, RED, YELLOW};
use twinrig_rig::registry::Registry;

#[derive(Serialize)]
struct Examination {
    version: &'static str,
    system: &'static str,
    items: Vec<Item>,
}

pub(super) fn doctor(registry: &Registry, args: &DoctorArgs, terminal: &mut Terminal<'_>) -> u8 {
    let items = examine(registry, &Machine);
    let code = if items.iter().any(Item::is_fatal) {
        NEGATIVE
    } else {
        SUCCESS
    };
    if args.json {
        terminal.print_json(&Examination {
            version: env!("CARGO_PKG_VERSION"),
            system: std::env::consts::OS,
            items,
        });
    } else {
        let mut lines = grid(&items).lines(1);
        lines.push(summary(&items));
        terminal.print(&lines.join("\n"));
    }
    code
}

fn grid(items: &[Item]) -> Grid {
    let mut grid = Grid::new(&[Left, Left, Left]);
    for item in items {
        let mark = match item.state {
            State::Ok => Cell::new("✓", GREEN),
            State::Notice => Cell::new("!", YELLOW),
            State::Problem => Cell::new("✗", RED),
        };
        grid.row([
            mark,
            item.name.as_str().into(),
            item.finding.as_str().into(),
        ]);
        for (title, text) in [("affects", &item.affects), ("remedy", &item.remedy)] {
            if !text.is_empty() {
                let line = format!("{title}: {text}");
                grid.row(["".into(), "".into(), Cell::new(line, DIM)]);
            }
        }
    }
    grid
}

fn summary(items: &[Item]) -> String {
    let count = |state| items.iter().filter(|item| item.state == state).count();
    let (notices, problems) = (count(State::Notice), count(State::Problem));
    let needed = if items.iter().any(Item::is_fatal) {
        "something that this build needs is broken"
    } else {
        "what this build needs is there"
    };
    format!(
        "\n {needed}; {problems} problems, {notices} notices, {} ok",
        count(State::Ok)
    )
}
