//! Footsteps of two runs are paired with their own, whatever else the feet do: a bounce or a missing footstep costs itself
//! and shifts no other.

use proptest::prelude::*;
use twinrig_record::{RecordedFootstep, pair_footsteps};

/// How much a foot stands of a stride.
const STANCE: f64 = 0.5;

/// What one run does with one footstep of one leg.
#[derive(Debug, Clone, Copy)]
struct Incident {
    /// The foot does not come down.
    missing: bool,
    /// The foot touches the ground in the swing before, at this part of it.
    bounce: Option<f64>,
    /// How much later it comes down and lifts off, in strides.
    late: [f64; 2],
}

/// A gait, and what two runs make of it.
#[derive(Debug, Clone)]
struct Gait {
    stride: f64,
    /// When each leg comes down, in strides.
    phases: Vec<f64>,
    /// How many strides b falls behind in a stride, at each stride.
    drift: Vec<f64>,
    /// By run, leg and stride.
    incidents: [Vec<Vec<Incident>>; 2],
}

/// A footstep, and which stride it belongs to; none is a bounce.
type Numbered = (RecordedFootstep, Option<usize>);

impl Gait {
    /// The footsteps of a leg in one of the runs, in order of time.
    fn footsteps(&self, run: usize, leg: usize) -> Vec<Numbered> {
        let mut steps: Vec<Numbered> = Vec::new();
        let mut behind = 0.0;
        for (number, incident) in self.incidents[run][leg].iter().enumerate() {
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
                // Both begin standing: a bounce before that is cut off.
                if step.touch_down_s >= 0.0 {
                    steps.push((step, number));
                }
            };
            if let Some(part) = incident.bounce {
                let from = -0.4 + 0.25 * part;
                step(from, from + 0.08, None);
            }
            if !incident.missing {
                let [touch_down, lift_off] = incident.late;
                step(touch_down, STANCE + lift_off, Some(number));
            }
        }
        steps
    }

    /// How many footsteps that both runs have are not paired with each other.
    fn wrong_pairs(&self) -> usize {
        let all: Vec<[Vec<Numbered>; 2]> = (0..self.phases.len())
            .map(|leg| [0, 1].map(|run| self.footsteps(run, leg)))
            .collect();
        let bare = |steps: &[Numbered]| steps.iter().map(|step| step.0).collect::<Vec<_>>();
        let legs: Vec<[Vec<_>; 2]> = all.iter().map(|[a, b]| [bare(a), bare(b)]).collect();
        let legs: Vec<_> = legs.iter().map(|[a, b]| [&a[..], &b[..]]).collect();
        let pairings = pair_footsteps(&legs, [1e3; 2]);
        let mut wrong = 0;
        for ([a, b], pairing) in all.iter().zip(&pairings.legs) {
            for (i, (_, number)) in a.iter().enumerate() {
                let twin = |(_, other): &Numbered| number.is_some() && other == number;
                if let Some(j) = b.iter().position(twin) {
                    wrong += usize::from(!pairing.pairs.contains(&(i, j)));
                }
            }
        }
        wrong
    }
}

/// The strides of a leg. One of five lacks its footstep, is preceded by a bounce, or both; but never two in a row, which are
/// not to be told from a pause.
fn incidents(strides: usize) -> impl Strategy<Value = Vec<Incident>> {
    let what = (0..15_u32).prop_map(|n| [[n == 1, n == 2], [true; 2]][usize::from(n == 0)]);
    let late = [-0.04..0.04_f64, -0.04..0.04_f64];
    let incident = (what, 0.0..1.0_f64, late);
    prop::collection::vec(incident, strides).prop_map(|all| {
        let mut before = false;
        let incident = |([missing, bounces], part, late): ([bool; 2], f64, [f64; 2])| {
            let here = (missing || bounces) && !before;
            before = here;
            Incident {
                missing: here && missing,
                bounce: (here && bounces).then_some(part),
                late,
            }
        };
        all.into_iter().map(incident).collect()
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
        let of_run = move || prop::collection::vec(incidents(strides), legs);
        // The frequency changes slowly: every so often another rate.
        let rates = prop::collection::vec(-drift..=drift, 1 + strides / 10);
        (0.15..0.6_f64, of_run(), of_run(), rates).prop_map(move |(stride, a, b, rates)| Gait {
            stride,
            phases: phases.clone(),
            drift: (0..strides).map(|n| rates[n / 10]).collect(),
            incidents: [a, b],
        })
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(50))]

    #[test]
    fn bounces_and_missing_footsteps_in_both_runs_shift_no_others(gait in gait(6..40, 0.0)) {
        prop_assert_eq!(gait.wrong_pairs(), 0);
    }

    #[test]
    fn nor_do_they_in_a_run_that_falls_behind_by_strides_or_gets_ahead(gait in gait(12..60, 0.05)) {
        prop_assert_eq!(gait.wrong_pairs(), 0);
    }

    /// All legs of one run bounce before their first footstep, or lack it: after a drop, say.
    #[test]
    fn nor_does_a_start_at_which_all_legs_bounce(
        mut gait in gait(6..20, 0.02), run in 0..2_usize, legs in prop::collection::vec(0..3_usize, 4),
    ) {
        for (incidents, kind) in gait.incidents[run].iter_mut().zip(legs) {
            match kind {
                0 => {}
                1 => incidents[1].bounce = Some(0.5),
                _ => (incidents[0].missing, incidents[1].bounce) = (true, Some(0.2)),
            }
        }
        prop_assert_eq!(gait.wrong_pairs(), 0);
    }
}
