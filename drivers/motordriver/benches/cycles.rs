//! What a cycle costs: a frame of four requests through USB and bus controller, four answers back, and eight ticks of
//! boards with two motors each.

#[path = "../tests/common/mod.rs"]
mod common;

use common::{Bench, millis};
use divan::Bencher;
use divan::counter::ItemsCount;
use twinrig_kernel::SimDuration;
use twinrig_motordriver::{BusConfig, BusTopology};

fn main() {
    divan::main();
}

/// A second at a time.
const CYCLES: u64 = 500;

fn run(bencher: Bencher, config: &BusConfig, turning: bool) {
    let mut bench = Bench::new(config);
    bench.world.turning = turning;
    bench.open().expect("the bus opens");
    bencher
        .counter(ItemsCount::new(CYCLES * 4))
        .bench_local(|| {
            let to = bench.now() + SimDuration::from_secs(1);
            bench
                .run_cycles(millis(2), to, |_| [0.1; 8])
                .expect("the bus works")
        });
}

/// Items are packets to boards, each with its answer.
#[divan::bench]
fn second_at_500_hz_through_the_controller(bencher: Bencher) {
    run(bencher, &BusConfig::default(), false);
}

#[divan::bench]
fn second_at_500_hz_with_turning_motors(bencher: Bencher) {
    run(bencher, &BusConfig::default(), true);
}

#[divan::bench]
fn second_at_400_hz_without_a_controller(bencher: Bencher) {
    let config = BusConfig {
        topology: BusTopology::Direct,
        ..BusConfig::default()
    };
    run(bencher, &config, false);
}

/// A second of ticks and USB frames alone.
#[divan::bench]
fn second_without_cycles(bencher: Bencher) {
    let mut bench = Bench::new(&BusConfig::default());
    bench.world.turning = false;
    bench.open().expect("the bus opens");
    bencher.bench_local(|| {
        let to = bench.now() + SimDuration::from_secs(1);
        bench.run_until(to).expect("the bus works");
    });
}
