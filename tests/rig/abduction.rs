//! Legs that abduct, by the servos of Oncilla's servo board.

use twinrig::Registry;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_tests::{run_from, shipped};

/// Returns fingerprint and angle of abduction of the left fore leg \[rad\] of a second of Oncilla's
/// trot, whose legs are commanded outwards at half of it.
fn trot(settings: &[(&str, &str)]) -> (String, f64) {
    let registry = Registry::standard();
    let change = "[{ at = '0.5 s', set = 'splay', to = '4 deg' }]";
    let settings = [settings, &[("change", change)]].concat();
    let mut rig = shipped(&registry, "oncilla-trot.toml", &settings)
        .unwrap()
        .rig()
        .unwrap();
    let digest = run_from(&mut rig, SimTime::ZERO + SimDuration::from_secs(1));
    let state = rig.plant().state().unwrap();
    let angle = state.get("leg/LF/abduction").map_or(0.0, |joint| joint[0]);
    (digest.to_string(), angle)
}

#[test]
fn unplugged_servo_board_changes_the_motion_of_legs_that_abduct() {
    let fault = "[{ at = '0.4 s', on = 'wire/rb110', kind = 'unplug', for = '9 s' }]";
    for model in ["'massless'", "'lcp'"] {
        let free = [("plant.model", model), ("plant.abduction", "'free'")];
        let (plugged, angle) = trot(&free);
        // 4° = 0.0698 rad, less the dead band of 0.3° and the load.
        assert!((0.05..0.08).contains(&angle), "{model}: {angle}");
        let cut = [&free[..], &[("fault", fault)]].concat();
        let (unplugged, angle) = trot(&cut);
        assert!(angle.abs() < 0.02, "{model}: {angle}");
        assert_ne!(plugged, unplugged, "{model}");
        assert_eq!(plugged, trot(&free).0, "{model}: two runs");
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
            refusal("trot-serial.toml", &[]),
            "a robot with serial servos has no joints of abduction",
        ),
        (
            refusal("trot.toml", &[]),
            "leg LF has no joint of abduction: add `[leg.….abduction]`",
        ),
    ] {
        assert!(text.contains(part), "{text}");
    }
}
