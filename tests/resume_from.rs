//! One plant goes on from where another is: the robot is then in the same place, moving in the same way.

use proptest::prelude::*;
use twinrig::Registry;
use twinrig::kernel::{Direction, Layout, SimDuration, SimTime};
use twinrig::runtime::Plant;
use twinrig_legged::{Base, Drives, Setup, Start};
use twinrig_robot::{Robot, RobotFile, Servo};
use twinrig_tests::Scene;

const SERVO: Servo = Servo {
    torque: 4.0,
    speed: 25.0,
    lag: 5e-3,
    dead_band: 0.0,
    inertia: 1e-3,
};

const LEGS: [&str; 4] = ["LF", "RF", "LH", "RH"];

/// Feet are found by two closed forms, from angles or from where they are kept; rounding alone tells them apart \[m\].
const SAME: f64 = 1e-9;

fn robot() -> Robot {
    let text = include_str!("../robots/cheetah-cub.toml");
    RobotFile::parse("cheetah-cub.toml", text)
        .unwrap()
        .robot()
        .unwrap()
}

/// The robot so high above the ground, or on it.
fn setup(fall: f64) -> Setup {
    let terrain = twinrig_contact::Terrain::StepDown {
        at: -10.0,
        drop: fall,
    };
    Setup {
        base: Base::Free,
        legs: LEGS.map(str::to_owned).to_vec(),
        ground: Some(twinrig_contact::Ground::new(terrain, 0.6, 0.0).unwrap()),
        step: SimDuration::from_millis(1),
        drives: Drives::Servos {
            hip: SERVO,
            knee: SERVO,
        },
        start: Start::default(),
    }
}

fn lcp(setup: &Setup) -> Box<dyn Plant> {
    let options = twinrig_lcp::Options {
        setup: setup.clone(),
        method: twinrig_lcp::Method::Rk4,
        tolerance: twinrig_lcp::Options::TOLERANCE,
        toe: false,
    };
    Box::new(twinrig_lcp::Lcp::new(&robot(), &options, &|_| true).unwrap())
}

fn massless(setup: &Setup) -> Box<dyn Plant> {
    let options = twinrig_massless::Options {
        setup: setup.clone(),
        force: twinrig_massless::Force::Solve,
    };
    Box::new(twinrig_massless::Massless::new(&robot(), &options, &|_| true).unwrap())
}

/// What a plant shows that is of its motion and not of its forces.
fn seen(plant: &mut dyn Plant) -> Vec<(String, Vec<f64>)> {
    let layout = Layout::of(&plant.ports(), Direction::Output);
    let mut outputs = vec![0.0; layout.len()];
    plant.observe(&mut outputs);
    let of_motion = [
        "/position",
        "/velocity",
        "/orientation",
        "/angles",
        "/angular_velocity",
        "/rate",
    ];
    let fields = layout
        .fields()
        .filter(|field| of_motion.iter().any(|end| field.port.name.ends_with(end)));
    fields
        .map(|field| (field.port.name.clone(), outputs[field.range()].to_vec()))
        .collect()
}

/// Holds the drives at commands that are off by `swing` and moves on to `ms`.
fn moved(plant: &mut dyn Plant, swing: [f64; 2], ms: u64) -> Result<(), TestCaseError> {
    let inputs = Layout::of(&plant.ports(), Direction::Input).len();
    let mut commands = vec![0.0; inputs];
    plant.first_inputs(&mut commands);
    for pair in commands.chunks_mut(2) {
        (pair[0], pair[1]) = (pair[0] + swing[0], pair[1] + swing[1]);
    }
    let to = SimTime::ZERO + SimDuration::from_millis(ms);
    plant
        .advance(to, &commands)
        .map_err(|fault| TestCaseError::reject(fault.to_string()))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// In flight, landing and in stance, either way round and through either's own words.
    #[test]
    fn the_robot_is_where_it_was_in_another_plant(
        fall in prop_oneof![Just(0.0), 0.0..0.3_f64],
        swing in [-0.2..0.2_f64, 0.0..0.2],
        ms in 1..250_u64,
        pair in 0..4_usize,
    ) {
        let setup = setup(fall);
        let [mut from, mut to] = match pair {
            0 => [lcp(&setup), massless(&setup)],
            1 => [massless(&setup), lcp(&setup)],
            2 => [massless(&setup), massless(&setup)],
            _ => [lcp(&setup), lcp(&setup)],
        };
        moved(&mut *from, swing, ms)?;
        let state = from.state().unwrap();
        prop_assert_eq!(to.resume_from(&state).unwrap(), Vec::<String>::new());
        for ((name, a), (_, b)) in seen(&mut *from).into_iter().zip(seen(&mut *to)) {
            // Speeds come by way of lever arms below a metre, angles by arc tangents: as near as places.
            for (a, b) in a.iter().zip(&b) {
                prop_assert!((a - b).abs() < SAME, "{name}: {a} and {b}");
            }
        }
        let balance = to.energy();
        prop_assert_eq!((balance.residual, balance.exchanged, balance.impact), (0.0, 0.0, 0.0));
        prop_assert!(balance.stored().is_finite());
        // It can go on from there, for as long as nothing is out of the ordinary.
        let mut inputs = vec![0.0; Layout::of(&to.ports(), Direction::Input).len()];
        to.first_inputs(&mut inputs);
        let next = state.time + SimDuration::from_millis(2);
        prop_assert!(to.advance(next, &inputs).is_ok());
    }
}

#[test]
fn a_leg_that_no_foot_tells_the_pose_of_is_refused_with_the_reason() {
    let setup = setup(0.0);
    let mut plant = massless(&setup);
    let state = plant.state().unwrap();
    let angles = state.get("leg/LH/angles").unwrap();
    // The ankle straight, and bent back.
    for third in [angles[1], angles[1] - 0.3] {
        let before = plant.save();
        let bent = state
            .clone()
            .with("leg/LH/angles", &[angles[0], angles[1], third]);
        let fault = plant.resume_from(&bent).unwrap_err();
        assert_eq!(fault.part, "leg/LH");
        assert!(fault.why.contains("folded up"), "{fault}");
        assert_eq!(plant.save(), before);
    }
}

#[test]
fn a_rig_goes_on_with_another_plant_from_one_snapshot() {
    let registry = Registry::standard();
    let assembly = Scene::default().assembly(&registry);
    let at = |ms| SimTime::ZERO + SimDuration::from_millis(ms);
    let mut rig = assembly.rig().unwrap();
    rig.run_until(at(300), &mut ()).unwrap();
    let saved = rig.save();
    let restored = || {
        let mut rig = assembly.rig().unwrap();
        rig.restore(&saved).unwrap();
        rig
    };
    // With a leg less it has other ports: refused, and all goes on as if nobody had tried.
    let mut tried = restored();
    let fewer = Setup {
        legs: LEGS[..3].iter().map(|leg| (*leg).to_owned()).collect(),
        ..setup(0.0)
    };
    let error = tried.exchange_plant(lcp(&fewer)).unwrap_err();
    let told = error.to_string();
    assert!(
        told.contains("lcp cannot take the place of massless: where that has leg/"),
        "{told}"
    );
    assert_eq!((tried.save() == saved, tried.exchanged()), (true, None));
    rig.run_until(at(400), &mut ()).unwrap();
    tried.run_until(at(400), &mut ()).unwrap();
    assert_eq!(rig.save(), tried.save());
    // With the same ports it goes on, and is a rig of another make.
    let mut exchanged = restored();
    let lost = exchanged.exchange_plant(lcp(&setup(0.0))).unwrap();
    assert_eq!(lost, Vec::<String>::new());
    assert_eq!(exchanged.exchanged(), Some(exchanged.now()));
    exchanged.run_until(at(400), &mut ()).unwrap();
    assert_eq!(exchanged.plant().name(), "lcp");
    let state = exchanged.plant().state().unwrap();
    let height = state.get("body/position").unwrap()[2];
    let before = rig.plant().state().unwrap();
    // A tenth of a second later the two still walk at the same height, to a centimetre.
    assert!(
        (height - before.get("body/position").unwrap()[2]).abs() < 0.01,
        "{height}"
    );
    assert!(rig.restore(&exchanged.save()).is_err());
}
