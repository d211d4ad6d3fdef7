//! Files of benches with mistakes: each is reported at its place.

use twinrig_bench::{BenchFile, BenchSettings};

const LIFT: &str = r#"lift = "12 mm""#;
const TACTILE: &str = include_str!("../../../../benches/tactile.toml");

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

/// A slip of a unit, in each quantity of a bench that has a range.
#[test]
fn quantities_of_no_bench_are_reported() {
    for (from, to) in [
        (r#"base_radius = "20 mm""#, r#"base_radius = "20 m""#),
        (r#"inertia = "100 g·cm²""#, r#"inertia = "100 kg·m²""#),
        (r#"mass = "120 g""#, r#"mass = "120 Mg""#),
        (
            r#"stiffness = "2.34 N/mm""#,
            r#"stiffness = "2.34e-6 N/mm""#,
        ),
        (r#"range = "50 N""#, r#"range = "50e6 N""#),
        (r#"feedback = "75e3 ohm""#, r#"feedback = "75e12 ohm""#),
        (
            r#"amplifier_time = "100 ms""#,
            r#"amplifier_time = "100 ns""#,
        ),
        (r#"gain = "-0.05 V·s/N""#, r#"gain = "-0.05e9 V·s/N""#),
    ] {
        let problems = problems(from, to);
        let value = to.split('"').nth(1).unwrap();
        assert!(problems.contains(value), "{problems}");
        assert!(
            problems.contains("out of range") || value == "120 Mg",
            "{problems}"
        );
    }
}
