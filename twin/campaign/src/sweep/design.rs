//! Designs: the points of a sweep.

use serde::Serialize;
use twinrig_document::declaration::Words;
use twinrig_kernel::{Stream, stream};

use super::dimension::{DimensionValues, SweepDimension};
use super::value::SweepValue;

/// Rule that chooses the points.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum DesignKind {
    /// Every combination of the values of all dimensions; the last dimension varies fastest.
    Grid,
    /// Each dimension is divided into as many equally probable strata as there are points, each of
    /// which has one point; strata of different dimensions are combined at random.
    LatinHypercube,
    /// Independent draws.
    Random,
    /// Trajectories that change one dimension at a time, for elementary effects.
    Morris,
}

impl Words for DesignKind {
    const WORDS: &'static [(&'static str, Self)] = &[
        ("grid", Self::Grid),
        ("latin-hypercube", Self::LatinHypercube),
        ("random", Self::Random),
        ("morris", Self::Morris),
    ];
}

impl DesignKind {
    /// Returns the word of a specification.
    pub fn word(self) -> &'static str {
        let word = Self::WORDS.iter().find(|(_, kind)| *kind == self);
        word.map_or("", |(word, _)| word)
    }
}

/// Design of a sweep.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Design {
    /// Rule.
    pub kind: DesignKind,
    /// Number of points.
    pub points: usize,
    /// Seed of the draws, without effect on a grid.
    pub seed: u64,
    /// Number of values of each dimension of [`DesignKind::Morris`], which is even.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub levels: Option<usize>,
}

impl Design {
    /// Returns the points: a value for each dimension. The numbers of a dimension are of the stream
    /// `campaign/design/KEY`, so that another dimension has no influence on them.
    pub fn points(&self, dimensions: &[SweepDimension]) -> Vec<Vec<SweepValue>> {
        if self.kind == DesignKind::Morris {
            return trajectories(self, dimensions);
        }
        let mut points = vec![Vec::with_capacity(dimensions.len()); self.points];
        // Points with the same value in all further dimensions.
        let mut block = self.points;
        for dimension in dimensions {
            let key = &dimension.key.value;
            let mut numbers = stream(self.seed, &format!("campaign/design/{key}"));
            let values = &dimension.values;
            match self.kind {
                DesignKind::Grid => {
                    let count = values.count().unwrap_or(1).max(1);
                    block /= count;
                    for (index, point) in points.iter_mut().enumerate() {
                        point.push(values.on_grid(index / block.max(1) % count));
                    }
                }
                DesignKind::LatinHypercube => {
                    let strata = permutation(self.points, &mut numbers);
                    for (point, stratum) in points.iter_mut().zip(strata) {
                        point.push(values.draw(stratum, self.points, &mut numbers));
                    }
                }
                DesignKind::Random | DesignKind::Morris => {
                    for point in &mut points {
                        point.push(values.draw(0, 1, &mut numbers));
                    }
                }
            }
        }
        points
    }
}

/// Returns the points of a design for elementary effects, trajectory by trajectory. Numbers of a
/// dimension are of a stream of its own, as of other designs.
fn trajectories(design: &Design, dimensions: &[SweepDimension]) -> Vec<Vec<SweepValue>> {
    let levels = design.levels.unwrap_or(2).max(2);
    let trajectories = design.points / (dimensions.len() + 1);
    let mut streams: Vec<_> = dimensions
        .iter()
        .map(|one| stream(design.seed, &format!("campaign/design/{}", one.key.value)))
        .collect();
    let mut points = Vec::with_capacity(design.points);
    for _ in 0..trajectories {
        let draws = streams.iter_mut().map(|numbers| {
            let level = numbers.between(0, levels as u64 - 1);
            (numbers.unit(), usize::try_from(level).unwrap_or(0))
        });
        let draws: Vec<(f64, usize)> = draws.collect();
        let value = |index: usize, level: usize| {
            let share = level as f64 / (levels - 1) as f64;
            match &dimensions[index].values {
                DimensionValues::Interval(interval) => interval.on_grid(share),
                // The reader has refused other values.
                other => other.on_grid(level),
            }
        };
        let starts = draws.iter().enumerate();
        let mut point: Vec<_> = starts
            .map(|(index, (_, level))| value(index, *level))
            .collect();
        points.push(point.clone());
        let mut order: Vec<usize> = (0..dimensions.len()).collect();
        order.sort_by(|one, other| draws[*one].0.total_cmp(&draws[*other].0));
        for index in order {
            // Half of the levels up, or down from the upper half.
            point[index] = value(index, (draws[index].1 + levels / 2) % levels);
            points.push(point.clone());
        }
    }
    points
}

/// Returns a random permutation of the numbers below `count` (Fisher and Yates).
fn permutation(count: usize, numbers: &mut Stream) -> Vec<usize> {
    let mut order: Vec<usize> = (0..count).collect();
    for last in (1..count).rev() {
        let other = usize::try_from(numbers.between(0, last as u64));
        order.swap(last, other.unwrap_or(last));
    }
    order
}
