//! The same driver with its filter in real time at a PTY, and again on the bytes that it received
//! there.

use std::sync::atomic::AtomicBool;
use std::thread;

use crate::support::{filter, plant, quiet};
use twinrig_kernel::SimDuration;
use twinrig_runtime::real_time::{
    EndReason, Privileges, RealTimeRig, Serve, ServeOptions, ServedWire,
};
use twinrig_runtime::{Driver, Group, Schedule};
use twinrig_tactile::{LoadFilter, Tactile, TactileDriver};
use twinrig_testing::driver_harness::DriverHarness;
use twinrig_testing::real_time::Log;
use twinrig_testing::rig_harness::ScriptedProcess;
use twinrig_wire::{Pty, SerialPort};

fn driver(config: &Tactile) -> TactileDriver {
    let filter = LoadFilter::new(filter()).unwrap();
    config.driver().unwrap().with_stage(Box::new(filter))
}

/// Volts of a load of 2 Hz, and the load.
fn load(seconds: f64, channel: usize) -> f64 {
    let force = 10.0 * (1.0 - libm::cos(std::f64::consts::TAU * 2.0 * seconds));
    [1.0 + 0.2 * force, 0.5, force][channel]
}

/// The numbers of samples, and the estimates at these numbers.
fn estimates(layout: &twinrig_kernel::Layout, values: &[f64]) -> (f64, [u64; 2]) {
    let of = |name: &str| values[layout.field(name).unwrap().offset];
    let bits = ["", "/nis"].map(|what| of(&format!("bench/force/estimate{what}")).to_bits());
    (of("tactile/samples"), bits)
}

#[test]
fn estimates_at_a_pty_are_those_of_the_same_frames_in_virtual_time() {
    let config = quiet();
    let twin = Pty::open().unwrap();
    let port = SerialPort::open(twin.path(), config.baud).unwrap();
    let wire = ServedWire {
        name: "tactile".into(),
        wire: Box::new(config.wire(&crate::support::none()).unwrap()),
        device: Box::new(twin),
    };
    let options = ServeOptions {
        until_hang_up: true,
        ..ServeOptions::default()
    };
    let serve = Serve::new(options, Box::new(plant(load)), vec![wire]).unwrap();
    let served = thread::Builder::new()
        .spawn(move || serve.run(&mut Log::default(), &AtomicBool::new(false)))
        .unwrap();

    let process = ScriptedProcess {
        ports: Vec::new(),
        command: |_| 0.0,
        steps: 0,
    };
    let schedule = Schedule::with_period(SimDuration::from_millis(2));
    let host: Box<dyn Driver> = Box::new(driver(&config));
    let devices = vec![(host, Box::new(port) as _)];
    let mut rig = RealTimeRig::new(&schedule, Box::new(process), devices).unwrap();
    rig.options.privileges = Privileges::none();
    let layout = rig.layout(Group::Diagnostics).clone();
    let mut log = Log::default();
    let second = SimDuration::from_secs(1);
    let (ended, report) = rig.run(Some(second), &mut log, &AtomicBool::new(false));
    assert_eq!(ended, Ok(EndReason::Duration), "{report}");
    assert!(served.join().unwrap().0.is_ok());

    // Byte by byte, at times that have nothing to do with those of the run.
    let mut replayed = DriverHarness::new(driver(&config));
    replayed.open();
    let mut by_count = std::collections::BTreeMap::new();
    let ports = replayed.driver.diagnostics();
    let own = twinrig_kernel::Layout::of(&ports, twinrig_kernel::Direction::Output);
    let mut values = vec![0.0; own.len()];
    for byte in log.trace(1) {
        replayed.receive(SimDuration::from_micros(70), &[byte]);
        replayed.driver.read_diagnostics(&mut values);
        let (count, bits) = estimates(&own, &values);
        by_count.insert(count.to_bits(), bits);
    }
    let mut compared = 0;
    for values in log.samples(Group::Diagnostics) {
        let (count, bits) = estimates(&layout, values);
        if count > 0.0 {
            assert_eq!(
                by_count.get(&count.to_bits()),
                Some(&bits),
                "{count} samples"
            );
            compared += 1;
        }
    }
    assert!(compared > 10, "{compared} control steps");
}
