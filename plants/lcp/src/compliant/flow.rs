//! State of the compliant plant and its integration.

use twinrig_compliant::lanes::{Features, Quad, dispatch};
use twinrig_compliant::{StepControl, TooStiff};
use twinrig_legged::{Ledger, Stored};

use super::energy::StoredEnergy;
use super::model::{Commands, CompliantModel};
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
    pub(crate) control: StepControl,
    pub(crate) ledger: Ledger,
    pub(crate) features: Features,
    /// Energy of the rotors at the start \[J\].
    rotors_at_start: f64,
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
            control: StepControl::new(tolerance),
            ledger: Ledger::default(),
            features,
            rotors_at_start: 0.0,
        };
        flow.rotors_at_start = flow.rotors();
        flow.ledger = Ledger::opened(flow.stored());
        flow
    }

    /// Advances by `seconds`.
    pub(crate) fn step(&mut self, seconds: f64) -> Result<(), TooStiff> {
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
        done?;
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

    /// Returns the slope in the present state.
    #[cfg(test)]
    pub(crate) fn present_slope(&mut self) -> Slope<Quad, N, P> {
        let mut copy = self.clone();
        copy.slope = None;
        let _ = copy.step(0.0);
        copy.slope.expect("a step leaves the slope at its end")
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
}
