//! Runs of a study of robustness: scenarios, each on a plant, from perturbed starts.

use std::path::{Path, PathBuf};

use twinrig_kernel::{SimDuration, SimTime, Unit, signal};
use twinrig_rig::assembly::Assembly;
use twinrig_rig::registry::Registry;
use twinrig_rig::run::observers::{RunLayouts, RunObserver};
use twinrig_runtime::Group;
use twinrig_scenario::{Footstep, Setting, Varied};

use super::options::RobustnessOptions;
use crate::ensemble::Ensemble;
use crate::error::Error;
use crate::gait::scene::{left_out, plants};
use crate::plants::selection::of_plant;
use crate::{MemberRun, RobustnessCase, RobustnessPlan, RobustnessRunner, Trajectory};

/// Greatest number of instants of a trajectory.
const INSTANTS: u64 = 2000;

/// Scenarios on plants.
pub(crate) struct RobustnessCases<'r> {
    ensembles: Vec<Ensemble<Assembly<'r>>>,
    cases: Vec<RobustnessCase>,
    /// Scenario file of each case, and its plant if it is not that of the file.
    files: Vec<(PathBuf, Option<String>)>,
    left_out: Vec<String>,
    runs: usize,
}

impl<'r> RobustnessCases<'r> {
    /// Reads the scenarios; one that a plant cannot simulate is left out.
    ///
    /// # Errors
    /// The error of the first of them, if all are left out.
    pub(crate) fn new(
        registry: &'r Registry,
        options: &RobustnessOptions,
        settings: &[Setting],
    ) -> Result<Self, Error> {
        let mut cases = Self {
            ensembles: Vec::new(),
            cases: Vec::new(),
            files: Vec::new(),
            left_out: Vec::new(),
            runs: options.ensemble,
        };
        let mut first_error = None;
        for path in &options.scenarios {
            for plant in plants(&options.plant) {
                if let Err(error) = cases.add(registry, path, settings, plant) {
                    let name = path.display().to_string();
                    cases.left_out.push(left_out(&name, plant, &error));
                    first_error.get_or_insert(error);
                }
            }
        }
        match first_error {
            Some(error) if cases.cases.is_empty() => Err(error),
            _ => Ok(cases),
        }
    }

    pub(crate) fn plan(options: &RobustnessOptions) -> RobustnessPlan {
        RobustnessPlan {
            runs: options.ensemble,
            tolerance: options.tolerance,
            jobs: options.jobs,
        }
    }

    fn add(
        &mut self,
        registry: &'r Registry,
        path: &Path,
        settings: &[Setting],
        plant: Option<&str>,
    ) -> Result<(), Error> {
        let assembly = match plant {
            Some(plant) => of_plant(registry, path, settings, plant)?,
            None => Assembly::of_file(registry, path, settings)?,
        };
        let mut scenario = assembly.scenario().clone();
        scenario.record.signals = Some(Vec::new());
        scenario.record.frames = None;
        let positions = positions(&assembly);
        let names: Vec<String> = positions.iter().map(|(name, _)| name.clone()).collect();
        let assembly = assembly.with_scenario(&scenario, &names)?;
        let ensemble = Ensemble::new(assembly, self.runs, Varied::Start)?;
        let (kind, why_seeds) = (ensemble.kind(), ensemble.why_seeds().map(str::to_owned));
        let has = |unit| positions.iter().any(|(_, it)| *it == unit);
        self.cases.push(RobustnessCase {
            scenario: scenario.name.clone(),
            file: scenario.file.clone(),
            plant: scenario.plant.model.clone(),
            kind,
            why_seeds,
            unit: [Unit::Meter, Unit::Radian]
                .into_iter()
                .find(|unit| has(*unit))
                .map(|unit| unit.symbol().to_owned()),
            duration_s: scenario.duration.as_secs_f64(),
        });
        self.ensembles.push(ensemble);
        self.files.push((path.to_owned(), plant.map(str::to_owned)));
        Ok(())
    }

    /// Returns the scenario file of each case, and its plant if it is not that of the file.
    pub(crate) fn files(&self) -> &[(PathBuf, Option<String>)] {
        &self.files
    }
}

impl RobustnessRunner for RobustnessCases<'_> {
    fn cases(&self) -> &[RobustnessCase] {
        &self.cases
    }

    fn left_out(&self) -> &[String] {
        &self.left_out
    }

    fn run(&self, case: usize, member: usize) -> Result<MemberRun, String> {
        let ensemble = &self.ensembles[case];
        let mut observer = TrajectoryObserver::new(ensemble.assembly());
        let row = ensemble.run(member, Some(&mut observer));
        let row = row.map_err(|error| error.to_string())?;
        Ok(observer.finish(row))
    }
}

/// Returns the observed positions of a plant with their units: trunk and feet, or of a plant
/// without them all positions and lifts.
fn positions(assembly: &Assembly<'_>) -> Vec<(String, Unit)> {
    let of = |ends: &[&str]| -> Vec<(String, Unit)> {
        let outputs = assembly.plant_outputs().iter();
        let found = outputs.filter(|port| {
            let has_end = |end: &&str| port.name.ends_with(end);
            ends.iter().any(has_end) && [Unit::Meter, Unit::Radian].contains(&port.unit)
        });
        found.map(|port| (port.name.clone(), port.unit)).collect()
    };
    let trunk_and_feet = of(&[signal::BODY_POSITION, signal::FOOT_POSITION]);
    if trunk_and_feet.is_empty() {
        of(&["/position", "/lift"])
    } else {
        trunk_and_feet
    }
}

/// Keeps positions and the times of touch-downs.
struct TrajectoryObserver {
    names: Vec<String>,
    period: SimDuration,
    next: SimTime,
    /// Ranges in the samples of the plant.
    ranges: Vec<std::ops::Range<usize>>,
    trajectory: Trajectory,
    /// Leg and time.
    touch_downs: Vec<(usize, SimTime)>,
}

impl TrajectoryObserver {
    fn new(assembly: &Assembly<'_>) -> Self {
        let scenario = assembly.scenario();
        let names = positions(assembly).into_iter().map(|(name, _)| name);
        Self {
            names: names.collect(),
            period: SimDuration::from_nanos(scenario.duration.as_nanos() / INSTANTS),
            next: SimTime::ZERO,
            ranges: Vec::new(),
            trajectory: Trajectory::default(),
            touch_downs: Vec::new(),
        }
    }

    fn finish(self, row: twinrig_campaign::sweep::SweepRow) -> MemberRun {
        let touch_downs = self.touch_downs.iter().enumerate();
        let strides = touch_downs.filter_map(|(index, (leg, at))| {
            let mut later = self.touch_downs[index + 1..].iter();
            let (_, next) = later.find(|(other, _)| other == leg)?;
            Some((*next - *at).as_secs_f64())
        });
        MemberRun {
            row,
            strides_s: strides.collect(),
            trajectory: self.trajectory,
        }
    }
}

impl RunObserver for TrajectoryObserver {
    fn begin(&mut self, layouts: &RunLayouts<'_>) {
        let layout = layouts.layout(Group::Plant);
        let names = self.names.iter();
        self.ranges = names.filter_map(|name| layout.find(name)).collect();
        self.trajectory.sizes = self.ranges.iter().map(ExactSizeIterator::len).collect();
    }

    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        if group != Group::Plant || now < self.next {
            return;
        }
        self.next = now + self.period;
        self.trajectory.at_s.push(now.as_secs_f64());
        for range in &self.ranges {
            let values = &values[range.clone()];
            self.trajectory.values.extend_from_slice(values);
        }
    }

    fn footstep(&mut self, footstep: &Footstep) {
        self.touch_downs.push((footstep.leg, footstep.touch_down));
    }
}
