//! Legs that hang from a held trunk, against trajectories of another program.

use twinrig_rapier::{Joints, Options};

use crate::scene::{Golden, Scene, hanging};

/// Root mean square and greatest error of the foot over the golden's time \[m\].
pub fn error(name: &str, options: impl Fn(Options) -> Options, joints: Joints, step_us: u64) -> [f64; 2] {
    let golden = Golden::read(name);
    let robot = golden.robot();
    let setup = hanging(&["LF"], golden.start(), step_us);
    let mut scene = Scene::new(&robot, &options(Options::new(setup, joints)));
    let (feet, step) = (golden.rows("foot"), golden.number("step_s"));
    let (mut square, mut worst) = (0.0, 0.0_f64);
    let hip = robot.legs[0].hip;
    for (k, foot) in feet.iter().enumerate() {
        scene.to_us((k as f64 * step * 1e6).round() as u64);
        let (found, trunk) = (scene.read("leg/LF/foot/position"), scene.read("body/position"));
        let apart = [0, 2].map(|axis| found[axis] - trunk[axis] - hip[axis] - foot[axis / 2]);
        let away = apart[0] * apart[0] + apart[1] * apart[1];
        square += away;
        worst = worst.max(away.sqrt());
    }
    [(square / feet.len() as f64).sqrt(), worst]
}

#[test]
fn look() {
    for name in ["passive", "hard-hit", "between"] {
        for joints in Joints::ALL {
            for step_us in [2000, 1000, 750, 500, 400, 250, 100] {
                let [rms, worst] = error(name, |o| o, joints, step_us);
                println!("{name:10} {joints:?} {step_us:5}: {rms:.2e} {worst:.2e}");
            }
        }
    }
}
