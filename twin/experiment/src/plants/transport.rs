//! Cost of transport by plant and method, and the energy that the integration creates or destroys.

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Direction, Layout, SimDuration, SimTime, signal};
use twinrig_report::number::instant;
use twinrig_rig::{MethodOffer, MethodSetting, PlantOffer, Scales, SettingKind, Variant};
use twinrig_runtime::{EnergyBalance, Plant};

use crate::budget::{Share, Weight};
use crate::error::StudyError;
use crate::measured::Measured;
use crate::plants::plant_run::{PlantRun, SampleVerdict};
use crate::plants::precision_job::{Job, Runs};
use crate::plants::reference::ended;
use crate::plants::row::{Status, VariantKey};

/// Greatest simulated duration of the walk.
pub const TRANSPORT_DURATION: SimDuration = SimDuration::from_secs(10);
/// Share of the walk that is excluded until the gait has settled.
pub(crate) const SETTLING: f64 = 0.2;
/// Height of the trunk, as a share of the initial height, below which the robot has fallen.
const FALLEN: f64 = 0.5;
/// Tolerance of adaptive methods: its effect is far below the differences between walks.
pub(crate) const TOLERANCE: f64 = 1e-6;

/// Greatest number of finer settings tried for a converged cost.
const FINER_MOST: u32 = 6;

/// Cost of a walk in one plant by one method, at the scenario's step. Values that do not apply are
/// null.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Transport {
    /// Plant, method and setting.
    #[serde(flatten)]
    pub key: VariantKey,
    /// Outcome.
    pub status: Status,
    /// Reason of a status other than `ok`, or the fall.
    pub why: Option<String>,
    /// Time at which the trunk was first below half of its initial height \[s\].
    pub fell_at_s: Option<f64>,
    /// Whether the cost of transport, as printed, is that at a coarser setting; `None` for a walk
    /// at the scenario's step, whose convergence is not examined.
    pub converged: Option<bool>,
    /// Cost of the walk.
    pub cost: Option<Cost>,
}

/// Energy and distance over a window of a walk.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// Start of the window \[s\].
    pub from_s: f64,
    /// End of the window \[s\].
    pub to_s: f64,
    /// Horizontal straight-line displacement of the trunk \[m\].
    pub distance_m: f64,
    /// Mean speed \[m/s\].
    pub speed_m_s: f64,
    /// Net work of the drives on the robot, from the energy balance \[J\].
    pub work_j: f64,
    /// Net work of the drives from torques and angles, as a check \[J\].
    pub drive_work_j: Option<f64>,
    /// Positive work of the drives, each on its own: the consumption without regeneration \[J\].
    pub positive_work_j: Option<f64>,
    /// Energy dissipated by friction \[J\].
    pub dissipated_j: f64,
    /// Energy dissipated by impacts \[J\].
    pub impact_j: f64,
    /// Increase of the stored energy \[J\].
    pub stored_j: f64,
    /// Residual of the energy balance: positive if energy was created, negative if it was lost
    /// \[J\].
    pub residual_j: f64,
    /// Greatest energy created in any tenth of the window \[J\].
    pub appears_most_j: f64,
    /// Greatest energy lost in any tenth of the window, as a positive number \[J\].
    pub vanishes_most_j: f64,
    /// Cost of transport: net work over weight and distance; `None` without displacement.
    pub cost_of_transport: Option<f64>,
    /// Cost of transport if the drives had also supplied the residual.
    pub covered_cost_of_transport: Option<f64>,
    /// Cost of transport from positive work.
    pub positive_cost_of_transport: Option<f64>,
}

impl Transport {
    /// Returns the cost of transport of a walk that ended upright, in its printed digits.
    fn printed_cost(&self) -> Option<String> {
        let upright = self.status == Status::Ok && self.fell_at_s.is_none();
        let cost = self.cost.as_ref().filter(|_| upright)?;
        cost.cost_of_transport.map(|cost| format!("{cost:.3}"))
    }
}

/// Returns the method that stands for a plant: that of its reference which is set as the plant is
/// in scenarios, otherwise the first.
pub(crate) fn usual_method(plant: &PlantOffer) -> Option<&MethodOffer> {
    let mut methods = plant.complete_methods();
    let usual = |method: &&MethodOffer| {
        let set_by = if plant.plant.is_compliant() {
            SettingKind::Tolerance
        } else {
            SettingKind::Step
        };
        method.reference.is_some() && method.set_by == set_by
    };
    methods.clone().find(usual).or_else(|| methods.next())
}

/// Returns the number of walks.
pub(crate) fn parts(plants: &[PlantOffer]) -> usize {
    let walks = |plant: &PlantOffer| plant.complete_methods().count() + 1;
    plants.iter().map(walks).sum()
}

impl Job<'_> {
    /// Computes the cost of transport by each method of each plant.
    pub(crate) fn transports(
        &mut self,
        plants: &[PlantOffer],
    ) -> Result<Vec<Transport>, StudyError> {
        let runs = self.runs;
        let step = runs.context.factory.input().step;
        let mut transports = Vec::new();
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
                let label = format!("{}, cost of transport", plant.plant);
                let content = ("transport", &variant);
                transports.push(self.parts.measure(
                    &label,
                    Weight::Reference,
                    &content,
                    |share| runs.transport(&variant, share),
                )?);
            }
            let label = format!("{}, converged cost of transport", plant.plant);
            let content = ("converged transport", plant);
            let converged = self
                .parts
                .measure(&label, Weight::Reference, &content, |share| {
                    runs.converged_transport(plant, &transports, share)
                })?;
            transports.extend(converged);
        }
        Ok(transports)
    }
}

impl Measured for Transport {}

impl Runs<'_> {
    /// Walks with ever finer settings of the plant's usual method until the cost of transport no
    /// longer changes in its printed digits, or the share is spent; returns the last walk, or none.
    fn converged_transport(
        &self,
        plant: &PlantOffer,
        known: &[Transport],
        share: Share,
    ) -> Vec<Transport> {
        let Some(method) = usual_method(plant) else {
            return Vec::new();
        };
        let of_method = |one: &&Transport| {
            let set_by = if one.key.tolerance.is_some() {
                SettingKind::Tolerance
            } else {
                SettingKind::Step
            };
            (&one.key.plant, &one.key.method, set_by) == (&plant.plant, &method.name, method.set_by)
        };
        let usual = known.iter().find(of_method);
        let Some(mut cost) = usual.and_then(Transport::printed_cost) else {
            return Vec::new();
        };
        let mut setting = match method.set_by {
            SettingKind::Step => MethodSetting::Step(self.context.factory.input().step),
            SettingKind::Tolerance => MethodSetting::Tolerance(TOLERANCE),
        };
        let mut last = None;
        for _ in 0..FINER_MOST {
            setting = setting.finer();
            let variant = Variant {
                plant: plant.plant.clone(),
                method: method.name.clone(),
                setting,
                scales: Scales::AS_IS,
            };
            let mut transport = self.transport(&variant, share);
            let Some(finer) = transport.printed_cost() else {
                break;
            };
            transport.converged = Some(finer == cost);
            cost = finer;
            if last.insert(transport).converged == Some(true) {
                break;
            }
        }
        Vec::from_iter(last)
    }

    fn transport(&self, variant: &Variant, share: Share) -> Transport {
        let input = self.context.factory.input();
        let mut transport = Transport {
            key: variant.into(),
            status: Status::Failed,
            why: None,
            fell_at_s: None,
            converged: None,
            cost: None,
        };
        // The drives are sampled after every step, so that torque times rotation sums to their
        // work.
        let grid = input.step.max(SimDuration::from_nanos(1));
        let end = TRANSPORT_DURATION.min(input.duration);
        let plant_run = PlantRun {
            grid,
            end: SimTime::ZERO + grid * (end.as_nanos() / grid.as_nanos()),
            ..self.context.plant_run(share)
        };
        let walked = self.context.with_drives(variant, |plant| {
            let mut walk = WalkRecorder::of(plant).ok_or("it has no output body/position")?;
            let ending = plant_run.run(plant, |now, plant| walk.sample(now, plant));
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
        transport.cost = walk.cost(plant_run.end.as_secs_f64(), input.weight);
        transport
    }
}

/// Offsets of a drive's signals in the output vector.
#[derive(Clone, Copy)]
struct Drive {
    angle: usize,
    torque: usize,
}

/// Sample of a walk.
#[derive(Clone, Copy)]
struct WalkSample {
    at_s: f64,
    trunk: [f64; 3],
    balance: EnergyBalance,
    /// Work of the drives until then from torques and angles: net, and positive part \[J\].
    drives: [f64; 2],
}

/// Walk, sampled step by step.
struct WalkRecorder {
    outputs: Vec<f64>,
    trunk: usize,
    drives: Vec<Drive>,
    angles: Vec<f64>,
    samples: Vec<WalkSample>,
    fell_at: Option<SimTime>,
}

impl WalkRecorder {
    fn of(plant: &dyn Plant) -> Option<Self> {
        let ports = plant.ports();
        let layout = Layout::of(&ports, Direction::Output);
        let trunk = layout.find(signal::BODY_POSITION)?.start;
        let drives = layout.fields().filter_map(|field| {
            let (leg, name) = signal::parse_leg(&field.port.name)?;
            let (angle, _) = signal::DRIVES.iter().find(|(_, torque)| *torque == name)?;
            Some(Drive {
                angle: layout.find(&signal::of_leg(leg, angle))?.start,
                torque: field.offset,
            })
        });
        let drives: Vec<Drive> = drives.collect();
        Some(Self {
            outputs: vec![0.0; layout.len()],
            trunk,
            angles: vec![0.0; drives.len()],
            drives,
            samples: Vec::new(),
            fell_at: None,
        })
    }

    fn sample(&mut self, now: SimTime, plant: &mut dyn Plant) -> SampleVerdict {
        plant.observe(&mut self.outputs);
        let balance = plant.energy();
        if !balance.stored().is_finite() || self.outputs.iter().any(|output| !output.is_finite()) {
            return SampleVerdict::NotFinite;
        }
        let last = self.samples.last();
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
        self.samples.push(WalkSample {
            at_s: now.as_secs_f64(),
            trunk,
            balance,
            drives,
        });
        let first = self.samples[0].trunk[2];
        if self.fell_at.is_none() && trunk[2] < FALLEN * first {
            self.fell_at = Some(now);
        }
        SampleVerdict::Continue
    }

    /// Returns the cost from the end of the settling time to `end_s`, for a robot of `weight`
    /// \[N\]; `None` without samples.
    fn cost(&self, end_s: f64, weight: f64) -> Option<Cost> {
        let start_s = SETTLING * end_s;
        let at = |at_s: f64| {
            let n = self
                .samples
                .partition_point(|sample| sample.at_s < at_s * (1.0 - 1e-9));
            self.samples.get(n)
        };
        let (from, to) = (at(start_s)?, self.samples.last()?);
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
        let per_distance =
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
            cost_of_transport: per_distance(work),
            covered_cost_of_transport: per_distance(work + residual),
            positive_cost_of_transport: drives[1].and_then(per_distance),
        })
    }
}
