//! Axes and shapes.

use super::*;

fn axis(values: &[f64]) -> LinearAxis {
    LinearAxis::around(values.iter().copied(), 100.0, 500.0, 80.0)
}

#[test]
fn ticks_are_round_and_contain_all_values() {
    let axis = axis(&[-0.3, 27.9]);
    let labels: Vec<String> = axis.ticks(1.0).map(|(_, label)| label).collect();
    assert_eq!(labels, ["-10", "0", "10", "20", "30"]);
    assert_eq!((axis.at(-10.0), axis.at(30.0)), (100.0, 500.0));
    assert_eq!(axis.at(10.0), 300.0);
}

#[test]
fn axis_is_valid_for_any_values() {
    for values in [&[][..], &[f64::NAN], &[5.0], &[0.0], &[f64::INFINITY, 1.0]] {
        let axis = axis(values);
        assert!((100.0..=500.0).contains(&axis.at(5.0)), "{values:?}");
        assert!(axis.ticks(1.0).count() >= 2);
    }
}

#[test]
fn single_value_is_in_the_middle() {
    assert_eq!(axis(&[5.0]).at(5.0), 300.0);
}

#[test]
fn small_values_have_a_prefix_if_their_unit_takes_one() {
    let prefix = |unit| AxisLabel::in_unit("a", unit).prefix(4e-3);
    let plain = ("", 1.0);
    assert_eq!(["s", "m/s", "1"].map(prefix), [("m", 1e-3), plain, plain]);
}

#[test]
fn bars_begin_at_zero_and_a_band_goes_back_along_its_lower_end() {
    let bars = Shape::Bars {
        width: 1.0,
        points: vec![[2.0, 5.0]],
    };
    assert_eq!(bars.points(), [[1.5, 0.0], [2.5, 5.0]]);
    let band = Shape::Band(vec![[0.0, 1.0, 2.0], [1.0, 1.0, 2.0]]);
    let plot = LinePlot {
        title: String::new(),
        width: 500.0,
        height: 200.0,
        x: AxisLabel::number("x"),
        y: AxisLabel::number("y"),
        series: vec![Series {
            number: 0,
            shape: band,
        }],
    };
    let around = "points=\"78.0,12.0 472.0,12.0 472.0,152.0 78.0,152.0\"";
    assert!(plot.svg().contains(around));
}
