//! Cost of one second of virtual time, and of one event of it, with parts of negligible cost: what
//! remains is the executor. Each iteration is one second with a control step, a transfer and an
//! observation every 2 ms; the counter reports events per second (10 M/s are 100 ns per event).

use divan::Bencher;
use divan::counter::ItemsCount;
use twinrig_kernel::{Port, SimDuration, SimTime, Unit};
use twinrig_runtime::{DirectIo, Plant, PlantFault, Process, Rig, Schedule, Timing};

/// Signals in each direction, as of a quadruped.
const COMMANDS: usize = 8;
const MEASUREMENTS: usize = 40;

struct Idle;

impl Process for Idle {
    fn name(&self) -> &'static str {
        "idle"
    }
    fn ports(&self) -> Vec<Port> {
        Still.ports().iter().map(Port::mirrored).collect()
    }
    fn step(&mut self, _: SimDuration, inputs: &[f64], outputs: &mut [f64]) {
        outputs.copy_from_slice(&inputs[..COMMANDS]);
    }
}

struct Still;

impl Plant for Still {
    fn name(&self) -> &'static str {
        "still"
    }
    fn ports(&self) -> Vec<Port> {
        let command = |n| Port::input(format!("command/{n}"), Unit::Radian, 1);
        let measurement = |n| Port::output(format!("measurement/{n}"), Unit::Radian, 1);
        (0..COMMANDS)
            .map(command)
            .chain((0..MEASUREMENTS).map(measurement))
            .collect()
    }
    fn advance(&mut self, _: SimTime, _: &[f64]) -> Result<(), PlantFault> {
        Ok(())
    }
    fn observe(&mut self, outputs: &mut [f64]) {
        outputs.fill(1.0);
    }
}

fn main() {
    divan::main();
}

fn second_of(bencher: Bencher, transfer: Timing, compute: Timing, events_per_cycle: usize) {
    let mut schedule = Schedule::with_period(SimDuration::from_millis(2));
    schedule.compute = compute;
    let io = DirectIo::for_process("direct", &Idle.ports(), transfer, 1)
        .expect("constant timing is valid");
    let mut rig = Rig::new(
        &schedule,
        Box::new(Idle),
        vec![Box::new(io)],
        Box::new(Still),
    )
    .expect("ports match");
    let mut end = SimTime::ZERO;
    bencher
        .counter(ItemsCount::new(500 * events_per_cycle))
        .bench_local(|| {
            end += SimDuration::from_secs(1);
            rig.run_until(end, &mut ()).expect("run succeeds");
        });
}

/// Control step, end of the process with the whole transfer, observation.
#[divan::bench]
fn no_time(bencher: Bencher) {
    second_of(bencher, Timing::ZERO, Timing::ZERO, 3);
}

/// Control step, end of the process, two wake-ups of the transfer, observation.
#[divan::bench]
fn modelled_times(bencher: Bencher) {
    let micros = SimDuration::from_micros;
    let transfer = Timing::Uniform {
        min: micros(200),
        max: micros(900),
    };
    second_of(bencher, transfer, Timing::Constant(micros(150)), 5);
}
