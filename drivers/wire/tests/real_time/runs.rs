//! Real-time runs over PTYs. No assertion depends on the speed of the machine.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::real_time::{EndReason, Limits, Privileges, RealTimeReport, RealTimeRig};
use twinrig_runtime::{
    Change, Device, DeviceError, Driver, Group, PanicReport, Phase, Rig, RigError, RunEvent,
    Schedule, TaskError, WiredTask, catch_panic,
};
use twinrig_testing::real_time::{
    CLOSE, EchoWire, HalvingDriver, Lag, Log, NUMBER, OPEN, Summing, answer,
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

/// Answers until the other end is closed or, with `unplug_after`, until that many answers have been
/// given; then closes its end. Returns the bytes received.
fn answering(mut twin: Pty, delay: Duration, unplug_after: Option<usize>) -> JoinHandle<Vec<u8>> {
    thread::Builder::new()
        .spawn(move || {
            let (mut all, mut received, mut answered) = (Vec::new(), Vec::new(), 0);
            loop {
                let before = received.len();
                match twin.read(Duration::from_millis(100), &mut received) {
                    Ok(()) => {}
                    Err(DeviceError::HungUp { .. }) => return all,
                    Err(error) => panic!("{error}"),
                }
                all.extend_from_slice(&received[before..]);
                let answers = answer(&mut received);
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

fn rig(process: Summing, drivers: Vec<(HalvingDriver, Box<dyn Device>)>) -> RealTimeRig {
    rig_with(millis(2), process, drivers)
}

fn rig_with(
    period: SimDuration,
    process: Summing,
    drivers: Vec<(HalvingDriver, Box<dyn Device>)>,
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

fn run(rig: RealTimeRig, for_ms: u64) -> (Result<EndReason, RigError>, RealTimeReport, Log) {
    let mut log = Log::default();
    let (ended, report) = rig.run(Some(millis(for_ms)), &mut log, &AtomicBool::new(false));
    assert!(log.is_in_order());
    assert_eq!(report.lost, 0);
    (ended, report, log)
}

#[test]
fn observer_records_exactly_the_exchanged_bytes() {
    let (twin, port) = pair();
    let far_end = answering(twin, Duration::ZERO, None);
    let rig = rig(
        Summing::new(&["sbcp"]),
        vec![(HalvingDriver::new("sbcp"), port)],
    );
    assert_eq!(rig.traces(), ["sbcp/out", "sbcp/in"]);
    assert_eq!(
        rig.layout(Group::Diagnostics).find("sbcp/transfers"),
        Some(0..1)
    );
    // In place of a plant: the signals that the driver measures.
    assert_eq!(rig.layout(Group::Plant).find("sbcp/half"), Some(0..1));
    let (ended, report, log) = run(rig, 100);
    assert_eq!(ended, Ok(EndReason::Duration));

    let out = log.trace(0);
    assert_eq!(out, far_end.join().unwrap());
    assert_eq!((out[0], out[out.len() - 1]), (OPEN, CLOSE));
    let transfers = log.count(RunEvent::TaskBegin { task: 0 });
    assert_eq!(log.count(RunEvent::TaskEnd { task: 0 }), transfers);
    assert_eq!(out.len(), 2 + transfers * (1 + NUMBER));
    assert_eq!(log.trace(1).len(), 1 + transfers * NUMBER);
    assert_eq!(report.tasks[0].took.len(), transfers as u64);

    // Whatever the load of the machine: the elapsed times add up, and every step is executed or
    // counted as missed.
    let steps = report.iterations + report.overruns + report.overslept;
    assert_eq!(log.count(RunEvent::ProcessEnd) as u64, report.iterations);
    let elapsed = log.events().filter_map(|event| match event {
        RunEvent::ProcessBegin { elapsed } => Some(elapsed.as_nanos()),
        _ => None,
    });
    let elapsed: u64 = elapsed.sum();
    assert!(
        elapsed.is_multiple_of(2_000_000) && elapsed <= (steps - 1) * 2_000_000,
        "{elapsed}"
    );
    assert!(log.samples(Group::Diagnostics).count() > 0);
}

/// Returns a run without overruns and the period at which this machine, under its present load,
/// achieves it.
fn without_overruns(
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
fn without_overruns_the_bytes_equal_those_of_lockstep() {
    const STEPS: u64 = 40;
    let (period, real) = without_overruns(|period| {
        let (twin, port) = pair();
        let far_end = answering(twin, Duration::ZERO, None);
        let process = Summing::new(&["sbcp"]);
        let mut rig = rig_with(period, process, vec![(HalvingDriver::new("sbcp"), port)]);
        let at = SimTime::ZERO + period * 10;
        rig.schedule(at, "offset", Change::By(7.5)).unwrap();
        let mut log = Log::default();
        let (ended, report) = rig.run(Some(period * STEPS), &mut log, &AtomicBool::new(false));
        assert_eq!(ended, Ok(EndReason::Duration));
        far_end.join().unwrap();
        (report, log)
    });

    let task = WiredTask::new(
        Box::new(HalvingDriver::new("sbcp")),
        Box::new(EchoWire::default()),
    );
    let schedule = Schedule::with_period(period);
    let process = Box::new(Summing::new(&["sbcp"]));
    let mut lockstep = Rig::new(
        &schedule,
        process,
        vec![Box::new(task)],
        Box::new(Lag::default()),
    );
    let lockstep = lockstep.as_mut().unwrap();
    // In lockstep, opening takes a control step.
    let at = SimTime::ZERO + period * 11;
    lockstep.schedule(at, "offset", Change::By(7.5)).unwrap();
    let mut in_lockstep = Log::default();
    let end = SimTime::ZERO + period * (STEPS + 1) + millis(1);
    lockstep.run_until(end, &mut in_lockstep).unwrap();

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
fn unplugged_device_ends_the_run_with_an_error_and_complete_records() {
    let (twin, port) = pair();
    let place = port.place().to_string();
    let far_end = answering(twin, Duration::ZERO, Some(11));
    let driver = HalvingDriver::new("sbcp");
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
    let received = far_end.join().unwrap();
    assert!(log.trace(0).starts_with(&received) || received.starts_with(&log.trace(0)));
}

#[test]
fn unresponsive_device_ends_the_run_at_the_time_limit_and_all_are_closed() {
    let ((_silent, port), (twin, other)) = (pair(), pair());
    let place = port.place().to_string();
    let far_end = answering(twin, Duration::ZERO, None);
    let drivers = vec![
        (HalvingDriver::new("mute"), port),
        (HalvingDriver::new("sbcp"), other),
    ];
    let mut rig = rig(Summing::new(&["mute", "sbcp"]), drivers);
    // The other device answers in time on a loaded machine, too.
    let limit = millis(500);
    rig.options.limits.open = limit;
    let (ended, report, log) = run(rig, 1000);
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
fn failing_driver_is_closed_and_its_reason_reported() {
    let (twin, port) = pair();
    let far_end = answering(twin, Duration::ZERO, None);
    let mut driver = HalvingDriver::new("sbcp");
    driver.fails_after = Some(3.0);
    let (ended, _, _) = run(rig(Summing::new(&["sbcp"]), vec![(driver, port)]), 60_000);
    let why = ended.unwrap_err().to_string();
    assert!(
        why.ends_with(": too many errors; look after the cable"),
        "{why}"
    );
    assert_eq!(far_end.join().unwrap().last(), Some(&CLOSE));
}

#[test]
fn panicking_driver_ends_the_run_with_an_error_that_names_it_and_all_are_closed() {
    let ((one, port), (two, other)) = (pair(), pair());
    let ends = [
        answering(one, Duration::ZERO, None),
        answering(two, Duration::ZERO, None),
    ];
    let mut driver = HalvingDriver::new("bad");
    driver.panics_after = Some(3.0);
    let drivers = vec![(driver, port), (HalvingDriver::new("good"), other)];
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
    assert!(report.message.contains("requested by the test"), "{report}");
    // The driver that panicked is closed, too: it may still be able to stop its motors.
    for end in ends {
        assert_eq!(end.join().unwrap().last(), Some(&CLOSE));
    }
}

/// Runs with a driver that hangs and one that does not; the far end of the former answers or not.
fn error_with_hanging_driver(answers: bool) -> TaskError {
    let ((one, port), (two, other)) = (pair(), pair());
    let silent = if answers {
        let _ = answering(one, Duration::ZERO, None);
        None
    } else {
        Some(one)
    };
    let far_end = answering(two, Duration::ZERO, None);
    let mut driver = HalvingDriver::new("bad");
    driver.hangs_after = Some(0.0);
    let drivers = vec![(driver, port), (HalvingDriver::new("good"), other)];
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
fn hanging_driver_does_not_block_the_run_or_other_drivers() {
    let lost = error_with_hanging_driver(true);
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
fn driver_hanging_on_close_after_a_time_out_does_not_block_the_run() {
    let late = error_with_hanging_driver(false);
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
fn panicking_process_ends_the_run_with_an_error_that_names_it_and_closed_devices() {
    let (twin, port) = pair();
    let far_end = answering(twin, Duration::ZERO, None);
    let mut process = Summing::new(&["sbcp"]);
    process.panics_at = Some(5);
    let rig = rig(process, vec![(HalvingDriver::new("sbcp"), port)]);
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

/// Returns the report of the panic in virtual time with these parts.
fn panics_in_lockstep(process: Summing, driver: HalvingDriver, plant: Lag) -> PanicReport {
    let wire = Box::new(EchoWire::default());
    let task = Box::new(WiredTask::new(Box::new(driver), wire));
    let schedule = Schedule::with_period(millis(2));
    let mut rig = Rig::new(&schedule, Box::new(process), vec![task], Box::new(plant)).unwrap();
    let end = SimTime::ZERO + millis(100);
    catch_panic(|| rig.run_until(end, &mut ())).unwrap_err()
}

#[test]
fn panicking_part_is_named_in_virtual_time() {
    let summing = || Summing::new(&["sbcp"]);
    let mut driver = HalvingDriver::new("sbcp");
    driver.panics_after = Some(3.0);
    let report = panics_in_lockstep(summing(), driver, Lag::default());
    assert_eq!(report.part.as_deref(), Some("driver `sbcp`"));
    let mut process = summing();
    process.panics_at = Some(5);
    let report = panics_in_lockstep(process, HalvingDriver::new("sbcp"), Lag::default());
    assert_eq!(report.part.as_deref(), Some("controller `summing`"));
    // The wire advances the plant, but the plant is the part that panics.
    let plant = Lag {
        panics_at: Some(SimTime::ZERO + millis(10)),
        ..Lag::default()
    };
    let report = panics_in_lockstep(summing(), HalvingDriver::new("sbcp"), plant);
    assert_eq!(report.part.as_deref(), Some("plant `lag`"));
    assert!(report.message.contains("requested by the test"), "{report}");
}

#[test]
fn stopped_run_ends_and_closes_the_devices() {
    let (twin, port) = pair();
    let far_end = answering(twin, Duration::ZERO, None);
    let stop = Arc::new(AtomicBool::new(false));
    let later = stop.clone();
    let stopper = thread::Builder::new().spawn(move || {
        thread::sleep(Duration::from_millis(30));
        later.store(true, Ordering::SeqCst);
    });
    let mut log = Log::default();
    let rig = rig(
        Summing::new(&["sbcp"]),
        vec![(HalvingDriver::new("sbcp"), port)],
    );
    let (ended, _) = rig.run(None, &mut log, &stop);
    stopper.unwrap().join().unwrap();
    assert_eq!(ended, Ok(EndReason::Stopped));
    assert_eq!(far_end.join().unwrap().last(), Some(&CLOSE));
}

#[test]
fn slow_observer_loses_counted_records_and_delays_no_device() {
    let (twin, port) = pair();
    let far_end = answering(twin, Duration::ZERO, None);
    let mut rig = rig(
        Summing::new(&["sbcp"]),
        vec![(HalvingDriver::new("sbcp"), port)],
    );
    rig.options.queue_bytes = 512;
    let mut log = Log {
        takes: Duration::from_millis(5),
        ..Log::default()
    };
    let (ended, report) = rig.run(Some(millis(200)), &mut log, &AtomicBool::new(false));
    assert_eq!(ended, Ok(EndReason::Duration));
    assert!(report.lost > 0);
    // The devices are not affected.
    let received = far_end.join().unwrap();
    let transfers = report.tasks[0].took.len();
    assert_eq!(received.len() as u64, 2 + transfers * (1 + NUMBER as u64));
    assert!(report.to_string().contains("LOST"), "{report}");
}

#[test]
fn late_process_misses_steps_and_receives_the_elapsed_time() {
    let (twin, port) = pair();
    let far_end = answering(twin, Duration::ZERO, None);
    let mut process = Summing::new(&["sbcp"]);
    process.takes = Duration::from_millis(5);
    let (ended, report, log) = run(rig(process, vec![(HalvingDriver::new("sbcp"), port)]), 60);
    far_end.join().unwrap();
    assert_eq!(ended, Ok(EndReason::Duration));
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
fn slow_task_skips_steps_without_delaying_a_fast_one() {
    let ((one, port), (two, other)) = (pair(), pair());
    let ends = [
        answering(one, Duration::ZERO, None),
        answering(two, Duration::from_millis(15), None),
    ];
    let drivers = vec![
        (HalvingDriver::new("fast"), port),
        (HalvingDriver::new("slow"), other),
    ];
    let (ended, report, log) = run(rig(Summing::new(&["fast", "slow"]), drivers), 150);
    for end in ends {
        end.join().unwrap();
    }
    assert_eq!(ended, Ok(EndReason::Duration));
    let [fast, slow] = [0, 1].map(|task| log.count(RunEvent::TaskBegin { task }) as u64);
    assert_eq!(
        [fast, slow],
        [0, 1].map(|n| report.iterations - report.tasks[n].skipped)
    );
    // The slow task is busy for more than seven steps, whatever the load.
    assert!(
        slow < fast && report.tasks[1].skipped >= 3 * (slow - 1),
        "{report}"
    );
    assert_eq!(
        log.count(RunEvent::TaskSkipped {
            task: 1,
            implied: false
        }) as u64,
        report.tasks[1].skipped
    );
}
