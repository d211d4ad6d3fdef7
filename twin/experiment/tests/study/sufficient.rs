//! The search of the cheapest sufficient twin among candidates with known errors and costs.

use std::cell::RefCell;

use proptest::prelude::*;
use twinrig_experiment::{
    Candidate, CandidateFactory, CandidateReference, CandidateRun, CandidateStatus, MarginOutcome,
    ProgressObserver, Rule, RunFailure, StudyError, Sufficiency, SufficiencyPlan, sufficient,
};
use twinrig_kernel::SimDuration;
use twinrig_rig::{MethodSetting, PlantId};

const SIMULATED_S: f64 = 2.0;
/// Margin of the reference, with a verdict that holds.
const MARGIN: f64 = 1.0;

/// A model with a known error of the margin and a known computation time.
#[derive(Clone, Copy, Debug)]
struct Model {
    error: f64,
    /// Amplitude of the difference between starts.
    scatter: f64,
    run_s: f64,
    /// Whether the expectation about the computation holds.
    closes: bool,
}

const EXACT: Model = Model {
    error: 0.0,
    scatter: 0.0,
    run_s: 100.0,
    closes: true,
};

/// Candidates are named by their indices in `models`; the first is the scenario's own, the last two
/// are the reference and its check.
struct Fake {
    models: Vec<Model>,
    margin: f64,
    own: Candidate,
    refinements: Vec<Vec<Candidate>>,
    references: Vec<CandidateReference>,
    runs: RefCell<Vec<usize>>,
}

fn candidate(index: usize) -> Candidate {
    Candidate {
        plant: PlantId::new(&index.to_string()),
        method: Some("exact".to_owned()),
        setting: Some(MethodSetting::Step(SimDuration::from_millis(1))),
        settings: Vec::new(),
    }
}

impl Fake {
    fn new(own: Model, refinements: &[Vec<Model>], reference: Model, check: Model) -> Self {
        let mut models = vec![own];
        let mut numbered = Vec::new();
        for refinement in refinements {
            let from = models.len();
            models.extend(refinement);
            numbered.push((from..models.len()).map(candidate).collect());
        }
        let last = models.len();
        models.extend([reference, check]);
        Self {
            models,
            margin: MARGIN,
            own: candidate(0),
            refinements: numbered,
            references: vec![CandidateReference {
                reference: candidate(last),
                check: candidate(last + 1),
            }],
            runs: RefCell::default(),
        }
    }

    fn search(&self) -> Sufficiency {
        sufficient(self, &plan(), &mut ()).unwrap()
    }

    fn count(&self, index: usize) -> usize {
        let runs = self.runs.borrow();
        runs.iter().filter(|&&run| run == index).count()
    }
}

fn plan() -> SufficiencyPlan {
    SufficiencyPlan {
        starts: 5,
        repetitions: 2,
        budget_s: 1e6,
    }
}

impl CandidateFactory for Fake {
    fn own(&self) -> &Candidate {
        &self.own
    }

    fn refinements(&self) -> &[Vec<Candidate>] {
        &self.refinements
    }

    fn references(&self) -> &[CandidateReference] {
        &self.references
    }

    fn simulated_s(&self) -> f64 {
        SIMULATED_S
    }

    fn starts_differ(&self) -> bool {
        true
    }

    fn run(
        &self,
        candidate: &Candidate,
        start: usize,
        limit_s: f64,
    ) -> Result<CandidateRun, RunFailure> {
        let index: usize = candidate.plant.name.parse().unwrap();
        let model = self.models[index];
        self.runs.borrow_mut().push(index);
        if model.run_s > limit_s {
            return Err(RunFailure::OverLimit);
        }
        // −1, −½, 0, ½, 1 in an order that begins off the middle.
        let shift = [0.5, -1.0, 0.0, 1.0, -0.5][start % 5];
        let margin = self.margin + model.error + model.scatter * shift;
        let outcome = |name: &str, holds, margin| MarginOutcome {
            name: name.to_owned(),
            unit: "m".to_owned(),
            holds,
            margin,
        };
        Ok(CandidateRun {
            outcomes: vec![outcome("walks", margin >= 0.0, Some(margin))],
            of_computation: vec![outcome("energy balance closes", model.closes, None)],
            run_s: model.run_s,
            simulated_s: SIMULATED_S,
            work: index as u64,
        })
    }
}

/// Settings of a method whose error halves and whose cost doubles from each to the next.
fn halving(of_model: f64, of_method: f64, run_s: f64) -> Vec<Model> {
    let setting = |n: u32| Model {
        error: of_model + of_method / f64::from(1_u32 << n),
        run_s: run_s * f64::from(1_u32 << n),
        ..EXACT
    };
    (0..7).map(setting).collect()
}

/// Costs differ by more than the noise, for different methods as well.
fn method(run_s: f64) -> impl Strategy<Value = Vec<Model>> {
    let errors = prop::sample::select(vec![0.0, 0.02, 0.05, 0.15, 0.5]);
    (errors, 0.01..4.0_f64, 0..6_u32).prop_map(move |(of_model, of_method, cost)| {
        halving(of_model, of_method, run_s * f64::from(1_u32 << cost))
    })
}

proptest! {
    #[test]
    fn the_choice_is_that_of_trying_everything(
        first in method(0.5),
        second in method(0.65),
        own_error in prop::sample::select(vec![0.0, 0.2]),
    ) {
        let own = Model { error: own_error, run_s: 17.0, ..EXACT };
        let fake = Fake::new(own, &[first, second], EXACT, EXACT);
        let last = fake.models.len() - 2;
        let sufficient = (0..last).filter(|&index| {
            let model = fake.models[index];
            // One that takes longer than the reference is no candidate.
            model.error < 0.1 * MARGIN && (index == 0 || model.run_s <= EXACT.run_s)
        });
        let cost = |index: usize| fake.models[index].run_s;
        let expected = sufficient.min_by(|&a, &b| cost(a).total_cmp(&cost(b)));
        let found = fake.search();
        let chosen = found.choice().map(|row| row.candidate.plant.name.clone());
        prop_assert_eq!(chosen, expected.map(|index| index.to_string()));
        let time = found.choice().and_then(|row| row.run_s_per_s);
        prop_assert_eq!(time, expected.map(|index| cost(index) / SIMULATED_S));
    }
}

#[test]
fn hopeless_candidates_run_once_and_sufficient_ones_from_every_start() {
    let hopeless = vec![Model {
        error: 0.5,
        run_s: 1.0,
        ..EXACT
    }];
    let suitable = vec![Model {
        error: 0.05,
        run_s: 2.0,
        ..EXACT
    }];
    let fake = Fake::new(EXACT, &[hopeless, suitable], EXACT, EXACT);
    let found = fake.search();
    assert_eq!([fake.count(1), fake.count(2)], [1, 6]);
    let row = &found.rows[1];
    assert_eq!(row.status, CandidateStatus::Insufficient);
    assert_eq!(
        row.why.as_deref(),
        Some("walks: error 500 mm of a margin of 1 m")
    );
    assert_eq!(found.savings(), [Some(50.0); 2]);
}

#[test]
fn finer_settings_do_not_run_once_the_error_is_that_of_the_model() {
    let settings = halving(0.4, 1e-3, 0.1);
    let fake = Fake::new(EXACT, &[settings], EXACT, EXACT);
    let found = fake.search();
    let not_run = found.rows.iter();
    let not_run = not_run.filter(|row| row.status == CandidateStatus::NotRun);
    assert_eq!(not_run.count(), 5);
    assert_eq!(found.chosen, Some(0), "the scenario's own is exact");
}

#[test]
fn expectation_that_scatters_is_judged_by_verdict_and_overlap() {
    let scattered = Model {
        scatter: 0.3,
        ..EXACT
    };
    let like = vec![Model {
        error: 0.2,
        run_s: 2.0,
        ..scattered
    }];
    let apart = vec![Model {
        error: 0.7,
        run_s: 1.0,
        ..scattered
    }];
    let fails = vec![Model {
        error: -1.6,
        run_s: 1.0,
        scatter: 1.5,
        closes: true,
    }];
    let fake = Fake::new(scattered, &[apart, fails, like], scattered, scattered);
    let found = fake.search();
    let margin = &found.margins[0];
    assert_eq!(margin.rule, Rule::Overlap);
    assert!((margin.scatter - 0.6).abs() < 1e-12);
    assert_eq!(found.chosen, Some(3));
    let why = |row: usize| found.rows[row].why.clone().unwrap();
    assert!(why(1).contains("do not overlap"), "{}", why(1));
    assert!(why(2).contains("fails from most starts"), "{}", why(2));
}

#[test]
fn margin_of_zero_allows_no_error() {
    let off = vec![Model {
        error: 1e-12,
        run_s: 1.0,
        ..EXACT
    }];
    let equal = vec![Model {
        run_s: 2.0,
        ..EXACT
    }];
    let mut fake = Fake::new(EXACT, &[off, equal], EXACT, EXACT);
    fake.margin = 0.0;
    let found = fake.search();
    assert_eq!(found.chosen, Some(2));
    assert_eq!(found.rows[1].status, CandidateStatus::Insufficient);
}

#[test]
fn uncertain_reference_makes_nothing_sufficient() {
    let check = Model {
        error: 0.12,
        ..EXACT
    };
    let found = Fake::new(EXACT, &[vec![EXACT]], EXACT, check).search();
    assert!(found.margins[0].is_too_uncertain());
    assert_eq!(found.chosen, None);
    // The uncertainty adds to the error of a candidate.
    let check = Model {
        error: -0.06,
        ..EXACT
    };
    let near = Model {
        error: 0.05,
        run_s: 1.0,
        ..EXACT
    };
    let found = Fake::new(EXACT, &[vec![near]], EXACT, check).search();
    assert!(!found.margins[0].is_too_uncertain());
    assert_eq!(found.chosen, Some(0));
}

#[test]
fn candidate_must_hold_its_bounds_of_the_computation_and_the_reference_need_not() {
    let open = Model {
        closes: false,
        ..EXACT
    };
    let cheap = Model { run_s: 1.0, ..open };
    let found = Fake::new(EXACT, &[vec![cheap]], open, EXACT).search();
    assert_eq!(found.chosen, Some(0));
    assert_eq!(
        found.rows[1].why.as_deref(),
        Some("energy balance closes: it fails")
    );
    assert_eq!(
        found.reference.failed_of_computation,
        ["energy balance closes"]
    );
}

#[test]
fn first_affordable_reference_is_used() {
    let mut fake = Fake::new(EXACT, &[vec![EXACT]], EXACT, EXACT);
    let relaxed = fake.references[0].clone();
    let last = fake.models.len();
    fake.models.push(Model {
        run_s: 1e6,
        ..EXACT
    });
    let finest = CandidateReference {
        reference: candidate(last),
        check: candidate(last),
    };
    fake.references.insert(0, finest.clone());
    assert_eq!(fake.search().reference.reference, relaxed.reference);
    fake.references = vec![finest];
    let found = sufficient(&fake, &plan(), &mut ());
    assert!(
        matches!(found, Err(StudyError::NoReference { .. })),
        "{found:?}"
    );
}

#[test]
fn search_ends_at_the_word_of_the_observer() {
    struct Second;
    impl ProgressObserver for Second {
        fn at(&mut self, part: usize, _: usize, _: &str) -> bool {
            part < 1
        }
    }
    let fake = Fake::new(EXACT, &[vec![EXACT]], EXACT, EXACT);
    let found = sufficient(&fake, &plan(), &mut Second);
    assert_eq!(found, Err(StudyError::Interrupted { done: 1, of: 3 }));
}
