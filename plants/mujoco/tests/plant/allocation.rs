//! A run asks for no memory on this side of the engine once it is under way.

use crate::scene::{Scene, standing};
use twinrig_mujoco::Coordinates;
use twinrig_runtime::Plant;

#[test]
fn a_robot_that_stands_asks_for_no_memory() {
    for coordinates in Coordinates::ALL {
        let mut scene = Scene::of(standing(), coordinates);
        for _ in 0..100 {
            scene.go(2000);
        }
        let counted = allocation_counter::measure(|| {
            for _ in 0..100 {
                scene.go(2000);
                scene.all();
                scene.plant.begin_window();
            }
        });
        assert_eq!(counted.count_total, 0, "{coordinates:?}");
        // The counter does count.
        assert!(allocation_counter::measure(|| drop(scene.plant.save())).count_total > 0);
    }
}
