//! Runs that are sought back, changed and branched, against runs of their scenarios.

use std::path::Path;

use proptest::prelude::*;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_live::{Ended, Event, EventKind, LiveError, SNAPSHOT_BYTES, Session};
use twinrig_rig::{Assembly, Execution, Registry, execute_observed};

/// An act of a visitor.
#[derive(Clone, Debug)]
enum Visit {
    Advance(SimDuration),
    ToEvent,
    Back(SimDuration),
    /// Back or forth to a share of the scenario.
    Seek(f64),
    /// A variable, by a share of their number, to a share of its value, with a rate or without.
    Set(f64, f64, Option<f64>),
    Select(f64),
}

fn visit() -> impl Strategy<Value = Visit> {
    let share = 0.0..1.0;
    let factor = 0.9..1.1;
    let duration = (0_u64..150_000_000).prop_map(SimDuration::from_nanos);
    prop_oneof![
        3 => duration.clone().prop_map(Visit::Advance),
        2 => duration.prop_map(Visit::Back),
        1 => Just(Visit::ToEvent),
        2 => share.clone().prop_map(Visit::Seek),
        6 => (share.clone(), factor, prop::option::of(0.1..10.0))
            .prop_map(|(of, to, slew)| Visit::Set(of, to, slew)),
        1 => share.prop_map(Visit::Select),
    ]
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "a share of a small number"
)]
fn index(share: f64, count: usize) -> usize {
    ((share * count as f64) as usize).min(count - 1)
}

fn pay(session: &mut Session<'_>, visit: &Visit, end: SimTime) {
    match *visit {
        Visit::Advance(by) => session.advance(session.now() + by, &mut ()),
        Visit::ToEvent => {
            let before = session.now();
            if let Some(event) = session.advance_to_event(end, &mut ()).cloned() {
                assert!(event.at > before || before == SimTime::ZERO);
                assert_eq!(event.at, session.now());
            }
        }
        Visit::Back(by) => {
            let since = session.now().since_start();
            let at = SimTime::ZERO + since.checked_sub(by).unwrap_or(SimDuration::ZERO);
            session.seek(at, &mut ()).unwrap();
            assert_eq!(session.now(), at);
        }
        Visit::Seek(share) => {
            let at = SimDuration::try_from_secs_f64(end.as_secs_f64() * share).unwrap();
            session.seek(SimTime::ZERO + at, &mut ()).unwrap();
            assert_eq!(session.now(), SimTime::ZERO + at);
        }
        Visit::Set(of, factor, slew) => {
            let variables = session.variables().iter();
            let set: Vec<_> = variables.filter(|it| it.value() != 0.0).collect();
            let variable = set[index(of, set.len())];
            let (name, value) = (variable.name().to_owned(), variable.value() * factor);
            // One that the controller refuses is no change.
            let _ = session.set(&name, value, slew);
        }
        Visit::Select(share) => {
            let branch = index(share, session.branches().len());
            session.select(branch, None, &mut ()).unwrap();
            assert_eq!(session.present(), branch);
            assert_eq!(session.now(), session.branches()[branch].reached);
        }
    }
}

fn scenario(file: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../scenarios")
        .join(file);
    std::fs::read_to_string(path).unwrap()
}

/// Robot, plant, buses and controllers of the same kinds as in larger scenarios, in less time.
const PLANTS: [(&str, &str, &str); 4] = [
    ("trot.toml", "plant.model", "massless"),
    ("trot.toml", "plant.model", "lcp"),
    ("oncilla-trot.toml", "plant.model", "massless"),
    ("bench.toml", "seed", "2"),
];

fn assembly<'r>(registry: &'r Registry, (file, key, value): (&str, &str, &str)) -> Assembly<'r> {
    let setting = |key: &str, value: &str| twinrig_scenario::Setting {
        origin: "test".to_owned(),
        key: key.to_owned(),
        value: value.to_owned(),
    };
    let settings = [
        setting(key, value),
        setting("until", "600 ms"),
        setting("record", "{}"),
    ];
    let builder = Assembly::builder(registry).settings(&settings);
    builder
        .text(file, &scenario(file), "../../scenarios".as_ref())
        .unwrap()
}

/// Returns the fingerprint of the run of a scenario.
fn fingerprint(assembly: &Assembly<'_>) -> String {
    let report = execute_observed(assembly, &Execution::default(), &mut ()).unwrap();
    assert_eq!(report.error, None);
    report.fingerprint.unwrap()
}

/// Runs each branch to its end, first the present one from where it is, and its scenario.
fn assert_branches_are_runs(session: &mut Session<'_>, registry: &Registry, end: SimTime) {
    let present = session.present();
    let others = (0..session.branches().len()).filter(|branch| *branch != present);
    for branch in std::iter::once(present).chain(others) {
        if branch != session.present() {
            session.select(branch, None, &mut ()).unwrap();
        }
        session.advance(end, &mut ());
        // Changes that were yet to be made begin another one.
        let branch = session.present();
        let text = session.text_of(branch, "".as_ref()).unwrap();
        let builder = Assembly::builder(registry);
        let again = builder.text("branch.toml", &text, "".as_ref()).unwrap();
        assert_eq!(
            session.fingerprint().to_string(),
            fingerprint(&again),
            "{text}"
        );
        let branch = &session.branches()[branch];
        assert_eq!(branch.reached, session.now());
        assert_eq!(branch.fingerprint, Some(session.fingerprint()));
    }
}

fn check(plant: usize, visits: &[Visit], limit: usize) {
    let registry = Registry::standard();
    let assembly = assembly(&registry, PLANTS[plant]);
    let mut session = Session::new(&assembly, limit).unwrap();
    for visit in visits {
        pay(&mut session, visit, assembly.end());
        let reach = session.reach().unwrap();
        assert!(reach.bytes[0] <= reach.bytes[1].max(1 << 20), "{reach:?}");
    }
    assert_branches_are_runs(&mut session, &registry, assembly.end());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 50, failure_persistence: None, ..ProptestConfig::default() })]

    /// Any acts make branches whose scenarios have their fingerprints, on each plant that saves its
    /// state, also with a memory for few states.
    #[test]
    fn branches_are_runs_of_their_scenarios(
        plant in 0..PLANTS.len(),
        visits in prop::collection::vec(visit(), 4..16),
        limit in prop_oneof![Just(SNAPSHOT_BYTES), Just(1 << 20)],
    ) {
        check(plant, &visits, limit);
    }
}

fn ms(ms: u64) -> SimTime {
    SimTime::from_nanos(ms * 1_000_000)
}

/// Someone pauses, goes back, tries a change and returns: the run goes on as without visitors.
#[test]
fn the_original_goes_on_as_without_visitors() {
    let registry = Registry::standard();
    let assembly = assembly(&registry, PLANTS[0]);
    let mut session = Session::new(&assembly, SNAPSHOT_BYTES).unwrap();
    session.advance(ms(450), &mut ());
    session.seek(ms(250), &mut ()).unwrap();
    assert_eq!(session.branches().len(), 1);
    session.set("frequency", 2.0, None).unwrap();
    assert_eq!(
        session.branches().len(),
        1,
        "a run that does not go on has no other future"
    );
    session.advance(ms(500), &mut ());
    assert_eq!(session.branches().len(), 2);
    let [original, branch] = session.branches() else {
        panic!()
    };
    assert_eq!((original.reached, branch.reached), (ms(450), ms(500)));
    assert_eq!(
        (branch.parent, branch.begin, branch.acts.len()),
        (Some(0), ms(250), 1)
    );
    session.select(0, None, &mut ()).unwrap();
    session.advance(assembly.end(), &mut ());
    assert_eq!(session.ended(), Some(&Ended::Scenario));
    let original = session.fingerprint().to_string();
    assert_eq!(original, fingerprint(&assembly));
    session.select(1, None, &mut ()).unwrap();
    session.advance(assembly.end(), &mut ());
    assert_ne!(session.fingerprint().to_string(), original);
}

/// A branch is sought back to its own states, not to those that its parent has at later instants.
#[test]
fn states_of_another_future_are_not_restored() {
    let registry = Registry::standard();
    let assembly = assembly(&registry, PLANTS[0]);
    let mut session = Session::new(&assembly, SNAPSHOT_BYTES).unwrap();
    session.advance(ms(450), &mut ());
    session.seek(ms(250), &mut ()).unwrap();
    session.set("frequency", 2.0, None).unwrap();
    session.advance(ms(550), &mut ());
    session.seek(ms(420), &mut ()).unwrap();
    let (present, branches) = (session.present(), session.branches().len());
    assert_eq!((present, branches), (1, 2));
    assert_branches_are_runs(&mut session, &registry, assembly.end());
}

/// A scenario of a robot that stands.
fn stand<'r>(registry: &'r Registry, more: &str) -> Assembly<'r> {
    let text = format!(
        "robot = 'cheetah-cub'\nduration = '500 ms'\nplant = {{ model = 'massless', ground = {{}} }}\n\
         controller = {{ kind = 'stand', period = '2 ms', hip_height = '138 mm' }}\n{more}"
    );
    let builder = Assembly::builder(registry);
    builder.text("stand.toml", &text, "".as_ref()).unwrap()
}

/// A fall ends the session where it ends the run; before it there is another future.
#[test]
fn a_fall_ends_a_session_as_it_ends_a_run() {
    let registry = Registry::standard();
    // That of a robot which bends its legs.
    let bends = "fall = { height = 0.95, end = true }\n\
                 change = [{ at = '200 ms', set = 'hip_height', by = '-1 cm' }]\n";
    let assembly = stand(&registry, bends);
    let mut session = Session::new(&assembly, SNAPSHOT_BYTES).unwrap();
    session.advance(assembly.end(), &mut ());
    assert_eq!(session.ended(), Some(&Ended::Fall));
    let fell = session.now();
    assert!(fell > ms(200) && fell < ms(500), "{fell}");
    assert_eq!(session.fingerprint().to_string(), fingerprint(&assembly));
    let is_fall = |event: &Event| event.kind == EventKind::Fall && event.at == fell;
    assert!(session.events().0.any(is_fall));
    session.advance(assembly.end(), &mut ());
    assert_eq!(session.now(), fell);
    session.seek(ms(150), &mut ()).unwrap();
    for leg in ["fore", "hind"] {
        let name = format!("hip_height/{leg}");
        session.set(&name, 0.145, None).unwrap();
    }
    session.advance(ms(180), &mut ());
    assert_eq!((session.ended(), session.present()), (None, 1));
    assert_branches_are_runs(&mut session, &registry, assembly.end());
}

/// A change that the controller refuses ends a session with its reason; such a branch is no
/// scenario, and the run of the scenario goes on.
#[test]
fn a_failed_branch_leaves_the_run() {
    let registry = Registry::standard();
    let lower = "change = [{ at = '300 ms', set = 'hip_height/fore', by = '-1 cm' }]\n";
    let assembly = stand(&registry, lower);
    let mut session = Session::new(&assembly, SNAPSHOT_BYTES).unwrap();
    session.advance(ms(350), &mut ());
    session.seek(ms(200), &mut ()).unwrap();
    let variables = session.variables().iter();
    let height = variables.clone().find(|it| it.name() == "hip_height/fore");
    let (std::ops::Bound::Included(least), _) = height.unwrap().range() else {
        panic!()
    };
    session.set("hip_height/fore", least, None).unwrap();
    session.advance(assembly.end(), &mut ());
    let Some(Ended::Failed(why)) = session.ended() else {
        panic!("{:?}", session.ended())
    };
    assert!(why.contains("hip_height/fore"), "{why}");
    let error = session.text_of(1, "".as_ref()).unwrap_err();
    assert!(matches!(error, LiveError::Branch(_)), "{error}");
    session.select(0, None, &mut ()).unwrap();
    session.advance(assembly.end(), &mut ());
    assert_eq!(session.ended(), Some(&Ended::Scenario));
    assert_eq!(session.fingerprint().to_string(), fingerprint(&assembly));
}

/// The first event may be at the start.
#[test]
fn an_event_at_the_start_is_one() {
    let registry = Registry::standard();
    let first = "change = [{ at = '0 s', set = 'hip_height', to = '135 mm' }]\n";
    let assembly = stand(&registry, first);
    let mut session = Session::new(&assembly, SNAPSHOT_BYTES).unwrap();
    let event = session.advance_to_event(assembly.end(), &mut ()).cloned();
    let event = event.unwrap();
    assert_eq!((event.at, session.now()), (SimTime::ZERO, SimTime::ZERO));
    assert!(matches!(event.kind, EventKind::Change { .. }));
    session.advance(assembly.end(), &mut ());
    assert_eq!(session.fingerprint().to_string(), fingerprint(&assembly));
}

/// The memory that saved states take is what a session says, so that its limit is one.
#[test]
fn reach_tells_the_memory_of_saved_states() {
    let registry = Registry::standard();
    for file in [
        "trot.toml",
        "tegotae-tactile.toml",
        "bench.toml",
        "push.toml",
        "stand.toml",
    ] {
        let path = Path::new("../../scenarios").join(file);
        let assembly = Assembly::builder(&registry).file(&path).unwrap();
        let mut session = Session::new(&assembly, 1 << 30).unwrap();
        session.advance(ms(350), &mut ());
        let before = session.reach().unwrap();
        let used = allocation_counter::measure(|| session.advance(ms(1050), &mut ()));
        let after = session.reach().unwrap();
        assert_eq!(after.count - before.count, 7);
        let told = i64::try_from(after.bytes[0] - before.bytes[0]).unwrap();
        let used = used.bytes_current;
        assert!(
            (used..5 * used).contains(&told),
            "{file}: {told} told, {used} used"
        );
    }
}

/// A jump of a slider is a ramp of changes, none greater than the rate allows.
#[test]
fn slew_limits_the_steps_of_a_change() {
    let registry = Registry::standard();
    let assembly = assembly(&registry, PLANTS[0]);
    let mut session = Session::new(&assembly, SNAPSHOT_BYTES).unwrap();
    session.advance(ms(100), &mut ());
    let index = session
        .variables()
        .iter()
        .position(|it| it.name() == "frequency")
        .unwrap();
    let start = session.variables()[index].value();
    session.set("frequency", start + 0.5, Some(5.0)).unwrap();
    assert_eq!(session.target(index), Some(start + 0.5));
    session.advance(ms(300), &mut ());
    let period = session.rig().period().as_secs_f64();
    let acts = &session.branches()[0].acts;
    let values: Vec<f64> = std::iter::once(start)
        .chain(acts.iter().map(|it| it.value))
        .collect();
    assert!(
        values
            .windows(2)
            .all(|pair| pair[1] - pair[0] <= 5.0 * period + 1e-12)
    );
    assert!(
        values.len() > 8 && *values.last().unwrap() == start + 0.5,
        "{values:?}"
    );
    assert_eq!(session.variables()[index].value(), start + 0.5);
    assert_branches_are_runs(&mut session, &registry, assembly.end());
}

#[test]
fn refusals_name_the_reason_and_change_nothing() {
    let registry = Registry::standard();
    let assembly = assembly(&registry, PLANTS[0]);
    let mut session = Session::new(&assembly, SNAPSHOT_BYTES).unwrap();
    session.advance(ms(50), &mut ());
    let error = session.set("frequenzy", 2.0, None).unwrap_err();
    assert_eq!(
        error.to_string(),
        "there is no process variable `frequenzy`; similar: frequency"
    );
    let error = session.set("frequency", f64::NAN, None).unwrap_err();
    assert!(
        error
            .to_string()
            .starts_with("frequency = NaN is not in [0, "),
        "{error}"
    );
    let error = session.set("frequency", 2.0, Some(0.0)).unwrap_err();
    assert_eq!(error.to_string(), "a rate of 0 is not above 0");
    let error = session.seek(ms(601), &mut ()).unwrap_err();
    assert!(matches!(error, LiveError::PastEnd { .. }), "{error}");
    let error = session.select(1, None, &mut ()).unwrap_err();
    assert_eq!(error.to_string(), "there is no branch 1, only 1, from 0");
    session.advance(assembly.end(), &mut ());
    assert_eq!(session.branches().len(), 1);
    assert_eq!(session.fingerprint().to_string(), fingerprint(&assembly));
}

/// The events of a trot are its touch-downs and lift-offs, each at its own instant.
#[test]
fn events_are_found_one_by_one() {
    let registry = Registry::standard();
    let assembly = assembly(&registry, PLANTS[0]);
    let mut session = Session::new(&assembly, SNAPSHOT_BYTES).unwrap();
    let mut events = Vec::new();
    while let Some(event) = session.advance_to_event(assembly.end(), &mut ()).cloned() {
        events.push(event);
    }
    assert_eq!(session.ended(), Some(&Ended::Scenario));
    assert!(events.is_sorted_by(|a, b| a.at < b.at), "{events:?}");
    let touch_downs = events
        .iter()
        .filter(|it| matches!(it.kind, EventKind::TouchDown(_)));
    assert!(touch_downs.count() >= 4, "{events:?}");
    assert_eq!(session.fingerprint().to_string(), fingerprint(&assembly));
}
