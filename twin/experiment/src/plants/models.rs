//! Modelling errors: differences between models, as opposed to errors of methods.

use std::rc::Rc;

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_report::number::si;
use twinrig_rig::{MethodSetting, PlantOffer, Scales, Variant};

use crate::budget::{Share, Weight};
use crate::error::StudyError;
use crate::plants::factory::PlantFactory;
use crate::plants::footsteps::{self, Footstep, GAIT_DURATION, TouchDowns};
use crate::plants::plant_run::PlantRun;
use crate::plants::precision_job::{Job, Runs};
use crate::plants::reference::{self, Reference};
use crate::plants::references::model_of;
use crate::plants::row::{Row, RowKind, Status};

/// Returns the base model with segment masses, and the plant that is its limit without them.
pub(crate) fn limit_pair(factory: &dyn PlantFactory) -> Option<(&PlantOffer, &PlantOffer)> {
    let plants = factory.plants();
    let full = plants.iter().find(|plant| plant.segment_masses)?;
    let full = model_of(factory, full).map_or(full, |(model, _)| model);
    let limit = plants.iter().find(|plant| !plant.segment_masses)?;
    Some((full, limit))
}

impl Job<'_> {
    /// Compares the touch-downs of the models, computed by the methods of their references at
    /// coarser settings.
    pub(crate) fn footsteps(
        &mut self,
        plants: &[PlantOffer],
        references: &[Option<Rc<Reference>>],
    ) -> Result<Vec<Footstep>, StudyError> {
        let runs = self.runs;
        let end = GAIT_DURATION.min(runs.context.factory.input().duration);
        let mut walks = Vec::new();
        for (plant, reference) in plants.iter().zip(references) {
            let label = format!("{}, footsteps", plant.plant);
            let own = reference.as_ref();
            let Some(own) = own.filter(|own| own.variant.plant == plant.plant) else {
                self.parts.begin(&label, Weight::Run)?;
                continue;
            };
            let content = ("footsteps", &own.variant);
            let walk = self.parts.measure(&label, Weight::Run, &content, |share| {
                runs.fine_and_coarse_walk(&own.variant, end, share)
            })?;
            walks.extend(walk.ok().map(|walk| (plant, walk)));
        }
        let Some(full) = walks.iter().find(|(plant, _)| plant.segment_masses) else {
            return Ok(Vec::new());
        };
        let others = walks
            .iter()
            .filter(|(plant, _)| plant.plant != full.0.plant);
        let pair = |walk: &'_ [TouchDowns; 2]| [walk[0].clone(), walk[1].clone()];
        let own = pair(&full.1);
        Ok(others
            .flat_map(|(plant, other)| {
                let (own, other) = ([&own[0], &own[1]], [&other[0], &other[1]]);
                footsteps::compare(&plant.plant, own, other, end.as_secs_f64())
            })
            .collect())
    }

    /// Computes the difference of the two models as a function of the segment masses.
    pub(crate) fn limit(&mut self) -> Result<(), StudyError> {
        let runs = self.runs;
        let Some((full, limit)) = limit_pair(runs.context.factory) else {
            return Ok(());
        };
        for &mass in &runs.plan.masses {
            let label = format!("{} without its segments' mass", full.plant);
            let scales = Scales {
                mass,
                bare_foot: true,
                ..Scales::AS_IS
            };
            let content = ("limit", full, limit, mass);
            let row = self.parts.measure(&label, Weight::Run, &content, |share| {
                runs.limit_row(full, limit, scales, share)
            })?;
            self.rows.push(match row {
                // A kept row does not have all scales.
                Ok(row) => Row { scales, ..row },
                Err(why) => {
                    let variant = Variant {
                        plant: full.plant.clone(),
                        method: String::new(),
                        setting: MethodSetting::Step(runs.context.grid),
                        scales,
                    };
                    let row = Row::new(RowKind::Limit, &variant).ended(Status::Failed, why);
                    Row {
                        step_s: None,
                        ..row
                    }
                }
            });
        }
        Ok(())
    }
}

impl Runs<'_> {
    /// Returns the touch-downs of a variant at a coarser setting than that of a reference, and at a
    /// still coarser one.
    fn fine_and_coarse_walk(
        &self,
        variant: &Variant,
        end: SimDuration,
        share: Share,
    ) -> Result<[TouchDowns; 2], String> {
        let setting = variant.setting.relaxed();
        let fine = self.walk(variant, setting, end, share)?;
        let coarse = self.walk(variant, setting.coarser(), end, share)?;
        Ok([fine, coarse])
    }

    /// Returns the touch-downs of a variant with `setting`.
    fn walk(
        &self,
        variant: &Variant,
        setting: MethodSetting,
        end: SimDuration,
        share: Share,
    ) -> Result<TouchDowns, String> {
        let variant = Variant {
            setting,
            ..variant.clone()
        };
        let plant_run = PlantRun {
            end: SimTime::ZERO + end,
            grid: footsteps::SAMPLE_PERIOD,
            ..self.context.plant_run(share)
        };
        let steps = self
            .context
            .with_plant(&variant, |plant| TouchDowns::record(plant, &plant_run));
        steps?.ok_or_else(|| "a walk did not complete".to_owned())
    }

    /// Computes the difference of the two models with these segment masses.
    fn limit_row(
        &self,
        full: &PlantOffer,
        limit: &PlantOffer,
        scales: Scales,
        share: Share,
    ) -> Result<Row, String> {
        let reference =
            |plant| reference::checked(&self.context, plant, scales, self.trust(), share);
        let (full, limit) = (reference(full)?, reference(limit)?);
        let mut row = limit.difference(RowKind::Limit, &full);
        let unsure = full.floor_rms().max(limit.floor_rms());
        row.at_floor = row.error_rms_m.is_some_and(|error| error <= unsure);
        if row.at_floor && unsure > 0.0 {
            let unsure = si(unsure, "m");
            row.why = Some(format!("the models are known to within {unsure} only"));
        }
        Ok(row)
    }
}
