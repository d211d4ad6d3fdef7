mod abduction;

use proptest::prelude::*;
use twinrig_compliant::lanes::{Features, Kernel, Lanes, Quad, Simd, dispatch};
use twinrig_compliant::{DriveLaws, Element, Equations as _, Fastest, FlowError, StepError};
use twinrig_contact::Ground;
use twinrig_legged::{Base, Drives, Dynamics as _, Readings as _};
use twinrig_robot::{Compliance, OneSided, Robot};

use super::equations::{CompliantFlow, compliant_state};
use super::model::{CompliantEquations, CompliantModel};
use crate::constraints::motion::Dynamics;
use crate::fixtures::{self, HARD, Pose, flow, robot, tumbling};
use crate::plant::flow::Flow;

pub(crate) fn compliance() -> Compliance {
    let side = |stiffness, damping, toe_region| OneSided {
        stiffness,
        damping,
        toe_region,
    };
    Compliance {
        stops: side(100e3, 20.0, 0.3e-3),
        cable: side(50e3, 20.0, 0.3e-3),
        sole: side(20e3, 30.0, 0.5e-3),
        slip_deflection: 0.2e-3,
    }
}

/// Builds the compliant plant in the state of a rigid one, its servos at rest there.
fn compliant<const N: usize, const P: usize>(
    rigid: &Flow<N>,
    compliance: Compliance,
    tolerance: f64,
    features: Features,
) -> CompliantFlow<N, P, 0, 0> {
    let compliances = vec![compliance; rigid.model.legs.len()];
    let model = CompliantModel::new(rigid.model.clone(), &compliances, [], &[]);
    let state = compliant_state(&rigid.run.state);
    CompliantFlow::new(CompliantEquations::new(model), state, tolerance, features)
}

fn start<const N: usize>(
    base: Base,
    pose: Pose,
    drives: Drives,
    ground: Option<Ground>,
) -> Flow<N> {
    flow::<N>(&robot(), base, pose, drives, ground)
}

/// Slope of the rigid model without constraints, in the form of the compliant one.
fn rigid_slope<const N: usize>(flow: &Flow<N>) -> Vec<f64> {
    let dynamics = Dynamics::new(&flow.model, &flow.model.side_by_side, &flow.run.mode, 0.0);
    let (slope, _) = dynamics.slope_without_contacts(&flow.run.state);
    let mut numbers = Vec::new();
    numbers.extend(slope.position);
    numbers.extend(slope.attitude);
    numbers.extend(slope.velocity);
    numbers.extend(slope.turning);
    for lanes in slope.rates {
        numbers.extend(lanes.to_array());
    }
    numbers.extend(slope.dissipated.to_array());
    numbers
}

fn compliant_slope<const N: usize, const P: usize>(
    flow: &mut CompliantFlow<N, P, 0, 0>,
) -> Vec<f64> {
    flow.update_slope();
    let slope = flow.slope.unwrap();
    let mut numbers = Vec::new();
    numbers.extend(&slope.state.position.0[..3]);
    numbers.extend(slope.state.attitude.0);
    numbers.extend(&slope.state.velocity.0[..3]);
    numbers.extend(&slope.state.turning.0[..3]);
    for lanes in slope.state.rates {
        numbers.extend(lanes.0);
    }
    numbers.extend(slope.flows.dissipated.0);
    numbers
}

fn equal_without_constraints<const N: usize, const P: usize>(base: Base, spin: [f64; 3]) {
    let pose = ([20.0, -40.0, 55.0], [-3.0, 5.0, 8.0]);
    let mut rigid = start::<N>(base, pose, Drives::None, None);
    if base == Base::Free {
        tumbling(&mut rigid);
        rigid.run.state.turning = spin;
    }
    let mut flow = compliant::<N, P>(
        &rigid,
        compliance().scaled(0.0, 0.0),
        1e-6,
        Features::Detected,
    );
    let expected = rigid_slope(&rigid);
    let found = compliant_slope(&mut flow);
    for (i, (a, b)) in expected.iter().zip(&found).enumerate() {
        assert!((a - b).abs() < 1e-9 * (1.0 + a.abs()), "{i}: {a} {b}");
    }
    let (a, b) = (rigid.stored(), flow.stored());
    for (a, b) in a.iter().zip(b) {
        assert!((a - b).abs() < 1e-12 * (1.0 + a.abs()), "{a} {b}");
    }
}

fn equal_feet<const N: usize, const P: usize>() {
    let pose = ([20.0, -40.0, 55.0], [-3.0, 5.0, 8.0]);
    let mut rigid = start::<N>(Base::Free, pose, Drives::None, Some(fixtures::flat()));
    tumbling(&mut rigid);
    // Beyond a quarter of a turn, too.
    for angle in &mut rigid.run.state.angles {
        *angle += crate::model::real::Lanes::new([0.0, 0.7, -1.4, 2.1]);
    }
    let flow = compliant::<N, P>(&rigid, compliance(), 1e-6, Features::Detected);
    let (expected, feet) = (rigid.feet(), flow.feet());
    let surfaces = [rigid.surfaces(&expected), flow.surfaces(&feet)];
    for leg in 0..expected.len() {
        let (a, b) = (expected[leg], feet[leg]);
        assert!((a.position - b.position).norm() < 1e-14, "{a:?} {b:?}");
        assert!((a.velocity - b.velocity).norm() < 1e-13, "{a:?} {b:?}");
        let [a, b] = surfaces.each_ref().map(|of| of[leg].gap);
        assert!((a - b).abs() < 1e-14, "{a} {b}");
    }
}

#[test]
fn feet_and_the_ground_below_are_those_of_the_rigid_model() {
    equal_feet::<3, 1>();
    equal_feet::<4, 2>();
}

#[test]
fn slope_without_constraints_is_that_of_the_rigid_model() {
    for spin in [[3.0, -2.0, 5.0], [0.0, 4.0, 0.0], [-1.0, 0.3, 0.0]] {
        equal_without_constraints::<3, 1>(Base::Free, spin);
        equal_without_constraints::<4, 2>(Base::Free, spin);
    }
    equal_without_constraints::<3, 1>(Base::Fixed, [0.0; 3]);
    equal_without_constraints::<3, 1>(Base::Planar, [0.0; 3]);
}

/// A hard start on a free trunk with servos, on the ground.
fn landing<const N: usize, const P: usize>(
    tolerance: f64,
    features: Features,
) -> CompliantFlow<N, P, 0, 0> {
    let robot: Robot = robot();
    let drives = fixtures::servo_drives(&robot);
    let mut rigid = start::<N>(Base::Free, HARD, drives, Some(fixtures::flat()));
    rigid.run.state.position[2] = 0.13;
    rigid.run.state.velocity = [0.4, 0.1, -0.3];
    rigid.run.state.turning = [0.5, -0.3, 0.2];
    compliant::<N, P>(&rigid, compliance(), tolerance, features)
}

#[test]
fn fastest_leg_is_sought_in_the_members_after_the_trunk() {
    let state = landing::<3, 1>(1e-6, Features::Detected).state;
    let mut members = Vec::new();
    state.map(|quad| members.push(quad));
    assert_eq!(members[..4], state.trunk());
    // A leg whose rate changes fast is found beside a faster trunk.
    let mut next = state;
    next.velocity.0[0] += 1e-3;
    next.rates[1].0[2] += 1e-6;
    let difference = |a: &[Quad]| {
        let mut of_next = Vec::new();
        next.map(|quad| of_next.push(quad));
        let pairs = of_next.iter().zip(a);
        let less = |(b, a): (&Quad, &Quad)| Quad(std::array::from_fn(|i| b.0[i] - a.0[i]));
        pairs.map(less).collect::<Vec<_>>()
    };
    let states = difference(&members);
    let fastest = Fastest::new(&states, &states);
    assert_eq!(fastest.leg, 2);
}

#[test]
fn bits_do_not_depend_on_the_processor() {
    let run = |features| {
        let mut flow = landing::<3, 1>(1e-6, features);
        for _ in 0..100 {
            flow.step(2e-3).unwrap();
        }
        (flow.state, flow.sums, flow.control)
    };
    assert_eq!(run(Features::Detected), run(Features::Portable));
}

#[test]
fn energy_balance_closes_with_the_tolerance() {
    let residual = |tolerance| {
        let mut flow = landing::<3, 1>(tolerance, Features::Detected);
        for _ in 0..150 {
            flow.step(2e-3).unwrap();
        }
        let balance = flow.ledger.balance();
        eprintln!("{tolerance:e} {balance:?} {:?}", flow.control);
        (balance.residual / balance.exchanged).abs()
    };
    assert!(residual(1e-6) < 1e-4);
    assert!(residual(1e-9) < 1e-7);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]
    #[test]
    fn toe_and_planar_bases_keep_the_energy_balance(pitch in -0.3..0.3_f64) {
        let mut flow = landing::<4, 2>(1e-9, Features::Detected);
        flow.equations.model.base = Base::Planar;
        flow.state.attitude = Quad([libm::cos(pitch / 2.0), 0.0, libm::sin(pitch / 2.0), 0.0]);
        flow.state.position.0[2] = 0.16;
        flow.state.velocity.0[1] = 0.0;
        flow.state.turning = Quad([0.0, 0.5, 0.0, 0.0]);
        flow.ledger = twinrig_legged::Ledger::opened(flow.stored());
        for _ in 0..50 {
            flow.step(2e-3).unwrap();
        }
        let balance = flow.ledger.balance();
        prop_assert!(balance.residual.abs() < 1e-6 * balance.exchanged, "{balance:?}");
    }
}

#[test]
fn restored_run_is_bit_identical() {
    let mut flow = landing::<4, 2>(1e-6, Features::Detected);
    for _ in 0..20 {
        flow.step(2e-3).unwrap();
    }
    let saved = flow.save();
    let mut other = landing::<4, 2>(1e-3, Features::Portable);
    other.restore(saved).unwrap();
    for _ in 0..20 {
        flow.step(1.7e-3).unwrap();
        other.step(1.7e-3).unwrap();
    }
    assert_eq!((flow.state, flow.sums), (other.state, other.sums));
    assert_eq!((flow.control, flow.ledger), (other.control, other.ledger));
    assert!(
        landing::<3, 1>(1e-6, Features::Detected)
            .restore(flow.save())
            .is_err()
    );
}

#[test]
fn step_beyond_the_limit_of_stability_is_refused() {
    // Soles a thousand million times as stiff: 2 ms are far too long, and the control says so.
    let stiff = |tolerance| {
        let mut flow = landing::<3, 1>(tolerance, Features::Detected);
        flow.equations.model.legs.sole.element = Element::side_by_side(
            [OneSided {
                stiffness: 2e13,
                damping: 3e5,
                toe_region: 1e-8,
            }; 4],
        );
        (0..150).try_for_each(|_| flow.step(2e-3))
    };
    let unstable = stiff(f64::INFINITY).unwrap_err();
    assert!(
        matches!(unstable, FlowError::Energy { .. })
            || matches!(unstable, FlowError::Step(StepError::Diverged { .. })),
        "{unstable}"
    );
    let refused = stiff(1e-9).unwrap_err();
    // The bristle gives way at up to 5e7/s while a sole of 10 nm is pressed: within the least
    // substep, at a kink of that rate, it moves by more than the tolerance. All three refusals name
    // the rate.
    let FlowError::Step(
        StepError::TooStiff { fastest, .. }
        | StepError::TooPrecise { fastest, .. }
        | StepError::Abrupt { fastest, .. },
    ) = refused
    else {
        panic!("{refused}");
    };
    assert!(fastest.rate > 1e5, "{refused}");
}

/// Compressed elements of the slope and those by their depths, of each leg.
fn compressed<const N: usize, const P: usize>(flow: &CompliantFlow<N, P, 0, 0>) -> [[f64; 4]; 2] {
    let mut flow = CompliantFlow::new(flow.equations.clone(), flow.state, 1e-6, Features::Detected);
    flow.update_slope();
    let motion = flow.equations.elements(Features::Detected, &flow.state);
    let mut sums = [0.0; 4];
    for (element, depths) in (0_u32..).zip(motion.depths) {
        let weight = f64::from(1 << element);
        for (sum, depth) in sums.iter_mut().zip(depths.0) {
            *sum += if depth > 0.0 { weight } else { 0.0 };
        }
    }
    [flow.slope.unwrap().compressed.0, sums]
}

/// Depths \[m\], and their derivatives by differences and as computed \[m/s\].
fn element_rates<const N: usize, const P: usize>(
    flow: &mut CompliantFlow<N, P, 0, 0>,
) -> Vec<[f64; 3]> {
    let before = flow.equations.elements(Features::Detected, &flow.state);
    flow.control = twinrig_compliant::StepControl::new(f64::INFINITY);
    let step = 1e-7;
    flow.step(step).unwrap();
    let after = flow.equations.elements(Features::Detected, &flow.state);
    let mut all = Vec::new();
    for i in 0..before.depths.len() {
        for leg in 0..4 {
            let [a, b] = [&before, &after].map(|motion| motion.depths[i].0[leg]);
            let [u, v] = [&before, &after].map(|motion| motion.rates[i].0[leg]);
            all.push([a, (b - a) / step, 0.5 * (u + v)]);
        }
    }
    all
}

#[test]
fn compressed_elements_have_positive_depths_with_the_given_rates() {
    let (mut seen, mut flow) = ([false; 256], landing::<4, 2>(1e-6, Features::Detected));
    for _ in 0..150 {
        flow.step(2e-3).unwrap();
        // One leg straight, one folded: both ends of the diagonal. A third with its rod in line.
        let mut bent = flow.clone();
        let first = bent.state.angles[0];
        bent.state.angles[1].0[..2].copy_from_slice(&[first.0[0], first.0[1] - 2.5]);
        bent.state.angles[2].0[2] = bent.state.angles[1].0[2] + 0.2;
        let [slope, depths] = compressed(&bent);
        assert_eq!(slope, depths);
        assert_eq!((slope[0] % 4.0, slope[1] % 4.0), (1.0, 2.0));
        assert!(slope[2] % 32.0 >= 16.0, "{slope:?}");
        let [slope, depths] = compressed(&flow);
        assert_eq!(slope, depths);
        for (number, seen) in (0_u32..).zip(&mut seen) {
            *seen |= slope.contains(&f64::from(number));
        }
        for [depth, change, rate] in element_rates(&mut flow.clone()) {
            assert!(
                depth.is_infinite() || (change - rate).abs() < 1e-5 * (1.0 + rate.abs()),
                "{depth} {change} {rate}"
            );
        }
    }
    for element in [3, 5, 6, 7] {
        let compressed = (0..256).filter(|number| number >> element & 1 == 1);
        assert!(
            compressed.into_iter().any(|number| seen[number]),
            "{element}"
        );
    }
}

/// Accelerations of the hips \[rad/s²\], commanded and found, torque of the drives, and its least
/// and greatest value \[N·m\].
fn hips<const N: usize, const P: usize>(flow: &mut CompliantFlow<N, P, 0, 0>) -> [[f64; 4]; 5] {
    struct Law<'a>(&'a twinrig_compliant::ServoLaw, [Quad; 2]);
    impl Kernel for Law<'_> {
        type Output = [Quad; 3];

        #[inline(always)]
        fn run<S: Simd>(self, simd: S) -> [Quad; 3] {
            let [angle, rate] = self.1.map(|quad| simd.load(quad));
            // The servos of a new plant are commanded to stay.
            let wanted = self.0.acceleration(angle, angle, rate);
            let limit = |torque| self.0.limited(simd.splat(torque), rate);
            [wanted, limit(-1e9), limit(1e9)].map(Lanes::quad)
        }
    }
    flow.update_slope();
    let (slope, state) = (flow.slope.unwrap(), flow.state);
    let DriveLaws::Servos { hip, .. } = &flow.equations.model.drives else {
        panic!("servos");
    };
    let law = Law(hip, [state.angles[0], state.rates[0]]);
    let [wanted, least, most] = dispatch(Features::Detected, law);
    let found = slope.state.rates[0].0;
    let torque = std::array::from_fn(|leg| slope.flows.hip.0[leg] + hip.inertia() * found[leg]);
    [wanted.0, found, torque, least.0, most.0]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    #[test]
    fn hips_follow_their_command_or_are_at_the_limit_of_their_torque(
        rates in proptest::array::uniform4(-12.0..12.0_f64), height in 0.11..0.15_f64,
    ) {
        let mut rigid = start::<3>(
            Base::Free,
            HARD,
            fixtures::servo_drives(&robot()),
            Some(fixtures::flat()),
        );
        rigid.run.state.position[2] = height;
        let mut flow = compliant::<3, 1>(&rigid, compliance(), 1e-6, Features::Detected);
        flow.state.rates[0] = Quad(rates);
        let mut flow = CompliantFlow::new(flow.equations, flow.state, 1e-6, Features::Detected);
        let [wanted, found, torque, least, most] = hips(&mut flow);
        for leg in 0..4 {
            let (torque, limits) = (torque[leg], [least[leg], most[leg]]);
            let within = torque.clamp(limits[0], limits[1]);
            prop_assert!((torque - within).abs() < 1e-9, "{leg}: {torque} {limits:?}");
            let lag = wanted[leg] - found[leg];
            if lag.abs() > 1e-6 * (1.0 + wanted[leg].abs()) {
                let limit = if lag > 0.0 { limits[1] } else { limits[0] };
                prop_assert!((torque - limit).abs() < 1e-9, "{leg}: {lag} {torque} {limits:?}");
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn dissipation_never_decreases_in_drops(
        drop in 0.12..0.25_f64,
        velocity in proptest::array::uniform3(-1.0..1.0_f64),
        turning in proptest::array::uniform3(-3.0..3.0_f64),
    ) {
        let mut flow = landing::<4, 2>(1e-6, Features::Detected);
        flow.state.position.0[2] = drop;
        flow.state.velocity = Quad::of_three(velocity);
        flow.state.turning = Quad::of_three(turning);
        flow.ledger = twinrig_legged::Ledger::opened(flow.stored());
        for _ in 0..100 {
            let before = flow.sums.dissipated.0;
            flow.step(2e-3).unwrap();
            let after = flow.sums.dissipated.0;
            // Exact: sums of powers, none negative, with positive weights.
            prop_assert!(before.iter().zip(after).all(|(a, b)| b >= *a), "{before:?} {after:?}");
        }
    }
}
