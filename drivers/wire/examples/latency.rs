//! Latency of this machine: runs a control loop at 500 Hz (arguments: period in µs, duration in s)
//! over a PTY with a twin at its other end, and prints the histograms.
//!
//! ```text
//! cargo run --release -p twinrig-wire --example latency -- 2000 10
//! ```

use std::sync::atomic::AtomicBool;
use std::thread;

use twinrig_kernel::SimDuration;
use twinrig_runtime::Schedule;
use twinrig_runtime::real_time::{RealTimeRig, Serve, ServeOptions, ServedWire};
use twinrig_testing::real_time::{EchoWire, HalvingDriver, Lag, Summing};
use twinrig_wire::{Pty, SerialPort};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1).map(|word| word.parse::<u64>());
    let period = SimDuration::from_micros(arguments.next().unwrap_or(Ok(2_000))?);
    let duration = SimDuration::from_secs(arguments.next().unwrap_or(Ok(10))?);

    let twin = Pty::open()?;
    let port = SerialPort::open(twin.path(), 3_333_333)?;
    let options = ServeOptions {
        until_hang_up: true,
        ..ServeOptions::default()
    };
    let wire = ServedWire {
        name: "echo".into(),
        wire: Box::new(EchoWire::default()),
        device: Box::new(twin),
    };
    let serve = Serve::new(options, Box::new(Lag::default()), vec![wire])?;
    let served = thread::Builder::new().spawn(|| serve.run(&mut (), &AtomicBool::new(false)))?;

    let process = Box::new(Summing::new(&["echo"]));
    let driver = Box::new(HalvingDriver::new("echo"));
    let schedule = Schedule::with_period(period);
    let rig = RealTimeRig::new(&schedule, process, vec![(driver, Box::new(port))])?;
    for missing in rig.options.privileges.prepare() {
        println!("{missing}");
    }
    let (ended, report) = rig.run(Some(duration), &mut (), &AtomicBool::new(false));
    println!("{ended:?}\n{report}");
    if let Ok((ended, report)) = served.join() {
        println!("the twin: {ended:?}\n{report}");
    }
    Ok(())
}
