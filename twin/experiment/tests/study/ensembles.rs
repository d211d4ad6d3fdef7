//! Ensembles of a walking plant whose gait is known in closed form.

use twinrig_experiment::{
    Commands, Ensemble, PlantFactory, PrecisionPlan, Study, StudyInput, precision,
};
use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit};
use twinrig_rig::{MethodOffer, PlantId, PlantOffer, SettingKind, Variant};
use twinrig_runtime::{EnergyBalance, Plant, PlantFault, PlantState};

/// Period of the strides, and the stance share of each \[s\].
const STRIDE_S: f64 = 0.4;
const DUTY: f64 = 0.6;
/// Phase of the second leg.
const PHASE: f64 = 0.25;
/// Change of the speed per distance of the start from the origin \[1/s\].
const GAIN: f64 = 1e4;

/// Load of a foot in stance \[N\], its penetration and its clearance in swing \[m\], and the
/// friction along the motion as a share of the load.
const LOAD: f64 = 2.0;
const DEEP: f64 = 1e-3;
const CLEARANCE: f64 = 0.01;
const PUSH: f64 = 0.5;

/// Two legs that step by a clock; the speed depends on the place of the start.
struct Pacer {
    speed: f64,
    start: f64,
    now: SimTime,
}

impl Plant for Pacer {
    fn name(&self) -> &'static str {
        "pacer"
    }

    fn ports(&self) -> Vec<Port> {
        let leg = |leg| {
            [
                Port::output(format!("leg/{leg}/foot/position"), Unit::Meter, 3),
                Port::output(format!("leg/{leg}/foot/load"), Unit::Newton, 1),
                Port::output(format!("leg/{leg}/foot/force"), Unit::Newton, 3),
                Port::output(format!("leg/{leg}/foot/clearance"), Unit::Meter, 1),
            ]
        };
        let own = [
            Port::input("leg/A/hip/position", Unit::Radian, 1),
            Port::output("body/position", Unit::Meter, 3),
        ];
        own.into_iter().chain(leg("A")).chain(leg("B")).collect()
    }

    fn advance(&mut self, to: SimTime, _: &[f64]) -> Result<(), PlantFault> {
        self.now = to;
        Ok(())
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        let t = self.now.as_secs_f64();
        let x = self.speed * t;
        outputs[..3].copy_from_slice(&[x, 0.0, 0.1]);
        for (n, leg) in outputs[3..].chunks_mut(8).enumerate() {
            // Half a millisecond away from the samples.
            let strides = (t + 5e-4) / STRIDE_S - PHASE * n as f64 + 1.0;
            let stance = strides - libm::floor(strides) < DUTY;
            let (load, clearance) = if stance {
                (LOAD, -DEEP)
            } else {
                (0.0, CLEARANCE)
            };
            leg.copy_from_slice(&[x, 0.0, clearance, load, PUSH * load, 0.0, load, clearance]);
        }
    }

    fn energy(&self) -> EnergyBalance {
        EnergyBalance::default()
    }

    fn state(&self) -> Option<PlantState> {
        Some(PlantState::at(self.now).with("body/position", &[0.0; 3]))
    }

    fn resume_from(&mut self, from: &PlantState) -> Result<Vec<String>, PlantFault> {
        self.start = from.get("body/position").unwrap()[0];
        self.speed += GAIN * self.start;
        Ok(Vec::new())
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&self.now)
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.now = snapshot.read()?;
        Ok(())
    }
}

/// Stiffness of the soles in the robot file, half of that of the plant \[N/m\].
const STIFFNESS: f64 = 1e3;

struct Pacers {
    input: StudyInput,
    speeds: Vec<(PlantId, f64)>,
    plants: Vec<PlantOffer>,
}

/// Plants by name, with their speeds \[m/s\]; the last one depends on its step.
const SPEEDS: [(&str, f64); 4] = [
    ("one", 0.5),
    ("same", 0.5),
    ("faster", 0.6),
    ("coarse", 0.5),
];

impl Pacers {
    fn new(speeds: Vec<(PlantId, f64)>) -> Self {
        let mut commands = Commands::of(&[Port::input("leg/A/hip/position", Unit::Radian, 1)]);
        for n in 0..10_u64 {
            let at = SimTime::ZERO + SimDuration::from_millis(4) * n;
            commands.hold(at, &[if n.is_multiple_of(2) { 0.0 } else { 1.0 }]);
        }
        let plants = speeds.iter().map(|(plant, _)| PlantOffer {
            plant: plant.clone(),
            about: String::new(),
            segment_masses: true,
            model_of: None,
            peer: None,
            methods: vec![MethodOffer {
                name: "only".to_owned(),
                about: String::new(),
                set_by: SettingKind::Step,
                reference: None,
                step_only: false,
                tabulated: false,
            }],
        });
        Self {
            input: StudyInput {
                name: "a walk".to_owned(),
                file: "walk.toml".to_owned(),
                duration: SimDuration::from_secs(5),
                ground: true,
                servos: true,
                commands,
                step: SimDuration::from_millis(2),
                friction: Some(0.4),
                sole_stiffness: Some(STIFFNESS),
                weight: 10.0,
            },
            plants: plants.collect(),
            speeds,
        }
    }
}

impl PlantFactory for Pacers {
    fn input(&self) -> &StudyInput {
        &self.input
    }

    fn plants(&self) -> &[PlantOffer] {
        &self.plants
    }

    fn build(&self, variant: &Variant) -> Result<Box<dyn Plant>, String> {
        let mut speeds = self.speeds.iter();
        let (_, speed) = speeds.find(|(plant, _)| variant.plant == *plant).unwrap();
        let mut speed = *speed;
        if variant.plant == "coarse" {
            speed += 1e4 * variant.setting.step_s().unwrap();
        }
        Ok(Box::new(Pacer {
            speed,
            start: 0.0,
            now: SimTime::ZERO,
        }))
    }
}

fn study(ensemble: usize) -> Study {
    let plan = PrecisionPlan {
        steps: vec![SimDuration::from_millis(2)],
        tolerances: Vec::new(),
        ensemble,
        repetitions: 1,
        budget_s: 1e6,
        ..PrecisionPlan::default()
    };
    let speeds = SPEEDS.map(|(name, speed)| (PlantId::new(name), speed));
    precision(&Pacers::new(speeds.into()), &plan, &mut ()).unwrap()
}

fn of<'a>(study: &'a Study, plant: &str) -> &'a Ensemble {
    let mut all = study.ensembles.iter();
    all.find(|one| one.key.plant == *plant).unwrap()
}

fn mean(ensemble: &Ensemble, name: &str) -> [f64; 3] {
    let mut all = ensemble.quantities.iter();
    let found = all.find(|one| one.quantity == name).unwrap().interval;
    [found.low, found.mean, found.high]
}

#[test]
fn quantities_are_those_of_the_gait() {
    let study = study(30);
    let one = of(&study, "one");
    assert_eq!((one.completed, one.fell, one.failed), (30, 0, 0), "{one:?}");
    assert_eq!(one.simulated_s, 5.0);
    let [low, speed, high] = mean(one, "speed");
    // Starts within a micrometre of the origin: speeds within 0.01 m/s.
    assert!(low < 0.5 && 0.5 < high && high - low < 0.01, "{one:?}");
    assert!(high - low > 1e-4, "starts are not perturbed: {one:?}");
    let [_, duty, _] = mean(one, "duty factor");
    assert!((duty - DUTY).abs() < 2e-3, "{duty}");
    let [_, phase, _] = mean(one, "phase B");
    assert!((phase - PHASE).abs() < 1e-9, "{phase}");
    // Every step of a walk is the same.
    let [_, spread, _] = mean(one, "footstep spread");
    assert!(spread < 1e-12, "{spread}");
    // The same starts for every plant.
    assert_eq!(mean(of(&study, "same"), "speed"), [low, speed, high]);
}

#[test]
fn models_differ_where_intervals_and_method_errors_do_not_overlap() {
    let study = study(30);
    let differ = study.ensemble_differences();
    let differ: Vec<_> = differ
        .iter()
        .map(|one| (one.quantity.as_str(), one.models.clone()))
        .collect();
    let pair = |first: &str, second: &str| ("speed", [first, second].map(str::to_owned));
    // The step of the last plant changes its speed by as much as it differs from the others.
    assert_eq!(differ, [pair("one", "faster"), pair("same", "faster")]);
    let coarse = of(&study, "coarse").quantities.iter();
    let speed = coarse.clone().find(|one| one.quantity == "speed").unwrap();
    let error = 1e4 * of(&study, "coarse").key.step_s.unwrap();
    assert!(
        (speed.method_error.unwrap() / error - 1.0).abs() < 1e-2,
        "{speed:?}"
    );
    let page = study
        .page(
            &twinrig_experiment::Machine::here("test", "release"),
            "test",
        )
        .html();
    assert!(
        page.contains("speed: one and faster; same and faster."),
        "{page}"
    );
}

#[test]
fn no_ensemble_is_computed_if_none_is_requested() {
    assert!(study(0).ensembles.is_empty());
}

#[test]
fn contact_is_that_of_the_feet_at_rest_and_in_the_gait() {
    let plan = PrecisionPlan {
        steps: vec![SimDuration::from_millis(2)],
        tolerances: Vec::new(),
        ensemble: 0,
        repetitions: 1,
        budget_s: 1e6,
        ..PrecisionPlan::default()
    };
    let compliant = PlantId::new("still").with_constraints("compliant");
    let speeds = vec![(compliant, 0.0), (PlantId::new("walking"), 0.5)];
    let study = precision(&Pacers::new(speeds), &plan, &mut ()).unwrap();
    let [still, walking] = &study.contacts[..] else {
        panic!("{:?}", study.contacts);
    };
    let rest = still.rest.unwrap();
    assert_eq!(
        (rest.load_n, rest.penetration_m, rest.speed_m_s),
        (LOAD, DEEP, 0.0)
    );
    let near = |found: f64, expected: f64| (found / expected - 1.0).abs() < 1e-9;
    assert!(near(rest.expected_m.unwrap(), LOAD / STIFFNESS), "{rest:?}");
    assert!(
        near(rest.stiffness_realised.unwrap(), LOAD / DEEP / STIFFNESS),
        "{rest:?}"
    );
    // Two seconds of stance and swing: friction beyond its limit, which pushes the feet forward.
    let gait = walking.gait.unwrap();
    assert!(
        near(gait.signorini_j, LOAD * DEEP) && gait.penetration_m == DEEP,
        "{gait:?}"
    );
    assert!(
        near(gait.coulomb_n.unwrap(), (PUSH - 0.4) * LOAD),
        "{gait:?}"
    );
    let work = PUSH * LOAD * 0.5 * DUTY * 2.0 * 2.0;
    assert!((gait.along_slip_j / work - 1.0).abs() < 0.05, "{gait:?}");
    // Ten landings against the load take some of it.
    let landings = 10.0 * LOAD * (CLEARANCE + DEEP);
    let net = gait.created_j - gait.dissipated_j;
    assert!(near(net + landings, gait.along_slip_j), "{gait:?}");
    assert_eq!(walking.rest, None);
    let why = walking.why.as_deref().unwrap();
    assert!(why.contains("a foot still moves"), "{why}");
    let page = study
        .page(
            &twinrig_experiment::Machine::here("test", "release"),
            "test",
        )
        .html();
    // Load, penetration and their ratio to the stiffness of the robot file.
    assert!(page.contains(">2 N<") && page.contains(">1 mm<") && page.contains(">2 mm<"));
}
