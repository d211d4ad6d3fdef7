//! Twin served in real time on PTYs. No assertion depends on the speed of the machine.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::real_time::{
    EndReason, Hold, Privileges, RealTimeRig, Serve, ServeOptions, ServeReport, ServedWire,
};
use twinrig_runtime::{Device, DeviceError, Group, Plant, RigError, RunEvent, Schedule};
use twinrig_testing::real_time::{
    EchoWire, Entry, HalvingDriver, Lag, Log, OPEN, SilentWire, Summing,
};
use twinrig_wire::{Pty, SerialPort};

const BAUD: u32 = 3_333_333;

fn millis(n: u64) -> SimDuration {
    SimDuration::from_millis(n)
}

fn wire(name: &str, device: impl Device + 'static) -> ServedWire {
    ServedWire {
        name: name.into(),
        wire: Box::new(EchoWire::default()),
        device: Box::new(device),
    }
}

fn until_hang_up() -> ServeOptions {
    ServeOptions {
        until_hang_up: true,
        ..ServeOptions::default()
    }
}

type Served = (Result<EndReason, RigError>, ServeReport, Log);

/// Serves on a separate thread; the closure joins it.
fn serve(options: ServeOptions, plant: Lag, wires: Vec<ServedWire>) -> impl FnOnce() -> Served {
    let serve = Serve::new(options, Box::new(plant) as Box<dyn Plant>, wires).unwrap();
    let thread = thread::Builder::new().spawn(move || {
        let mut log = Log::default();
        let (ended, report) = serve.run(&mut log, &AtomicBool::new(false));
        assert!(log.is_in_order());
        assert_eq!(report.lost, 0);
        (ended, report, log)
    });
    move || thread.unwrap().join().unwrap()
}

fn read(port: &mut SerialPort, count: usize) -> Vec<u8> {
    let mut bytes = Vec::new();
    while bytes.len() < count {
        let before = bytes.len();
        port.read(Duration::from_secs(10), &mut bytes).unwrap();
        assert!(bytes.len() > before, "no bytes received");
    }
    bytes
}

#[test]
fn real_time_rig_and_served_twin_record_the_same_bytes() {
    let twin = Pty::open().unwrap();
    let port = SerialPort::open(twin.path(), BAUD).unwrap();
    let served = serve(until_hang_up(), Lag::default(), vec![wire("sbcp", twin)]);
    let schedule = Schedule::with_period(millis(2));
    let process = Box::new(Summing::new(&["sbcp"]));
    let driver = Box::new(HalvingDriver::new("sbcp"));
    let mut rig = RealTimeRig::new(&schedule, process, vec![(driver, Box::new(port))]).unwrap();
    rig.options.privileges = Privileges::none();
    let mut host = Log::default();
    let (ended, report) = rig.run(Some(millis(200)), &mut host, &AtomicBool::new(false));
    assert_eq!(ended, Ok(EndReason::Duration), "{report}");
    let (ended, report, twin) = served();
    assert_eq!(ended, Ok(EndReason::HungUp), "{report}");
    assert_eq!(
        (host.trace(0), host.trace(1)),
        (twin.trace(0), twin.trace(1))
    );
    assert_eq!(report.unread, 0);
}

#[test]
fn plant_follows_the_clock_on_the_grid_from_the_first_byte_on() {
    let twin = Pty::open().unwrap();
    let mut port = SerialPort::open(twin.path(), BAUD).unwrap();
    let served = serve(until_hang_up(), Lag::default(), vec![wire("sbcp", twin)]);
    thread::sleep(Duration::from_millis(20));
    port.write(&[OPEN]).unwrap();
    assert_eq!(read(&mut port, 1), [OPEN]);
    thread::sleep(Duration::from_millis(20));
    drop(port);
    let (ended, report, log) = served();
    assert_eq!(ended, Ok(EndReason::HungUp));

    let released = log
        .entries
        .iter()
        .find_map(|(at, entry)| (*entry == Entry::Event(RunEvent::Opened)).then_some(*at));
    let released = released.unwrap();
    assert!(released > SimTime::ZERO && released < SimTime::ZERO + report.served);
    let mut grid = SimTime::ZERO;
    for (at, entry) in &log.entries {
        if let Entry::Samples(Group::Plant, values) = entry {
            assert_eq!(*at, grid);
            let elapsed = at.checked_since(released).unwrap_or_default();
            assert_eq!(values, &[elapsed.as_secs_f64()], "at {at}");
            grid += millis(2);
        }
    }
    assert!(grid > released && grid + millis(2) > SimTime::ZERO + report.served);
    let answered: Vec<f64> = log
        .samples(Group::Diagnostics)
        .map(|values| values[0])
        .collect();
    assert_eq!((answered[0], answered.last()), (0.0, Some(&1.0)));
}

#[test]
fn hold_of_the_plant_is_configurable() {
    for (hold, events) in [(Hold::Never, 0), (Hold::AfterFirstByte(millis(15)), 1)] {
        let twin = Pty::open().unwrap();
        let mut port = SerialPort::open(twin.path(), BAUD).unwrap();
        let options = ServeOptions {
            hold,
            duration: Some(millis(60)),
            ..ServeOptions::default()
        };
        let served = serve(options, Lag::default(), vec![wire("sbcp", twin)]);
        port.write(&[OPEN]).unwrap();
        let (ended, report, log) = served();
        assert_eq!(
            (ended, report.served),
            (Ok(EndReason::Duration), millis(60))
        );
        assert_eq!(log.count(RunEvent::Opened), events);
        let is_traced = |entry: &Entry| matches!(entry, Entry::Bytes(0, _));
        let first = log
            .entries
            .iter()
            .find(|(_, entry)| is_traced(entry))
            .unwrap()
            .0;
        let last = log.samples(Group::Plant).last().unwrap()[0];
        let released = if events == 0 {
            SimTime::ZERO
        } else {
            first + millis(15)
        };
        let end = SimTime::ZERO + millis(60);
        assert_eq!(last, (end - released.min(end)).as_secs_f64());
    }
}

#[test]
fn hosts_of_two_wires_may_reconnect_at_any_time() {
    let twins = [Pty::open().unwrap(), Pty::open().unwrap()];
    let paths = [0, 1].map(|n: usize| twins[n].path().to_path_buf());
    let [one, two] = twins;
    let stop = Arc::new(AtomicBool::new(false));
    let stop_flag = stop.clone();
    let mut other = wire("other", two);
    other.wire = Box::new(SilentWire);
    let wires = vec![wire("sbcp", one), other];
    let serve = Serve::new(ServeOptions::default(), Box::new(Lag::default()), wires).unwrap();
    assert_eq!(
        serve.traces(),
        ["sbcp/out", "sbcp/in", "other/out", "other/in"]
    );
    let thread = thread::Builder::new().spawn(move || serve.run(&mut (), &stop_flag));
    for _ in 0..3 {
        let mut port = SerialPort::open(&paths[0], BAUD).unwrap();
        let mut other = SerialPort::open(&paths[1], BAUD).unwrap();
        other.write(b"whatever").unwrap();
        port.write(&[OPEN]).unwrap();
        assert_eq!(read(&mut port, 1), [OPEN]);
    }
    stop.store(true, Ordering::SeqCst);
    let (ended, _) = thread.unwrap().join().unwrap();
    assert_eq!(ended, Ok(EndReason::Stopped));
}

#[test]
fn failing_plant_ends_serving_with_its_fault_and_closes_the_port() {
    let twin = Pty::open().unwrap();
    let mut port = SerialPort::open(twin.path(), BAUD).unwrap();
    let plant = Lag {
        fails_at: Some(SimTime::ZERO + millis(10)),
        ..Lag::default()
    };
    let served = serve(ServeOptions::default(), plant, vec![wire("sbcp", twin)]);
    port.write(&[OPEN]).unwrap();
    let (ended, _, log) = served();
    assert!(matches!(ended, Err(RigError::Plant(_))), "{ended:?}");
    assert!(log.samples(Group::Plant).count() > 4);
    let mut bytes = Vec::new();
    let gone = (0..10).find_map(|_| port.read(Duration::from_secs(1), &mut bytes).err());
    assert!(matches!(gone, Some(DeviceError::Gone { .. })), "{gone:?}");
}

#[test]
fn panicking_plant_ends_serving_with_an_error_that_names_it() {
    let plant = Lag {
        panics_at: Some(SimTime::ZERO + millis(10)),
        ..Lag::default()
    };
    let options = ServeOptions {
        hold: Hold::Never,
        ..ServeOptions::default()
    };
    let served = serve(options, plant, vec![wire("sbcp", Pty::open().unwrap())]);
    let (ended, _, log) = served();
    let Err(RigError::Panic(report)) = ended else {
        panic!("{ended:?}");
    };
    assert_eq!(report.part.as_deref(), Some("plant `lag`"));
    assert_eq!(log.samples(Group::Plant).count(), 5);
}

#[test]
fn twin_slower_than_the_clock_reports_it_and_omits_no_sample() {
    let plant = Lag {
        takes: Duration::from_millis(4),
        ..Lag::default()
    };
    let options = ServeOptions {
        hold: Hold::Never,
        duration: Some(millis(40)),
        ..ServeOptions::default()
    };
    let served = serve(options, plant, vec![wire("sbcp", Pty::open().unwrap())]);
    let (ended, report, log) = served();
    assert_eq!(
        (ended, report.served),
        (Ok(EndReason::Duration), millis(40))
    );
    assert_eq!(log.samples(Group::Plant).count(), 21);
    assert!(
        report.behind > 0 && report.to_string().contains("BEHIND"),
        "{report}"
    );
}
