//! The physics: a trunk on a spring and a damper. It knows neither scenarios nor controllers.

use twinrig::plant::{
    EnergyBalance, Plant, PlantFault, Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit,
    WorkCounts,
};

const GRAVITY: f64 = 9.81;
/// Length of the unloaded spring \[m\].
const LENGTH: f64 = 0.15;

#[derive(Clone, Copy, Debug)]
pub struct Parameters {
    /// \[kg\]
    pub mass: f64,
    /// \[N/m\]
    pub stiffness: f64,
    /// \[N·s/m\]
    pub damping: f64,
    /// Height at the start above that at rest \[m\].
    pub start: f64,
}

impl Parameters {
    /// Returns the weight \[N\].
    pub fn weight(&self) -> f64 {
        self.mass * GRAVITY
    }

    /// Returns the height at rest \[m\].
    fn rest(&self) -> f64 {
        LENGTH - self.weight() / self.stiffness
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Integrator {
    Rk4,
    SemiImplicit,
}

/// Height \[m\], its rate \[m/s\], energy dissipated since the start \[J\].
type State = [f64; 3];

/// The plant.
#[derive(Clone)]
pub struct SpringTrunk {
    parameters: Parameters,
    integrator: Integrator,
    step: SimDuration,
    /// Time and state of the last whole step. Steps begin here alone, so that the motion does not
    /// depend on when it is observed.
    grid: (SimTime, State),
    /// State at the present time.
    state: State,
}

impl SpringTrunk {
    pub fn new(parameters: Parameters, integrator: Integrator, step: SimDuration) -> Self {
        let state = [parameters.rest() + parameters.start, 0.0, 0.0];
        Self {
            parameters,
            integrator,
            step,
            grid: (SimTime::ZERO, state),
            state,
        }
    }

    /// Returns its signals. With `body/position` every expectation of `body` can be asked.
    pub fn ports_of() -> Vec<Port> {
        vec![
            Port::output("body/position", Unit::Meter, 3),
            Port::output("body/rpy", Unit::Radian, 3),
        ]
    }

    /// The equations of motion: the rate of change of `state`.
    fn slope(&self, [height, rate, _]: State) -> State {
        let Parameters {
            mass,
            stiffness,
            damping,
            ..
        } = self.parameters;
        let force = stiffness * (LENGTH - height) - damping * rate;
        [rate, force / mass - GRAVITY, damping * rate * rate]
    }

    /// Returns the state `h` seconds after `state`.
    fn stepped(&self, state: State, h: f64) -> State {
        let moved = |slope: State, h: f64| [0, 1, 2].map(|i| state[i] + h * slope[i]);
        let a = self.slope(state);
        if self.integrator == Integrator::SemiImplicit {
            let [_, rate, dissipated] = moved(a, h);
            return [state[0] + h * rate, rate, dissipated];
        }
        let b = self.slope(moved(a, 0.5 * h));
        let c = self.slope(moved(b, 0.5 * h));
        let d = self.slope(moved(c, h));
        moved(
            [0, 1, 2].map(|i| (a[i] + 2.0 * (b[i] + c[i]) + d[i]) / 6.0),
            h,
        )
    }

    /// Returns the energy stored in `state`: kinetic, of the spring, of gravity \[J\].
    fn stored(&self, [height, rate, _]: State) -> [f64; 3] {
        let Parameters {
            mass, stiffness, ..
        } = self.parameters;
        let compressed = LENGTH - height;
        [
            0.5 * mass * rate * rate,
            0.5 * stiffness * compressed * compressed,
            self.parameters.weight() * height,
        ]
    }
}

impl Plant for SpringTrunk {
    fn name(&self) -> &'static str {
        "spring-trunk"
    }

    fn ports(&self) -> Vec<Port> {
        Self::ports_of()
    }

    /// Advances to `to`. There are no inputs: a plant with inputs, which change between steps, has
    /// to end a step at every change.
    fn advance(&mut self, to: SimTime, _inputs: &[f64]) -> Result<(), PlantFault> {
        let (mut now, mut state) = self.grid;
        while now + self.step <= to {
            state = self.stepped(state, self.step.as_secs_f64());
            now += self.step;
        }
        let present = self.stepped(state, (to - now).as_secs_f64());
        if !present.iter().all(|value| value.is_finite()) {
            return Err(PlantFault {
                time: self.grid.0,
                part: "spring".to_owned(),
                energy: self.energy().stored(),
                why: format!(
                    "its motion grows without bound: take a step below {}",
                    self.step
                ),
            });
        }
        (self.grid, self.state) = ((now, state), present);
        Ok(())
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        outputs.copy_from_slice(&[0.0, 0.0, self.state[0], 0.0, 0.0, 0.0]);
    }

    /// What is stored now and at the start differs by what was dissipated, and by the errors of the
    /// integration: the residual.
    fn energy(&self) -> EnergyBalance {
        let begin = Self::new(self.parameters, self.integrator, self.step).state;
        let [kinetic, spring, gravity] = self.stored(self.state);
        let dissipated = self.state[2];
        let balance = EnergyBalance {
            kinetic,
            spring,
            gravity,
            dissipated,
            exchanged: dissipated,
            ..EnergyBalance::default()
        };
        let gained = balance.stored() - self.stored(begin).iter().sum::<f64>();
        EnergyBalance {
            residual: gained + dissipated,
            ..balance
        }
    }

    fn work(&self) -> WorkCounts {
        WorkCounts::of_steps(self.grid.0.as_nanos() / self.step.as_nanos().max(1))
    }

    /// All that changes, so that a run can be saved and continued bit for bit.
    fn save(&self) -> Snapshot {
        Snapshot::of(&(self.grid, self.state))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        (self.grid, self.state) = snapshot.read()?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use twinrig::testing::plant_harness::PlantHarness;

    use super::*;

    fn harness(
        parameters: Parameters,
        integrator: Integrator,
        us: u64,
    ) -> PlantHarness<SpringTrunk> {
        let step = SimDuration::from_micros(us);
        PlantHarness::new(SpringTrunk::new(parameters, integrator, step))
    }

    /// Any spring trunk that swings.
    fn swinging() -> impl Strategy<Value = Parameters> {
        (0.5..2.0, 50.0..500.0, 0.0..0.9, 0.01..0.05).prop_map(
            |(mass, stiffness, ratio, start): (f64, f64, f64, f64)| Parameters {
                mass,
                stiffness,
                damping: 2.0 * ratio * (mass * stiffness).sqrt(),
                start,
            },
        )
    }

    /// The height after `t` seconds, in closed form.
    fn height(parameters: &Parameters, t: f64) -> f64 {
        let decay = parameters.damping / (2.0 * parameters.mass);
        let omega = (parameters.stiffness / parameters.mass - decay * decay).sqrt();
        let swing = (omega * t).cos() + decay / omega * (omega * t).sin();
        parameters.rest() + parameters.start * (-decay * t).exp() * swing
    }

    proptest! {
        #[test]
        fn motion_is_that_of_the_closed_form(parameters in swinging(), ms in 1..2000_u64) {
            let mut harness = harness(parameters, Integrator::Rk4, 1000);
            harness.advance_to_ms(ms);
            let error = harness.read("body/position")[2] - height(&parameters, ms as f64 * 1e-3);
            prop_assert!(error.abs() < 1e-5 * parameters.start, "{error:e} m");
        }

        /// Whether and when it is observed, or saved and restored, the motion is the same, bit for
        /// bit.
        #[test]
        fn observation_and_restoration_change_nothing(
            parameters in swinging(),
            first in 1..5000_u64,
            later in 1..5000_u64,
        ) {
            let mut straight = harness(parameters, Integrator::Rk4, 1000);
            straight.advance_to_us(first + later);
            let mut halting = harness(parameters, Integrator::Rk4, 1000);
            halting.advance_to_us(first);
            let mut restored = harness(parameters, Integrator::Rk4, 1000);
            restored.plant.restore(&halting.plant.save()).unwrap();
            restored.advance_to_us(first + later);
            let bits = |harness: &PlantHarness<SpringTrunk>| harness.plant.state.map(f64::to_bits);
            prop_assert_eq!(bits(&straight), bits(&restored));
        }

        /// Half the step, and the error is that of the order: a sixteenth, or a half.
        #[test]
        fn errors_fall_with_the_order(parameters in swinging()) {
            for (integrator, least) in [(Integrator::Rk4, 10.0), (Integrator::SemiImplicit, 1.5)] {
                let worst = |us| {
                    let mut harness = harness(parameters, integrator, us);
                    let errors = (1..50).map(|k| {
                        harness.advance_to_ms(8 * k);
                        let exact = height(&parameters, 8e-3 * k as f64);
                        (harness.read("body/position")[2] - exact).abs()
                    });
                    errors.fold(0.0, f64::max)
                };
                prop_assert!(worst(8000) > least * worst(4000), "{integrator:?}");
            }
        }
    }
}
