//! Results for the terminal.

use anstyle::Style;

use crate::thesis::flips::Flips;
use crate::thesis::item::Item;
use crate::thesis::result::{FigureResult, ItemResult, ThesisResult};
use crate::thesis::verdict::Verdict;
use twinrig_report::text::grid::{Cell, Grid, Left, Right};
use twinrig_report::text::style::{BOLD, DIM, GREEN, RED, YELLOW, styled};

/// Columns of a paragraph.
const COLUMNS: usize = 96;

fn style(verdict: Verdict) -> Style {
    match verdict {
        Verdict::Reproduced => GREEN,
        Verdict::Consistent | Verdict::Recomputed => Style::new(),
        Verdict::Contradicted | Verdict::Misprint => YELLOW,
        Verdict::NotRun => DIM,
        Verdict::Unobserved => RED,
    }
}

fn verdict(figure: &FigureResult) -> Cell {
    Cell::new(figure.verdict.words(), style(figure.verdict))
}

/// Formats the list of items.
pub(crate) fn list<'i>(items: impl Iterator<Item = &'i Item>) -> String {
    let mut grid = Grid::new(&[Left, Left, Left, Right]);
    grid.header("item | title | place in the thesis | run time");
    for item in items {
        let run = match item.run_s {
            run_s if run_s < 1.0 => String::new(),
            run_s => format!("{run_s:.0} s"),
        };
        let cells = [item.title, item.place].map(Cell::from);
        let [title, place] = cells;
        grid.row([Cell::new(item.id, BOLD), title, place, run.into()]);
    }
    grid.lines(0).join("\n")
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
        grid.row([name("verdict"), verdict(figure)]);
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
    let mut grid = Grid::new(&[Left, Left, Left, Left, Left]);
    grid.header("item | figure | printed | ours | verdict");
    for item in &result.items {
        for (n, figure) in item.figures.iter().enumerate() {
            let id = if n == 0 { item.id.as_str() } else { "" };
            let printed = figure.printed.as_str();
            grid.row([
                Cell::new(id, BOLD),
                figure.quantity.as_str().into(),
                printed.into(),
                figure.ours_text().into(),
                verdict(figure),
            ]);
        }
    }
    grid.lines(0).join("\n")
}

/// Formats the moves that flip verdicts.
pub(crate) fn flips(flips: &Flips) -> String {
    let mut grid = Grid::new(&[Left, Left, Left, Left]);
    grid.header("item | figure | verdict | flips");
    for item in &flips.items {
        for (n, figure) in item.figures.iter().enumerate() {
            let id = if n == 0 { item.id.as_str() } else { "" };
            grid.row([
                Cell::new(id, BOLD),
                figure.key.as_str().into(),
                figure.verdict.words().into(),
                item.text(&figure.key, &figure.place).into(),
            ]);
        }
    }
    let mut lines = grid.lines(0);
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
    fact("machine", result.cpu.clone());
    let skipped: Vec<String> = skipped
        .iter()
        .map(|item| format!("{} ({:.0} s)", item.id, item.run_s))
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
