use std::collections::BTreeSet;

use proptest::prelude::*;
use twinrig_campaign::sweep::SweepValue;

use super::spec;

fn column(points: &[Vec<SweepValue>], dimension: usize) -> Vec<&str> {
    let values = points.iter().map(|point| point[dimension].toml.as_str());
    values.collect()
}

fn numbers(points: &[Vec<SweepValue>], dimension: usize) -> Vec<f64> {
    points
        .iter()
        .map(|point| point[dimension].number.unwrap())
        .collect()
}

#[test]
fn grid_is_the_product_with_the_last_dimension_fastest() {
    let spec = spec(
        "[[dimension]]\nkey = 'gait'\nvalues = ['trot', \"walk\"]\n\
         [[dimension]]\nkey = 'frequency'\nfrom = '1 Hz'\nto = '2 Hz'\ncount = 3\n\
         [[dimension]]\nkey = 'seed'\nfrom = 7\nto = 8",
    )
    .unwrap();
    let mut expected = Vec::new();
    for gait in ["\"trot\"", "\"walk\""] {
        for frequency in ["\"1 Hz\"", "\"1.5 Hz\"", "\"2 Hz\""] {
            for seed in ["7", "8"] {
                expected.push(vec![gait, frequency, seed]);
            }
        }
    }
    let points = spec.points();
    let found: Vec<Vec<&str>> = points
        .iter()
        .map(|point| point.iter().map(|value| value.toml.as_str()).collect())
        .collect();
    assert_eq!(found, expected);
    assert_eq!(points[0][0].shown(), "trot");
}

#[test]
fn further_keys_of_a_dimension_have_its_value_and_change_no_other() {
    let dimensions = "{ key = 'a', ALSO from = 0, to = 1 }, { key = 'c', from = 0, to = 1 }";
    let read = |also: &str| {
        let dimensions = dimensions.replace("ALSO", also);
        spec(&format!(
            "design = 'random'\npoints = 9\ndimension = [{dimensions}]"
        ))
    };
    let (plain, linked) = (read("").unwrap(), read("also = ['b', 'x.y'],").unwrap());
    let keys: Vec<&str> = linked.keys().map(|key| key.value.as_str()).collect();
    assert_eq!(keys, ["a", "b", "x.y", "c"]);
    for (plain, linked) in plain.points().iter().zip(linked.points()) {
        let [a, c] = plain.as_slice() else {
            panic!("{plain:?}");
        };
        assert_eq!([a, a, a, c], [0, 1, 2, 3].map(|n| &linked[n]));
    }
    let error = read("also = ['c'],").unwrap_err();
    assert!(
        error.contains("`c` is set by the dimension `c` already"),
        "{error}"
    );
}

#[test]
fn logarithmic_grid_has_equal_ratios_and_exact_ends() {
    let spec =
        spec("dimension = [{ key = 'k', from = 1e-3, to = 10, count = 5, scale = 'logarithmic' }]");
    let found = numbers(&spec.unwrap().points(), 0);
    assert_eq!((found[0], found[4]), (1e-3, 10.0));
    for pair in found.windows(2) {
        assert!((pair[1] / pair[0] - 10.0).abs() < 1e-12, "{found:?}");
    }
}

proptest! {
    #[test]
    fn latin_hypercube_has_one_point_in_each_stratum(count in 1_usize..200, seed: u64) {
        let text = format!(
            "design = 'latin-hypercube'\npoints = {count}\nseed = {seed}\n\
             [[dimension]]\nkey = 'a'\nfrom = 0\nto = {count}\n\
             [[dimension]]\nkey = 'b'\nfrom = 1\nto = 1024\nscale = 'logarithmic'\n\
             [[dimension]]\nkey = 'seed'\nfrom = 11\nto = {}\n\
             [[dimension]]\nkey = 'c'\nvalues = [true, false]",
            count + 10,
        );
        let points = spec(&text).unwrap().points();
        let strata = |values: Vec<f64>| -> Vec<usize> {
            let mut strata: Vec<usize> = values
                .into_iter()
                .map(|value| (0..count).rev().find(|&n| value >= n as f64).unwrap())
                .collect();
            strata.sort_unstable();
            strata
        };
        let all: Vec<usize> = (0..count).collect();
        prop_assert_eq!(strata(numbers(&points, 0)), all.clone());
        // Each stratum of the logarithm is a decade of 1024^(1/count).
        let logarithms = numbers(&points, 1).into_iter().map(|value| {
            libm::log2(value) / 10.0 * count as f64 + 1e-9
        });
        prop_assert_eq!(strata(logarithms.collect()), all.clone());
        // As many seeds as points: each once.
        let mut seeds = numbers(&points, 2);
        seeds.sort_by(f64::total_cmp);
        let expected: Vec<f64> = all.iter().map(|n| (n + 11) as f64).collect();
        prop_assert_eq!(seeds, expected);
        let truths = column(&points, 3).into_iter().filter(|value| *value == "true").count();
        prop_assert!(truths.abs_diff(count - truths) <= 1);
    }

    /// Another dimension, at any place, takes no number from the others.
    #[test]
    fn numbers_of_a_dimension_do_not_depend_on_the_others(
        seed: u64, lhs: bool, first: bool,
    ) {
        let design = if lhs { "latin-hypercube" } else { "random" };
        let head = format!("design = '{design}'\npoints = 20\nseed = {seed}\n");
        let a = "[[dimension]]\nkey = 'a'\nfrom = '1 m'\nto = '2 m'\n";
        let b = "[[dimension]]\nkey = 'b'\nfrom = '1 ms'\nto = '2 s'\n";
        let alone = spec(&format!("{head}{a}")).unwrap().points();
        let both = if first { format!("{head}{b}{a}") } else { format!("{head}{a}{b}") };
        let both = spec(&both).unwrap().points();
        prop_assert_eq!(column(&alone, 0), column(&both, usize::from(first)));
        // The streams of two dimensions are different.
        let a = numbers(&alone, 0);
        let b = numbers(&both, usize::from(!first));
        prop_assert!(a.iter().zip(&b).any(|(a, b)| (a - 1.0 - b).abs() > 0.01));
        // Durations are whole nanoseconds, which the scenario requires.
        prop_assert!(b.iter().all(|b| (b * 1e9 - (b * 1e9).round()).abs() < 1e-3));
    }

    #[test]
    fn whole_numbers_are_drawn_from_both_ends_and_all_between(seed: u64, whole: bool) {
        let from = if whole { u64::MAX - 3 } else { 0 };
        let text = format!(
            "design = 'random'\npoints = 200\nseed = {seed}\n\
             [[dimension]]\nkey = 'n'\nwhole = true\nfrom = {from}\nto = {}", from + 3,
        );
        // TOML has numbers up to 2⁶³ − 1; larger ones are accepted by the reader.
        let points = spec(&text).unwrap().points();
        let found: BTreeSet<&str> = column(&points, 0).into_iter().collect();
        let expected: BTreeSet<String> = (0..4).map(|n| (from + n).to_string()).collect();
        prop_assert_eq!(found, expected.iter().map(String::as_str).collect());
    }
}

/// Commands with draws are legible.
#[test]
fn draws_have_few_digits() {
    let text = "design = 'random'\npoints = 1000\n\
                [[dimension]]\nkey = 'a'\nfrom = '2.5 m'\nto = '2.6 m'\n\
                [[dimension]]\nkey = 'b'\nfrom = 1e-6\nto = 1e6\nscale = 'logarithmic'";
    for point in spec(text).unwrap().points() {
        assert!(
            point[0].shown().len() <= "2.5123456 m".len(),
            "{:?}",
            point[0]
        );
        let digits = point[1].toml.trim_start_matches(['0', '.']).len();
        assert!(digits <= "123456.1234567".len(), "{:?}", point[1]);
    }
}

/// Kolmogorov's distance of 10⁴ uniform draws is above 0.0195 with a probability of 10⁻³.
#[test]
fn random_draws_are_uniform() {
    let spec = spec(
        "design = 'random'\npoints = 10000\n[[dimension]]\nkey = 'a'\nfrom = '-1 m'\nto = '1 m'",
    );
    let mut values = numbers(&spec.unwrap().points(), 0);
    values.sort_by(f64::total_cmp);
    let distances = values.iter().enumerate().map(|(index, value)| {
        let share = f64::midpoint(*value, 1.0);
        (share - index as f64 / 1e4).abs()
    });
    let distance = distances.fold(0.0, f64::max);
    assert!(distance < 0.0195, "{distance}");
}
