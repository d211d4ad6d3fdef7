#[allow(dead_code)]
#[path = "../tests/plant/scene.rs"]
mod scene;
use scene::{Golden, Scene, hanging};
use twinrig_rapier::{Joints, Options};
use twinrig_runtime::Plant;
fn main() {
    let name = std::env::args().nth(1).unwrap();
    for joints in Joints::ALL {
        let golden = Golden::read(&name);
        let robot = golden.robot();
        let mut options = Options::new(hanging(&["LF"], golden.start(), std::env::args().nth(2).unwrap().parse().unwrap()), joints);
        options.solver.pgs_iterations = std::env::args().nth(3).unwrap().parse().unwrap();
        let mut scene = Scene::new(&robot, &options);
        let dt = golden.number("step_s");
        let (feet, hip) = (golden.rows("foot"), robot.legs[0].hip);
        for (k, foot) in (0_u64..).zip(&feet) {
            scene.to_us((1e6 * dt * k as f64).round() as u64);
            let (found, trunk) = (scene.read("leg/LF/foot/position"), scene.read("body/position"));
            if k % 3 == 0 {
                let b = scene.plant.energy();
                println!("{k:4} {:9.5} {:9.5} | {:9.5} {:9.5} | res {:.2e} kin {:.3e} imp {:.2e} drift {:.1e}", found[0]-trunk[0]-hip[0], foot[0], found[2]-trunk[2]-hip[2], foot[1], b.residual, b.kinetic, b.impact, scene.plant.drift().unwrap());
            }
        }
    }
}
