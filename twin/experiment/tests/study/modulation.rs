//! Footstep modulation of an ideal gait with a closed form.

use std::f64::consts::PI;

use proptest::prelude::*;
use twinrig_experiment::{
    Counting, FootContact, GaitRun, ModelForm, Modulation, ModulationCase, ModulationInput,
    ModulationPlan, ModulationRun, ModulationStudy, StudyError, VariableChange,
};
use twinrig_kernel::{SimDuration, SimTime, Unit};

use crate::pages::{elements, machine};

const PERIOD: f64 = 0.25;
const DUTY: f64 = 0.6;
const STEP: f64 = 0.12;
/// Share of the cycle at which each leg touches down: no two alike.
const PHASES: [f64; 4] = [0.0, 0.13, 0.5, 0.77];

/// Feet that stand still on the ground while they move by the step length in the share `DUTY` of
/// the cycle, and land half a step length ahead of the hip.
struct IdealGait {
    input: ModulationInput,
    /// Direction of travel \[rad\].
    heading: f64,
    /// Contacts of a footstep after a change.
    bounces_after: usize,
    /// Contacts of a footstep before it.
    bounces: usize,
    fails: fn(Option<VariableChange>) -> Option<String>,
    falls: fn(Option<VariableChange>) -> bool,
}

impl IdealGait {
    fn new() -> Self {
        let case = ModulationCase {
            gait: "an <ideal> gait".to_owned(),
            plant: "none".to_owned(),
            factor: "as given".to_owned(),
            after: SimTime::ZERO + SimDuration::from_secs(2),
            value: STEP,
            duty: Some(DUTY),
        };
        Self {
            input: ModulationInput {
                name: "an <ideal> gait".to_owned(),
                files: vec!["ideal.toml".to_owned()],
                variable: "step_length".to_owned(),
                unit: Unit::Meter,
                cases: vec![case],
                left_out: Vec::new(),
            },
            heading: 0.3,
            bounces_after: 1,
            bounces: 1,
            fails: |_| None,
            falls: |_| false,
        }
    }

    fn study(&self, plan: &ModulationPlan) -> ModulationStudy {
        self.modulation(plan).unwrap()
    }

    /// Does both rounds of a study.
    fn modulation(&self, plan: &ModulationPlan) -> Result<ModulationStudy, StudyError> {
        let runs = |runs: Vec<ModulationRun>| runs.into_iter().map(|run| self.run(run)).collect();
        let references = runs(Modulation::references(&self.input));
        let modulation = Modulation::new(&self.input, plan, references)?;
        let changed = runs(modulation.changed());
        Ok(modulation.finish(changed))
    }

    fn run(&self, run: ModulationRun) -> Result<GaitRun, String> {
        let ModulationRun { change, end, .. } = run;
        if let Some(why) = (self.fails)(change) {
            return Err(why);
        }
        let at_s = change.map_or(f64::INFINITY, |change| change.at.as_secs_f64());
        let by = change.map_or(0.0, |change| change.by);
        let hip = |time: f64| {
            let speed = |step: f64| step / (DUTY * PERIOD);
            time * speed(STEP) + (time - at_s).max(0.0) * speed(by)
        };
        let mut run = GaitRun {
            legs: ["LF", "RF", "LH", "RH"].map(str::to_owned).into(),
            end_s: end.as_secs_f64(),
            fell_at_s: (self.falls)(change).then_some(at_s + 5.2 * PERIOD),
            ..GaitRun::default()
        };
        for cycle in 0..200 {
            for (leg, phase) in PHASES.into_iter().enumerate() {
                let time = (f64::from(cycle) + phase) * PERIOD;
                if time > run.end_s {
                    continue;
                }
                let step = if time > at_s { STEP + by } else { STEP };
                let ahead = hip(time) + 0.5 * step;
                let contact = FootContact {
                    leg,
                    touch_down_s: time,
                    lift_off_s: Some(time + DUTY * PERIOD),
                    position_m: [
                        ahead * libm::cos(self.heading),
                        ahead * libm::sin(self.heading),
                        0.0,
                    ],
                    impulse_n_s: 1.0,
                    slip_m: 0.0,
                };
                run.footsteps.push(contact);
                let bounces = if time > at_s {
                    self.bounces_after
                } else {
                    self.bounces
                };
                run.contacts.extend((0..bounces).map(|bounce| FootContact {
                    touch_down_s: time + 0.01 * bounce as f64,
                    ..contact
                }));
            }
        }
        Ok(run)
    }
}

fn plan(changes: &[f64]) -> ModulationPlan {
    ModulationPlan {
        changes: changes.to_vec(),
        ..ModulationPlan::default()
    }
}

#[test]
fn ideal_gait_has_the_slope_of_geometry() {
    let study = IdealGait::new().study(&ModulationPlan::default());
    let case = &study.cases[0];
    let ideal = case.ideal.unwrap();
    assert!((ideal.by_duty - 1.0 / DUTY).abs() < 1e-12);
    assert!((ideal.by_stride - 1.0 / DUTY).abs() < 1e-9);
    for counting in Counting::ALL {
        let table = case.table(counting).unwrap();
        let model = table.model(ModelForm::BilinearWithFirstStep).unwrap();
        // The points divide the cycle of the first leg evenly; those of the others by a multiple
        // of a tenth and a remainder, of which the mean is at most a twentieth of a cycle off.
        assert!((model.slope * DUTY - 1.0).abs() < 1e-6, "{model:?}");
        let first = ideal.first_step;
        assert!((model.second - first).abs() < 0.05 / DUTY, "{model:?}");
        assert_eq!(table.first_step, Some(1.0));
        assert_eq!((table.opposite, table.missing()), (None, 0));
        // Points scatter half a cycle about the mean, which later footsteps exceed tenfold.
        let r_squared: Vec<f64> = table.r_squared.iter().map(|it| it.unwrap()).collect();
        assert!(
            r_squared.is_sorted() && r_squared[0] > 0.5 && r_squared[9] > 0.99,
            "{r_squared:?}"
        );
    }
}

#[test]
fn no_change_displaces_nothing_and_a_fall_or_failure_is_counted() {
    let gait = IdealGait {
        fails: |change| {
            let fails = change.is_some_and(|change| change.by == -0.02);
            fails.then(|| "refused".to_owned())
        },
        falls: |change| change.is_some_and(|change| change.by == -0.01),
        ..IdealGait::new()
    };
    let study = gait.study(&plan(&[0.0, -0.01, -0.02, -0.03]));
    let case = &study.cases[0];
    assert_eq!((case.runs, case.fell, case.failed.len()), (40, 10, 10));
    assert_eq!(study.error(), None);
    let none = gait.study(&plan(&[-0.02])).error().unwrap();
    assert!(none.ends_with("none of 10 re-runs has a result: refused"));
    for table in &case.tables {
        for step in 1..=10 {
            let cell = table.cell(0.0, step).unwrap();
            assert_eq!((cell.mean_m, cell.range_m, cell.count), (0.0, [0.0; 2], 40));
            // Footsteps after the fall have no displacement; failed runs have no footsteps at all.
            let fallen = table.cell(-0.01, step).unwrap();
            assert_eq!(fallen.count + fallen.missing, 40);
            assert_eq!(fallen.missing > 0, step > 5, "{fallen:?}");
            assert_eq!(table.cell(-0.02, step).unwrap().count, 0);
        }
        // Without change there is no direction.
        assert_eq!(table.first_step, Some(1.0));
    }
    let headline = study.headline();
    assert!(
        headline.contains("Of 40 re-runs 10 fell and 10 failed."),
        "{headline}"
    );
}

/// Feet that bounce before the change and not after it: the same number of the touch-down is a
/// later cycle, ahead by strides.
#[test]
fn counting_bounces_turns_a_linear_displacement_against_the_change() {
    let gait = IdealGait {
        bounces: 2,
        ..IdealGait::new()
    };
    let gait = IdealGait {
        // Only the runs with a change have fewer bounces.
        bounces_after: 1,
        ..gait
    };
    let study = gait.study(&plan(&[-0.0025, -0.04]));
    let [cycle, touch_down] = Counting::ALL.map(|it| study.cases[0].table(it).unwrap());
    assert_eq!(cycle.opposite, None);
    let opposite = touch_down.opposite.unwrap();
    // Touch-down 10 is cycle 10 here and cycle 5 in the reference.
    let ahead = 5.0 * STEP / DUTY;
    assert_eq!((opposite.by, opposite.step), (-0.0025, 10));
    assert!((opposite.mean_m / ahead - 1.0).abs() < 0.1, "{opposite:?}");
    assert!(ModulationStudy::is_erratic(touch_down) && !ModulationStudy::is_erratic(cycle));
}

#[test]
fn page_and_data_have_every_displacement() {
    let gait = IdealGait {
        bounces: 2,
        ..IdealGait::new()
    };
    let study = gait.study(&plan(&[-0.01, -0.02]));
    let page = study.page(&machine(), "twin study <modulation>").html();
    let elements = elements(&page);
    assert_eq!(elements.iter().filter(|it| *it == "figure").count(), 4);
    assert!(elements.contains(&"polygon".to_owned()));
    let csv = study.csv();
    // Two ways of counting, two changes, ten points, four legs, ten footsteps.
    assert_eq!(csv.lines().count(), 1 + 2 * 2 * 10 * 4 * 10);
    assert!(
        csv.starts_with("gait,plant,factor,counting,by,point,change_s,leg,step,displacement_m")
    );
    let json = study.json(&machine(), "twin study modulation");
    assert_eq!(json["cases"][0]["tables"][1]["counting"], "touch-down");
    assert_eq!(json["unit"], "m");
}

#[test]
fn unsuitable_reference_is_an_error_with_the_reason() {
    let mut short = IdealGait::new();
    short.input.cases[0].after = SimTime::ZERO + SimDuration::from_secs(49);
    let fallen = IdealGait {
        falls: |_| true,
        ..IdealGait::new()
    };
    for (gait, why) in [
        (short, "footsteps of leg LF"),
        // 20 s after the begin of the limit cycle.
        (fallen, "s of 22 s"),
    ] {
        let error = gait.modulation(&ModulationPlan::default()).unwrap_err();
        assert!(
            matches!(&error, StudyError::Run(text) if text.contains(why)),
            "{error}"
        );
    }
}

#[test]
fn case_without_a_reference_leaves_the_others_as_they_are() {
    let mut gait = IdealGait::new();
    let case = gait.input.cases[0].clone();
    let plan = plan(&[-0.01]);
    let alone = gait.study(&plan);
    gait.input.cases.push(case);
    let second = gait.run(Modulation::references(&gait.input)[1]);
    let references = vec![Err("refused".to_owned()), second];
    let modulation = Modulation::new(&gait.input, &plan, references).unwrap();
    let changed = modulation.changed().into_iter();
    let study = modulation.finish(changed.map(|run| gait.run(run)).collect());
    assert_eq!(study.cases[0].why.as_deref(), Some("refused"));
    assert_eq!(study.cases[1], alone.cases[0]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    /// The displacement is along the heading, whichever that is.
    #[test]
    fn direction_of_travel_has_no_effect(heading in -PI..PI) {
        let study = |heading| IdealGait { heading, ..IdealGait::new() }.study(&plan(&[-0.01]));
        let (ahead, turned) = (study(0.0), study(heading));
        let both = ahead.cases[0].displacements.iter().zip(&turned.cases[0].displacements);
        for (a, b) in both {
            prop_assert!((a.along_m.unwrap() - b.along_m.unwrap()).abs() < 1e-12);
        }
    }
}
