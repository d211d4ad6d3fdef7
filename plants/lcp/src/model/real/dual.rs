use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use super::Real;

/// A number and its derivative in one direction.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Dual<R> {
    pub(crate) value: R,
    pub(crate) slope: R,
}

impl<R: Real> Real for Dual<R> {
    type Sum = Dual<R::Sum>;

    fn splat(value: f64) -> Self {
        Self {
            value: R::splat(value),
            slope: R::zero(),
        }
    }

    fn sqrt(self) -> Self {
        let value = self.value.sqrt();
        Self {
            value,
            slope: self.slope / (value + value),
        }
    }

    fn sum(self) -> Self::Sum {
        Dual {
            value: self.value.sum(),
            slope: self.slope.sum(),
        }
    }

    fn sin_cos(self) -> (Self, Self) {
        let (sine, cosine) = self.value.sin_cos();
        (
            Self {
                value: sine,
                slope: cosine * self.slope,
            },
            Self {
                value: cosine,
                slope: -(sine * self.slope),
            },
        )
    }

    fn clamped(self, low: Self, high: Self) -> Self {
        // One inside the interval, zero at a limit.
        let value = self.value.clamped(low.value, high.value);
        let within = R::splat(1.0) - (self.value - value).nonzero_mask();
        Self {
            value,
            slope: self.slope * within,
        }
    }

    fn beyond(self, width: Self) -> Self {
        let value = self.value.beyond(width.value);
        let passed = value.nonzero_mask();
        Self {
            value,
            slope: self.slope * passed,
        }
    }

    fn nonzero_mask(self) -> Self {
        Self {
            value: self.value.nonzero_mask(),
            slope: R::zero(),
        }
    }

    fn plain(self) -> f64 {
        self.value.plain()
    }

    fn broadcast(value: Self::Sum) -> Self {
        Self {
            value: R::broadcast(value.value),
            slope: R::broadcast(value.slope),
        }
    }

    fn lane(self, lane: usize) -> Self::Sum {
        Dual {
            value: self.value.lane(lane),
            slope: self.slope.lane(lane),
        }
    }

    fn with_lane(self, lane: usize, value: Self::Sum) -> Self {
        Self {
            value: self.value.with_lane(lane, value.value),
            slope: self.slope.with_lane(lane, value.slope),
        }
    }
}

impl<R: Real> Add for Dual<R> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            slope: self.slope + other.slope,
        }
    }
}

impl<R: Real> Sub for Dual<R> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self {
            value: self.value - other.value,
            slope: self.slope - other.slope,
        }
    }
}

impl<R: Real> Mul for Dual<R> {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self {
            value: self.value * other.value,
            slope: self.value * other.slope + self.slope * other.value,
        }
    }
}

impl<R: Real> Div for Dual<R> {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        Self {
            value,
            slope: (self.slope - value * other.slope) / other.value,
        }
    }
}

impl<R: Real> Neg for Dual<R> {
    type Output = Self;
    fn neg(self) -> Self {
        Self {
            value: -self.value,
            slope: -self.slope,
        }
    }
}

impl<R: Real> AddAssign for Dual<R> {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<R: Real> SubAssign for Dual<R> {
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}
