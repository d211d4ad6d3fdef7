use proptest::prelude::*;

use super::*;
use crate::lanes::Numbers;

/// A mass on a one-sided spring whose damper sets in at once: the force has a kink at zero, its
/// rate a jump.
#[derive(Clone, Copy)]
struct Bounce {
    /// Stiffness \[1/s²\] and damping \[1/s\] over the mass.
    stiffness: f64,
    damping: f64,
    /// Viscous friction over the mass, everywhere \[1/s\].
    drag: f64,
}

/// Depth \[m\] and speed \[m/s\].
type Motion = [f64; 2];

impl System for Bounce {
    type State = Motion;
    type Slope = Motion;
    type Mode = NoMode<Motion, Motion, Numbers>;

    fn mode(&self, _: &Motion, _: &Motion) -> Option<Self::Mode> {
        None
    }

    fn slope(&self, _: f64, [depth, speed]: &Motion) -> Motion {
        const TOE: f64 = 1e-4;
        let pressed = depth.max(0.0);
        let force = self.stiffness * pressed + self.damping * (pressed / TOE).min(1.0) * speed;
        [*speed, 9.81 - force.max(0.0) - self.drag * speed]
    }

    fn along<const M: usize>(state: &Motion, slopes: [&Motion; M], seconds: [f64; M]) -> Motion {
        let change = sum(slopes, seconds);
        [0, 1].map(|i| state[i] + change[i])
    }

    fn error(
        &self,
        substep: f64,
        slopes: [&Motion; 5],
        seconds: [f64; 5],
        _: Option<Missed<'_, Self::Mode>>,
    ) -> f64 {
        let [depth, speed] = sum(slopes, seconds).map(f64::abs);
        depth + substep * speed
    }

    fn fastest(&self, states: [&Motion; 2], slopes: [&Motion; 2]) -> Fastest {
        let difference = |[a, b]: [&Motion; 2]| [0, 1].map(|i| Quad([b[i] - a[i], 0.0, 0.0, 0.0]));
        let trunk = [Quad::splat(0.0); TRUNK];
        let all = |ends| [&trunk[..], &difference(ends)].concat();
        Fastest::new(&all(states), &all(slopes))
    }

    fn accept(&mut self, _: &Substep<'_, Self>) -> u64 {
        0
    }
}

fn sum<const M: usize>(slopes: [&Motion; M], seconds: [f64; M]) -> Motion {
    let parts = slopes.into_iter().zip(seconds);
    parts.fold([0.0; 2], |sum, (slope, h)| {
        [sum[0] + slope[0] * h, sum[1] + slope[1] * h]
    })
}

/// Lets the mass fall by 5 cm onto the spring, in steps of 2 ms, until it is about to leave it.
fn fall(bounce: Bounce, tolerance: f64) -> Result<(Motion, StepWork), StepError> {
    let (mut control, mut system) = (StepControl::new(tolerance), bounce);
    let (mut state, mut slope) = ([-0.05, 0.0], None);
    for _ in 0..51 {
        control.advance(&mut system, &mut state, &mut slope, 2e-3)?;
    }
    Ok((state, control.work))
}

const SOFT: Bounce = Bounce {
    stiffness: 1e6,
    damping: 4e3,
    drag: 0.0,
};

#[test]
fn kinks_do_not_stop_a_tight_tolerance() {
    let (exact, _) = fall(SOFT, 1e-13).unwrap();
    let mut before = f64::INFINITY;
    for tolerance in [1e-6, 1e-8, 1e-10, 2e-12] {
        let (state, work) = fall(SOFT, tolerance).unwrap();
        let error = (state[0] - exact[0]).abs();
        assert!(
            error < 0.2 * before,
            "{tolerance:e}: {error:e} after {before:e}"
        );
        assert!(work.accepted < 200_000, "{work:?}");
        before = error;
    }
}

#[test]
fn stiffness_and_tolerance_are_told_apart() {
    let stiff = Bounce { drag: 1e7, ..SOFT };
    let error = fall(stiff, 1e-6).unwrap_err();
    let StepError::TooStiff { fastest, substep } = error else {
        panic!("{error}");
    };
    assert_eq!(fastest.leg, 0);
    assert!(
        (fastest.rate / 1e7 - 1.0).abs() < 0.5 && substep < 1e-6,
        "{error}"
    );
    let error = fall(SOFT, 1e-14).unwrap_err();
    assert!(matches!(error, StepError::TooPrecise { .. }), "{error}");
    let error = fall(SOFT, f64::INFINITY).map(|(state, _)| state);
    assert!(
        !matches!(error, Err(StepError::TooStiff { .. })),
        "{error:?}"
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]
    #[test]
    fn every_run_completes_or_is_refused_in_bounded_work(
        stiffness in 0.0..14.0_f64, damping in 0.0..9.0_f64,
        drag in -3.0..9.0_f64, tolerance in -13.0..-3.0_f64,
    ) {
        let power = |exponent| libm::pow(10.0, exponent);
        let bounce = Bounce { stiffness: power(stiffness), damping: power(damping), drag: power(drag) };
        let (mut control, mut system) = (StepControl::new(power(tolerance)), bounce);
        let (mut state, mut slope) = ([-0.05, 0.0], None);
        for step in 1..=100_u32 {
            let done = control.advance(&mut system, &mut state, &mut slope, 2e-3);
            let work = control.work;
            let substeps = (work.accepted + work.rejected) as f64;
            prop_assert!(substeps <= f64::from(step) * (SUBSTEPS + SUBSTEPS_PER_TIME * 2e-3));
            if done.is_err() {
                break;
            }
            prop_assert!(state.iter().all(|x| x.is_finite()));
        }
    }
}
