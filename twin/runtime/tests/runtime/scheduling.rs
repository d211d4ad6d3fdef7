//! Properties of the scheduling rule, on rigs of toys.

use crate::toys::{Fixture, Log, any_fixture, expected_transfer};
use proptest::prelude::*;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::{Group, RunEvent, Timing};

/// Returns the busy intervals of a task; fails unless beginnings and ends alternate.
fn busy_intervals(log: &Log, task: usize) -> Vec<(SimTime, SimTime)> {
    let mut intervals = Vec::new();
    let mut begun = None;
    for (time, event) in log.events() {
        match event {
            RunEvent::TaskBegin { task: n } if n == task => {
                assert!(
                    begun.is_none(),
                    "task {task} received outputs at {time} while busy"
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

/// Returns the transfers that ended before the end of the run.
fn finished(
    wire: &[crate::toys::WireTransfer],
) -> impl Iterator<Item = (u64, &crate::toys::WireTransfer)> {
    (0..).zip(wire.iter().filter(|transfer| transfer.ended.is_some()))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn outputs_are_sent_to_idle_tasks_at_process_end_only(fixture in any_fixture()) {
        let run = fixture.run();
        let ends: Vec<SimTime> = run.log.events()
            .filter_map(|(time, event)| (event == RunEvent::ProcessEnd).then_some(time)).collect();
        for task in 0..fixture.delays.len() {
            for (begun, _) in busy_intervals(&run.log, task) {
                prop_assert!(ends.contains(&begun));
            }
        }
    }

    #[test]
    fn every_sample_is_read_once_and_in_order(fixture in any_fixture()) {
        let run = fixture.run();
        let tasks = fixture.delays.len();
        let mut reads = run.log.samples_of(Group::ProcessInputs);
        let (mut skipped, mut last) = (vec![false; tasks], vec![None::<Vec<f64>>; tasks]);
        for (time, event) in run.log.events() {
            match event {
                RunEvent::TaskSkipped { task, .. } => skipped[task] = true,
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
    fn task_is_skipped_iff_busy_at_process_begin(fixture in any_fixture()) {
        let run = fixture.run();
        let mut busy = vec![false; fixture.delays.len()];
        let mut skipped = busy.clone();
        for (_, event) in run.log.events() {
            match event {
                RunEvent::TaskBegin { task } => busy[task] = true,
                RunEvent::TaskEnd { task } => busy[task] = false,
                RunEvent::TaskSkipped { task, .. } => skipped[task] = true,
                RunEvent::ProcessBegin { .. } => {
                    prop_assert_eq!(&skipped, &busy);
                    skipped.fill(false);
                }
                _ => {}
            }
        }
    }

    #[test]
    fn elapsed_times_sum_to_physical_time(fixture in any_fixture()) {
        let run = fixture.run();
        let period = fixture.schedule.period().unwrap();
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
        // The sum computed by the process is its first output.
        for ((_, outputs), begun) in run.log.samples_of(Group::ProcessOutputs).zip(begins) {
            prop_assert_eq!(outputs[0], begun.as_nanos() as f64);
        }
    }

    /// The bytes of each transfer, their division into chunks, and the times of the chunks since
    /// its beginning are a function of the task, the number of the transfer and its command,
    /// independent of the process in the meantime.
    #[test]
    fn bytes_of_a_transfer_depend_on_its_own_data_only(fixture in any_fixture()) {
        let run = fixture.run();
        for (n, name) in fixture.names().iter().enumerate() {
            let commands = commands_of(&run.log, n, fixture.delays.len());
            for (number, transfer) in finished(&run.wires[n]) {
                let command = commands[usize::try_from(number).unwrap()];
                let expected =
                    expected_transfer(name, fixture.schedule.seed, fixture.delays[n], number, command);
                prop_assert_eq!(transfer, &expected);
            }
        }
    }

    #[test]
    fn slower_process_changes_only_the_data_of_transfers(
        fixture in any_fixture(), slow in 0_u64..3_000
    ) {
        // A process that runs at other times computes other commands: they and the checksum, which
        // depends on them, are excluded from the comparison.
        let slower = Fixture {
            schedule: twinrig_runtime::Schedule {
                compute: Timing::Constant(SimDuration::from_micros(slow)), ..fixture.schedule.clone()
            },
            ..fixture.clone()
        };
        let (fast, slow) = (fixture.run(), slower.run());
        for (fast, slow) in fast.wires.iter().zip(&slow.wires) {
            for ((_, a), (_, b)) in finished(fast).zip(finished(slow)) {
                prop_assert_eq!(without_command(a), without_command(b));
            }
        }
    }
}

/// Returns the commands of a task's transfers: the process's outputs at each process end at which
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

/// Returns times and sizes of the chunks of a transfer, and its bytes before the command.
fn without_command(transfer: &crate::toys::WireTransfer) -> (Vec<(SimDuration, usize)>, Vec<u8>) {
    let shape = transfer
        .chunks
        .iter()
        .map(|(at, bytes)| (*at, bytes.len()))
        .collect();
    let bytes: Vec<u8> = transfer
        .chunks
        .iter()
        .flat_map(|(_, bytes)| bytes.clone())
        .collect();
    (shape, bytes[..10].to_vec())
}
