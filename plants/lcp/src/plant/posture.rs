//! Conversion between the plant's state and the coordinates shared by all plants of a robot.

use twinrig_kernel::signal;
use twinrig_legged::{DriveModels, LegPosture, PartFault, Posture, Readings};
use twinrig_runtime::PlantState;

use crate::constraints::events::Instant;
use crate::model::real::{Lanes, Real};
use crate::model::rotation::{into_trunk, rotation};
use crate::plant::flow::Flow;

impl<const N: usize> Flow<N> {
    /// Returns the posture, without the last link of a leg with a toe.
    pub(crate) fn shared_posture(&self) -> Posture {
        let legs = self.model.legs.iter().enumerate();
        let legs = legs.map(|(i, leg)| {
            let of = |lanes: &[Lanes; N]| std::array::from_fn(|k| lanes[k].lane(i));
            let posture = LegPosture {
                angles: of(&self.run.state.angles),
                rates: of(&self.run.state.rates),
                pulley: self.run.state.pulley.lane(i),
                pulley_rate: self.run.state.pulley_rate.lane(i),
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

    /// Returns the last link of each leg with a toe: its name in a state, its angle and its rate.
    pub(crate) fn toes(&self) -> Vec<(String, Vec<f64>)> {
        let legs = self.model.legs.iter().enumerate();
        let toe = |(i, leg): (usize, &crate::model::LegModel<N>)| {
            let values = vec![
                self.run.state.angles[N - 1].lane(i),
                self.run.state.rates[N - 1].lane(i),
            ];
            (signal::of_leg(&leg.name, "toe"), values)
        };
        legs.filter(|_| N > 3).map(toe).collect()
    }

    /// Returns the same robot in a posture with the toes of `extra`, with new energy balance and
    /// counters; and a line for each value that was not taken over. Contact forces depend on the
    /// commands, so the active constraints are found in its first step.
    pub(crate) fn resumed_from(
        &self,
        posture: &Posture,
        extra: &PlantState,
    ) -> Result<(Self, Vec<String>), PartFault> {
        let mut lines = Vec::new();
        let mut next = self.in_posture(posture);
        for (i, (name, _)) in self.toes().iter().enumerate() {
            let values = extra.get(name).filter(|values| values.len() == 2);
            if let Some(values) =
                values.filter(|values| values.iter().all(|value| value.is_finite()))
            {
                next.run.state.angles[N - 1] = next.run.state.angles[N - 1].with_lane(i, values[0]);
                next.run.state.rates[N - 1] = next.run.state.rates[N - 1].with_lane(i, values[1]);
            } else {
                lines.push(format!(
                    "{name} is missing; the toe follows the third segment"
                ));
            }
        }
        next.check_violation()?;
        next.run.ledger = twinrig_legged::Ledger::opened(next.stored());
        Ok((next, lines))
    }

    /// Returns the same robot in a posture; servos are commanded to stay there, motors coast, and
    /// no constraint is active. Toes follow the third segments without load.
    fn in_posture(&self, posture: &Posture) -> Self {
        let mut state = self.run.state;
        state.position = posture.position.into();
        state.attitude = posture.attitude;
        let trunk_to_world = rotation(state.attitude);
        state.velocity = into_trunk(&trunk_to_world, posture.velocity.into());
        state.turning = posture.angular_velocity.into();
        for (i, (leg, (_, from))) in self.model.legs.iter().zip(&posture.legs).enumerate() {
            for k in 0..N {
                let toe = if k > 2 { leg.constants.toe[1] } else { 0.0 };
                let (angle, rate) = (from.angles[k.min(2)] + toe, from.rates[k.min(2)]);
                state.angles[k] = state.angles[k].with_lane(i, angle);
                state.rates[k] = state.rates[k].with_lane(i, rate);
            }
            state.pulley = state.pulley.with_lane(i, from.pulley);
            state.pulley_rate = state.pulley_rate.with_lane(i, from.pulley_rate);
        }
        let mut next = Self::new(self.model.clone(), state, self.method, self.tolerance);
        if let Some(DriveModels::Servos(_)) = next.model.drives {
            (next.run.mode.commands.hip, next.run.mode.commands.pulley) =
                (state.angles[0], state.pulley);
        }
        next.run.log.enabled = self.run.log.enabled;
        next
    }

    /// Checks the violation of the constraints, and schedules the search for the active ones at the
    /// next step, when the commands are known.
    fn check_violation(&mut self) -> Result<(), PartFault> {
        let mut mode = self.run.mode;
        let closed = Instant::default().reactivate(
            &self.run.dynamics(&self.model, 0.0),
            &self.run.state,
            &mut mode,
        );
        closed.map_err(|violation| PartFault {
            part: signal::of_leg(&self.model.legs[violation.leg].name, violation.what),
            why: format!(
                "the limit is passed by {:.3e} m, which no force can correct",
                violation.by
            ),
        })?;
        self.modes_pending = self.method.is_event_driven();
        Ok(())
    }
}
