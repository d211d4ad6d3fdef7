//! Comparisons whose outcome is known because the rows are synthetic.

use twinrig_kernel::SimDuration;
use twinrig_rig::PlantId;
use twinrig_rig::{MethodSetting, Scales, Variant};

use crate::machine::Machine;
use crate::measured::Starts;
use crate::plants::dominance::{Comparison, Dominance};
use crate::plants::reference_note::{CheckNote, ReferenceNote};
use crate::plants::row::{Row, RowKind, Status};
use crate::plants::study::{Study, StudyKind};

/// A run of `plant` with steps of so many microseconds, its error \[m\] and its run time per
/// simulated time.
pub(crate) fn row(plant: &str, micros: u64, error: f64, cost: f64) -> Row {
    let variant = Variant {
        plant: PlantId::new(plant),
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
        ..ReferenceNote::missing(&PlantId::new(plant), String::new())
    }
}

/// A study of a plant `full` and an `engine` that solves its model.
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
        massive: ["full", "engine"].map(PlantId::new).into(),
        solves: vec![(PlantId::new("engine"), "full".to_owned())],
        peers: Vec::new(),
        abouts: Vec::new(),
        references: vec![note("full", None), note("engine", Some("full"))],
        rows,
        footsteps: Vec::new(),
        transports: Vec::new(),
        contacts: Vec::new(),
        ensembles: Vec::new(),
        criteria: Vec::new(),
        left_out: Vec::new(),
        starts: Starts::default(),
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
    study.page(&machine, "").html()
}

fn only(study: &Study) -> Dominance {
    let mut all = study.dominances();
    assert_eq!(all.len(), 1);
    all.remove(0)
}

#[test]
fn fastest_at_equal_error_and_most_accurate_at_equal_time_are_found() {
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
        let competitors = [&comparison.no_greater_error, &comparison.no_more_time];
        competitors.map(|competitor| competitor.as_ref().and_then(|competitor| competitor.step_s))
    };
    // An equal error counts as no greater.
    assert_eq!(steps(coarse), [Some(4e-3), Some(1e-3)]);
    assert_eq!(steps(fine), [Some(2e-3), Some(1e-3)]);
    let competitor = fine.no_greater_error.as_ref().unwrap();
    assert!((competitor.times_less_time - 8.0).abs() < 1e-12);
    assert!((competitor.times_less_error - 50.0).abs() < 1e-9);
    assert_eq!(found.behind().count(), 0);
    assert_eq!(found.range("engine", None), Some((8.0, 8.0)));
    let headline = study.headline();
    assert!(
        headline.contains("ahead at all of engine's 2 best settings"),
        "{headline}"
    );
    assert!(!page(&study).contains("is not ahead"));
}

#[test]
fn headline_compares_with_the_best_settings_of_the_other_plant() {
    let mut alone = row("engine", 2000, 1e-5 * (1.0 + 1e-9), 3.0);
    alone.method = "euler, step only".to_owned();
    let study = study(vec![
        row("full", 2000, 1e-5, 2.0),
        row("full", 5000, 1e-4, 1.0),
        // Equal but for rounding, and slower than its step alone.
        row("engine", 2000, 1e-5, 12.0),
        row("engine", 5000, 1e-4, 40.0),
        alone,
    ]);
    let found = only(&study);
    let best: Vec<&str> = found.best().map(|best| &*best.method).collect();
    assert_eq!(best, ["euler, step only"]);
    assert_eq!(found.range("engine", None), Some((1.5, 1.5)));
    assert_eq!(found.range("engine", Some("euler")), Some((6.0, 40.0)));
    let headline = study.headline();
    let sentence = "At no greater error full takes 1.5 × less run time than engine";
    assert!(headline.contains(sentence), "{headline}");
}

#[test]
fn peers_are_compared_each_against_its_own_reference() {
    let mut study = study(vec![
        row("full", 2000, 1e-5, 2.0),
        row("engine", 2000, 1e-4, 8.0),
    ]);
    study.solves.clear();
    study.references[1].of_plant = None;
    assert!(study.dominances().is_empty());
    study.peers = vec![(PlantId::new("engine"), "full".to_owned())];
    let found = only(&study);
    assert!(found.own_references);
    let headline = study.headline();
    let sentence = "Each against its own reference, at no greater error full takes 4 × less run time than engine";
    assert!(headline.contains(sentence), "{headline}");
    let page = page(&study);
    assert!(page.contains("compared with its own reference"), "{page}");
    // Without errors of its peer there is no comparison.
    study.rows.remove(0);
    assert!(study.dominances().is_empty());
}

#[test]
fn page_lists_settings_where_the_plant_is_not_ahead_with_counts() {
    let mut locating = row("full", 1000, 1e-5, 4.0);
    locating.events = Some(57);
    let study = study(vec![
        locating,
        row("engine", 5000, 2e-5, 3.0),
        row("engine", 2000, 1e-6, 9.0),
        row("engine", 1000, 2e-5, 40.0),
    ]);
    let found = only(&study);
    let behind: Vec<Option<f64>> = found.behind().map(|comparison| comparison.step_s).collect();
    // One setting that is faster at no greater error, and one that is more accurate than every
    // setting of `full`.
    assert_eq!(behind, [Some(5e-3), Some(2e-3)]);
    let headline = study.headline();
    assert!(
        headline.contains(
            "ahead at 0 of engine's 2 best settings, and not at engine euler at 5 ms (20 µm at 0.333 × real time); engine \
             euler at 2 ms (1 µm at 0.111 × real time)."
        ),
        "{headline}"
    );
    let page = page(&study);
    for text in [
        "Where full is not ahead",
        "engine: 150 steps of 20 ms each, locates none of 57 events; full: 150 steps of 26.7 ms \
         each, 57 events located",
        "no setting of full is as accurate",
    ] {
        assert!(page.contains(text), "{text}: {page}");
    }
}

#[test]
fn errors_are_bounded_below_by_the_floor() {
    // Both errors are below the 10 nm disagreement of the reference and its check.
    let study = study(vec![
        row("full", 1000, 9e-9, 1.0),
        row("engine", 1000, 1e-12, 2.0),
    ]);
    let found = only(&study);
    let competitor = found.settings[0].no_greater_error.as_ref().unwrap();
    assert_eq!(
        (competitor.times_less_error, competitor.times_less_time),
        (1.0, 2.0)
    );
}

#[test]
fn failed_or_self_referenced_settings_are_not_compared() {
    let failed = row("engine", 2000, 1e-3, 1.0).ended(Status::Failed, "it fell");
    let mut sparse = study(vec![row("full", 1000, 1e-5, 1.0), failed]);
    assert!(sparse.dominances().is_empty());
    sparse.rows.push(row("engine", 1000, 1e-3, 1.0));
    assert_eq!(sparse.dominances().len(), 1);
    sparse.references[1].of_plant = None;
    assert!(sparse.dominances().is_empty());
}
