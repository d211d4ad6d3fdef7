//! A run does not allocate after its start.

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_lcp::Method;
use twinrig_runtime::Plant;
use twinrig_testing::robots::robot;
use twinrig_testing::trot::Trot;

use crate::harness::{
    Harness, Integration, hard_impact, lcp, passive_start, standing_setup, suspended,
};

const METHODS: [Method; 4] = [
    Method::Rk4,
    Method::Rodas4,
    Method::Moreau,
    Method::SemiImplicit,
];

/// Advances, observes and begins a window every 2 ms; returns the number of allocations.
fn allocations(harness: &mut Harness, from_ms: u64, commands: &[Vec<f64>]) -> u64 {
    let mut outputs = harness.observe().to_vec();
    let counted = allocation_counter::measure(|| {
        for (tick, commands) in (from_ms / 2 + 1..).zip(commands) {
            let at = SimTime::ZERO + SimDuration::from_millis(2 * tick);
            harness.plant.advance(at, commands).unwrap();
            harness.plant.observe(&mut outputs);
            harness.plant.begin_window();
        }
    });
    counted.count_total
}

#[test]
fn trot_does_not_allocate() {
    let robot = robot();
    let setup = Trot::START.started(&robot, standing_setup());
    // RODAS4 is not intended for gaits; the test below covers it.
    for method in METHODS.into_iter().filter(|m| *m != Method::Rodas4) {
        let mut harness = lcp(&robot, &setup, Integration::new(method, 2000));
        let (first, second) = (
            Trot::START.sampled(&robot, &setup, 0, 1000),
            Trot::START.sampled(&robot, &setup, 1000, 1400),
        );
        allocations(&mut harness, 0, &first);
        assert_eq!(allocations(&mut harness, 1000, &second), 0, "{method:?}");
        // The counter detects allocations.
        assert!(allocation_counter::measure(|| drop(harness.plant.save())).count_total > 0);
    }
}

#[test]
fn swinging_and_chattering_legs_do_not_allocate() {
    for start in [passive_start(), hard_impact()] {
        for method in METHODS {
            let mut harness = lcp(
                &robot(),
                &suspended(start.clone()),
                Integration::new(method, 2000),
            );
            let none = vec![Vec::new(); 100];
            allocations(&mut harness, 0, &none);
            assert_eq!(allocations(&mut harness, 200, &none), 0, "{method:?}");
        }
    }
}
