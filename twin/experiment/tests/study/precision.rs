//! Study of precision: error against run time.

use twinrig_experiment::{
    CLOCKED, Machine, PrecisionPlan, ProgressObserver, Row, RowKind, Status, Study, StudyError,
    precision,
};
use twinrig_kernel::SimDuration;

use crate::oscillator::Oscillators;

pub fn study(methods: &[&str]) -> Study {
    study_for(methods, 0.2)
}

fn study_for(methods: &[&str], seconds: f64) -> Study {
    let plan = PrecisionPlan {
        duration: SimDuration::try_from_secs_f64(seconds),
        repetitions: 1,
        budget_s: 1e9,
        ..PrecisionPlan::default()
    };
    precision(&Oscillators::new(methods, 200).with_bare(), &plan, &mut ()).unwrap()
}

fn rows<'a>(study: &'a Study, method: &str) -> Vec<&'a Row> {
    let ours = |row: &&Row| {
        row.plant == "full" && row.method == method && row.kind == RowKind::Integration
    };
    study.rows.iter().filter(ours).collect()
}

#[test]
fn errors_show_the_order_of_each_method() {
    let study = study(&["rk4", "semi-implicit", "explicit-euler"]);
    for (method, order) in [
        ("rk4", 4.0),
        ("semi-implicit", 1.0),
        ("explicit-euler", 1.0),
    ] {
        let orders = study.orders();
        let found = orders
            .iter()
            .find(|found| found.plant == "full" && found.method == method)
            .unwrap();
        assert!((found.order - order).abs() < 0.25, "{found:?}");
    }
}

#[test]
fn errors_below_the_reference_disagreement_are_at_the_floor() {
    let study = study(&["rk4", "tolerant"]);
    let reference = &study.references[0];
    let check = reference.check.as_ref().unwrap();
    assert_eq!(reference.method.as_deref(), Some("rk4"));
    // Only `rk4` qualifies as a reference, so it is its own check.
    assert!(!check.independent && reference.why.is_some());
    let errors = rows(&study, "tolerant");
    assert_eq!(errors.len(), 8);
    for row in errors {
        let below = row.error_rms_m.unwrap() <= check.disagreement_rms_m;
        assert_eq!(row.at_floor, below);
    }
}

#[test]
fn contradicted_reference_is_rejected() {
    let study = study(&["rk4", "biased"]);
    let reference = &study.references[0];
    assert_eq!(reference.method, None);
    let why = reference.why.as_ref().unwrap();
    assert!(why.contains("contradict each other"), "{why}");
    for row in rows(&study, "rk4") {
        assert_eq!((row.status, row.error_rms_m), (Status::Ok, None));
    }
}

#[test]
fn comparison_ends_where_check_and_reference_part() {
    let study = study(&["rk4", "late", "semi-implicit"]);
    let reference = &study.references[0];
    let until = reference.holds_until_s.unwrap();
    assert!((0.12..0.15).contains(&until), "{until}");
    let truncated = study_for(&["rk4", "semi-implicit"], until);
    let errors = |study: &Study| -> Vec<f64> {
        let rows = rows(study, "semi-implicit").into_iter();
        rows.map(|row| row.error_rms_m.unwrap()).collect()
    };
    for (a, b) in errors(&study).iter().zip(errors(&truncated)) {
        assert!((a / b - 1.0).abs() < 1e-6, "{a} {b}");
    }
}

#[test]
fn method_can_have_step_and_tolerance_series() {
    let study = study(&["rk4", "rk4 to a tolerance"]);
    let lines = study.series();
    let ours: Vec<String> = lines
        .iter()
        .filter(|line| line.plant == "full")
        .map(twinrig_experiment::Series::method_label)
        .collect();
    assert_eq!(ours, ["rk4", "rk4, adaptive"]);
    // The order is fitted to the fixed steps only.
    let orders = study.orders();
    assert_eq!(
        orders.iter().filter(|order| order.plant == "full").count(),
        1
    );
}

#[test]
fn tighter_tolerance_reduces_error_and_increases_work() {
    let study = study(&["rk4", "tolerant"]);
    let rows = rows(&study, "tolerant");
    for pair in rows.windows(2) {
        assert!(pair[1].evaluations > pair[0].evaluations);
        assert!(pair[1].error_rms_m < pair[0].error_rms_m || pair[1].at_floor);
    }
}

#[test]
fn failures_are_rows_with_reasons() {
    let study = study(&["rk4", "brittle", "unbuildable", "explicit-euler"]);
    for (method, why) in [
        ("brittle", "spring failed at"),
        ("unbuildable", "there is no such oscillator"),
    ] {
        let rows = rows(&study, method);
        assert_eq!(rows.len(), 10);
        for row in rows {
            assert_eq!(row.status, Status::Failed);
            assert!(row.why.as_ref().unwrap().contains(why), "{row:?}");
            assert_eq!(
                (row.error_rms_m, row.real_time_factor.is_some()),
                (None, method == "brittle")
            );
        }
    }
    // 2ζ/ω is 2 ms: steps of 10 and 5 ms are unstable.
    let statuses: Vec<Status> = rows(&study, "explicit-euler")
        .iter()
        .map(|row| row.status)
        .collect();
    assert_eq!(statuses[..2], [Status::Unstable; 2]);
    assert_eq!(statuses[3..], [Status::Ok; 7]);
}

#[test]
fn row_over_budget_is_reported() {
    let plan = PrecisionPlan {
        budget_s: 0.0,
        steps: vec![SimDuration::from_millis(10), SimDuration::from_nanos(10)],
        tolerances: Vec::new(),
        ..PrecisionPlan::default()
    };
    let study = precision(&Oscillators::new(&["rk4"], 1000), &plan, &mut ()).unwrap();
    let rows = rows(&study, "rk4");
    assert_eq!(rows[0].status, Status::Ok);
    assert_eq!(rows[1].status, Status::Failed);
    assert!(
        rows[1].why.as_ref().unwrap().starts_with("too slow"),
        "{rows:?}"
    );
    assert_eq!(study.cut().count(), 1);
}

#[test]
fn events_are_compared_with_those_of_the_reference() {
    let study = study(&["rk4", "semi-implicit"]);
    let fine = *rows(&study, "rk4").last().unwrap();
    let coarse = rows(&study, "semi-implicit")[2];
    assert_eq!(fine.events, fine.events_expected);
    assert!(fine.events > Some(3));
    assert!(fine.event_time_error_s < coarse.event_time_error_s);
}

#[test]
fn model_difference_is_separate_and_vanishes_with_the_mass() {
    let study = study(&["rk4"]);
    let of = |kind| {
        let rows = study.rows.iter().filter(move |row| row.kind == kind);
        rows.map(|row| row.error_rms_m.unwrap()).collect::<Vec<_>>()
    };
    let models = of(RowKind::Model);
    let limits = of(RowKind::Limit);
    assert_eq!((models.len(), limits.len()), (1, 8));
    assert!(models[0] > 1e-3);
    for pair in limits[3..].windows(2) {
        assert!(pair[1] < 0.5 * pair[0], "{limits:?}");
    }
    assert!(limits[7] < 1e-12);
    let mut own = study
        .rows
        .iter()
        .filter(|row| row.plant == "bare" && row.kind == RowKind::Integration);
    assert!(own.next_back().unwrap().error_rms_m.unwrap() < 1e-9);
}

/// Returns the JSON of a study without the values that depend on run times.
pub fn without_clock(study: &Study) -> serde_json::Value {
    let machine = Machine::here("test", "release");
    let mut json = study.json(&machine, "test");
    for row in json["rows"].as_array_mut().unwrap() {
        for key in CLOCKED {
            row.as_object_mut().unwrap().remove(key);
        }
    }
    json.as_object_mut().unwrap().remove("machine");
    json
}

#[test]
fn studies_are_reproducible_except_for_run_times() {
    let methods = ["rk4", "semi-implicit", "tolerant", "brittle"];
    assert_eq!(
        without_clock(&study(&methods)),
        without_clock(&study(&methods))
    );
}

#[test]
fn json_keys_keep_their_order() {
    let study = study(&["rk4", "tolerant"]);
    let json = study.json(&Machine::here("test", "release"), "test");
    let keys: Vec<&str> = json
        .as_object()
        .unwrap()
        .keys()
        .map(String::as_str)
        .collect();
    assert_eq!(
        keys[..5],
        ["study", "scenario", "machine", "reference", "rows"]
    );
    assert_eq!(json["study"], "precision");
    let rest = [
        "stiffness",
        "mass",
        "damping",
        "gain",
        "compliance",
        "compliance_damping",
        "friction",
        "restitution",
        "longest_step_s",
        "speed",
        "status",
        "error_rms_m",
        "error_max_m",
        "largest_stable_step_s",
        "cost_per_step_s",
        "run_s_per_simulated_s",
        "evaluations",
    ];
    for row in json["rows"].as_array().unwrap() {
        let keys: Vec<&str> = row
            .as_object()
            .unwrap()
            .keys()
            .map(String::as_str)
            .collect();
        assert_eq!(keys[..3], ["plant", "constraints", "method"]);
        assert!(["step_s", "tolerance"].contains(&keys[3]), "{keys:?}");
        assert_eq!(keys[4..21], rest);
        assert_eq!(row["stiffness"], 1.0);
    }
}

#[test]
fn csv_has_a_line_per_row_and_a_cell_per_key() {
    let study = study(&["rk4", "unbuildable"]);
    let text = study.csv();
    let mut lines = text.lines();
    let head = lines.next().unwrap();
    assert!(
        head.starts_with("plant,constraints,method,step_s,tolerance,stiffness,"),
        "{head}"
    );
    assert_eq!(lines.count(), study.rows.len());
    assert!(text.contains("full,,rk4,0.002,,1.0,"), "{text}");
}

#[test]
fn observer_can_stop_the_study_and_short_duration_is_an_error() {
    struct StopsEarly;
    impl ProgressObserver for StopsEarly {
        fn at(&mut self, part: usize, of: usize, _: &str) -> bool {
            assert!(part <= of);
            part < 3
        }
    }
    let plan = PrecisionPlan::default();
    let factory = Oscillators::new(&["rk4"], 100);
    let ended = precision(&factory, &plan, &mut StopsEarly);
    assert_eq!(ended, Err(StudyError::Interrupted { done: 3, of: 11 }));
    let short = precision(&Oscillators::new(&["rk4"], 5), &plan, &mut ());
    assert!(
        matches!(short, Err(StudyError::TooShort { .. })),
        "{short:?}"
    );
}

#[test]
fn rows_match_snapshot() {
    let plan = PrecisionPlan {
        steps: [5, 1].map(SimDuration::from_millis).into(),
        masses: vec![1.0, 0.0],
        repetitions: 1,
        budget_s: 1e9,
        ..PrecisionPlan::default()
    };
    let factory = Oscillators::new(&["rk4", "explicit-euler", "brittle"], 100).with_bare();
    let study = precision(&factory, &plan, &mut ()).unwrap();
    let json = without_clock(&study);
    let shown = |row: &serde_json::Value| {
        let cell = |key: &str| match &row[key] {
            serde_json::Value::Null => "–".to_owned(),
            serde_json::Value::Number(number) if number.is_f64() => {
                format!("{:.3e}", number.as_f64().unwrap())
            }
            other => other.to_string(),
        };
        let keys = [
            "kind",
            "plant",
            "method",
            "step_s",
            "mass",
            "status",
            "error_rms_m",
            "error_max_m",
            "evaluations",
            "steps",
            "events",
            "event_time_error_s",
            "at_floor",
            "why",
        ];
        keys.map(cell).join("  ")
    };
    let rows: Vec<String> = json["rows"].as_array().unwrap().iter().map(shown).collect();
    insta::assert_snapshot!(rows.join("\n"));
}
