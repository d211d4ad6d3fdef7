//! Interpolation between the samples of a trace.

/// Interpolation stencil: four neighbouring samples and their weights.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stencil {
    pub(crate) first: usize,
    weights: [f64; 4],
}

impl Stencil {
    /// The stencil of a single sample.
    pub(crate) fn at(n: usize) -> Self {
        Self {
            first: n,
            weights: [1.0, 0.0, 0.0, 0.0],
        }
    }

    /// Lagrange's cubic through the samples around `at_s`; `None` beyond the last sample.
    pub(crate) fn between(times: &[f64], at_s: f64) -> Option<Self> {
        let count = times.len();
        if count < 4 || at_s > times[count - 1] * (1.0 + 1e-12) {
            return None;
        }
        let spacing = times[1] - times[0];
        let after = times.partition_point(|&time| time <= at_s);
        let first = after.saturating_sub(2).min(count - 4);
        let x = (at_s - times[first]) / spacing;
        let weight = |n: usize| {
            let others = (0..4).filter(|&m| m != n);
            others
                .map(|m| (x - m as f64) / (n as f64 - m as f64))
                .product()
        };
        Some(Self {
            first,
            weights: [weight(0), weight(1), weight(2), weight(3)],
        })
    }

    pub(crate) fn of(&self, value: impl Fn(usize) -> [f64; 3]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (n, &weight) in self.weights.iter().enumerate() {
            if weight != 0.0 {
                let value = value(self.first + n);
                for (sum, value) in sum.iter_mut().zip(value) {
                    *sum += weight * value;
                }
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cubic_is_interpolated_exactly_up_to_the_last_sample() {
        let times: Vec<f64> = (0..8).map(|n| 0.5 * f64::from(n)).collect();
        let cubic = |x: f64| 1.0 - 2.0 * x + x * x * x;
        for at in [0.0, 0.1, 0.7, 2.3, 3.4, 3.5] {
            let stencil = Stencil::between(&times, at).unwrap();
            let [value, ..] = stencil.of(|n| [cubic(times[n]), 0.0, 0.0]);
            assert!((value - cubic(at)).abs() < 1e-12, "{at}: {value}");
        }
        assert!(Stencil::between(&times, 3.6).is_none());
    }
}
