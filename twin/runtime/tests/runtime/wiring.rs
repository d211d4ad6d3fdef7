//! Signals connect by name, direction, size and unit; a mismatch is an error with similar signals.

use twinrig_kernel::{Port, SimDuration, SimTime, Unit};
use twinrig_runtime::{
    DirectIo, IoTask, Part, Plant, PlantAccess, PlantFault, Process, Progress, Rig, RigError,
    Schedule, TaskError, Timing,
};

/// An output of a process that needs no receiver.
const MONITOR: &str = "phase";

/// A part with a name and ports only.
struct Stub(&'static str, Vec<Port>);

impl Process for Stub {
    fn name(&self) -> &str {
        self.0
    }
    fn ports(&self) -> Vec<Port> {
        self.1.clone()
    }
    fn is_monitor(&self, output: &str) -> bool {
        output == MONITOR
    }
    fn step(&mut self, _: SimDuration, _: &[f64], _: &mut [f64]) {}
}

impl Part for Stub {}

impl IoTask for Stub {
    fn name(&self) -> &str {
        self.0
    }

    fn ports(&self) -> Vec<Port> {
        self.1.clone()
    }

    fn begin(
        &mut self,
        _: SimTime,
        _: &[f64],
        _: &mut dyn PlantAccess,
    ) -> Result<Progress, TaskError> {
        Ok(Progress::Done)
    }

    fn wake(&mut self, _: SimTime, _: &mut dyn PlantAccess) -> Result<Progress, TaskError> {
        Ok(Progress::Done)
    }

    fn to_process(&self) -> &[f64] {
        &[]
    }
}

impl Plant for Stub {
    fn name(&self) -> &str {
        self.0
    }
    fn ports(&self) -> Vec<Port> {
        self.1.clone()
    }
    fn advance(&mut self, _: SimTime, _: &[f64]) -> Result<(), PlantFault> {
        Ok(())
    }
    fn observe(&mut self, _: &mut [f64]) {}
}

fn command(name: &str) -> Port {
    Port::output(name, Unit::Radian, 1)
}

/// Wires a process to tasks, with a plant without signals.
fn wired(process: Vec<Port>, tasks: Vec<Stub>) -> Result<(), String> {
    let tasks = tasks
        .into_iter()
        .map(|task| Box::new(task) as Box<dyn IoTask>)
        .collect();
    rig(process, tasks, vec![])
}

fn rig(process: Vec<Port>, tasks: Vec<Box<dyn IoTask>>, plant: Vec<Port>) -> Result<(), String> {
    let schedule = Schedule::with_period(SimDuration::from_millis(1));
    let built = Rig::new(
        &schedule,
        Box::new(Stub("cpg", process)),
        tasks,
        Box::new(Stub("massless", plant)),
    );
    built.map(|_| ()).map_err(|error| match error {
        RigError::Wiring(error) => error.to_string(),
        other => panic!("{other}"),
    })
}

fn direct(process: &[Port]) -> Vec<Box<dyn IoTask>> {
    vec![Box::new(
        DirectIo::for_process("direct", process, Timing::ZERO, 1).unwrap(),
    )]
}

#[test]
fn unmatched_signal_is_reported_with_near_misses() {
    let servo = Stub(
        "servo",
        vec![
            command("leg/LF/hip/comand").mirrored(),
            command("leg/LF/knee").mirrored(),
        ],
    );
    assert_eq!(
        wired(
            vec![command("leg/LF/hip/command"), command("leg/LF/knee")],
            vec![servo]
        )
        .unwrap_err(),
        "nothing takes `leg/LF/hip/command [rad]`, which cpg writes; there is `leg/LF/hip/comand [rad]`"
    );
}

#[test]
fn size_or_unit_mismatch_is_reported_first() {
    let body = |unit, size| Stub("imu", vec![Port::output("body/rpy", unit, size)]);
    let reads = || vec![Port::input("body/rpy", Unit::Radian, 3)];
    assert_eq!(
        wired(reads(), vec![body(Unit::Radian, 4)]).unwrap_err(),
        "nothing provides `body/rpy [rad] × 3`, which cpg reads; there is `body/rpy [rad] × 4`"
    );
    assert_eq!(
        wired(reads(), vec![body(Unit::One, 3)]).unwrap_err(),
        "nothing provides `body/rpy [rad] × 3`, which cpg reads; there is `body/rpy [1] × 3`"
    );
    assert_eq!(wired(reads(), vec![body(Unit::Radian, 3)]), Ok(()));
}

#[test]
fn task_inputs_need_a_source_and_task_outputs_need_no_reader() {
    let servo = Stub("servo", vec![command("hip").mirrored()]);
    assert_eq!(
        wired(vec![], vec![servo]).unwrap_err(),
        "nothing provides `hip [rad]`, which servo reads"
    );
    let imu = Stub("imu", vec![Port::output("body/rpy", Unit::Radian, 3)]);
    assert_eq!(wired(vec![], vec![imu]), Ok(()));
}

#[test]
fn output_may_have_two_readers_and_input_one_source() {
    let servo = |name| Stub(name, vec![command("hip").mirrored()]);
    assert_eq!(
        wired(vec![command("hip")], vec![servo("left"), servo("right")]),
        Ok(())
    );
    let sensor = |name| Stub(name, vec![command("angle")]);
    assert_eq!(
        wired(
            vec![command("angle").mirrored()],
            vec![sensor("adc"), sensor("bus")]
        )
        .unwrap_err(),
        "`angle [rad]` of cpg has two sources: adc and bus"
    );
}

#[test]
fn names_are_unique() {
    assert_eq!(
        wired(vec![], vec![Stub("adc", vec![]), Stub("adc", vec![])]).unwrap_err(),
        "two tasks are named `adc`"
    );
    let twice = vec![command("hip"), command("hip")];
    assert_eq!(
        wired(twice.clone(), vec![]).unwrap_err(),
        "cpg has two outputs named `hip`"
    );
    assert_eq!(
        rig(vec![], vec![], twice).unwrap_err(),
        "massless has two outputs named `hip`"
    );
}

#[test]
fn direct_io_requires_the_process_signals_in_the_plant() {
    let process = vec![
        command("leg/LF/hip/command"),
        Port::input("body/position", Unit::Meter, 3),
    ];
    let plant = vec![
        Port::input("leg/LF/hip/command", Unit::Radian, 1),
        Port::output("leg/LF/foot/load", Unit::Newton, 1),
        Port::output("body/position", Unit::Meter, 3),
    ];
    assert_eq!(
        rig(process.clone(), direct(&process), plant.clone()),
        Ok(())
    );
    assert_eq!(
        rig(process.clone(), direct(&process), plant[1..].to_vec()).unwrap_err(),
        "nothing takes `leg/LF/hip/command [rad]`, which direct writes"
    );
    assert_eq!(
        rig(process.clone(), direct(&process), plant[..2].to_vec()).unwrap_err(),
        "nothing provides `body/position [m] × 3`, which direct reads"
    );
}

#[test]
fn monitor_needs_no_receiver_but_is_transferred_to_one() {
    let outputs = || vec![command("hip"), command(MONITOR)];
    let takes = |names: &[&str]| {
        let ports = names.iter().map(|name| command(name).mirrored());
        Stub("io", ports.collect())
    };
    assert_eq!(wired(outputs(), vec![takes(&["hip"])]), Ok(()));
    assert_eq!(wired(outputs(), vec![takes(&["hip", MONITOR])]), Ok(()));
    // Another output without a receiver, and a monitor of another unit.
    let error = wired(outputs(), vec![takes(&[MONITOR])]).unwrap_err();
    assert!(error.contains("nothing takes `hip [rad]`"), "{error}");
    let volts = Stub(
        "io",
        vec![
            command("hip").mirrored(),
            Port::input(MONITOR, Unit::Volt, 1),
        ],
    );
    let error = wired(outputs(), vec![volts]).unwrap_err();
    assert!(error.contains("nothing provides `phase [V]`"), "{error}");
}
