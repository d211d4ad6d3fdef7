//! The local engine: every task once, on any number of threads.

use std::collections::BTreeSet;
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicUsize, Ordering};

use twinrig_campaign::engine::{
    Engine, EngineEvent, EngineOptions, EngineStatus, Job, LocalEngine,
};
use twinrig_runtime::interrupt::{self, Token};

/// A job of this function, for this process only.
struct Here<F>(F);

impl<F: Fn(usize) -> Option<Vec<u8>> + Sync> Job for Here<F> {
    fn shared(&self) -> Vec<u8> {
        Vec::new()
    }

    fn task(&self, _: usize) -> Vec<u8> {
        Vec::new()
    }

    fn run(&self, index: usize) -> Option<Vec<u8>> {
        self.0(index)
    }
}

fn options(jobs: usize) -> EngineOptions {
    EngineOptions {
        jobs: NonZeroUsize::new(jobs),
        address: None,
    }
}

/// The result of a task.
fn result(task: usize) -> Vec<u8> {
    task.to_string().into_bytes()
}

type Ended = (usize, Result<Vec<u8>, String>);

/// Does the tasks; returns their results, in the order of their ends.
fn run(tasks: &[usize], jobs: usize, one: impl Fn(usize) -> Option<Vec<u8>> + Sync) -> Vec<Ended> {
    let mut ended = Vec::new();
    let mut observe = |event| {
        if let EngineEvent::Done { task, result } = event {
            ended.push((task, result));
        }
        true
    };
    let ran = LocalEngine.run(&Here(one), tasks, &options(jobs), &mut observe);
    assert_eq!(
        ran.unwrap().to_string().split(' ').next(),
        Some(&*jobs.to_string())
    );
    ended
}

#[test]
fn each_task_is_done_once_on_any_number_of_threads() {
    let tasks: Vec<usize> = (0..100).map(|n| 3 * n).collect();
    for jobs in [1, 2, 7, 200] {
        let mut ended = run(&tasks, jobs, |task| Some(result(task)));
        ended.sort_by_key(|(task, _)| *task);
        let expected: Vec<_> = tasks.iter().map(|&task| (task, Ok(result(task)))).collect();
        assert_eq!(ended, expected);
    }
    assert!(run(&[], 3, |_| None).is_empty());
}

#[test]
fn panic_of_one_task_ends_no_other() {
    let ended = run(&[0, 1, 2, 3], 2, |task| {
        assert!(task != 2, "no such point");
        Some(result(task))
    });
    let failed: Vec<_> = ended.iter().filter(|(task, _)| *task == 2).collect();
    let [(_, Err(panic))] = failed[..] else {
        panic!("{failed:?}")
    };
    assert!(panic.contains("no such point"));
    assert_eq!(ended.len(), 4);
}

/// The threads inherit the token, and the tasks that they have begun have no result.
#[test]
fn interrupt_of_the_token_ends_the_work() {
    let token = Token::new();
    let tasks: Vec<usize> = (0..1000).collect();
    let begun = AtomicUsize::new(0);
    let ended = token.scope(|| {
        run(&tasks, 2, |task| {
            if begun.fetch_add(1, Ordering::SeqCst) == 20 {
                token.request();
            }
            (!interrupt::is_requested()).then(|| result(task))
        })
    });
    let tasks: BTreeSet<usize> = ended.iter().map(|(task, _)| *task).collect();
    assert!((19..=21).contains(&ended.len()), "{}", ended.len());
    assert_eq!(tasks.len(), ended.len());
}

#[test]
fn observer_ends_the_work() {
    let tasks: Vec<usize> = (0..1000).collect();
    let mut count = 0;
    let mut observe = |event| {
        count += usize::from(matches!(event, EngineEvent::Done { .. }));
        count < 10
    };
    let job = Here(|task| {
        std::thread::sleep(std::time::Duration::from_micros(100));
        Some(result(task))
    });
    LocalEngine
        .run(&job, &tasks, &options(2), &mut observe)
        .unwrap();
    assert!(count < 900, "{count}");
}

#[test]
fn cluster_is_for_another_engine() {
    let options = EngineOptions {
        address: Some("auto".to_owned()),
        ..EngineOptions::default()
    };
    let ran = LocalEngine.run(&Here(|_| None), &[0], &options, &mut |_| true);
    let error = ran.unwrap_err().to_string();
    assert!(
        error.contains("choose the engine of the cluster"),
        "{error}"
    );
}

#[test]
fn status_counts_slots_and_machines() {
    let cluster = EngineStatus {
        workers: 8,
        machines: Some(1),
        repeated: 3,
        waits_s: None,
    };
    assert_eq!(cluster.to_string(), "8 slots of 1 machine, 3 begun again");
    assert_eq!(
        EngineStatus {
            workers: 1,
            ..EngineStatus::default()
        }
        .to_string(),
        "1 thread"
    );
}
