//! Legs that abduct, by the servos of Oncilla's servo board.

use twinrig::Registry;
use twinrig_tests::{assert_legs_follow_the_servo_board, shipped};

#[test]
fn unplugged_servo_board_changes_the_motion_of_legs_that_abduct() {
    for plant in ["massless", "lcp"] {
        assert_legs_follow_the_servo_board(plant);
    }
}

#[test]
fn free_abduction_is_refused_where_it_is_not_modelled() {
    let registry = Registry::standard();
    let refusal = |file: &str, settings: &[(&str, &str)]| {
        let free = [settings, &[("plant.abduction", "'free'")]].concat();
        let assembled = shipped(&registry, file, &free).and_then(|assembly| assembly.rig());
        assembled.map(|_| ()).unwrap_err().to_string()
    };
    let oncilla = |settings: &[(&str, &str)]| refusal("oncilla-trot.toml", settings);
    let lcp = ("plant.model", "'lcp'");
    let rigid = ("plant.constraints", "'rigid'");
    for (text, part) in [
        (
            oncilla(&[rigid]),
            "`massless` with rigid constraints has no joints of abduction",
        ),
        (
            oncilla(&[lcp, rigid]),
            "`lcp` with rigid constraints has no joints of abduction",
        ),
        (
            oncilla(&[lcp, ("plant.toe", "true")]),
            "`lcp` with toe joints has no joints of abduction",
        ),
        (
            refusal("trot.toml", &[]),
            "leg LF has no joint of abduction: add `[leg.….abduction]`",
        ),
    ] {
        assert!(text.contains(part), "{text}");
    }
}
