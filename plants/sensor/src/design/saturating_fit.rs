//! Fit of the linear characteristic with saturation.

use crate::SensorError;

/// Characteristic fitted to measured points (eq. 4.4).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SaturatingFit {
    /// Sensitivity a₁ \[S/N\].
    pub sensitivity: f64,
    /// Base conductance a₂ \[S\].
    pub base: f64,
    /// Conductance of the saturated cell a₃ \[S\]; infinite if no point is saturated.
    pub saturated: f64,
    /// Sum of squared residuals \[S²\].
    pub residual: f64,
    /// Coefficient of determination.
    pub r_squared: f64,
}

impl SaturatingFit {
    /// Conductance at a load \[N\], \[S\].
    pub fn conductance(&self, load: f64) -> f64 {
        clipped(load, self.sensitivity, self.base, self.saturated)
    }

    /// Saturation load (a₃ − a₂)/a₁ (eq. 4.5) \[N\].
    pub fn saturation(&self) -> f64 {
        (self.saturated - self.base) / self.sensitivity
    }
}

fn clipped(load: f64, a1: f64, a2: f64, a3: f64) -> f64 {
    (a1 * load + a2).max(0.0).min(a3)
}

/// Where a bend of the characteristic is.
#[derive(Clone, Copy)]
enum Bend {
    /// Between two points.
    Between,
    /// At a point.
    At(f64),
}

/// Fits eq. 4.4 to points of load \[N\] and conductance \[S\] by least squares.
///
/// The sum of squares is quadratic in the parameters as long as no bend passes a point, so that its
/// minimum is that of one of these quadratics, or of one of them with bends at points. All of them
/// are solved, and the best of the true sums is the global minimum: no start, no iteration. The
/// effort is that of the cube of the number of points.
///
/// # Errors
/// Fewer than four points, a number that is not finite, points without a rise.
pub fn fit_saturating(points: &[(f64, f64)]) -> Result<SaturatingFit, SensorError> {
    let finite = |(load, conductance): &(f64, f64)| load.is_finite() && conductance.is_finite();
    if points.len() < 4 || !points.iter().all(finite) {
        let found = points.len();
        return Err(SensorError::Points { found });
    }
    let mut points = points.to_vec();
    points.sort_by(|one, other| one.0.total_cmp(&other.0));
    let mut best: Option<[f64; 4]> = None;
    for first in 0..points.len() - 1 {
        for end in first + 2..=points.len() {
            for parameters in candidates(&points, first, end).into_iter().flatten() {
                let [a1, a2, a3] = parameters;
                let square = |&(load, conductance): &(f64, f64)| {
                    let error = conductance - clipped(load, a1, a2, a3);
                    error * error
                };
                let sum: f64 = points.iter().map(square).sum();
                if best.is_none_or(|best| sum < best[3]) {
                    best = Some([a1, a2, a3, sum]);
                }
            }
        }
    }
    let [sensitivity, base, saturated, residual] = best.ok_or(SensorError::NoRise)?;
    let mean = points.iter().map(|point| point.1).sum::<f64>() / points.len() as f64;
    let squares = points
        .iter()
        .map(|point| (point.1 - mean) * (point.1 - mean));
    Ok(SaturatingFit {
        sensitivity,
        base,
        saturated,
        residual,
        r_squared: 1.0 - residual / squares.sum::<f64>(),
    })
}

/// Parameters of the quadratics with the line on the points `first..end`, with zeros before and
/// saturation after them: bends between points, or at the last zero or the first saturated point.
fn candidates(points: &[(f64, f64)], first: usize, end: usize) -> [Option<[f64; 3]>; 4] {
    let lower = [
        Some(Bend::Between),
        first.checked_sub(1).map(|last| Bend::At(points[last].0)),
    ];
    let upper = [
        Some(Bend::Between),
        points.get(end).map(|next| Bend::At(next.0)),
    ];
    let both =
        |lower: Option<Bend>, upper: Option<Bend>| quadratic(points, first, end, lower?, upper?);
    [
        both(lower[0], upper[0]),
        both(lower[0], upper[1]),
        both(lower[1], upper[0]),
        both(lower[1], upper[1]),
    ]
}

fn quadratic(
    points: &[(f64, f64)],
    first: usize,
    end: usize,
    lower: Bend,
    upper: Bend,
) -> Option<[f64; 3]> {
    let (line, bend) = match upper {
        Bend::Between => (&points[first..end], f64::INFINITY),
        // Saturated points lie on the line, too: at the load of the bend.
        Bend::At(bend) => (&points[first..], bend),
    };
    let count = line.len() as f64;
    let (mean_load, mean) = match lower {
        Bend::Between => (
            line.iter().map(|point| point.0.min(bend)).sum::<f64>() / count,
            line.iter().map(|point| point.1).sum::<f64>() / count,
        ),
        // A line through a point on the axis.
        Bend::At(zero) => (zero, 0.0),
    };
    let (mut squares, mut products) = (0.0, 0.0);
    for (load, conductance) in line {
        let load = load.min(bend) - mean_load;
        squares += load * load;
        products += load * (conductance - mean);
    }
    let a1 = products / squares;
    // NaN where all loads are equal.
    if !(a1 > 0.0 && a1.is_finite()) {
        return None;
    }
    let a2 = mean - a1 * mean_load;
    let saturated = &points[end..];
    let a3 = match upper {
        Bend::At(bend) => a1 * bend + a2,
        Bend::Between if saturated.is_empty() => f64::INFINITY,
        Bend::Between => {
            saturated.iter().map(|point| point.1).sum::<f64>() / saturated.len() as f64
        }
    };
    Some([a1, a2, a3])
}
