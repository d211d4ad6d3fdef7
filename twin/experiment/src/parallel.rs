//! Independent runs of a study on the threads of this program, with results in order.

use serde::Serialize;
use serde::de::DeserializeOwned;
use twinrig_campaign::engine::{Engine, EngineEvent, EngineOptions, Job, LocalEngine};
use twinrig_runtime::interrupt;

use crate::error::StudyError;
use crate::stopwatch::Stopwatch;

/// Result of a run, or the reason of its failure.
pub type RunResult<T> = Result<T, String>;

struct Runs<'f, T> {
    run: &'f (dyn Fn(usize) -> RunResult<T> + Sync),
}

impl<T: Serialize> Job for Runs<'_, T> {
    fn shared(&self) -> Vec<u8> {
        Vec::new()
    }

    fn task(&self, _: usize) -> Vec<u8> {
        Vec::new()
    }

    fn run(&self, index: usize) -> Option<Vec<u8>> {
        let ran = (self.run)(index);
        // The results have lists, texts and numbers only, which can be serialised.
        (!interrupt::is_requested()).then(|| postcard::to_stdvec(&ran).unwrap_or_default())
    }
}

/// Does `count` runs, each on one thread, on all processors. `progress` gets the number of runs
/// done and the expected time left \[s\], and returns whether the study continues.
///
/// # Errors
/// [`StudyError::Interrupted`] if `progress` or an interrupt ended the study, and
/// [`StudyError::Engine`] without threads.
pub(crate) fn run_all<T: Serialize + DeserializeOwned>(
    count: usize,
    run: &(dyn Fn(usize) -> RunResult<T> + Sync),
    progress: &mut dyn FnMut(usize, f64) -> bool,
) -> Result<Vec<RunResult<T>>, StudyError> {
    let stopwatch = Stopwatch::start();
    let mut results: Vec<Option<RunResult<T>>> = (0..count).map(|_| None).collect();
    let tasks: Vec<usize> = (0..count).collect();
    let mut done = 0;
    let job = Runs { run };
    let options = EngineOptions::default();
    let ran = LocalEngine.run(&job, &tasks, &options, &mut |event| {
        if let EngineEvent::Done { task, result } = event {
            done += 1;
            let result = result.and_then(|bytes| {
                let read: Result<RunResult<T>, _> = postcard::from_bytes(&bytes);
                read.unwrap_or_else(|error| Err(format!("a result cannot be read: {error}")))
            });
            results[task] = Some(result);
        }
        let left_s = stopwatch.elapsed_s() * (count - done) as f64 / done.max(1) as f64;
        progress(done, left_s)
    });
    ran.map_err(|error| StudyError::Engine(error.to_string()))?;
    let results: Option<Vec<RunResult<T>>> = results.into_iter().collect();
    results.ok_or(StudyError::Interrupted { done, of: count })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_are_in_order_and_a_panic_is_one_of_them() {
        let run = |index: usize| match index {
            3 => Err("refused".to_owned()),
            4 => panic!("broken"),
            _ => Ok(index * index),
        };
        let found = run_all(6, &run, &mut |_, _| true).unwrap();
        assert_eq!(found[..3], [Ok(0), Ok(1), Ok(4)]);
        assert_eq!(found[3], Err("refused".to_owned()));
        assert!(found[4].as_ref().unwrap_err().contains("broken"));
        assert_eq!(found[5], Ok(25));
    }

    #[test]
    fn progress_ends_the_study() {
        let run = |index: usize| {
            std::thread::sleep(std::time::Duration::from_millis(1));
            Ok(index)
        };
        let found = run_all(1000, &run, &mut |done, _| done < 3);
        let Err(StudyError::Interrupted { done, of: 1000 }) = found else {
            panic!("{found:?}");
        };
        assert!((3..1000).contains(&done));
    }
}
