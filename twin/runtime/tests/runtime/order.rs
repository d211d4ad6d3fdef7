//! Invariance of a run: order of registration, partition of the run, repetition.

use crate::toys::{Entry, Fixture, Log, any_fixture};
use proptest::prelude::*;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::{RunEvent, Timing};

/// Events of one task: begin, end, skip.
fn of_task(log: &Log, task: usize) -> Vec<(SimTime, char)> {
    let mark = |event| match event {
        RunEvent::TaskBegin { task: of } => (of == task).then_some('b'),
        RunEvent::TaskEnd { task: of } => (of == task).then_some('e'),
        RunEvent::TaskSkipped { task: of, .. } => (of == task).then_some('s'),
        _ => None,
    };
    log.events()
        .filter_map(|(time, event)| Some((time, mark(event)?)))
        .collect()
}

/// The run without task events: every sample, bit for bit, and every event of the process.
fn without_tasks(log: &Log) -> Vec<(SimTime, Entry)> {
    let of_a_task = |entry: &Entry| {
        matches!(
            entry,
            Entry::Event(
                RunEvent::TaskBegin { .. }
                    | RunEvent::TaskEnd { .. }
                    | RunEvent::TaskSkipped { .. }
            )
        )
    };
    log.0
        .iter()
        .filter(|(_, entry)| !of_a_task(entry))
        .cloned()
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn registration_order_has_no_effect(
        (fixture, order) in any_fixture().prop_flat_map(|fixture| {
            let order = Just(fixture.order.clone()).prop_shuffle();
            (Just(fixture), order)
        })
    ) {
        let shuffled = Fixture { order: order.clone(), ..fixture.clone() };
        let (a, b) = (fixture.run(), shuffled.run());
        prop_assert_eq!(without_tasks(&a.log), without_tasks(&b.log));
        prop_assert_eq!(&a.wires, &b.wires);
        for (index, &task) in order.iter().enumerate() {
            prop_assert_eq!(of_task(&a.log, task), of_task(&b.log, index));
        }
    }

    #[test]
    fn run_in_pieces_equals_run_at_once(fixture in any_fixture(), pieces in prop::collection::vec(0_u64..20_000_000, 0..8)) {
        let at_once = fixture.run();
        let (mut rig, _) = fixture.build();
        let mut log = Log::default();
        for piece in pieces {
            rig.run_until(SimTime::from_nanos(piece), &mut log).unwrap();
        }
        rig.run_until(fixture.duration, &mut log).unwrap();
        prop_assert_eq!(log, at_once.log);
        prop_assert_eq!(rig.save(), at_once.rig.save());
    }

    #[test]
    fn repeated_run_is_identical(fixture in any_fixture()) {
        let (a, b) = (fixture.run(), fixture.run());
        prop_assert_eq!(a.log, b.log);
        prop_assert_eq!(a.rig.save(), b.rig.save());
    }
}

#[test]
fn events_of_one_instant_are_ordered_by_rank() {
    // Period, compute time and observation period are all 1 ms, transfers take no time.
    let millisecond = SimDuration::from_millis(1);
    let mut schedule = twinrig_runtime::Schedule::with_period(millisecond);
    schedule.observe = millisecond;
    schedule.compute = Timing::Constant(millisecond);
    let fixture = Fixture {
        schedule,
        delays: vec![SimDuration::ZERO],
        order: vec![0],
        changes: vec![],
        duration: SimTime::ZERO + millisecond,
    };
    let text = |entry: &Entry| match entry {
        Entry::Samples(group, _) => format!("{group:?}"),
        Entry::Event(event) => format!("{event:?}").split(' ').next().unwrap().to_string(),
    };
    let log = fixture.run().log;
    let last: Vec<String> = log
        .0
        .iter()
        .filter(|(time, _)| *time == fixture.duration)
        .map(|(_, entry)| text(entry))
        .collect();
    let expected = [
        "ProcessEnd",
        "ProcessOutputs",
        "TaskBegin",
        "TaskEnd",
        "ProcessBegin",
        "ProcessInputs",
        "Plant",
    ];
    assert_eq!(last, expected);
}

/// Returns the number of events that a rig without tasks handles in 100 iterations, each of which
/// is followed by an observation.
fn handled_events(compute: SimDuration) -> usize {
    let millisecond = SimDuration::from_millis(1);
    let mut schedule = twinrig_runtime::Schedule::with_period(millisecond);
    schedule.observe = millisecond;
    schedule.compute = Timing::Constant(compute);
    let fixture = Fixture {
        schedule,
        delays: vec![],
        order: vec![],
        changes: vec![],
        duration: SimTime::ZERO + SimDuration::from_millis(99),
    };
    let (mut rig, _) = fixture.build();
    let handle = || rig.step(fixture.duration, &mut ()).unwrap();
    std::iter::from_fn(handle).count()
}

#[test]
fn iteration_of_zero_duration_ends_without_an_event_but_the_first() {
    assert_eq!(handled_events(SimDuration::from_micros(1)), 3 * 100 - 1);
    assert_eq!(handled_events(SimDuration::ZERO), 2 * 100 + 1);
}

#[test]
fn rig_is_send() {
    fn is_send<T: Send>() {}
    is_send::<twinrig_runtime::Rig>();
}
