//! Results for the terminal.

use twinrig_report::number::fixed;
use twinrig_report::table::{self, Column, Table};
use twinrig_report::text::grid::{Cell, Grid, Left};
use twinrig_report::text::style::{BOLD, DIM, styled};

use crate::thesis::flips::Flips;
use crate::thesis::item::Item;
use crate::thesis::result::{ItemResult, ThesisResult};
use crate::thesis::verdict::Verdict;

/// Columns of a paragraph.
const COLUMNS: usize = 96;

/// Formats the list of items.
pub(crate) fn list<'i>(items: impl Iterator<Item = &'i Item>) -> String {
    let mut table = Table::new([
        Column::label("item"),
        Column::text("title"),
        Column::text("place in the thesis"),
        Column::number("run time").in_unit("s").with_places(0),
    ]);
    for item in items {
        let run_s = Some(item.run_s).filter(|run_s| *run_s >= 1.0);
        let [id, title, place] = [item.id, item.title, item.place].map(table::Cell::from);
        table.row([id, title, place, run_s.into()]);
    }
    lines(&table)
}

fn lines(table: &Table) -> String {
    table.grid().lines(0).join("\n")
}

/// Formats the result of one item in full.
pub(crate) fn item(result: &ItemResult) -> String {
    let title = format!("{}  {}", styled(BOLD, &result.id), result.title);
    let mut lines = vec![format!("{title}  {}", styled(DIM, &result.place))];
    for figure in &result.figures {
        lines.push(String::new());
        let place = styled(DIM, &figure.place);
        lines.push(format!("  {}  {place}", figure.quantity));
        let mut grid = Grid::new(&[Left, Left]);
        let name = |name| Cell::new(name, DIM);
        grid.row([name("printed"), figure.printed.clone().into()]);
        grid.row([name("ours"), figure.ours_text().into()]);
        let verdict = figure.verdict;
        grid.row([
            name("verdict"),
            Cell::new(verdict.words(), verdict.tone().style()),
        ]);
        grid.paragraph(name("ground"), &figure.ground().into(), COLUMNS);
        lines.extend(grid.lines(4));
    }
    if !result.commands.is_empty() {
        lines.push(String::new());
        let commands = result.commands.iter();
        lines.extend(commands.map(|command| format!("  {}{command}", styled(DIM, "$ "))));
    }
    lines.join("\n")
}

/// Formats the results of several items as one table.
pub(crate) fn table(result: &ThesisResult) -> String {
    lines(&results(result))
}

/// Returns the table of all results, as the documentation has it, too.
pub(crate) fn results(result: &ThesisResult) -> Table {
    let mut table = Table::new([
        Column::label("item"),
        Column::text("figure"),
        Column::text("printed"),
        Column::text("ours"),
        Column::status("verdict"),
        Column::text("ground").only_on_pages(),
    ]);
    for item in &result.items {
        for (n, figure) in item.figures.iter().enumerate() {
            table.row([
                (n == 0).then(|| table::Cell::code(&item.id)).into(),
                table::Cell::from(&*figure.quantity).with_detail(&figure.place),
                figure.printed.as_str().into(),
                figure.ours_text().into(),
                table::Cell::from(figure.verdict.words()).with_tone(figure.verdict.tone()),
                figure.ground().into(),
            ]);
        }
    }
    table
}

/// Formats the moves that flip verdicts.
pub(crate) fn flips(flips: &Flips) -> String {
    let mut table = Table::new([
        Column::label("item"),
        Column::text("figure"),
        Column::text("verdict"),
        Column::text("flips"),
    ]);
    for item in &flips.items {
        for (n, figure) in item.figures.iter().enumerate() {
            table.row([
                (n == 0).then_some(&*item.id).into(),
                figure.key.as_str().into(),
                figure.verdict.words().into(),
                item.text(&figure.key, &figure.place).into(),
            ]);
        }
    }
    let mut lines = table.grid().lines(0);
    lines.push(String::new());
    for item in &flips.items {
        let [free, set] = item.moved;
        let refused = item.refused;
        let id = &item.id;
        lines.push(format!(
            "  {id}: {free} assumed or fitted and {set} other numbers, {refused} moves refused"
        ));
    }
    lines.join("\n")
}

/// Formats the numbers of verdicts, the items that were not run, and the departures from the
/// record.
pub(crate) fn summary(result: &ThesisResult, skipped: &[&Item], departures: &[String]) -> String {
    let mut grid = Grid::new(&[Left, Left]);
    let mut fact = |name: &str, text: String| {
        grid.paragraph(Cell::new(name, DIM), &text.into(), COLUMNS);
    };
    let counts = Verdict::ALL.into_iter().filter_map(|verdict| {
        let count = result.count(verdict);
        (count > 0).then(|| format!("{count} {}", verdict.words()))
    });
    fact("verdicts", counts.collect::<Vec<_>>().join(", "));
    fact("machine", format!("run times (⏱) are of {}", result.cpu));
    let skipped: Vec<String> = skipped
        .iter()
        .map(|item| format!("{} ({} s)", item.id, fixed(item.run_s, 0)))
        .collect();
    if !skipped.is_empty() {
        fact(
            "skipped",
            format!("{}: run them with --all", skipped.join(", ")),
        );
    }
    for (n, departure) in departures.iter().enumerate() {
        fact(if n == 0 { "departs" } else { "" }, departure.clone());
    }
    grid.lines(2).join("\n")
}
