//! Lanes in a register of 256 bits, for processors with AVX2.

use core::arch::x86_64::{__m256d, _CMP_GT_OQ};
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use pulp::x86::V3;
use pulp::{NullaryFnOnce, cast};

use super::{Entry, Kernel, LANES, Lanes, Quad, Simd, Task, portable};

/// Four numbers, with the proof that the processor has the registers.
#[derive(Debug, Clone, Copy)]
pub(super) struct Numbers {
    v3: V3,
    v: __m256d,
}

/// A processor with AVX2.
#[derive(Debug, Clone, Copy)]
pub(super) struct Avx2(V3);

pub(super) fn is_available() -> bool {
    V3::try_new().is_some()
}

pub(super) fn dispatch<K: Kernel>(kernel: K) -> K::Output {
    let Some(simd) = V3::try_new().map(Avx2) else {
        return portable::dispatch(kernel);
    };
    simd.call(Entry { kernel, simd })
}

/// A task, in the form that `pulp` runs.
struct Vectorized<T>(T);

impl<T: Task> NullaryFnOnce for Vectorized<T> {
    type Output = T::Output;

    #[inline(always)]
    fn call(self) -> T::Output {
        self.0.run()
    }
}

impl Simd for Avx2 {
    type Lanes = Numbers;

    const ARE_WIDE: bool = true;

    #[inline(always)]
    fn splat(self, value: f64) -> Numbers {
        let v = self.0.avx._mm256_set1_pd(value);
        Numbers { v3: self.0, v }
    }

    #[inline(always)]
    fn load(self, quad: Quad) -> Numbers {
        let v = cast(quad.0);
        Numbers { v3: self.0, v }
    }

    #[inline(always)]
    fn call<T: Task>(self, task: T) -> T::Output {
        self.0.vectorize(Vectorized(task))
    }
}

impl Numbers {
    #[inline(always)]
    fn with(self, v: __m256d) -> Self {
        Self { v, ..self }
    }
}

impl Lanes for Numbers {
    type Mask = __m256d;

    #[inline(always)]
    fn like(self, value: f64) -> Self {
        Avx2(self.v3).splat(value)
    }

    #[inline(always)]
    fn quad(self) -> Quad {
        Quad(cast(self.v))
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        self.with(self.v3.avx._mm256_sqrt_pd(self.v))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        let sign = self.v3.avx._mm256_set1_pd(-0.0);
        self.with(self.v3.avx._mm256_andnot_pd(sign, self.v))
    }

    #[inline(always)]
    fn gt(self, other: Self) -> __m256d {
        self.v3.avx._mm256_cmp_pd::<_CMP_GT_OQ>(self.v, other.v)
    }

    #[inline(always)]
    fn or(self, mask: __m256d, other: Self) -> Self {
        self.with(self.v3.avx._mm256_blendv_pd(other.v, self.v, mask))
    }

    #[inline(always)]
    fn any(self, mask: __m256d) -> bool {
        self.v3.avx._mm256_movemask_pd(mask) != 0
    }

    #[inline(always)]
    fn sums(of: [Self; LANES]) -> Self {
        let [a, b, c, d] = of.map(|numbers| numbers.v);
        let avx = of[0].v3.avx;
        // The sums of neighbours: a₀+a₁, b₀+b₁, a₂+a₃, b₂+b₃.
        let (ab, cd) = (avx._mm256_hadd_pd(a, b), avx._mm256_hadd_pd(c, d));
        let low = avx._mm256_permute2f128_pd::<0x20>(ab, cd);
        let high = avx._mm256_permute2f128_pd::<0x31>(ab, cd);
        of[0].with(avx._mm256_add_pd(low, high))
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.with(self.v3.avx._mm256_max_pd(self.v, other.v))
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.with(self.v3.avx._mm256_min_pd(self.v, other.v))
    }
}

impl Neg for Numbers {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        let sign = self.v3.avx._mm256_set1_pd(-0.0);
        self.with(self.v3.avx._mm256_xor_pd(self.v, sign))
    }
}

macro_rules! operators {
    ($($operator:ident $method:ident $instruction:ident),*) => {$(
        impl $operator for Numbers {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.with(self.v3.avx.$instruction(self.v, other.v))
            }
        }

        impl $operator<f64> for Numbers {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: f64) -> Self {
                let other = self.v3.avx._mm256_set1_pd(other);
                self.with(self.v3.avx.$instruction(self.v, other))
            }
        }
    )*};
}

operators!(
    Add add _mm256_add_pd,
    Sub sub _mm256_sub_pd,
    Mul mul _mm256_mul_pd,
    Div div _mm256_div_pd
);

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
