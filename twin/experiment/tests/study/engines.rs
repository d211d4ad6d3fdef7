//! Plants that solve the model of another plant with another engine.

use twinrig_experiment::{Factor, PrecisionPlan, Row, RowKind, StiffnessTrend, Study, precision};
use twinrig_kernel::SimDuration;

use crate::oscillator::{Oscillators, SOFT, STEP_ONLY};
use crate::stability;

fn study(factory: &Oscillators) -> Study {
    let plan = PrecisionPlan {
        repetitions: 1,
        budget_s: 1e9,
        ..PrecisionPlan::default()
    };
    precision(factory, &plan, &mut ()).unwrap()
}

/// Returns the errors of `plant`, the longest step first \[m\].
fn errors(study: &Study, plant: &str) -> Vec<f64> {
    let ours = study.rows.iter();
    let ours = ours.filter(|row| row.plant == plant && row.kind == RowKind::Integration);
    ours.map(|row| row.error_rms_m.unwrap()).collect()
}

/// Range of the error due to the soft spring: the oscillator of frequency ω√(1 − SOFT) leaves that
/// of ω by ω t SOFT/2 of its amplitude of 1 cm, over ω t = 20, reduced by the damping.
const DETUNED_M: std::ops::Range<f64> = 1e-6..1e-4;

#[test]
fn step_independent_engine_error_shows_against_the_model_reference() {
    let found = study(&Oscillators::new(&["rk4", "semi-implicit"], 200).with_engine(&["rk4"]));
    let note = &found.references[1];
    assert_eq!(
        (&*note.plant.name, note.of_plant.as_deref()),
        ("engine", Some("full"))
    );
    assert_eq!(note.check, found.references[0].check);
    let soft = errors(&found, "engine");
    let finest = *soft.last().unwrap();
    assert!(DETUNED_M.contains(&finest), "{finest}");
    // The error is due to the soft spring and does not depend on the step.
    assert!(
        (finest / soft[soft.len() - 3] - 1.0).abs() < 1e-3,
        "{soft:?} {SOFT}"
    );
    let floors = found.floors();
    let floor = floors.iter().find(|floor| floor.plant == "engine").unwrap();
    assert!(floor.levels_off_from_s.unwrap() >= 1e-3, "{floor:?}");
    assert!(!floor.at_floor);
    let own = floors.iter().find(|floor| floor.plant == "full").unwrap();
    assert_eq!(own.levels_off_from_s, None, "{own:?}");
    // It is another solver of the same model, not another model.
    assert!(found.rows.iter().all(|row| row.kind != RowKind::Model));
}

#[test]
fn model_reference_is_built_for_a_bystander() {
    let both = study(&Oscillators::new(&["rk4"], 200).with_engine(&["rk4"]));
    let aside = study(
        &Oscillators::new(&["rk4"], 200)
            .with_engine(&["rk4"])
            .with_full_aside(),
    );
    assert_eq!(errors(&aside, "engine"), errors(&both, "engine"));
    assert!(aside.rows.iter().all(|row| row.plant == "engine"));
    let note = &aside.references[0];
    assert_eq!(note.of_plant.as_deref(), Some("full"));
    let why = note.why.as_ref().unwrap();
    assert!(why.contains("not in this study"), "{why}");
}

#[test]
fn engine_without_model_is_its_own_reference_with_a_note() {
    let standalone = study(
        &Oscillators::new(&["rk4"], 200)
            .with_engine(&["rk4"])
            .without_full(),
    );
    let note = &standalone.references[0];
    assert_eq!(note.of_plant, None);
    let why = note.why.as_ref().unwrap();
    assert!(
        why.contains("there is no plant full") && why.contains("measured against itself"),
        "{why}"
    );
    let finest = *errors(&standalone, "engine").last().unwrap();
    assert!(finest < 1e-3 * DETUNED_M.start, "{finest}");
    assert!(standalone.dominances().is_empty());
    // The same holds if the check of the model's reference contradicts it.
    let biased = study(&Oscillators::new(&["rk4", "biased"], 200).with_engine(&["rk4"]));
    let why = biased.references[1].why.as_ref().unwrap();
    assert!(
        why.contains("contradict each other") && why.contains("measured against itself"),
        "{why}"
    );
}

#[test]
fn comparisons_follow_from_the_rows() {
    let methods = ["rk4", "semi-implicit", "tolerant"];
    let found = study(&Oscillators::new(&methods, 200).with_engine(&["rk4", "explicit-euler"]));
    let [dominance] = &found.dominances()[..] else {
        panic!("one model, one engine");
    };
    let floor = found.references[0]
        .check
        .as_ref()
        .unwrap()
        .disagreement_rms_m;
    let rows = || {
        found
            .rows
            .iter()
            .filter(|row| row.kind == RowKind::Integration)
    };
    // A run shorter than the resolution of the clock has no cost.
    let cost = |row: &Row| row.run_s_per_simulated_s.filter(|&cost| cost > 0.0);
    let sound = rows().filter(|row| row.error_rms_m.is_some() && cost(row).is_some());
    let sound = sound.filter(|row| row.plant == "engine");
    assert_eq!(dominance.settings.len(), sound.count());
    for comparison in &dominance.settings {
        let full = rows().filter(|row| row.plant == "full");
        let known = full.filter_map(|row| Some((row.error_rms_m?, cost(row)?)));
        let closer = known.filter(|(error, _)| error.max(floor) <= comparison.error_rms_m);
        let least = closer.map(|(_, cost)| cost).fold(f64::INFINITY, f64::min);
        let text = comparison.no_greater_error.as_ref();
        assert_eq!(
            text.map_or(f64::INFINITY, |competitor| competitor.run_s_per_simulated_s),
            least
        );
    }
}

#[test]
fn stiffness_trend_separates_spring_limits_from_others() {
    let methods = ["rk4", "explicit-euler", "capped"];
    let factory = Oscillators::new(&methods, 200).with_engine(&["capped"]);
    let found = stability::study(&factory, &[Factor::Stiffness]);
    let all = found.stiffnesses();
    let of = |plant: &str, method: &str| -> StiffnessTrend {
        let mut all = all.iter();
        let trend = all.find(|trend| (&*trend.plant.name, &*trend.method) == (plant, method));
        trend.unwrap().clone()
    };
    // 2ζ/ω; the damping does not depend on the spring.
    let damped = of("full", "explicit-euler");
    assert_eq!(damped.depends, Some(true));
    assert!((damped.exponent.unwrap() + 1.0).abs() < 0.05, "{damped:?}");
    // √8/ω where damping is small against the spring, less for softer springs.
    let swinging = of("full", "rk4");
    assert_eq!(swinging.depends, Some(true));
    assert!(
        (swinging.exponent.unwrap() + 0.5).abs() < 0.1,
        "{swinging:?}"
    );
    // The cap is the limit at low stiffness, the spring at high.
    let mixed = of("full", "capped");
    assert!(
        mixed.greatest_step_s.unwrap() <= crate::oscillator::CAP_S,
        "{mixed:?}"
    );
    assert_eq!(of("engine", "capped").depends, mixed.depends);
}

#[test]
fn fixed_cap_does_not_depend_on_stiffness() {
    // Without the stiff springs, whose own limit is below the cap.
    let factory = Oscillators::new(&["rk4", "capped"], 200).with_engine(&["capped"]);
    let mut found = stability::study(&factory, &[Factor::Stiffness]);
    found.rows.retain(|row| row.scales.stiffness <= 1.0);
    let all = found.stiffnesses();
    let capped: Vec<_> = all
        .iter()
        .filter(|trend| trend.method == "capped")
        .collect();
    assert_eq!(capped.len(), 2);
    for trend in capped {
        assert_eq!(trend.depends, Some(false), "{trend:?}");
        assert!(trend.exponent.unwrap().abs() <= trend.none_below.unwrap());
    }
}

#[test]
fn engine_keeps_its_reference_for_changed_robots() {
    let factory = Oscillators::new(&["rk4"], 200).with_engine(&["rk4"]);
    let found = stability::study(&factory, &[Factor::Stiffness]);
    let errors = |plant: &'static str| {
        let rows = found.rows.iter().filter(move |row| row.plant == plant);
        rows.filter(|row| row.largest_stable_step_s.is_some())
            .map(|row| row.error_rms_m)
            .collect::<Vec<_>>()
    };
    assert_eq!(errors("engine").len(), errors("full").len());
    assert!(errors("engine").iter().all(Option::is_some));
    let least = SimDuration::from_micros(1);
    assert!(found.grid_s > least.as_secs_f64());
}

#[test]
fn steps_of_an_engine_alone_have_neither_energy_nor_stability() {
    let factory = Oscillators::new(&["rk4"], 200).with_engine(&["semi-implicit", STEP_ONLY]);
    let found = study(&factory);
    let residuals = |method: &str| {
        let rows = found.rows.iter();
        let rows = rows.filter(|row| row.plant == "engine" && row.method == method);
        rows.map(|row| row.energy_residual_j.is_some())
            .collect::<Vec<_>>()
    };
    assert!(residuals("semi-implicit").iter().all(|known| *known));
    let alone = residuals(STEP_ONLY);
    assert!(!alone.is_empty() && alone.iter().all(|known| !known));
    let limits = stability::study(&factory, &[]);
    assert!(limits.rows.iter().all(|row| row.method != STEP_ONLY));
    assert!(limits.rows.iter().any(|row| row.method == "semi-implicit"));
}
