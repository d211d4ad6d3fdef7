//! Differences between models, each against each other, and the sensitivity to assumed compliance.

use std::rc::Rc;

use twinrig_report::number::si;
use twinrig_rig::{MethodSetting, PlantOffer, Scales, Variant};

use crate::budget::Weight;
use crate::error::StudyError;
use crate::plants::precision_job::Job;
use crate::plants::reference::{self, Reference, Trust};
use crate::plants::row::{Row, RowKind, Status, model_label};

/// Factors of the stiffness of compliant constraints, towards rigid ones.
const STIFFER: [f64; 3] = [3.0, 10.0, 30.0];
/// Factors of stiffness and of damping by which assumed compliance is varied; three times the
/// stiffness is one of the above.
const SENSITIVITY: [(f64, f64); 3] = [(1.0 / 3.0, 1.0), (1.0, 1.0 / 3.0), (1.0, 3.0)];

/// Model with its reference.
struct Model {
    variant: Variant,
    reference: Result<Rc<Reference>, String>,
    /// Label of the only model that it is compared with; `None`: all.
    against: Option<String>,
}

/// Returns the number of models of scaled compliance.
pub(crate) fn parts(plants: &[PlantOffer]) -> usize {
    let compliant = plants.iter().filter(|plant| plant.plant.is_compliant());
    compliant.count() * (STIFFER.len() + SENSITIVITY.len())
}

impl Job<'_> {
    /// Adds a row for each pair of models, the first with segment masses before all others, over
    /// the time for which all are trusted; assumed compliance, over the time for which the pair is.
    pub(crate) fn differences(
        &mut self,
        plants: &[PlantOffer],
        references: &[Option<Rc<Reference>>],
    ) -> Result<(), StudyError> {
        let mut models = Vec::new();
        for (plant, reference) in plants.iter().zip(references) {
            // A plant with the reference of another plant solves the same model.
            let own = reference.as_ref();
            let Some(own) = own.filter(|own| own.variant.plant == plant.plant) else {
                continue;
            };
            models.push(Model {
                variant: own.variant.clone(),
                reference: Ok(Rc::clone(own)),
                against: None,
            });
            if plant.plant.is_compliant() {
                self.scaled(plant, &mut models)?;
            }
        }
        let base = plants.iter().find(|plant| plant.segment_masses);
        let is_base = |model: &Model| base.is_some_and(|base| model.variant.plant == base.plant);
        if let Some(place) = models.iter().position(is_base) {
            models[..=place].rotate_right(1);
        }
        let trusted = models.iter().filter(|model| model.against.is_none());
        let trusted = trusted.filter_map(|model| model.reference.as_ref().ok());
        let until_s = trusted.map(|reference| reference.trace.trusted_s());
        let until_s = until_s.fold(f64::INFINITY, f64::min);
        for (n, other) in models.iter().enumerate() {
            for base in &models[..n] {
                let base_label = model_label(&base.variant.plant, &base.variant.scales);
                let wanted = match (&base.against, &other.against) {
                    (Some(_), _) => false,
                    (None, None) => true,
                    (None, Some(only)) => *only == base_label,
                };
                if wanted {
                    // A model compared with itself only is known for longer.
                    let until_s = other.against.as_ref().map_or(until_s, |_| f64::INFINITY);
                    self.rows.push(row(base, &base_label, other, until_s));
                }
            }
        }
        Ok(())
    }

    /// Adds the models of a plant with scaled compliance, at coarser settings where the finest
    /// fail: models differ by far more than these err.
    fn scaled(&mut self, plant: &PlantOffer, models: &mut Vec<Model>) -> Result<(), StudyError> {
        let runs = self.runs;
        let fine = runs.trust();
        let rough = Trust {
            rough: true,
            ..fine
        };
        let stiffer = STIFFER.map(|stiffness| (stiffness, 1.0, true));
        let varied = SENSITIVITY.map(|(stiffness, damping)| (stiffness, damping, false));
        for (compliance, compliance_damping, is_main) in stiffer.into_iter().chain(varied) {
            let scales = Scales {
                compliance,
                compliance_damping,
                ..Scales::AS_IS
            };
            let label = model_label(&plant.plant, &scales);
            let of = |trust, share| reference::checked(&runs.context, plant, scales, trust, share);
            let content = ("model", plant, scales);
            let reference = self.parts.measure(&label, Weight::Run, &content, |share| {
                of(fine, share.part(2)).or_else(|_| of(rough, share.part(2)))
            })?;
            let variant = reference
                .as_ref()
                .map(|reference| reference.variant.clone());
            models.push(Model {
                variant: variant.unwrap_or(Variant {
                    plant: plant.plant.clone(),
                    method: String::new(),
                    setting: MethodSetting::Step(runs.context.grid),
                    scales,
                }),
                reference: reference.map(Rc::new),
                against: (!is_main).then(|| plant.plant.label()),
            });
        }
        Ok(())
    }
}

/// Returns the difference of `other` from `base` up to `until_s`.
fn row(base: &Model, base_label: &str, other: &Model, until_s: f64) -> Row {
    let mut row = Row::new(RowKind::Model, &other.variant);
    row.against = Some(base_label.to_owned());
    let (base, reference) = match (&base.reference, &other.reference) {
        (Ok(base), Ok(other)) => (base, other),
        (Err(why), _) | (_, Err(why)) => {
            row.step_s = None;
            return row.ended(Status::Failed, why.clone());
        }
    };
    let trusted = [base, reference].map(|one| one.trace.trusted_s());
    let until_s = trusted.into_iter().fold(until_s, f64::min);
    let Some(errors) = reference.trace.errors_until(&base.trace, until_s) else {
        return row.ended(Status::Failed, "the plants have no foot in common");
    };
    row.note_errors(&errors);
    row.compared_s = Some(until_s);
    let unsure = base.floor_rms() + reference.floor_rms();
    row.at_floor = errors.foot_rms <= unsure;
    if row.at_floor && unsure > 0.0 {
        let unsure = si(unsure, "m");
        row.why = Some(format!("the models are known to within {unsure} only"));
    }
    row
}
