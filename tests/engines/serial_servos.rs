//! Legs on serial servos in the engines: torques and friction of the drives are ours, the motion is
//! theirs.

use twinrig::kernel::SimDuration;

use crate::{ENGINES, feet_of_text, rms};

const HANGING: &str = r#"
name = "hanging"
robot = "cheetah-cub-sts3215"
duration = "2 s"
seed = 1
override.serial.controller.gain = 32

[plant]
model = "lcp"
base = "fixed"

[actuator]
kind = "serial"

[controller]
kind = "cpg"
gait = "trot"
period = "2 ms"
frequency = "2 Hz"
ramp = "500 ms"
"#;

/// The same with joints of abduction, whose servos are on a bus, too.
const ABDUCTING: &str = r#"
name = "abducting"
robot = "half-cub-xl330"
duration = "2 s"
seed = 1

[plant]
model = "lcp"
base = "fixed"
abduction = "free"

[actuator]
kind = "serial"
firmware = "bus"

[[bus]]
kind = "dynamixel"
settings = { position_p_gain = 1500 }

[controller]
kind = "cpg"
gait = "trot"
period = "10 ms"
frequency = "2 Hz"
ramp = "500 ms"
abduction = "steer"
turn = "60 deg/s"
"#;

/// To the side MuJoCo is 0.04 mm from the full plant, of 24 mm; along the leg 0.4 mm, as without
/// abduction.
#[test]
fn mujoco_abducts_legs_on_serial_servos_as_the_full_plant() {
    if !ENGINES.contains(&"mujoco") {
        return;
    }
    let track = |plant: &str| -> Vec<Vec<f64>> {
        let model = format!("\"{plant}\"");
        let settings = [("plant.model", &*model)];
        let feet = feet_of_text(ABDUCTING, &settings, SimDuration::from_secs(2));
        let to_the_side = |feet: &Vec<f64>| feet.iter().skip(1).step_by(3).copied().collect();
        feet.iter().map(to_the_side).collect()
    };
    let (reference, found) = (track("lcp"), track("mujoco"));
    let distance = rms(&reference, &found);
    assert!(distance < 1e-4, "{distance} m");
    let still = vec![reference[0].clone(); reference.len()];
    let moved = rms(&reference, &still);
    assert!(moved > 4e-3, "{moved} m to the side");
}

/// Feet of a hanging robot that trots in the air: MuJoCo is 0.4 mm from the full plant, Rapier
/// 2.3 mm.
#[test]
fn engines_move_the_feet_as_the_full_plant() {
    let track = |plant: &str| {
        let model = format!("\"{plant}\"");
        feet_of_text(
            HANGING,
            &[("plant.model", &model)],
            SimDuration::from_secs(2),
        )
    };
    let reference = track("lcp");
    for engine in ENGINES {
        let distance = rms(&reference, &track(engine));
        let most = if *engine == "mujoco" { 6e-4 } else { 3e-3 };
        assert!(distance < most, "{engine}: {distance} m");
    }
    // The feet do move, by more than centimetres.
    let still = vec![reference[0].clone(); reference.len()];
    assert!(rms(&reference, &still) > 2e-2);
}
