//! Differences between models of scaled compliance.

use twinrig_experiment::{PrecisionPlan, Row, RowKind, Study, precision};
use twinrig_kernel::SimDuration;

use crate::oscillator::Oscillators;

fn study() -> Study {
    let plan = PrecisionPlan {
        steps: vec![SimDuration::from_millis(1)],
        masses: Vec::new(),
        repetitions: 1,
        budget_s: 1e9,
        ..PrecisionPlan::default()
    };
    let factory = Oscillators::new(&["rk4"], 100).with_bare().with_compliant();
    precision(&factory, &plan, &mut ()).unwrap()
}

fn models(study: &Study) -> Vec<&Row> {
    let rows = study.rows.iter().filter(|row| row.kind == RowKind::Model);
    rows.collect()
}

/// The compliance softens the spring in inverse proportion to its stiffness.
#[test]
fn difference_from_the_rigid_model_falls_with_the_stiffness() {
    let study = study();
    let against_rigid = |stiffness| {
        let rows = models(&study).into_iter();
        let mut rows = rows.filter(|row| {
            row.plant == "full, compliant"
                && row.scales.compliance == stiffness
                && row.against.as_deref() == Some("full")
        });
        rows.next().unwrap().error_rms_m.unwrap()
    };
    let errors = [1.0, 3.0, 10.0, 30.0].map(against_rigid);
    for (stiffness, error) in [3.0, 10.0, 30.0].into_iter().zip(&errors[1..]) {
        let ratio = errors[0] / error / stiffness;
        assert!((ratio - 1.0).abs() < 0.02, "{errors:?}");
    }
}

#[test]
fn each_model_is_compared_with_each_other_and_assumed_compliance_with_itself() {
    let study = study();
    let names = |row: &&Row| (row.model(), row.against.clone().unwrap());
    let rows = models(&study);
    // The full model comes first, whatever the order of the plants.
    let main: Vec<_> = rows
        .iter()
        .filter(|row| !row.varies_compliance())
        .map(names)
        .collect();
    assert_eq!(main.len(), 6 * 5 / 2, "{main:?}");
    assert!(main.iter().all(|(model, _)| model != "full"), "{main:?}");
    let varied: Vec<_> = rows
        .iter()
        .filter(|row| row.varies_compliance())
        .map(names)
        .collect();
    let expected = ["stiffness × 0.333", "damping × 0.333", "damping × 3"];
    let own = "full, compliant".to_owned();
    assert_eq!(
        varied,
        expected.map(|what| (format!("{own}, {what}"), own.clone()))
    );
    // All over the same duration, to the end of the runs.
    assert!(
        rows.iter().all(|row| row.compared_s == Some(0.1)),
        "{rows:?}"
    );
    assert!(rows.iter().all(|row| row.error_rms_m.unwrap() > 0.0));
    let page = study
        .page(
            &twinrig_experiment::Machine::here("test", "release"),
            "test",
        )
        .html();
    assert!(page.contains("Sensitivity to compliance"));
    assert!(page.contains("full, compliant, stiffness × 30"));
}
