//! What must make no difference to a run does make none.

mod toys;

use proptest::prelude::*;
use toys::{Entry, Log, Scene, any_scene};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::{RunEvent, Timing};

/// The run as it looks to one task: when it begins, ends and is skipped.
fn of_task(log: &Log, task: usize) -> Vec<(SimTime, char)> {
    let mark = |event| match event {
        RunEvent::TaskBegin { task: of } => (of == task).then_some('b'),
        RunEvent::TaskEnd { task: of } => (of == task).then_some('e'),
        RunEvent::TaskSkipped { task: of } => (of == task).then_some('s'),
        _ => None,
    };
    log.events()
        .filter_map(|(time, event)| Some((time, mark(event)?)))
        .collect()
}

/// The run without its tasks: every sample, bit for bit, and every event of the process.
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
    fn the_order_in_which_tasks_are_registered_changes_nothing(
        (scene, order) in any_scene().prop_flat_map(|scene| {
            let order = Just(scene.order.clone()).prop_shuffle();
            (Just(scene), order)
        })
    ) {
        let shuffled = Scene { order: order.clone(), ..scene.clone() };
        let (a, b) = (scene.run(), shuffled.run());
        prop_assert_eq!(without_tasks(&a.log), without_tasks(&b.log));
        prop_assert_eq!(&a.wires, &b.wires);
        for (place, &task) in order.iter().enumerate() {
            prop_assert_eq!(of_task(&a.log, task), of_task(&b.log, place));
        }
    }

    #[test]
    fn running_in_pieces_is_running_at_once(scene in any_scene(), pieces in prop::collection::vec(0_u64..20_000_000, 0..8)) {
        let whole = scene.run();
        let (mut rig, _) = scene.build();
        let mut log = Log::default();
        for piece in pieces {
            rig.run_until(SimTime::from_nanos(piece), &mut log).unwrap();
        }
        rig.run_until(scene.duration, &mut log).unwrap();
        prop_assert_eq!(log, whole.log);
        prop_assert_eq!(rig.save(), whole.rig.save());
    }

    #[test]
    fn two_runs_of_one_scene_are_one(scene in any_scene()) {
        let (a, b) = (scene.run(), scene.run());
        prop_assert_eq!(a.log, b.log);
        prop_assert_eq!(a.rig.save(), b.rig.save());
    }
}

#[test]
fn at_one_instant_transfers_end_then_the_process_then_it_begins_then_the_plant_is_seen() {
    // Period, compute time and observation grid are all 1 ms, transfers take no time.
    let millisecond = SimDuration::from_millis(1);
    let mut schedule = twinrig_runtime::Schedule::with_period(millisecond);
    schedule.observe = millisecond;
    schedule.compute = Timing::Constant(millisecond);
    let scene = Scene {
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
    let log = scene.run().log;
    let last: Vec<String> = log
        .0
        .iter()
        .filter(|(time, _)| *time == scene.duration)
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

#[test]
fn a_rig_may_be_built_here_and_run_on_another_thread() {
    fn is_send<T: Send>() {}
    is_send::<twinrig_runtime::Rig>();
}
