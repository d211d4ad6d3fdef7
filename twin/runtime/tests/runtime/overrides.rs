//! Outputs of the process that the caller replaces.

use twinrig_kernel::{Port, SimDuration, SimTime, Unit};
use twinrig_runtime::{
    DirectIo, Group, Observer, Plant, PlantFault, Process, Rig, RigError, RunEvent, Schedule,
    Timing,
};

/// Process that adds 1 to each of its last outputs.
struct Counter;

impl Process for Counter {
    fn name(&self) -> &'static str {
        "counter"
    }
    fn ports(&self) -> Vec<Port> {
        vec![
            Port::output("left/force", Unit::Newton, 1),
            Port::output("right/force", Unit::Newton, 2),
        ]
    }
    fn step(&mut self, _: SimDuration, _: &[f64], outputs: &mut [f64]) {
        for output in outputs {
            *output += 1.0;
        }
    }
}

/// Plant that takes the commands and does nothing.
struct Sink;

impl Plant for Sink {
    fn name(&self) -> &'static str {
        "sink"
    }
    fn ports(&self) -> Vec<Port> {
        Counter.ports().iter().map(Port::mirrored).collect()
    }
    fn advance(&mut self, _: SimTime, _: &[f64]) -> Result<(), PlantFault> {
        Ok(())
    }
    fn observe(&mut self, _: &mut [f64]) {}
    fn restore(
        &mut self,
        _: &twinrig_kernel::Snapshot,
    ) -> Result<(), twinrig_kernel::SnapshotError> {
        Ok(())
    }
}

/// The last outputs of the process.
#[derive(Default)]
struct Last(Vec<f64>);

impl Observer for Last {
    fn samples(&mut self, _: SimTime, group: Group, values: &[f64]) {
        if group == Group::ProcessOutputs {
            self.0 = values.to_vec();
        }
    }
    fn event(&mut self, _: SimTime, _: RunEvent) {}
}

fn rig() -> Rig {
    let io = DirectIo::for_process("io", &Counter.ports(), Timing::ZERO, 1).unwrap();
    let schedule = Schedule::with_period(SimDuration::from_millis(1));
    Rig::new(
        &schedule,
        Box::new(Counter),
        vec![Box::new(io)],
        Box::new(Sink),
    )
    .unwrap()
}

/// Runs to the next control step and returns the outputs of the process.
fn next(rig: &mut Rig) -> Vec<f64> {
    let mut last = Last::default();
    rig.run_until(rig.now() + rig.period(), &mut last).unwrap();
    last.0
}

#[test]
fn replaced_output_applies_from_the_next_iteration_until_its_release() {
    let mut rig = rig();
    assert_eq!(next(&mut rig), [2.0, 2.0, 2.0]);
    rig.override_output("right/force", Some(&[10.0, 20.0]))
        .unwrap();
    assert_eq!(next(&mut rig), [3.0, 10.0, 20.0]);
    assert_eq!(
        next(&mut rig),
        [4.0, 10.0, 20.0],
        "also of an iteration that counts them"
    );
    let saved = rig.save();
    rig.override_output("right/force", None).unwrap();
    assert_eq!(next(&mut rig), [5.0, 11.0, 21.0]);
    rig.restore(&saved).unwrap();
    assert_eq!(
        next(&mut rig),
        [5.0, 10.0, 20.0],
        "replacements are part of the state"
    );
}

#[test]
fn invalid_replacements_are_refused() {
    let mut rig = rig();
    let mut refused = |signal: &str, values: &[f64]| {
        let error: RigError = rig.override_output(signal, Some(values)).unwrap_err();
        error.to_string()
    };
    assert_eq!(
        refused("left/forces", &[1.0]),
        "counter has no output `left/forces`; did you mean `left/force`?"
    );
    assert_eq!(
        refused("right/force", &[1.0]),
        "`right/force` cannot be replaced by [1.0]: it has 2 finite values"
    );
    assert!(refused("left/force", &[f64::NAN]).contains("finite"));
    assert_eq!(next(&mut rig), [2.0, 2.0, 2.0], "a refusal changes nothing");
}
