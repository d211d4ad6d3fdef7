//! A run asks for no memory once it is under way.

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_lcp::Method;
use twinrig_runtime::Plant;

use crate::scene::{Scene, Way, hanging, hard, passive, robot, standing};
use crate::trot;

const METHODS: [Method; 4] = [
    Method::Rk4,
    Method::Rodas4,
    Method::Moreau,
    Method::SemiImplicit,
];

/// Advances, looks and begins a window every two milliseconds, and counts what is asked for meanwhile.
fn asked(scene: &mut Scene, from_ms: u64, commands: &[Vec<f64>]) -> u64 {
    let mut outputs = scene.observe().to_vec();
    let counted = allocation_counter::measure(|| {
        for (tick, commands) in (from_ms / 2 + 1..).zip(commands) {
            let at = SimTime::ZERO + SimDuration::from_millis(2 * tick);
            scene.plant.advance(at, commands).unwrap();
            scene.plant.observe(&mut outputs);
            scene.plant.begin_window();
        }
    });
    counted.count_total
}

#[test]
fn a_trot_under_way_asks_for_no_memory() {
    let robot = robot();
    let setup = trot::begun(&robot, standing());
    // RODAS4 is not for gaits; it is seen below.
    for method in METHODS.into_iter().filter(|m| *m != Method::Rodas4) {
        let mut scene = Scene::new(&robot, &setup, Way::by(method, 2000));
        let (first, second) = (
            trot::commands(&robot, &setup, 0, 1000),
            trot::commands(&robot, &setup, 1000, 1400),
        );
        asked(&mut scene, 0, &first);
        assert_eq!(asked(&mut scene, 1000, &second), 0, "{method:?}");
        // The counter does count.
        assert!(allocation_counter::measure(|| drop(scene.plant.save())).count_total > 0);
    }
}

#[test]
fn legs_that_swing_and_rattle_ask_for_no_memory() {
    for start in [passive(), hard()] {
        for method in METHODS {
            let mut scene = Scene::new(&robot(), &hanging(start.clone()), Way::by(method, 2000));
            let none = vec![Vec::new(); 100];
            asked(&mut scene, 0, &none);
            assert_eq!(asked(&mut scene, 200, &none), 0, "{method:?}");
        }
    }
}
