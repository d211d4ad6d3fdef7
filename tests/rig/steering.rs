//! Gaits that turn and step to the side, by the servos of Oncilla's servo board.

use twinrig_tests::assert_steers;

#[test]
fn oncilla_turns_and_steps_to_the_side() {
    for plant in ["massless", "lcp"] {
        assert_steers(plant);
    }
}
