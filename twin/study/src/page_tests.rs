//! Pages of studies whose rows are made up.

use crate::dominance_tests::{page, row, study};
use crate::factory::MethodSetting;
use crate::number::{method_setting, si};
use crate::row::{Row, Status};

/// Errors of a method of second order at five steps.
fn falling() -> Vec<Row> {
    let steps = [4000, 2000, 1000, 500, 250_u64];
    let row = |micros: u64| {
        let milliseconds = micros as f64 / 1e3;
        row(
            "full",
            micros,
            1e-7 * milliseconds * milliseconds,
            1.0 / milliseconds,
        )
    };
    steps.map(row).into()
}

/// The pictures of a page.
fn pictures(page: &str) -> Vec<&str> {
    let pictures = page.split("<svg viewBox").skip(1);
    let pictures = pictures.filter_map(|rest| rest.split("</svg>").next());
    pictures
        .filter(|picture| picture.contains("role=\"img\""))
        .collect()
}

/// How many points each line of a picture has.
fn lines(picture: &str) -> Vec<usize> {
    let lines = picture.split("<polyline points=\"").skip(1);
    let lines = lines.filter_map(|rest| rest.split('"').next());
    lines.map(|points| points.split(' ').count()).collect()
}

#[test]
fn no_line_is_drawn_across_a_run_that_failed() {
    let whole = page(&study(falling()));
    let drawn: Vec<Vec<usize>> = pictures(&whole).into_iter().map(lines).collect();
    assert_eq!(drawn, [[5], [5]], "error over run time, error over step");
    let mut rows = falling();
    rows[2] = rows[2].clone().ended(Status::Failed, "it snapped");
    let broken = page(&study(rows));
    let drawn: Vec<Vec<usize>> = pictures(&broken).into_iter().map(lines).collect();
    assert_eq!(drawn, [[2, 2], [2, 2]]);
}

#[test]
fn a_run_that_contradicts_its_neighbours_is_marked_in_rows_and_pictures() {
    let mut sound = study(falling());
    sound.mark_contradictions();
    assert!(
        sound
            .rows
            .iter()
            .all(|row| !row.contradicts && row.why.is_none())
    );
    assert!(!page(&sound).contains("contradicts"));
    let mut rows = falling();
    rows[3].error_rms_m = Some(0.18);
    let mut odd = study(rows);
    odd.mark_contradictions();
    let marked: Vec<bool> = odd.rows.iter().map(|row| row.contradicts).collect();
    assert_eq!(marked, [false, false, false, true, false]);
    let why = odd.rows[3].why.as_deref().unwrap();
    assert!(
        why.starts_with("contradicts the settings next to it, which have 100 nm and "),
        "{why}"
    );
    let page = page(&odd);
    for picture in pictures(&page) {
        assert_eq!(picture.matches("class=\"doubtful\"").count(), 1);
    }
    assert!(page.contains(why), "the table of all runs says it");
}

/// Of the plants that it is about, and at the step that the tables show.
#[test]
fn the_row_of_the_headline_has_a_card_and_is_in_the_table() {
    let mut rows = falling();
    // Closer and faster, by a model that leaves out what the headline is about.
    rows.push(row("other", 2000, 1e-9, 0.01));
    let mut adaptive = row("full", 1, 2e-9, 0.02);
    (adaptive.step_s, adaptive.tolerance) = (None, MethodSetting::Tolerance(1e-8).tolerance());
    let foremost = |rows: &[Row]| {
        let study = study(rows.to_vec());
        let row = study.foremost().unwrap().row.clone();
        let name = format!(
            "{}, {}",
            row.line().name(),
            method_setting(row.step_s, row.tolerance)
        );
        let (page, error) = (page(&study), si(row.error_rms_m.unwrap(), "m"));
        let headline = study.headline();
        assert!(
            headline.contains(&row.line().name()) && headline.contains(&error),
            "{headline}"
        );
        let cards = page.split("<div class=\"cards\">").nth(1).unwrap();
        let cards = cards.split("<h2>").next().unwrap();
        assert!(
            cards.contains(&name) && cards.contains(&error),
            "{name}: {cards}"
        );
        assert!(!cards.contains("other"), "{cards}");
        let table = page.split("side by side</h2>").nth(1).unwrap();
        let table = table.split("</table>").next().unwrap();
        assert!(table.contains(&error), "{error}: {table}");
        name
    };
    assert_eq!(foremost(&rows), "full euler, 2 ms");
    rows.push(adaptive);
    assert_eq!(
        foremost(&rows),
        "full euler, 2 ms",
        "a step of its own is no better than the usual one"
    );
    // None comes within the aim at that step: the one that chooses its steps does.
    rows[1].error_rms_m = Some(1e-5);
    assert_eq!(foremost(&rows), "full euler, adaptive, tolerance 10⁻⁸");
    rows.pop();
    assert_eq!(foremost(&rows), "full euler, 2 ms", "the nearest");
}
