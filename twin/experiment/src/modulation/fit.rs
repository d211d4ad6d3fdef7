//! Least-squares models of a displacement d by the number n of the footstep and the change Δ.

use serde::Serialize;

use crate::plants::ensemble::interval::{CONFIDENCE, quantile};

/// Displacement of one footstep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sample {
    /// Change of the variable.
    pub(crate) by: f64,
    /// Number of the footstep after the change.
    pub(crate) step: usize,
    /// Point of the cycle: runs of one point start from the same state.
    pub(crate) point: usize,
    /// \[m\]
    pub(crate) along_m: f64,
}

/// Form of a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum ModelForm {
    /// d = k n Δ.
    #[serde(rename = "k n Δ")]
    Bilinear,
    /// d = k n Δ + c.
    #[serde(rename = "k n Δ + c")]
    BilinearWithConstant,
    /// d = (k n + k₀) Δ: the first step differs from the later ones.
    #[serde(rename = "(k n + k₀) Δ")]
    BilinearWithFirstStep,
}

impl ModelForm {
    /// All forms.
    pub const ALL: [Self; 3] = [
        Self::Bilinear,
        Self::BilinearWithConstant,
        Self::BilinearWithFirstStep,
    ];

    /// Returns the formula.
    pub fn formula(self) -> &'static str {
        match self {
            Self::Bilinear => "k n Δ",
            Self::BilinearWithConstant => "k n Δ + c",
            Self::BilinearWithFirstStep => "(k n + k₀) Δ",
        }
    }

    fn parameters(self) -> f64 {
        match self {
            Self::Bilinear => 1.0,
            Self::BilinearWithConstant | Self::BilinearWithFirstStep => 2.0,
        }
    }

    fn regressors(self, sample: &Sample) -> [f64; 2] {
        let product = sample.step as f64 * sample.by;
        match self {
            Self::Bilinear => [product, 0.0],
            Self::BilinearWithConstant => [product, 1.0],
            Self::BilinearWithFirstStep => [product, sample.by],
        }
    }
}

/// Fitted model.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LinearModel {
    /// Form.
    pub form: ModelForm,
    /// Displacement per footstep and unit of the change, k.
    pub slope: f64,
    /// 95 % confidence interval of k; none with fewer than two points of the cycle. Errors of runs
    /// that change at the same point are taken as dependent.
    pub interval: Option<[f64; 2]>,
    /// Second parameter: c \[m\] or k₀; 0 if the form has none.
    pub second: f64,
    /// Share of the variance of the displacements that the model explains.
    pub r_squared: f64,
}

impl LinearModel {
    /// Fits the model; none if the samples do not determine it.
    pub(crate) fn fit(form: ModelForm, samples: &[Sample]) -> Option<Self> {
        let mut normal = [[0.0; 2]; 2];
        let mut right = [0.0; 2];
        for sample in samples {
            let x = form.regressors(sample);
            for row in 0..2 {
                for column in 0..2 {
                    normal[row][column] += x[row] * x[column];
                }
                right[row] += x[row] * sample.along_m;
            }
        }
        let inverse = inverse(normal)?;
        let [slope, second] = times(inverse, right);
        let error = |sample: &Sample| {
            let [first, other] = form.regressors(sample);
            sample.along_m - slope * first - second * other
        };
        let mean = samples.iter().map(|it| it.along_m).sum::<f64>() / samples.len() as f64;
        let total = samples.iter().map(|it| square(it.along_m - mean));
        let total: f64 = total.sum();
        let residual: f64 = samples.iter().map(|it| square(error(it))).sum();
        let half = half_width(form, samples, inverse, &error);
        Some(Self {
            form,
            slope,
            interval: half.map(|half| [slope - half, slope + half]),
            second,
            r_squared: (total > 0.0).then(|| 1.0 - residual / total)?,
        })
    }
}

/// Returns half the width of the confidence interval of the slope, from the covariance that is
/// robust to dependent errors within a cluster, here a point of the cycle.
fn half_width(
    form: ModelForm,
    samples: &[Sample],
    inverse: [[f64; 2]; 2],
    error: &dyn Fn(&Sample) -> f64,
) -> Option<f64> {
    let clusters = samples.iter().map(|sample| sample.point + 1).max()?;
    let mut scores = vec![[0.0; 2]; clusters];
    let mut filled = vec![false; clusters];
    for sample in samples {
        let x = form.regressors(sample);
        let error = error(sample);
        for (score, x) in scores[sample.point].iter_mut().zip(x) {
            *score += x * error;
        }
        filled[sample.point] = true;
    }
    let count = filled.iter().filter(|filled| **filled).count() as f64;
    if count < 2.0 {
        return None;
    }
    let squares = scores.iter().map(|score| square(times(inverse, *score)[0]));
    // The usual correction for few clusters.
    let (all, parameters) = (samples.len() as f64, form.parameters());
    let correction = count / (count - 1.0) * (all - 1.0) / (all - parameters);
    let variance = correction * squares.sum::<f64>();
    Some(quantile(0.5 * (1.0 + CONFIDENCE), count - 1.0) * variance.sqrt())
}

/// Returns the squared correlation of the displacement with the change; none without spread.
pub(crate) fn correlation_squared(samples: &[Sample]) -> Option<f64> {
    let count = samples.len() as f64;
    let mean = |of: &dyn Fn(&Sample) -> f64| samples.iter().map(of).sum::<f64>() / count;
    let (x, y) = (mean(&|it| it.by), mean(&|it| it.along_m));
    let xx = mean(&|it| square(it.by - x));
    let yy = mean(&|it| square(it.along_m - y));
    let xy = mean(&|it| (it.by - x) * (it.along_m - y));
    (xx > 0.0 && yy > 0.0).then(|| xy * xy / (xx * yy))
}

/// Returns the inverse of a symmetric matrix whose second row may be empty.
fn inverse([[a, b], [_, d]]: [[f64; 2]; 2]) -> Option<[[f64; 2]; 2]> {
    if d == 0.0 {
        return (a > 0.0).then(|| [[1.0 / a, 0.0], [0.0, 0.0]]);
    }
    let determinant = a * d - b * b;
    let positive = determinant > 1e-12 * a * d;
    positive.then(|| {
        [
            [d / determinant, -b / determinant],
            [-b / determinant, a / determinant],
        ]
    })
}

fn times([[a, b], [c, d]]: [[f64; 2]; 2], [x, y]: [f64; 2]) -> [f64; 2] {
    [a * x + b * y, c * x + d * y]
}

fn square(value: f64) -> f64 {
    value * value
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `statsmodels.api.OLS(d, x).fit(cov_type="cluster", cov_kwds={"groups": points}, use_t=True)`
    /// of statsmodels 0.15.0, clusters being the points.
    #[test]
    fn models_and_intervals_are_those_of_statsmodels() {
        let displacements = [
            [-0.013, -0.034, -0.031, -0.066],
            [-0.010, -0.029, -0.024, -0.063],
            [-0.016, -0.038, -0.033, -0.071],
        ];
        let sample = |point: usize, place: usize| Sample {
            by: [-0.01, -0.02][place / 2],
            step: 1 + place % 2,
            point,
            along_m: displacements[point][place],
        };
        let samples: Vec<Sample> = (0..12).map(|n| sample(n / 4, n % 4)).collect();
        let expected = [
            [
                1.622_666_666_666_666_5,
                0.0,
                1.254_835_291_947_325_8,
                1.990_498_041_386_007_2,
                0.955_218_070_748_685_9,
            ],
            [
                1.782_456_140_350_877,
                0.004_438_596_491_228_082,
                1.686_142_313_325_094,
                1.878_769_967_376_66,
                0.964_790_154_103_827_5,
            ],
            [
                1.906_666_666_666_666_7,
                -0.473_333_333_333_334_05,
                1.709_390_052_041_247_5,
                2.103_943_281_292_085_7,
                0.969_541_128_001_136_6,
            ],
        ];
        for (form, expected) in ModelForm::ALL.into_iter().zip(expected) {
            let model = LinearModel::fit(form, &samples).unwrap();
            let [low, high] = model.interval.unwrap();
            let found = [model.slope, model.second, low, high, model.r_squared];
            for (found, expected) in found.into_iter().zip(expected) {
                assert!(
                    (found - expected).abs() < 1e-10,
                    "{form:?}: {found} {expected}"
                );
            }
        }
        let one_point: Vec<Sample> = samples.into_iter().filter(|it| it.point == 0).collect();
        let model = LinearModel::fit(ModelForm::Bilinear, &one_point).unwrap();
        assert_eq!(model.interval, None);
        assert_eq!(LinearModel::fit(ModelForm::Bilinear, &[]), None);
    }
}
