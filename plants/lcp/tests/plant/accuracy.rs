//! How far a foot may be off.

use twinrig_lcp::Method;
use twinrig_legged::Start;
use twinrig_robot::Robot;
use twinrig_runtime::Plant;

use crate::scene::{
    DEFAULT, Scene, Way, changed, hanging, hard, passive, pose, rmse, robot, stiffened,
};

#[test]
fn xx() {
    let between = changed(|leg| {
        leg.diagonal.preload = -0.004;
        leg.parallel.preload = -0.004;
        leg.parallel_travel = 0.014;
    });
    let mut list: Vec<(String, Robot, Start)> = vec![
        ("passive".into(), robot(), passive()),
        ("hard".into(), robot(), hard()),
        (
            "between".into(),
            between,
            pose([10.0, -25.0, 37.0], [6.0, -4.0, 3.0]),
        ),
    ];
    for k in [3.0, 10.0, 30.0, 100.0] {
        list.push((format!("stiff {k}"), stiffened(k), passive()));
        list.push((format!("stiffhard {k}"), stiffened(k), hard()));
        let mut r = stiffened(k);
        for m in &mut r.legs {
            m.leg.diagonal.preload = 0.003;
            m.leg.parallel.preload = 0.003;
        }
        list.push((format!("stiffpreload {k}"), r.clone(), passive()));
        list.push((format!("stiffpreload hard {k}"), r.clone(), hard()));
    }
    for (name, robot, start) in list {
        let setup = hanging(start);
        let right = Scene::new(
            &robot,
            &setup,
            Way::by(Method::Rk4, 10).within(f64::INFINITY),
        )
        .trace("LF", 300);
        let right2 = Scene::new(&robot, &setup, Way::by(Method::Rodas4, 2000).within(1e-12))
            .trace("LF", 300);
        println!("{name}: references {:.1e}", rmse(&right, &right2));
        for tol in [1e-5, 1e-6, 3e-7, 1e-7, 1e-8, f64::INFINITY] {
            for method in [Method::Rk4, Method::Rodas4] {
                let mut scene = Scene::new(&robot, &setup, Way::by(method, 2000).within(tol));
                let feet = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
                    scene.trace("LF", 300)
                }));
                let Ok(feet) = feet else {
                    println!("  {tol:e} {method:?} FAULT");
                    continue;
                };
                let t0 = std::time::Instant::now();
                for _ in 0..20 {
                    Scene::new(&robot, &setup, Way::by(method, 2000).within(tol)).to_ms(300);
                }
                let speed = 20.0 * 0.3 / t0.elapsed().as_secs_f64();
                println!(
                    "  {tol:e} {method:?} rmse {:.2e} {:?} residual {:.1e} x{speed:.0}",
                    rmse(&feet, &right),
                    scene.plant.work(),
                    scene.energy().residual
                );
            }
        }
    }
    let _ = DEFAULT;
}
