//! Duels whose outcome is known because their rows are made up.

use twinrig_kernel::SimDuration;

use crate::dominance::{Comparison, Dominance};
use crate::factory::{MethodSetting, Scales, Variant};
use crate::machine::Machine;
use crate::reference::{CheckNote, ReferenceNote};
use crate::row::{Row, RowKind, Status};
use crate::study::{Study, StudyKind};

/// A run of `plant` with steps of so many microseconds, its error \[m\] and its run time over simulated time.
pub(crate) fn row(plant: &str, micros: u64, error: f64, cost: f64) -> Row {
    let variant = Variant {
        plant: plant.to_owned(),
        method: "euler".to_owned(),
        setting: MethodSetting::Step(SimDuration::from_micros(micros)),
        scales: Scales::AS_IS,
    };
    let mut row = Row::new(RowKind::Integration, &variant);
    row.error_rms_m = Some(error);
    row.steps = Some(150);
    row.events_expected = Some(57);
    row.note_time(cost, 1.0, 1);
    row
}

fn note(plant: &str, of_plant: Option<&str>) -> ReferenceNote {
    ReferenceNote {
        of_plant: of_plant.map(str::to_owned),
        method: Some("fine".to_owned()),
        check: Some(CheckNote {
            method: "other".to_owned(),
            step_s: None,
            tolerance: None,
            independent: true,
            disagreement_rms_m: 1e-8,
            disagreement_max_m: 1e-8,
        }),
        ..ReferenceNote::missing(plant, String::new())
    }
}

/// Of a plant `full` and an `engine` that solves its model.
pub(crate) fn study(rows: Vec<Row>) -> Study {
    Study {
        kind: StudyKind::Precision,
        scenario: "made up".to_owned(),
        file: "made-up.toml".to_owned(),
        scene_s: 1.0,
        simulated_s: 1.0,
        grid_s: 0.01,
        commanded: false,
        ground: false,
        budget_s: 1.0,
        massive: vec!["full".to_owned(), "engine".to_owned()],
        solves: vec![("engine".to_owned(), "full".to_owned())],
        abouts: Vec::new(),
        references: vec![note("full", None), note("engine", Some("full"))],
        rows,
        footsteps: Vec::new(),
        transports: Vec::new(),
        criteria: Vec::new(),
        left_out: Vec::new(),
        panics: Vec::new(),
    }
}

pub(crate) fn page(study: &Study) -> String {
    let machine = Machine {
        cpu: String::new(),
        cores: 1,
        load: None,
        system: String::new(),
        build: String::new(),
    };
    crate::html::html(study, &machine, "")
}

fn only(study: &Study) -> Dominance {
    let mut all = study.dominances();
    assert_eq!(all.len(), 1);
    all.remove(0)
}

#[test]
fn the_fastest_that_is_no_further_off_and_the_closest_that_is_no_slower_are_found() {
    let study = study(vec![
        row("full", 4000, 1e-3, 1.0),
        row("full", 2000, 1e-5, 2.0),
        row("full", 1000, 1e-7, 4.0),
        row("engine", 2000, 1e-3, 8.0),
        row("engine", 1000, 5e-4, 16.0),
    ]);
    let found = only(&study);
    assert_eq!(
        (&*found.of, &found.over[..]),
        ("full", &["engine".to_owned()][..])
    );
    let [coarse, fine] = &found.settings[..] else {
        panic!("{found:?}");
    };
    let steps = |comparison: &Comparison| {
        let rivals = [&comparison.no_greater_error, &comparison.no_more_time];
        rivals.map(|rival| rival.as_ref().and_then(|rival| rival.step_s))
    };
    // An equal error is no greater one.
    assert_eq!(steps(coarse), [Some(4e-3), Some(1e-3)]);
    assert_eq!(steps(fine), [Some(2e-3), Some(1e-3)]);
    let rival = fine.no_greater_error.as_ref().unwrap();
    assert!((rival.times_less_time - 8.0).abs() < 1e-12);
    assert!((rival.times_less_error - 50.0).abs() < 1e-9);
    assert_eq!(found.behind().count(), 0);
    assert_eq!(found.range("engine", None), Some((8.0, 8.0)));
    let headline = study.headline();
    assert!(
        headline.contains("ahead at all of engine's 2 settings"),
        "{headline}"
    );
    assert!(!page(&study).contains("is not ahead"));
}

#[test]
fn where_the_plant_is_not_ahead_the_page_shows_it_with_what_was_counted() {
    let mut looking = row("full", 1000, 1e-5, 4.0);
    looking.events = Some(57);
    let study = study(vec![
        looking,
        row("engine", 5000, 2e-5, 3.0),
        row("engine", 2000, 1e-6, 9.0),
        row("engine", 1000, 2e-5, 40.0),
    ]);
    let found = only(&study);
    let behind: Vec<Option<f64>> = found.behind().map(|comparison| comparison.step_s).collect();
    // One that is faster at no greater error, and one that is closer than anything.
    assert_eq!(behind, [Some(5e-3), Some(2e-3)]);
    let headline = study.headline();
    assert!(
        headline.contains("ahead at 1 of engine's 3 settings and not at 2"),
        "{headline}"
    );
    let page = page(&study);
    for told in [
        "Where full is not ahead",
        "engine: 150 steps of 20 ms each, looks for none of 57 events; full: 150 steps of 26.7 ms each, 57 events found",
        "no setting of full comes as close",
    ] {
        assert!(page.contains(told), "{told}: {page}");
    }
}

#[test]
fn no_error_counts_as_less_than_what_is_known_of_the_reference() {
    // Both are below the 10 nm that the reference is known to.
    let study = study(vec![
        row("full", 1000, 9e-9, 1.0),
        row("engine", 1000, 1e-12, 2.0),
    ]);
    let found = only(&study);
    let rival = found.settings[0].no_greater_error.as_ref().unwrap();
    assert_eq!((rival.times_less_error, rival.times_less_time), (1.0, 2.0));
}

#[test]
fn what_failed_or_is_measured_against_itself_is_in_no_duel() {
    let failed = row("engine", 2000, 1e-3, 1.0).ended(Status::Failed, "it fell");
    let mut alone = study(vec![row("full", 1000, 1e-5, 1.0), failed]);
    assert!(alone.dominances().is_empty());
    alone.rows.push(row("engine", 1000, 1e-3, 1.0));
    assert_eq!(alone.dominances().len(), 1);
    alone.references[1].of_plant = None;
    assert!(alone.dominances().is_empty());
}
