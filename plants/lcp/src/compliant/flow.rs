//! State of the compliant plant and its integration.

use twinrig_compliant::lanes::{Features, Quad, dispatch};
use twinrig_compliant::{StepControl, StepError};
use twinrig_legged::{Ledger, Stored};

use super::energy::{ElementDepths, StoredEnergy};
use super::model::{Commands, CompliantModel, DriveLaws};
use super::motion::Step;
use super::state::{Flows, Slope, State};

/// Greatest residual of the energy balance as a share of the energy exchanged, and, as a share of the
/// reference energy, the residual below which it is no error.
const RESIDUAL_MAX: f64 = 0.1;
const RESIDUAL_FLOOR: f64 = 0.02;

/// Failure of a step.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub(crate) enum CompliantError {
    #[error(transparent)]
    Step(#[from] StepError),
    #[error(
        "steps of {:.3} ms are unstable or too long: {residual:.3e} J of energy are not accounted for",
        1e3 * seconds
    )]
    Energy { seconds: f64, residual: f64 },
}

/// Everything that a step changes.
struct Checkpoint<const N: usize, const P: usize> {
    state: State<Quad, N, P>,
    slope: Option<Slope<Quad, N, P>>,
    sums: Flows<Quad>,
    control: StepControl,
    ledger: Ledger,
}

/// Model and state of the plant.
#[derive(Debug, Clone)]
pub(crate) struct CompliantFlow<const N: usize, const P: usize> {
    pub(crate) model: CompliantModel<N>,
    pub(crate) state: State<Quad, N, P>,
    pub(crate) commands: Commands<Quad>,
    /// Slope in this state under these commands, if known.
    pub(crate) slope: Option<Slope<Quad, N, P>>,
    pub(crate) sums: Flows<Quad>,
    /// Sums, and rates of hip and pulley, before the last step, and its duration \[s\].
    pub(crate) sums_before: Flows<Quad>,
    pub(crate) rates_before: [Quad; 2],
    pub(crate) step_seconds: f64,
    pub(crate) control: StepControl,
    pub(crate) ledger: Ledger,
    pub(crate) features: Features,
    /// Energy of the rotors at the start \[J\].
    pub(crate) rotors_at_start: f64,
}

impl<const N: usize, const P: usize> CompliantFlow<N, P> {
    pub(crate) fn new(
        model: CompliantModel<N>,
        state: State<Quad, N, P>,
        tolerance: f64,
        features: Features,
    ) -> Self {
        let mut flow = Self {
            model,
            state,
            commands: Commands::zero(),
            slope: None,
            sums: Flows::zero(),
            sums_before: Flows::zero(),
            rates_before: [state.rates[0], state.pulley_rate],
            step_seconds: 0.0,
            control: StepControl::new(tolerance),
            ledger: Ledger::default(),
            features,
            rotors_at_start: 0.0,
        };
        if !matches!(flow.model.drives, DriveLaws::Motors(_)) {
            flow.commands.hip[0] = flow.state.angles[0];
            flow.commands.knee[0] = flow.state.pulley;
        }
        flow.rotors_at_start = flow.rotors();
        flow.ledger = Ledger::opened(flow.stored());
        flow
    }

    /// Sets the commands; the slope under others is forgotten.
    pub(crate) fn command(&mut self, commands: Commands<Quad>) {
        if !commands.continues(&self.commands.at_end(self.step_seconds)) {
            self.slope = None;
        }
        self.commands = commands;
    }

    /// Advances by `seconds`, or leaves everything as it is on error.
    pub(crate) fn step(&mut self, seconds: f64) -> Result<(), CompliantError> {
        let before = Checkpoint {
            state: self.state,
            slope: self.slope,
            sums: self.sums,
            control: self.control,
            ledger: self.ledger,
        };
        let done = dispatch(
            self.features,
            Step {
                model: &self.model,
                commands: &self.commands,
                state: &mut self.state,
                slope: &mut self.slope,
                sums: &mut self.sums,
                control: &mut self.control,
                seconds,
            },
        );
        self.close_ledger();
        let done = done.map_err(CompliantError::from);
        if let Err(error) = done.and_then(|()| self.check_energy(seconds)) {
            self.state = before.state;
            self.slope = before.slope;
            self.sums = before.sums;
            self.control = before.control;
            self.ledger = before.ledger;
            return Err(error);
        }
        self.sums_before = before.sums;
        self.rates_before = [before.state.rates[0], before.state.pulley_rate];
        self.step_seconds = seconds;
        Ok(())
    }

    /// Updates the energy balance.
    fn close_ledger(&mut self) {
        let sum = |quad: Quad| {
            let [a, b, c, d] = quad.0;
            (a + b) + (c + d)
        };
        // The work into the rotors is their energy, exactly.
        self.ledger.actuator = sum(self.sums.actuator) + self.rotors() - self.rotors_at_start;
        self.ledger.dissipated = sum(self.sums.dissipated);
        let stored = self.stored();
        self.ledger.close_step(stored);
    }

    /// Checks that the balance of the energy closes: steps beyond the limit of stability gain energy.
    fn check_energy(&self, seconds: f64) -> Result<(), CompliantError> {
        let balance = self.ledger.balance();
        let reference = balance.kinetic + balance.spring + self.model.rigid.moving_energy;
        let most = (RESIDUAL_MAX * balance.exchanged).max(RESIDUAL_FLOOR * reference);
        // The form of the comparison rejects NaN.
        if balance.residual.abs() <= most {
            return Ok(());
        }
        let residual = balance.residual;
        Err(CompliantError::Energy { seconds, residual })
    }

    /// Returns the energy of the rotors \[J\].
    pub(crate) fn rotors(&self) -> f64 {
        let [hip, knee] = self.model.drive_inertias();
        let squares = |quad: Quad| quad.0.iter().map(|rate| rate * rate).sum::<f64>();
        0.5 * (hip * squares(self.state.rates[0]) + knee * squares(self.state.pulley_rate))
    }

    /// Returns kinetic, spring and gravity energy \[J\].
    pub(crate) fn stored(&self) -> Stored {
        dispatch(
            self.features,
            StoredEnergy {
                model: &self.model,
                state: &self.state,
            },
        )
    }

    /// Returns the greatest depth of a compressed element \[m\].
    pub(crate) fn greatest_depth(&self) -> f64 {
        let depths = dispatch(
            self.features,
            ElementDepths {
                model: &self.model,
                state: &self.state,
            },
        );
        let depths = depths.iter().flat_map(|quad| quad.0);
        depths.fold(0.0, f64::max)
    }
}
