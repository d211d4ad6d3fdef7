//! Runs in real time over PTYs. What is asserted never depends on how fast the machine is.

mod real;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use real::{Asker, CLOSE, EchoWire, Lag, Log, NUMBER, OPEN, Summing, answer};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::real_time::{Ended, Limits, Privileges, RealTimeReport, RealTimeRig};
use twinrig_runtime::{
    Change, Device, DeviceError, Driver, Group, PanicReport, Phase, Rig, RigError, RunEvent,
    Schedule, TaskError, WiredTask, caught,
};
use twinrig_wire::{Pty, SerialPort};

const BAUD: u32 = 3_333_333;

fn millis(n: u64) -> SimDuration {
    SimDuration::from_millis(n)
}

/// Both ends of a PTY.
fn pair() -> (Pty, Box<dyn Device>) {
    let twin = Pty::open().unwrap();
    let port = SerialPort::open(twin.path(), BAUD).unwrap();
    (twin, Box::new(port))
}

/// Answers until the other end is closed, or until it has answered `unplug_after` times, if that is given: then
/// its end is gone. Gives what it heard.
fn answering(mut twin: Pty, delay: Duration, unplug_after: Option<usize>) -> JoinHandle<Vec<u8>> {
    thread::Builder::new()
        .spawn(move || {
            let (mut all, mut heard, mut answered) = (Vec::new(), Vec::new(), 0);
            loop {
                let before = heard.len();
                match twin.read(Duration::from_millis(100), &mut heard) {
                    Ok(()) => {}
                    Err(DeviceError::HungUp { .. }) => return all,
                    Err(error) => panic!("{error}"),
                }
                all.extend_from_slice(&heard[before..]);
                let answers = answer(&mut heard);
                if answers.is_empty() {
                    continue;
                }
                if unplug_after == Some(answered) {
                    return all;
                }
                answered += 1;
                thread::sleep(delay);
                twin.write(&answers).unwrap();
            }
        })
        .unwrap()
}

fn rig(process: Summing, drivers: Vec<(Asker, Box<dyn Device>)>) -> RealTimeRig {
    rig_with(millis(2), process, drivers)
}

fn rig_with(
    period: SimDuration,
    process: Summing,
    drivers: Vec<(Asker, Box<dyn Device>)>,
) -> RealTimeRig {
    let schedule = Schedule::with_period(period);
    let drivers = drivers.into_iter();
    let drivers = drivers.map(|(driver, device)| (Box::new(driver) as Box<dyn Driver>, device));
    let mut rig = RealTimeRig::new(&schedule, Box::new(process), drivers.collect()).unwrap();
    rig.options.privileges = Privileges::none();
    rig.options.limits = Limits {
        open: millis(20_000),
        transfer: millis(20_000),
        close: millis(20_000),
    };
    rig
}

fn run(rig: RealTimeRig, for_ms: u64) -> (Result<Ended, RigError>, RealTimeReport, Log) {
    let mut log = Log::default();
    let (ended, report) = rig.run(Some(millis(for_ms)), &mut log, &AtomicBool::new(false));
    assert!(log.is_in_order());
    assert_eq!(report.lost, 0);
    (ended, report, log)
}

#[test]
fn a_driver_and_its_far_end_exchange_what_the_observer_is_told_and_nothing_else() {
    let (twin, port) = pair();
    let far_end = answering(twin, Duration::ZERO, None);
    let rig = rig(Summing::new(&["sbcp"]), vec![(Asker::new("sbcp"), port)]);
    assert_eq!(rig.traces(), ["sbcp/out", "sbcp/in"]);
    assert_eq!(
        rig.layout(Group::Diagnostics).find("sbcp/transfers"),
        Some(0..1)
    );
    assert!(rig.layout(Group::Plant).is_empty());
    let (ended, report, log) = run(rig, 100);
    assert_eq!(ended, Ok(Ended::Duration));

    let out = log.trace(0);
    assert_eq!(out, far_end.join().unwrap());
    assert_eq!((out[0], out[out.len() - 1]), (OPEN, CLOSE));
    let transfers = log.count(RunEvent::TaskBegin { task: 0 });
    assert_eq!(log.count(RunEvent::TaskEnd { task: 0 }), transfers);
    assert_eq!(out.len(), 2 + transfers * (1 + NUMBER));
    assert_eq!(log.trace(1).len(), 1 + transfers * NUMBER);
    assert_eq!(report.tasks[0].took.len(), transfers as u64);

    // However the machine was: what the process was told adds up, and every step was kept or missed.
    let steps = report.iterations + report.overruns + report.overslept;
    assert_eq!(log.count(RunEvent::ProcessEnd) as u64, report.iterations);
    let told = log.events().filter_map(|event| match event {
        RunEvent::ProcessBegin { elapsed } => Some(elapsed.as_nanos()),
        _ => None,
    });
    let told: u64 = told.sum();
    assert!(
        told.is_multiple_of(2_000_000) && told <= (steps - 1) * 2_000_000,
        "{told}"
    );
    assert!(log.samples(Group::Diagnostics).count() > 0);
}

/// A run of so many steps without overruns, and the period that this machine could keep for that long, busy as it
/// may be.
fn undisturbed(
    mut attempt: impl FnMut(SimDuration) -> (RealTimeReport, Log),
) -> (SimDuration, Log) {
    for doubled in 0..10 {
        let period = millis(2 << doubled);
        let (report, log) = attempt(period);
        let skipped: u64 = report.tasks.iter().map(|task| task.skipped).sum();
        if report.overruns + report.overslept + skipped == 0 {
            return (period, log);
        }
    }
    panic!("this machine is too busy for a period of a second");
}

#[test]
fn without_overruns_the_bytes_are_those_of_lockstep() {
    const STEPS: u64 = 40;
    let (period, real) = undisturbed(|period| {
        let (twin, port) = pair();
        let far_end = answering(twin, Duration::ZERO, None);
        let process = Summing::new(&["sbcp"]);
        let mut rig = rig_with(period, process, vec![(Asker::new("sbcp"), port)]);
        let at = SimTime::ZERO + period * 10;
        rig.schedule(at, "offset", Change::By(7.5)).unwrap();
        let mut log = Log::default();
        let (ended, report) = rig.run(Some(period * STEPS), &mut log, &AtomicBool::new(false));
        assert_eq!(ended, Ok(Ended::Duration));
        far_end.join().unwrap();
        (report, log)
    });

    let task = WiredTask::new(Box::new(Asker::new("sbcp")), Box::new(EchoWire::default()));
    let schedule = Schedule::with_period(period);
    let process = Box::new(Summing::new(&["sbcp"]));
    let mut model = Rig::new(
        &schedule,
        process,
        vec![Box::new(task)],
        Box::new(Lag::default()),
    );
    let model = model.as_mut().unwrap();
    // There, opening takes a control step.
    let at = SimTime::ZERO + period * 11;
    model.schedule(at, "offset", Change::By(7.5)).unwrap();
    let mut in_lockstep = Log::default();
    let end = SimTime::ZERO + period * (STEPS + 1) + millis(1);
    model.run_until(end, &mut in_lockstep).unwrap();

    let (mut out, back) = (real.trace(0), real.trace(1));
    assert_eq!(out.pop(), Some(CLOSE));
    assert_eq!((out, back), (in_lockstep.trace(0), in_lockstep.trace(1)));
    let events = |log: &Log| -> Vec<_> {
        log.events()
            .filter(|event| *event != RunEvent::Opened)
            .collect()
    };
    assert_eq!(events(&real), events(&in_lockstep));
}

#[test]
fn an_unplugged_device_ends_the_run_with_an_error_and_everything_before_is_told() {
    let (twin, port) = pair();
    let place = port.place().to_string();
    let far_end = answering(twin, Duration::ZERO, Some(11));
    let driver = Asker::new("sbcp");
    let closed = driver.closed.clone();
    let (ended, _, log) = run(rig(Summing::new(&["sbcp"]), vec![(driver, port)]), 60_000);
    let Err(RigError::Task { task, source, .. }) = ended else {
        panic!("{ended:?}");
    };
    assert_eq!(
        (task.as_str(), source),
        ("sbcp", TaskError::Port(DeviceError::Gone { place }))
    );
    assert!(closed.load(Ordering::SeqCst));
    assert_eq!(log.count(RunEvent::TaskEnd { task: 0 }), 10);
    assert_eq!(log.trace(1).len(), 1 + 10 * NUMBER);
    let heard = far_end.join().unwrap();
    assert!(log.trace(0).starts_with(&heard) || heard.starts_with(&log.trace(0)));
}

#[test]
fn a_device_that_does_not_answer_ends_the_run_when_the_limit_is_over_and_all_are_closed() {
    let ((_silent, port), (twin, other)) = (pair(), pair());
    let place = port.place().to_string();
    let far_end = answering(twin, Duration::ZERO, None);
    let drivers = vec![(Asker::new("mute"), port), (Asker::new("sbcp"), other)];
    let mut rig = rig(Summing::new(&["mute", "sbcp"]), drivers);
    rig.options.limits.open = millis(30);
    let (ended, report, log) = run(rig, 1000);
    let limit = millis(30);
    let Err(RigError::Task { task, source, .. }) = ended else {
        panic!("{ended:?}");
    };
    assert_eq!(task, "mute");
    let what = Phase::Opening;
    assert_eq!(source, TaskError::TimeLimit { what, place, limit });
    assert_eq!(far_end.join().unwrap(), [OPEN, CLOSE]);
    assert_eq!((report.iterations, log.trace(0)), (0, vec![OPEN, CLOSE]));
}

#[test]
fn a_driver_that_gives_up_is_closed_and_says_why() {
    let (twin, port) = pair();
    let far_end = answering(twin, Duration::ZERO, None);
    let mut driver = Asker::new("sbcp");
    driver.tires_after = Some(3.0);
    let (ended, _, _) = run(rig(Summing::new(&["sbcp"]), vec![(driver, port)]), 60_000);
    let why = ended.unwrap_err().to_string();
    assert!(
        why.ends_with(": too many errors; look after the cable"),
        "{why}"
    );
    assert_eq!(far_end.join().unwrap().last(), Some(&CLOSE));
}

#[test]
fn a_driver_that_panics_ends_the_run_with_an_error_that_names_it_and_all_are_closed() {
    let ((one, port), (two, other)) = (pair(), pair());
    let ends = [
        answering(one, Duration::ZERO, None),
        answering(two, Duration::ZERO, None),
    ];
    let mut driver = Asker::new("bad");
    driver.panics_after = Some(3.0);
    let drivers = vec![(driver, port), (Asker::new("good"), other)];
    let (ended, _, _) = run(rig(Summing::new(&["bad", "good"]), drivers), 60_000);
    let Err(RigError::Task {
        task,
        source: TaskError::Panic(report),
        ..
    }) = ended
    else {
        panic!("{ended:?}");
    };
    assert_eq!(task, "bad");
    assert_eq!(report.part.as_deref(), Some("driver `bad`"));
    assert!(report.message.contains("as it was told to"), "{report}");
    // The one that panicked is asked to close, too: it may still know how to stop its motors.
    for end in ends {
        assert_eq!(end.join().unwrap().last(), Some(&CLOSE));
    }
}

/// Runs with a driver that hangs, and one that does not; the far end of the former answers, or not.
fn with_one_that_hangs(answers: bool) -> TaskError {
    let ((one, port), (two, other)) = (pair(), pair());
    let silent = if answers {
        let _ = answering(one, Duration::ZERO, None);
        None
    } else {
        Some(one)
    };
    let far_end = answering(two, Duration::ZERO, None);
    let mut driver = Asker::new("bad");
    driver.hangs_after = Some(0.0);
    let drivers = vec![(driver, port), (Asker::new("good"), other)];
    let mut rig = rig(Summing::new(&["bad", "good"]), drivers);
    (rig.options.limits.open, rig.options.limits.close) = (millis(2_000), millis(2_000));
    let (ended, _) = rig.run(None, &mut Log::default(), &AtomicBool::new(false));
    assert_eq!(far_end.join().unwrap().last(), Some(&CLOSE));
    drop(silent);
    match ended {
        Err(RigError::Task { source, .. }) => source,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_driver_that_never_comes_back_keeps_neither_the_run_nor_the_others() {
    let lost = with_one_that_hangs(true);
    assert!(
        matches!(
            lost,
            TaskError::Lost {
                what: Phase::Opening,
                ..
            }
        ),
        "{lost:?}"
    );
}

#[test]
fn neither_does_one_that_never_comes_back_from_closing_after_it_has_failed() {
    let late = with_one_that_hangs(false);
    assert!(
        matches!(
            late,
            TaskError::TimeLimit {
                what: Phase::Opening,
                ..
            }
        ),
        "{late:?}"
    );
}

#[test]
fn a_process_that_panics_ends_the_run_with_an_error_that_names_it_and_leaves_the_devices_closed() {
    let (twin, port) = pair();
    let far_end = answering(twin, Duration::ZERO, None);
    let mut process = Summing::new(&["sbcp"]);
    process.panics_at = Some(5);
    let rig = rig(process, vec![(Asker::new("sbcp"), port)]);
    let (ended, report, _) = run(rig, 60_000);
    let Err(RigError::Panic(panic)) = ended else {
        panic!("{ended:?}");
    };
    assert_eq!(panic.part.as_deref(), Some("controller `summing`"));
    assert!(
        panic
            .place
            .as_ref()
            .is_some_and(|place| place.contains("process.rs")),
        "{panic}"
    );
    assert_eq!(report.iterations, 5);
    assert_eq!(far_end.join().unwrap().last(), Some(&CLOSE));
}

/// What panics in virtual time, with these parts.
fn panics_in_lockstep(process: Summing, driver: Asker, plant: Lag) -> PanicReport {
    let wire = Box::new(EchoWire::default());
    let task = Box::new(WiredTask::new(Box::new(driver), wire));
    let schedule = Schedule::with_period(millis(2));
    let mut rig = Rig::new(&schedule, Box::new(process), vec![task], Box::new(plant)).unwrap();
    let end = SimTime::ZERO + millis(100);
    caught(|| rig.run_until(end, &mut ())).unwrap_err()
}

#[test]
fn in_virtual_time_the_part_that_panics_is_named_too() {
    let summing = || Summing::new(&["sbcp"]);
    let mut driver = Asker::new("sbcp");
    driver.panics_after = Some(3.0);
    let report = panics_in_lockstep(summing(), driver, Lag::default());
    assert_eq!(report.part.as_deref(), Some("driver `sbcp`"));
    let mut process = summing();
    process.panics_at = Some(5);
    let report = panics_in_lockstep(process, Asker::new("sbcp"), Lag::default());
    assert_eq!(report.part.as_deref(), Some("controller `summing`"));
    // The plant is moved by the wire, and it is the plant that panics.
    let plant = Lag {
        panics_at: Some(SimTime::ZERO + millis(10)),
        ..Lag::default()
    };
    let report = panics_in_lockstep(summing(), Asker::new("sbcp"), plant);
    assert_eq!(report.part.as_deref(), Some("plant `lag`"));
    assert!(report.message.contains("as it was told to"), "{report}");
}

#[test]
fn a_run_that_is_stopped_ends_and_closes() {
    let (twin, port) = pair();
    let far_end = answering(twin, Duration::ZERO, None);
    let stop = Arc::new(AtomicBool::new(false));
    let later = stop.clone();
    let stopper = thread::Builder::new().spawn(move || {
        thread::sleep(Duration::from_millis(30));
        later.store(true, Ordering::SeqCst);
    });
    let mut log = Log::default();
    let rig = rig(Summing::new(&["sbcp"]), vec![(Asker::new("sbcp"), port)]);
    let (ended, _) = rig.run(None, &mut log, &stop);
    stopper.unwrap().join().unwrap();
    assert_eq!(ended, Ok(Ended::Stopped));
    assert_eq!(far_end.join().unwrap().last(), Some(&CLOSE));
}

#[test]
fn an_observer_that_is_too_slow_loses_records_which_is_counted_and_delays_nobody() {
    let (twin, port) = pair();
    let far_end = answering(twin, Duration::ZERO, None);
    let mut rig = rig(Summing::new(&["sbcp"]), vec![(Asker::new("sbcp"), port)]);
    rig.options.queue_bytes = 512;
    let mut log = Log {
        takes: Duration::from_millis(5),
        ..Log::default()
    };
    let (ended, report) = rig.run(Some(millis(200)), &mut log, &AtomicBool::new(false));
    assert_eq!(ended, Ok(Ended::Duration));
    assert!(report.lost > 0);
    // Everybody else got everything.
    let heard = far_end.join().unwrap();
    let transfers = report.tasks[0].took.len();
    assert_eq!(heard.len() as u64, 2 + transfers * (1 + NUMBER as u64));
    assert!(report.to_string().contains("LOST"), "{report}");
}

#[test]
fn a_late_process_misses_steps_and_is_told_the_time_elapsed() {
    let (twin, port) = pair();
    let far_end = answering(twin, Duration::ZERO, None);
    let mut process = Summing::new(&["sbcp"]);
    process.takes = Duration::from_millis(5);
    let (ended, report, log) = run(rig(process, vec![(Asker::new("sbcp"), port)]), 60);
    far_end.join().unwrap();
    assert_eq!(ended, Ok(Ended::Duration));
    assert!(report.overruns >= 2 * (report.iterations - 1), "{report}");
    let mut missed = 0;
    for event in log.events() {
        match event {
            RunEvent::Overrun { .. } => missed += 1,
            RunEvent::ProcessBegin { elapsed } => {
                if !elapsed.is_zero() {
                    assert_eq!(elapsed, millis(2) * (1 + missed));
                }
                missed = 0;
            }
            _ => {}
        }
    }
}

#[test]
fn a_slow_task_sits_out_and_does_not_delay_a_fast_one() {
    let ((one, port), (two, other)) = (pair(), pair());
    let ends = [
        answering(one, Duration::ZERO, None),
        answering(two, Duration::from_millis(15), None),
    ];
    let drivers = vec![(Asker::new("fast"), port), (Asker::new("slow"), other)];
    let (ended, report, log) = run(rig(Summing::new(&["fast", "slow"]), drivers), 150);
    for end in ends {
        end.join().unwrap();
    }
    assert_eq!(ended, Ok(Ended::Duration));
    let [fast, slow] = [0, 1].map(|task| log.count(RunEvent::TaskBegin { task }) as u64);
    assert_eq!(
        [fast, slow],
        [0, 1].map(|n| report.iterations - report.tasks[n].skipped)
    );
    // It is busy for more than seven steps, whoever else is.
    assert!(
        slow < fast && report.tasks[1].skipped >= 3 * (slow - 1),
        "{report}"
    );
    assert_eq!(
        log.count(RunEvent::TaskSkipped { task: 1 }) as u64,
        report.tasks[1].skipped
    );
}
