//! Tables and headline of a synthetic map, in which every value is another.

use twinrig_report::html::line_plot::AxisLabel;

use super::super::{GaitMap, GaitMapInput, GaitPoint};
use super::{QUANTITIES, lines, table};
use crate::page_parts::rows;

fn map() -> GaitMap {
    let input = GaitMapInput {
        name: "a <gait>".to_owned(),
        file: "gait.toml".to_owned(),
        frequencies_hz: vec![2.0, 3.0],
        step_lengths_m: vec![0.1, 0.12],
        after_s: 5.0,
        end_s: 10.0,
        left_out: Vec::new(),
    };
    let places = input.places(2).into_iter().enumerate();
    let points = places.map(|(index, (scene, [frequency_hz, step_length_m]))| {
        let n = index as f64;
        GaitPoint {
            plant: ["a", "b"][scene].to_owned(),
            frequency_hz,
            step_length_m,
            speed_m_s: Some(0.5 + 0.01 * n),
            cost_of_transport: Some(1.5 + 0.01 * n),
            froude: Some(2.5 + 0.01 * n),
            fell_at_s: None,
            why: None,
        }
    });
    let mut map = GaitMap {
        points: points.collect(),
        input,
    };
    let fallen = &mut map.points[3];
    fallen.fell_at_s = Some(4.25);
    (fallen.speed_m_s, fallen.cost_of_transport, fallen.froude) = (None, None, None);
    map.points[6].froude = None;
    map
}

#[test]
fn values_are_at_their_frequency_and_step_length() {
    let map = map();
    let tables = ["a", "b"].map(|plant| {
        let tables = QUANTITIES
            .iter()
            .map(|quantity| rows(&table(&map, plant, quantity)));
        tables.collect::<Vec<_>>()
    });
    let head = "frequency | 100 mm | 120 mm";
    let expected = [
        [
            [
                head,
                "2 Hz | 0.500 | 0.510",
                "3 Hz | 0.520 | **fell 4.2 s**",
            ],
            [
                head,
                "2 Hz | 1.500 | 1.510",
                "3 Hz | 1.520 | **fell 4.2 s**",
            ],
            [
                head,
                "2 Hz | 2.500 | 2.510",
                "3 Hz | 2.520 | **fell 4.2 s**",
            ],
        ],
        [
            [head, "2 Hz | 0.540 | 0.550", "3 Hz | 0.560 | 0.570"],
            [head, "2 Hz | 1.540 | 1.550", "3 Hz | 1.560 | 1.570"],
            [head, "2 Hz | 2.540 | 2.550", "3 Hz | – | 2.570"],
        ],
    ];
    assert_eq!(tables, expected);
}

#[test]
fn row_has_all_step_lengths() {
    let mut map = map();
    map.input.frequencies_hz = vec![2.0];
    map.input.step_lengths_m = vec![0.1, 0.12, 0.14, 0.16];
    assert_eq!(
        rows(&table(&map, "a", &QUANTITIES[0])),
        [
            "frequency | 100 mm | 120 mm | 140 mm | 160 mm",
            "2 Hz | 0.500 | 0.510 | 0.520 | **fell 4.2 s**"
        ]
    );
}

#[test]
fn headline_has_the_fastest_and_the_cheapest_gait_of_each_plant() {
    assert_eq!(
        map().headline(),
        "a: fastest 0.520 m/s at 3 Hz and 100 mm; least cost of transport 1.500 at 2 Hz and \
         100 mm; 1 of 4 fell. b: fastest 0.570 m/s at 3 Hz and 120 mm; least cost of transport \
         1.540 at 2 Hz and 100 mm; 0 of 4 fell."
    );
}

#[test]
fn plot_has_a_point_for_each_gait_that_stands() {
    let axes = ["x", "y"].map(AxisLabel::number);
    let drawing = lines(&map(), "a", axes, |it| Some([it.speed_m_s?, it.froude?])).drawing;
    let tooltips = ["2 Hz, 100 mm", "2 Hz, 120 mm", "3 Hz, 100 mm"];
    assert!(
        tooltips
            .iter()
            .all(|tooltip| drawing.svg().contains(tooltip))
    );
    assert!(!drawing.svg().contains("3 Hz, 120 mm"));
}
