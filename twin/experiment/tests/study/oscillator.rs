//! Damped oscillator, integrated by textbook methods with known stability limits.

use serde::{Deserialize, Serialize};
use twinrig_experiment::{Commands, PlantFactory, StudyInput};
use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit};
use twinrig_rig::{MethodOffer, MethodSetting, PlantId, PlantOffer, Scales, SettingKind, Variant};
use twinrig_runtime::{EnergyBalance, Plant, PlantEvent, PlantEventKind, PlantFault, WorkCounts};

pub const OMEGA: f64 = 100.0;
pub const ZETA: f64 = 0.1;
/// Limit of the step of the method `capped`, independent of the oscillator \[s\].
pub const CAP_S: f64 = 3e-3;
/// Damping over the mass beyond which the method `tolerant` refuses \[1/s\].
const STIFF: f64 = 1e5;
/// Relative softness of the spring of the plant `engine`.
pub const SOFT: f64 = 1e-3;
/// Share of the oscillator's mass that belongs to the segments.
const SEGMENTS: f64 = 0.5;

/// Oscillator ẍ = −2ζω ẋ − ω² x, from x = 1 cm at rest.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Oscillator {
    method: String,
    step: Option<SimDuration>,
    tolerance: f64,
    omega_squared: f64,
    damping: f64,
    mass: f64,
    now: SimTime,
    state: [f64; 2],
    work: WorkCounts,
    #[serde(skip)]
    log: Option<Vec<PlantEvent>>,
}

impl Oscillator {
    fn slope(&mut self, [x, v]: [f64; 2]) -> [f64; 2] {
        self.work.evaluations += 1;
        [v, -self.damping * v - self.omega_squared * x]
    }

    fn rk4(&mut self, state: [f64; 2], h: f64) -> [f64; 2] {
        let along = |slope: [f64; 2], h: f64| [state[0] + h * slope[0], state[1] + h * slope[1]];
        let a = self.slope(state);
        let b = self.slope(along(a, h / 2.0));
        let c = self.slope(along(b, h / 2.0));
        let d = self.slope(along(c, h));
        let mean = |n: usize| (a[n] + 2.0 * b[n] + 2.0 * c[n] + d[n]) / 6.0;
        along([mean(0), mean(1)], h)
    }

    /// Advances by `h`, halved until the error is within the tolerance.
    fn adaptive(&mut self, state: [f64; 2], h: f64) -> [f64; 2] {
        let full = self.rk4(state, h);
        let half = self.rk4(state, h / 2.0);
        let halves = self.rk4(half, h / 2.0);
        let error = (full[0] - halves[0]).abs() + (full[1] - halves[1]).abs() / OMEGA;
        if error > self.tolerance * h && h > 1e-7 {
            let middle = self.adaptive(state, h / 2.0);
            self.adaptive(middle, h / 2.0)
        } else {
            self.work.steps += 2;
            halves
        }
    }

    fn step(&mut self, h: f64) -> Result<(), PlantFault> {
        if self.method == "tolerant" && self.damping > STIFF {
            return Err(PlantFault {
                time: self.now,
                part: "integrator".to_owned(),
                energy: 0.0,
                why: "too stiff".to_owned(),
            });
        }
        let before = self.state;
        let [x, v] = before;
        self.state = match self.method.as_str() {
            "explicit-euler" => {
                let slope = self.slope(before);
                [x + h * slope[0], v + h * slope[1]]
            }
            "semi-implicit" => {
                let v = v + h * self.slope(before)[1];
                [x + h * v, v]
            }
            "tolerant" => self.adaptive(before, h),
            "rk4" if self.tolerance > 0.0 => self.adaptive(before, h),
            // Undamped motion of the initial amplitude.
            "undecaying" => {
                let phase = OMEGA * (self.now.as_secs_f64() + h);
                [0.01 * libm::cos(phase), -0.01 * OMEGA * libm::sin(phase)]
            }
            // Limit of a constraint spring of fixed stiffness.
            "capped" if h > CAP_S => [2.0 * x, OMEGA * x],
            "brittle" if self.now >= SimTime::from_nanos(50_000_000) => {
                return Err(PlantFault {
                    time: self.now,
                    part: "spring".to_owned(),
                    energy: 0.5,
                    why: "it snapped".to_owned(),
                });
            }
            _ => self.rk4(before, h),
        };
        // Errors not due to an integration method: from the first instant on, and after 120 ms.
        if self.method == "biased" || self.method == "late" && self.now.as_nanos() >= 120_000_000 {
            self.state[0] += 1e-3 * h;
        }
        if self.method != "tolerant" {
            self.work.steps += 1;
        }
        if let Some(log) = &mut self.log
            && (before[0] > 0.0) != (self.state[0] > 0.0)
        {
            let share = before[0] / (before[0] - self.state[0]);
            log.push(PlantEvent {
                at_s: self.now.as_secs_f64() + share * h,
                part: "middle".to_owned(),
                kind: if before[0] > 0.0 {
                    PlantEventKind::Reached
                } else {
                    PlantEventKind::Released
                },
            });
        }
        Ok(())
    }
}

impl Plant for Oscillator {
    fn name(&self) -> &'static str {
        "oscillator"
    }

    fn ports(&self) -> Vec<Port> {
        vec![
            Port::output("body/position", Unit::Meter, 3),
            Port::output("leg/A/foot/position", Unit::Meter, 3),
        ]
    }

    fn advance(&mut self, to: SimTime, _: &[f64]) -> Result<(), PlantFault> {
        while self.now < to {
            let next = self.step.map_or(to, |step| to.min(self.now + step));
            self.step((next - self.now).as_secs_f64())?;
            self.now = next;
        }
        Ok(())
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        outputs.copy_from_slice(&[0.0, 0.0, 0.0, self.state[0], 0.0, 0.0]);
    }

    fn energy(&self) -> EnergyBalance {
        EnergyBalance {
            kinetic: 0.5 * self.mass * self.state[1] * self.state[1],
            ..EnergyBalance::default()
        }
    }

    fn work(&self) -> WorkCounts {
        self.work
    }

    fn least_substep_s(&self) -> Option<f64> {
        (self.method == "tolerant").then_some(1e-3)
    }

    fn log_events(&mut self, enabled: bool) {
        self.log = enabled.then(Vec::new);
    }

    fn events(&self) -> &[PlantEvent] {
        self.log.as_deref().unwrap_or_default()
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(self)
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        *self = snapshot.read()?;
        Ok(())
    }
}

/// Factory of oscillators of two models: `full`, with segment masses, and `bare`, without.
pub struct Oscillators {
    input: StudyInput,
    plants: Vec<PlantOffer>,
    reference_plants: Vec<PlantOffer>,
    zeta: f64,
}

/// Method of an engine's step alone, by `rk4`.
pub const STEP_ONLY: &str = "step only";

fn method(name: &str, set_by: SettingKind, reference: Option<MethodSetting>) -> MethodOffer {
    MethodOffer {
        name: name.to_owned(),
        about: format!("the method {name}"),
        set_by,
        reference,
        step_only: name == STEP_ONLY,
        tabulated: false,
    }
}

impl Oscillators {
    /// A factory with these methods of the full model, for `millis`.
    pub fn new(methods: &[&str], millis: u64) -> Self {
        let fine = Some(MethodSetting::Step(SimDuration::from_micros(20)));
        let loose = Some(MethodSetting::Tolerance(1e-9));
        let offered = |&name: &&str| match name {
            "tolerant" => method(name, SettingKind::Tolerance, None),
            "rk4" | "biased" | "late" => method(name, SettingKind::Step, fine),
            // The same method, controlled by a tolerance.
            "rk4 to a tolerance" => method("rk4", SettingKind::Tolerance, loose),
            _ => method(name, SettingKind::Step, None),
        };
        let full = PlantOffer {
            plant: PlantId::new("full"),
            about: "an oscillator".to_owned(),
            segment_masses: true,
            model_of: None,
            peer: None,
            methods: methods.iter().map(offered).collect(),
        };
        Self {
            input: StudyInput {
                name: "an oscillator".to_owned(),
                file: "oscillator.toml".to_owned(),
                duration: SimDuration::from_millis(millis),
                ground: false,
                servos: false,
                commands: Commands::none(),
                step: SimDuration::from_millis(2),
                friction: None,
                sole_stiffness: None,
                weight: 0.0,
            },
            plants: vec![full],
            reference_plants: Vec::new(),
            zeta: ZETA,
        }
    }

    pub fn with_bare(mut self) -> Self {
        self.plants.push(PlantOffer {
            plant: PlantId::new("bare"),
            about: "one without segments".to_owned(),
            segment_masses: false,
            model_of: None,
            peer: None,
            methods: vec![method("rk4", SettingKind::Step, None)],
        });
        self
    }

    /// Adds the full model with compliant constraints, which soften its spring.
    pub fn with_compliant(mut self) -> Self {
        let fine = Some(MethodSetting::Step(SimDuration::from_micros(20)));
        let plant = |constraints| PlantId::new("full").with_constraints(constraints);
        self.plants[0].plant = plant("rigid");
        self.plants.push(PlantOffer {
            plant: plant("compliant"),
            about: "the same, softer".to_owned(),
            segment_masses: true,
            model_of: None,
            peer: None,
            methods: vec![method("rk4", SettingKind::Step, fine)],
        });
        self
    }

    /// Adds the full model with compliant constraints and error control, on ground.
    pub fn with_error_control(mut self) -> Self {
        self = self.with_compliant();
        self.plants[1].methods = vec![method(
            "tolerant",
            SettingKind::Tolerance,
            Some(MethodSetting::Tolerance(1e-9)),
        )];
        self.input.ground = true;
        self
    }

    /// Adds an engine that solves the model of `full`, with an error at every step.
    pub fn with_engine(mut self, methods: &[&str]) -> Self {
        let offered = |&name: &&str| method(name, SettingKind::Step, None);
        self.plants.push(PlantOffer {
            plant: PlantId::new("engine"),
            about: "the same, by other means".to_owned(),
            segment_masses: true,
            model_of: Some("full".to_owned()),
            peer: None,
            methods: methods.iter().map(offered).collect(),
        });
        self
    }

    /// Moves the full model from the compared plants to those that serve as references only.
    pub fn with_full_aside(mut self) -> Self {
        self.reference_plants.push(self.plants.remove(0));
        self
    }

    /// Removes the full model.
    pub fn without_full(mut self) -> Self {
        self.plants.remove(0);
        self
    }

    pub fn undamped(mut self) -> Self {
        self.zeta = 0.0;
        self
    }
}

impl PlantFactory for Oscillators {
    fn input(&self) -> &StudyInput {
        &self.input
    }

    fn plants(&self) -> &[PlantOffer] {
        &self.plants
    }

    fn reference_plants(&self) -> &[PlantOffer] {
        &self.reference_plants
    }

    fn build(&self, variant: &Variant) -> Result<Box<dyn Plant>, String> {
        if variant.method == "unbuildable" {
            return Err("there is no such oscillator".to_owned());
        }
        let Scales {
            stiffness,
            mass,
            damping,
            compliance,
            compliance_damping,
            ..
        } = variant.scales;
        let mass = if variant.plant == "bare" {
            1.0
        } else {
            1.0 + SEGMENTS * mass
        };
        let soft = if variant.plant == "engine" {
            1.0 - SOFT
        } else if variant.plant == "full, compliant" {
            1.0 - SOFT / compliance
        } else {
            1.0
        };
        let (step, tolerance) = match variant.setting {
            MethodSetting::Step(step) => (Some(step), 0.0),
            MethodSetting::Tolerance(tolerance) => (None, tolerance),
        };
        Ok(Box::new(Oscillator {
            method: variant.method.clone(),
            step,
            tolerance,
            // Unchanged, the full model has the frequency ω.
            omega_squared: OMEGA * OMEGA * stiffness * soft * (1.0 + SEGMENTS) / mass,
            damping: 2.0 * self.zeta * OMEGA * damping * compliance_damping * (1.0 + SEGMENTS)
                / mass,
            mass,
            now: SimTime::ZERO,
            state: [0.01, 0.0],
            work: WorkCounts::default(),
            log: None,
        }))
    }
}
