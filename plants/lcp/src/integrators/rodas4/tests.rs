use twinrig_legged::{Base, Drives};

use super::linear_system::{TRUNK, directions, number, positions, trunk_direction, velocities};
use super::*;
use crate::constraints::contacts::Contact;
use crate::constraints::motion::Motion;
use crate::constraints::workspace::Workspace;
use crate::fixtures::{self, PASSIVE, distance, flow, motion, robot};
use crate::integrators::jacobian::Direction;
use crate::plant::flow::Flow;

type Matrix = [[f64; STAGES]; STAGES];

/// Returns αᵢⱼ, βᵢⱼ = αᵢⱼ + γᵢⱼ and the weights of both methods, from the coefficients in U: with C
/// = I/γ − Γ⁻¹ these are A Γ, A Γ + Γ and m Γ.
fn classical() -> (Matrix, Matrix, [[f64; STAGES]; 2]) {
    let mut gammas = [[0.0; STAGES]; STAGES];
    // Γ⁻¹ = I/γ − C is triangular.
    #[expect(clippy::needless_range_loop, reason = "as in formulas")]
    for column in 0..STAGES {
        for row in column..STAGES {
            let mut sum = if row == column { 1.0 } else { 0.0 };
            for k in column..row {
                sum += C[row - 1][k] * gammas[k][column];
            }
            gammas[row][column] = GAMMA * sum;
        }
    }
    let times = |weights: &[f64]| -> [f64; STAGES] {
        std::array::from_fn(|j| weights.iter().zip(&gammas).map(|(w, row)| w * row[j]).sum())
    };
    let mut alphas = [[0.0; STAGES]; STAGES];
    for i in 1..STAGES {
        alphas[i] = times(&A[i - 1]);
    }
    let betas = std::array::from_fn(|i| std::array::from_fn(|j| alphas[i][j] + gammas[i][j]));
    let [mut full, mut embedded] = [[0.0; STAGES]; 2];
    full[..5].copy_from_slice(&A[4]);
    embedded[..5].copy_from_slice(&A[4]);
    full[5] = 1.0;
    (alphas, betas, [times(&full), times(&embedded)])
}

#[test]
fn coefficients_satisfy_order_conditions_four_and_three() {
    let (alphas, betas, [full, embedded]) = classical();
    let sums = |m: &Matrix| m.map(|row| row.iter().sum::<f64>());
    let of = |m: &Matrix, v: [f64; STAGES]| -> [f64; STAGES] {
        m.map(|row| row.iter().zip(v).map(|(m, v)| m * v).sum())
    };
    let (alpha, beta) = (sums(&alphas), sums(&betas));
    let product = |a: [f64; STAGES], b: [f64; STAGES]| std::array::from_fn(|i| a[i] * b[i]);
    let squares = product(alpha, alpha);
    // Each tree with the inverse of its weighted sum.
    let third: [([f64; STAGES], f64); 4] = [
        ([1.0; STAGES], 1.0),
        (beta, 2.0),
        (squares, 3.0),
        (of(&betas, beta), 6.0),
    ];
    let fourth = [
        (product(squares, alpha), 4.0),
        (product(alpha, of(&alphas, beta)), 8.0),
        (of(&betas, squares), 12.0),
        (of(&betas, of(&betas, beta)), 24.0),
    ];
    let sum = |weights: &[f64; STAGES], tree: &[f64; STAGES]| -> f64 {
        weights.iter().zip(tree).map(|(w, t)| w * t).sum()
    };
    for (tree, density) in third.iter().chain(&fourth) {
        assert!(
            (sum(&full, tree) - 1.0 / density).abs() < 1e-13,
            "1/{density}"
        );
    }
    for (tree, density) in &third {
        assert!(
            (sum(&embedded, tree) - 1.0 / density).abs() < 1e-13,
            "1/{density}"
        );
    }
    let misses = fourth
        .iter()
        .map(|(tree, density)| sum(&embedded, tree) - 1.0 / density);
    assert!(misses.map(f64::abs).fold(0.0, f64::max) > 1e-3);
}

#[test]
fn method_is_stiffly_accurate_and_l_stable() {
    let (_, betas, [full, _]) = classical();
    for (weight, beta) in full.iter().zip(&betas[STAGES - 1]) {
        assert!((weight - beta).abs() < 1e-13);
    }
    // R(z) = 1 + z bᵀ (I − z β)⁻¹ 1, stage by stage, in complex numbers.
    let times = |a: [f64; 2], b: [f64; 2]| [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]];
    let growth = |z: [f64; 2]| {
        let mut stages = [[0.0; 2]; STAGES];
        let pivot = [1.0 - GAMMA * z[0], -GAMMA * z[1]];
        let size = pivot[0] * pivot[0] + pivot[1] * pivot[1];
        let inverse = [pivot[0] / size, -pivot[1] / size];
        let weighted = |weights: &[f64; STAGES], stages: &[[f64; 2]; STAGES]| {
            let mut sum = [0.0; 2];
            for (w, s) in weights.iter().zip(stages) {
                sum = [sum[0] + w * s[0], sum[1] + w * s[1]];
            }
            times(z, sum)
        };
        for i in 0..STAGES {
            let sum = weighted(&betas[i], &stages);
            stages[i] = times(inverse, [1.0 + sum[0], sum[1]]);
        }
        let sum = weighted(&full, &stages);
        libm::hypot(1.0 + sum[0], sum[1])
    };
    for k in -40..=60 {
        let y = libm::exp10(f64::from(k) / 10.0);
        assert!(growth([0.0, y]) <= 1.0 + 1e-12, "at {y} i");
        assert!(growth([-y, 0.0]) < 1.0, "at −{y}");
    }
    assert!(growth([-1e8, 0.0]) < 1e-6 && growth([0.0, 1e8]) < 1e-6);
}

/// Computes one step of the classical Runge–Kutta method.
fn runge_kutta<const N: usize>(
    flow: &mut Flow<N>,
    state: &State<Lanes, N>,
    h: f64,
) -> State<Lanes, N> {
    let free = flow.model.is_free();
    let mut sum = Slope::zero();
    let mut slope = motion(flow, state, 0.0).slope;
    for (weight, share) in [(1.0, 0.5), (2.0, 0.5), (2.0, 1.0)] {
        sum.add(weight / 6.0, &slope, free);
        slope = motion(
            flow,
            &state.along(Lanes::splat(share * h), &slope, free),
            0.0,
        )
        .slope;
    }
    sum.add(1.0 / 6.0, &slope, free);
    normalised(&state.along(Lanes::splat(h), &sum, free), free)
}

/// Computes one step.
fn step_from<const N: usize>(
    flow: &mut Flow<N>,
    start: &State<Lanes, N>,
    motion: &Motion<Lanes, N>,
    h: Lanes,
    recovery: f64,
) -> RodasStep<N> {
    let substep = Substep {
        start,
        motion,
        h,
        elapsed: Lanes::zero(),
        recovery,
    };
    Rodas4::default().step(&flow.model, &mut flow.run, &substep)
}

/// Advances by `steps` steps; returns the work of friction and motors.
fn steps<const N: usize>(flow: &mut Flow<N>, h: f64, steps: u32) -> [f64; 2] {
    let mut work = [0.0; 2];
    for _ in 0..steps {
        let state = flow.run.state;
        let start = motion(flow, &state, 0.0);
        let step = step_from(flow, &state, &start, Lanes::splat(h), 0.0);
        assert!(step.error.to_array().iter().all(|e| e.is_finite()));
        flow.run.state = step.end;
        work[0] += step.dissipated.sum();
        work[1] += step.actuator.sum();
    }
    work
}

/// Start pose of a leg away from all stops.
const OPEN: fixtures::Pose = ([15.0, -20.0, 28.0], [2.0, -3.0, 4.0]);

/// Returns named robots that fall freely or hang, with and without motors, toes, and constraints.
fn assorted<const N: usize>() -> Vec<(&'static str, Flow<N>)> {
    let mut robot = robot();
    if N < 4 {
        for mount in &mut robot.legs {
            mount.leg.toe = None;
        }
    }
    let servos = fixtures::servo_drives(&robot);
    let mut tumbling = flow::<N>(&robot, Base::Free, OPEN, Drives::None, None);
    fixtures::tumbling(&mut tumbling);
    let mut fixed = flow::<N>(&robot, Base::Fixed, OPEN, servos.clone(), None);
    fixed.run.state.pulley_rate = Lanes::new([1.0, 2.0, 0.5, 3.0]);
    // Outside the dead band, below the maximum speed.
    fixed.run.mode.commands.hip += Lanes::splat(0.1);
    fixed.run.mode.commands.pulley += Lanes::splat(0.1);
    fixed.run.mode.active.closed = Lanes::new([1.0, 0.0, 0.0, 1.0]);
    fixed.run.mode.active.cable = Lanes::new([1.0, 1.0, 0.0, 0.0]);
    fixed.run.mode.update_any();
    let mut standing = flow::<N>(&robot, Base::Free, OPEN, servos, Some(fixtures::flat()));
    fixtures::tumbling(&mut standing);
    standing.run.state.attitude = [0.995_037_438, 0.07, -0.05, 0.05];
    standing.run.state = normalised(&standing.run.state, true);
    standing.run.mode.active.open = Lanes::new([0.0, 1.0, 0.0, 1.0]);
    standing.run.mode.active.cable = Lanes::new([1.0, 0.0, 0.0, 1.0]);
    standing.run.mode.update_any();
    for (leg, slides) in [(0, None), (1, Some([1.0, 0.0])), (3, None)] {
        let links = 3;
        standing
            .run
            .mode
            .contacts
            .push(Contact { leg, links, slides });
    }
    vec![
        (
            "hanging",
            flow(&robot, Base::Fixed, OPEN, Drives::None, None),
        ),
        ("fixed", fixed),
        ("tumbling", tumbling),
        ("standing", standing),
    ]
}

/// Returns the right-hand side as a list in a fixed order.
fn listed<const N: usize>(slope: &Slope<Lanes, N>) -> Vec<f64> {
    let mut all = [
        &slope.position[..],
        &slope.attitude,
        &slope.velocity,
        &slope.turning,
    ]
    .concat();
    let powers = [
        slope.pulley,
        slope.pulley_rate,
        slope.dissipated,
        slope.actuator,
    ];
    for lanes in slope.angles.iter().chain(&slope.rates).chain(&powers) {
        all.extend(lanes.to_array());
    }
    all
}

fn jacobian_matches_differences<const N: usize>() {
    const RECOVERY: f64 = 20.0;
    for (name, mut flow) in assorted::<N>() {
        let state = flow.run.state;
        let free = flow.model.is_free();
        let mut workspace = Workspace::default();
        let trunk = (0..TRUNK).map(|i| (trunk_direction(i), Lanes::splat(1.0)));
        let leg = (0..flow.model.coordinates())
            .flat_map(directions::<N>)
            .flat_map(|to| (0..4).map(move |lane| (to, Lanes::zero().with_lane(lane, 1.0))));
        let trunk: Vec<_> = trunk.filter(|_| free).collect();
        for (to, seed) in trunk.into_iter().chain(leg) {
            let mut jacobian = Jacobian::new(&flow.model, &flow.run.mode, &state, RECOVERY);
            let exact = listed(&jacobian.column(to, seed, &mut workspace));
            let mut difference = |e: f64| {
                let mut moved = state;
                let by = seed * Lanes::splat(e);
                match to {
                    Direction::Position(i) => moved.position[i] += e,
                    Direction::Attitude(i) => moved.attitude[i] += e,
                    Direction::Velocity(i) => moved.velocity[i] += e,
                    Direction::Turning(i) => moved.turning[i] += e,
                    Direction::Angle(i) => moved.angles[i] += by,
                    Direction::Rate(i) => moved.rates[i] += by,
                    Direction::Pulley => moved.pulley += by,
                    Direction::PulleyRate => moved.pulley_rate += by,
                }
                listed(&motion(&mut flow, &moved, RECOVERY).slope)
            };
            let (up, down) = (difference(1e-5), difference(-1e-5));
            let scale = exact.iter().fold(1.0_f64, |most, x| most.max(x.abs()));
            for (i, x) in exact.iter().enumerate() {
                let slope = (up[i] - down[i]) / 2e-5;
                assert!(
                    (x - slope).abs() < 1e-5 * scale,
                    "{name} {to:?} {i}: {x} and {slope} of {scale}"
                );
            }
        }
    }
}

#[test]
fn jacobian_matches_differences_with_point_feet() {
    jacobian_matches_differences::<3>();
}

#[test]
fn jacobian_matches_differences_with_toes() {
    jacobian_matches_differences::<4>();
}

/// Substitutes U of the reduced system into (I − hγJ) U = R, column by column.
fn solves_the_full_system<const N: usize>() {
    const RECOVERY: f64 = 20.0;
    let h = 3e-3;
    for (name, mut flow) in assorted::<N>() {
        let state = flow.run.state;
        let (free, coordinates) = (flow.model.is_free(), flow.model.coordinates());
        let slope = motion(&mut flow, &state, RECOVERY).slope;
        let right = scaled(&slope, Lanes::splat(h), free);
        let mut memory = Memory::default();
        let mut jacobian = Jacobian::new(&flow.model, &flow.run.mode, &state, RECOVERY);
        let u = if free {
            assert!(memory.factor_coupled(&mut jacobian, h));
            memory.solve(right, h * GAMMA, coordinates, 4)
        } else {
            let islands = memory.factor_islands(&mut jacobian, Lanes::splat(h));
            islands.solve(&right, Lanes::splat(h * GAMMA), coordinates)
        };
        let mut left = u;
        let mut workspace = Workspace::default();
        for row in 0..if free { TRUNK } else { 0 } {
            let one = Lanes::splat(1.0);
            let column = jacobian.column(trunk_direction(row), one, &mut workspace);
            left.add(-h * GAMMA * number(&u, row, coordinates), &column, true);
        }
        for k in 0..coordinates {
            for lane in 0..4 {
                let seed = Lanes::zero().with_lane(lane, 1.0);
                for (to, by) in directions::<N>(k)
                    .into_iter()
                    .zip([positions(&u)[k], velocities(&u)[k]])
                {
                    let column = jacobian.column(to, seed, &mut workspace);
                    left.add(-h * GAMMA * by.lane(lane), &column, free);
                }
            }
        }
        let (left, right) = (listed(&left), listed(&right));
        let scale = right.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        for (i, (l, r)) in left.iter().zip(&right).enumerate() {
            assert!((l - r).abs() < 1e-12 * scale, "{name} {i}: {l} and {r}");
        }
    }
}

#[test]
fn reduced_system_solves_the_full_system() {
    solves_the_full_system::<3>();
    solves_the_full_system::<4>();
}

#[test]
fn error_is_of_fourth_order() {
    for (name, start) in assorted::<3>() {
        if name == "standing" {
            // Its pose violates its constraints, which would be corrected abruptly.
            continue;
        }
        let ends = [16_u32, 32, 512].map(|count| {
            let mut flow = start.clone();
            let work = steps(&mut flow, 0.016 / f64::from(count), count);
            (flow.run.state, work)
        });
        let errors = [0, 1].map(|i| distance(&ends[i].0, &ends[2].0));
        let order = libm::log2(errors[0] / errors[1]);
        assert!(
            (3.6..5.0).contains(&order),
            "{name}: order {order}, {errors:?}"
        );
        let errors = [0, 1].map(|i| (ends[i].1[0] - ends[2].1[0]).abs());
        let order = libm::log2(errors[0] / errors[1]);
        assert!(
            (3.4..6.0).contains(&order),
            "work of friction, {name}: {order}, {errors:?}"
        );
    }
}

#[test]
fn short_steps_agree_with_runge_kutta() {
    for (name, mut flow) in assorted::<3>() {
        if name == "standing" {
            continue;
        }
        let mut other = flow.clone();
        let h = 1.25e-5;
        steps(&mut flow, h, 1600);
        for _ in 0..1600 {
            let state = other.run.state;
            other.run.state = runge_kutta(&mut other, &state, h);
        }
        let deviation = distance(&flow.run.state, &other.run.state);
        // Rates are of the order of ten.
        assert!(deviation < 1e-10, "{name}: {deviation:e}");
        let [a, b] = [&flow, &other].map(fixtures::foot);
        assert!(fixtures::rms(&[a], &[b]) < 1e-11, "{name}");
    }
}

#[test]
fn energy_balance_closes_with_the_order_of_the_method() {
    for (name, start) in assorted::<4>() {
        if name == "standing" || name == "fixed" {
            continue;
        }
        let residual = |count: u32| {
            let mut flow = start.clone();
            let before: f64 = flow.stored().iter().sum();
            let [dissipated, actuator] = steps(&mut flow, 0.064 / f64::from(count), count);
            flow.stored().iter().sum::<f64>() + dissipated - actuator - before
        };
        let [coarse, fine] = [64, 128].map(residual);
        assert!(
            fine.abs() < 1e-5 && coarse.abs() > 7.0 * fine.abs(),
            "{name}: {coarse:e} {fine:e}"
        );
    }
}

/// Advances with steps whose error is below a nanometre; returns the length of the last one.
fn adaptively(flow: &mut Flow<3>, seconds: f64, longest: f64) -> f64 {
    let (mut h, mut left) = (longest, seconds);
    while left > 0.0 {
        let state = flow.run.state;
        let start = motion(flow, &state, 0.0);
        let step = step_from(flow, &state, &start, Lanes::splat(h.min(left)), 0.0);
        let error = step.error.to_array().into_iter().fold(0.0, f64::max);
        if error > 1e-9 {
            h *= 0.5;
            assert!(h > 1e-12, "{error:e}");
            continue;
        }
        left -= h.min(left);
        flow.run.state = step.end;
        if error < 1e-11 {
            h = longest.min(2.0 * h);
        }
    }
    h
}

#[test]
fn stiff_leg_is_integrated_with_steps_unstable_for_rk4() {
    // Segments of negligible mass; stiff springs; joint friction, up to ten thousand times the
    // normal values.
    for (mass, stiffness, friction) in [(1e-6, 1.0, 1.0), (1.0, 1e4, 100.0), (1.0, 1.0, 1e4)] {
        let mut robot = robot();
        for mount in &mut robot.legs {
            let leg = &mut mount.leg;
            leg.toe = None;
            for m in [&mut leg.mass.l1, &mut leg.mass.l2, &mut leg.mass.l3] {
                *m *= mass;
            }
            leg.diagonal.stiffness *= stiffness;
            leg.parallel.stiffness *= stiffness;
            let joints = &mut leg.joint_friction;
            for f in [&mut joints.hip, &mut joints.knee, &mut joints.ankle] {
                *f *= friction;
            }
        }
        let pose = ([10.0, -20.0, 25.0], [0.0; 3]);
        let mut flow = flow::<3>(&robot, Base::Fixed, pose, Drives::None, None);
        let before: f64 = flow.stored().iter().sum();
        let h = adaptively(&mut flow, 0.5, 2e-3);
        let stored: f64 = flow.stored().iter().sum();
        assert!(
            stored < before,
            "{mass} {stiffness} {friction}: {before} to {stored}"
        );
        let mut other = flow.run.state;
        for _ in 0..1000 {
            other = runge_kutta(&mut flow, &other, h);
        }
        let rates = other
            .rates
            .iter()
            .fold(0.0, |sum, rate| sum + rate.lane(0).abs());
        assert!(
            rates.is_nan() || rates > 1e3,
            "{mass} {stiffness} {friction}: {rates}"
        );
    }
}

#[test]
fn legs_on_a_fixed_trunk_are_independent() {
    let (_, mut flow) = assorted::<4>().swap_remove(1);
    let state = flow.run.state;
    let h = Lanes::new([2e-3, 1e-3, 3e-3, 0.0]);
    let start = motion(&mut flow, &state, 10.0);
    let unperturbed = step_from(&mut flow, &state, &start, h, 10.0);
    let mut other = state;
    for lane in [1, 2, 3] {
        other.angles[1] = other.angles[1].with_lane(lane, 0.3 * lane as f64);
        other.rates[2] = other.rates[2].with_lane(lane, -9.0);
        other.pulley = other.pulley.with_lane(lane, 0.4);
    }
    let start = motion(&mut flow, &other, 10.0);
    let h = Lanes::new([2e-3, 5e-3, 1e-4, 1e-3]);
    let perturbed = step_from(&mut flow, &other, &start, h, 10.0);
    let bits = |step: &RodasStep<4>| {
        let end = &step.end;
        let legs = end.angles.iter().chain(&end.rates);
        let more = [
            &end.pulley,
            &end.pulley_rate,
            &step.dissipated,
            &step.actuator,
            &step.error,
        ];
        legs.chain(more)
            .map(|x| x.lane(0).to_bits())
            .collect::<Vec<_>>()
    };
    assert_eq!(bits(&unperturbed), bits(&perturbed));
}

#[test]
fn energy_balance_closes_under_motors_and_taut_cables() {
    let robot = fixtures::without_toes();
    let pose = (OPEN.0, [0.0; 3]);
    for taut in [false, true] {
        let residual = |count: u32| {
            let servos = fixtures::servo_drives(&robot);
            let mut flow = flow::<3>(&robot, Base::Fixed, pose, servos, None);
            flow.run.mode.active.cable = Lanes::splat(if taut { 1.0 } else { 0.0 });
            flow.run.mode.update_any();
            flow.run.mode.commands.hip += Lanes::splat(0.1);
            flow.run.mode.commands.pulley += Lanes::splat(0.1);
            let before: f64 = flow.stored().iter().sum();
            let [dissipated, actuator] = steps(&mut flow, 0.01 / f64::from(count), count);
            assert!(actuator > 1e-2, "{actuator}");
            flow.stored().iter().sum::<f64>() + dissipated - actuator - before
        };
        let [coarse, fine] = [10, 100].map(residual);
        // Fourth order or higher.
        assert!(
            fine.abs() < 1e-11 && coarse.abs() < 1e-6,
            "{coarse:e} {fine:e}"
        );
    }
}

#[test]
fn zero_length_step_changes_nothing() {
    for (name, mut flow) in assorted::<3>() {
        let state = flow.run.state;
        let start = motion(&mut flow, &state, 10.0);
        let step = step_from(&mut flow, &state, &start, Lanes::zero(), 10.0);
        assert!(distance(&step.end, &state) < 1e-15, "{name}");
        assert_eq!(step.error.to_array(), [0.0; 4], "{name}");
    }
}

#[test]
fn error_estimate_is_of_fourth_order_and_bounds_the_error() {
    let (_, mut flow) = assorted::<3>().swap_remove(0);
    let state = flow.run.state;
    let start = motion(&mut flow, &state, 0.0);
    let mut step = |h: f64| step_from(&mut flow, &state, &start, Lanes::splat(h), 0.0);
    let [long, short] = [2e-3, 1e-3].map(&mut step);
    let [estimate, half] = [&long, &short].map(|step| step.error.lane(0));
    let order = libm::log2(estimate / half);
    assert!((3.5..4.5).contains(&order), "{order}");
    // The same 2 ms in steps a hundredth as long.
    steps(&mut flow, 2e-5, 100);
    let error = error_norm(&flow.model, &difference(&long.end, &flow.run.state), true).lane(0);
    // The estimate is that of the third-order method.
    assert!(
        error < estimate && estimate < 1e3 * error,
        "{estimate:e} of {error:e}"
    );
}

/// Returns the difference of two states as an error.
fn difference<const N: usize>(a: &State<Lanes, N>, b: &State<Lanes, N>) -> Slope<Lanes, N> {
    let less = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|i| a[i] - b[i]);
    Slope {
        position: less(a.position, b.position),
        attitude: std::array::from_fn(|i| a.attitude[i] - b.attitude[i]),
        velocity: less(a.velocity, b.velocity),
        turning: less(a.turning, b.turning),
        angles: std::array::from_fn(|i| a.angles[i] - b.angles[i]),
        rates: std::array::from_fn(|i| a.rates[i] - b.rates[i]),
        pulley: a.pulley - b.pulley,
        pulley_rate: a.pulley_rate - b.pulley_rate,
        ..Slope::zero()
    }
}

#[test]
fn nan_step_has_infinite_error() {
    for which in [0, 2] {
        let (name, mut flow) = assorted::<3>().swap_remove(which);
        let mut state = flow.run.state;
        state.rates[0] = state.rates[0].with_lane(0, f64::NAN);
        let start = motion(&mut flow, &state, 0.0);
        let step = step_from(&mut flow, &state, &start, Lanes::splat(1e-3), 0.0);
        assert_eq!(step.error.lane(0), f64::INFINITY, "{name}");
        assert_eq!(
            step.error.lane(1).is_finite(),
            !flow.model.is_free(),
            "{name}"
        );
    }
}

#[test]
fn evaluations_and_factorisations_are_counted() {
    for (name, mut flow) in assorted::<3>() {
        let state = flow.run.state;
        let start = motion(&mut flow, &state, 0.0);
        let before = flow.run.counts;
        let _ = step_from(&mut flow, &state, &start, Lanes::splat(1e-3), 0.0);
        // Five stages, and one column per coordinate: of one leg for all legs, or of the trunk and
        // all legs, where the position counts only with contacts.
        let columns = match name {
            "hanging" => 6,
            "fixed" => 8,
            "tumbling" => 10 + 24,
            _ => 13 + 32,
        };
        assert_eq!(
            flow.run.counts.evaluations - before.evaluations,
            5 + columns,
            "{name}"
        );
        assert_eq!(
            flow.run.counts.factorisations - before.factorisations,
            1,
            "{name}"
        );
    }
}

#[test]
fn lanes_without_a_leg_stay_zero() {
    let mut robot = robot();
    robot.legs.truncate(2);
    for base in [Base::Fixed, Base::Planar] {
        let mut flow = flow::<4>(&robot, base, PASSIVE, fixtures::servo_drives(&robot), None);
        steps(&mut flow, 1e-3, 10);
        assert_eq!(flow.run.state.angles[0].lane(3), 0.0);
    }
}
