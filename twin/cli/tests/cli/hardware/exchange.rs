//! The same build, the same process: whether boards are emulated beside it in virtual time or are at the other end of a port,
//! it asks the same things.

use std::collections::{BTreeMap, BTreeSet};

use super::trace::{CALIBRATE, Happened, MODES, is_cyclic, read, requests, story, written};
use super::{BENCH, run_at_a_twin};
use crate::common::{Folder, twin};

/// Cycles that are compared at least.
const CYCLES: usize = 1_000;
/// Longer and longer, on a machine that is too busy for a cycle every 2 ms.
const DURATIONS: [u64; 4] = [3, 10, 30, 90];

#[test]
fn a_twin_in_lockstep_and_one_at_a_port_are_asked_the_same_byte_for_byte() {
    let folder = Folder::new("exchange");
    let scenario = folder.file("bench.toml", BENCH);
    let link = folder.join("bus");
    for seconds in DURATIONS {
        let lockstep = story(&in_lockstep(&folder, &scenario, seconds));
        let real = at_a_port(&folder, &scenario, &link, seconds);
        let compared = compare(&lockstep, &real);
        println!("{compared} frames of {seconds} s are the same");
        if compared >= CYCLES {
            return;
        }
    }
    panic!("this machine is too busy to do {CYCLES} cycles");
}

/// Gives the path of a recording that is longer than the other one: it counts from before the boards are ready.
fn in_lockstep(folder: &Folder, scenario: &str, seconds: u64) -> String {
    let (out, duration) = (
        folder.join("lockstep"),
        format!("duration=\"{} s\"", seconds + 1),
    );
    let done = twin(&["run", scenario, "--out", &out, "--set", &duration]);
    assert_eq!(done.code, 0, "{done:?}");
    only_recording(&out)
}

/// The same at a port, without a request that had to be repeated because its answer was late: answers that come even later
/// would be taken for those of others.
fn at_a_port(folder: &Folder, scenario: &str, link: &str, seconds: u64) -> Vec<Happened> {
    let duration = format!("duration=\"{seconds} s\"");
    for _ in 0..10 {
        let [run, served] = run_at_a_twin(folder, scenario, link, &["--set", &duration]);
        assert_eq!(run.code, Some(0), "{run:?}");
        println!("{}\n{}", run.out, served.out);
        let story = story(&only_recording(&folder.join("out")));
        let opening = opening(&story);
        if opening.windows(2).all(|pair| pair[0] != pair[1]) {
            return story;
        }
    }
    panic!("this machine is too busy to get boards ready");
}

/// Takes the only recording out of a folder, which is empty then.
fn only_recording(folder: &str) -> String {
    let mut files = std::fs::read_dir(folder).unwrap();
    let path = files.next().unwrap().unwrap().path().display().to_string();
    assert!(files.next().is_none());
    let kept = format!("{folder}.mcap");
    std::fs::rename(&path, &kept).unwrap();
    kept
}

/// Compares what both put onto the bus; gives how many frames of cycles were.
fn compare(lockstep: &[Happened], real: &[Happened]) -> usize {
    assert_eq!(opening(lockstep), opening(real));
    let (reference, real) = (Cycles::of(lockstep), Cycles::of(real));
    assert!(reference.is_unbroken());

    // What was commanded tells the control step: no two are alike.
    let steps: BTreeMap<&[u8], usize> = reference.commanded.iter().copied().zip(0..).collect();
    assert_eq!(steps.len(), reference.commanded.len());
    let step = |commands: &[u8]| *steps.get(commands).expect("lockstep knows the command");
    let kept: Vec<usize> = real
        .commanded
        .iter()
        .map(|commands| step(commands))
        .collect();
    assert!(kept.is_sorted_by(|a, b| a < b), "control steps in order");
    let last = *kept.last().unwrap();
    assert_eq!(
        kept.len() + real.missed,
        last + 1,
        "control steps are kept, or said to be missed"
    );

    // A frame for each of them at which the bus was not said to be busy.
    let begun = kept.iter().enumerate();
    let begun = begun.filter(|(n, _)| !real.skipped.contains(n));
    let begun: Vec<usize> = begun.map(|(_, step)| *step).collect();
    assert_eq!(begun.len(), real.frames.len());
    for (step, frame) in begun.iter().zip(&real.frames) {
        assert_eq!(&reference.frames[*step], frame, "control step {step}");
    }

    let different: BTreeSet<&[u8]> = real.frames.iter().copied().collect();
    assert!(
        different.len() * 2 > real.frames.len(),
        "frames are told apart"
    );
    println!(
        "{} control steps missed, {} without the bus",
        real.missed,
        real.skipped.len()
    );
    real.frames.len()
}

/// The cycles of a run.
#[derive(Default)]
struct Cycles<'s> {
    /// What each iteration commanded.
    commanded: Vec<&'s [u8]>,
    /// Numbers of the iterations that found the bus busy.
    skipped: BTreeSet<usize>,
    /// Control steps that were missed.
    missed: usize,
    /// What was written for the cycles.
    frames: Vec<&'s [u8]>,
}

impl<'s> Cycles<'s> {
    fn of(story: &'s [Happened]) -> Self {
        let mut cycles = Self::default();
        for happened in story {
            match happened {
                Happened::Missed => cycles.missed += 1,
                Happened::Skipped => {
                    assert!(cycles.skipped.insert(cycles.commanded.len()));
                }
                Happened::Commanded(commands) => cycles.commanded.push(commands),
                Happened::Wrote(bytes) if is_cyclic(bytes) => cycles.frames.push(bytes),
                Happened::Wrote(_) => {}
            }
        }
        cycles
    }

    fn is_unbroken(&self) -> bool {
        self.missed == 0 && self.skipped.is_empty() && self.frames.len() == self.commanded.len()
    }
}

/// The requests before the first cycle, but for those that ask whether calibration is over: how often depends on the time.
fn opening(story: &[Happened]) -> Vec<Vec<u8>> {
    let mut calibrating = false;
    let mut opening = requests(story);
    let cycles = opening.iter().position(|request| is_cyclic(request));
    opening.truncate(cycles.expect("there are cycles"));
    opening.retain(|request| {
        calibrating |= matches!(written(request), Some((_, CALIBRATE)));
        !calibrating || read(request).is_none_or(|register| !MODES.contains(&register))
    });
    assert!(calibrating && opening.len() > 100, "boards are made ready");
    opening
}
