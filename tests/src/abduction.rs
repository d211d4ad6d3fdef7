//! Trot of legs that abduct, by the servos of Oncilla's servo board.

use twinrig::kernel::{SimDuration, SimTime};

use crate::{run_from, shipped};

/// Returns fingerprint and angle of abduction of the left fore leg \[rad\] of a second of Oncilla's
/// trot, whose legs are commanded outwards at half of it.
fn spreading_trot(settings: &[(&str, &str)]) -> (String, f64) {
    let registry = twinrig::registry();
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

/// Checks that the legs of a plant follow the servo board, and not one that is unplugged.
///
/// # Panics
/// If they do not.
pub fn assert_legs_follow_the_servo_board(plant: &str) {
    let model = format!("'{plant}'");
    let free = [
        ("plant.model", model.as_str()),
        ("plant.abduction", "'free'"),
    ];
    let (plugged, angle) = spreading_trot(&free);
    // 4° = 0.0698 rad, less the dead band of 0.3° and the load.
    assert!((0.05..0.08).contains(&angle), "{plant}: {angle}");
    let fault = "[{ at = '0.4 s', on = 'wire/rb110', kind = 'unplug', for = '9 s' }]";
    let cut = [&free[..], &[("fault", fault)]].concat();
    let (unplugged, angle) = spreading_trot(&cut);
    assert!(angle.abs() < 0.02, "{plant}: {angle}");
    assert_ne!(plugged, unplugged, "{plant}");
    assert_eq!(plugged, spreading_trot(&free).0, "{plant}: two runs");
}
