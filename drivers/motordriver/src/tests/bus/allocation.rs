//! A running bus does not allocate.

use allocation_counter::measure;
use twinrig_kernel::SimDuration;
use twinrig_motordriver::{BusConfig, BusTopology};

use super::harness::{Harness, millis, with_clocks};

fn allocations(config: &BusConfig) -> u64 {
    let mut harness = Harness::new(config);
    harness.open().unwrap();
    let mut second = |seconds: u64| {
        let end = harness.now() + SimDuration::from_secs(seconds);
        harness
            .run_cycles(millis(2), end, |now| {
                [0.1 * libm::sin(now.as_secs_f64()); 8]
            })
            .unwrap();
    };
    // Buffers reach their final size.
    second(1);
    measure(|| second(2)).count_total
}

#[test]
fn cycles_do_not_allocate() {
    let phases = [10, 300, 500, 990].map(SimDuration::from_micros);
    for topology in [BusConfig::default().topology, BusTopology::Direct] {
        let config = BusConfig {
            topology,
            ..BusConfig::default()
        };
        let config = with_clocks(config, [-764_000, -749_000, 767_000, 0], phases);
        assert_eq!(allocations(&config), 0, "{topology:?}");
    }
}
