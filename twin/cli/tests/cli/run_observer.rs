//! Observers of the caller: they receive the samples of recorder and judge, and their polls end a
//! run.

use twinrig::kernel::SimTime;
use twinrig::runtime::Group;
use twinrig::runtime::interrupt::Token;
use twinrig::scenario::{Footstep, Setting};
use twinrig::{
    Assembly, Execution, Report, RunLayouts, RunObserver, RunProgress, Status, execute,
    execute_observed,
};

use crate::common::registry;

const TROT: &str = include_str!("../../../../scenarios/trot.toml");

/// Counts of what an observer received.
#[derive(Default)]
struct Seen {
    legs: Vec<String>,
    height: Option<usize>,
    lowest: f64,
    samples: u64,
    footsteps: u64,
    polls: u64,
    /// Number of polls after which the run is to end.
    polls_max: Option<u64>,
    token: Token,
}

impl RunObserver for Seen {
    fn begin(&mut self, layouts: &RunLayouts<'_>) {
        self.legs = layouts.legs.to_vec();
        let position = layouts.layout(Group::Plant).find("body/position");
        self.height = position.map(|range| range.end - 1);
        self.lowest = f64::INFINITY;
    }

    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        if group == Group::Plant {
            assert_eq!(now.as_nanos(), self.samples * 2_000_000);
            self.samples += 1;
            self.lowest = self.lowest.min(values[self.height.unwrap()]);
        }
    }

    fn footstep(&mut self, footstep: &Footstep) {
        assert!(footstep.lift_off.is_some() && footstep.leg < 4);
        self.footsteps += 1;
    }

    fn poll(&mut self, _: &RunProgress<'_>) {
        self.polls += 1;
        if self.polls_max == Some(self.polls) {
            self.token.request();
        }
    }
}

fn observed(text: &str, seen: &mut Seen) -> (Report, Report) {
    let registry = registry();
    let short = Setting {
        origin: "duration".to_owned(),
        key: "duration".to_owned(),
        value: "7 s".to_owned(),
    };
    let folder = "".as_ref();
    let assembly = Assembly::builder(&registry)
        .settings(&[short])
        .text("trot", text, folder)
        .unwrap();
    let execution = Execution::default();
    let token = seen.token.clone();
    let report = token.scope(|| execute_observed(&assembly, &execution, seen));
    (report.unwrap(), execute(&assembly, &execution).unwrap())
}

#[test]
fn observer_receives_the_samples_and_footsteps_that_are_judged() {
    let mut seen = Seen::default();
    let (report, unobserved) = observed(TROT, &mut seen);
    assert_eq!(report.fingerprint, unobserved.fingerprint);
    assert_eq!(seen.legs, ["LF", "RF", "LH", "RH"]);
    assert_eq!(seen.samples, 3501);
    assert_eq!(report.expectations[0].outcome.name, "does not fall");
    assert_eq!(report.expectations[0].outcome.measured, Some(seen.lowest));
    // 3.64 strides a second of four legs, less those of the ramp.
    assert!((70..=102).contains(&seen.footsteps), "{}", seen.footsteps);
    assert!(seen.polls >= 70);
}

#[test]
fn request_of_a_poll_ends_this_run_only() {
    let mut seen = Seen {
        polls_max: Some(3),
        ..Seen::default()
    };
    let (report, unobserved) = observed(TROT, &mut seen);
    assert_eq!(report.verdict, Status::Error);
    let error = report.error.unwrap();
    assert!(error.starts_with("interrupted at "), "{error}");
    assert!(seen.samples < 250, "{}", seen.samples);
    assert_eq!(unobserved.simulated_s, Some(7.0));
}

#[test]
fn reference_run_is_polled_but_not_observed() {
    let text = TROT.to_owned()
        + r#"
[[change]]
at = "6 s"
set = "frequency"
by = "0 Hz"

[[expect]]
name = "same footsteps"
footstep = { displacement = { max = "1 mm" }, against = "without changes" }
"#;
    let (mut seen, mut plain) = (Seen::default(), Seen::default());
    observed(&text, &mut seen);
    observed(TROT, &mut plain);
    assert_eq!(seen.samples, plain.samples);
    assert_eq!(seen.polls, 2 * plain.polls);
}
