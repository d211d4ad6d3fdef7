//! Plants that solve the model of another by other means.

use twinrig_kernel::SimDuration;
use twinrig_study::{Factor, PrecisionPlan, RowKind, StiffnessTrend, Study, precision};

use crate::oscillator::{Oscillators, SOFT};
use crate::stability;

fn study(factory: &Oscillators) -> Study {
    let plan = PrecisionPlan {
        repetitions: 1,
        budget_s: 1e9,
        ..PrecisionPlan::default()
    };
    precision(factory, &plan, &mut ()).unwrap()
}

/// The errors of `plant`, the longest step first \[m\].
fn errors(study: &Study, plant: &str) -> Vec<f64> {
    let ours = study.rows.iter();
    let ours = ours.filter(|row| row.plant == plant && row.kind == RowKind::Integration);
    ours.map(|row| row.error_rms_m.unwrap()).collect()
}

/// The oscillator of frequency ω√(1 − SOFT) leaves that of ω by ω t SOFT/2 of its amplitude: a centimetre, over ω t = 20, damped by
/// a tenth.
const DETUNED_M: std::ops::Range<f64> = 1e-6..1e-4;

#[test]
fn what_an_engine_gets_wrong_at_every_step_shows_against_the_reference_of_the_model() {
    let found = study(&Oscillators::new(&["rk4", "semi-implicit"], 200).with_engine(&["rk4"]));
    let note = &found.references[1];
    assert_eq!(
        (&*note.plant, note.of_plant.as_deref()),
        ("engine", Some("full"))
    );
    assert_eq!(note.check, found.references[0].check);
    let soft = errors(&found, "engine");
    let finest = *soft.last().unwrap();
    assert!(DETUNED_M.contains(&finest), "{finest}");
    // Twice as soft, twice as far off: it is the softness, which a shorter step does not mend.
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
    // It is another way to the same model, and no other model.
    assert!(found.rows.iter().all(|row| row.kind != RowKind::Model));
}

#[test]
fn the_reference_of_a_model_that_is_not_in_the_study_is_built_all_the_same() {
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
fn without_the_model_an_engine_is_its_own_reference_and_the_study_says_what_that_hides() {
    let alone = study(
        &Oscillators::new(&["rk4"], 200)
            .with_engine(&["rk4"])
            .without_full(),
    );
    let note = &alone.references[0];
    assert_eq!(note.of_plant, None);
    let why = note.why.as_ref().unwrap();
    assert!(
        why.contains("there is no plant full") && why.contains("measured against itself"),
        "{why}"
    );
    let finest = *errors(&alone, "engine").last().unwrap();
    assert!(finest < 1e-3 * DETUNED_M.start, "{finest}");
    assert!(alone.dominances().is_empty());
    // Nor is there one where the model has a reference that its check contradicts.
    let lying = study(&Oscillators::new(&["rk4", "lying"], 200).with_engine(&["rk4"]));
    let why = lying.references[1].why.as_ref().unwrap();
    assert!(
        why.contains("contradict each other") && why.contains("measured against itself"),
        "{why}"
    );
}

#[test]
fn a_duel_is_what_its_rows_say() {
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
    let sound = rows().filter(|row| row.plant == "engine" && row.error_rms_m.is_some());
    assert_eq!(dominance.settings.len(), sound.count());
    for comparison in &dominance.settings {
        let full = rows().filter(|row| row.plant == "full");
        let known = full.filter_map(|row| Some((row.error_rms_m?, row.run_s_per_simulated_s?)));
        let closer = known.filter(|(error, _)| error.max(floor) <= comparison.error_rms_m);
        let least = closer.map(|(_, cost)| cost).fold(f64::INFINITY, f64::min);
        let told = comparison.no_greater_error.as_ref();
        assert_eq!(
            told.map_or(f64::INFINITY, |rival| rival.run_s_per_simulated_s),
            least
        );
    }
}

#[test]
fn springs_are_told_from_what_is_not_theirs_by_how_limits_go_with_stiffness() {
    let methods = ["rk4", "explicit-euler", "capped"];
    let factory = Oscillators::new(&methods, 200).with_engine(&["capped"]);
    let found = stability::study(&factory, &[Factor::Stiffness]);
    let all = found.stiffnesses();
    let of = |plant: &str, method: &str| -> StiffnessTrend {
        let mut all = all.iter();
        let trend = all.find(|trend| (&*trend.plant, &*trend.method) == (plant, method));
        trend.unwrap().clone()
    };
    // 2ζ/ω, whose damping does not go with the spring.
    let damped = of("full", "explicit-euler");
    assert_eq!(damped.depends, Some(true));
    assert!((damped.exponent.unwrap() + 1.0).abs() < 0.05, "{damped:?}");
    // √8/ω where damping is little beside the spring, less where there is more of it.
    let swinging = of("full", "rk4");
    assert_eq!(swinging.depends, Some(true));
    assert!(
        (swinging.exponent.unwrap() + 0.5).abs() < 0.1,
        "{swinging:?}"
    );
    // Below some stiffness the cap alone limits it, and above the spring does.
    let mixed = of("full", "capped");
    assert!(
        mixed.greatest_step_s.unwrap() <= crate::oscillator::CAP_S,
        "{mixed:?}"
    );
    assert_eq!(of("engine", "capped").depends, mixed.depends);
}

#[test]
fn a_limit_that_no_spring_moves_does_not_depend_on_stiffness() {
    // Stiff springs are left out: those whose own limit is below the cap.
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
fn an_engine_keeps_its_reference_when_the_robot_changes() {
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
