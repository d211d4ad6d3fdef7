//! Tables of synthetic results, in which every value differs.

use twinrig_campaign::radius::AxisEnd;
use twinrig_kernel::Unit;

use super::*;
use crate::page_parts::{assert_cards, rows};

fn radius(name: &str, holds_to: f64, fails_at: Option<f64>) -> ExpectationRadius {
    ExpectationRadius {
        name: name.to_owned(),
        state: fails_at.map_or(RadiusState::Beyond, |_| RadiusState::Found),
        holds_to: Some(holds_to),
        fails_at,
        error: None,
        unobserved: false,
        holds_again: Vec::new(),
        resolution: Some(0.25 * holds_to),
        margins: Vec::new(),
    }
}

/// Delays grow and an expectation holds again; the voltage falls, and one holds to its end.
fn result() -> RadiusResult {
    let mut upright = radius("upright", 4e-3, Some(5e-3));
    upright.holds_again = vec![6e-3];
    let delay = AxisResult {
        name: "delay".to_owned(),
        about: "delay of frames".to_owned(),
        keys: vec!["bus.delay".to_owned()],
        unit: Unit::Second,
        nominal: 1e-3,
        limit: 9e-3,
        end: AxisEnd::Refused {
            to: 7e-3,
            from: 8e-3,
            reason: "too late".to_owned(),
        },
        first: vec!["fast".to_owned()],
        expectations: vec![upright, radius("fast", 2e-3, Some(3e-3))],
        tested: vec![1e-3; 11],
        exhausted: false,
    };
    let voltage = AxisResult {
        name: "voltage".to_owned(),
        about: "voltage of the supply".to_owned(),
        keys: vec!["supply".to_owned()],
        unit: Unit::Volt,
        nominal: 12.0,
        limit: 6.0,
        end: AxisEnd::Limit,
        first: vec!["fast".to_owned(), "upright".to_owned()],
        expectations: vec![radius("upright", 9.0, Some(8.0)), radius("fast", 6.0, None)],
        tested: vec![12.0; 13],
        exhausted: false,
    };
    RadiusResult {
        scenario: "trot".to_owned(),
        file: "trot.toml".to_owned(),
        build: String::new(),
        settings: Vec::new(),
        precision: 0.1,
        axes: vec![delay, voltage],
        left_out: Vec::new(),
    }
}

#[test]
fn radii_are_those_of_their_axis_and_expectation() {
    assert_eq!(
        rows(&radii(&result())),
        [
            "expectation | delay | voltage",
            "*undisturbed* | 1 ms | 12 V",
            r"upright | 4 ms\* | **9 V**",
            "fast | **2 ms** | **≤ 6 V**",
        ]
    );
    // The only one that is not monotone.
    let html = radii(&result()).html();
    assert_eq!(html.matches("class=\"doubtful\"").count(), 1);
    let headline = headline(&result());
    assert_eq!(
        headline,
        "3 radii along 2 axes; 1 times an expectation holds up to the end of the axis."
    );
}

#[test]
fn axes_have_their_values_below_their_heads() {
    assert_eq!(
        rows(&first(&result())),
        [
            "axis | undisturbed | holds to | fails at | first to fail | axis ends at",
            "delay | 1 ms | 2 ms | 3 ms | fast | 7 ms (not valid beyond: too late)",
            "voltage | 12 V | 9 V | 8 V | fast, and 1 more | 6 V",
        ]
    );
    assert_cards(
        &cards(&result()),
        [
            ["delay", "2 ms", "fast"],
            ["voltage", "≤ 6 V", "fast and 1 more"],
        ],
    );
}
