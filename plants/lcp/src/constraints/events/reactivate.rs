//! Active constraints in a state of another model, which may leave gaps slightly open or
//! penetrated.

use super::Instant;
use super::entry::{Feet, Role};
use super::resolve_modes::motors_only;
use crate::constraints::contacts::CONTACTS;
use crate::constraints::contacts::Contact;
use crate::constraints::mode::Mode;
use crate::constraints::motion::Dynamics;
use crate::model::constants::ALL;
use crate::model::real::{Lanes, Real};
use crate::model::state::State;

/// Gap \[m\] and rate \[m/s\] below which a constraint counts as closed: bounds for a rule that
/// imposes velocities and corrects overlaps over several steps.
const NEARLY_CLOSED: f64 = 1e-6;
const SLOW: f64 = 1e-3;

/// Violation above which a state is rejected \[m\].
const EXCESS: f64 = 5e-3;

/// Stop or ground contact with a violation above [`EXCESS`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ExcessViolation {
    pub(crate) leg: usize,
    pub(crate) what: &'static str,
    /// \[m\]
    pub(crate) by: f64,
}

impl<const N: usize> Instant<N> {
    /// Stores all closed or nearly closed constraints with small rates in the mode;
    /// [`Instant::resolve_modes`] selects the active ones. A gap that closes faster is left out: it
    /// causes an impact in the next step.
    ///
    /// # Errors
    /// [`ExcessViolation`] for the first constraint that is violated by more than [`EXCESS`].
    pub(crate) fn reactivate(
        &mut self,
        dynamics: &Dynamics<'_, Lanes, N>,
        state: &State<Lanes, N>,
        mode: &mut Mode,
    ) -> Result<(), ExcessViolation> {
        let (articulated, drive) = motors_only(dynamics, state);
        let near =
            |gap: f64, rate: f64| gap < -EXCESS || (gap < NEARLY_CLOSED && rate.abs() < SLOW);
        self.find_entries(
            dynamics,
            state,
            &articulated,
            &drive,
            &ALL[..dynamics.model.legs.len()],
            Feet::BySpeed,
            &near,
        );
        for entry in self.entries.iter().filter(|entry| entry.is_normal()) {
            let leg = entry.row.leg;
            if entry.gap < -EXCESS {
                let by = -entry.gap;
                let what = match entry.role {
                    Role::Stop(stop) => stop.name(),
                    _ => "ground",
                };
                return Err(ExcessViolation { leg, what, by });
            }
            match entry.role {
                Role::Stop(stop) => {
                    let active = stop.active_mut(mode);
                    *active = active.with_lane(leg, 1.0);
                }
                Role::Normal { links, slides } if mode.contacts.len() < CONTACTS => {
                    mode.contacts.push(Contact { leg, links, slides });
                }
                Role::Normal { .. } | Role::Tangent { .. } => {}
            }
        }
        Ok(())
    }
}
