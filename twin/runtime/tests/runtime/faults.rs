//! A failing part ends the run with an error that has time and cause; earlier observations are
//! kept.

use crate::toys::{Log, ToyPlant, ToyProcess, ToyTask};
use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{
    Change, DirectIo, IoTask, Part, PlantAccess, Process, Progress, Rig, RigError, Schedule,
    TaskError, Timing,
};

fn millis(n: u64) -> SimTime {
    SimTime::ZERO + SimDuration::from_millis(n)
}

fn names() -> Vec<String> {
    vec!["toy0".into()]
}

fn schedule() -> Schedule {
    Schedule::with_period(SimDuration::from_millis(2))
}

fn toy_task() -> Box<dyn IoTask> {
    Box::new(ToyTask::new("toy0", 1, SimDuration::from_micros(100)))
}

fn rig_with(task: Box<dyn IoTask>, plant: ToyPlant) -> Rig {
    Rig::new(
        &schedule(),
        Box::new(ToyProcess::new(&names())),
        vec![task],
        Box::new(plant),
    )
    .unwrap()
}

#[test]
fn plant_fault_has_time_part_and_energy_and_keeps_earlier_records() {
    let mut plant = ToyPlant::new(&names());
    plant.fails_at = Some(millis(7));
    let mut log = Log::default();
    let mut rig = rig_with(toy_task(), plant);
    let error = rig.run_until(millis(20), &mut log).unwrap_err();
    let RigError::Plant(fault) = &error else {
        panic!("{error}")
    };
    assert_eq!((fault.time, fault.part.as_str()), (millis(7), "toy/spring"));
    assert!(
        error
            .to_string()
            .starts_with("toy/spring failed at 7.000 ms with a stored energy of "),
        "{error}"
    );

    let mut fault_free = Log::default();
    rig_with(toy_task(), ToyPlant::new(&names()))
        .run_until(millis(20), &mut fault_free)
        .unwrap();
    assert!(log.0.len() > 10 && fault_free.0.starts_with(&log.0));

    let count = log.0.len();
    assert_eq!(
        rig.run_until(millis(30), &mut log),
        Err(error),
        "a failed rig returns the same error"
    );
    assert_eq!(log.0.len(), count);
}

/// Task with scripted progress.
struct ScriptedTask(fn(SimTime) -> Result<Progress, TaskError>);

impl Part for ScriptedTask {}

impl IoTask for ScriptedTask {
    fn name(&self) -> &'static str {
        "scripted"
    }

    fn ports(&self) -> Vec<Port> {
        vec![
            Port::output("toy0/sample", Unit::One, 2),
            Port::input("toy0/command", Unit::Volt, 1),
        ]
    }

    fn begin(
        &mut self,
        now: SimTime,
        _: &[f64],
        _: &mut dyn PlantAccess,
    ) -> Result<Progress, TaskError> {
        (self.0)(now)
    }

    fn wake(&mut self, now: SimTime, _: &mut dyn PlantAccess) -> Result<Progress, TaskError> {
        (self.0)(now)
    }

    fn to_process(&self) -> &[f64] {
        &[0.0; 2]
    }
}

fn error_of(task: fn(SimTime) -> Result<Progress, TaskError>) -> RigError {
    rig_with(Box::new(ScriptedTask(task)), ToyPlant::new(&names()))
        .run_until(millis(4), &mut ())
        .unwrap_err()
}

#[test]
fn livelock_names_the_task() {
    let error = error_of(|now| Ok(Progress::WakeAt(now)));
    let text = error.to_string();
    assert!(matches!(error, RigError::Livelock(_)));
    assert!(text.contains("at 0 ns: scripted woke itself"), "{text}");
}

#[test]
fn wake_up_in_the_past_names_the_task() {
    let error = error_of(|now| match now.checked_since(millis(1)) {
        None => Ok(Progress::WakeAt(millis(1))),
        Some(_) => Ok(Progress::WakeAt(SimTime::ZERO)),
    });
    assert_eq!(
        error.to_string(),
        "scripted requested a wake-up at 0 ns, which is before the present time 1.000 ms"
    );
}

#[test]
fn device_failure_has_task_and_time() {
    let error = error_of(|_| {
        Err(TaskError::Device {
            why: "the port is gone".into(),
        })
    });
    assert_eq!(
        error.to_string(),
        "scripted failed at 0 ns: the port is gone"
    );
}

/// Process that writes `output` and has `fault` after each iteration.
struct Failing {
    inner: ToyProcess,
    output: f64,
    fault: Option<&'static str>,
}

impl Process for Failing {
    fn name(&self) -> &'static str {
        "failing"
    }
    fn ports(&self) -> Vec<Port> {
        self.inner.ports()
    }
    fn step(&mut self, _: SimDuration, _: &[f64], outputs: &mut [f64]) {
        outputs[0] = self.output;
    }
    fn fault(&self) -> Option<String> {
        self.fault.map(str::to_owned)
    }
    fn save(&self) -> Snapshot {
        self.inner.save()
    }
    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.inner.restore(snapshot)
    }
}

/// Returns the error that ends a run of [`Failing`], at its first iteration.
fn failure(output: f64, fault: Option<&'static str>) -> String {
    let inner = ToyProcess::new(&names());
    let process = Box::new(Failing {
        inner,
        output,
        fault,
    });
    let plant = Box::new(ToyPlant::new(&names()));
    let mut rig = Rig::new(&schedule(), process, vec![toy_task()], plant).unwrap();
    rig.run_until(millis(4), &mut ()).unwrap_err().to_string()
}

#[test]
fn non_finite_output_ends_the_run() {
    let error = failure(f64::INFINITY, None);
    assert_eq!(error, "failing wrote inf to `toy0/command` at 0 ns");
}

#[test]
fn fault_of_the_process_ends_the_run_and_comes_before_its_outputs() {
    let error = failure(f64::NAN, Some("it lost its table"));
    assert_eq!(error, "failing failed at 0 ns: it lost its table");
}

#[test]
fn invalid_changes_are_refused_at_scheduling_or_when_due() {
    let mut rig = rig_with(toy_task(), ToyPlant::new(&names()));
    let text = |result: Result<(), RigError>| result.unwrap_err().to_string();
    assert_eq!(
        text(rig.schedule(millis(1), "gian", Change::To(0.1))),
        "toy process has no variable `gian`; did you mean `gain`?"
    );
    assert_eq!(
        text(rig.schedule(millis(1), "gain", Change::To(1.5))),
        "change at 1.000 ms: gain = 1.5 is not in [0, 1]"
    );
    rig.schedule(millis(1), "gain", Change::By(0.4)).unwrap();
    rig.schedule(millis(3), "gain", Change::By(0.4)).unwrap();
    rig.run_until(millis(3), &mut ()).unwrap();
    assert_eq!(rig.process().variables()[0].value(), 0.9);
    assert!(text(rig.schedule(millis(1), "gain", Change::To(0.1))).contains("it is 2."));
    assert_eq!(
        text(rig.run_until(millis(9), &mut ())),
        "change at 3.000 ms: gain = 1.3 is not in [0, 1]"
    );
}

#[test]
fn invalid_schedules_are_refused() {
    let refused = |schedule: Schedule| {
        let (process, plant) = (ToyProcess::new(&names()), ToyPlant::new(&names()));
        let rig = Rig::new(
            &schedule,
            Box::new(process),
            vec![toy_task()],
            Box::new(plant),
        );
        rig.expect_err("invalid schedule").to_string()
    };
    assert_eq!(
        refused(Schedule::with_period(SimDuration::ZERO)),
        "the control period is zero or past 584 years"
    );
    assert!(
        refused(Schedule {
            every: u64::MAX,
            ..schedule()
        })
        .starts_with("the control period")
    );
    assert!(
        refused(Schedule {
            observe: SimDuration::ZERO,
            ..schedule()
        })
        .starts_with("the observation")
    );
    let compute = Timing::Trace(vec![]);
    assert_eq!(
        refused(Schedule {
            compute,
            ..schedule()
        }),
        "compute time: the recorded trace is empty"
    );
    assert!(DirectIo::for_process("direct", &[], Timing::Trace(vec![]), 1).is_err());
}
