//! Files of benches with mistakes: each is reported at its place.

use twinrig_bench::{BenchFile, BenchSettings};

const LIFT: &str = r#"lift = "12 mm""#;
const TACTILE: &str = include_str!("../../../benches/tactile.toml");

/// The problems of the file with one text in place of another.
fn problems(from: &str, to: &str) -> String {
    assert!(TACTILE.contains(from), "{from}");
    let text = TACTILE.replace(from, to);
    let file = BenchFile::parse("tactile.toml", &text).unwrap();
    let error = file.bench(&BenchSettings::default()).unwrap_err();
    error.to_string()
}

#[test]
fn cam_table_that_is_not_periodic_is_reported() {
    let table =
        r#"profile = ["0 mm", "1 mm", "3 mm", "5 mm", "6 mm", "5 mm", "4 mm", "3 mm", "2 mm"]"#;
    insta::assert_snapshot!(problems(LIFT, table));
}

#[test]
fn cam_that_cuts_under_its_roller_is_reported() {
    let lift = |n| if n == 18 { r#""6 mm""# } else { r#""0 mm""# };
    let lifts: Vec<&str> = (0..=36).map(lift).collect();
    let table = format!("profile = [{}]", lifts.join(", "));
    insta::assert_snapshot!(problems(LIFT, &table));
}

#[test]
fn load_beyond_the_reference_cell_is_reported() {
    insta::assert_snapshot!(problems(
        r#"stiffness = "2.34 N/mm""#,
        r#"stiffness = "9.36 N/mm""#
    ));
}

#[test]
fn parameters_of_sensors_are_checked() {
    insta::assert_snapshot!(problems(
        r#"silicone_time = "5 ms""#,
        r#"silicone_time = "100 ms""#
    ));
}
