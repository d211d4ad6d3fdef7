//! Exact and grid coupling of a rig whose plant is solved exactly: all errors are those of the
//! coupling.

use std::cell::RefCell;

use twinrig_experiment::{
    CouplingInput, CouplingKind, CouplingMethod, CouplingPlan, CouplingStudy, RigFactory,
    RigVariant, Status, StudyError, coupling,
};
use twinrig_kernel::{Port, SimDuration, SimTime, Unit};
use twinrig_runtime::{
    Coupling, DirectIo, FixedStepCoupling, Plant, PlantFault, Process, Rig, Schedule, Timing,
    WorkCounts,
};

use crate::pages::{elements, machine};

const FOOT: &str = "leg/LF/foot/position";
const PUSH: &str = "leg/LF/foot/push";
/// \[rad/s\]
const OMEGA: f64 = 30.0;
/// Control period, not a multiple of any grid step.
const PERIOD: SimDuration = SimDuration::from_micros(1_013);

/// Foot of 1 kg on a spring, advanced by the exact solution under a constant force.
struct Foot {
    now: SimTime,
    at: [f64; 2],
    pub steps: u64,
    breaks: bool,
}

impl Plant for Foot {
    fn name(&self) -> &'static str {
        "foot"
    }
    fn ports(&self) -> Vec<Port> {
        vec![
            Port::input(PUSH, Unit::Newton, 1),
            Port::output(FOOT, Unit::Meter, 3),
        ]
    }
    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        if self.breaks && to > SimTime::ZERO + SimDuration::from_millis(30) {
            return Err(PlantFault {
                time: self.now,
                part: "foot".to_owned(),
                energy: 0.0,
                why: "it snapped".to_owned(),
            });
        }
        let phase = OMEGA * (to - self.now).as_secs_f64();
        let (sin, cos) = (libm::sin(phase), libm::cos(phase));
        let [x, v] = self.at;
        let rest = inputs[0] / (OMEGA * OMEGA);
        self.at = [
            rest + (x - rest) * cos + v / OMEGA * sin,
            v * cos - (x - rest) * OMEGA * sin,
        ];
        (self.now, self.steps) = (to, self.steps + 1);
        Ok(())
    }
    fn observe(&mut self, outputs: &mut [f64]) {
        outputs.copy_from_slice(&[self.at[0], 0.0, 0.0]);
    }
    fn work(&self) -> WorkCounts {
        WorkCounts::of_steps(self.steps)
    }
}

/// Controller with proportional and derivative feedback of the foot position.
struct Damper([f64; 2]);

impl Process for Damper {
    fn name(&self) -> &'static str {
        "damper"
    }
    fn ports(&self) -> Vec<Port> {
        vec![
            Port::input(FOOT, Unit::Meter, 3),
            Port::output(PUSH, Unit::Newton, 1),
        ]
    }
    fn step(&mut self, elapsed: SimDuration, inputs: &[f64], outputs: &mut [f64]) {
        let seconds = elapsed.as_secs_f64().max(1e-3);
        let went = (inputs[0] - self.0[0]) / seconds;
        self.0 = [inputs[0], went];
        outputs[0] = -100.0 * inputs[0] - 5.0 * went;
    }
}

pub struct Rigs {
    input: CouplingInput,
    plants: Vec<String>,
    /// Plant steps of the rigs built.
    pub steps: RefCell<Vec<SimDuration>>,
}

pub fn rigs(plants: &[&str], buses: &[&str]) -> Rigs {
    Rigs {
        input: CouplingInput {
            name: "a <foot>".to_owned(),
            file: "foot.toml".to_owned(),
            duration: SimDuration::from_millis(400),
            period: PERIOD,
            buses: buses.iter().map(|&bus| bus.to_owned()).collect(),
        },
        plants: plants.iter().map(|&plant| plant.to_owned()).collect(),
        steps: RefCell::default(),
    }
}

impl RigFactory for Rigs {
    fn input(&self) -> &CouplingInput {
        &self.input
    }
    fn plants(&self) -> &[String] {
        &self.plants
    }
    fn rig(&self, variant: &RigVariant<'_>) -> Result<Rig, String> {
        self.steps.borrow_mut().push(variant.step);
        if variant.plant == "none" {
            return Err("there is no such foot".to_owned());
        }
        let foot = Foot {
            now: SimTime::ZERO,
            at: [0.1, 0.0],
            steps: 0,
            breaks: variant.plant == "brittle",
        };
        let plant: Box<dyn Plant> = match variant.coupling {
            Coupling::Exact => Box::new(foot),
            Coupling::Grid { step, inputs } => {
                Box::new(FixedStepCoupling::new(Box::new(foot), step, inputs, &|_| true).unwrap())
            }
        };
        let process = Damper([0.1, 0.0]);
        let transfer = Timing::Constant(SimDuration::from_micros(300));
        let io = DirectIo::for_process("direct", &process.ports(), transfer, 7).unwrap();
        let schedule = Schedule {
            observe: variant.observe,
            ..Schedule::with_period(PERIOD)
        };
        let rig = Rig::new(&schedule, Box::new(process), vec![Box::new(io)], plant);
        rig.map_err(|error| error.to_string())
    }
}

pub fn plan() -> CouplingPlan {
    CouplingPlan {
        steps: [4_000, 2_000, 1_000, 500, 250, 125]
            .map(SimDuration::from_micros)
            .into(),
        repetitions: 1,
        budget_s: 1e6,
        ..CouplingPlan::default()
    }
}

fn found(plants: &[&str], buses: &[&str]) -> CouplingStudy {
    coupling(&rigs(plants, buses), &plan(), &mut ()).unwrap()
}

#[test]
fn grid_orders_match_theory_and_exact_coupling_has_no_error() {
    let study = found(&["foot"], &["sbcp"]);
    // Three methods with the plant stepping with the grid, two of the coupling alone, six steps
    // each.
    assert_eq!(study.rows.len(), 30);
    assert!(study.rows.iter().all(|row| row.status == Status::Ok));
    for row in study.series(CouplingKind::Together, "foot", CouplingMethod::Exact) {
        // Rounding error of 400 observations and as many transfers.
        assert!(row.error_max_m.unwrap() < 1e-12, "{row:?}");
    }
    let order = |method| study.order("foot", method).unwrap();
    let (mean, held) = (order(CouplingMethod::Grid), order(CouplingMethod::GridHeld));
    // Half of the difference between neighbouring orders: the transfers fall anywhere in the grid
    // intervals.
    assert!((mean - 2.0).abs() < 0.5, "{mean}");
    assert!((held - 1.0).abs() < 0.3, "{held}");
    let at = |method| {
        let mut rows = study.series(CouplingKind::Alone, "foot", method);
        rows.find(|row| row.step_s == 5e-4).unwrap().clone()
    };
    let (mean, held) = (at(CouplingMethod::Grid), at(CouplingMethod::GridHeld));
    assert!(20.0 * mean.error_rms_m.unwrap() < held.error_rms_m.unwrap());
    // 2000 steps per second, independent of the instants of access.
    assert_eq!(mean.steps, Some(800));
    assert_eq!(held.steps, Some(800));
}

#[test]
fn plant_step_is_that_of_the_grid_or_of_the_reference() {
    let rigs = rigs(&["foot"], &[]);
    let plan = plan();
    let study = coupling(&rigs, &plan, &mut ()).unwrap();
    for row in &study.rows {
        let coupling_only = row.kind == CouplingKind::Alone;
        let plant_step = if coupling_only { 2.5e-5 } else { row.step_s };
        assert!((row.plant_step_s - plant_step).abs() < 1e-12, "{row:?}");
    }
    // The reference and its check, then each row once for its result and once for its run time.
    let steps = rigs.steps.borrow();
    assert_eq!(steps[..2], [plan.fine, plan.fine * 2]);
    assert_eq!(steps.len(), 2 + 2 * study.rows.len());
}

#[test]
fn missing_bus_is_reported() {
    assert!(found(&["foot"], &["sbcp"]).left_out.is_empty());
    let study = found(&["foot"], &[]);
    assert!(study.left_out[0].contains("no bus"), "{:?}", study.left_out);
}

#[test]
fn failures_are_rows_with_reasons() {
    let study = found(&["none", "brittle"], &[]);
    let (none, brittle) = study.rows.split_at(study.rows.len() / 2);
    for (rows, why) in [(none, "no such foot"), (brittle, "it snapped")] {
        for row in rows {
            assert_eq!(row.status, Status::Failed);
            assert!(row.why.as_ref().unwrap().contains(why), "{row:?}");
        }
    }
    assert!(study.references.iter().all(|note| note.method.is_none()));
    assert!(study.headline().contains("No coupling keeps"));
    let none = coupling(&rigs(&[], &[]), &plan(), &mut ());
    assert_eq!(none.unwrap_err(), StudyError::NoPlant);
    let short = CouplingPlan {
        duration: Some(SimDuration::from_millis(3)),
        ..plan()
    };
    let short = coupling(&rigs(&["foot"], &[]), &short, &mut ());
    assert!(matches!(short, Err(StudyError::TooShort { .. })));
}

#[test]
fn json_csv_and_page_contain_every_row() {
    let study = found(&["foot", "brittle"], &["sbcp"]);
    let json = study.json(&machine(), "twin study coupling");
    let keys: Vec<&String> = json.as_object().unwrap().keys().take(5).collect();
    assert_eq!(keys, ["study", "scenario", "machine", "reference", "rows"]);
    let row = json["rows"][0].as_object().unwrap();
    let first: Vec<&String> = row.keys().take(11).collect();
    assert_eq!(
        first,
        [
            "plant",
            "method",
            "step_s",
            "stiffness",
            "status",
            "error_rms_m",
            "error_max_m",
            "largest_stable_step_s",
            "cost_per_step_s",
            "run_s_per_simulated_s",
            "evaluations"
        ]
    );
    assert_eq!(json["rows"].as_array().unwrap().len(), study.rows.len());
    let csv = study.csv();
    assert_eq!(csv.lines().count(), study.rows.len() + 1);
    assert!(csv.starts_with("plant,method,step_s,stiffness,status,"));
    let page = study.page(&machine(), "twin study <coupling>").html();
    let elements = elements(&page);
    for expected in ["svg", "table", "polyline", "title"] {
        assert!(
            elements.iter().any(|name| name == expected),
            "no {expected}"
        );
    }
    assert!(page.contains("it snapped") && page.contains("a &lt;foot&gt;"));
    assert!(!page.contains("NaN"));
}

#[test]
fn truncated_runs_are_marked_cut_not_failed() {
    // Rows as they result on a machine that is too slow for the budget.
    let mut study = found(&["foot"], &["sbcp"]);
    for row in &mut study.rows {
        (row.status, row.cut, row.error_rms_m) = (Status::Failed, true, None);
        row.why = Some("too slow".to_owned());
    }
    assert!(study.rows.iter().all(|row| row.word() == "cut"));
    let page = study.page(&machine(), "").html();
    elements(&page);
    for text in [
        "class=\"strip cut\"",
        "<span class=\"tag\">cut</span>",
        "0 completed, 30 were cut for the budget: see the table",
        "mean commands no slope (too few points), held commands no slope (too few points)",
    ] {
        assert!(page.contains(text), "{text}");
    }
    for text in ["class=\"strip\"", "failed", "tag bad", "class=\"bad\""] {
        assert!(!page.contains(text), "{text}");
    }
    // A fault is still a failure.
    let broken = found(&["brittle"], &[]).page(&machine(), "").html();
    assert!(broken.contains("class=\"strip\"") && broken.contains("tag bad\">failed"));
}

#[test]
fn headline_and_table_show_equal_figures() {
    let study = found(&["foot"], &[]);
    let headline = study.headline();
    let speeds: Vec<&str> = headline
        .split(" at ")
        .filter_map(|part| part.split_once(" real time"))
        .map(|(speed, _)| speed)
        .collect();
    assert_eq!(speeds.len(), 2, "{headline}");
    let page = study.page(&machine(), "").html();
    for speed in speeds {
        assert!(
            page.contains(&format!("<td class=\"n\">{speed}</td>")),
            "{speed}"
        );
    }
    assert!(headline.contains("RMS error of the feet"));
}
