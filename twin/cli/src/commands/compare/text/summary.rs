//! Summary of the difference between two runs at their end.

use super::super::EventDifference;
use twinrig_kernel::signal;
use twinrig_report::number::{plain, precise, si};

/// Distances below this are negligible \[m\].
const NEGLIGIBLE: f64 = 1e-9;

impl EventDifference {
    /// Returns the summary, such as `b is 8.34 m behind at 20 s (9.7 m against 18); 290 of 290
    /// footsteps are pairs; touch-downs within 40 ms`; none without a trunk position and footsteps.
    pub(super) fn summary(&self) -> Option<String> {
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
            parts.push(format!("touch-downs within {}", si(most.abs(), "s")));
        }
        (!parts.is_empty()).then(|| parts.join("; "))
    }

    /// Returns the final position of b relative to a.
    fn place(&self) -> Option<String> {
        let component = |component: usize| {
            let mut all = self.signals.iter();
            let found =
                all.find(|of| of.signal == signal::BODY_POSITION && of.component == component);
            found.and_then(|of| Some((of.ends_at_s?[1], of.ends_a?, of.ends_b?)))
        };
        let ((at, a_x, b_x), (_, a_y, b_y)) = (component(0)?, component(1)?);
        let relative = relative_position(
            [[a_x[0], a_y[0]], [a_x[1], a_y[1]]],
            [[b_x[0], b_y[0]], [b_x[1], b_y[1]]],
        );
        relative
            .map(|(place, distances)| format!("b is {place} at {}{distances}", precise(at, "s")))
    }
}

/// Returns the final position of b relative to a, along or across the displacement of a, and the
/// displacements of both along this direction; from the initial and final positions in the ground
/// plane \[m\]. None if both are at rest at the same place or a position is not finite.
fn relative_position(a: [[f64; 2]; 2], b: [[f64; 2]; 2]) -> Option<(String, String)> {
    let less = |to: [f64; 2], from: [f64; 2]| [to[0] - from[0], to[1] - from[1]];
    let (path_a, path_b, apart) = (less(a[1], a[0]), less(b[1], b[0]), less(b[1], a[1]));
    let length = |of: [f64; 2]| libm::hypot(of[0], of[1]);
    let distance = length(path_a);
    if !length(apart).is_finite() || length(apart).max(distance) < NEGLIGIBLE {
        return None;
    }
    if distance < NEGLIGIBLE {
        return Some((format!("{} away", si(length(apart), "m")), String::new()));
    }
    let ahead = |of: [f64; 2]| (of[0] * path_a[0] + of[1] * path_a[1]) / distance;
    let left = (path_a[0] * apart[1] - path_a[1] * apart[0]) / distance;
    let along = ahead(apart);
    let (by, side) = match (left.abs() > along.abs(), along < 0.0, left < 0.0) {
        (true, _, false) => (left, "to the left"),
        (true, _, true) => (left, "to the right"),
        (false, true, _) => (along, "behind"),
        (false, false, _) => (along, "ahead"),
    };
    if by.abs() < NEGLIGIBLE {
        return Some(("at the position of a".to_owned(), String::new()));
    }
    let distances = format!(" ({} m against {})", plain(ahead(path_b)), plain(distance));
    Some((format!("{} {side}", si(by.abs(), "m")), distances))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn relative_position_refers_to_displacement_of_first_run() {
        let of = |a: [f64; 2], b: [f64; 2]| relative_position([[0.0; 2], a], [[0.0; 2], b]);
        let words = |side: &str, distances: &str| Some((side.to_owned(), distances.to_owned()));
        let behind = of([18.1, 0.0], [9.76, 0.0]);
        assert_eq!(behind, words("8.34 m behind", " (9.76 m against 18.1)"));
        // Independent of the direction of walking.
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
        assert_eq!(
            of([1.0, 0.0], [1.0, 0.0]),
            words("at the position of a", "")
        );
        assert_eq!(of([0.0; 2], [0.0, 0.02]), words("20 mm away", ""));
        assert_eq!(of([0.0; 2], [0.0; 2]), None);
        assert_eq!(of([1.0, 0.0], [f64::NAN, 0.0]), None);
    }
}
