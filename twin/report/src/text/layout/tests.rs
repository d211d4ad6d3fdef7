use anstream::adapter::strip_str;
use proptest::prelude::*;

use super::*;
use crate::text::grid::{Cell, Grid};
use crate::text::style::{BOLD, DIM};

fn plain(text: &str) -> String {
    strip_str(text).to_string()
}

fn text_of(rows: &[(String, String, String)]) -> String {
    let mut grid = Grid::new(&[Left, Right, Left]);
    for (name, number, remark) in rows {
        let cells = [(name, BOLD), (number, anstyle::Style::new()), (remark, DIM)];
        grid.row(cells.map(|(text, style)| Cell::new(text.as_str(), style)));
    }
    format!("title\n{}\nend", grid.lines(2).join("\n"))
}

proptest! {
    #[test]
    fn tables_fit_and_lose_no_word(
        rows in proptest::collection::vec(
            ("[a-z]{1,12}( [a-z]{1,12}){0,4}", "[0-9]{1,9}", "([a-z]{1,12} ){0,12}[a-z脚]{1,6}"),
            1..6,
        ),
        columns in 40..120_usize,
    ) {
        let text = text_of(&rows);
        let narrow = laid_out(&text, Some(columns));
        for line in narrow.lines() {
            prop_assert!(width(line) <= columns, "{line:?}");
        }
        let sorted = |text: &str| {
            let mut words: Vec<String> = plain(text).split_whitespace().map(str::to_owned).collect();
            words.sort();
            words
        };
        prop_assert_eq!(sorted(&narrow), sorted(&text));
        // A wide terminal shows what a file has.
        prop_assert_eq!(laid_out(&text, Some(10_000)), laid_out(&text, None));
        prop_assert_eq!(plain(&laid_out(&text, None)), plain(&text));
    }
}

#[test]
fn columns_that_do_not_fit_follow_in_lines_of_their_own() {
    let row = |name: &str, number: &str, remark: &str| {
        (name.to_owned(), number.to_owned(), remark.to_owned())
    };
    let long = "worst: LH at 0.537 of the cycle, expected 0.50";
    let rows = [
        row("stride-to-stride variation", "12345.678", ""),
        row("trots", "0.5", long),
    ];
    let text = plain(&laid_out(&text_of(&rows), Some(44)));
    let expected = "title\n  stride-to-stride variation  12345.678\n  \
                    trots                             0.5\n      \
                    worst: LH at 0.537 of the cycle,\n      expected 0.50\nend";
    assert_eq!(text, expected);
}

#[test]
fn values_that_would_need_many_lines_follow_their_names() {
    let mut grid = Grid::new(&[Left, Left, Right, Right, Right, Left, Right, Right]);
    grid.header(
        "| signal | first, last tenth | | growth per second | at equal times | > 10 % of the range \
         | rms of both",
    );
    let cells = [
        "✗",
        "leg/LF/foot/load",
        "0.0149, 3.03",
        "N",
        "2.77",
        "",
        "11 s after it",
        "12 %",
    ];
    grid.row(cells.map(Cell::from));
    let text = plain(&laid_out(&grid.lines(2).join("\n"), Some(40)));
    let expected = "  ✗  leg/LF/foot/load\n      first, last tenth: 0.0149, 3.03  N\n      \
                    growth per second: 2.77\n      > 10 % of the range: 11 s after it\n      rms of both: 12 %";
    assert_eq!(text, expected);
}

#[test]
fn values_of_two_lines_are_aligned_below_their_names() {
    let mut grid = Grid::new(&[Right; 6]);
    grid.header("one | two | three | four | five | six");
    grid.row(["1234567890"; 6].map(Cell::from));
    let text = plain(&laid_out(&grid.lines(0).join("\n"), Some(40)));
    let line = |[a, b, c]: [&str; 3]| format!("{a:>10}  {b:>10}  {c:>10}\n");
    let values = line(["1234567890"; 3]);
    let names = [["one", "two", "three"], ["four", "five", "six"]].map(line);
    let expected = format!("{}    {}{values}    {values}", names[0], names[1]);
    assert_eq!(text, expected.trim_end());
}

#[test]
fn paragraphs_are_wrapped_anew() {
    let text = "one two three four five six seven eight nine ten eleven twelve thirteen fourteen";
    let lines = |columns| {
        let mut grid = Grid::new(&[Left, Left]);
        grid.paragraph("a".into(), &text.into(), columns);
        plain(&laid_out(&grid.lines(0).join("\n"), Some(40)))
    };
    // Of three lines that are too wide, and of lines that fit.
    assert_eq!(lines(45), lines(37));
}

#[test]
fn words_that_fit_nowhere_are_whole_in_a_line_below() {
    let hash = "3d60c8727d842745".repeat(4);
    let mut grid = Grid::new(&[Left, Left]);
    grid.paragraph(
        "time".into(),
        &"20 s simulated in 0.028 s, 717 × real time".into(),
        30,
    );
    grid.row(["fingerprint".into(), hash.as_str().into()]);
    let text = plain(&laid_out(&grid.lines(2).join("\n"), Some(40)));
    let expected = format!(
        "  time         20 s simulated in\n               0.028 s, 717 × real time\n  \
         fingerprint\n      {hash}"
    );
    assert_eq!(text, expected);
}
