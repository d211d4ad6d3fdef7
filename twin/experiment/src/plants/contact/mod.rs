//! Contact of the feet with the ground: penetration at rest, and residuals of the contact law in a
//! gait.

mod recorder;
mod residuals;

pub use residuals::{ContactResiduals, GaitContact, RestContact};

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_rig::{MethodSetting, PlantOffer, Scales, SettingKind, Variant};

use crate::budget::{Share, Weight};
use crate::error::StudyError;
use crate::measured::Measured;
use crate::plants::commands::Commands;
use crate::plants::plant_run::{Ending, PlantRun};
use crate::plants::precision_job::{Job, Runs};
use crate::plants::reference::ended;
use crate::plants::row::Status;
use crate::plants::transport::TOLERANCE;
use recorder::ContactRecorder;

/// Duration for which the first commands are held until the robot is at rest, and greatest duration
/// of the gait.
const REST: SimDuration = SimDuration::from_secs(3);
const GAIT: SimDuration = SimDuration::from_secs(2);

/// Returns the number of runs.
pub(crate) fn parts(plants: &[PlantOffer]) -> usize {
    let runs = |plant: &PlantOffer| plant.complete_methods().count();
    plants.iter().map(runs).sum()
}

impl Job<'_> {
    /// Computes the contact residuals of each method of each plant.
    pub(crate) fn contacts(
        &mut self,
        plants: &[PlantOffer],
    ) -> Result<Vec<ContactResiduals>, StudyError> {
        let runs = self.runs;
        let step = runs.context.factory.input().step;
        let mut contacts = Vec::new();
        for plant in plants {
            for method in plant.complete_methods() {
                let variant = Variant {
                    plant: plant.plant.clone(),
                    method: method.name.clone(),
                    setting: match method.set_by {
                        SettingKind::Step => MethodSetting::Step(step),
                        SettingKind::Tolerance => MethodSetting::Tolerance(TOLERANCE),
                    },
                    scales: Scales::AS_IS,
                };
                let label = format!("{}, contact", plant.plant);
                let content = ("contact", &variant);
                contacts.push(self.parts.measure(&label, Weight::Run, &content, |share| {
                    runs.contact(&variant, share)
                })?);
            }
        }
        Ok(contacts)
    }
}

impl Measured for ContactResiduals {}

impl Runs<'_> {
    fn contact(&self, variant: &Variant, share: Share) -> ContactResiduals {
        let input = self.context.factory.input();
        let mut contact = ContactResiduals {
            key: variant.into(),
            status: Status::Ok,
            why: None,
            rest: None,
            gait: None,
        };
        let none = Commands::none();
        let standing = self.recorded(variant, share.part(2), Some(&none), REST);
        let standing = standing.and_then(|(recorder, ending)| match ended(&ending, share) {
            None => recorder.rest(),
            Some((_, why)) => Err(why),
        });
        match standing {
            Ok(mut rest) => {
                let stiffness = input
                    .sole_stiffness
                    .filter(|_| variant.plant.is_compliant());
                rest.expected_m = stiffness.map(|stiffness| rest.load_n / stiffness);
                let realised = rest.load_n / rest.penetration_m;
                rest.stiffness_realised = stiffness
                    .map(|stiffness| realised / stiffness)
                    .filter(|share| share.is_finite());
                contact.rest = Some(rest);
            }
            Err(why) => contact.why = Some(format!("at rest: {why}")),
        }
        match self.recorded(variant, share, None, GAIT.min(input.duration)) {
            Ok((recorder, ending)) => {
                contact.gait = Some(recorder.finished());
                if let Some((status, why)) = ended(&ending, share) {
                    (contact.status, contact.why) = (status, Some(why));
                    contact.gait = None;
                }
            }
            Err(why) => (contact.status, contact.why) = (Status::Failed, Some(why)),
        }
        contact
    }

    /// Records the contacts of a run under `commands`, or under those of the scenario.
    fn recorded(
        &self,
        variant: &Variant,
        share: Share,
        commands: Option<&Commands>,
        duration: SimDuration,
    ) -> Result<(ContactRecorder, Ending), String> {
        let input = self.context.factory.input();
        let grid = input.step.max(SimDuration::from_nanos(1));
        let mut plant_run = PlantRun {
            grid,
            end: SimTime::ZERO + grid * (duration.as_nanos() / grid.as_nanos()),
            ..self.context.plant_run(share)
        };
        if let Some(commands) = commands {
            plant_run.commands = commands;
        }
        let run = self.context.with_contacts(variant, |plant| {
            let recorder = ContactRecorder::of(plant, grid.as_secs_f64(), input.friction);
            let mut recorder = recorder.ok_or("it has no outputs of the contact")?;
            let ending = plant_run.run(plant, |_, plant| recorder.sample(plant));
            Ok::<_, String>((recorder, ending))
        });
        run?
    }
}
