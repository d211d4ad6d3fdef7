//! Tables and plots of synthetic results, in which every value is another: a column with the value
//! of another one fails.

use twinrig_kernel::SimDuration;
use twinrig_report::page::Block;
use twinrig_report::table::Table;
use twinrig_rig::{MethodSetting, PlantId, Scales, Variant};

use super::{
    constraint_violation, contact, differences, dominance, ensemble, error_control, footsteps,
    precision, runs, stability, stiffness, thesis, tolerance, transport,
};
use crate::contact::{ContactResiduals, GaitContact, RestContact};
use crate::dominance_tests::{page, row, study};
use crate::ensemble::{Ensemble, Interval, QuantityInterval};
use crate::footsteps::Footstep;
use crate::row::{Row, RowKind, Status, VariantKey};
use crate::stiffness::StiffnessTrend;
use crate::study::{Study, StudyKind};
use crate::sweep::Factor;
use crate::transport::{Cost, Transport};

/// Returns the rows of a table below its head, without empty columns.
fn rows(table: &Table) -> Vec<String> {
    let lines = table.markdown();
    let cells = |line: &str| -> Vec<String> {
        let cells = line.trim_matches('|').split(" | ");
        cells.map(|cell| cell.trim().to_owned()).collect()
    };
    let lines: Vec<Vec<String>> = lines.lines().map(cells).collect();
    let filled = |column: usize| lines[2..].iter().any(|line| !line[column].is_empty());
    let columns: Vec<usize> = (0..lines[0].len()).filter(|&n| filled(n)).collect();
    let kept = |line: &Vec<String>| {
        let cells = columns.iter().map(|&column| line[column].as_str());
        cells.collect::<Vec<_>>().join(" | ")
    };
    std::iter::once(&lines[0])
        .chain(&lines[2..])
        .map(kept)
        .collect()
}

/// Returns the tables of a section.
fn tables(blocks: &[Block]) -> Vec<Vec<String>> {
    let tables = blocks.iter().filter_map(|block| match block {
        Block::Table(table) => Some(rows(table)),
        _ => None,
    });
    tables.collect()
}

fn key(plant: &str) -> VariantKey {
    VariantKey::from(&Variant {
        plant: PlantId::new(plant),
        method: "euler".to_owned(),
        setting: MethodSetting::Step(SimDuration::from_millis(2)),
        scales: Scales::AS_IS,
    })
}

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
fn cost_of_transport_is_shown_by_its_definition() {
    let cost = Cost {
        from_s: 1.0,
        to_s: 5.0,
        distance_m: 2.0,
        speed_m_s: 0.51,
        work_j: 4.2,
        drive_work_j: Some(4.3),
        positive_work_j: Some(5.0),
        dissipated_j: 3.1,
        impact_j: 0.32,
        stored_j: 0.033,
        residual_j: 0.42,
        appears_most_j: 0.1,
        vanishes_most_j: 0.2,
        cost_of_transport: Some(0.61),
        covered_cost_of_transport: Some(0.62),
        positive_cost_of_transport: Some(0.63),
    };
    let walk = |cost| Transport {
        key: key("full"),
        status: Status::Ok,
        why: None,
        fell_at_s: None,
        converged: None,
        cost: Some(cost),
    };
    // The drives' own work is another one: their positive work is not known.
    let doubtful = Cost {
        drive_work_j: Some(8.4),
        ..cost
    };
    let mut study = study(Vec::new());
    study.transports = vec![walk(cost), walk(doubtful)];
    assert_eq!(
        tables(&transport::section(&study))[0],
        [
            "plant | method | speed [m/s] | cost, net | covered | positive | work, net | residual \
             | friction | impacts | stored",
            "full | euler | 0.510 | 0.610 | 0.620 | 0.630 | 4.2 J | 420 mJ, 10.00 % | 3.1 J \
             | 320 mJ | 33 mJ",
            "full | euler | 0.510 | 0.610 | 0.620 |  | 4.2 J | 420 mJ, 10.00 % | 3.1 J | 320 mJ \
             | 33 mJ",
        ]
    );
}

#[test]
fn contacts_have_their_residuals_below_their_heads() {
    let mut study = study(Vec::new());
    study.contacts = vec![ContactResiduals {
        key: key("full"),
        status: Status::Ok,
        why: Some("a remark".to_owned()),
        rest: Some(RestContact {
            load_n: 1.0,
            penetration_m: 2e-3,
            expected_m: Some(3e-3),
            stiffness_realised: Some(0.4),
            speed_m_s: 0.0,
        }),
        gait: Some(GaitContact {
            signorini_j: 5e-3,
            penetration_m: 6e-3,
            coulomb_n: Some(7.0),
            along_slip_j: 8e-3,
            created_j: 9e-3,
            dissipated_j: 10e-3,
        }),
    }];
    assert_eq!(
        tables(&contact::section(&study))[0],
        [
            "plant | method | load at rest | penetration | load / k | stiffness realised \
             | Signorini | greatest penetration | Coulomb | along slip | created | dissipated | why",
            "full | euler | 1 N | 2 mm | 3 mm | 0.4 | 5 mJ | 6 mm | 7 N | 8 mJ | 9 mJ | 10 mJ \
             | a remark",
        ]
    );
}

#[test]
fn ensembles_show_the_error_of_the_method_below_the_interval() {
    let mut study = study(Vec::new());
    study.ensembles = vec![Ensemble {
        key: key("full"),
        simulated_s: 3.0,
        completed: 8,
        fell: 1,
        failed: 2,
        why: None,
        quantities: vec![QuantityInterval {
            quantity: "speed".to_owned(),
            unit: "m/s",
            interval: Interval {
                mean: 0.5,
                low: 0.48,
                high: 0.52,
                deviation: 0.02,
            },
            method_error: Some(0.003),
        }],
    }];
    let section = ensemble::section(&study);
    assert_eq!(
        tables(&section)[0],
        [
            "plant | method | walks | speed",
            "full | euler | 8, 1 fell, 2 failed | 0.500 ± 0.020 m/s",
        ]
    );
    assert!(page(&study).contains("<span class=\"wrap soft\">3 mm/s</span>"));
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
fn touch_downs_within_the_uncertainty_are_grey() {
    let mut study = study(Vec::new());
    let step = |number: usize, unsure_s: f64| Footstep {
        plant: PlantId::new("other"),
        leg: "LF".to_owned(),
        number,
        at_s: Some(0.25),
        later_s: Some(2e-3),
        apart_m: Some(3e-3),
        unsure_s: Some(unsure_s),
        unsure_m: Some(1e-3),
    };
    study.footsteps = vec![step(1, 1e-3), step(2, 3e-3)];
    let section = footsteps::section(&study);
    let [_, first, second] = &tables(&section)[0][..] else {
        panic!("{section:?}");
    };
    assert_eq!(first, "1 | 0.250 s | +2 ms | 3 mm");
    assert_eq!(second, "2 | 0.250 s | +2 ms | 3 mm");
    let html = page(&study);
    assert_eq!(html.matches("<span class=\"soft\">+2 ms</span>").count(), 1);
    let (before, _) = html.split_once("<span class=\"soft\">+2 ms").unwrap();
    assert!(before.contains(">+2 ms<"), "the second one is grey");
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
        ["engine | euler | 2 of 2 | 8 × to 20 × | 1 µm | 20 × | 10 ×"]
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
