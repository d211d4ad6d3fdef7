//! Differences of gaits between models: pairs of ensembles whose intervals do not overlap.

use serde::Serialize;

use crate::plants::ensemble::QuantityInterval;
use crate::plants::study::Study;

/// Pair of models whose intervals do not overlap, widened by the errors of their methods.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EnsembleDifference {
    /// Quantity.
    pub quantity: String,
    /// Labels of the two models.
    pub models: [String; 2],
    /// Difference of the means: second less first.
    pub difference: f64,
}

impl Study {
    /// Returns the pairs of models whose intervals of a quantity, widened by the errors of the
    /// methods, do not overlap.
    pub fn ensemble_differences(&self) -> Vec<EnsembleDifference> {
        let mut found = Vec::new();
        for (n, second) in self.ensembles.iter().enumerate() {
            for first in &self.ensembles[..n] {
                for own in &first.quantities {
                    let mut others = second.quantities.iter();
                    let other = others.find(|other| other.quantity == own.quantity);
                    let differs = |other: &&QuantityInterval| {
                        let [own, other] = [own, *other].map(QuantityInterval::widened);
                        own.zip(other)
                            .is_some_and(|(own, other)| !own.overlaps(&other))
                    };
                    if let Some(other) = other.filter(differs) {
                        found.push(EnsembleDifference {
                            quantity: own.quantity.clone(),
                            models: [first.key.plant.label(), second.key.plant.label()],
                            difference: other.interval.mean - own.interval.mean,
                        });
                    }
                }
            }
        }
        found
    }
}
