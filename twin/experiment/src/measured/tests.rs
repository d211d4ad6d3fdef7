use std::cell::Cell;
use std::path::Path;

use serde::Deserialize;
use twinrig_testing::folder::Folder;

use super::*;
use crate::machine::Machine;

/// Result of a part.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Reading {
    value: f64,
    is_cut: bool,
    start: usize,
}

impl Measured for Reading {
    fn is_cut(&self) -> bool {
        self.is_cut
    }

    fn note_start(&mut self, start: usize) {
        self.start = start;
    }
}

fn machine(cpu: &str, load: f64) -> Machine {
    Machine {
        cpu: cpu.to_owned(),
        load: Some(load),
        ..Machine::here("test", "release")
    }
}

fn store(folder: &Path, load: f64) -> PartStore {
    PartStore::open(folder, &[b"study"], &machine("cpu", load)).unwrap()
}

/// Measures parts with these contents, of which those in `cut` are cut, and returns results, number
/// of runs and starts.
fn study(
    store: &mut PartStore,
    scope: &str,
    contents: &[&str],
    cut: &[&str],
) -> (Vec<Reading>, usize, Starts) {
    let incidents = Incidents::default();
    let budget = Budget::new(1000.0, &[(Weight::Run, contents.len())]);
    let mut observer = ();
    let mut measuring = Measuring::kept(&mut observer, store);
    let mut parts = Parts::new(budget, &mut measuring, &incidents, &scope);
    let runs = Cell::new(0);
    let measure = |content: &&str| {
        parts.measure(content, Weight::Run, content, |_| {
            runs.set(runs.get() + 1);
            Reading {
                value: 0.1 + content.len() as f64 / 3.0,
                is_cut: cut.contains(content),
                start: 0,
            }
        })
    };
    let readings: Result<Vec<Reading>, _> = contents.iter().map(measure).collect();
    (readings.unwrap(), runs.get(), parts.finish().unwrap())
}

#[test]
fn parts_of_earlier_starts_are_not_measured_again_and_keep_their_start() {
    let folder = Folder::new("measured-again");
    let (first, runs, starts) = study(&mut store(folder.path(), 0.5), "", &["a", "bb"], &[]);
    assert_eq!((runs, starts.starts.len()), (2, 1));
    let (second, runs, starts) =
        study(&mut store(folder.path(), 2.0), "", &["a", "ccc", "bb"], &[]);
    assert_eq!(runs, 1);
    assert_eq!([&second[0], &second[2]], [&first[0], &first[1]]);
    assert_eq!(second[1].start, 2);
    let expected = [(1, Some(0.5)), (2, Some(2.0))].map(|(start, load)| Start { start, load });
    assert_eq!(starts.starts, expected);
    // The study began with the first of them.
    assert_eq!(starts.machine(&machine("cpu", 2.0)).load, Some(0.5));
    let sentence = "the run times are of 2 starts of the program: 1 (load 0.50), 2 (load 2.00)";
    assert_eq!(starts.sentence().as_deref(), Some(sentence));
    // A start without a measurement is none.
    let (_, runs, starts) = study(&mut store(folder.path(), 3.0), "", &["bb"], &[]);
    assert_eq!((runs, starts.starts), (0, expected[..1].to_vec()));
}

#[test]
fn parts_that_the_budget_cut_are_measured_again_and_their_time_counts() {
    let folder = Folder::new("measured-cut");
    let (_, runs, _) = study(&mut store(folder.path(), 0.0), "", &["a", "bb"], &["bb"]);
    assert_eq!(runs, 2);
    let mut again = store(folder.path(), 0.0);
    let spent_s = again.spent_s(again.key("\"\"", &"bb"));
    assert!(spent_s > 0.0);
    let (readings, runs, _) = study(&mut again, "", &["a", "bb"], &[]);
    assert_eq!((runs, readings[1].start), (1, 2));
    let both_s = again.spent_s(again.key("\"\"", &"bb"));
    assert!(both_s > spent_s, "{both_s} s after {spent_s} s");
}

#[test]
fn time_of_earlier_starts_is_that_of_the_budget() {
    let folder = Folder::new("measured-budget");
    let mut kept = store(folder.path(), 0.0);
    let key = kept.key("()", &"kept");
    let reading = Reading {
        value: 1.0,
        is_cut: false,
        start: 1,
    };
    kept.keep(key, 90.0, Some(&reading)).unwrap();
    let incidents = Incidents::default();
    let budget = Budget::new(100.0, &[(Weight::Run, 2)]);
    let mut observer = ();
    let mut measuring = Measuring::kept(&mut observer, &mut kept);
    let mut parts = Parts::new(budget, &mut measuring, &incidents, &());
    let found = parts.measure("kept", Weight::Run, &"kept", |_| -> Reading {
        unreachable!()
    });
    assert_eq!(found.unwrap(), reading);
    let share = parts.begin("next", Weight::Run).unwrap();
    assert!((9.0..=10.0).contains(&share.seconds), "{} s", share.seconds);
}

#[test]
fn each_thing_that_changes_a_part_changes_its_key() {
    let folder = Folder::new("measured-key");
    let kept = store(folder.path(), 0.0);
    let key = kept.key("scope", &"content");
    assert_eq!(kept.key("scope", &"content"), key);
    assert_ne!(kept.key("scope", &"other"), key);
    assert_ne!(kept.key("other", &"content"), key);
    drop(kept);
    let of = |study: &str, machine: Machine| {
        let store = PartStore::open(folder.path(), &[study.as_bytes()], &machine).unwrap();
        store.key("scope", &"content")
    };
    // The load is that of a start.
    assert_eq!(of("study", machine("cpu", 9.0)), key);
    assert_ne!(of("other", machine("cpu", 0.0)), key);
    assert_ne!(of("study", machine("another cpu", 0.0)), key);
}

#[test]
fn results_of_a_panic_and_numbers_that_json_lacks_are_not_kept() {
    let folder = Folder::new("measured-panic");
    for _ in 0..2 {
        let mut kept = store(folder.path(), 0.0);
        let incidents = Incidents::default();
        let budget = Budget::new(100.0, &[(Weight::Run, 2)]);
        let mut observer = ();
        let mut measuring = Measuring::kept(&mut observer, &mut kept);
        let mut parts = Parts::new(budget, &mut measuring, &incidents, &());
        let runs = Cell::new(0);
        let reading = |value| {
            runs.set(runs.get() + 1);
            Reading {
                value,
                is_cut: false,
                start: 0,
            }
        };
        let panicked = parts.measure("panic", Weight::Run, &"panic", |_| {
            let _: Result<(), String> = incidents.guarded(|| panic!("on purpose"));
            reading(1.0)
        });
        panicked.unwrap();
        let infinite = parts.measure("infinite", Weight::Run, &"infinite", |_| {
            reading(f64::INFINITY)
        });
        infinite.unwrap();
        assert_eq!(runs.get(), 2);
    }
}

#[test]
fn a_line_that_a_killed_process_left_is_measured_again() {
    let folder = Folder::new("measured-torn");
    let (first, ..) = study(&mut store(folder.path(), 0.0), "", &["a", "bb"], &[]);
    let path = folder.path().join("all.jsonl");
    let text = std::fs::read(&path).unwrap();
    std::fs::write(&path, &text[..text.len() - 9]).unwrap();
    let (second, runs, starts) = study(&mut store(folder.path(), 0.0), "", &["a", "bb"], &[]);
    assert_eq!((runs, &second[0]), (1, &first[0]));
    assert_eq!((first[1].start, second[1].start), (1, 2));
    let [note, _] = &*starts.notes else {
        panic!("{:?}", starts.notes);
    };
    assert!(note.contains("1 damaged line"), "{note}");
}

#[test]
fn two_processes_do_not_measure_one_study_at_once() {
    let folder = Folder::new("measured-lock");
    let _open = store(folder.path(), 0.0);
    let other = PartStore::open(folder.path(), &[b"study"], &machine("cpu", 0.0));
    assert!(
        other
            .err()
            .is_some_and(|error| error.to_string().contains("another process"))
    );
}
