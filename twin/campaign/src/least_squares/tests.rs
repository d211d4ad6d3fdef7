use super::*;

const SETTINGS: LeastSquares = LeastSquares {
    loss: Loss::Square,
    iterations: 100,
    tolerance: 1e-9,
    difference: 0.02,
    threads: 2,
};

fn minimum(model: &dyn Residuals, start: &[f64]) -> Minimum {
    let found = SETTINGS.minimise(model, start, &mut |_| true).unwrap();
    assert!(found.converged);
    SETTINGS.evaluate(model, &found.point).unwrap()
}

/// y = 10 a exp(−5 b t), at 50 instants.
fn decay(point: &[f64]) -> Vec<f64> {
    let instants = (0..50).map(|i| f64::from(i) * 0.02);
    instants
        .map(|t| 10.0 * point[0] * libm::exp(-5.0 * point[1] * t))
        .collect()
}

#[test]
fn minimum_of_a_curve_without_noise_is_its_truth() {
    let measured = decay(&[0.3, 0.7]);
    let model = |point: &[f64]| {
        let computed = decay(point).into_iter();
        Some(
            computed
                .zip(&measured)
                .map(|(one, other)| one - other)
                .collect(),
        )
    };
    let found = minimum(&model, &[0.9, 0.1]);
    assert!((found.point[0] - 0.3).abs() < 1e-7, "{:?}", found.point);
    assert!((found.point[1] - 0.7).abs() < 1e-7, "{:?}", found.point);
}

/// A straight line has covariance σ² (XᵀX)⁻¹ in closed form.
#[test]
fn covariance_of_a_straight_line_is_the_textbooks() {
    let noise = |i: u32| f64::from(i * 7919 % 101) / 50.0 - 1.0;
    let model = |point: &[f64]| {
        let line = (0..40_u32).map(|i| {
            let x = f64::from(i) / 40.0;
            point[0] + point[1] * x - (0.4 + 0.2 * x + 0.05 * noise(i))
        });
        Some(line.collect())
    };
    let found = minimum(&model, &[0.5, 0.5]);
    let information = Information::of(&SETTINGS, &found, &[40]);
    let xs: Vec<f64> = (0..40).map(|i| f64::from(i) / 40.0).collect();
    let mean = xs.iter().sum::<f64>() / 40.0;
    let spread: f64 = xs.iter().map(|x| (x - mean) * (x - mean)).sum();
    let squares: f64 = found.residuals.iter().map(|it| it * it).sum();
    let variance = squares / 38.0;
    let slope = (variance / spread).sqrt() * information.correlation_time.sqrt();
    assert!((information.deviation(1) / slope - 1.0).abs() < 1e-6);
    assert!((information.variance / variance - 1.0).abs() < 1e-9);
    let correlation = -mean / (mean * mean + spread / 40.0).sqrt();
    assert!((information.correlation(0, 1) - correlation).abs() < 1e-6);
}

#[test]
fn product_of_two_parameters_is_a_direction_that_the_data_cannot_tell() {
    let model = |point: &[f64]| {
        let sum = libm::log(0.5 + point[0]) + libm::log(0.5 + point[1]);
        Some(
            (0..30)
                .map(|i| sum * f64::from(i) + point[2] - 0.5 - 0.01 * f64::from(i % 3))
                .collect(),
        )
    };
    let found = minimum(&model, &[0.3, 0.6, 0.1]);
    let information = Information::of(&SETTINGS, &found, &[30]);
    let unknown: Vec<_> = information
        .directions
        .iter()
        .filter(|it| !it.is_known())
        .collect();
    assert_eq!(unknown.len(), 1, "{:?}", information.directions);
    let vector = &unknown[0].vector;
    // Along it the product is constant, and the third parameter has no part in it.
    let change = vector[0] / (0.5 + found.point[0]) + vector[1] / (0.5 + found.point[1]);
    assert!(change.abs() < 1e-4 && vector[2].abs() < 1e-4, "{vector:?}");
    assert_eq!(information.deviation(0), f64::INFINITY);
    assert!(information.deviation(2) < 0.1);
}

/// Residuals of 10⁻⁷ standard deviations, as rounding and tolerances of a model make them.
#[test]
fn parameter_that_changes_residuals_by_rounding_alone_is_not_known() {
    let model = |point: &[f64]| {
        let rough = |i: u32| 1e-8 * libm::sin(1e3 * point[0] + f64::from(i));
        let residuals = (0..50).map(|i| 1e-7 * (point[0] - 0.9) + rough(i));
        Some(residuals.collect())
    };
    let found = SETTINGS.evaluate(&model, &[0.6]).unwrap();
    let information = Information::of(&SETTINGS, &found, &[50]);
    assert_eq!(information.deviation(0), f64::INFINITY);
}

#[test]
fn parameter_at_a_bound_is_held_there() {
    let model = |point: &[f64]| Some(vec![point[0] + 0.5, point[1] - 0.3, point[0] + point[1]]);
    let found = minimum(&model, &[0.5, 0.5]);
    assert_eq!(found.point[0], 0.0);
    assert!((found.point[1] - 0.15).abs() < 1e-7, "{:?}", found.point);
    assert_eq!(Information::of(&SETTINGS, &found, &[3]).free, [false, true]);
}

#[test]
fn outliers_move_a_robust_fit_less() {
    let model = |point: &[f64]| {
        let residuals = (0..40).map(|i| {
            let outlier = if i % 10 == 0 { 100.0 } else { 0.0 };
            100.0 * (point[0] - 0.2) - outlier + 0.1 * f64::from(i % 5)
        });
        Some(residuals.collect())
    };
    let robust = LeastSquares {
        loss: Loss::Huber(1.0),
        ..SETTINGS
    };
    let robust = robust.minimise(&model, &[0.5], &mut |_| true).unwrap();
    assert!((robust.point[0] - 0.2).abs() < 0.02, "{:?}", robust.point);
    assert!((minimum(&model, &[0.5]).point[0] - 0.3).abs() < 0.01);
}

/// A model in steps of 0.001 has no derivative but over longer steps.
#[test]
fn steps_of_differences_avoid_the_noise_of_counts_and_the_error_of_curvature() {
    let threads = rayon::ThreadPoolBuilder::new().build().unwrap();
    let chosen =
        |model: &dyn Residuals, at: f64| Jacobian::chosen(model, &[at], 0.05, &threads).unwrap();
    let counts = |point: &[f64]| Some(vec![(point[0] * 1000.0).round() * 2.0]);
    let found = chosen(&counts, 0.5003);
    assert!(
        (found.columns[0][0] / 2000.0 - 1.0).abs() < 0.03,
        "{found:?}"
    );
    let curved = |point: &[f64]| Some(vec![libm::exp(40.0 * point[0])]);
    let found = chosen(&curved, 0.1);
    let exact = 40.0 * libm::exp(4.0);
    assert!(
        (found.columns[0][0] / exact - 1.0).abs() < 0.01,
        "{found:?}"
    );
}

#[test]
fn integrated_time_of_an_autoregressive_series_is_its_closed_form() {
    // ρ(k) = 0.8ᵏ: 1 + 2 · 0.8/0.2 = 9.
    let (mut state, mut last, mut series) = (1_u64, 0.0, Vec::new());
    for _ in 0..200_000 {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        let uniform = (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5;
        last = 0.8 * last + uniform;
        series.push(last);
    }
    let time = integrated_time(&series, &[200_000]);
    assert!((time - 9.0).abs() < 0.8, "{time}");
    let white: Vec<f64> = series.windows(2).map(|it| it[1] - 0.8 * it[0]).collect();
    assert!((integrated_time(&white, &[white.len()]) - 1.0).abs() < 0.05);
}

/// Of a linear model the profile is that of the covariance; where a parameter has no influence, or
/// its bound is beyond the range, there is none.
#[test]
fn profile_of_a_linear_model_is_the_interval_of_its_covariance() {
    let noise = |i: u32| f64::from(i * 7919 % 101) / 50.0 - 1.0;
    let profiles = |intercept: f64| {
        let model = move |point: &[f64]| {
            let line = (0..40_u32).map(|i| {
                let x = f64::from(i) / 40.0;
                point[0] + point[1] * x - (intercept + 0.2 * x + 0.1 * noise(i))
            });
            Some(line.collect())
        };
        let found = minimum(&model, &[0.5, 0.5, 0.5]);
        let information = Information::of(&SETTINGS, &found, &[40]);
        [0, 1, 2].map(|parameter| {
            let profile = SETTINGS.profile(&model, &found, &information, parameter);
            let reach = 1.96 * information.deviation(parameter);
            profile.unwrap().bounds.map(|bound| {
                let distance = bound.map(|bound| (bound - found.point[parameter]).abs());
                distance.map(|distance| distance / reach)
            })
        })
    };
    let [intercept, slope, none] = profiles(0.4);
    for ratio in [intercept, slope].concat() {
        // The accuracy of a bound is 2 %.
        assert!((ratio.unwrap() - 1.0).abs() < 0.03, "{ratio:?}");
    }
    assert_eq!(none, [None, None]);
    // An intercept at the end of its range limits the slope, too.
    let [[low, high], [_, steep], _] = profiles(0.04);
    assert!(low.is_none() && high.is_some(), "{low:?} {high:?}");
    assert!(steep.unwrap() < 0.95, "{steep:?}");
}

/// exp(4 p) measured 25 times with a deviation of 1: the bounds are where it differs from the mean
/// by 1.96/5, not symmetrical in p.
#[test]
fn profile_of_a_curved_model_is_not_symmetrical() {
    let model = |point: &[f64]| {
        let sign = |i: i32| if i % 2 == 0 { 1.0 } else { -1.0 };
        let samples = (0..25).map(|i| libm::exp(4.0 * point[0]) - 2.0 - sign(i));
        Some(samples.collect())
    };
    let found = minimum(&model, &[0.5]);
    let information = Information::of(&SETTINGS, &found, &[25]);
    let deviation = (information.variance * information.correlation_time).sqrt();
    let profile = SETTINGS.profile(&model, &found, &information, 0).unwrap();
    let bounds = profile.bounds;
    let mean = libm::exp(4.0 * found.point[0]);
    for (side, bound) in [-1.0, 1.0].into_iter().zip(bounds) {
        let exact = libm::log(mean + side * 1.96 * deviation / 5.0) / 4.0;
        let reach = (exact - found.point[0]).abs();
        assert!(
            (bound.unwrap() - exact).abs() < 0.03 * reach,
            "{bounds:?} {exact}"
        );
    }
    let [low, high] = bounds.map(Option::unwrap);
    assert!(found.point[0] - low > 1.1 * (high - found.point[0]));
}

/// A parabola that levels off within the allowed excess is followed to the end of the range, where
/// it rises again; from a local minimum the lower one is found.
#[test]
fn profile_is_followed_to_the_end_of_the_range() {
    let profile = |curve: fn(f64) -> f64, start: f64| {
        // A sample whose half square is the curve, besides white ones of a variance of 1.
        let model = move |point: &[f64]| {
            let sign = |i: i32| if i % 2 == 0 { 1.0 } else { -1.0 };
            let white = (0..20).map(sign);
            Some(white.chain([(2.0 * curve(point[0])).sqrt()]).collect())
        };
        let found = SETTINGS.evaluate(&model, &[start]).unwrap();
        let information = Information::of(&SETTINGS, &found, &[21]);
        let found_profile = SETTINGS.profile(&model, &found, &information, 0).unwrap();
        (found_profile, found.cost)
    };
    // 95 % allow an excess of some 1.92.
    let plateau = |x: f64| (1e4 * (x - 0.1) * (x - 0.1)).min(1.5) + 50.0 * (x - 0.9).max(0.0);
    let (levels, _) = profile(plateau, 0.1);
    let [low, high] = levels.bounds;
    assert!(
        low.is_none() && (0.9..0.92).contains(&high.unwrap()),
        "{levels:?}"
    );
    let (open, _) = profile(|x| (1e4 * (x - 0.1) * (x - 0.1)).min(1.5), 0.1);
    assert_eq!(open.bounds, [None, None]);
    // 3.92 · 0.7² = 1.92: further below than the range reaches above.
    let (wide, _) = profile(|x| 3.92 * (x - 0.8) * (x - 0.8), 0.8);
    assert!((0.08..0.12).contains(&wide.bounds[0].unwrap()), "{wide:?}");
    let two = |x: f64| 1.0 + (1e3 * (x - 0.3) * (x - 0.3)).min(1e3 * (x - 0.34) * (x - 0.34) - 0.9);
    let (local, cost) = profile(two, 0.3);
    assert!(local.least_cost < cost - 0.1, "{local:?} {cost}");
    assert!((local.least[0] - 0.34).abs() < 0.02, "{local:?}");
}
