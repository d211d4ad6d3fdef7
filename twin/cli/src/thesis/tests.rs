//! Properties of the items, of the recorded results, and of the page that shows them.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use clap::Parser;
use twinrig_experiment::Machine;

use crate::args::Cli;
use crate::progress::Progress;
use crate::thesis::item::{Item, Measurements, Printed};
use crate::thesis::items::items;
use crate::thesis::record::{recorded, recorded_flips};
use crate::thesis::result::{FigureResult, ItemResult, ThesisResult};
use crate::thesis::verdict::{Basis, Input, Rule, Verdict};
use crate::thesis::{page, run};
use twinrig_rig::registry::Registry;

/// Command that writes the record.
const HINT: &str = "run `twin thesis --all --json > docs/thesis.json` in release";
/// Command that renews the texts of the record, and the page.
const UPDATE: &str = "run UPDATE_DOCS=1 cargo test -p twinrig --lib thesis";
/// Run time above which items are not repeated by a test, which is not optimised \[s\].
const SHORT_S: f64 = 6.0;
/// Greatest relative difference of a repeated figure: other changes of the program may move the
/// last bits of a run, and the page shows four digits.
const SAME: f64 = 1e-6;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

#[test]
fn every_figure_has_a_place_a_rule_and_the_reason_for_it() {
    let mut ids = BTreeSet::new();
    for item in items() {
        let is_allowed = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
        assert!(
            item.id.chars().all(is_allowed) && ids.insert(item.id),
            "{}",
            item.id
        );
        assert!(
            !item.figures.is_empty() && !item.place.is_empty(),
            "{}",
            item.id
        );
        let mut keys = BTreeSet::new();
        for figure in item.figures {
            let name = format!("{}, {}", item.id, figure.quantity);
            assert!(keys.insert((figure.key, figure.place)), "{name}: twice");
            assert!(
                !figure.place.is_empty() && !figure.quantity.is_empty(),
                "{name}"
            );
            if figure.rule == Rule::NotRun {
                assert!(!figure.remark.is_empty(), "{name}: why was it not run?");
            } else {
                assert!(!figure.tolerance.is_empty(), "{name}: why this tolerance?");
                let accepted = figure.rule.accepted(figure.printed_value());
                let [least, most] = accepted.unwrap_or_else(|| panic!("{name}: no rule"));
                assert!(least <= most, "{name}");
                // What is printed reproduces itself.
                if let Printed::Value(value) = figure.printed {
                    assert!((least..=most).contains(&value), "{name}");
                }
            }
        }
    }
}

/// Each figure has one origin, whose inputs are those of its basis.
#[test]
fn every_figure_names_its_inputs_and_what_was_free_to_differ() {
    for item in items() {
        for figure in item.figures {
            let name = format!("{}, {}", item.id, figure.quantity);
            let Some(source) = item.source(figure.key) else {
                assert_eq!(figure.rule, Rule::NotRun, "{name}: no source");
                continue;
            };
            let has = |is: fn(&Input) -> bool| source.inputs.iter().any(is);
            let is_fitted = has(|input| matches!(input, Input::Fitted(_)));
            let is_free = has(|input| matches!(input, Input::Free(_)));
            match source.basis {
                Basis::Arithmetic => assert!(!is_fitted && !is_free, "{name}"),
                Basis::Given => assert!(!is_free && !source.inputs.is_empty(), "{name}"),
                Basis::Outcome | Basis::Substitute => assert!(is_free, "{name}"),
            }
        }
        for key in item.sources.iter().flat_map(|source| source.keys) {
            let mut figures = item.figures.iter();
            assert!(
                figures.any(|figure| figure.key == *key),
                "{}: {key}",
                item.id
            );
        }
    }
}

#[test]
fn commands_of_items_are_valid() {
    for command in items().flat_map(|item| item.commands) {
        let Some(words) = command.strip_prefix("twin ") else {
            assert!(command.starts_with("cargo test "), "{command}");
            continue;
        };
        let words = words.split(' ');
        Cli::try_parse_from(std::iter::once("twin").chain(words.clone())).unwrap();
        for file in words.filter(|word| word.contains('/')) {
            assert!(root().join(file).is_file(), "{command}");
        }
    }
}

/// Returns the result of an item of which nothing was observed.
fn unobserved(item: &Item) -> ItemResult {
    ItemResult::of(item, &Measurements::default())
}

fn result(items: Vec<ItemResult>) -> ThesisResult {
    ThesisResult {
        cpu: String::new(),
        build: String::new(),
        items,
    }
}

#[test]
fn item_of_which_nothing_was_observed_departs_from_every_record() {
    for item in items() {
        let judged = |figure: &&FigureResult| figure.verdict != Verdict::NotRun;
        let found = result(vec![unobserved(item)]);
        let count = found.items[0].figures.iter().filter(judged).count();
        let departures = found.departures(Some(&found));
        assert_eq!(departures.len(), count, "{departures:?}");
    }
}

#[test]
fn verdict_other_than_the_recorded_one_is_a_departure() {
    let item = items().find(|item| item.id == "fig-2-9").unwrap();
    let of = |stiffness: f64| {
        let mut measured = Measurements::default();
        measured.set("closed", stiffness);
        result(vec![ItemResult::of(item, &measured)])
    };
    let record = of(253.0);
    // The ratio of printed stiffnesses is not measured here.
    let unobserved = of(252.0).departures(Some(&record)).len();
    assert_eq!(of(230.0).departures(Some(&record)).len(), unobserved + 1);
    assert_eq!(of(252.0).departures(None).len(), 3);
}

/// Returns the recorded figures with the texts of the declared items.
fn record() -> ThesisResult {
    let record = recorded();
    redeclared(&record.unwrap_or_else(|| panic!("docs/thesis.json is not valid: {HINT}")))
}

/// Returns all items as they are declared, with the figures of `record` and the verdicts on them.
fn redeclared(record: &ThesisResult) -> ThesisResult {
    let flips = recorded_flips().unwrap_or_else(|| panic!("docs/thesis-flips.json is not valid"));
    let item = |item: &'static Item| {
        let known = record.item(item.id);
        let known = known.unwrap_or_else(|| panic!("{} is not recorded: {HINT}", item.id));
        let mut measured = Measurements::default();
        for figure in item.figures {
            let mut same = known.figures.iter().filter(|known| known.key == figure.key);
            measured.add(figure.key, same.next().and_then(|known| known.ours));
        }
        ItemResult::of(item, &measured).with_flips(&flips)
    };
    ThesisResult {
        items: items().map(item).collect(),
        ..record.clone()
    }
}

/// The record has all figures of all items, as they are declared, and their verdicts.
#[test]
fn record_is_that_of_the_declared_items() {
    let record = record();
    for item in &record.items {
        for figure in &item.figures {
            let name = format!("{}, {}", item.id, figure.quantity);
            assert_ne!(figure.verdict, Verdict::Unobserved, "{name}");
            let negative = [Verdict::Contradicted, Verdict::Misprint, Verdict::NotRun];
            assert!(
                !negative.contains(&figure.verdict) || !figure.remark.is_empty(),
                "{name} has no evidence"
            );
        }
    }
    if std::env::var_os("UPDATE_DOCS").is_none() {
        assert!(
            recorded().as_ref() == Some(&record),
            "docs/thesis.json: {UPDATE}"
        );
    }
}

#[test]
#[ignore = "slow"]
fn recorded_figures_are_found_again() {
    let record = record();
    let registry = Registry::standard();
    let short: Vec<&Item> = items().filter(|item| item.run_s <= SHORT_S).collect();
    let scenarios = root().join("scenarios");
    let progress = Progress::new("", false);
    let machine = Machine::here("", "release");
    let found = run::run(
        &registry,
        &short,
        &scenarios,
        Vec::new(),
        &machine,
        progress,
    );
    for item in found.unwrap_or_else(|error| panic!("{error}")).items {
        let known = record.item(&item.id).unwrap();
        for figure in item.figures.iter().filter(|figure| !figure.timing) {
            let [ours, before] = [Some(figure), known.figure(figure)].map(|it| it.unwrap().ours);
            let difference = ours.zip(before).map(|(ours, before)| {
                (ours.value - before.value).abs() / before.value.abs().max(f64::MIN_POSITIVE)
            });
            let same = difference.map_or(ours == before, |difference| difference <= SAME);
            let name = format!("{}, {}", item.id, figure.quantity);
            assert!(same, "{name}: {ours:?}, recorded as {before:?}: {HINT}");
        }
    }
}

/// Texts of items come into the record and onto the page by `UPDATE_DOCS=1`, figures by [`HINT`].
#[test]
fn page_shows_the_record() {
    let record = record();
    let path = root().join("docs/thesis.md");
    let kept = std::fs::read_to_string(&path).unwrap();
    let parts = [page::counts(&record), page::table(&record)];
    let made =
        page::MARKS
            .into_iter()
            .zip(parts)
            .fold(kept.clone(), |page, ((begin, end), part)| {
                let (before, rest) = page.split_once(begin).unwrap();
                let (_, after) = rest.split_once(end).unwrap();
                format!("{before}{begin}{part}{end}{after}")
            });
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(&path, &made).unwrap();
        let json = serde_json::to_string_pretty(&record).unwrap();
        std::fs::write(root().join("docs/thesis.json"), json + "\n").unwrap();
    } else {
        assert!(made == kept, "docs/thesis.md: {UPDATE}");
    }
}
