//! Walking plant with speed and cost of transport known in closed form.

use serde::{Deserialize, Serialize};
use twinrig_experiment::{
    Commands, Cost, PlantFactory, PrecisionPlan, Status, StudyInput, Transport, precision,
};
use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit};
use twinrig_rig::{MethodOffer, MethodSetting, PlantId, PlantOffer, SettingKind, Variant};
use twinrig_runtime::{EnergyBalance, Plant, PlantFault};

const SPEED: f64 = 0.5;
const WEIGHT: f64 = 10.0;
/// Torque \[N·m\] and rate \[rad/s\] of the hip, whose power is always positive.
const HIP: (f64, f64) = (0.25, 4.0);
/// Torque \[N·m\], amplitude \[rad\] and frequency \[Hz\] of the knee, whose power changes sign.
const KNEE: (f64, f64, f64) = (0.125, 0.5, 5.0);
/// Power of the energy error of the method `leaking` \[W\].
const LEAK: f64 = 0.03;

/// Relative error of the work per step of the method `coarse` \[1/s\].
const COARSE: f64 = 12.0;

#[derive(Clone, Debug, Serialize, Deserialize)]
struct Walker {
    method: String,
    step: SimDuration,
    now: SimTime,
}

impl Walker {
    fn now_s(&self) -> f64 {
        self.now.as_secs_f64()
    }

    fn knee(&self) -> f64 {
        KNEE.1 * libm::sin(core::f64::consts::TAU * KNEE.2 * self.now_s())
    }

    fn leak(&self) -> f64 {
        match self.method.as_str() {
            "leaking" => LEAK,
            "losing" => -LEAK,
            _ => 0.0,
        }
    }
}

impl Plant for Walker {
    fn name(&self) -> &'static str {
        "walker"
    }

    fn ports(&self) -> Vec<Port> {
        vec![
            Port::input("leg/A/hip/position", Unit::Radian, 1),
            Port::output("body/position", Unit::Meter, 3),
            Port::output("leg/A/foot/position", Unit::Meter, 3),
            Port::output("leg/A/hip/position", Unit::Radian, 1),
            Port::output("leg/A/hip/torque", Unit::NewtonMeter, 1),
            Port::output("leg/A/knee/position", Unit::Radian, 1),
            Port::output("leg/A/knee/torque", Unit::NewtonMeter, 1),
        ]
    }

    fn advance(&mut self, to: SimTime, _: &[f64]) -> Result<(), PlantFault> {
        self.now = to;
        Ok(())
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        let t = self.now_s();
        let height = if self.method == "falling" && t > 4.0 {
            0.05
        } else {
            0.15
        };
        // A straight line oblique to the axes.
        let [x, y] = [0.6, 0.8].map(|share| share * SPEED * t);
        let all = [
            x,
            y,
            height,
            x,
            y,
            0.0,
            HIP.1 * t,
            HIP.0,
            self.knee(),
            KNEE.0,
        ];
        outputs.copy_from_slice(&all);
    }

    fn energy(&self) -> EnergyBalance {
        let t = self.now_s();
        let coarse = if self.method == "coarse" {
            1.0 + COARSE * self.step.as_secs_f64()
        } else {
            1.0
        };
        let actuator = coarse * (HIP.0 * HIP.1 * t + KNEE.0 * self.knee());
        let impact = 0.2 * t;
        let gravity = KNEE.0 * self.knee();
        let dissipated = actuator + self.leak() * t - impact - gravity;
        EnergyBalance {
            gravity,
            actuator,
            impact,
            dissipated,
            residual: self.leak() * t,
            ..EnergyBalance::default()
        }
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(self)
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        *self = snapshot.read()?;
        Ok(())
    }
}

pub struct Walkers {
    input: StudyInput,
    plants: Vec<PlantOffer>,
}

impl Walkers {
    pub fn new(methods: &[&str], seconds: u64) -> Self {
        let method = |&name: &&str| MethodOffer {
            name: name.to_owned(),
            about: String::new(),
            set_by: SettingKind::Step,
            reference: None,
            step_only: false,
            tabulated: false,
        };
        let mut commands = Commands::of(&[Port::input("leg/A/hip/position", Unit::Radian, 1)]);
        for n in 0..10_u64 {
            let at = SimTime::ZERO + SimDuration::from_millis(4) * n;
            commands.hold(at, &[if n.is_multiple_of(2) { 0.0 } else { 1.0 }]);
        }
        Self {
            input: StudyInput {
                name: "a walk".to_owned(),
                file: "walk.toml".to_owned(),
                duration: SimDuration::from_secs(seconds),
                ground: true,
                servos: true,
                commands,
                step: SimDuration::from_millis(2),
                friction: None,
                sole_stiffness: None,
                weight: WEIGHT,
            },
            plants: vec![PlantOffer {
                plant: PlantId::new("walker"),
                about: String::new(),
                segment_masses: true,
                model_of: None,
                peer: None,
                methods: methods.iter().map(method).collect(),
            }],
        }
    }
}

impl PlantFactory for Walkers {
    fn input(&self) -> &StudyInput {
        &self.input
    }

    fn plants(&self) -> &[PlantOffer] {
        &self.plants
    }

    fn build(&self, variant: &Variant) -> Result<Box<dyn Plant>, String> {
        if variant.method == "unbuildable" {
            return Err("there is no such walker".to_owned());
        }
        Ok(Box::new(Walker {
            method: variant.method.clone(),
            step: match variant.setting {
                MethodSetting::Step(step) => step,
                MethodSetting::Tolerance(_) => return Err("it has no tolerance".to_owned()),
            },
            now: SimTime::ZERO,
        }))
    }
}

/// Returns the walks at the scenario's step.
fn transports(methods: &[&str], seconds: u64) -> Vec<Transport> {
    let mut all = study(methods, seconds).transports;
    all.retain(|one| one.converged.is_none());
    all
}

pub fn study(methods: &[&str], seconds: u64) -> twinrig_experiment::Study {
    let plan = PrecisionPlan {
        steps: vec![SimDuration::from_millis(2)],
        tolerances: Vec::new(),
        repetitions: 1,
        budget_s: 1e9,
        ..PrecisionPlan::default()
    };
    precision(&Walkers::new(methods, seconds), &plan, &mut ()).unwrap()
}

fn assert_near(found: f64, expected: f64, within: f64) {
    assert!(
        (found - expected).abs() <= within,
        "{found} instead of {expected}"
    );
}

/// Rounding error of sums of some thousand numbers near one.
const ROUNDING: f64 = 1e-9;

/// Of 0.2048, 0.2024, 0.2012 and 0.2006 the last two have the same printed digits.
#[test]
fn converged_cost_is_that_of_the_first_step_whose_half_changes_no_digit() {
    let converged = |methods: &[&str]| {
        let mut all = study(methods, 10).transports;
        all.retain(|one| one.converged.is_some());
        all
    };
    let [one] = &converged(&["coarse"])[..] else {
        panic!("one plant, one walk");
    };
    assert_eq!((one.key.step_s, one.converged), (Some(2.5e-4), Some(true)));
    assert_near(one.cost.unwrap().cost_of_transport.unwrap(), 0.2006, 1e-9);
    assert!(converged(&["falling"]).is_empty());
}

#[test]
fn cost_of_transport_is_drive_work_over_weight_and_distance() {
    let found = transports(&["steady"], 10);
    let [one] = &found[..] else {
        panic!("{found:?}");
    };
    assert_eq!(
        (one.status, one.key.step_s, one.fell_at_s),
        (Status::Ok, Some(2e-3), None)
    );
    let cost: Cost = one.cost.unwrap();
    // The last four fifths, over which the knee makes whole periods without net work.
    assert_eq!((cost.from_s, cost.to_s), (2.0, 10.0));
    assert_near(cost.distance_m, 8.0 * SPEED, ROUNDING);
    assert_near(cost.speed_m_s, SPEED, ROUNDING);
    let net = 8.0 * HIP.0 * HIP.1;
    assert_near(cost.work_j, net, ROUNDING);
    assert_near(cost.drive_work_j.unwrap(), net, ROUNDING);
    assert_near(
        cost.cost_of_transport.unwrap(),
        HIP.0 * HIP.1 / (WEIGHT * SPEED),
        ROUNDING,
    );
    // In each period the knee does positive work over two amplitudes. Its turning points lie at odd
    // multiples of 50 ms, which are sampling instants.
    let knee = 8.0 * KNEE.2 * 2.0 * KNEE.1 * KNEE.0;
    assert_near(cost.positive_work_j.unwrap(), net + knee, ROUNDING);
    let positive = (net + knee) / (WEIGHT * 8.0 * SPEED);
    assert_near(cost.positive_cost_of_transport.unwrap(), positive, ROUNDING);
    assert_near(cost.impact_j, 8.0 * 0.2, ROUNDING);
    assert_near(cost.dissipated_j, net - 8.0 * 0.2, ROUNDING);
    assert_near(cost.stored_j, 0.0, ROUNDING);
    assert_near(cost.residual_j, 0.0, ROUNDING);
}

#[test]
fn created_and_lost_energy_are_distinguished() {
    let found = transports(&["leaking", "losing"], 10);
    let [leaking, losing] = [0, 1].map(|n| found[n].cost.unwrap());
    assert_near(leaking.residual_j, 8.0 * LEAK, ROUNDING);
    assert_near(losing.residual_j, -8.0 * LEAK, ROUNDING);
    assert_near(leaking.appears_most_j, 0.8 * LEAK, ROUNDING);
    assert_near(leaking.vanishes_most_j, 0.0, 0.0);
    assert_near(losing.vanishes_most_j, 0.8 * LEAK, ROUNDING);
    assert_near(losing.appears_most_j, 0.0, 0.0);
    // Cost if the drives had supplied the energy created.
    let covered = (HIP.0 * HIP.1 + LEAK) / (WEIGHT * SPEED);
    assert_near(
        leaking.covered_cost_of_transport.unwrap(),
        covered,
        ROUNDING,
    );
    for cost in [leaking, losing] {
        let balance = cost.work_j - cost.dissipated_j - cost.impact_j + cost.residual_j;
        assert_near(balance, cost.stored_j, ROUNDING);
    }
}

#[test]
fn short_walk_excludes_settling_and_reports_falls_and_failures() {
    let found = transports(&["steady", "falling", "unbuildable"], 5);
    let [steady, falling, unbuildable] = &found[..] else {
        panic!("{found:?}");
    };
    assert_near(steady.cost.unwrap().from_s, 1.0, ROUNDING);
    assert_near(falling.fell_at_s.unwrap(), 4.002, ROUNDING);
    assert!(
        falling.why.as_ref().unwrap().contains("fell at 4 s"),
        "{falling:?}"
    );
    assert_eq!(
        (unbuildable.status, unbuildable.cost),
        (Status::Failed, None)
    );
    assert_eq!(unbuildable.why.as_deref(), Some("there is no such walker"));
}

#[test]
fn standing_robot_has_no_cost_of_transport() {
    let plan = PrecisionPlan {
        repetitions: 1,
        budget_s: 1e9,
        ..PrecisionPlan::default()
    };
    let mut still = Walkers::new(&["steady"], 5);
    still.input.commands = Commands::none();
    assert!(
        precision(&still, &plan, &mut ())
            .unwrap()
            .transports
            .is_empty()
    );
}
