//! Footsteps of two runs are paired with their counterparts; a bounce or a missing footstep affects
//! no other pair.

use proptest::prelude::*;
use twinrig_record::{RecordedFootstep, pair_footsteps};

/// Duty factor.
const STANCE: f64 = 0.5;

/// Irregularities of one footstep of one leg in one run.
#[derive(Debug, Clone, Copy)]
struct Irregularity {
    /// The footstep is missing.
    missing: bool,
    /// Additional touch-down during the preceding swing, at this fraction of the interval.
    bounce: Option<f64>,
    /// Delay of touch-down and lift-off, in strides.
    late: [f64; 2],
}

/// A gait with the irregularities of two runs.
#[derive(Debug, Clone)]
struct Gait {
    stride: f64,
    /// Touch-down phase of each leg, in strides.
    phases: Vec<f64>,
    /// Lag that b accumulates in each stride, in strides.
    drift: Vec<f64>,
    /// By run, leg and stride.
    irregularities: [Vec<Vec<Irregularity>>; 2],
}

/// A footstep and the number of its stride; `None` for a bounce.
type Numbered = (RecordedFootstep, Option<usize>);

impl Gait {
    /// Returns the footsteps of a leg in one of the runs, in order of time.
    fn footsteps(&self, run: usize, leg: usize) -> Vec<Numbered> {
        let mut steps: Vec<Numbered> = Vec::new();
        let mut behind = 0.0;
        for (number, irregularity) in self.irregularities[run][leg].iter().enumerate() {
            if run == 1 {
                behind += self.drift[number];
            }
            let begin = number as f64 + self.phases[leg] + behind;
            let mut step = |from: f64, to: f64, number| {
                let step = RecordedFootstep {
                    touch_down_s: (begin + from) * self.stride,
                    lift_off_s: (begin + to) * self.stride,
                    position_m: None,
                };
                // Both runs begin standing: earlier bounces are omitted.
                if step.touch_down_s >= 0.0 {
                    steps.push((step, number));
                }
            };
            if let Some(part) = irregularity.bounce {
                let from = -0.4 + 0.25 * part;
                step(from, from + 0.08, None);
            }
            if !irregularity.missing {
                let [touch_down, lift_off] = irregularity.late;
                step(touch_down, STANCE + lift_off, Some(number));
            }
        }
        steps
    }

    /// Number of footsteps that occur in both runs and are not paired with each other.
    fn wrong_pairs(&self) -> usize {
        let all: Vec<[Vec<Numbered>; 2]> = (0..self.phases.len())
            .map(|leg| [0, 1].map(|run| self.footsteps(run, leg)))
            .collect();
        let unnumbered = |steps: &[Numbered]| steps.iter().map(|step| step.0).collect::<Vec<_>>();
        let legs: Vec<[Vec<_>; 2]> = all
            .iter()
            .map(|[a, b]| [unnumbered(a), unnumbered(b)])
            .collect();
        let legs: Vec<_> = legs.iter().map(|[a, b]| [&a[..], &b[..]]).collect();
        let pairings = pair_footsteps(&legs, [1e3; 2]);
        let mut wrong = 0;
        for ([a, b], pairing) in all.iter().zip(&pairings.legs) {
            for (i, (_, number)) in a.iter().enumerate() {
                let is_counterpart = |(_, other): &Numbered| number.is_some() && other == number;
                if let Some(j) = b.iter().position(is_counterpart) {
                    wrong += usize::from(!pairing.pairs.contains(&(i, j)));
                }
            }
        }
        wrong
    }
}

/// Strides of a leg. One of five lacks its footstep, is preceded by a bounce, or both; never two in
/// succession, which cannot be distinguished from a pause.
fn irregularities(strides: usize) -> impl Strategy<Value = Vec<Irregularity>> {
    let kind = (0..15_u32).prop_map(|n| [[n == 1, n == 2], [true; 2]][usize::from(n == 0)]);
    let late = [-0.04..0.04_f64, -0.04..0.04_f64];
    let irregularity = (kind, 0.0..1.0_f64, late);
    prop::collection::vec(irregularity, strides).prop_map(|all| {
        let mut before = false;
        let irregularity = |([missing, bounces], part, late): ([bool; 2], f64, [f64; 2])| {
            let here = (missing || bounces) && !before;
            before = here;
            Irregularity {
                missing: here && missing,
                bounce: (here && bounces).then_some(part),
                late,
            }
        };
        all.into_iter().map(irregularity).collect()
    })
}

fn gait(strides: core::ops::Range<usize>, drift: f64) -> impl Strategy<Value = Gait> {
    let phases = prop::sample::select(vec![
        vec![0.0, 0.5, 0.5, 0.0],
        vec![0.0, 0.25, 0.5, 0.75],
        vec![0.0, 0.0, 0.5, 0.5],
        vec![0.0, 0.5],
    ]);
    (strides, phases).prop_flat_map(move |(strides, phases)| {
        let legs = phases.len();
        let of_run = move || prop::collection::vec(irregularities(strides), legs);
        // The frequency varies slowly: a new rate every ten strides.
        let rates = prop::collection::vec(-drift..=drift, 1 + strides / 10);
        (0.15..0.6_f64, of_run(), of_run(), rates).prop_map(move |(stride, a, b, rates)| Gait {
            stride,
            phases: phases.clone(),
            drift: (0..strides).map(|n| rates[n / 10]).collect(),
            irregularities: [a, b],
        })
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(50))]

    #[test]
    fn bounces_and_missing_footsteps_affect_no_other_pair(gait in gait(6..40, 0.0)) {
        prop_assert_eq!(gait.wrong_pairs(), 0);
    }

    #[test]
    fn pairing_tolerates_a_lag_of_several_strides(gait in gait(12..60, 0.05)) {
        prop_assert_eq!(gait.wrong_pairs(), 0);
    }

    /// All legs of one run bounce before their first footstep, or lack it, as after a drop.
    #[test]
    fn pairing_tolerates_bounces_of_all_legs_at_the_start(
        mut gait in gait(6..20, 0.02), run in 0..2_usize, legs in prop::collection::vec(0..3_usize, 4),
    ) {
        for (irregularities, kind) in gait.irregularities[run].iter_mut().zip(legs) {
            match kind {
                0 => {}
                1 => irregularities[1].bounce = Some(0.5),
                _ => (irregularities[0].missing, irregularities[1].bounce) = (true, Some(0.2)),
            }
        }
        prop_assert_eq!(gait.wrong_pairs(), 0);
    }
}
