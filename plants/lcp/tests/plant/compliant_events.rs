//! Events of compliant constraints: instants, counts, snapshots, resuming.

use twinrig_kernel::SimDuration;
use twinrig_lcp::{Constraints, Lcp, Method, Options};
use twinrig_legged::Setup;
use twinrig_runtime::{Plant, PlantEvent, PlantEventKind};
use twinrig_testing::plant_harness::{at_ms, at_us};
use twinrig_testing::robots::robot;

use crate::harness::{
    DEFAULT, Harness, hard_impact, lcp, lowered_ground, standing_setup, suspended,
};

fn drop() -> Setup {
    Setup {
        ground: Some(lowered_ground(0.1, 0.6)),
        ..standing_setup()
    }
}

fn compliant(setup: &Setup, tolerance: f64, toe: bool) -> Harness {
    let options = Options {
        setup: setup.clone(),
        constraints: Constraints::Compliant,
        method: Method::Rk4,
        tolerance,
        toe,
        features: twinrig_lcp::Features::Detected,
    };
    let mut plant = Lcp::new(&robot(), &options, &|_| true).unwrap();
    plant.log_events(true);
    Harness::new(plant)
}

/// Returns the events of a run, after those of the start pose, which has gaps of zero.
fn events(harness: &mut Harness, until_ms: u64) -> Vec<PlantEvent> {
    harness.advance_to_ms(until_ms);
    let events = harness.plant.events().iter();
    events.filter(|event| event.at_s > 1e-3).cloned().collect()
}

fn touch_downs(events: &[PlantEvent]) -> Vec<&PlantEvent> {
    let reached = |event: &&PlantEvent| event.kind == PlantEventKind::Reached;
    let ground = |event: &&PlantEvent| event.part.ends_with("/ground");
    events.iter().filter(reached).filter(ground).collect()
}

/// The first events of each part and direction, sorted by these.
fn firsts(events: &[PlantEvent]) -> Vec<&PlantEvent> {
    let mut firsts: Vec<&PlantEvent> = Vec::new();
    for event in events {
        let key = |e: &PlantEvent| (e.part.clone(), e.kind);
        if firsts.iter().all(|first| key(first) != key(event)) {
            firsts.push(event);
        }
    }
    firsts.sort_by_key(|event| (event.part.clone(), event.kind));
    firsts
}

/// Returns the number of feet that touch down.
fn firsts_on_ground(events: &[PlantEvent]) -> usize {
    touch_downs(&firsts(events).into_iter().cloned().collect::<Vec<_>>()).len()
}

#[test]
fn instants_converge_with_the_tolerance() {
    for setup in [drop(), suspended(hard_impact())] {
        let fine = events(&mut compliant(&setup, 1e-9, false), 180);
        assert!(fine.len() > 8, "{fine:?}");
        assert!(fine.is_sorted_by(|a, b| a.at_s <= b.at_s));
        for tolerance in [2e-6, 1e-7] {
            // The control permits an error of the tolerance in each millisecond, 360 of it over the
            // run, and an instant errs by that of the depth over its rate. Rates of some 0.1 m/s
            // and more would permit thousands of s/m; errors that do not add up leave 13 s/m, and
            // both tolerances share one bound because the error is proportional.
            let error_s = 20.0 * tolerance;
            let coarse = events(&mut compliant(&setup, tolerance, false), 180);
            let (fine, coarse) = (firsts(&fine), firsts(&coarse));
            assert_eq!(fine.len(), coarse.len(), "{fine:?} {coarse:?}");
            for (a, b) in fine.iter().zip(&coarse) {
                assert_eq!((&a.part, a.kind), (&b.part, b.kind));
                assert!(
                    (a.at_s - b.at_s).abs() < error_s,
                    "{tolerance:e}: {a:?} {b:?}"
                );
            }
        }
    }
}

#[test]
fn foot_is_on_the_ground_at_its_touch_down() {
    let logged = events(&mut compliant(&drop(), 1e-7, false), 160);
    let mut landings = touch_downs(&logged);
    landings.truncate(4);
    assert_eq!(landings.len(), 4);
    for event in landings {
        let mut harness = compliant(&drop(), 1e-7, false);
        let at = SimDuration::try_from_secs_f64(event.at_s).unwrap();
        let at = at.as_nanos() / 1000;
        harness.advance_to_us(at);
        let signal = event.part.replace("/ground", "/foot/position");
        let (before, speed) = (harness.read(&signal)[2], 1.4);
        // Within a microsecond of the instant, at less than the speed of the fall.
        harness.advance_to_us(at + 1);
        let after = harness.read(&signal)[2];
        let level = -0.1;
        assert!(
            after < level && level <= before + 1e-9,
            "{event:?}: {before} {after}"
        );
        assert!(before - after < speed * 1e-6);
    }
}

#[test]
fn drop_touches_down_as_often_as_with_rigid_constraints() {
    let until_ms = 148;
    let smooth = events(&mut compliant(&drop(), 1e-7, false), until_ms);
    let mut rigid = lcp(&robot(), &drop(), DEFAULT);
    rigid.plant.log_events(true);
    let rigid = events(&mut rigid, until_ms);
    let [smooth, rigid] = [&smooth, &rigid].map(|events| touch_downs(events));
    assert_eq!(smooth.len(), 4, "{smooth:?}");
    assert_eq!(rigid.len(), 4, "{rigid:?}");
    for event in &rigid {
        let same = smooth.iter().find(|other| other.part == event.part);
        assert!((same.unwrap().at_s - event.at_s).abs() < 1e-3);
    }
}

#[test]
fn log_has_no_influence_and_counts_are_those_of_the_log() {
    for toe in [false, true] {
        let mut logged = compliant(&drop(), 2e-6, toe);
        let mut silent = compliant(&drop(), 2e-6, toe);
        silent.plant.log_events(false);
        logged.advance_to_ms(250);
        silent.advance_to_ms(250);
        assert!(silent.plant.events().is_empty());
        assert_eq!(logged.observe(), silent.observe());
        assert_eq!(logged.plant.work(), silent.plant.work());
        let events = logged.plant.events();
        assert_eq!(logged.plant.work().events, events.len() as u64);
        let toes = events.iter().any(|event| event.part.ends_with("/toe"));
        assert_eq!(toes, toe);
        // Every element alternates.
        for event in events {
            let part = events.iter().filter(|other| other.part == event.part);
            let kinds: Vec<_> = part.map(|other| other.kind).collect();
            assert!(kinds.is_sorted_by(|a, b| a != b), "{event:?}: {kinds:?}");
        }
    }
}

#[test]
fn events_of_a_restored_run_are_logged_once() {
    let mut whole = compliant(&drop(), 2e-6, false);
    // Whole nanoseconds of which some are close to events.
    let instants: Vec<_> = (0..400).map(|k| at_us(130_000 + 97 * k)).collect();
    let commands = whole.commands.clone();
    whole.plant.advance(at_ms(130), &commands).unwrap();
    let mut pieces = whole.plant.events().to_vec();
    for at in instants {
        let saved = whole.plant.save();
        let mut other = compliant(&drop(), 1e-3, false);
        other.plant.restore(&saved).unwrap();
        for plant in [&mut whole.plant, &mut other.plant] {
            plant.advance(at.max(at_us(130_001)), &commands).unwrap();
        }
        pieces.extend(other.plant.events().iter().cloned());
    }
    assert_eq!(pieces, whole.plant.events());
    assert!(pieces.len() > 12);
}

#[test]
fn failed_step_leaves_no_events() {
    let mut harness = compliant(&drop(), f64::INFINITY, false);
    let failed = (1..200).find(|k| harness.try_advance_to_us(20_000 * k).is_err());
    assert!(failed.is_some(), "20 ms are too long a step");
    let events = harness.plant.events();
    let last = harness.now_us as f64 * 1e-6;
    assert!(
        events.iter().all(|event| event.at_s <= last + 1e-9),
        "{events:?}"
    );
}

#[test]
fn resumed_plant_logs_on() {
    let mut rigid = lcp(&robot(), &drop(), DEFAULT);
    rigid.advance_to_ms(120);
    let state = rigid.plant.state().unwrap();
    let mut smooth = compliant(&drop(), 2e-6, false);
    smooth.plant.resume_from(&state).unwrap();
    smooth.now_us = 120_000;
    let landings = events(&mut smooth, 148);
    assert_eq!(firsts_on_ground(&landings), 4);
    // And back, before the landing.
    let mut smooth = compliant(&drop(), 2e-6, false);
    smooth.advance_to_ms(120);
    let state = smooth.plant.state().unwrap();
    let mut rigid = lcp(&robot(), &drop(), DEFAULT);
    rigid.plant.log_events(true);
    rigid.plant.resume_from(&state).unwrap();
    rigid.now_us = 120_000;
    let landings = events(&mut rigid, 148);
    assert_eq!(firsts_on_ground(&landings), 4);
}
