//! Number and causes of wake-ups of a running bus: a deterministic measure of its cost.

use twinrig_kernel::SimDuration;
use twinrig_motordriver::{BusConfig, BusTopology};
use twinrig_runtime::{BusWork, Part};

use super::harness::{Harness, LEGS, millis, with_clocks};

/// Returns the wake-ups in a second of cycles.
fn wakes(config: &BusConfig, period: SimDuration) -> u64 {
    let phases = [10, 300, 620, 990].map(SimDuration::from_micros);
    let config = with_clocks(config.clone(), [0; 4], phases);
    let mut harness = Harness::new(&config);
    harness.open().unwrap();
    let mut second = || {
        let end = harness.now() + SimDuration::from_secs(1);
        let before = harness.woken;
        harness.run_cycles(period, end, |_| [0.1; 8]).unwrap();
        harness.woken - before
    };
    second();
    second()
}

/// Ticks of all boards per millisecond.
const TICKS: u64 = LEGS.len() as u64;

#[test]
fn controller_cycle_takes_one_wake_per_packet_and_one_per_read() {
    // Per board: end of the request. The last answer ends apart.
    let found = wakes(&BusConfig::default(), millis(2));
    assert_eq!(
        found / 500,
        2 * TICKS + TICKS + 1 + 4,
        "{found} in 500 cycles"
    );
}

#[test]
fn controller_cycle_byte_by_byte_takes_five_wakes_per_packet() {
    let config = BusConfig {
        packet_level: false,
        ..BusConfig::default()
    };
    // Per board: start and end of the request; first byte, length and last byte of the answer.
    let found = wakes(&config, millis(2));
    assert_eq!(
        found / 500,
        2 * TICKS + 5 * TICKS + 4,
        "{found} in 500 cycles"
    );
}

#[test]
fn direct_cycle_takes_three_wakes_per_packet_and_one_per_read() {
    let config = BusConfig {
        topology: BusTopology::Direct,
        ..BusConfig::default()
    };
    // Per board: end of the request, first and last byte of the answer, and one read.
    let found = wakes(&config, millis(4));
    assert_eq!(found / 250, 4 * TICKS + 4 * TICKS, "{found} in 250 cycles");
}

#[test]
fn idle_bus_wakes_for_board_ticks_only() {
    let found = wakes(&BusConfig::default(), SimDuration::from_secs(100));
    assert_eq!(found, 1_000 * TICKS);
}

#[test]
fn every_answer_is_computed_as_a_whole_and_a_board_adds_its_ticks_only() {
    let work = |unused: usize| {
        let mut harness = Harness::with_unused_boards(unused);
        harness.open().unwrap();
        let mut count = || {
            let end = harness.now() + SimDuration::from_secs(1);
            harness.run_cycles(millis(2), end, |_| [0.1; 8]).unwrap();
            let mut work = BusWork::default();
            harness.task.count_work(&mut work);
            work
        };
        let (before, after) = (count(), count());
        assert_eq!(after.packets, after.transmissions);
        assert_eq!(after.packets - before.packets, 500 * TICKS);
        after.instants - before.instants
    };
    let (none, eight) = (work(0), work(8));
    // Ends of four requests and of the last answer, and the common ticks of the four boards; those
    // of others are apart.
    assert_eq!(none, 500 * (TICKS + 1) + 1_000);
    assert_eq!(eight, none + 8_000);
}
