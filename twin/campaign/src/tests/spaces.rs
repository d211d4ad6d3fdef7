//! Search spaces: keys, mistakes, and points of a search.

use proptest::prelude::*;
use twinrig_campaign::optimization::{ConstraintChoice, Direction, SearchMethod, SearchSpace};
use twinrig_document::Document;

fn space(text: &str) -> Result<SearchSpace, String> {
    let document = Document::parse("walk.toml", text).map_err(|error| error.to_string())?;
    SearchSpace::read(&document).map_err(|error| error.to_string())
}

const OBJECTIVE: &str = "maximize = 'speed'\n";
const DIMENSION: &str = "[[dimension]]\nkey = 'a'\nfrom = '1 m'\nto = '2 m'\n";

/// A space with the example of a key.
fn with_example(table: &str, name: &str, example: &str) -> String {
    match (table, name) {
        ("top level", "maximize" | "minimize") => format!("{example}\n{DIMENSION}"),
        ("top level", "dimension") => format!("{OBJECTIVE}{example}"),
        ("top level", _) => format!("{OBJECTIVE}{example}\n{DIMENSION}"),
        ("[[case]]", "name") => format!("{OBJECTIVE}{DIMENSION}[[case]]\n{example}"),
        ("[[case]]", _) => format!("{OBJECTIVE}{DIMENSION}[[case]]\nname = 'a'\n{example}"),
        (_, "scale") => format!("{OBJECTIVE}{DIMENSION}{example}"),
        _ => {
            let lines = DIMENSION.lines();
            let lines = lines.map(|line| {
                if line.starts_with(name) {
                    example
                } else {
                    line
                }
            });
            let lines: Vec<&str> = lines.collect();
            // Both bounds in one unit.
            let text = lines
                .join("\n")
                .replace("1 m'", "9 cm'")
                .replace("2 m'", "15 cm'");
            format!("{OBJECTIVE}{text}")
        }
    }
}

/// The reader and the declarations have the same keys.
#[test]
fn every_declared_key_is_read_and_no_other() {
    for table in SearchSpace::tables() {
        for key in table.keys {
            let text = with_example(table.name, key.name, key.example);
            assert_eq!(space(&text).map(drop), Ok(()), "{text}");
            let wrong = key.example.replacen(key.name, "unheard", 1);
            let error = space(&with_example(table.name, key.name, &wrong)).unwrap_err();
            assert!(error.contains("unknown key `unheard`"), "{error}");
        }
    }
}

#[test]
fn space_has_its_defaults() {
    let space = space(&(OBJECTIVE.to_owned() + DIMENSION)).unwrap();
    assert_eq!(
        (space.name.as_str(), space.method),
        ("walk", SearchMethod::CmaEs)
    );
    assert_eq!((space.iterations, space.restarts, space.seed), (100, 0, 1));
    assert_eq!(space.constraints, ConstraintChoice::Named(Vec::new()));
    assert_eq!(
        (space.direction, space.cases.len()),
        (Direction::Maximize, 0)
    );
    // One parameter.
    assert_eq!(space.search().unwrap().ask().unwrap().unwrap().len(), 4);
}

#[test]
fn mistakes_are_reported_with_their_place_and_remedy() {
    for (text, message, help, line) in [
        (DIMENSION.to_owned(), "`maximize` is missing", "", 1),
        (
            format!("{OBJECTIVE}minimize = 'roll'\n{DIMENSION}"),
            "there are both `maximize` and `minimize`",
            "leave one of them out",
            2,
        ),
        (
            format!("{OBJECTIVE}constraints = 'fall'\n{DIMENSION}"),
            "`fall` is neither `all` nor a list of names",
            "write constraints = [\"fall\"]",
            2,
        ),
        (
            format!("{OBJECTIVE}method = 'pso'\nrestarts = 2\n{DIMENSION}"),
            "a particle swarm has no `restarts`",
            "leave it out",
            3,
        ),
        (
            format!("{OBJECTIVE}particles = 3\n{DIMENSION}"),
            "a population of 3 is too small",
            "take more particles",
            2,
        ),
        (
            format!("{OBJECTIVE}[[dimension]]\nkey = 'a'\nvalues = [1, 2]"),
            "a search has no `values`",
            "write `from` and `to`",
            4,
        ),
        (
            format!("{OBJECTIVE}[[dimension]]\nkey = 'seed'\nfrom = 1\nto = 2"),
            "whole numbers are not searched",
            "the seed of all runs is a key of `set`",
            3,
        ),
        (
            format!("{OBJECTIVE}{DIMENSION}scale = 'logarithmic'").replace("1 m", "-1 m"),
            "a logarithmic scale has positive values only",
            "take a linear scale",
            4,
        ),
        (
            format!("{OBJECTIVE}{DIMENSION}[[case]]\nname = 'a'\n[[case]]\nname = 'a'"),
            "there are two cases `a`",
            "rename one of them",
            9,
        ),
        (
            format!("{OBJECTIVE}{DIMENSION}[[case]]\nset = {{ seed = 2 }}"),
            "`name` is missing",
            "",
            6,
        ),
        (
            format!("{OBJECTIVE}{DIMENSION}{DIMENSION}"),
            "`a` is set by the dimension `a` already",
            "one dimension for each key",
            7,
        ),
    ] {
        let error = space(&text).unwrap_err();
        let place = if line == 1 {
            String::new()
        } else {
            format!("walk.toml:{line}:")
        };
        for part in [message, help, &place] {
            assert!(error.contains(part), "{part}\n{error}");
        }
    }
}

proptest! {
    /// Within the bounds, at the bounds exactly, and elsewhere to a millionth of the range.
    #[test]
    fn points_are_at_their_shares_of_the_ranges(share in 0.0..=1.0_f64, logarithmic: bool) {
        let scale = if logarithmic { "scale = 'logarithmic'" } else { "" };
        let (from, to) = (0.012_345_678_9, 4.321);
        let dimension = format!("[[dimension]]\nkey = 'a'\nfrom = '{from} m'\nto = '{to} m'\n{scale}");
        let space = space(&(OBJECTIVE.to_owned() + &dimension)).unwrap();
        let number = |share: f64| space.point(&[share])[0].number.unwrap();
        let (found, expected) = if logarithmic {
            (number(share), from * libm::pow(to / from, share))
        } else {
            (number(share), from + (to - from) * share)
        };
        prop_assert!((from..=to).contains(&found));
        prop_assert!((found - expected).abs() <= 1.01e-6 * (to - from), "{found} {expected}");
        prop_assert_eq!([number(0.0), number(1.0)], [from, to]);
        // The text of a setting has the same number.
        let toml = space.point(&[share])[0].toml.clone();
        let text: f64 = toml.trim_matches('"').trim_end_matches(" m").parse().unwrap();
        prop_assert_eq!(text, found);
    }
}
