//! A running plant allocates no memory outside the engine.

use twinrig_mujoco::Coordinates;
use twinrig_runtime::Plant;

use super::fixture::{standing, with_coordinates};

#[test]
fn standing_robot_does_not_allocate() {
    for coordinates in Coordinates::ALL {
        let mut fixture = with_coordinates(standing(), coordinates);
        for _ in 0..100 {
            fixture.advance_us(2000);
        }
        let counted = allocation_counter::measure(|| {
            for _ in 0..100 {
                fixture.advance_us(2000);
                fixture.observe();
                fixture.plant.begin_window();
            }
        });
        assert_eq!(counted.count_total, 0, "{coordinates:?}");
        // Checks that the counter counts.
        assert!(allocation_counter::measure(|| drop(fixture.plant.save())).count_total > 0);
    }
}
