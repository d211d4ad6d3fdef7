use std::path::Path;

use proptest::prelude::*;
use serde_json::{Value, json};
use twinrig_testing::python;

use super::distribution::Distribution;
use super::parameters::{Parameters, usual_population};
use super::*;

/// Standard normal vectors.
fn normals(numbers: &mut Stream, size: usize, count: usize) -> Vec<Vec<f64>> {
    let mut normal = || (0..size).map(|_| numbers.normal()).collect();
    (0..count).map(|_| normal()).collect()
}

fn numbers_of(value: &Value) -> Vec<f64> {
    let numbers = value.as_array().unwrap().iter();
    numbers.map(|number| number.as_f64().unwrap()).collect()
}

fn script() -> &'static Path {
    Path::new(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/tests/reference/cma_peer.py"
    ))
}

/// All quantities after each of twenty generations, negative weights included; the samples of the
/// first generations are stretched, so that the path of the mean is stopped.
#[test]
fn updates_are_those_of_purecma() {
    /// Far from its limit, which purecma does not have.
    const STEP: f64 = 1e-6;
    let Some(python) = python::python_of_peers("cma") else {
        return;
    };
    for size in [1, 2, 7, 16] {
        let mut numbers = stream(5, "test");
        let population = usual_population(size);
        let mut distribution = Distribution::new(vec![0.5; size], STEP, population);
        let (mut generations, mut ours) = (Vec::new(), Vec::new());
        for generation in 0..20 {
            let stretched = if generation < 3 { 6.0 } else { 1.0 };
            let samples: Vec<Vec<f64>> = normals(&mut numbers, size, population)
                .iter()
                .map(|normal| normal.iter().map(|z| stretched * (z + 0.3)).collect())
                .map(|normal: Vec<f64>| distribution.sample(&normal))
                .collect();
            let ranked: Vec<&[f64]> = samples.iter().map(Vec::as_slice).collect();
            distribution.update(&ranked);
            generations.push(samples);
            ours.push(distribution.clone());
        }
        let request = json!({
            "request": "updates", "mean": vec![0.5; size], "step": STEP, "generations": generations,
        });
        let peer = python::run(&python, script(), &[], &request);
        for (ours, peer) in ours.iter().zip(peer.as_array().unwrap()) {
            let near = |one: f64, other: f64, scale: f64| {
                assert!((one - other).abs() <= 1e-9 * scale, "{one} is not {other}");
            };
            near(ours.step, peer["step"].as_f64().unwrap(), ours.step);
            for (mean, other) in ours.mean.iter().zip(numbers_of(&peer["mean"])) {
                near(*mean, other, ours.step);
            }
            let paths = ours.path.iter().chain(&ours.step_path);
            let peers = numbers_of(&peer["path"]);
            let peers = peers.into_iter().chain(numbers_of(&peer["step_path"]));
            for (path, other) in paths.zip(peers) {
                near(*path, other, 1.0 + other.abs());
            }
            let norm = ours.covariances.diagonal().fold(0.0, f64::max);
            for (row, other) in peer["covariances"].as_array().unwrap().iter().enumerate() {
                for (column, other) in numbers_of(other).into_iter().enumerate() {
                    near(ours.covariances.at(row, column), other, norm);
                }
            }
        }
    }
}

/// The medians of 15 runs are alike: their quotient scatters by a few percent.
#[test]
fn evaluations_to_a_target_are_those_of_pycma() {
    type Cost<'a> = &'a (dyn Fn(&[f64]) -> f64 + Sync);
    const SIZE: usize = 6;
    const RUNS: u64 = 15;
    let Some(python) = python::python_of_peers("cma") else {
        return;
    };
    let request = json!({ "request": "evaluations", "size": SIZE, "runs": RUNS });
    let peers = python::run(&python, script(), &[], &request);
    let ellipsoid = |x: &[f64]| {
        let squares = x.iter().enumerate().map(|(i, x)| {
            libm::pow(10.0, 6.0 * i as f64 / (SIZE - 1) as f64) * (x - 1.0) * (x - 1.0)
        });
        squares.sum()
    };
    let rosenbrock = |x: &[f64]| {
        let pairs = x.windows(2);
        let valley = |x: &[f64]| {
            let (across, along) = (x[1] - x[0] * x[0], 1.0 - x[0]);
            100.0 * across * across + along * along
        };
        pairs.map(valley).sum()
    };
    let sphere = |x: &[f64]| x.iter().map(|x| (x - 1.0) * (x - 1.0)).sum();
    let functions: [(&str, Cost<'_>); 3] = [
        ("sphere", &sphere),
        ("ellipsoid", &ellipsoid),
        ("rosenbrock", &rosenbrock),
    ];
    for (name, function) in functions {
        let ours = (1..=RUNS).filter_map(|seed| evaluations(function, SIZE, seed));
        let peers = peers[name].as_array().unwrap();
        let (ours, peers) = (median(ours), median(peers.iter().filter_map(Value::as_f64)));
        println!("{name}: {ours} evaluations, pycma {peers}");
        assert!(
            (0.8..1.25).contains(&(ours / peers)),
            "{name}: {ours}, pycma {peers}"
        );
    }
}

/// Returns the evaluations to a cost of 1e-9, if it is reached.
fn evaluations(function: &(dyn Fn(&[f64]) -> f64 + Sync), size: usize, seed: u64) -> Option<f64> {
    let strategy = CmaEs {
        dimensions: vec![Dimension::linear(-5.0, 5.0); size],
        population: None,
        iterations: 3000,
        restarts: 0,
        tolerance: 1e-14,
        seed,
        threads: 1,
    };
    let population = usual_population(size) as f64;
    let mut count = None;
    let _ = strategy.minimise(function, &mut |progress| {
        if progress.cost <= 1e-9 {
            count = Some((progress.iteration + 1) as f64 * population);
        }
        count.is_none()
    });
    count
}

fn median(numbers: impl Iterator<Item = f64>) -> f64 {
    let mut numbers: Vec<f64> = numbers.collect();
    numbers.sort_by(f64::total_cmp);
    numbers[numbers.len() / 2]
}

proptest! {
    /// The update of rotated samples is the rotated update: no direction is preferred.
    #[test]
    fn updates_rotate_with_the_samples(seed: u64, size in 2..8_usize, turns in 1..6_usize) {
        let mut numbers = stream(seed, "test");
        let population = usual_population(size);
        // Far from the limit of the step size, which is one of coordinates.
        let mut plain = Distribution::new(vec![0.0; size], 1e-3, population);
        let mut turned = plain.clone();
        let axes = normals(&mut numbers, size, turns);
        // Householder reflections.
        let rotate = |vector: &[f64]| {
            axes.iter().fold(vector.to_vec(), |vector, axis| {
                let dot = |one: &[f64]| one.iter().zip(axis).map(|(one, axis)| one * axis).sum();
                let (along, square): (f64, f64) = (dot(&vector), dot(axis));
                let pairs = vector.iter().zip(axis);
                pairs.map(|(value, axis)| value - 2.0 * along / square * axis).collect()
            })
        };
        for _ in 0..6 {
            let normals = normals(&mut numbers, size, population);
            let samples: Vec<_> = normals.iter().map(|normal| plain.sample(normal)).collect();
            let images: Vec<_> = samples.iter().map(|sample| rotate(sample)).collect();
            plain.update(&samples.iter().map(Vec::as_slice).collect::<Vec<_>>());
            turned.update(&images.iter().map(Vec::as_slice).collect::<Vec<_>>());
        }
        let near = |one: f64, other: f64| (one - other).abs() < 1e-9 * (1.0 + other.abs());
        prop_assert!(near(plain.step / turned.step, 1.0));
        let pairs = [(&plain.mean, &turned.mean), (&plain.path, &turned.path)];
        for (one, other) in pairs {
            for (one, other) in rotate(one).into_iter().zip(other) {
                prop_assert!(near(one, *other));
            }
        }
        // C' v' = (C v)' for any vector.
        let vector = normals(&mut numbers, size, 1).remove(0);
        let image = rotate(&plain.covariances.times(&vector));
        let other = turned.covariances.times(&rotate(&vector));
        prop_assert!(image.into_iter().zip(other).all(|(one, other)| near(one, other)));
    }

    /// Whatever the ranking, covariances stay positive and the step size bounded.
    #[test]
    fn distribution_stays_regular(seed: u64, size in 1..7_usize, population in 4..12_usize) {
        let mut numbers = stream(seed, "test");
        let mut distribution = Distribution::new(vec![0.5; size], 0.3, population);
        for _ in 0..100 {
            let mut samples: Vec<_> = normals(&mut numbers, size, population)
                .iter()
                .map(|normal| distribution.sample(normal))
                .collect();
            // The farthest samples are the best.
            let length = |sample: &Vec<f64>| -> f64 {
                let pairs = sample.iter().zip(&distribution.mean);
                pairs.map(|(x, mean)| (x - mean) * (x - mean)).sum()
            };
            samples.sort_by(|one, other| length(other).total_cmp(&length(one)));
            distribution.update(&samples.iter().map(Vec::as_slice).collect::<Vec<_>>());
            distribution.widen();
            if !distribution.is_regular() {
                // Round-off of its eigenvalues; the search ends.
                prop_assert!(distribution.condition().abs() > 1e13);
                break;
            }
            prop_assert!(distribution.deviations().all(|width| width > 0.0 && width < 1.0 + 1e-9));
        }
    }
}

/// Table 1 of the tutorial: positive weights sum to 1, and the sum of all is about 0.
#[test]
fn weights_are_balanced() {
    for size in [1, 3, 16, 100] {
        for population in [usual_population(size), 4, 200] {
            let parameters = Parameters::new(size, population);
            let sum = |keep: &dyn Fn(f64) -> bool| -> f64 {
                let weights = parameters.weights.iter();
                weights.filter(|weight| keep(**weight)).sum()
            };
            assert!((sum(&|weight| weight > 0.0) - 1.0).abs() < 1e-12);
            let decay = parameters.rank_one + parameters.rank_mu * sum(&|_| true);
            assert!(
                (-1e-12..1.0 + 1e-12).contains(&decay),
                "{size} {population}: {decay}"
            );
            assert!(parameters.weights.is_sorted_by(|one, next| one >= next));
        }
    }
    assert_eq!([1, 2, 6, 16, 100].map(usual_population), [4, 6, 9, 12, 17]);
}

/// Doubling has an end, after which memory would not suffice.
#[test]
fn restarts_end_at_the_greatest_population() {
    for (population, ends) in [(POINTS_MOST / 2, false), (POINTS_MOST / 2 + 1, true)] {
        let strategy = CmaEs {
            dimensions: vec![Dimension::linear(0.0, 1.0)],
            population: Some(population),
            iterations: 100,
            restarts: 60,
            tolerance: 1e-7,
            seed: 1,
            threads: 1,
        };
        let mut search = strategy.search().unwrap();
        search.restart();
        assert_eq!(search.has_ended, ends);
    }
}
