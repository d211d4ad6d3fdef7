//! Cost of a cycle: a frame of four requests through USB and bus controller, four answers, and
//! eight ticks of boards with two motors each.

#[allow(dead_code, reason = "the tests use the rest")]
#[path = "../src/tests/bus/harness.rs"]
mod harness;

use divan::Bencher;
use divan::counter::ItemsCount;
use harness::{Harness, millis};
use twinrig_kernel::SimDuration;
use twinrig_motordriver::{BusConfig, BusTopology};

fn main() {
    divan::main();
}

/// Cycles per iteration: a thousand packets to boards, each with its answer. The time of an
/// iteration in milliseconds is therefore the cost per packet in microseconds, including everything
/// else in its cycle. Items are packets.
const CYCLES: u64 = 250;
const PACKETS: u64 = 4 * CYCLES;

fn run(bencher: Bencher, config: &BusConfig, period: SimDuration, turning: bool) {
    let mut harness = Harness::new(config);
    harness.plant.turning = turning;
    run_harness(bencher, harness, period);
}

fn run_harness(bencher: Bencher, mut harness: Harness, period: SimDuration) {
    harness.open().expect("the bus opens");
    bencher.counter(ItemsCount::new(PACKETS)).bench_local(|| {
        let to = harness.now() + period * CYCLES;
        let cycles = harness
            .run_cycles(period, to, |_| [0.1; 8])
            .expect("the bus works");
        assert_eq!(cycles, CYCLES);
    });
}

#[divan::bench]
fn packets_at_500_hz_through_the_controller(bencher: Bencher) {
    run(bencher, &BusConfig::default(), millis(2), false);
}

#[divan::bench]
fn packets_at_500_hz_with_turning_motors(bencher: Bencher) {
    run(bencher, &BusConfig::default(), millis(2), true);
}

#[divan::bench]
fn packets_at_333_hz_without_a_controller(bencher: Bencher) {
    let config = BusConfig {
        topology: BusTopology::Direct,
        ..BusConfig::default()
    };
    run(bencher, &config, millis(3), false);
}

/// The cost of a cycle is linear in the number of boards on the bus.
#[divan::bench(args = [0, 8, 16, 46])]
fn packets_beside_unused_boards(bencher: Bencher, unused: usize) {
    run_harness(bencher, Harness::with_unused_boards(unused), millis(2));
}

/// A second of ticks without cycles.
#[divan::bench]
fn second_without_cycles(bencher: Bencher) {
    let mut harness = Harness::new(&BusConfig::default());
    harness.plant.turning = false;
    harness.open().expect("the bus opens");
    bencher.bench_local(|| {
        let to = harness.now() + SimDuration::from_secs(1);
        harness.run_until(to).expect("the bus works");
    });
}
