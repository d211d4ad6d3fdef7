//! Tables of synthetic results, in which every value differs.

use twinrig_rig::PlantId;

use super::*;
use crate::measured::Starts;
use crate::page_parts::{assert_cards, rows};
use crate::plants::reference_note::ReferenceNote;

/// Returns a run of a method, whose values differ from those of another `number` by a factor.
fn run(kind: CouplingKind, method: CouplingMethod, number: u64) -> CouplingRow {
    let factor = number as f64;
    let mut row = CouplingRow::new(kind, "full", method, 2e-3, 3e-3);
    row.error_rms_m = Some(11e-9 * factor);
    row.error_max_m = Some(12e-9 * factor);
    row.trunk_error_rms_m = Some(13e-9 * factor);
    row.trunk_error_max_m = Some(14e-9 * factor);
    row.steps = Some(15 * number);
    row.steps_per_simulated_s = Some(16.0 * factor);
    row.evaluations = Some(17 * number);
    row.factorisations = Some(18 * number);
    row.events = Some(19 * number);
    row.solver_iterations = Some(20 * number);
    row.fallbacks = Some(21 * number);
    row.cost_per_step_s = Some(22e-6 * factor);
    row.run_s_per_simulated_s = Some(23e-3 * factor);
    row.real_time_factor = Some(24.0 * factor);
    row.timed_runs = Some(25);
    row.why = Some("a remark".to_owned());
    row
}

fn study(rows: Vec<CouplingRow>) -> CouplingStudy {
    CouplingStudy {
        scenario: "made up".to_owned(),
        file: "made-up.toml".to_owned(),
        scene_s: 4.0,
        simulated_s: 3.0,
        grid_s: 0.01,
        period_s: 0.002,
        buses: vec!["serial".to_owned()],
        budget_s: 5.0,
        references: vec![ReferenceNote::missing(&PlantId::new("full"), String::new())],
        rows,
        left_out: Vec::new(),
        starts: Starts::default(),
        panics: Vec::new(),
    }
}

#[test]
fn runs_have_their_values_below_their_heads() {
    let mut row = run(CouplingKind::Together, CouplingMethod::Exact, 1);
    row.counters_changed = Some(vec![("frames".to_owned(), 31.0, 32.0)]);
    assert_eq!(
        rows(&all(&study(vec![row]))),
        [
            "plant | coupling | step | plant step |  | feet, RMS | greatest | trunk, RMS \
             | greatest | steps per second | evaluations | fallbacks | time per step | speed \
             | counters that differ | why",
            "full | exact | 2 ms | 3 ms | ok | 11 nm | 12 nm | 13 nm | 14 nm | 16 | 17 | 21 \
             | 22 µs | 24 × | frames: 31 → 32 | a remark",
        ]
    );
}

/// Of runs with the step of the grid, not of those of the coupling alone.
#[test]
fn steps_have_the_values_of_each_method_beside_each_other() {
    let together = |(method, number)| run(CouplingKind::Together, method, number);
    let mut runs: Vec<CouplingRow> = CouplingMethod::ALL
        .into_iter()
        .zip(1..)
        .map(together)
        .collect();
    runs[1].counters_changed = Some(vec![("frames".to_owned(), 31.0, 32.0)]);
    runs[2].status = Status::Failed;
    runs.insert(0, run(CouplingKind::Alone, CouplingMethod::Grid, 7));
    let study = study(runs);
    assert_eq!(
        rows(&steps(&study, "full")),
        [
            "step | exact: RMS | steps/s | × real time | grid: RMS | steps/s | × real time \
             | grid-held: RMS | steps/s | × real time | ",
            "2 ms | 11 nm | 16 | 24.0 | 22 nm | 32 | 48.0 | **failed** | 48 | 72.0 \
             | 1 counters differ",
        ]
    );
    assert_cards(
        &cards(&study),
        [
            [
                "timing",
                "1",
                "runs in which a counter of a driver or a board ended at another value than in \
                 the reference",
            ],
            [
                "runs",
                "4",
                "3 completed, 1 failed: see the table of all runs",
            ],
        ],
    );
}

/// The error is proportional to the step on a grid, and to its square with held commands.
#[test]
fn orders_are_those_of_their_method() {
    let mut runs = Vec::new();
    for (method, power) in [(CouplingMethod::Grid, 1.0), (CouplingMethod::GridHeld, 2.0)] {
        for step_s in [1e-3, 2e-3, 4e-3, 8e-3] {
            let mut row = run(CouplingKind::Alone, method, 1);
            (row.step_s, row.error_rms_m) = (step_s, Some(libm::pow(step_s, power)));
            runs.push(row);
        }
    }
    let blocks = cards(&study(runs));
    assert_cards(
        &blocks[..2],
        [
            [
                "order of grid with full",
                "1.0",
                "from 4 steps, coupling alone",
            ],
            [
                "order of grid-held with full",
                "2.0",
                "from 4 steps, coupling alone",
            ],
        ],
    );
}
