use crate::scene::*;
use twinrig_lcp::Method;
use twinrig_legged::{Base, Drives, Setup};
use twinrig_runtime::Plant;

pub const WAYS: [Way; 6] = [
    Way::by(Method::Rk4, 2000),
    Way::by(Method::Rodas4, 2000),
    Way::by(Method::Moreau, 2000),
    Way::by(Method::SemiImplicit, 1000),
    Way::by(Method::ExplicitEuler, 50),
    Way::by(Method::Thesis, 50),
];

fn show(
    name: &str,
    robot: &twinrig_robot::Robot,
    setup: &Setup,
    seconds: f64,
    ways: &[Way],
    drive: &dyn Fn(&mut Scene),
) {
    for way in ways {
        let mut scene = match std::panic::catch_unwind(|| built(robot, setup, *way).map(drop)) {
            Ok(Ok(())) => Scene::new(robot, setup, *way),
            Ok(Err(e)) => {
                println!("{name} {:?}: refused {e}", way.method);
                continue;
            }
            Err(_) => {
                println!("{name} PANIC");
                continue;
            }
        };
        drive(&mut scene);
        let t0 = std::time::Instant::now();
        let out = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| scene.soundly(seconds)));
        let out = match out {
            Ok(Ok(())) => "ok".to_string(),
            Ok(Err(f)) => format!("FAULT {f}"),
            Err(_) => "PANIC".into(),
        };
        let b = scene.energy();
        let w = scene.plant.work();
        let foot = scene.read("leg/LF/foot/position");
        let body = scene.read("body/position");
        println!(
            "{name} {:?} {} us tol {:e}: {out} | {:.2} s host | body {:.4?} foot {:.5?} | K {:.2e} S {:.2e} res {:.1e} exch {:.1e} imp {:.1e} diss {:.1e} act {:.1e} | steps {} ev {} evals {} fall {}",
            way.method,
            way.step_us,
            way.tolerance,
            t0.elapsed().as_secs_f64(),
            body,
            foot,
            b.kinetic,
            b.spring,
            b.residual,
            b.exchanged,
            b.impact,
            b.dissipated,
            b.actuator,
            w.steps,
            w.events,
            w.evaluations,
            w.fallbacks
        );
    }
}

#[test]
fn xx() {
    let none = |_: &mut Scene| {};
    let r = robot();
    for q in [1e-9, 1e-6, 1e-3, 1e-2] {
        let straight = changed(|leg| {
            leg.q2_ref = q;
        });
        show(
            &format!("straight {q:e}"),
            &straight,
            &hanging(pose([10.0, 0.0, 0.0], [0.0, 0.0, 0.0])),
            0.2,
            &WAYS,
            &none,
        );
        show(
            &format!("straight bent {q:e}"),
            &straight,
            &hanging(pose([10.0, -20.0, 30.0], [0.0, 0.0, 0.0])),
            0.2,
            &WAYS,
            &none,
        );
    }
    let driven = Setup {
        base: Base::Fixed,
        ground: None,
        ..standing()
    };
    show("wound", &r, &driven, 0.5, &WAYS, &|s| {
        for p in s.commands.chunks_mut(2) {
            p[1] = 10.0
        }
    });
    let ideal = Setup {
        drives: Drives::Ideal { period: 5e-3 },
        ..driven.clone()
    };
    show("wound ideal", &r, &ideal, 0.5, &WAYS, &|s| {
        for p in s.commands.chunks_mut(2) {
            p[1] = 10.0
        }
    });
    show("unwound", &r, &driven, 0.5, &WAYS, &|s| {
        for p in s.commands.chunks_mut(2) {
            p[1] = -10.0
        }
    });
    show("whirled", &r, &driven, 0.5, &WAYS, &|s| {
        for p in s.commands.chunks_mut(2) {
            p[0] = 1000.0
        }
    });
    let light = changed(|leg| {
        let m = &mut leg.mass;
        for x in [&mut m.l1, &mut m.l2, &mut m.l3, &mut m.foot] {
            *x *= 1e-6
        }
    });
    show("light", &light, &hanging(passive()), 0.1, &WAYS, &none);
    show(
        "light between",
        &light,
        &hanging(pose([10.0, -25.0, 37.0], [0.0; 3])),
        0.1,
        &WAYS,
        &none,
    );
    for k in [1e-2, 1e-1, 1e1, 1e2, 1e3, 1e4] {
        show(
            &format!("stiffness {k:e}"),
            &stiffened(k),
            &hanging(hard()),
            0.3,
            &WAYS,
            &none,
        );
        show(
            &format!("standing stiffness {k:e}"),
            &stiffened(k),
            &standing(),
            0.3,
            &WAYS,
            &none,
        );
    }
    let undamped = changed(|leg| {
        let f = &mut leg.joint_friction;
        for x in [&mut f.hip, &mut f.knee, &mut f.ankle, &mut f.toe] {
            *x = 0.0
        }
        leg.diagonal.preload = -0.004;
        leg.parallel.preload = -0.004;
        leg.parallel_travel = 0.02;
    });
    show(
        "undamped",
        &undamped,
        &hanging(pose([10.0, -25.0, 37.0], [0.0; 3])),
        20.0,
        &[WAYS[0], WAYS[1], WAYS[2], WAYS[3]],
        &none,
    );
    for f in [0.0, 0.6, 10.0] {
        show(
            &format!("stand mu {f}"),
            &r,
            &Setup {
                ground: Some(flat(f)),
                ..standing()
            },
            0.5,
            &WAYS,
            &none,
        );
    }
    for (mu, h) in [(0.6, 1.0), (0.0, 1.0), (10.0, 1.0), (0.6, 0.1)] {
        show(
            &format!("drop {h} mu {mu}"),
            &r,
            &Setup {
                ground: Some(below(h, mu)),
                ..standing()
            },
            0.8,
            &WAYS,
            &none,
        );
        show(
            &format!("limp drop {h} mu {mu}"),
            &r,
            &Setup {
                ground: Some(below(h, mu)),
                drives: Drives::None,
                ..standing()
            },
            0.8,
            &WAYS,
            &none,
        );
    }
    for (m, us, tol) in [
        (Method::ExplicitEuler, 1000, 1.0),
        (Method::ExplicitEuler, 2000, 1.0),
        (Method::ExplicitEuler, 10000, 1.0),
        (Method::SemiImplicit, 10000, 1.0),
        (Method::SemiImplicit, 20000, 1.0),
        (Method::SemiImplicit, 50000, 1.0),
        (Method::Moreau, 10000, 1.0),
        (Method::Moreau, 20000, 1.0),
        (Method::Moreau, 50000, 1.0),
        (Method::Rk4, 20000, f64::INFINITY),
        (Method::Rk4, 30000, f64::INFINITY),
        (Method::Rk4, 50000, f64::INFINITY),
        (Method::Rk4, 50000, 3e-7),
        (Method::Rodas4, 50000, f64::INFINITY),
        (Method::Rodas4, 50000, 1e-7),
        (Method::Thesis, 2000, 1.0),
        (Method::Thesis, 10000, 1.0),
    ] {
        let way = Way::by(m, us).within(tol);
        show("step passive", &r, &hanging(passive()), 2.0, &[way], &none);
        show("step hard", &r, &hanging(hard()), 2.0, &[way], &none);
        show("step stand", &r, &standing(), 2.0, &[way], &none);
    }
}
