use proptest::prelude::*;
use twinrig_campaign::sweep::{DesignKind, SweepSpec};

use super::spec;

/// A specification with the example of a key.
fn with_example(table: &str, name: &str, example: &str) -> String {
    let dimension = "[[dimension]]\nkey = 'seed'\nfrom = 1\nto = 9\n";
    let share = "[[share]]\nof = 'verdict'\n";
    let random = "design = 'random'\npoints = 5\n";
    match (table, name) {
        ("top level", "points") => format!("design = 'random'\n{example}\n{dimension}"),
        ("top level", "trajectories" | "levels" | "measures") => {
            let trajectories = ["trajectories = 2\n", ""][usize::from(name == "trajectories")];
            let dimension = "[[dimension]]\nkey = 'a'\nfrom = 1\nto = 2\n";
            format!("design = 'morris'\n{trajectories}{example}\n{dimension}")
        }
        ("top level", "assumed") => format!("{random}{example}\n{dimension}"),
        ("top level", "design" | "seed") => {
            let random = if name == "seed" {
                random
            } else {
                "points = 5\n"
            };
            format!("{random}{example}\n{dimension}")
        }
        ("top level", "dimension") => example.to_owned(),
        ("top level", _) => format!("{example}\n{dimension}"),
        ("[[dimension]]", "key") => format!("[[dimension]]\n{example}\nvalues = [1]"),
        ("[[dimension]]", "values") => format!("[[dimension]]\nkey = 'a'\n{example}"),
        ("[[dimension]]", "from") => {
            format!("[[dimension]]\nkey = 'a'\n{example}\nto = '3 m'\ncount = 2")
        }
        ("[[dimension]]", "to") => {
            format!("[[dimension]]\nkey = 'a'\nfrom = '1 m'\n{example}\ncount = 2")
        }
        ("[[dimension]]", "count") => {
            format!("[[dimension]]\nkey = 'a'\nfrom = 1\nto = 2\n{example}")
        }
        ("[[dimension]]", _) => {
            format!("{random}[[dimension]]\nkey = 'a'\nfrom = 1\nto = 2\n{example}")
        }
        (_, "of") => format!("{dimension}[[share]]\n{example}\nmin = 0.5"),
        (_, "confidence") => format!("{dimension}{share}min = 0.5\n{example}"),
        _ => format!("{dimension}{share}{example}"),
    }
}

/// The reader and the declarations have the same keys.
#[test]
fn every_declared_key_is_read_and_no_other() {
    for table in SweepSpec::tables() {
        for key in table.keys {
            let text = with_example(table.name, key.name, key.example);
            let read = spec(&text).map(drop);
            assert_eq!(read, Ok(()), "{text}");
            let wrong = key.example.replacen(key.name, "unheard", 1);
            let text = with_example(table.name, key.name, &wrong);
            let error = spec(&text).unwrap_err();
            assert!(error.contains("unknown key `unheard`"), "{error}");
        }
    }
    // An unknown key lists all known ones of its table.
    let error = spec("unheard = 1\n[[dimension]]\nunheard = 1\n[[share]]\nunheard = 1");
    let error = error.unwrap_err();
    for key in SweepSpec::tables().iter().flat_map(|table| &table.keys) {
        let listed = error.contains(key.name) || key.name == "confidence";
        assert!(listed, "{}: {error}", key.name);
    }
}

#[test]
fn mistakes_are_reported_at_their_place() {
    let dimension = "[[dimension]]\nkey = 'a'\n";
    for (text, message) in [
        (
            "design = 'gird'\n[[dimension]]\nkey = 'a'\nvalues = [1]".to_owned(),
            "did you mean `grid`?",
        ),
        ("dimension = []".to_owned(), "there is no dimension"),
        (dimension.to_owned(), "the dimension has no values"),
        (
            format!("{dimension}values = [1]\nfrom = 2"),
            "`from` has no meaning beside `values`",
        ),
        (
            format!("{dimension}values = ['1 m', '1 m']"),
            "\"1 m\" is listed twice",
        ),
        (
            format!("{dimension}from = '1 m'\nto = '2 Hz'\ncount = 2"),
            "`2 Hz` is a frequency; expected a length",
        ),
        (
            format!("{dimension}from = 2\nto = 2\ncount = 2"),
            "`to` has to be above `from`",
        ),
        (format!("{dimension}from = 1\nto = 2"), "`count` is missing"),
        (
            format!("design = 'random'\npoints = 2\n{dimension}from = 1\nto = 2\ncount = 2"),
            "`points` counts the draws",
        ),
        (
            format!("design = 'random'\n{dimension}from = 1\nto = 2"),
            "`points` is missing",
        ),
        (
            format!("points = 3\n{dimension}values = [1]"),
            "a grid has no `points`",
        ),
        (
            format!("{dimension}from = 0\nto = 2\ncount = 2\nscale = 'logarithmic'"),
            "a logarithmic scale has positive values only",
        ),
        (
            format!("{dimension}values = [1]\n[[dimension]]\nkey = 'a.b'\nvalues = [1]"),
            "`a.b` is set by the dimension `a` already",
        ),
        (
            format!("{dimension}values = [1]\n[[share]]\nof = 'verdict'"),
            "the share has no bound",
        ),
        (
            format!("{dimension}values = [1]\n[[share]]\nof = 'verdict'\nmin = '120 %'"),
            "it must be at least 0, at most 1",
        ),
        (
            format!("{dimension}values = [1]\n[[share]]\nof = 'verdict'\nmin = '100 %'"),
            "no number of runs shows a `min` of 100.0 %",
        ),
        (
            format!("{dimension}values = [1]\n[[share]]\nof = 'verdict'\nmax = 0"),
            "no number of runs shows a `max` of 0.0 %",
        ),
        (
            "[[dimension]]\nkey = 'seed'\nfrom = 0\nto = 1000000".to_owned(),
            "the grid has more than 1000000 points",
        ),
    ] {
        let error = spec(&text).unwrap_err();
        assert!(error.contains(message), "{text}\n{error}");
        assert!(error.contains("--> spec.toml:"), "{error}");
    }
}

#[test]
fn settings_of_all_runs_have_dotted_keys() {
    let spec = spec(
        "name = 'n'\n[set]\nduration = '7 s'\nplant = { step = '1 ms' }\na.b.c = [1, 2]\n\
         'x.y' = true\n[[dimension]]\nkey = 'seed'\nvalues = [3]",
    )
    .unwrap();
    let set = |key: &str, value: &str| (key.to_owned(), value.to_owned());
    assert_eq!(
        spec.set,
        [
            set("duration", "\"7 s\""),
            set("plant.step", "\"1 ms\""),
            set("a.b.c", "[1, 2]"),
            set("x.y", "true"),
        ]
    );
    assert_eq!(
        (spec.design.kind, spec.design.points),
        (DesignKind::Grid, 1)
    );
}

#[test]
fn specifications_of_the_repository_are_valid() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/sweeps");
    let mut count = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let read = spec(&std::fs::read_to_string(&path).unwrap());
        assert!(
            read.is_ok_and(|read| !read.shares.is_empty()),
            "{}",
            path.display()
        );
        count += 1;
    }
    assert!(count >= 2);
}

/// Words of specifications, and values that none of them expects.
fn word() -> impl Strategy<Value = String> {
    let tables = SweepSpec::tables().into_iter();
    let keys = tables.flat_map(|table| table.keys);
    let keys = keys.flat_map(|key| [key.name, key.example]);
    let keys: Vec<&'static str> = keys.collect();
    prop_oneof![
        prop::sample::select(keys).prop_map(str::to_owned),
        prop::sample::select(vec![
            "\n[[dimension]]\n",
            "\n[[share]]\n",
            "\n[set]\n",
            " = ",
            "\n",
            "[",
            "]",
            "{",
            "}",
            "''",
            "'1e308 m'",
            "-1e308",
            "1e308",
            "nan",
            "inf",
            "18446744073709551615",
            "-1",
            "0",
            "'1 ns'",
        ])
        .prop_map(str::to_owned),
        "[a-z0-9.'\"=\\[\\]{}, \n]{0,6}",
    ]
}

proptest! {
    /// No text is a panic, and the points of a valid one are as many as it says.
    #[test]
    fn any_text_is_a_specification_or_an_error(
        words in prop::collection::vec(word(), 0..12), ends: bool, design in 0..4_usize,
    ) {
        let design = ["", "design = 'morris'\ntrajectories = 3\n", "design = 'random'\npoints = 3\n", "design = 'latin-hypercube'\npoints = 4\n"][design];
        let end = "\n[[dimension]]\nkey = 'seed'\nfrom = 1\nto = 3\n";
        let text = format!("{design}{}{}", words.concat(), if ends { end } else { "" });
        if let Ok(spec) = spec(&text) {
            prop_assert_eq!(spec.points().len(), spec.design.points);
        }
    }

    /// Ends of any size.
    #[test]
    fn draws_are_within_the_interval(from: f64, to: f64, lhs: bool, logarithmic: bool) {
        let design = if lhs { "latin-hypercube" } else { "random" };
        let scale = if logarithmic { "logarithmic" } else { "linear" };
        let text = format!(
            "design = '{design}'\npoints = 20\n[[dimension]]\nkey = 'a'\n\
             from = {from:e}\nto = {to:e}\nscale = '{scale}'"
        );
        if let Ok(spec) = spec(&text) {
            for point in spec.points() {
                let number = point[0].number.unwrap();
                prop_assert!((from..=to).contains(&number), "{number} of {from} to {to}");
            }
        }
    }
}

#[test]
fn all_mistakes_are_reported_at_once() {
    let text = "points = 3\nseed = 2\n[set]\na = [\n1]\nb = [\n2]\n\
                [[dimension]]\nkey = 'a'\nfrom = 1\nto = 2\ncount = 1\nscale = 'log'\nwhole = 3\n\
                [[dimension]]\nkey = 'b'\nvalues = [1, 1]\ncount = 4\n\
                [[share]]\nof = 'verdict'";
    let error = spec(text).unwrap_err();
    for message in [
        "a grid has no `points`",
        "a grid has no `seed`",
        "`count` is 1",
        "`log` is not a valid `scale`",
        "`whole` is a whole number; expected true or false",
        "1 is listed twice",
        "`count` has no meaning beside `values`",
        "the share has no bound",
    ] {
        assert!(error.contains(message), "{message}: {error}");
    }
    assert_eq!(
        error.matches("a value of a setting is one line").count(),
        2,
        "{error}"
    );
    assert!(!error.contains("unknown key"), "{error}");
}

#[test]
fn values_of_decimal_steps_are_decimal() {
    let spec = spec("[[dimension]]\nkey = 'a'\nfrom = '2.1 Hz'\nto = '3 Hz'\ncount = 10").unwrap();
    let shown: Vec<String> = spec
        .points()
        .iter()
        .map(|it| it[0].shown().to_owned())
        .collect();
    let expected: Vec<String> = (21..=30)
        .map(|n| format!("{} Hz", f64::from(n) / 10.0))
        .collect();
    assert_eq!(shown, expected);
}
