//! Periodic loads of rectangular contacts, whose phase, duty factor and number of contacts are
//! known in closed form.

use proptest::prelude::*;
use twinrig_kernel::SimDuration;

use super::*;

const SAMPLE_S: f64 = 2e-3;
const THRESHOLDS: Thresholds = Thresholds {
    touch_down: 0.5,
    lift_off: 0.25,
    shortest_swing: SimDuration::ZERO,
    least_impulse: 0.0,
};

/// A contact: begin and duration as shares of the period, and load \[N\].
#[derive(Clone, Copy, Debug)]
struct Contact {
    begin: f64,
    lasts: f64,
    load: f64,
}

/// Contacts of each leg in one period.
#[derive(Clone, Debug)]
struct Gait {
    period_s: f64,
    legs: Vec<Vec<Contact>>,
}

impl Gait {
    /// Returns the impulse of a leg since the start, up to a time.
    fn impulse(&self, leg: usize, at_s: f64) -> f64 {
        let periods = at_s / self.period_s;
        let whole = libm::floor(periods);
        let share = periods - whole;
        let contacts = self.legs[leg].iter().map(|contact| {
            // A contact may reach into the next period.
            let within = |share: f64| (share - contact.begin).clamp(0.0, contact.lasts);
            let lasted = within(share) + within(share + 1.0) - within(1.0);
            contact.load * (whole * contact.lasts + lasted)
        });
        self.period_s * contacts.sum::<f64>()
    }

    /// Returns the mean load of a leg since the last sample.
    fn load(&self, leg: usize, at_s: f64) -> f64 {
        (self.impulse(leg, at_s) - self.impulse(leg, at_s - SAMPLE_S)) / SAMPLE_S
    }

    /// Returns the phase of a leg: minus the argument of its first Fourier coefficient.
    fn phase(&self, leg: usize) -> f64 {
        let parts = self.legs[leg].iter().map(|contact| {
            let amplitude = contact.load * libm::sin(TAU / 2.0 * contact.lasts);
            let (sine, cosine) = libm::sincos(TAU * (contact.begin + 0.5 * contact.lasts));
            (amplitude * sine, amplitude * cosine)
        });
        let (y, x) = parts.fold((0.0, 0.0), |(y, x), part| (y + part.0, x + part.1));
        libm::atan2(y, x) / TAU
    }

    fn duty_factor(&self, leg: usize) -> f64 {
        self.legs[leg].iter().map(|contact| contact.lasts).sum()
    }

    fn cycles(&self, lasts_s: f64) -> Vec<LoadCycle> {
        cycles(self.legs.len(), lasts_s, &|leg, at_s| self.load(leg, at_s))
    }
}

/// Returns the cycles of loads in a run.
fn cycles(legs: usize, lasts_s: f64, load: &dyn Fn(usize, f64) -> f64) -> Vec<LoadCycle> {
    let mut search = LoadCycles::new(legs, THRESHOLDS);
    let mut found = Vec::new();
    let mut collect = |cycle: &LoadCycle| found.push(cycle.clone());
    for sample in 0..=whole_samples(lasts_s) {
        let now = SimTime::ZERO + SimDuration::from_millis(2 * sample);
        let at_s = now.as_secs_f64();
        search.sample(now, (0..legs).map(|leg| load(leg, at_s)), &mut collect);
    }
    search.finish(&mut collect);
    found
}

fn whole_samples(lasts_s: f64) -> u64 {
    let sample = SimDuration::from_millis(2);
    let lasts = SimDuration::try_from_secs_f64(lasts_s).unwrap();
    lasts.as_nanos() / sample.as_nanos()
}

/// Returns the distance of two phases.
fn apart(a: f64, b: f64) -> f64 {
    (wrap(a - b + 0.5) - 0.5).abs()
}

/// A leg that touches down with a contact, and bounces: a second contact not more than a third of a
/// cycle after the first, and a short third one.
fn leg() -> impl Strategy<Value = Vec<Contact>> {
    let first = (0.0..1.0_f64, 0.15..0.45_f64, 4.0..10.0_f64);
    let bounce = (0.02..0.15_f64, 0.05..0.3_f64, 0.2..1.0_f64);
    let graze = (0.05..0.2_f64, 0.02..0.05_f64, 1.0..4.0_f64);
    let bounces = (proptest::option::of(bounce), proptest::option::of(graze));
    (first, bounces).prop_map(|((begin, lasts, load), (bounce, graze))| {
        let mut contacts = vec![Contact { begin, lasts, load }];
        let mut end = lasts;
        if let Some((gap, share, of_load)) = bounce {
            let (offset, lasts) = (end + gap, share * lasts);
            contacts.push(Contact {
                begin: begin + offset,
                lasts,
                load: of_load * load,
            });
            end = offset + lasts;
        }
        if let Some((gap, lasts, load)) = graze.filter(|(gap, lasts, _)| end + gap + lasts < 0.9) {
            contacts.push(Contact {
                begin: begin + end + gap,
                lasts,
                load,
            });
        }
        for contact in &mut contacts {
            contact.begin = wrap(contact.begin);
        }
        contacts
    })
}

/// Robots with blocks of four legs that are full, empty in part, or several.
const LEGS: std::ops::RangeInclusive<usize> = 1..=6;

fn gait(legs: impl Strategy<Value = Vec<Vec<Contact>>>) -> impl Strategy<Value = Gait> {
    // Evenly over the logarithm: from 4 Hz to 0.25 Hz.
    let period = (0.0..1.0_f64).prop_map(|share| 0.25 * libm::pow(16.0, share));
    (period, legs).prop_map(|(period_s, legs)| Gait { period_s, legs })
}

proptest! {
    // A case is a run of some thousand samples.
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Measures of a cycle are those of the closed form, with any bounces.
    #[test]
    fn cycles_of_periodic_loads_are_those_of_their_fourier_series(
        gait in gait(proptest::collection::vec(leg(), LEGS)),
    ) {
        let lasts_s = 8.0 * gait.period_s;
        let cycles = gait.cycles(lasts_s);
        // The first and the last of eight periods may not lie within the run by a whole window.
        prop_assert!((5..=8).contains(&cycles.len()), "{} cycles", cycles.len());
        // Two samples at each end of a contact.
        let sampled = 4.0 * SAMPLE_S / gait.period_s;
        // A touch-down lies between two instants of the history, and the weights of two bins differ
        // by up to 0.05.
        let instants = 0.01 / gait.period_s;
        for cycle in &cycles {
            prop_assert!((cycle.period.as_secs_f64() / gait.period_s - 1.0).abs() < 0.005, "{cycle:?}");
            for leg in 0..gait.legs.len() {
                let of_leg = cycle.legs[leg];
                let phase = cycle.phase(leg, 0).unwrap();
                let expected = gait.phase(leg) - gait.phase(0);
                prop_assert!(apart(phase, expected) < 0.005, "{leg}: {phase}, {expected}");
                let (duty, contacts) = (gait.duty_factor(leg), gait.legs[leg].len() as f64);
                prop_assert!((of_leg.duty_factor - duty).abs() < 0.01 + contacts * sampled);
                let tolerance = contacts * (0.05 + instants);
                prop_assert!((of_leg.contacts - contacts).abs() < tolerance, "{of_leg:?}");
            }
        }
        for pair in cycles.windows(2) {
            let apart_s = pair[1].centre.as_secs_f64() - pair[0].centre.as_secs_f64();
            prop_assert!((apart_s / gait.period_s - 1.0).abs() < 0.01);
        }
    }

    /// A gait that changes its frequency has cycles of the one period and then of the other.
    #[test]
    fn cycles_follow_a_change_of_frequency(
        gait in gait(proptest::collection::vec(leg(), LEGS)),
        faster in 1.1..2.0_f64,
    ) {
        let after = Gait { period_s: gait.period_s / faster, ..gait.clone() };
        let change_s = 6.0 * gait.period_s;
        let load = |leg, at_s: f64| if at_s < change_s {
            gait.load(leg, at_s)
        } else {
            after.load(leg, at_s - change_s)
        };
        for cycle in cycles(gait.legs.len(), 2.0 * change_s, &load) {
            let at_s = cycle.centre.as_secs_f64();
            // Windows of three cycles and half a cycle of the search.
            let expected = match at_s - change_s {
                since if since < -2.5 * gait.period_s => &gait,
                since if since > 2.5 * gait.period_s => &after,
                _ => continue,
            };
            prop_assert!((cycle.period.as_secs_f64() / expected.period_s - 1.0).abs() < 0.01, "{cycle:?}");
        }
    }

    /// Standing, with loads that differ and drift, has no cycles.
    #[test]
    fn standing_has_no_cycles(
        loads in proptest::collection::vec((0.0..10.0_f64, -0.2..0.2_f64), LEGS),
    ) {
        let load = |leg: usize, at_s: f64| (loads[leg].0 + loads[leg].1 * at_s).max(0.0);
        prop_assert_eq!(cycles(loads.len(), 20.0, &load), vec![]);
    }

    /// The end of a run changes no cycle that was complete before.
    #[test]
    fn the_end_of_a_run_changes_no_earlier_cycle(
        gait in gait(proptest::collection::vec(leg(), LEGS)),
        ends in 0.3..1.0_f64,
    ) {
        let lasts_s = 8.0 * gait.period_s + LOOKAHEAD_S;
        let whole = gait.cycles(lasts_s);
        let shorter = gait.cycles(libm::floor(500.0 * ends * lasts_s) / 500.0);
        let is_complete = |cycle: &&LoadCycle| {
            cycle.centre.as_secs_f64() + gait.period_s + LOOKAHEAD_S < ends * lasts_s
        };
        let complete: Vec<_> = shorter.iter().filter(is_complete).collect();
        let expected: Vec<_> = whole.iter().filter(is_complete).collect();
        prop_assert_eq!(complete, expected);
    }
}

/// A cycle is that of both steps if one has less than two fifths of the load of the other.
#[test]
fn a_limp_doubles_the_period_below_two_fifths_of_the_load() {
    let limps = [(0.9, 1), (0.6, 1), (0.5, 1), (0.3, 2), (0.1, 2)];
    for (share, periods) in limps {
        let contact = |begin, load| Contact {
            begin,
            lasts: 0.05,
            load,
        };
        let legs = (0..4).map(|leg| {
            let begin = 0.25 * f64::from(leg % 2);
            vec![contact(begin, 6.0), contact(wrap(begin + 0.5), 6.0 * share)]
        });
        let gait = Gait {
            period_s: 0.8,
            legs: legs.collect(),
        };
        let cycles = gait.cycles(10.0);
        assert!(cycles.len() > 8, "{share}: {} cycles", cycles.len());
        for cycle in cycles {
            let expected_s = 0.4 * f64::from(periods);
            assert!(
                (cycle.period.as_secs_f64() / expected_s - 1.0).abs() < 0.03,
                "{share}: {cycle:?}"
            );
        }
    }
}

/// A leg in the air has no phase, and the cycle is that of the others.
#[test]
fn a_leg_without_load_has_no_phase() {
    let contact = |begin| {
        vec![Contact {
            begin,
            lasts: 0.5,
            load: 5.0,
        }]
    };
    let legs = vec![vec![], contact(0.0), contact(0.5), contact(0.0)];
    let gait = Gait {
        period_s: 0.4,
        legs,
    };
    let cycles = gait.cycles(5.0);
    assert!(cycles.len() > 8);
    for cycle in cycles {
        assert_eq!([cycle.legs[0].phase, cycle.phase(2, 0)], [None; 2]);
        assert!((cycle.period.as_secs_f64() - 0.4).abs() < 1e-3);
        assert!(apart(cycle.legs[2].phase.unwrap(), 0.5) < 1e-3);
    }
}

/// Touch-downs of a diagonal pair that bounces call a trot a walk; its loads do not.
#[test]
fn bounces_move_touch_downs_but_not_phases() {
    let stance = |begin| Contact {
        begin,
        lasts: 0.4,
        load: 6.0,
    };
    let graze = |begin| Contact {
        begin,
        lasts: 0.03,
        load: 1.0,
    };
    let legs = vec![
        vec![stance(0.1)],
        vec![graze(0.35), stance(0.6)],
        vec![graze(0.35), stance(0.6)],
        vec![stance(0.1)],
    ];
    let gait = Gait {
        period_s: 0.3,
        legs,
    };
    for cycle in gait.cycles(5.0) {
        let phases = [1, 2, 3].map(|leg| cycle.phase(leg, 0).unwrap());
        for (phase, expected) in phases.into_iter().zip([0.5, 0.5, 0.0]) {
            assert!(apart(phase, expected) < 0.02, "{phases:?}");
        }
        assert!((cycle.legs[1].contacts - 2.0).abs() < 0.02);
    }
}
