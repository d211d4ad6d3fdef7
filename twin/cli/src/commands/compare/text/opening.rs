//! How far two runs are apart in the end, in a sentence.

use super::super::EventDifference;
use super::figures::{figure, quantity, three};

/// Ways and differences below this are none \[m\].
const STILL: f64 = 1e-9;

impl EventDifference {
    /// `b is 8.34 m behind at 20 s (9.7 m against 18); 290 of 290 footsteps are pairs; touch-downs within 40 ms`; none if
    /// there is neither a trunk nor a footstep.
    pub(super) fn opening(&self) -> Option<String> {
        let of = &self.footsteps;
        let mut parts: Vec<String> = self.place().into_iter().collect();
        if of.a + of.b > 0 {
            parts.push(format!(
                "{} of {} footsteps are pairs",
                of.pairs,
                of.a.max(of.b)
            ));
        }
        if let Some(most) = of.touch_down.max {
            parts.push(format!("touch-downs within {}", quantity(most.abs(), "s")));
        }
        (!parts.is_empty()).then(|| parts.join("; "))
    }

    /// Where b is in the end, seen from a.
    fn place(&self) -> Option<String> {
        let component = |component: usize| {
            let mut all = self.signals.iter();
            let found = all.find(|of| of.signal == "body/position" && of.component == component);
            found.and_then(|of| Some((of.ends_at_s?[1], of.ends_a?, of.ends_b?)))
        };
        let ((at, a_x, b_x), (_, a_y, b_y)) = (component(0)?, component(1)?);
        let told = told(
            [[a_x[0], a_y[0]], [a_x[1], a_y[1]]],
            [[b_x[0], b_y[0]], [b_x[1], b_y[1]]],
        );
        told.map(|(where_it_is, ways)| format!("b is {where_it_is} at {} s{ways}", figure(at)))
    }
}

/// Where the second is in the end, along the way that the first has gone or across it, and how far both have gone along that
/// way; from where they begin and end on the ground \[m\]. None where neither has gone anywhere.
fn told(a: [[f64; 2]; 2], b: [[f64; 2]; 2]) -> Option<(String, String)> {
    let less = |to: [f64; 2], from: [f64; 2]| [to[0] - from[0], to[1] - from[1]];
    let (way_a, way_b, apart) = (less(a[1], a[0]), less(b[1], b[0]), less(b[1], a[1]));
    let length = |of: [f64; 2]| libm::hypot(of[0], of[1]);
    let gone = length(way_a);
    if !length(apart).is_finite() || length(apart).max(gone) < STILL {
        return None;
    }
    if gone < STILL {
        return Some((
            format!("{} away", quantity(length(apart), "m")),
            String::new(),
        ));
    }
    let ahead = |of: [f64; 2]| (of[0] * way_a[0] + of[1] * way_a[1]) / gone;
    let left = (way_a[0] * apart[1] - way_a[1] * apart[0]) / gone;
    let along = ahead(apart);
    let (by, side) = match (left.abs() > along.abs(), along < 0.0, left < 0.0) {
        (true, _, false) => (left, "to the left"),
        (true, _, true) => (left, "to the right"),
        (false, true, _) => (along, "behind"),
        (false, false, _) => (along, "ahead"),
    };
    if by.abs() < STILL {
        return Some(("where a is".to_owned(), String::new()));
    }
    let ways = format!(" ({} m against {})", three(ahead(way_b)), three(gone));
    Some((format!("{} {side}", quantity(by.abs(), "m")), ways))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn where_it_is_goes_by_the_way_of_the_first() {
        let of = |a: [f64; 2], b: [f64; 2]| told([[0.0; 2], a], [[0.0; 2], b]);
        let words = |side: &str, ways: &str| Some((side.to_owned(), ways.to_owned()));
        let behind = of([18.1, 0.0], [9.76, 0.0]);
        assert_eq!(behind, words("8.34 m behind", " (9.76 m against 18.1)"));
        // The same whichever way it walks.
        assert_eq!(of([0.0, -18.1], [0.0, -9.76]), behind);
        assert_eq!(
            of([1.0, 0.0], [1.02, 0.0]),
            words("20 mm ahead", " (1.02 m against 1)")
        );
        assert_eq!(
            of([1.0, 0.0], [1.0, 0.5]),
            words("500 mm to the left", " (1 m against 1)")
        );
        assert_eq!(
            of([-1.0, 0.0], [-1.0, 0.5]),
            words("500 mm to the right", " (1 m against 1)")
        );
        assert_eq!(of([1.0, 0.0], [1.0, 0.0]), words("where a is", ""));
        assert_eq!(of([0.0; 2], [0.0, 0.02]), words("20 mm away", ""));
        assert_eq!(of([0.0; 2], [0.0; 2]), None);
        assert_eq!(of([1.0, 0.0], [f64::NAN, 0.0]), None);
    }
}
