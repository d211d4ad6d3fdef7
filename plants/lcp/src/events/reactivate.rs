//! What may hold in a state that another model came to: it may be open by what that model overlooks, or closed too far.

use super::Instant;
use super::closed::{Feet, Role, Stop};
use super::resolve_modes::motors_only;
use crate::contacts::CONTACTS;
use crate::mode::{Contact, Mode};
use crate::motion::Scene;
use crate::real::{Lanes, Real};
use crate::state::State;

/// Gaps below this are as good as closed where they hardly move \[m\], \[m/s\]: what a rule that holds velocities and gives
/// overlaps back over some steps leaves of them.
const NEXT_TO_CLOSED: f64 = 1e-6;
const SLOW: f64 = 1e-3;

/// What is passed by more than this is not worth being called a stop \[m\].
const PASSED_MAX: f64 = 5e-3;

/// A stop that is passed, or a foot in the ground, by more than can be made good.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Passed {
    pub(crate) leg: usize,
    pub(crate) what: &'static str,
    /// \[m\]
    pub(crate) by: f64,
}

impl<const N: usize> Instant<N> {
    /// Notes in the mode all that is closed, or next to it, and hardly moves; which of it pushes is for
    /// [`Instant::resolve_modes`] to say. What closes faster is not noted: it strikes as soon as time goes on.
    pub(crate) fn reactivate(
        &mut self,
        scene: &Scene<'_, Lanes, N>,
        state: &State<Lanes, N>,
        legs: &[usize],
        mode: &mut Mode,
    ) -> Result<(), Passed> {
        let (articulated, drive) = motors_only(scene, state);
        let near =
            |gap: f64, rate: f64| gap < -PASSED_MAX || (gap < NEXT_TO_CLOSED && rate.abs() < SLOW);
        self.find(
            scene,
            state,
            &articulated,
            &drive,
            legs,
            Feet::BySpeed,
            &near,
        );
        for entry in self.entries.iter().filter(|entry| entry.is_normal()) {
            let leg = entry.row.leg;
            if entry.gap < -PASSED_MAX {
                let by = -entry.gap;
                let what = match entry.role {
                    Role::Stop(stop) => stop.name(),
                    _ => "ground",
                };
                return Err(Passed { leg, what, by });
            }
            match entry.role {
                Role::Stop(stop) => {
                    let active = Stop::of(stop, mode);
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
