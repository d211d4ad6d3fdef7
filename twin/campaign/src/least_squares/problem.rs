use thiserror::Error;

/// Model whose residuals are to be small.
pub trait Residuals: Sync {
    /// Returns the residuals at a point, always as many, each divided by its standard deviation;
    /// none where the model has no result.
    fn at(&self, point: &[f64]) -> Option<Vec<f64>>;
}

impl<F: Fn(&[f64]) -> Option<Vec<f64>> + Sync> Residuals for F {
    fn at(&self, point: &[f64]) -> Option<Vec<f64>> {
        self(point)
    }
}

/// Cost of a residual.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Loss {
    /// Half its square.
    Square,
    /// Half its square for small residuals, its magnitude for large ones: c² (√(1 + r²/c²) − 1)
    /// (pseudo-Huber), with c in standard deviations.
    Huber(f64),
}

impl Loss {
    /// Returns the cost of a residual.
    pub fn cost(self, residual: f64) -> f64 {
        match self {
            Self::Square => 0.5 * residual * residual,
            Self::Huber(c) => {
                let ratio = residual / c;
                c * c * ((1.0 + ratio * ratio).sqrt() - 1.0)
            }
        }
    }

    /// Returns the weight of a residual: the slope of its cost over the residual.
    pub fn weight(self, residual: f64) -> f64 {
        match self {
            Self::Square => 1.0,
            Self::Huber(c) => {
                let ratio = residual / c;
                1.0 / (1.0 + ratio * ratio).sqrt()
            }
        }
    }
}

/// Settings of a minimisation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeastSquares {
    /// Cost of a residual.
    pub loss: Loss,
    /// Greatest number of steps.
    pub iterations: usize,
    /// Step, as a share of the ranges, at which the minimum is found.
    pub tolerance: f64,
    /// Greatest step of differences, as a share of the ranges.
    pub difference: f64,
    /// Threads, without influence on the result.
    pub threads: usize,
}

/// Reason why there is no minimum.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum Failure {
    /// The model has no result at the start.
    #[error("the model has no result at the start of the fit")]
    Start,
    /// The model has no result beside a point, so that its derivative is not known.
    #[error("the model has no result beside a point of the fit, by parameter {parameter}")]
    Derivative {
        /// Index of the parameter.
        parameter: usize,
    },
    /// The threads could not be started.
    #[error("cannot start threads: {0}")]
    Threads(String),
    /// The caller or an interrupt ended it.
    #[error("interrupted after {0} steps")]
    Interrupted(usize),
}
