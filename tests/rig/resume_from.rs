//! A plant resumes from the state of another: position and motion of the robot are then the same.

use proptest::prelude::*;
use twinrig::Registry;
use twinrig::kernel::{Direction, Layout, SimDuration, SimTime};
use twinrig::runtime::Plant;
use twinrig_legged::{Abduction, Base, Contacts, Drives, SetPoint, Setup, Start};
use twinrig_testing::robots::{LEGS, SERVO, robot};
use twinrig_tests::TrotFixture;

/// Tolerance \[m\]: foot positions are computed by two closed forms, from angles or from stored
/// positions, which differ by rounding only.
const TOLERANCE: f64 = 1e-9;

/// The robot at height `fall` above the ground.
fn setup(fall: f64) -> Setup {
    let terrain = twinrig_contact::Terrain::step_down(-10.0, fall);
    Setup {
        base: Base::Free,
        legs: LEGS.map(str::to_owned).to_vec(),
        ground: Some(twinrig_contact::Ground::new(terrain, 0.6, 0.0).unwrap()),
        step: SimDuration::from_millis(1),
        drives: Drives::Servos {
            hip: SERVO,
            knee: SERVO,
        },
        abduction: Abduction::Locked,
        contacts: Contacts::Feet,
        set_point: SetPoint::Held,
        start: Start::default(),
    }
}

fn lcp(setup: &Setup) -> Box<dyn Plant> {
    let options = twinrig_lcp::Options {
        constraints: twinrig_lcp::Constraints::Rigid,
        setup: setup.clone(),
        method: twinrig_lcp::Method::Rk4,
        tolerance: twinrig_lcp::Options::TOLERANCE,
        features: twinrig_lcp::Features::Detected,
        toe: false,
    };
    Box::new(twinrig_lcp::Lcp::new(&robot(), &options, &|_| true).unwrap())
}

fn massless(setup: &Setup) -> Box<dyn Plant> {
    let options = twinrig_massless::Options::new(setup.clone(), twinrig_massless::Force::Solve);
    Box::new(twinrig_massless::Massless::new(&robot(), &options, &|_| true).unwrap())
}

/// Outputs of a plant that describe motion, not forces.
fn motion_outputs(plant: &mut dyn Plant) -> Vec<(String, Vec<f64>)> {
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

/// Advances to `ms` with drive commands offset by `swing`.
fn advance_to(plant: &mut dyn Plant, swing: [f64; 2], ms: u64) -> Result<(), TestCaseError> {
    let inputs = Layout::of(&plant.ports(), Direction::Input).len();
    let mut commands = vec![0.0; inputs];
    plant.initial_inputs(&mut commands);
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

    /// In flight, at landing and in stance, in both directions and between plants of the same kind.
    #[test]
    fn resumed_plant_has_the_same_motion(
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
        advance_to(&mut *from, swing, ms)?;
        let state = from.state().unwrap();
        prop_assert_eq!(to.resume_from(&state).unwrap(), Vec::<String>::new());
        for ((name, a), (_, b)) in motion_outputs(&mut *from).into_iter().zip(motion_outputs(&mut *to)) {
            // Speeds involve lever arms below a metre, angles arc tangents: the tolerance of
            // positions applies.
            for (a, b) in a.iter().zip(&b) {
                prop_assert!((a - b).abs() < TOLERANCE, "{name}: {a} and {b}");
            }
        }
        let balance = to.energy();
        prop_assert_eq!((balance.residual, balance.exchanged, balance.impact), (0.0, 0.0, 0.0));
        prop_assert!(balance.stored().is_finite());
        // The plant can advance from there.
        let mut inputs = vec![0.0; Layout::of(&to.ports(), Direction::Input).len()];
        to.initial_inputs(&mut inputs);
        let next = state.time + SimDuration::from_millis(2);
        prop_assert!(to.advance(next, &inputs).is_ok());
    }
}

#[test]
fn leg_pose_not_determined_by_the_foot_is_rejected() {
    let setup = setup(0.0);
    let mut plant = massless(&setup);
    let state = plant.state().unwrap();
    let angles = state.get("leg/LH/angles").unwrap();
    // Ankle straight, and bent backwards.
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
fn rig_continues_with_another_plant_from_a_snapshot() {
    let registry = Registry::standard();
    let assembly = TrotFixture::default().assembly(&registry);
    let at = |ms| SimTime::ZERO + SimDuration::from_millis(ms);
    let mut rig = assembly.rig().unwrap();
    rig.run_until(at(300), &mut ()).unwrap();
    let snapshot = rig.save();
    let restored = || {
        let mut rig = assembly.rig().unwrap();
        rig.restore(&snapshot).unwrap();
        rig
    };
    // A plant with a leg less has other ports: it is rejected, and the rig continues unchanged.
    let mut unchanged = restored();
    let fewer = Setup {
        legs: LEGS[..3].iter().map(|leg| (*leg).to_owned()).collect(),
        ..setup(0.0)
    };
    let error = unchanged.replace_plant(lcp(&fewer)).unwrap_err();
    let message = error.to_string();
    assert!(
        message.contains("lcp cannot replace massless: massless has leg/"),
        "{message}"
    );
    assert_eq!(
        (unchanged.save() == snapshot, unchanged.exchanged()),
        (true, None)
    );
    rig.run_until(at(400), &mut ()).unwrap();
    unchanged.run_until(at(400), &mut ()).unwrap();
    assert_eq!(rig.save(), unchanged.save());
    // With the same ports the exchange succeeds; snapshots of the two rigs are incompatible.
    let mut exchanged = restored();
    let lost = exchanged.replace_plant(lcp(&setup(0.0))).unwrap();
    assert_eq!(lost, Vec::<String>::new());
    assert_eq!(exchanged.exchanged(), Some(exchanged.now()));
    exchanged.run_until(at(400), &mut ()).unwrap();
    assert_eq!(exchanged.plant().name(), "lcp");
    let state = exchanged.plant().state().unwrap();
    let height = state.get("body/position").unwrap()[2];
    let before = rig.plant().state().unwrap();
    // A tenth of a second later both walk at the same height, to a centimetre.
    assert!(
        (height - before.get("body/position").unwrap()[2]).abs() < 0.01,
        "{height}"
    );
    assert!(rig.restore(&exchanged.save()).is_err());
}
