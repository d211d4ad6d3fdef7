//! Equality of the bus traffic with boards emulated in virtual time and with a served twin in real
//! time.

use std::collections::{BTreeMap, BTreeSet};

use super::trace::{CALIBRATE, MODES, TraceEvent, is_cyclic, read, requests, trace_of, written};
use super::{STAND, run_on_twin};
use crate::common::{Folder, twin};

/// Minimum number of compared cycles.
const CYCLES: usize = 1_000;
/// Increasing durations of the attempts, for machines that are too busy for the cycle of 2 ms
/// \[s\].
const DURATIONS: [u64; 4] = [3, 10, 30, 90];

#[test]
fn bus_traffic_in_virtual_and_real_time_is_identical() {
    let folder = Folder::new("exchange");
    let scenario = folder.file("bench.toml", STAND);
    let link = folder.join("bus");
    for seconds in DURATIONS {
        let lockstep = trace_of(&in_lockstep(&folder, &scenario, seconds));
        let real = at_a_port(&folder, &scenario, &link, seconds);
        let compared = compare(&lockstep, &real);
        println!("{compared} frames of {seconds} s are identical");
        if compared >= CYCLES {
            return;
        }
    }
    panic!("this machine is too busy for {CYCLES} cycles");
}

/// Runs in virtual time and returns the path of the recording. The run is longer than the one in
/// real time, because its duration includes the initialisation of the boards.
fn in_lockstep(folder: &Folder, scenario: &str, seconds: u64) -> String {
    let (out, duration) = (
        folder.join("lockstep"),
        format!("duration=\"{} s\"", seconds + 1),
    );
    let done = twin(&["run", scenario, "--out", &out, "--set", &duration]);
    assert_eq!(done.code, 0, "{done:?}");
    only_recording(&out)
}

/// Runs in real time on a served twin, until no request was repeated because of a late response: a
/// response later still would be attributed to another request.
fn at_a_port(folder: &Folder, scenario: &str, link: &str, seconds: u64) -> Vec<TraceEvent> {
    let duration = format!("duration=\"{seconds} s\"");
    for _ in 0..10 {
        let [run, served] = run_on_twin(folder, scenario, link, &["--set", &duration]);
        assert_eq!(run.code, Some(0), "{run:?}");
        println!("{}\n{}", run.out, served.out);
        let trace = trace_of(&only_recording(&folder.join("out")));
        let opening = opening(&trace);
        if opening.windows(2).all(|pair| pair[0] != pair[1]) {
            return trace;
        }
    }
    panic!("this machine is too busy to initialise the boards");
}

/// Moves the only recording out of a folder and returns its path.
fn only_recording(folder: &str) -> String {
    let mut files = std::fs::read_dir(folder).unwrap();
    let path = files.next().unwrap().unwrap().path().display().to_string();
    assert!(files.next().is_none());
    let kept = format!("{folder}.mcap");
    std::fs::rename(&path, &kept).unwrap();
    kept
}

/// Compares the bus traffic; returns the number of compared frames of control cycles.
fn compare(lockstep: &[TraceEvent], real: &[TraceEvent]) -> usize {
    assert_eq!(opening(lockstep), opening(real));
    let (reference, real) = (Cycles::of(lockstep), Cycles::of(real));
    assert!(reference.is_unbroken());

    // Commands are unique and thus identify the control step.
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
        "each control step is executed or reported as missed"
    );

    // One frame for each iteration at which the bus was not reported as busy.
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
        "most frames are distinct"
    );
    println!(
        "{} control steps missed, {} without the bus",
        real.missed,
        real.skipped.len()
    );
    real.frames.len()
}

/// Control cycles of a run.
#[derive(Default)]
struct Cycles<'s> {
    /// Commands of the iterations.
    commanded: Vec<&'s [u8]>,
    /// Numbers of the iterations with a busy bus.
    skipped: BTreeSet<usize>,
    /// Number of missed control steps.
    missed: usize,
    /// Frames written in the cycles.
    frames: Vec<&'s [u8]>,
}

impl<'s> Cycles<'s> {
    fn of(trace: &'s [TraceEvent]) -> Self {
        let mut cycles = Self::default();
        for event in trace {
            match event {
                TraceEvent::Missed => cycles.missed += 1,
                TraceEvent::Skipped => {
                    assert!(cycles.skipped.insert(cycles.commanded.len()));
                }
                TraceEvent::Commanded(commands) => cycles.commanded.push(commands),
                TraceEvent::Wrote(bytes) if is_cyclic(bytes) => cycles.frames.push(bytes),
                TraceEvent::Wrote(_) => {}
            }
        }
        cycles
    }

    fn is_unbroken(&self) -> bool {
        self.missed == 0 && self.skipped.is_empty() && self.frames.len() == self.commanded.len()
    }
}

/// Returns the requests before the first cycle without the polling of the calibration, whose number
/// depends on the timing.
fn opening(trace: &[TraceEvent]) -> Vec<Vec<u8>> {
    let mut calibrating = false;
    let mut opening = requests(trace);
    let cycles = opening.iter().position(|request| is_cyclic(request));
    opening.truncate(cycles.expect("there are cycles"));
    opening.retain(|request| {
        calibrating |= matches!(written(request), Some((_, CALIBRATE)));
        !calibrating || read(request).is_none_or(|register| !MODES.contains(&register))
    });
    assert!(calibrating && opening.len() > 100, "boards are initialised");
    opening
}
