//! Active constraints in a state of another model or method.

use super::EventDriven;
use crate::integrators::run_state::RunState;
use crate::integrators::step_error::StepError;
use crate::model::Model;

impl<const N: usize> EventDriven<N> {
    /// Finds the active constraints in a state of another model or method, once the commands of the
    /// drives are known: the sign of a constraint force depends on them. Methods that select the
    /// active constraints in every step do not need it.
    pub(crate) fn reactivate(
        &mut self,
        model: &Model<N>,
        run: &mut RunState<N>,
    ) -> Result<(), StepError> {
        let mut mode = run.mode;
        self.instant
            .reactivate(&run.dynamics(model, 0.0), &run.state, &mut mode)
            .map_err(|violation| StepError::ConstraintViolation { by: violation.by })?;
        mode.update_any();
        let before = core::mem::replace(&mut run.mode, mode);
        let logging = core::mem::take(&mut run.log.enabled);
        let mut selected = Ok(());
        for island in model.islands() {
            selected =
                selected.and_then(|()| self.select_modes(model, run, island, 0.0, run.now_s));
        }
        run.log.enabled = logging;
        let mode = core::mem::replace(&mut run.mode, before);
        selected?;
        run.log_changes(model, &mode, run.now_s);
        run.mode = mode;
        Ok(())
    }
}
