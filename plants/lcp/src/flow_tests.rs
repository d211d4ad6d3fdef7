use super::*;
use twinrig_kernel::SimDuration;
use twinrig_legged::{Base, Drives, Setup, StartPose};
use twinrig_robot::RobotFile;

fn robot() -> twinrig_robot::Robot {
    let text = include_str!("../../../robots/cheetah-cub.toml");
    let mut robot = RobotFile::parse("cheetah-cub.toml", text)
        .unwrap()
        .robot()
        .unwrap();
    for mount in &mut robot.legs {
        mount.leg.toe = None;
    }
    robot
}

fn passive(base: Base, q: [f64; 3], rates: [f64; 3]) -> Flow<3> {
    flow(&robot(), base, q, rates)
}

fn flow(robot: &twinrig_robot::Robot, base: Base, q: [f64; 3], rates: [f64; 3]) -> Flow<3> {
    let d = core::f64::consts::PI / 180.0;
    let setup = Setup {
        base,
        legs: robot.legs.iter().map(|m| m.name.clone()).collect(),
        ground: None,
        step: SimDuration::from_millis(2),
        drives: Drives::None,
        start: StartPose {
            q: q.map(|x| x * d),
            rates,
        }
        .into(),
    };
    let model = Model::<3>::new(robot, &setup).unwrap();
    let zero = Lanes::zero();
    let mut state = State {
        position: [0.0; 3],
        attitude: [1.0, 0.0, 0.0, 0.0],
        velocity: [0.0; 3],
        turning: [0.0; 3],
        angles: [zero; 3],
        rates: [zero; 3],
        pulley: zero,
        pulley_rate: zero,
    };
    for (i, leg) in model.legs.iter().enumerate() {
        let s = setup.start.of_leg(&leg.name, &leg.pantograph).unwrap();
        for k in 0..3 {
            state.angles[k] = state.angles[k].with_lane(i, s.angles[k]);
            state.rates[k] = state.rates[k].with_lane(i, s.rates[k]);
        }
    }
    Flow::new(model, state, crate::options::Method::Rk4, f64::INFINITY)
}

fn foot(flow: &Flow<3>) -> [f64; 2] {
    let c = &flow.model.legs[0].constants;
    let mut f = [0.0; 2];
    for k in 0..3 {
        let a = flow.state.angles[k].lane(0);
        f[0] += c.links[k] * libm::sin(a);
        f[1] -= c.links[k] * libm::cos(a);
    }
    f
}

fn trace(mut flow: Flow<3>, h: f64) -> (Vec<[f64; 2]>, Flow<3>) {
    let per = (2e-3 / h).round() as usize;
    let mut out = vec![];
    for _ in 0..150 {
        for _ in 0..per {
            flow.step(h).unwrap();
        }
        out.push(foot(&flow));
    }
    (out, flow)
}

fn rms(a: &[[f64; 2]], b: &[[f64; 2]]) -> f64 {
    let s: f64 = a
        .iter()
        .zip(b)
        .map(|(a, b)| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2))
        .sum();
    (s / a.len() as f64).sqrt()
}

#[test]
fn scratch_free_tumble() {
    let mut robot = robot();
    for m in &mut robot.legs {
        let f = &mut m.leg.joint_friction;
        f.hip = 0.0;
        f.knee = 0.0;
        f.ankle = 0.0;
    }
    for h in [2e-3, 1e-3, 5e-4] {
        let mut flow = flow(&robot, Base::Free, [20.0, -40.0, 62.0], [-10.0, 15.0, 3.0]);
        flow.state.turning = [3.0, -2.0, 5.0];
        flow.state.velocity = [1.0, 0.5, 2.0];
        let s = flow.stored();
        flow.ledger = Ledger::opened(s);
        for _ in 0..(0.3 / h) as usize {
            flow.step(h).unwrap();
        }
        println!(
            "{h} {:?} events {} books {:?}",
            flow.state.position,
            flow.counts.events,
            flow.ledger.books()
        );
    }
}

#[test]
fn scratch_passive() {
    for (name, q, r) in [
        ("passive", [10.0, -9.5, 9.5], [0.0; 3]),
        ("hard", [20.0, -40.0, 62.0], [-10.0, 15.0, 30.0]),
    ] {
        let (reference, _) = trace(passive(Base::Fixed, q, r), 1e-5);
        for h in [2e-3, 1e-3, 5e-4, 2.5e-4, 1e-4] {
            let (t, f) = trace(passive(Base::Fixed, q, r), h);
            println!(
                "{name} h {h} rms {:e} events {} evals {} residual {:e}",
                rms(&t, &reference),
                f.counts.events,
                f.counts.evaluations,
                f.ledger.books().residual
            );
        }
        let t0 = std::time::Instant::now();
        let n = 200;
        for _ in 0..n {
            let _ = trace(passive(Base::Fixed, q, r), 2e-3);
        }
        println!(
            "{name} x real {}",
            0.3 * n as f64 / t0.elapsed().as_secs_f64()
        );
    }
}

fn standing() -> Flow<3> {
    standing_on(Base::Free)
}
fn standing_on(base: Base) -> Flow<3> {
    use twinrig_contact::{Ground, Terrain};
    let robot = robot();
    let servo = twinrig_robot::Servo {
        lag: 5e-3,
        speed: 20.0,
        torque: 5.0,
        dead_band: 0.0,
        inertia: 1e-4,
    };
    let setup = Setup {
        base,
        legs: robot.legs.iter().map(|m| m.name.clone()).collect(),
        ground: Some(Ground::new(Terrain::Flat, 0.6, 0.0).unwrap()),
        step: SimDuration::from_millis(2),
        drives: Drives::Servos {
            hip: servo,
            knee: servo,
        },
        start: Vec::new().into(),
    };
    let options = crate::options::Options {
        setup,
        method: crate::options::Method::Rk4,
        tolerance: f64::INFINITY,
        toe: false,
    };
    crate::body::started::<3>(&robot, &options).unwrap()
}

#[test]
fn scratch_books() {
    for tol in [1e-5, 1e-7, 1e-9] {
        for (name, case) in [
            ("fixed drive", 0),
            ("free drive air", 2),
            ("stand drive", 3),
            ("stand drive slide", 4),
            ("stand knee", 5),
            ("slide lateral", 6),
            ("one leg slides", 7),
        ] {
            let mut flow = standing_on(if case == 0 { Base::Fixed } else { Base::Free });
            flow.tolerance = tol;
            if case == 0 || case == 2 {
                flow.model.ground = None;
            }
            if case == 4 {
                flow.state.velocity = [0.5, 0.0, 0.0];
            }
            if case == 6 {
                flow.state.velocity = [0.5, 0.3, 0.0];
            }
            if case == 7 {
                flow.state.velocity = [0.3, 0.3, 0.0];
                flow.state.turning = [0.0, 0.0, 3.0];
            }
            let s = flow.stored();
            flow.ledger = Ledger::opened(s);
            for i in 0..10 {
                if [0, 2, 3, 4].contains(&case) {
                    flow.mode.commands.hip =
                        flow.mode.commands.hip + Lanes::new([0.001, -0.001, 0.002, 0.003]);
                }
                if [5].contains(&case) {
                    flow.mode.commands.pulley = flow.mode.commands.pulley + Lanes::splat(0.001);
                }
                let r = flow.step(2e-3);
                if i == 9 || r.is_err() {
                    println!(
                        "{name} tol {tol:e} {i} {r:?} ev {} evals {} fallbacks {} {:?} residual {:e} exch {:e}",
                        flow.counts.events,
                        flow.counts.evaluations,
                        flow.counts.fallbacks,
                        flow.mode.contacts.first().map(|c| c.slides),
                        flow.ledger.books().residual,
                        flow.ledger.books().exchanged
                    );
                }
            }
        }
    }
}

#[test]
fn scratch_stand() {
    let mut flow = standing();
    for i in 0..100 {
        let r = flow.step(2e-3);
        println!(
            "{i} z {:.6} w {:?} events {} {:?} {:e}",
            flow.state.position[2],
            flow.state.turning,
            flow.counts.events,
            flow.mode
                .contacts
                .iter()
                .map(|c| (c.leg, c.slides))
                .collect::<Vec<_>>(),
            flow.ledger.books().residual
        );
        if let Err(e) = r {
            println!("{e}");
            break;
        }
    }
}
