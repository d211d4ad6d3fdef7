//! State of the compliant plant and its integration.

use twinrig_compliant::lanes::{Features, Quad, dispatch};
use twinrig_compliant::{StepControl, TooStiff};
use twinrig_legged::{Ledger, Stored};

use super::energy::{ElementDepths, StoredEnergy};
use super::model::{Commands, CompliantModel, DriveLaws};
use super::motion::Step;
use super::state::{Flows, Slope, State};

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
    pub(crate) steps: u64,
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
            steps: 0,
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
    pub(crate) fn step(&mut self, seconds: f64) -> Result<(), TooStiff> {
        let (state, slope, sums, control) = (self.state, self.slope, self.sums, self.control);
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
        if let Err(error) = done {
            (self.state, self.slope, self.sums, self.control) = (state, slope, sums, control);
            return Err(error);
        }
        self.sums_before = sums;
        self.rates_before = [state.rates[0], state.pulley_rate];
        self.step_seconds = seconds;
        self.steps += 1;
        let sum = |quad: Quad| {
            let [a, b, c, d] = quad.0;
            (a + b) + (c + d)
        };
        self.ledger.actuator = sum(self.sums.actuator) + self.rotors() - self.rotors_at_start;
        self.ledger.dissipated = sum(self.sums.dissipated);
        let stored = self.stored();
        self.ledger.close_step(stored);
        Ok(())
    }

    /// Computes the slope at the end of the last step again.
    pub(crate) fn renew_slope(&mut self) {
        let mut copy = self.clone();
        copy.commands = self.commands.at_end(self.step_seconds);
        copy.slope = None;
        // A step of no duration leaves the slope at its end.
        if copy.step(0.0).is_ok() {
            self.slope = copy.slope;
        }
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
