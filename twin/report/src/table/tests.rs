//! Tables as text, on pages and in Markdown.

use super::*;
use crate::text::style::{GREEN, RED};

fn table() -> Table {
    let mut table = Table::new([
        Column::label("run"),
        Column::number("begins").in_unit("s").with_places(2),
        Column::number("error").in_unit("m"),
        Column::number("held").only_on_pages(),
        Column::reason().only_on_pages(),
    ]);
    let bad = Cell::from(1.3e-7).with_tone(Tone::Bad);
    let begins = Cell::from(1.5).with_detail("± <2>");
    table.row(["a | b*".into(), begins, bad, Cell::share(0.825)]);
    table.begin_group();
    let [none, nothing, never] = [(); 3].map(|()| Cell::empty());
    table.row(["<c>".into(), none, nothing, never, "it fell".into()]);
    table.set_tone(Tone::Bad);
    table
}

#[test]
fn text_has_units_in_its_cells_and_no_row_without_values() {
    let lines = table().grid().lines(0);
    let marks = |line: &String| {
        let text = anstream::adapter::strip_str(line).to_string();
        text.chars().filter(|c| !c.is_control()).collect::<String>()
    };
    let lines: Vec<String> = lines.iter().map(marks).collect();
    assert_eq!(lines, ["run     begins   error", "a | b*  1.50 s  130 nm"]);
}

#[test]
fn tone_of_a_row_is_that_of_its_plain_cells() {
    let mut table = Table::new([Column::label("run"), Column::text("gait")]);
    table.row(["one".into(), Cell::from("trot").with_tone(Tone::Good)]);
    table.set_tone(Tone::Bad);
    let line = &table.grid().lines(0)[1];
    let styled = |style, text| crate::text::style::styled(style, text);
    assert!(line.contains(&styled(RED, "one")), "{line:?}");
    assert!(line.contains(&styled(GREEN, "trot")), "{line:?}");
}

#[test]
fn page_has_units_in_its_head_and_escapes_its_cells() {
    let html = table().html();
    for expected in [
        "<th class=\"n\">begins [s]</th><th class=\"n\">error</th>",
        "<tr class=\"first\"><td><b>a | b*</b></td>",
        "<td class=\"n\">1.50<span class=\"wrap soft\">± &lt;2&gt;</span></td>",
        "<td class=\"n\"><b class=\"bad\">130 nm</b></td>",
        "<td class=\"n\">82.5 %</td>",
        "<tr class=\"bad\"><td><b>&lt;c&gt;</b></td>",
        "<span class=\"why\">it fell</span>",
    ] {
        assert!(html.contains(expected), "no {expected} in\n{html}");
    }
}

#[test]
fn markdown_escapes_its_marks_and_emphasizes_failures() {
    let mut lines = table()
        .markdown()
        .lines()
        .map(str::to_owned)
        .collect::<Vec<_>>();
    lines.remove(1);
    assert_eq!(
        lines,
        [
            "| run | begins [s] | error | held | why |",
            r"| a \| b\* | 1.50 (± <2>) | **130 nm** | 82.5 % |  |",
            "| <c> |  |  |  | it fell |"
        ]
    );
}

#[test]
fn links_are_links_on_pages_and_their_text_elsewhere() {
    let mut table = Table::new([Column::text("instant")]);
    table.row([Cell::link("0.41 s", "#t=0.41&x")]);
    assert!(
        table
            .html()
            .contains("<a href=\"#t=0.41&amp;x\">0.41 s</a>")
    );
    assert_eq!(table.markdown(), "| instant |\n|---|\n| 0.41 s |\n");
}
