//! Parts that fail end the run with an error that says when and how, and lose nothing seen before.

mod toys;

use toys::{Log, ToyPlant, ToyProcess, ToyTask};
use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{
    Change, DirectIo, IoTask, PlantAccess, Process, Progress, Rig, RigError, Schedule, TaskError,
    Timing,
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
fn a_plant_that_fails_says_when_where_and_with_how_much_energy_and_all_before_is_kept() {
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
            .starts_with("toy/spring failed at 7.000 ms, with "),
        "{error}"
    );

    let mut sound = Log::default();
    rig_with(toy_task(), ToyPlant::new(&names()))
        .run_until(millis(20), &mut sound)
        .unwrap();
    assert!(log.0.len() > 10 && sound.0.starts_with(&log.0));

    let seen = log.0.len();
    assert_eq!(
        rig.run_until(millis(30), &mut log),
        Err(error),
        "a dead rig stays dead"
    );
    assert_eq!(log.0.len(), seen);
}

/// Does whatever the test wants.
struct Wayward(fn(SimTime) -> Result<Progress, TaskError>);

impl IoTask for Wayward {
    fn name(&self) -> &'static str {
        "wayward"
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
    fn save(&self) -> Snapshot {
        Snapshot::of(&())
    }
    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        snapshot.read()
    }
}

fn error_of(task: fn(SimTime) -> Result<Progress, TaskError>) -> RigError {
    rig_with(Box::new(Wayward(task)), ToyPlant::new(&names()))
        .run_until(millis(4), &mut ())
        .unwrap_err()
}

#[test]
fn a_task_that_wakes_itself_for_ever_is_named() {
    let error = error_of(|now| Ok(Progress::Again(now)));
    let text = error.to_string();
    assert!(matches!(error, RigError::Livelock(_)));
    assert!(text.contains("at 0 ns: wayward woke itself"), "{text}");
}

#[test]
fn a_task_that_wants_to_be_woken_in_the_past_is_named() {
    let error = error_of(|now| match now.checked_since(millis(1)) {
        None => Ok(Progress::Again(millis(1))),
        Some(_) => Ok(Progress::Again(SimTime::ZERO)),
    });
    assert_eq!(
        error.to_string(),
        "wayward asked at 1.000 ms to be woken at 0 ns, which is past"
    );
}

#[test]
fn a_device_that_fails_is_named_with_the_time() {
    let error = error_of(|_| {
        Err(TaskError::Device {
            why: "the port is gone".into(),
        })
    });
    assert_eq!(
        error.to_string(),
        "wayward failed at 0 ns: the port is gone"
    );
}

#[test]
fn a_process_that_writes_no_number_is_stopped_before_it_reaches_the_plant() {
    struct Dizzy(ToyProcess);
    impl Process for Dizzy {
        fn name(&self) -> &'static str {
            "dizzy"
        }
        fn ports(&self) -> Vec<Port> {
            self.0.ports()
        }
        fn step(&mut self, elapsed: SimDuration, _: &[f64], outputs: &mut [f64]) {
            outputs[0] = elapsed.as_secs_f64().recip();
        }
        fn save(&self) -> Snapshot {
            self.0.save()
        }
        fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
            self.0.restore(snapshot)
        }
    }
    let process = Dizzy(ToyProcess::new(&names()));
    let plant = Box::new(ToyPlant::new(&names()));
    let mut rig = Rig::new(&schedule(), Box::new(process), vec![toy_task()], plant).unwrap();
    let error = rig.run_until(millis(4), &mut ()).unwrap_err();
    assert_eq!(
        error.to_string(),
        "dizzy wrote inf to `toy0/command` at 0 ns"
    );
}

#[test]
fn changes_that_cannot_be_are_refused_at_once_or_when_they_are_due() {
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
fn schedules_that_cannot_be_are_refused() {
    let refused = |schedule: Schedule| {
        let (process, plant) = (ToyProcess::new(&names()), ToyPlant::new(&names()));
        let rig = Rig::new(
            &schedule,
            Box::new(process),
            vec![toy_task()],
            Box::new(plant),
        );
        rig.expect_err("it cannot be").to_string()
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
