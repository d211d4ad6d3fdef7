//! Where the plant is, in the words that all plants of a robot share, and how it goes on from where another is.

use twinrig_legged::{Fitted, LegPosture, Posture, Readings};
use twinrig_runtime::PlantState;

use crate::articulated::{into_trunk, rotation};
use crate::event_driven::ALL;
use crate::events::Passed;
use crate::flow::{Flow, FlowError};
use crate::mode::Mode;
use crate::options::Method;
use crate::real::{Lanes, Real};

/// Why it cannot be where another plant is: what of it, and why.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Refused {
    pub(crate) part: String,
    pub(crate) why: String,
}

impl<const N: usize> Flow<N> {
    /// Where it is. The last link of a leg with a toe is not in it.
    pub(crate) fn posture(&self) -> Posture {
        let legs = self.model.legs.iter().enumerate();
        let legs = legs.map(|(i, leg)| {
            let of = |lanes: &[Lanes; N]| std::array::from_fn(|k| lanes[k].lane(i));
            let posture = LegPosture {
                angles: of(&self.state.angles),
                rates: of(&self.state.rates),
                pulley: self.state.pulley.lane(i),
                pulley_rate: self.state.pulley_rate.lane(i),
            };
            (leg.name.clone(), posture)
        });
        Posture {
            position: self.position(),
            attitude: self.attitude(),
            velocity: self.velocity(),
            angular_velocity: self.angular_velocity(),
            legs: legs.collect(),
        }
    }

    /// The last link of each leg with a toe: its name in a state, and its angle and rate.
    pub(crate) fn toes(&self) -> Vec<(String, [f64; 2])> {
        let legs = self.model.legs.iter().enumerate();
        let toe = |(i, leg): (usize, &crate::model::LegModel<N>)| {
            let values = [
                self.state.angles[N - 1].lane(i),
                self.state.rates[N - 1].lane(i),
            ];
            (format!("leg/{}/toe", leg.name), values)
        };
        legs.filter(|_| N > 3).map(toe).collect()
    }

    /// The same robot where a state has it, with all its books and counts new; and a line on what it could not take over.
    pub(crate) fn gone_on_from(&self, from: &PlantState) -> Result<(Self, Vec<String>), Refused> {
        let body = |why: String| Refused {
            part: "body".to_owned(),
            why,
        };
        let mut posture = self.posture();
        let mut lines = posture.resume_from(from);
        posture.sound().map_err(body)?;
        lines.extend(posture.keep_to(self.model.base));
        let mut next = self.at(&posture);
        for (i, (name, _)) in self.toes().iter().enumerate() {
            let told = from.get(name).filter(|told| told.len() == 2);
            lines.retain(|line| !line.starts_with(&format!("{name} ")));
            if let Some(told) = told.filter(|told| told.iter().all(|value| value.is_finite())) {
                next.state.angles[N - 1] = next.state.angles[N - 1].with_lane(i, told[0]);
                next.state.rates[N - 1] = next.state.rates[N - 1].with_lane(i, told[1]);
            } else {
                lines.push(format!(
                    "{name} is not told, and goes with the third segment"
                ));
            }
        }
        next.check()?;
        next.ledger = twinrig_legged::Ledger::opened(next.stored());
        Ok((next, lines))
    }

    /// The same robot in a posture; servos are told to stay there, motors coast, and nothing holds yet. Toes go unloaded with
    /// the third segments.
    fn at(&self, posture: &Posture) -> Self {
        let mut state = self.state;
        state.position = posture.position.into();
        state.attitude = posture.attitude;
        let turned = rotation(state.attitude);
        state.velocity = into_trunk(&turned, posture.velocity.into());
        state.turning = posture.angular_velocity.into();
        for (i, (leg, (_, of))) in self.model.legs.iter().zip(&posture.legs).enumerate() {
            for k in 0..N {
                let toe = if k > 2 { leg.constants.toe[1] } else { 0.0 };
                let (angle, rate) = (of.angles[k.min(2)] + toe, of.rates[k.min(2)]);
                state.angles[k] = state.angles[k].with_lane(i, angle);
                state.rates[k] = state.rates[k].with_lane(i, rate);
            }
            state.pulley = state.pulley.with_lane(i, of.pulley);
            state.pulley_rate = state.pulley_rate.with_lane(i, of.pulley_rate);
        }
        let mut next = Self::new(self.model.clone(), state, self.method, self.tolerance);
        if let Some(Fitted::Servos(_)) = next.model.drives {
            (next.mode.commands.hip, next.mode.commands.pulley) = (state.angles[0], state.pulley);
        }
        next.logs = self.logs;
        next
    }

    /// Looks whether what is to hold can, and has it found when there are commands.
    fn check(&mut self) -> Result<(), Refused> {
        let mut mode = self.mode;
        self.mark(&mut mode).map_err(|passed| Refused {
            part: format!("leg/{}/{}", self.model.legs[passed.leg].name, passed.what),
            why: format!(
                "it is passed by {:.3e} m, which no force makes good",
                passed.by
            ),
        })?;
        self.fresh = matches!(self.method, Method::Rk4 | Method::Rodas4);
        Ok(())
    }

    fn mark(&mut self, mode: &mut Mode) -> Result<(), Passed> {
        let legs = self.model.legs.len();
        let mut instant = core::mem::take(&mut self.instant);
        let marked = instant.reactivate(&self.scene(0.0), &self.state, &ALL[..legs], mode);
        self.instant = instant;
        marked
    }

    /// Finds the active constraints in a state of another model or method, once the commands of the drives are known: what
    /// pushes under one command lets go under another. Methods that look for them in every step have no need of it.
    pub(crate) fn reactivate(&mut self) -> Result<(), FlowError> {
        let mut mode = self.mode;
        self.mark(&mut mode)
            .map_err(|Passed { by, .. }| FlowError::Apart { by })?;
        mode.recount();
        let before = core::mem::replace(&mut self.mode, mode);
        let logs = core::mem::take(&mut self.logs);
        let mut chosen = Ok(());
        for island in self.islands() {
            chosen = chosen.and_then(|()| self.choose(island, 0.0));
        }
        self.logs = logs;
        let mode = core::mem::replace(&mut self.mode, before);
        chosen?;
        self.note_events(&mode, self.now_s);
        (self.mode, self.fresh) = (mode, false);
        Ok(())
    }
}
