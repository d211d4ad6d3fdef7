//! Tables and plots of synthetic results, in which every value is another: a column with the value
//! of another one fails.

use twinrig_report::page::Block;
use twinrig_rig::PlantId;

use super::{
    constraint_violation, contact, differences, dominance, ensemble, error_control, footsteps,
    precision, runs, stability, stiffness, thesis, tolerance, transport,
};
use crate::page_parts::{rows, tables};
use crate::plants::dominance_tests::{page, row, study};
use crate::plants::factor::Factor;
use crate::plants::row::{Row, RowKind, Status};
use crate::plants::stiffness::StiffnessTrend;
use crate::plants::study::{Study, StudyKind};

/// Returns a row whose values differ in their digits.
fn distinct(kind: RowKind) -> Row {
    let mut row = row("full", 2000, 11e-9, 0.5);
    row.kind = kind;
    row.error_max_m = Some(12e-9);
    row.trunk_error_rms_m = Some(13e-9);
    row.trunk_error_max_m = Some(14e-9);
    row.foot_to_hip_error_rms_m = Some(15e-9);
    row.event_time_error_s = Some(16e-6);
    row.events = Some(17);
    row.energy_residual_j = Some(18e-3);
    row.drift_m = Some(19e-6);
    row.evaluations = Some(20);
    row.factorisations = Some(21);
    row.solver_iterations = Some(22);
    row.fallbacks = Some(23);
    row.cost_per_step_s = Some(24e-6);
    row.real_time_factor = Some(25.0);
    row.largest_stable_step_s = Some(26e-3);
    row.least_unstable_step_s = Some(27e-3);
    row.largest_right_step_s = Some(28e-3);
    row.probes = Some(29);
    row.least_substep_s = Some(30e-6);
    row.compared_s = Some(31e-3);
    row.why = Some("a remark".to_owned());
    row
}

#[test]
fn runs_and_searches_have_their_values_below_their_heads() {
    let complete = study(vec![distinct(RowKind::Integration)]);
    assert_eq!(
        tables(&runs::section(&complete))[0],
        [
            "plant | method | setting |  | feet, RMS | greatest | trunk, RMS | greatest \
             | worst foot to hip, RMS | event time | events | energy residual \
             | constraint violation | evalu\u{ad}ations | factori\u{ad}sations | solver \
             | fallbacks | per step | speed | why",
            "full | euler | 2 ms | ok | 11 nm | 12 nm | 13 nm | 14 nm | 15 nm | 16 µs | 17 of 57 \
             | 18 mJ | 19 µm | 20 | 21 | 22 | 23 | 24 µs | 25 × | a remark",
        ]
    );
    let searched = study(vec![distinct(RowKind::Stability)]);
    assert_eq!(
        rows(&stability::as_it_is(&searched)),
        [
            "plant | method | largest stable step |  | accurate up to | feet, RMS | greatest \
             | fallbacks | time per step | speed | why",
            "full | euler | 26 ms | ok | 28 ms | 11 nm | 12 nm | 23 | 24 µs | 25 × | a remark",
        ]
    );
    let mut varied = distinct(RowKind::Stability);
    varied.scales = Factor::Stiffness.scales(0.25);
    let searches = stability::blocks(&study(vec![varied]));
    assert_eq!(
        tables(&searches).last().unwrap()[..],
        [
            "varied | value | plant | method | largest stable step | shortest unstable |  \
             | accurate up to | feet, RMS | energy residual | fallbacks | time per step | speed \
             | probes | why",
            "stiffness | 0.25 | full | euler | 26 ms | 27 ms | ok | 28 ms | 11 nm | 18 mJ | 23 \
             | 24 µs | 25 × | 29 | a remark",
        ]
    );
}

/// The usual step is neither the most accurate nor the fastest one.
#[test]
fn summary_has_the_usual_step_and_the_most_accurate_setting() {
    let rows_of_methods = vec![
        row("full", 4000, 3e-6, 0.5),
        row("full", 2000, 2e-6, 1.0),
        row("full", 1000, 1e-6, 2.0),
        row("engine", 2000, 4e-6, 4.0),
    ];
    let study = study(rows_of_methods);
    let table = precision::summary(&study);
    assert_eq!(
        rows(&table)[1..],
        [
            "full | euler | 0.8 | 2 µm | 1 × | 1 µm | 1 ms | 0.5 ×",
            "engine | euler |  | 4 µm | 0.25 × | 4 µm | 2 ms | 0.25 ×",
        ]
    );
    // A line separates the plants.
    assert_eq!(table.html().matches("<tr class=\"first\">").count(), 1);
}

#[test]
fn rows_of_failed_runs_have_their_colour_and_truncated_ones_are_named() {
    let mut failed = distinct(RowKind::Integration);
    failed = failed.ended(Status::Failed, "it snapped");
    let cut = row("full", 1000, 1e-6, 2.0).cut_off("too slow");
    let study = study(vec![distinct(RowKind::Integration), failed, cut]);
    let html = page(&study);
    let (_, all) = html.split_once("All runs</h2>").unwrap();
    assert_eq!(all.matches("<tr class=\"bad\">").count(), 1);
    assert_eq!(all.matches("<tr class=\"cut\">").count(), 1);
    assert!(all.contains("for a budget of 1 s: full euler 1 ms</dd>"));
}

#[test]
fn differences_of_models_have_their_values_below_their_heads() {
    let mut row = distinct(RowKind::Model);
    row.scales.compliance_damping = 3.0;
    row.against = Some("full".to_owned());
    let found = tables(&differences::tables(&study(vec![
        distinct(RowKind::Model),
        row,
    ])));
    assert_eq!(
        found.last().unwrap()[1],
        "full, damping × 3 | full | 11 nm | 12 nm | 13 nm | 15 nm | 31 ms | a remark"
    );
}

#[test]
fn slopes_are_those_of_feet_trunk_and_worst_foot() {
    let rows = [-5, -6, -7, -8].map(|exponent| {
        let tolerance = libm::pow(10.0, f64::from(exponent));
        let mut row = row("full", 1, 1e3 * tolerance, 1.0);
        (row.step_s, row.tolerance) = (None, Some(tolerance));
        row.trunk_error_rms_m = Some(libm::sqrt(tolerance));
        row.foot_to_hip_error_rms_m = Some(tolerance * tolerance);
        row
    });
    let section = tolerance::section(&study(rows.into()));
    assert_eq!(
        tables(&section)[0][1],
        "full | euler | 1.00 | 0.50 | 2.00 | 4 | 10⁻⁸ | 10⁻⁵"
    );
}

#[test]
fn limits_over_stiffness_have_their_values_below_their_heads() {
    let trend = StiffnessTrend {
        plant: PlantId::new("full"),
        method: "euler".to_owned(),
        limits: 3,
        unlimited: 1,
        unknown: 2,
        least_step_s: Some(4e-3),
        greatest_step_s: Some(5e-3),
        exponent: Some(-0.47),
        none_below: Some(0.06),
        is_power: Some(true),
        same_over: Some([0.1, 10.0]),
        depends: Some(true),
    };
    assert_eq!(
        rows(&stiffness::table(&[trend])),
        [
            "plant | method | depends on stiffness | constant from … to | exponent \
             | insignificant below | smallest limit | greatest limit | limits found \
             | stable at the longest",
            "full | euler | yes | 0.1 … 10 × | −0.47 | 0.06 | 4 ms | 5 ms | 3 of 6 | 1",
        ]
    );
}

#[test]
fn limits_of_the_thesis_are_beside_those_at_the_same_stiffness() {
    let limit = |stiffness: f64, step_s: f64| {
        let mut row = distinct(RowKind::Stability);
        row.scales.stiffness = stiffness;
        row.largest_stable_step_s = Some(step_s);
        row
    };
    let section = thesis::section(&study(vec![limit(1.0, 7e-3), limit(0.25, 8e-3)]));
    let found = &tables(&section)[0];
    assert!(
        found[1].ends_with("15 µs | 166 µs | full euler | 7 ms | 8 ms"),
        "{found:?}"
    );
}

#[test]
fn compliant_constraints_show_their_substeps() {
    let rows = [0.1, 1.0].map(|stiffness| {
        let mut row = distinct(RowKind::Stability);
        row.plant = PlantId::new("full").with_constraints("compliant");
        (row.step_s, row.tolerance) = (None, Some(1e-8));
        row.scales.stiffness = stiffness;
        row.evaluations = None;
        row
    });
    let mut study = study(rows.into());
    study.kind = StudyKind::Stability;
    let section = error_control::section(&study);
    assert_eq!(
        tables(&section)[0][1],
        "full, compliant | euler, adaptive | stiffness | 0.1 | ok | 30 µs | 11 nm | 18 mJ | 25 × \
         | a remark"
    );
}

#[test]
fn violations_are_drawn_by_their_own_axis() {
    let violations = [1e-6, 1e-3].map(|drift_m| {
        let mut row = distinct(RowKind::Integration);
        row.drift_m = Some(drift_m);
        row
    });
    let [mut one, two] = violations;
    one.step_s = Some(1e-3);
    let blocks = constraint_violation::section(&study(vec![two, one]));
    let Some(Block::Figure(figure)) = blocks.last() else {
        panic!("{blocks:?}");
    };
    let svg = figure.drawing.svg();
    assert_eq!(svg.matches("<title>").count(), 2);
    // Decades of the axis from one to the other violation, not of the steps.
    for decade in ["10⁻⁶", "10⁻⁵", "10⁻⁴"] {
        assert!(svg.contains(decade), "no {decade} in {svg}");
    }
}

/// The most accurate setting of a method, not the first one, is what others surpass.
#[test]
fn better_settings_are_those_of_the_most_accurate_one() {
    let study = study(vec![
        row("full", 1000, 1e-7, 4.0),
        row("full", 2000, 1e-6, 1.0),
        row("engine", 2000, 1e-5, 8.0),
        row("engine", 1000, 1e-6, 20.0),
    ]);
    let found = tables(&dominance::section(&study));
    assert_eq!(
        found[0][1..],
        [
            "engine | euler | 2 of 2 | 8 × to 20 × | 1 µm (1 ms) | 20 × (euler, 2 ms) \
          | 10 × (euler, 1 ms: 100 nm)"
        ]
    );
}

#[test]
fn no_section_stands_without_results() {
    let empty = study(Vec::new());
    let sections: [fn(&Study) -> Vec<Block>; 6] = [
        tolerance::section,
        constraint_violation::section,
        footsteps::section,
        contact::section,
        ensemble::section,
        transport::section,
    ];
    for section in sections {
        assert!(section(&empty).is_empty());
    }
}
