//! How often a running bus is woken, and what it is woken for: work is counted, not timed.

mod common;

use common::{Bench, LEGS, millis, with_clocks};
use twinrig_kernel::SimDuration;
use twinrig_motordriver::{BusConfig, BusTopology};

/// Wake-ups in a second of cycles.
fn wakes(config: &BusConfig, period: SimDuration) -> u64 {
    let phases = [10, 300, 620, 990].map(SimDuration::from_micros);
    let config = with_clocks(config.clone(), [0; 4], phases);
    let mut bench = Bench::new(&config);
    bench.open().unwrap();
    let mut second = || {
        let end = bench.now() + SimDuration::from_secs(1);
        let before = bench.woken;
        bench.run_cycles(period, end, |_| [0.1; 8]).unwrap();
        bench.woken - before
    };
    second();
    second()
}

/// Ticks of all boards in a millisecond.
const TICKS: u64 = LEGS.len() as u64;

#[test]
fn a_cycle_through_the_controller_takes_five_wake_ups_a_packet_and_one_a_read() {
    // For each board: the request begins and ends; of the answer the first byte, the length and the last byte.
    let packets = 5 * TICKS;
    let found = wakes(&BusConfig::default(), millis(2));
    assert_eq!(
        found / 500,
        2 * TICKS + packets + 4,
        "{found} in 500 cycles"
    );
}

#[test]
fn without_a_controller_it_takes_three_a_packet_and_one_a_read() {
    let config = BusConfig {
        topology: BusTopology::Direct,
        ..BusConfig::default()
    };
    // For each board: the end of the request, the first and the last byte of the answer, and one read.
    let found = wakes(&config, millis(4));
    assert_eq!(found / 250, 4 * TICKS + 4 * TICKS, "{found} in 250 cycles");
}

#[test]
fn a_bus_at_rest_is_woken_by_the_ticks_of_its_boards_alone() {
    let found = wakes(&BusConfig::default(), SimDuration::from_secs(100));
    assert_eq!(found, 1_000 * TICKS);
}
