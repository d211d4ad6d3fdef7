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
