//! A run allocates nothing once it is under way.

use twinrig_massless::Force;
use twinrig_runtime::Plant;

use crate::scene::{Scene, Trot, at, robot, setup};

#[test]
fn steps_and_looks_under_way_allocate_nothing() {
    let (robot, setup) = (robot(), setup());
    let mut scene = Scene::trotting(&robot, &setup, Force::Solve, 1000);
    let commands: Vec<Vec<f64>> = (1001..2000)
        .map(|ms| {
            let commands = Trot::START.commands(&robot, &setup, f64::from(ms) * 1e-3);
            commands
                .iter()
                .flat_map(|(_, command)| [command.hip, command.knee])
                .collect()
        })
        .collect();
    let mut outputs = vec![0.0; scene.observe().len()];
    let allocations = allocation_counter::measure(|| {
        for (ms, commands) in (1001..).zip(&commands) {
            scene.plant.advance(at(ms), commands).unwrap();
            scene.plant.observe(&mut outputs);
            scene.plant.begin_window();
        }
    });
    assert_eq!(allocations.count_total, 0);
    // The counter does count.
    assert!(allocation_counter::measure(|| drop(scene.plant.save())).count_total > 0);
}
