//! What walking costs in each plant, and where energy appears or vanishes meanwhile.

use serde::Serialize;
use twinrig_kernel::{Direction, Layout, SimDuration, SimTime};
use twinrig_runtime::{EnergyBalance, Plant};

use crate::budget::Share;
use crate::error::StudyError;
use crate::factory::{MethodSetting, PlantOffer, Scales, SetBy, Variant};
use crate::number::instant;
use crate::plant_run::{Go, PlantRun};
use crate::precision::Job;
use crate::reference::ended;
use crate::row::Status;

/// So much of a walk is led through.
pub const STROLL: SimDuration = SimDuration::from_secs(10);
/// The first share of it does not count: gaits take some steps to settle.
const SETTLING: f64 = 0.2;
/// A trunk at less than this share of its first height has fallen.
const FALLEN: f64 = 0.5;
/// The tolerance of methods that choose their steps: far below what walks differ by.
const TOLERANCE: f64 = 1e-6;

/// What a walk costs in one plant by one method at the scenario's step. What does not apply is null.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Transport {
    /// Name of the plant.
    pub plant: String,
    /// Name of its method.
    pub method: String,
    /// Its step \[s\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_s: Option<f64>,
    /// Its tolerance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// What became of it.
    pub status: Status,
    /// Why it is not `ok`.
    pub why: Option<String>,
    /// When its trunk was first at less than half the height it began at \[s\].
    pub fell_at_s: Option<f64>,
    /// What it costs.
    pub cost: Option<Cost>,
}

/// What happened over a window of a walk.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Cost {
    /// Where the window begins \[s\].
    pub from_s: f64,
    /// Where it ends \[s\].
    pub to_s: f64,
    /// How far the trunk came, as the crow flies and on the level \[m\].
    pub distance_m: f64,
    /// That by the time it took \[m/s\].
    pub speed_m_s: f64,
    /// Work of the drives on the robot, what they took back subtracted, by the energy books \[J\].
    pub work_j: f64,
    /// The same by torques and angles of the drives, as a check of both \[J\].
    pub drive_work_j: Option<f64>,
    /// What the drives gave where they gave, each for itself: a drive that gets nothing back for braking needs so much \[J\].
    pub positive_work_j: Option<f64>,
    /// What friction took \[J\].
    pub dissipated_j: f64,
    /// What impacts took \[J\].
    pub impact_j: f64,
    /// What is stored at the end and was not at the beginning \[J\].
    pub stored_j: f64,
    /// What is there and was given by nobody; negative: was given and is nowhere \[J\].
    pub residual_j: f64,
    /// The greatest such residual of any tenth of the window, as it appears \[J\].
    pub appears_most_j: f64,
    /// The same as it vanishes, as a positive number \[J\].
    pub vanishes_most_j: f64,
    /// Work by weight and distance; none of what does not move.
    pub cost_of_transport: Option<f64>,
    /// The same had the drives given what appeared from nowhere, and kept what vanished.
    pub covered_cost_of_transport: Option<f64>,
    /// The same with positive work.
    pub positive_cost_of_transport: Option<f64>,
}

/// How many rows there will be.
pub(crate) fn parts(plants: &[PlantOffer]) -> usize {
    plants.iter().map(|plant| plant.methods.len()).sum()
}

impl Job<'_> {
    /// What walking costs, by each method of each plant.
    pub(crate) fn transports(
        &mut self,
        plants: &[PlantOffer],
    ) -> Result<Vec<Transport>, StudyError> {
        let step = self.stage.factory.scene().step;
        let mut transports = Vec::new();
        for plant in plants {
            for method in &plant.methods {
                let share = self.begin_heavy(&format!("{}, cost of transport", plant.name))?;
                let variant = Variant {
                    plant: plant.name.clone(),
                    method: method.name.clone(),
                    setting: match method.set_by {
                        SetBy::Step => MethodSetting::Step(step),
                        SetBy::Tolerance => MethodSetting::Tolerance(TOLERANCE),
                    },
                    scales: Scales::AS_IS,
                };
                transports.push(self.transport(&variant, share));
            }
        }
        Ok(transports)
    }

    fn transport(&self, variant: &Variant, share: Share) -> Transport {
        let scene = self.stage.factory.scene();
        let mut transport = Transport {
            plant: variant.plant.clone(),
            method: variant.method.clone(),
            step_s: variant.setting.step_s(),
            tolerance: variant.setting.tolerance(),
            status: Status::Failed,
            why: None,
            fell_at_s: None,
            cost: None,
        };
        // Drives are looked at after every step of theirs, so that torque by turning is all of their work.
        let grid = scene.step.max(SimDuration::from_nanos(1));
        let end = STROLL.min(scene.duration);
        let plant_run = PlantRun {
            grid,
            end: SimTime::ZERO + grid * (end.as_nanos() / grid.as_nanos()),
            ..self.stage.plant_run(share)
        };
        let walked = self.stage.with_drives(variant, |plant| {
            let mut walk = Walk::of(plant).ok_or("it does not tell where its trunk is")?;
            let ending = plant_run.lead(plant, |now, plant| walk.look(now, plant));
            Ok::<_, String>((walk, ending))
        });
        let (walk, ending) = match walked.and_then(|walked| walked) {
            Ok(walked) => walked,
            Err(why) => {
                transport.why = Some(why);
                return transport;
            }
        };
        transport.fell_at_s = walk.fell_at.map(SimTime::as_secs_f64);
        if let Some((status, why)) = ended(&ending, share) {
            (transport.status, transport.why) = (status, Some(why));
            return transport;
        }
        transport.status = Status::Ok;
        transport.why = walk.fell_at.map(|at| format!("it fell at {}", instant(at)));
        transport.cost = walk.cost(plant_run.end.as_secs_f64(), scene.weight);
        transport
    }
}

/// Where the numbers of a drive are among the outputs.
#[derive(Clone, Copy)]
struct Drive {
    angle: usize,
    torque: usize,
}

/// A moment of a walk.
#[derive(Clone, Copy)]
struct Moment {
    at_s: f64,
    trunk: [f64; 3],
    balance: EnergyBalance,
    /// Work of the drives up to then by torques and angles, and of that what they gave \[J\].
    drives: [f64; 2],
}

/// A walk, looked at step by step.
struct Walk {
    outputs: Vec<f64>,
    trunk: usize,
    drives: Vec<Drive>,
    angles: Vec<f64>,
    moments: Vec<Moment>,
    fell_at: Option<SimTime>,
}

impl Walk {
    fn of(plant: &dyn Plant) -> Option<Self> {
        let ports = plant.ports();
        let layout = Layout::of(&ports, Direction::Output);
        let trunk = layout.find("body/position")?.start;
        let drives = layout.fields().filter_map(|field| {
            let joint = field.port.name.strip_suffix("/torque")?;
            let angle = layout.find(&format!("{joint}/position"))?.start;
            Some(Drive {
                angle,
                torque: field.offset,
            })
        });
        let drives: Vec<Drive> = drives.collect();
        Some(Self {
            outputs: vec![0.0; layout.len()],
            trunk,
            angles: vec![0.0; drives.len()],
            drives,
            moments: Vec::new(),
            fell_at: None,
        })
    }

    fn look(&mut self, now: SimTime, plant: &mut dyn Plant) -> Go {
        plant.observe(&mut self.outputs);
        let balance = plant.energy();
        if !balance.stored().is_finite() || self.outputs.iter().any(|output| !output.is_finite()) {
            return Go::NotFinite;
        }
        let last = self.moments.last();
        let mut drives = last.map_or([0.0; 2], |last| last.drives);
        for (drive, before) in self.drives.iter().zip(&mut self.angles) {
            let angle = self.outputs[drive.angle];
            if last.is_some() {
                let work = self.outputs[drive.torque] * (angle - *before);
                drives[0] += work;
                drives[1] += work.max(0.0);
            }
            *before = angle;
        }
        let trunk = core::array::from_fn(|n| self.outputs[self.trunk + n]);
        self.moments.push(Moment {
            at_s: now.as_secs_f64(),
            trunk,
            balance,
            drives,
        });
        let first = self.moments[0].trunk[2];
        if self.fell_at.is_none() && trunk[2] < FALLEN * first {
            self.fell_at = Some(now);
        }
        Go::On
    }

    /// What it cost from when it had settled to `end_s`, for a robot of `weight` \[N\]; none of a walk without moments.
    fn cost(&self, end_s: f64, weight: f64) -> Option<Cost> {
        let start_s = SETTLING * end_s;
        let at = |at_s: f64| {
            let n = self
                .moments
                .partition_point(|moment| moment.at_s < at_s * (1.0 - 1e-9));
            self.moments.get(n)
        };
        let (from, to) = (at(start_s)?, self.moments.last()?);
        let seconds = to.at_s - from.at_s;
        let along = [0, 1].map(|n| to.trunk[n] - from.trunk[n]);
        let distance = (along[0] * along[0] + along[1] * along[1]).sqrt();
        let flow = |of: fn(&EnergyBalance) -> f64| of(&to.balance) - of(&from.balance);
        let work = flow(|balance| balance.actuator);
        let drives =
            [0, 1].map(|n| (!self.drives.is_empty()).then_some(to.drives[n] - from.drives[n]));
        let tenths = (0..10).filter_map(|n| {
            let tenth = |n: i32| at(from.at_s + seconds * f64::from(n) / 10.0);
            Some(tenth(n + 1)?.balance.residual - tenth(n)?.balance.residual)
        });
        let tenths: Vec<f64> = tenths.collect();
        let per_way =
            |work: f64| (distance > 0.0 && weight > 0.0).then(|| work / (weight * distance));
        let residual = flow(|balance| balance.residual);
        Some(Cost {
            from_s: from.at_s,
            to_s: to.at_s,
            distance_m: distance,
            speed_m_s: if seconds > 0.0 {
                distance / seconds
            } else {
                0.0
            },
            work_j: work,
            drive_work_j: drives[0],
            positive_work_j: drives[1],
            dissipated_j: flow(|balance| balance.dissipated),
            impact_j: flow(|balance| balance.impact),
            stored_j: flow(EnergyBalance::stored),
            residual_j: residual,
            appears_most_j: tenths.iter().copied().fold(0.0, f64::max),
            vanishes_most_j: tenths
                .iter()
                .fold(0.0, |most, tenth| f64::max(most, -tenth)),
            cost_of_transport: per_way(work),
            covered_cost_of_transport: per_way(work + residual),
            positive_cost_of_transport: drives[1].and_then(per_way),
        })
    }
}
