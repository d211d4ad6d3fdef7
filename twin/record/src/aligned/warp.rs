//! Map from the time of one run to that of another.

/// Piecewise-linear time map between two runs; the offset is constant before the first knot and
/// after the last.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Warp {
    knots: Vec<[f64; 2]>,
}

impl Warp {
    /// The identity map.
    pub(super) fn none() -> Self {
        Self { knots: Vec::new() }
    }

    /// Creates the map through pairs of corresponding instants \[s\]. A pair that would make the
    /// map non-monotonic is omitted.
    pub(super) fn through(knots: impl IntoIterator<Item = [f64; 2]>) -> Self {
        let mut rising: Vec<[f64; 2]> = Vec::new();
        for knot in knots {
            let last = rising.last();
            if last.is_none_or(|last| knot[0] > last[0] && knot[1] > last[1]) {
                rising.push(knot);
            }
        }
        Self { knots: rising }
    }

    /// Returns the time in the second run that corresponds to `at` in the first. `cursor` is the
    /// knot at which the search begins: 0, or its value after a call with an earlier time.
    pub(super) fn at(&self, at: f64, cursor: &mut usize) -> f64 {
        let (Some(first), Some(last)) = (self.knots.first(), self.knots.last()) else {
            return at;
        };
        if at <= first[0] {
            return at + (first[1] - first[0]);
        }
        if at >= last[0] {
            return at + (last[1] - last[0]);
        }
        while self
            .knots
            .get(*cursor + 1)
            .is_some_and(|knot| knot[0] <= at)
        {
            *cursor += 1;
        }
        let ([a, b], [c, d]) = (self.knots[*cursor], self.knots[*cursor + 1]);
        b + (at - a) * ((d - b) / (c - a))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn map_is_linear_between_knots_and_monotonic() {
        let warp = Warp::through([[0.0, 0.0], [1.0, 1.5], [1.2, 1.4], [2.0, 2.0]]);
        let mut cursor = 0;
        let of: Vec<f64> = [-1.0, 0.5, 1.0, 1.5, 2.0, 3.0]
            .into_iter()
            .map(|at| warp.at(at, &mut cursor))
            .collect();
        assert_eq!(of, [-1.0, 0.75, 1.5, 1.75, 2.0, 3.0]);
        assert_eq!(Warp::none().at(0.3, &mut 0), 0.3);
    }
}
