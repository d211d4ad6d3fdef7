//! Invariances of CMA-ES, and the protocol of a search.

use proptest::prelude::*;
use twinrig_campaign::search::{CmaEs, Dimension, Found, Search, SearchError, SwarmSearch};

fn strategy(dimensions: Vec<Dimension>, seed: u64) -> CmaEs {
    CmaEs {
        dimensions,
        population: None,
        iterations: 400,
        restarts: 0,
        tolerance: 1e-12,
        seed,
        threads: 1,
    }
}

fn minimise(strategy: &CmaEs, objective: impl Fn(&[f64]) -> f64 + Sync) -> Found {
    strategy.minimise(&objective, &mut |_| true).unwrap()
}

fn squares(x: &[f64], centre: &[f64]) -> f64 {
    let pairs = x.iter().zip(centre);
    pairs.map(|(x, centre)| (x - centre) * (x - centre)).sum()
}

/// Costs of a valley across the axes.
fn valley(x: &[f64]) -> f64 {
    squares(x, &[0.3; 3]) + 1e3 * (x[0] - x[1] + x[2] - 0.3) * (x[0] - x[1] + x[2] - 0.3)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// Only the order of the costs counts: the points are the same to the last bit.
    #[test]
    fn monotone_map_of_the_cost_changes_no_point(seed: u64, scale in 0.1..10.0_f64) {
        let strategy = CmaEs {
            iterations: 60,
            ..strategy(vec![Dimension::linear(0.0, 1.0); 3], seed)
        };
        let plain = minimise(&strategy, valley);
        for map in [
            (&|cost: f64| scale * cost - 7.0) as &(dyn Fn(f64) -> f64 + Sync),
            &|cost| -1.0 / (1e-9 + cost),
            &libm::cbrt,
        ] {
            prop_assert_eq!(&minimise(&strategy, |x| map(valley(x))).best, &plain.best);
        }
    }

    #[test]
    fn threads_have_no_influence_and_the_seed_has(seed: u64) {
        let one = CmaEs {
            iterations: 30,
            ..strategy(vec![Dimension::logarithmic(1e-3, 1e3); 3], seed)
        };
        let found = minimise(&one, valley);
        let with = |threads, seed| minimise(&CmaEs { seed, threads, ..one.clone() }, valley);
        prop_assert_eq!(&with(3, seed), &found);
        prop_assert_ne!(&with(1, seed ^ 1), &found);
    }

    /// Optima within the ranges, close to bounds and on them.
    #[test]
    fn optima_at_the_bounds_are_found(seed: u64, kinds in prop::array::uniform6(0_u8..5)) {
        let centre = kinds.map(|kind| [0.0, 0.02, 0.4, 0.95, 1.0][usize::from(kind)]);
        let found = minimise(&strategy(vec![Dimension::linear(0.0, 1.0); 6], seed), |x| {
            assert!(x.iter().all(|x| (0.0..=1.0).contains(x)));
            squares(x, &centre)
        });
        prop_assert!(found.cost < 1e-18, "{}", found.cost);
        // It has converged and ended by itself.
        prop_assert!(found.history.len() < 400);
    }

    /// Searches are functions of the costs they are told, so that a store of costs replays them:
    /// asking twice gives the same points, and a second search told the same costs follows.
    #[test]
    fn searches_are_functions_of_their_costs(seed: u64) {
        let strategy = strategy(vec![Dimension::linear(0.0, 1.0); 3], seed).search().unwrap();
        let swarm = SwarmSearch::new(3, 8, 20, seed).unwrap();
        let again = || -> [Box<dyn Search>; 2] {
            let strategy = self::strategy(vec![Dimension::linear(0.0, 1.0); 3], seed).search();
            [Box::new(strategy.unwrap()), Box::new(SwarmSearch::new(3, 8, 20, seed).unwrap())]
        };
        let searches: [Box<dyn Search>; 2] = [Box::new(strategy), Box::new(swarm)];
        for (mut search, mut replay) in searches.into_iter().zip(again()) {
            for _ in 0..20 {
                let points = search.ask().unwrap().unwrap();
                prop_assert_eq!(search.ask().unwrap(), Some(points.clone()));
                prop_assert_eq!(replay.ask().unwrap(), Some(points.clone()));
                let costs: Vec<f64> = points.iter().map(|point| valley(point)).collect();
                let few = search.tell(&costs[1..]);
                let is_refused = matches!(few, Err(SearchError::Costs { .. }));
                prop_assert!(is_refused);
                search.tell(&costs).unwrap();
                replay.tell(&costs).unwrap();
                let is_told = matches!(search.tell(&costs), Err(SearchError::Costs { .. }));
                prop_assert!(is_told);
            }
        }
    }
}

/// Rastrigin's function has a local minimum near every whole number, in which a small population
/// ends; populations that are doubled find the least of them.
#[test]
fn restarts_leave_local_minima() {
    let rastrigin = |x: &[f64]| -> f64 {
        let terms = x.iter().map(|x| {
            let x = x - 0.7;
            x * x + 10.0 * (1.0 - libm::cos(2.0 * std::f64::consts::PI * x))
        });
        terms.sum()
    };
    let found = |restarts| {
        let found = (1..=4).filter(|&seed| {
            let strategy = CmaEs {
                iterations: 2000,
                restarts,
                ..strategy(vec![Dimension::linear(-5.0, 5.0); 3], seed)
            };
            minimise(&strategy, rastrigin).cost < 1e-9
        });
        found.count()
    };
    let (without, with) = (found(0), found(7));
    assert!(without <= 1 && with >= 3, "{without} and {with} of 4");
}

#[test]
fn impossible_points_count_last_and_flat_costs_end_the_search() {
    let line = strategy(vec![Dimension::linear(-1.0, 1.0); 2], 3);
    let found = minimise(&line, |x| {
        if x[0] < 0.5 {
            f64::NAN
        } else {
            x[0] + x[1] * x[1]
        }
    });
    assert!((found.cost - 0.5).abs() < 1e-6, "{}", found.cost);
    assert!(found.not_a_number > 0);
    let error = line.minimise(&|_| f64::NAN, &mut |_| true).unwrap_err();
    let is_expected = matches!(
        error,
        SearchError::NoFiniteCost { evaluations, not_a_number }
            if evaluations == not_a_number && evaluations < 400
    );
    assert!(is_expected, "{error}");
}

#[test]
fn invalid_strategies_are_rejected() {
    let valid = strategy(vec![Dimension::linear(0.0, 1.0)], 0);
    let error = |strategy: CmaEs| strategy.minimise(&|_| 0.0, &mut |_| true).unwrap_err();
    let small = CmaEs {
        population: Some(3),
        ..valid.clone()
    };
    let least = SearchError::Population {
        population: 3,
        least: 4,
    };
    assert_eq!(error(small), least);
    let idle = CmaEs {
        threads: 0,
        ..valid.clone()
    };
    assert_eq!(error(idle), SearchError::Zero { what: "threads" });
    let none = CmaEs {
        dimensions: Vec::new(),
        ..valid
    };
    assert_eq!(error(none), SearchError::NoDimensions);
}
