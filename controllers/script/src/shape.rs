//! Shapes of commands.

use std::f64::consts::TAU;
use std::str::FromStr;

use crate::ScriptError;

/// Periodic or transient function of the number of cycles, with values from −1 to 1: the command is
/// offset + amplitude · value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Shape {
    /// Constant 0.
    #[default]
    Hold,
    /// Linear from 0 to 1 in the first cycle; 0 before and 1 afterwards.
    Ramp,
    /// Sine: 0, 1, 0, −1 at the quarters of a cycle.
    Sine,
    /// Linear interpolation between the quarters of the sine.
    Triangle,
    /// 1 in the first half of a cycle, −1 in the second.
    Steps,
}

impl Shape {
    /// All shapes.
    pub const ALL: [Self; 5] = [
        Self::Hold,
        Self::Ramp,
        Self::Sine,
        Self::Triangle,
        Self::Steps,
    ];

    /// Name in scenarios.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Hold => "hold",
            Self::Ramp => "ramp",
            Self::Sine => "sine",
            Self::Triangle => "triangle",
            Self::Steps => "steps",
        }
    }

    /// Value after `cycles` \[1\], which is negative before the start. In `[-1, 1]` if `cycles` is
    /// finite.
    ///
    /// ```
    /// use twinrig_script::Shape;
    /// let quarters = [0.0, 0.25, 0.5, 0.75];
    /// assert_eq!(quarters.map(|cycles| Shape::Triangle.at(cycles)), [0.0, 1.0, 0.0, -1.0]);
    /// assert_eq!([-1.0, 0.5, 7.0].map(|cycles| Shape::Ramp.at(cycles)), [0.0, 0.5, 1.0]);
    /// ```
    pub fn at(self, cycles: f64) -> f64 {
        let turn = cycles - cycles.floor();
        match self {
            Self::Hold => 0.0,
            Self::Ramp => cycles.clamp(0.0, 1.0),
            Self::Sine => libm::sin(TAU * turn),
            Self::Triangle if turn < 0.25 => 4.0 * turn,
            Self::Triangle if turn < 0.75 => 2.0 - 4.0 * turn,
            Self::Triangle => 4.0 * turn - 4.0,
            // A tiny negative number of cycles rounds up to a full cycle, i.e. the start of one.
            Self::Steps if (0.5..1.0).contains(&turn) => -1.0,
            Self::Steps => 1.0,
        }
    }
}

impl FromStr for Shape {
    type Err = ScriptError;

    fn from_str(name: &str) -> Result<Self, ScriptError> {
        let mut shapes = Self::ALL.into_iter();
        shapes
            .find(|shape| shape.name() == name)
            .ok_or_else(|| ScriptError::UnknownShape {
                name: name.to_owned(),
                known: Self::ALL.map(Self::name).join(", "),
            })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn shapes() -> impl Strategy<Value = Shape> {
        prop::sample::select(Shape::ALL.to_vec())
    }

    #[test]
    fn names_parse_back_and_an_unknown_name_lists_the_known_ones() {
        for shape in Shape::ALL {
            assert_eq!(shape.name().parse(), Ok(shape));
        }
        let error = "square".parse::<Shape>().unwrap_err().to_string();
        assert!(
            error.contains("hold, ramp, sine, triangle, steps"),
            "{error}"
        );
    }

    #[test]
    fn shapes_have_the_expected_values_at_eighths_of_a_cycle() {
        let at = |shape: Shape| [0.0, 0.125, 0.25, 0.5, 0.625, 0.75, 1.0].map(|n| shape.at(n));
        assert_eq!(at(Shape::Hold), [0.0; 7]);
        assert_eq!(at(Shape::Ramp), [0.0, 0.125, 0.25, 0.5, 0.625, 0.75, 1.0]);
        assert_eq!(at(Shape::Triangle), [0.0, 0.5, 1.0, 0.0, -0.5, -1.0, 0.0]);
        assert_eq!(at(Shape::Steps), [1.0, 1.0, 1.0, -1.0, -1.0, -1.0, 1.0]);
        let root = std::f64::consts::FRAC_1_SQRT_2;
        for (found, expected) in at(Shape::Sine)
            .into_iter()
            .zip([0.0, root, 1.0, 0.0, -root, -1.0, 0.0])
        {
            assert!((found - expected).abs() < 1e-15, "{found} {expected}");
        }
    }

    proptest! {
        #[test]
        fn values_stay_within_one(shape in shapes(), cycles in prop_oneof![-1e9..1e9_f64, -1e-15..1e-15_f64]) {
            prop_assert!(shape.at(cycles).abs() <= 1.0);
        }

        #[test]
        fn all_shapes_but_the_ramp_are_periodic(shape in shapes(), eighth in 0..8_u32, cycle in -9..9_i32) {
            prop_assume!(shape != Shape::Ramp);
            let turn = f64::from(eighth) / 8.0;
            prop_assert_eq!(shape.at(turn), shape.at(turn + f64::from(cycle)));
        }

        #[test]
        fn continuous_shapes_do_not_jump(shape in prop::sample::select(vec![Shape::Hold, Shape::Ramp, Shape::Sine, Shape::Triangle]),
                             cycles in -3.0..3.0_f64, further in 0.0..1e-3_f64) {
            let jump = (shape.at(cycles + further) - shape.at(cycles)).abs();
            prop_assert!(jump <= TAU * further + 1e-12, "{jump}");
        }
    }
}
