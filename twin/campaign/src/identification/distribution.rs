//! Distribution of fitted parameters, which an overlay states.

use std::fmt::Write as _;

use twinrig_document::{Document, DocumentError, Item, Range, Reported, Table, quoted};
use twinrig_kernel::stream;

use crate::least_squares::{Direction, Information};
use crate::optimization::space::SpaceDimension;
use crate::sweep::SweepValue;
use crate::sweep::read::{DIMENSIONS_MOST, interval};

/// Standard deviation of a direction that the data do not tell, as a share of the ranges: that of
/// an even distribution over a range.
const UNKNOWN: f64 = 0.289;
/// Deviation of the length of a vector from 1 that rounding leaves.
const LENGTH: f64 = 1e-3;

/// Tables of an overlay.
const FIT: &str = "fit";
const PARAMETER: &str = "parameter";
const DIRECTION: &str = "direction";

/// Normal distribution of fitted parameters; values beyond a range are reflected at its end.
#[derive(Clone, Debug, PartialEq)]
pub struct FittedDistribution {
    /// Parameters with their ranges.
    pub dimensions: Vec<SpaceDimension>,
    /// Estimates, as shares of the ranges.
    pub centre: Vec<f64>,
    /// Independent directions, in shares of the ranges.
    pub directions: Vec<Direction>,
}

impl FittedDistribution {
    /// Returns the distribution around a minimum.
    pub fn of(dimensions: &[SpaceDimension], centre: &[f64], information: &Information) -> Self {
        Self {
            dimensions: dimensions.to_vec(),
            centre: centre.to_vec(),
            directions: information.directions.clone(),
        }
    }

    /// Returns the tables of an overlay that [`FittedDistribution::read`] reads.
    pub fn toml(&self) -> String {
        let mut text = String::new();
        for (dimension, share) in self.dimensions.iter().zip(&self.centre) {
            let interval = &dimension.interval;
            let [from, to] = interval.ends().map(|end| end.toml);
            let scale = if interval.logarithmic {
                "scale = \"logarithmic\"\n"
            } else {
                ""
            };
            let key = quoted(&dimension.key.value);
            // Writing to a string cannot fail.
            let _ = write!(
                text,
                "\n[[{FIT}.{PARAMETER}]]\nkey = {key}\nfrom = {from}\nto = {to}\n{scale}\
                 share = {share:.6}\n"
            );
        }
        for direction in &self.directions {
            let vector = direction.vector.iter().map(|share| format!("{share:.6}"));
            let vector: Vec<String> = vector.collect();
            let _ = write!(
                text,
                "\n[[{FIT}.{DIRECTION}]]\nvector = [{}]\n",
                vector.join(", ")
            );
            if direction.is_known() {
                let _ = writeln!(text, "deviation = {:.6e}", direction.deviation);
            }
        }
        text
    }

    /// Reads the distribution of an overlay.
    ///
    /// # Errors
    /// The overlay has none, or it is malformed.
    pub fn read(overlay: &Document) -> Result<Self, DocumentError> {
        overlay.check(|root| {
            root.expect(root.keys());
            root.required(FIT, |item| {
                let fit = &item.table()?;
                fit.expect(fit.keys());
                let parameters = fit.required(PARAMETER, |item| item.each(parameter));
                let directions = fit.required(DIRECTION, |item| item.each(direction));
                let (dimensions, centre): (Vec<_>, Vec<_>) = parameters?.into_iter().unzip();
                let directions = directions?;
                let count = dimensions.len();
                if count > DIMENSIONS_MOST {
                    let message = format!("there are {count} parameters");
                    let help = format!("{DIMENSIONS_MOST} at most");
                    return Err(fit.report(PARAMETER, message, help));
                }
                let is_unit = |it: &Direction| {
                    let square: f64 = it.vector.iter().map(|part| part * part).sum();
                    it.vector.len() == count && (square - 1.0).abs() < LENGTH
                };
                if directions.is_empty() || !directions.iter().all(is_unit) {
                    let message = format!("there are no unit vectors of {count} entries");
                    let help = "`twin fit` writes them, if a parameter is at no bound of its range";
                    return Err(fit.report(DIRECTION, message, help));
                }
                Ok(Self {
                    dimensions,
                    centre,
                    directions,
                })
            })
        })
    }

    /// Returns points: a value for each parameter. The first ones do not depend on their number.
    pub fn points(&self, seed: u64, count: usize) -> Vec<Vec<SweepValue>> {
        let mut numbers = stream(seed, "campaign/design/fitted");
        let draw = |_| {
            let mut point = self.centre.clone();
            for direction in &self.directions {
                let deviation = if direction.is_known() {
                    direction.deviation
                } else {
                    UNKNOWN
                };
                let length = deviation * numbers.normal();
                for (share, part) in point.iter_mut().zip(&direction.vector) {
                    *share += length * part;
                }
            }
            let pairs = self.dimensions.iter().zip(&point);
            pairs
                .map(|(dimension, share)| dimension.interval.legible_at(reflected(*share)))
                .collect()
        };
        (0..count).map(draw).collect()
    }
}

/// Reflects a share at the ends of its range, 0 and 1.
fn reflected(share: f64) -> f64 {
    let within = (0.5 * share).rem_euclid(1.0) * 2.0;
    if within > 1.0 { 2.0 - within } else { within }
}

fn parameter(item: &Item<'_>) -> Result<(SpaceDimension, f64), Reported> {
    let table: &Table<'_> = &item.table()?;
    let key = table.required("key", Item::placed_text);
    let scale = table.optional("scale", |item| {
        item.choice(&[("linear", false), ("logarithmic", true)])
    });
    let share = table.required("share", |item| item.number(&Range::between(0.0, 1.0)));
    let interval = interval(table, None, scale?.unwrap_or_default());
    let dimension = SpaceDimension {
        key: key?,
        interval: interval?,
    };
    Ok((dimension, share?))
}

fn direction(item: &Item<'_>) -> Result<Direction, Reported> {
    let table: &Table<'_> = &item.table()?;
    let vector = table.required("vector", |item| {
        item.each(|item| item.number(&Range::between(-1.0, 1.0)))
    });
    let deviation = table.optional("deviation", |item| item.number(&Range::between(0.0, 1.0)));
    Ok(Direction {
        vector: vector?,
        deviation: deviation?.unwrap_or(f64::INFINITY),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const OVERLAY: &str = "
[fit]
name = 'x'

[[fit.parameter]]
key = 'override.a'
from = '0 m'
to = '10 m'
share = 0.5

[[fit.parameter]]
key = 'override.b'
from = 1
to = 100
scale = 'logarithmic'
share = 0.25

[[fit.direction]]
vector = [0.6, 0.8]
deviation = 0.01

[[fit.direction]]
vector = [-0.8, 0.6]
deviation = 0.04

[values]
a = '5 m'
";

    fn read(text: &str) -> Result<FittedDistribution, DocumentError> {
        FittedDistribution::read(&Document::parse("x.fit.toml", text).unwrap())
    }

    /// Means, variances and covariance of 20 000 draws are those of Σ d² v vᵀ, in metres and in the
    /// logarithm; deviations are within 4 standard errors of a variance, √(2/n).
    #[test]
    fn draws_have_the_covariance_of_the_directions() {
        let distribution = read(OVERLAY).unwrap();
        let count = 20_000;
        let points = distribution.points(1, count);
        let numbers: Vec<[f64; 2]> = points
            .iter()
            .map(|point| {
                let [a, b] = [&point[0], &point[1]].map(|value| value.number.unwrap());
                [a / 10.0 - 0.5, libm::log(b) / libm::log(100.0) - 0.25]
            })
            .collect();
        let mean =
            |of: &dyn Fn(&[f64; 2]) -> f64| numbers.iter().map(of).sum::<f64>() / count as f64;
        let (fine, coarse) = (1e-4, 16e-4);
        let expected = [
            0.36 * fine + 0.64 * coarse,
            0.64 * fine + 0.36 * coarse,
            0.48 * fine - 0.48 * coarse,
        ];
        let found = [
            mean(&|it| it[0] * it[0]),
            mean(&|it| it[1] * it[1]),
            mean(&|it| it[0] * it[1]),
        ];
        let error = 4.0 * (2.0 / count as f64).sqrt() * expected[0];
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < error, "{found} {expected}");
        }
        let error = 4.0 * (expected[0] / count as f64).sqrt();
        assert!(mean(&|it| it[0]).abs() < error && mean(&|it| it[1]).abs() < error);
        // More draws begin with the same ones.
        assert_eq!(distribution.points(1, 7), points[..7]);
        assert_ne!(distribution.points(2, 7), points[..7]);
    }

    /// A direction that the data do not tell is spread over the range, and stays within it.
    #[test]
    fn unknown_direction_is_spread_over_the_range() {
        let unknown = OVERLAY.replace("deviation = 0.04", "");
        let points = read(&unknown).unwrap().points(1, 2000);
        let numbers: Vec<f64> = points.iter().filter_map(|it| it[0].number).collect();
        let least = numbers.iter().copied().fold(f64::INFINITY, f64::min);
        let greatest = numbers.iter().copied().fold(0.0, f64::max);
        assert!((0.0..1.0).contains(&least), "{least}");
        assert!((9.0..=10.0).contains(&greatest), "{greatest}");
    }

    #[test]
    fn distribution_is_written_as_it_is_read() {
        let distribution = read(OVERLAY).unwrap();
        let text = format!("[fit]\nname = 'y'\n{}", distribution.toml());
        let again = read(&text).unwrap();
        assert_eq!(again.points(1, 5), distribution.points(1, 5));
        let missing = OVERLAY.replace("[[fit.direction]]", "[[fit.other]]");
        let error = read(&missing).unwrap_err().to_string();
        assert!(error.contains("direction"), "{error}");
        let short = OVERLAY.replace("[0.6, 0.8]", "[1.0]");
        let error = read(&short).unwrap_err().to_string();
        assert!(error.contains("unit vectors of 2 entries"), "{error}");
        for (from, to) in [
            ("[0.6, 0.8]", "[0.0, 0.0]"),
            ("[0.6, 0.8]", "[nan, 1.0]"),
            ("deviation = 0.01", "deviation = -0.01"),
            ("deviation = 0.01", "deviation = 1e308"),
            ("share = 0.5", "share = 1.5"),
            ("to = '10 m'", "to = '-1 m'"),
            ("to = 100", "to = '100 kg'"),
        ] {
            assert!(read(&OVERLAY.replace(from, to)).is_err(), "{to}");
        }
        let none = "[fit]\nparameter = []\ndirection = []\n";
        assert!(read(none).is_err());
    }
}
