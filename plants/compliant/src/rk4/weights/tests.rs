use super::*;
use crate::lanes::{Numbers, Quad};
use crate::rk4::{Fastest, Missed, NoMode, StepControl, Substep, System};

/// ẏ = cos t · y², whose solution from ½ is 1/(2 − sin t), and the integral of y.
#[derive(Debug, Clone, Copy)]
struct Riccati {
    area: f64,
}

impl System for Riccati {
    type State = f64;
    type Slope = [f64; 2];
    type Mode = NoMode<f64, [f64; 2], Numbers>;

    fn mode(&self, _: &f64, _: &[f64; 2]) -> Option<Self::Mode> {
        None
    }

    fn slope(&self, time: f64, state: &f64) -> [f64; 2] {
        [libm::cos(time) * state * state, *state]
    }

    fn along<const M: usize>(state: &f64, slopes: [&[f64; 2]; M], seconds: [f64; M]) -> f64 {
        state + sum(slopes, seconds)[0]
    }

    fn error(
        &self,
        _: f64,
        slopes: [&[f64; 2]; 5],
        seconds: [f64; 5],
        _: Option<Missed<'_, Self::Mode>>,
    ) -> f64 {
        sum(slopes, seconds)[0].abs()
    }

    fn fastest(&self, _: [&f64; 2], _: [&[f64; 2]; 2]) -> Fastest {
        Fastest::new(&[Quad::splat(0.0)], &[Quad::splat(0.0)])
    }

    fn accept(&mut self, substep: &Substep<'_, Self>) -> u64 {
        self.area += sum(substep.slopes, substep.shares)[1];
        0
    }
}

fn sum<const M: usize>(slopes: [&[f64; 2]; M], seconds: [f64; M]) -> [f64; 2] {
    let parts = slopes.into_iter().zip(seconds);
    parts.fold([0.0; 2], |sum, (slope, h)| {
        [sum[0] + slope[0] * h, sum[1] + slope[1] * h]
    })
}

/// Returns the errors of state and integral after two seconds in `steps` steps, and the control.
fn errors(tolerance: f64, steps: u32) -> ([f64; 2], StepControl) {
    let mut control = StepControl::new(tolerance);
    let mut error = [f64::NAN; 2];
    let mut system = Riccati { area: 0.0 };
    let mut state = 0.5;
    let seconds = 2.0 / f64::from(steps);
    for step in 0..steps {
        // The slope depends on the time within a step only.
        let begin = f64::from(step) * seconds;
        let mut shifted = Shifted { system, begin };
        control
            .advance(&mut shifted, &mut state, &mut None, seconds)
            .unwrap();
        system = shifted.system;
        let end = begin + seconds;
        let root = libm::sqrt(3.0);
        let area = |t: f64| 2.0 / root * libm::atan((2.0 * libm::tan(0.5 * t) - 1.0) / root);
        error = [
            (state - 1.0 / (2.0 - libm::sin(end))).abs(),
            (system.area - (area(end) - area(0.0))).abs(),
        ];
    }
    (error, control)
}

/// A system whose time begins later.
struct Shifted {
    system: Riccati,
    begin: f64,
}

impl System for Shifted {
    type State = f64;
    type Slope = [f64; 2];
    type Mode = NoMode<f64, [f64; 2], Numbers>;

    fn mode(&self, _: &f64, _: &[f64; 2]) -> Option<Self::Mode> {
        None
    }

    fn slope(&self, time: f64, state: &f64) -> [f64; 2] {
        self.system.slope(self.begin + time, state)
    }

    fn along<const M: usize>(state: &f64, slopes: [&[f64; 2]; M], seconds: [f64; M]) -> f64 {
        Riccati::along(state, slopes, seconds)
    }

    fn error(
        &self,
        substep: f64,
        slopes: [&[f64; 2]; 5],
        seconds: [f64; 5],
        missed: Option<Missed<'_, Self::Mode>>,
    ) -> f64 {
        self.system.error(substep, slopes, seconds, missed)
    }

    fn fastest(&self, states: [&f64; 2], slopes: [&[f64; 2]; 2]) -> Fastest {
        self.system.fastest(states, slopes)
    }

    fn accept(&mut self, substep: &Substep<'_, Self>) -> u64 {
        self.system.area += sum(substep.slopes, substep.shares)[1];
        0
    }
}

#[test]
fn order_is_four() {
    let [coarse, fine] = [40, 80].map(|steps| errors(f64::INFINITY, steps).0);
    for (coarse, fine) in coarse.into_iter().zip(fine) {
        assert!(
            (3.7..4.5).contains(&libm::log2(coarse / fine)),
            "{coarse} {fine}"
        );
    }
}

/// Stages and weights of a method: nodes, rows of the stages and of the end, error.
type Table<'t> = ([f64; 2], [&'t [f64]; 5], [f64; 5]);

/// Elementary differentials of a tree of order p have weights that sum to 1/γ. `blind` are the
/// trees of order 4 that the estimate of the error does not see.
fn check_order_conditions((nodes, rows, error): Table<'_>, blind: &[usize]) {
    let nodes = [0.0, nodes[0], nodes[1], 1.0, 1.0];
    let sum = |weights: &[f64], values: &dyn Fn(usize) -> f64| {
        let parts = weights
            .iter()
            .enumerate()
            .map(|(j, weight)| weight * values(j));
        parts.sum::<f64>()
    };
    let first = |i: usize| sum(rows[i], &|j| nodes[j]);
    let second = |i: usize| sum(rows[i], &|j| nodes[j] * nodes[j]);
    let third = |i: usize| sum(rows[i], &first);
    let trees: [(&dyn Fn(usize) -> f64, f64); 8] = [
        (&|_| 1.0, 1.0),
        (&|j| nodes[j], 2.0),
        (&|j| nodes[j] * nodes[j], 3.0),
        (&first, 6.0),
        (&|j| nodes[j] * nodes[j] * nodes[j], 4.0),
        (&|j| nodes[j] * first(j), 8.0),
        (&second, 12.0),
        (&third, 24.0),
    ];
    for (i, row) in rows.into_iter().enumerate() {
        assert!((sum(row, &|_| 1.0) - nodes[i]).abs() < 1e-15, "row {i}");
    }
    for (n, (value, density)) in trees.into_iter().enumerate() {
        let mean = sum(rows[4], value);
        assert!((mean - 1.0 / density).abs() < 1e-15, "tree {n}");
        // The companion is of order 3, and of no higher order.
        let error = sum(&error, value).abs();
        assert!(
            if n < 4 || blind.contains(&n) {
                error < 1e-15
            } else {
                error > 1e-3
            },
            "tree {n}: {error}"
        );
    }
}

#[test]
fn weights_satisfy_the_order_conditions() {
    use three_eighths as peer;
    let own: Table<'_> = (
        own::NODES,
        [&[], &own::SECOND, &own::THIRD, &own::FOURTH, &own::MEAN],
        own::ERROR,
    );
    check_order_conditions(own, &[]);
    let peer: Table<'_> = (
        peer::NODES,
        [&[], &peer::SECOND, &peer::THIRD, &peer::FOURTH, &peer::MEAN],
        peer::ERROR,
    );
    check_order_conditions(peer, &[6]);
}

#[test]
fn error_is_proportional_to_the_tolerance() {
    // A tolerance per millisecond: over two seconds errors may add up to 2000 of them.
    for tolerance in [1e-9, 1e-12] {
        let ([error, _], control) = errors(tolerance, 4);
        assert!(error < 2000.0 * tolerance, "{error}");
        assert!(control.work.accepted > 0);
        let work = control.work;
        assert_eq!(work.evaluations, 4 * (work.accepted + work.rejected) + 4);
    }
}

#[test]
fn substeps_are_at_most_a_millisecond() {
    let (_, control) = errors(1.0, 2);
    assert_eq!(control.work.accepted, 2000);
    let (_, control) = errors(1.0, 4000);
    assert_eq!(control.work.accepted, 4000);
    // Without control a step is a substep.
    let (_, control) = errors(f64::INFINITY, 2);
    assert_eq!(control.work.accepted, 2);
}

/// A force that begins within a substep, at any instant, is noticed.
#[cfg(not(feature = "three-eighths"))]
#[test]
fn estimate_notices_late_kinks() {
    for late in [0.3, 0.5, 0.7, 0.8] {
        let ramp = |time: f64| f64::max(time - late, 0.0);
        let slopes = [0.0, NODES[0], NODES[1], 1.0, 1.0].map(ramp);
        let estimate: f64 = slopes.iter().zip(ERROR).map(|(k, e)| k * e).sum();
        let taken: f64 = slopes.iter().zip(MEAN).map(|(k, b)| k * b).sum();
        let exact = 0.5 * (1.0 - late) * (1.0 - late);
        assert!(
            estimate.abs() > 0.3 * (taken - exact).abs(),
            "{late}: {estimate} {}",
            taken - exact
        );
    }
}
