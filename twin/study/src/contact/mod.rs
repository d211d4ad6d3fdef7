//! Contact of the feet with the ground: penetration at rest, and residuals of the contact law in a
//! gait.

mod recorder;

use serde::Serialize;
use twinrig_kernel::{SimDuration, SimTime};

use crate::budget::Share;
use crate::commands::Commands;
use crate::error::StudyError;
use crate::plant_run::{Ending, PlantRun};
use crate::precision_job::Job;
use crate::reference::ended;
use crate::row::{Status, VariantKey};
use crate::transport::TOLERANCE;
use recorder::ContactRecorder;
use twinrig_rig::{MethodSetting, PlantOffer, Scales, SettingKind, Variant};

/// Duration for which the first commands are held until the robot is at rest, and greatest duration
/// of the gait.
const REST: SimDuration = SimDuration::from_secs(3);
const GAIT: SimDuration = SimDuration::from_secs(2);
/// Contact of a plant by one method at the scenario's step. Values that do not apply are null.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ContactResiduals {
    /// Plant, method and setting.
    #[serde(flatten)]
    pub key: VariantKey,
    /// Outcome.
    pub status: Status,
    /// Reason of a status other than `ok`, or of missing values.
    pub why: Option<String>,
    /// Standing under the first commands.
    pub rest: Option<RestContact>,
    /// The first seconds of the gait.
    pub gait: Option<GaitContact>,
}

/// Foot with the greatest load of a standing robot.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RestContact {
    /// Load \[N\].
    pub load_n: f64,
    /// Penetration: 0 for rigid contact \[m\].
    pub penetration_m: f64,
    /// Penetration of a linear sole with the stiffness of the robot file, for compliant
    /// constraints \[m\].
    pub expected_m: Option<f64>,
    /// Stiffness realised: load over penetration, as a share of that of the robot file.
    pub stiffness_realised: Option<f64>,
    /// Speed of the foot: the robot is not at rest if this is large \[m/s\].
    pub speed_m_s: f64,
}

/// Residuals of unilateral contact with Coulomb friction and dissipation, all 0 for exact rigid
/// contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct GaitContact {
    /// Greatest product of gap or penetration and load (Signorini) \[J\].
    pub signorini_j: f64,
    /// Greatest penetration \[m\].
    pub penetration_m: f64,
    /// Greatest friction beyond the cone, `|F_t| − µ F_n` \[N\].
    pub coulomb_n: Option<f64>,
    /// Work of friction in the direction of slip, which friction should oppose \[J\].
    pub along_slip_j: f64,
    /// Energy that contacts created: work of the ground on a foot from touch-down to lift-off,
    /// where positive \[J\].
    pub created_j: f64,
    /// Energy that contacts dissipated, where that work is negative \[J\].
    pub dissipated_j: f64,
}

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
        let step = self.context.factory.input().step;
        let mut contacts = Vec::new();
        for plant in plants {
            for method in plant.complete_methods() {
                let share = self.begin(&format!("{}, contact", plant.plant))?;
                let variant = Variant {
                    plant: plant.plant.clone(),
                    method: method.name.clone(),
                    setting: match method.set_by {
                        SettingKind::Step => MethodSetting::Step(step),
                        SettingKind::Tolerance => MethodSetting::Tolerance(TOLERANCE),
                    },
                    scales: Scales::AS_IS,
                };
                contacts.push(self.contact(&variant, share));
            }
        }
        Ok(contacts)
    }

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
