//! Studies that keep what they measured: a later start measures the rest only.

use std::cell::Cell;

use twinrig_experiment::{
    CouplingPlan, Factor, Machine, Measuring, PartStore, PlantFactory, PrecisionPlan,
    ProgressObserver, StabilityPlan, Study, StudyError, StudyInput, coupling, estimate, precision,
    stability,
};
use twinrig_kernel::SimDuration;
use twinrig_rig::{PlantOffer, Variant};
use twinrig_runtime::Plant;
use twinrig_testing::folder::Folder;

use crate::oscillator::Oscillators;
use crate::walker::Walkers;

/// Opens the store in a folder.
fn store_in(folder: &Folder) -> PartStore {
    PartStore::open(
        folder.path(),
        &[b"study"],
        &Machine::here("test", "release"),
    )
    .unwrap()
}

/// Counts the plants that a study builds.
struct Counted<F> {
    factory: F,
    builds: Cell<usize>,
}

impl<F> Counted<F> {
    fn new(factory: F) -> Self {
        Self {
            factory,
            builds: Cell::new(0),
        }
    }

    fn count(&self) -> usize {
        self.builds.replace(0)
    }
}

impl<F: PlantFactory> PlantFactory for Counted<F> {
    fn input(&self) -> &StudyInput {
        self.factory.input()
    }

    fn plants(&self) -> &[PlantOffer] {
        self.factory.plants()
    }

    fn build(&self, variant: &Variant) -> Result<Box<dyn Plant>, String> {
        self.builds.set(self.builds.get() + 1);
        self.factory.build(variant)
    }
}

/// Stops a study before a part.
struct StopsBefore(usize);

impl ProgressObserver for StopsBefore {
    fn at(&mut self, part: usize, _: usize, _: &str) -> bool {
        part < self.0
    }
}

fn precision_plan() -> PrecisionPlan {
    PrecisionPlan {
        steps: [5, 2, 1].map(SimDuration::from_millis).into(),
        tolerances: vec![1e-6],
        masses: vec![1.0, 0.1],
        ensemble: 3,
        repetitions: 2,
        budget_s: 1e9,
        ..PrecisionPlan::default()
    }
}

fn stability_plan() -> StabilityPlan {
    StabilityPlan {
        least: SimDuration::from_micros(20),
        factors: vec![Factor::Stiffness],
        values: Some(vec![0.5, 2.0]),
        budget_s: 1e9,
        ..StabilityPlan::default()
    }
}

/// Does a study of precision twice with a store, and returns the number of plants of the second.
fn builds_of_a_second_study(name: &str, factory: impl PlantFactory) -> usize {
    let (folder, factory) = (Folder::new(&format!("kept-{name}")), Counted::new(factory));
    let study = || {
        let (mut observer, mut store) = ((), store_in(&folder));
        let measuring = Measuring::kept(&mut observer, &mut store);
        let mut study = precision(&factory, &precision_plan(), measuring).unwrap();
        // How many parts are of earlier starts.
        study.starts.notes.clear();
        study
    };
    let first = study();
    assert!(factory.count() > 0);
    let second = study();
    // With run times and starts.
    assert_eq!(second, first, "{name}");
    factory.count()
}

#[test]
fn second_study_of_precision_measures_nothing() {
    let oscillators = Oscillators::new(&["rk4", "explicit-euler"], 100).with_bare();
    assert_eq!(builds_of_a_second_study("oscillators", oscillators), 0);
    // Walks have costs of transport, contacts, footsteps and ensembles.
    let walkers = Walkers::new(&["straight", "halved"], 2);
    assert_eq!(builds_of_a_second_study("walkers", walkers), 0);
}

#[test]
fn stopped_study_continues_with_the_rows_of_its_first_start() {
    let folder = Folder::new("kept-stopped");
    let factory = Counted::new(Oscillators::new(&["rk4", "explicit-euler"], 100));
    let study = |observer: &mut dyn ProgressObserver| {
        let mut store = store_in(&folder);
        let measuring = Measuring::kept(observer, &mut store);
        precision(&factory, &precision_plan(), measuring)
    };
    let stopped = study(&mut StopsBefore(4));
    let Err(StudyError::InterruptedParts { done: 4, of }) = stopped else {
        panic!("{stopped:?}");
    };
    let rows = study(&mut ()).unwrap().rows;
    // A reference, and a row for each further part.
    let starts: Vec<_> = rows.iter().filter_map(|row| row.start).collect();
    let expected: Vec<usize> = (1..of).map(|part| if part < 3 { 1 } else { 2 }).collect();
    assert_eq!(starts, expected);
    assert_eq!(study(&mut ()).unwrap().rows, rows);
}

#[test]
fn rows_of_other_settings_are_not_used() {
    let folder = Folder::new("kept-settings");
    let factory = Counted::new(Oscillators::new(&["rk4"], 100));
    let study = |plan: &PrecisionPlan| {
        let (mut observer, mut store) = ((), store_in(&folder));
        precision(&factory, plan, Measuring::kept(&mut observer, &mut store)).unwrap();
        factory.count()
    };
    let plan = precision_plan();
    let all = study(&plan);
    assert_eq!(study(&plan), 0);
    // The budget is no setting of a row that it does not cut.
    let budget_s = 1e8;
    assert_eq!(
        study(&PrecisionPlan {
            budget_s,
            ..plan.clone()
        }),
        0
    );
    let repetitions = 1;
    assert!(
        study(&PrecisionPlan {
            repetitions,
            ..plan.clone()
        }) > 0
    );
    let duration = Some(SimDuration::from_millis(50));
    let shorter = PrecisionPlan { duration, ..plan };
    assert_eq!(study(&shorter), all);
}

/// With a method more, the reference has another check, and may hold for another time.
#[test]
fn rows_of_another_reference_are_not_used() {
    let folder = Folder::new("kept-reference");
    let rows_of_rk4 = |methods: &[&str]| {
        let factory = Oscillators::new(methods, 100);
        let (mut observer, mut store) = ((), store_in(&folder));
        let measuring = Measuring::kept(&mut observer, &mut store);
        let measured = precision(&factory, &precision_plan(), measuring).unwrap();
        let measuring = Measuring::kept(&mut observer, &mut store);
        let searched = stability(&factory, &stability_plan(), measuring).unwrap();
        let rows = measured.rows.into_iter().chain(searched.rows);
        let of_rk4 = rows.filter(|row| row.method == "rk4" && row.start.is_some());
        of_rk4.map(|row| row.start.unwrap()).collect::<Vec<_>>()
    };
    let alone = rows_of_rk4(&["rk4"]);
    assert!(
        alone.len() > 3 && alone.iter().all(|&start| start == 1),
        "{alone:?}"
    );
    let checked = rows_of_rk4(&["rk4", "late"]);
    assert!(checked.iter().all(|&start| start == 2), "{checked:?}");
    assert_eq!(rows_of_rk4(&["rk4"]), alone);
}

#[test]
fn second_study_of_stability_runs_its_references_only() {
    let folder = Folder::new("kept-stability");
    let factory = Counted::new(Oscillators::new(&["rk4", "explicit-euler"], 100));
    let study = |plan: &StabilityPlan| -> (Study, usize) {
        let (mut observer, mut store) = ((), store_in(&folder));
        let measuring = Measuring::kept(&mut observer, &mut store);
        let mut study = stability(&factory, plan, measuring).unwrap();
        study.starts.notes.clear();
        (study, factory.count())
    };
    let plan = stability_plan();
    let (first, all) = study(&plan);
    let (second, again) = study(&plan);
    assert_eq!(second, first);
    // A reference and its check for each of three stiffnesses.
    assert_eq!(again, 6);
    assert!(all > 100, "{all}");
    let ratio = 1.04;
    assert!(study(&StabilityPlan { ratio, ..plan }).1 > 100);
}

#[test]
fn second_study_of_coupling_runs_nothing() {
    let folder = Folder::new("kept-coupling");
    let rigs = crate::coupling::rigs(&["foot"], &["bus"]);
    let study = |plan: &CouplingPlan| {
        let (mut observer, mut store) = ((), store_in(&folder));
        let measuring = Measuring::kept(&mut observer, &mut store);
        let mut study = coupling(&rigs, plan, measuring).unwrap();
        study.starts.notes.clear();
        (study, rigs.steps.take().len())
    };
    let plan = crate::coupling::plan();
    let (first, all) = study(&plan);
    assert!(all > 0);
    assert_eq!(study(&plan), (first, 0));
    let duration = Some(SimDuration::from_millis(200));
    assert_eq!(study(&CouplingPlan { duration, ..plan }).1, all);
}

#[test]
fn second_study_of_load_filters_searches_nothing() {
    struct Iterations(usize);
    impl ProgressObserver for Iterations {
        fn at(&mut self, _: usize, _: usize, label: &str) -> bool {
            self.0 += usize::from(label.contains("iteration"));
            true
        }
    }
    let folder = Folder::new("kept-estimate");
    let bench = crate::estimate::Bench::new(&[0.5, 1.0, 2.5], 5.0);
    let study = |particles| {
        let (mut observer, mut store) = (Iterations(0), store_in(&folder));
        let measuring = Measuring::kept(&mut observer, &mut store);
        let plan = crate::estimate::plan(particles, 1);
        let mut study = estimate(&bench, &plan, measuring).unwrap();
        study.starts.notes.clear();
        (study, observer.0)
    };
    let (first, all) = study(2);
    assert!(all > 0);
    assert_eq!(study(2), (first, 0));
    assert_eq!(study(3).1, all);
}
