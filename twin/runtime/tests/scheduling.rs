//! Properties of the scheduling rule, on rigs of toys.

mod toys;

use proptest::prelude::*;
use toys::{Log, Scene, any_scene, expected_exchange};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::{Group, RunEvent, Timing};

/// What a task was at, event by event: fails unless beginnings and ends alternate.
fn busy_intervals(log: &Log, task: usize) -> Vec<(SimTime, SimTime)> {
    let mut intervals = Vec::new();
    let mut begun = None;
    for (time, event) in log.events() {
        match event {
            RunEvent::TaskBegin { task: n } if n == task => {
                assert!(
                    begun.is_none(),
                    "task {task} was given outputs at {time} while busy"
                );
                begun = Some(time);
            }
            RunEvent::TaskEnd { task: n } if n == task => {
                intervals.push((begun.take().expect("ended without having begun"), time));
            }
            _ => {}
        }
    }
    intervals.extend(begun.map(|begun| (begun, SimTime::MAX)));
    intervals
}

/// The transfers of each task that were over when the run was.
fn finished(wire: &[toys::Exchange]) -> impl Iterator<Item = (u64, &toys::Exchange)> {
    (0..).zip(wire.iter().filter(|exchange| exchange.ended.is_some()))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn outputs_reach_only_idle_tasks_and_only_when_the_process_ends(scene in any_scene()) {
        let run = scene.run();
        let ends: Vec<SimTime> = run.log.events()
            .filter_map(|(time, event)| (event == RunEvent::ProcessEnd).then_some(time)).collect();
        for task in 0..scene.delays.len() {
            for (begun, _) in busy_intervals(&run.log, task) {
                prop_assert!(ends.contains(&begun));
            }
        }
    }

    #[test]
    fn every_sample_is_read_once_and_in_order(scene in any_scene()) {
        let run = scene.run();
        let tasks = scene.delays.len();
        let mut reads = run.log.samples_of(Group::ProcessInputs);
        let (mut skipped, mut last) = (vec![false; tasks], vec![None::<Vec<f64>>; tasks]);
        for (time, event) in run.log.events() {
            match event {
                RunEvent::TaskSkipped { task } => skipped[task] = true,
                RunEvent::ProcessBegin { .. } => {
                    let (at, inputs) = reads.next().unwrap();
                    prop_assert_eq!(at, time);
                    for (task, sample) in inputs.chunks_exact(2).enumerate() {
                        match &last[task] {
                            None => prop_assert_eq!(sample, [0.0, 0.0]),
                            Some(last) if skipped[task] => prop_assert_eq!(sample, last),
                            Some(last) => prop_assert_eq!(sample[0], last[0] + 1.0),
                        }
                        last[task] = Some(sample.to_vec());
                    }
                    skipped.fill(false);
                }
                _ => {}
            }
        }
    }

    #[test]
    fn a_task_is_skipped_exactly_if_it_is_busy_when_the_process_begins(scene in any_scene()) {
        let run = scene.run();
        let mut busy = vec![false; scene.delays.len()];
        let mut skipped = busy.clone();
        for (_, event) in run.log.events() {
            match event {
                RunEvent::TaskBegin { task } => busy[task] = true,
                RunEvent::TaskEnd { task } => busy[task] = false,
                RunEvent::TaskSkipped { task } => skipped[task] = true,
                RunEvent::ProcessBegin { .. } => {
                    prop_assert_eq!(&skipped, &busy);
                    skipped.fill(false);
                }
                _ => {}
            }
        }
    }

    #[test]
    fn elapsed_times_sum_to_physical_time(scene in any_scene()) {
        let run = scene.run();
        let period = scene.schedule.period().unwrap();
        let (mut sum, mut begins, mut missed_next) = (SimDuration::ZERO, Vec::new(), 0);
        for (time, event) in run.log.events() {
            match event {
                RunEvent::Overrun { missed } => missed_next = missed,
                RunEvent::ProcessBegin { elapsed } => {
                    sum += elapsed;
                    prop_assert_eq!(SimTime::ZERO + sum, time);
                    prop_assert_eq!(elapsed.is_zero(), begins.is_empty());
                    prop_assert!(time.since_start().is_multiple_of(period), "begins on the grid");
                    if !begins.is_empty() {
                        prop_assert_eq!(elapsed, period * (1 + missed_next));
                    }
                    missed_next = 0;
                    begins.push(time);
                }
                _ => {}
            }
        }
        // What the process itself added up is its first output.
        for ((_, outputs), begun) in run.log.samples_of(Group::ProcessOutputs).zip(begins) {
            prop_assert_eq!(outputs[0], begun.as_nanos() as f64);
        }
    }

    /// A task's own protocol: the bytes of each of its transfers, how they are cut into chunks, and when
    /// each leaves after the transfer began. It is a function of the task, of the number of the transfer
    /// and of the data given to it when it began; what the process does meanwhile has no part in it.
    #[test]
    fn the_bytes_of_a_transfer_depend_on_its_own_data_alone(scene in any_scene()) {
        let run = scene.run();
        for (n, name) in scene.names().iter().enumerate() {
            let commands = commands_of(&run.log, n, scene.delays.len());
            for (number, exchange) in finished(&run.wires[n]) {
                let command = commands[usize::try_from(number).unwrap()];
                let expected =
                    expected_exchange(name, scene.schedule.seed, scene.delays[n], number, command);
                prop_assert_eq!(exchange, &expected);
            }
        }
    }

    #[test]
    fn a_slower_process_changes_no_byte_of_a_transfer_but_its_data(
        scene in any_scene(), slow in 0_u64..3_000
    ) {
        // A process that runs at other times computes other commands: they and the checksum, which
        // contains them, are left out of the comparison, all else is in it.
        let slower = Scene {
            schedule: twinrig_runtime::Schedule {
                compute: Timing::Constant(SimDuration::from_micros(slow)), ..scene.schedule.clone()
            },
            ..scene.clone()
        };
        let (fast, slow) = (scene.run(), slower.run());
        for (fast, slow) in fast.wires.iter().zip(&slow.wires) {
            for ((_, a), (_, b)) in finished(fast).zip(finished(slow)) {
                prop_assert_eq!(without_command(a), without_command(b));
            }
        }
    }
}

/// The commands that began the transfers of a task: the process's outputs at each of its ends at which
/// the task began.
fn commands_of(log: &Log, task: usize, tasks: usize) -> Vec<f64> {
    let mut outputs = log.samples_of(Group::ProcessOutputs);
    let (mut latest, mut commands) = (vec![0.0; tasks], Vec::new());
    for (_, event) in log.events() {
        match event {
            RunEvent::ProcessEnd => latest = outputs.next().unwrap().1,
            RunEvent::TaskBegin { task: n } if n == task => commands.push(latest[task]),
            _ => {}
        }
    }
    commands
}

/// Times and sizes of the chunks of a transfer, and its bytes as far as they precede the command.
fn without_command(exchange: &toys::Exchange) -> (Vec<(SimDuration, usize)>, Vec<u8>) {
    let shape = exchange
        .chunks
        .iter()
        .map(|(at, bytes)| (*at, bytes.len()))
        .collect();
    let bytes: Vec<u8> = exchange
        .chunks
        .iter()
        .flat_map(|(_, bytes)| bytes.clone())
        .collect();
    (shape, bytes[..10].to_vec())
}
