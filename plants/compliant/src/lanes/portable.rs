//! Lanes in two registers of 128 bits, or four scalars.

use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use wide::f64x4;

use super::{Entry, Kernel, LANES, Lanes, Quad, Simd, Task};

/// Name of the registers.
pub(super) const NAME: &str = if cfg!(target_arch = "x86_64") {
    "sse2"
} else if cfg!(target_arch = "aarch64") {
    "neon"
} else {
    "portable"
};

/// Lanes of every processor.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Portable;

/// Four numbers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Numbers(f64x4);

pub(super) fn dispatch<K: Kernel>(kernel: K) -> K::Output {
    let simd = Portable;
    simd.call(Entry { kernel, simd })
}

impl Simd for Portable {
    type Lanes = Numbers;

    const ARE_WIDE: bool = false;

    #[inline(always)]
    fn splat(self, value: f64) -> Numbers {
        Numbers(f64x4::splat(value))
    }

    #[inline(always)]
    fn load(self, quad: Quad) -> Numbers {
        Numbers(f64x4::new(quad.0))
    }

    #[inline(never)]
    fn call<T: Task>(self, task: T) -> T::Output {
        task.run()
    }
}

impl Lanes for Numbers {
    type Mask = f64x4;

    #[inline(always)]
    fn like(self, value: f64) -> Self {
        Self(f64x4::splat(value))
    }

    #[inline(always)]
    fn quad(self) -> Quad {
        Quad(self.0.to_array())
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.sqrt())
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.abs())
    }

    #[inline(always)]
    fn gt(self, other: Self) -> f64x4 {
        self.0.simd_gt(other.0)
    }

    #[inline(always)]
    fn or(self, mask: f64x4, other: Self) -> Self {
        Self(mask.bitselect(self.0, other.0))
    }

    #[inline(always)]
    fn any(self, mask: f64x4) -> bool {
        mask.any()
    }

    #[inline(always)]
    fn sums(of: [Self; LANES]) -> Self {
        let sum = |[a, b, c, d]: [f64; LANES]| (a + b) + (c + d);
        Self(f64x4::new(of.map(|numbers| sum(numbers.0.to_array()))))
    }
}

impl Neg for Numbers {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

macro_rules! operators {
    ($($operator:ident $method:ident),*) => {$(
        impl $operator for Numbers {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(self.0.$method(other.0))
            }
        }

        impl $operator<f64> for Numbers {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: f64) -> Self {
                Self(self.0.$method(f64x4::splat(other)))
            }
        }
    )*};
}

operators!(Add add, Sub sub, Mul mul, Div div);

impl AddAssign for Numbers {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Numbers {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}
