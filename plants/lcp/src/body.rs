//! Interface to a flow, independent of its number of links per leg.

mod numbers;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use twinrig_kernel::SimTime;
use twinrig_legged::{DriveModels, Ledger, Readings, Setup};
use twinrig_robot::Robot;
use twinrig_runtime::{PlantState, WorkCounts};

use crate::articulated::rotation;
use crate::contacts::CONTACTS;
use crate::flow::{Flow, FlowError};
use crate::log::LoggedEvent;
use crate::mode::Contact;
use crate::model::Model;
use crate::options::{LcpError, Options};
use crate::posture::ResumeError;
use crate::real::{Lanes, Real};
use crate::site::{Footing, Site};
use crate::state::State;

/// Interface of a [`Flow`] to the plant.
pub(crate) trait Body: Readings + Send {
    /// Sets the inputs of hips and pulleys, leg by leg: angles \[rad\], or voltages \[V\] and
    /// bridge states.
    fn set_inputs(&mut self, inputs: &[f64]);

    /// Returns the inputs before the first command: servos keep their position, motors coast.
    fn initial_inputs(&self, inputs: &mut [f64]);

    /// Advances by `seconds`, or restores the state before the step on error.
    fn run(&mut self, now_s: f64, seconds: f64) -> Result<(), FlowError>;

    /// Enables or disables the event log; clears it in both cases.
    fn set_logging(&mut self, enabled: bool);

    /// Returns the logged events from index `from` on, each with the name of its leg.
    fn log(&self, from: usize) -> Vec<(LoggedEvent, &str)>;

    /// Returns the work counters.
    fn counts(&self) -> WorkCounts;

    /// Returns the ground impulses on the legs since the start, world frame \[N·s\].
    fn ground_impulses(&self) -> &[[f64; 3]];

    /// Returns the maximum violation of the active constraints \[m\].
    fn constraint_violation(&self) -> f64;

    fn save(&self) -> SavedBody;

    fn restore(&mut self, saved: &SavedBody) -> Result<(), String>;

    /// Returns the state in the coordinates shared by all plants of the robot.
    fn state(&self, time: SimTime) -> PlantState;

    /// Resumes from the state of another plant; returns a line for each value that was not taken
    /// over.
    fn resume_from(&mut self, from: &PlantState) -> Result<Vec<String>, ResumeError>;
}

/// Serialised state.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct SavedBody {
    /// State, active constraints and sums, in the order of [`Flow::visit`].
    numbers: Vec<f64>,
    contacts: Vec<(u64, u64, Option<[f64; 2]>)>,
    ledger: Ledger,
    counts: WorkCounts,
}

/// Builds the flow in the start state.
pub(crate) fn initial_flow<const N: usize>(
    robot: &Robot,
    options: &Options,
) -> Result<Flow<N>, LcpError> {
    let setup = &options.setup;
    let model = Model::<N>::new(robot, setup)?;
    let zero = Lanes::zero();
    let mut state = State {
        position: [0.0, 0.0, height::<N>(robot, setup)?],
        attitude: [1.0, 0.0, 0.0, 0.0],
        velocity: [0.0; 3],
        turning: [0.0; 3],
        angles: [zero; N],
        rates: [zero; N],
        pulley: zero,
        pulley_rate: zero,
    };
    let mut commands = [zero; 2];
    for (i, leg) in model.legs.iter().enumerate() {
        let start = setup.start.of_leg(&leg.name, &leg.pantograph)?;
        for k in 0..N {
            // An unloaded toe follows the third segment.
            let (angle, rate) = if k < 3 {
                (start.angles[k], start.rates[k])
            } else {
                (start.angles[2] + leg.constants.toe[1], start.rates[2])
            };
            state.angles[k] = state.angles[k].with_lane(i, angle);
            state.rates[k] = state.rates[k].with_lane(i, rate);
        }
        state.pulley = state.pulley.with_lane(i, start.command.knee);
        commands[0] = commands[0].with_lane(i, start.angles[0]);
        commands[1] = commands[1].with_lane(i, start.command.knee);
    }
    let mut flow = Flow::new(model, state, options.method, options.tolerance);
    if let Some(DriveModels::Servos(_)) = flow.model.drives {
        [flow.mode.commands.hip, flow.mode.commands.pulley] = commands;
    }
    Ok(flow)
}

/// Returns the initial height of the trunk \[m\].
fn height<const N: usize>(robot: &Robot, setup: &Setup) -> Result<f64, LcpError> {
    let lowest = |mount: &twinrig_robot::LegMount, start: &twinrig_legged::LegStart| {
        let foot = Vector3::from(mount.hip) + Vector3::new(start.foot.x, 0.0, start.foot.y);
        let Some(toe) = mount.leg.toe.filter(|_| N > 3) else {
            return foot;
        };
        let angle = start.angles[2] + toe.rest;
        let tip = foot + Vector3::new(libm::sin(angle), 0.0, -libm::cos(angle)) * toe.length;
        if tip.z < foot.z { tip } else { foot }
    };
    Ok(setup.height(robot, lowest)?)
}

impl<const N: usize> Flow<N> {
    /// Returns a contact point of one leg; computes this leg only.
    pub(crate) fn site(&self, leg: usize, links: usize) -> Site<f64, N> {
        let of = |lanes: &[Lanes; N]| lanes.map(|lane| lane.lane(leg));
        let turns = of(&self.state.angles).map(Real::sin_cos);
        let (sines, cosines) = (turns.map(|(sine, _)| sine), turns.map(|(_, cosine)| cosine));
        Site::from_turns(
            &self.model.legs[leg].constants,
            [&sines, &cosines, &of(&self.state.rates)],
            [self.state.velocity, self.state.turning],
            0,
            links,
        )
    }

    /// Returns gap and velocity of a contact point relative to the ground; none without ground.
    pub(crate) fn footing(&self, leg: usize, links: usize) -> Option<Footing<f64>> {
        let ground = self.model.ground.as_ref()?;
        let upright = rotation(self.state.attitude);
        let site = self.site(leg, links);
        Some(site.footing(ground, self.state.position, &upright))
    }
}

impl<const N: usize> Body for Flow<N> {
    fn set_inputs(&mut self, inputs: &[f64]) {
        let commands = &mut self.mode.commands;
        if let Some(DriveModels::Motors(motors)) = &self.model.drives {
            for (leg, input) in inputs.chunks_exact(4).enumerate() {
                let hip = motors.hip.line(input[0], input[1]);
                let knee = motors.knee.line(input[2], input[3]);
                commands.hip = commands.hip.with_lane(leg, hip.torque);
                commands.hip_damping = commands.hip_damping.with_lane(leg, hip.damping);
                commands.pulley = commands.pulley.with_lane(leg, knee.torque);
                commands.pulley_damping = commands.pulley_damping.with_lane(leg, knee.damping);
            }
            return;
        }
        for (leg, pair) in inputs.chunks_exact(2).enumerate() {
            let reference = self.model.legs[leg].pantograph.hip_reference();
            commands.hip = commands.hip.with_lane(leg, pair[0] + reference);
            commands.pulley = commands.pulley.with_lane(leg, pair[1]);
        }
    }

    fn initial_inputs(&self, inputs: &mut [f64]) {
        if let Some(DriveModels::Motors(_)) = self.model.drives {
            inputs.fill(0.0);
            return;
        }
        for (leg, pair) in inputs.chunks_exact_mut(2).enumerate() {
            let reference = self.model.legs[leg].pantograph.hip_reference();
            pair[0] = self.mode.commands.hip.lane(leg) - reference;
            pair[1] = self.mode.commands.pulley.lane(leg);
        }
    }

    fn set_logging(&mut self, enabled: bool) {
        self.logging = enabled;
        self.log.clear();
    }

    fn log(&self, from: usize) -> Vec<(LoggedEvent, &str)> {
        let named = |event: &LoggedEvent| (*event, self.model.legs[event.leg].name.as_str());
        self.log.iter().skip(from).map(named).collect()
    }

    fn run(&mut self, now_s: f64, seconds: f64) -> Result<(), FlowError> {
        self.now_s = now_s;
        let before = (self.impulse_sums_before, self.run_seconds);
        (self.impulse_sums_before, self.run_seconds) = (self.impulse_sums, seconds);
        let moved = self.step(seconds);
        if moved.is_err() {
            (self.impulse_sums_before, self.run_seconds) = before;
        }
        moved
    }

    fn counts(&self) -> WorkCounts {
        self.counts
    }

    fn ground_impulses(&self) -> &[[f64; 3]] {
        &self.impulse_sums.ground[..self.model.legs.len()]
    }

    fn constraint_violation(&self) -> f64 {
        self.violation()
    }

    fn save(&self) -> SavedBody {
        let mut numbers = Vec::new();
        self.visit(&mut |x| numbers.push(x));
        let contact = |c: &Contact| (c.leg as u64, c.links as u64, c.slides);
        SavedBody {
            numbers,
            contacts: self.mode.contacts.iter().map(contact).collect(),
            ledger: self.ledger,
            counts: self.counts,
        }
    }

    fn restore(&mut self, saved: &SavedBody) -> Result<(), String> {
        let mut expected = 0;
        self.visit(&mut |_| expected += 1);
        if saved.numbers.len() != expected {
            return Err(format!(
                "{} numbers, expected {expected}",
                saved.numbers.len()
            ));
        }
        let mut numbers = saved.numbers.iter();
        let cached_recovery =
            self.replace(&mut || *numbers.next().expect("the number of values was checked"));
        self.mode.contacts.clear();
        if saved.contacts.len() > CONTACTS {
            return Err(format!(
                "{} contacts, at most {CONTACTS}",
                saved.contacts.len()
            ));
        }
        for &(leg, links, slides) in &saved.contacts {
            let contact = usize::try_from(leg).ok().zip(usize::try_from(links).ok());
            let Some((leg, links)) = contact
                .filter(|&(leg, links)| leg < self.model.legs.len() && (3..=N).contains(&links))
            else {
                return Err(format!("invalid contact of leg {leg} at link {links}"));
            };
            self.mode.contacts.push(Contact { leg, links, slides });
        }
        self.mode.update_any();
        (self.ledger, self.counts) = (saved.ledger, saved.counts);
        self.instant.iterations = self.counts.solver_iterations;
        self.instant.factorisations = self.counts.factorisations;
        self.buffers = None;
        if cached_recovery > 0.0 {
            self.restore_cache(cached_recovery);
        }
        Ok(())
    }

    fn state(&self, time: SimTime) -> PlantState {
        let toes = self.toes();
        let state = self.posture().state(time);
        toes.iter()
            .fold(state, |state, (name, values)| state.with(name, values))
    }

    fn resume_from(&mut self, from: &PlantState) -> Result<Vec<String>, ResumeError> {
        let (next, lines) = self.resumed_from(from)?;
        *self = next;
        Ok(lines)
    }
}
