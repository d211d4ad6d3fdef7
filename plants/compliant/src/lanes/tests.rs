use core::f64::consts::FRAC_PI_2;

use proptest::prelude::*;

use super::*;

/// Applies every operation to two quads.
struct Everything([Quad; 2]);

impl Kernel for Everything {
    type Output = Vec<Quad>;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Vec<Quad> {
        let [a, b] = self.0.map(|quad| simd.load(quad));
        let ([sine, _], [cosine, _]) = S::Lanes::sin_cos([a, b]);
        let mut sum = a;
        sum += b;
        sum -= b * 3.0;
        let any = f64::from(u8::from(a.any(a.gt(b))));
        let results = [
            a + b,
            a - b,
            a * b,
            a / b,
            -a,
            a.abs().sqrt(),
            a.max(b),
            a.min(b),
            a.clamp(-b.abs(), b.abs()),
            a.or(a.gt(b), b),
            S::Lanes::sums([a, b, a * b, a - 1.0]),
            (a + 2.0).reciprocal(),
            sine,
            cosine,
            sum,
            simd.splat(any),
        ];
        results.map(S::Lanes::quad).to_vec()
    }
}

fn bits(quads: &[Quad]) -> Vec<[u64; LANES]> {
    quads.iter().map(|quad| quad.0.map(f64::to_bits)).collect()
}

proptest! {
    #[test]
    fn bits_are_those_of_every_processor(
        a in proptest::array::uniform4(-20.0..20.0_f64),
        b in proptest::array::uniform4(-20.0..20.0_f64),
    ) {
        let [a, b] = [a, b].map(Quad);
        let [detected, portable] = [Features::Detected, Features::Portable]
            .map(|features| dispatch(features, Everything([a, b])));
        prop_assert_eq!(bits(&detected), bits(&portable));
        for lane in 0..LANES {
            let (x, y) = (a.0[lane], b.0[lane]);
            prop_assert_eq!(detected[0].0[lane], x + y);
            prop_assert_eq!(detected[3].0[lane], x / y);
            prop_assert_eq!(detected[6].0[lane], f64::max(x, y));
            prop_assert_eq!(detected[8].0[lane], f64::clamp(x, -y.abs(), y.abs()));
            // Two units in the last place of one: the error of libm is below one.
            prop_assert!((detected[12].0[lane] - libm::sin(x)).abs() < 3e-16);
            prop_assert!((detected[13].0[lane] - libm::cos(x)).abs() < 3e-16);
        }
        let [p, q, r, s] = a.0;
        prop_assert_eq!(detected[10].0[0], (p + q) + (r + s));
    }

    #[test]
    fn sine_and_cosine_of_small_angles_are_as_close(
        angles in proptest::array::uniform4(-FRAC_PI_2..=FRAC_PI_2),
    ) {
        let small = dispatch(Features::Detected, Everything([Quad(angles); 2]));
        for (lane, angle) in angles.into_iter().enumerate() {
            prop_assert!((small[12].0[lane] - libm::sin(angle)).abs() < 3e-16);
            prop_assert!((small[13].0[lane] - libm::cos(angle)).abs() < 3e-16);
        }
    }

    #[test]
    fn zeros_and_nan_have_one_maximum(order in 0..16_usize) {
        let values = [0.0, -0.0, f64::NAN, 1.0];
        let a = Quad([values[order % 4]; LANES]);
        let b = Quad([values[order / 4]; LANES]);
        let [detected, portable] = [Features::Detected, Features::Portable]
            .map(|features| dispatch(features, Everything([a, b])));
        // Maximum, minimum and selection; the payload of a NaN from arithmetic is not specified.
        prop_assert_eq!(bits(&detected[6..8]), bits(&portable[6..8]));
        prop_assert_eq!(bits(&detected[9..10]), bits(&portable[9..10]));
    }
}
