//! An instance with its state machine and logger, behind the pointer that the master has.

use std::ffi::{CString, c_char};

use twinrig_rig::fmu::{FmuError, FmuInstance, FmuState};
use twinrig_runtime::catch_panic;

use crate::failure::{Failure, Status};
use crate::logger::{Logger, c_text};
use crate::phase::Phase;
use crate::raw;

/// An instance as the master has it, behind an opaque pointer.
pub(crate) struct Component {
    instance: FmuInstance,
    phase: Phase,
    logger: Logger,
    /// Texts returned by the last call, which the master reads until the next one.
    texts: Vec<CString>,
}

impl Component {
    /// Creates an instance; an error is logged, and the pointer is then null.
    pub(crate) fn create(
        logger: Logger,
        call: &str,
        build: impl FnOnce() -> Result<FmuInstance, Failure>,
    ) -> *mut Self {
        let built = catch_panic(build);
        let built = built.unwrap_or_else(|panic| Err(FmuError::Panic(panic).into()));
        match built {
            Ok(instance) => Box::into_raw(Box::new(Self {
                instance,
                phase: Phase::Instantiated,
                logger,
                texts: Vec::new(),
            })),
            Err(failure) => {
                logger.log(Status::Error, &format!("{call}: {failure}"));
                std::ptr::null_mut()
            }
        }
    }

    /// Frees an instance.
    ///
    /// # Safety
    /// `component` is null or of [`Component::create`], and is not used afterwards.
    pub(crate) unsafe fn free(component: *mut Self) {
        if component.is_null() {
            return;
        }
        // SAFETY: made by `Box::into_raw`, and freed once.
        let component = unsafe { Box::from_raw(component) };
        // The drop of a part may panic, and must not unwind into C.
        let _ = catch_panic(move || drop(component));
    }

    /// Handles a call of the master in one of the `allowed` phases, and returns its status. Errors
    /// are logged; a panic makes the instance unusable.
    ///
    /// # Safety
    /// `component` is null or of [`Component::create`] and not freed, and no other call uses it.
    pub(crate) unsafe fn call(
        component: *mut Self,
        call: &'static str,
        allowed: &[Phase],
        handle: impl FnOnce(&mut Self) -> Result<(), Failure>,
    ) -> Status {
        // SAFETY: as the caller promises.
        let Some(component) = (unsafe { component.as_mut() }) else {
            return Status::Error;
        };
        let phase = component.phase;
        if phase == Phase::Fatal {
            return Status::Fatal;
        }
        let handled = if allowed.contains(&phase) {
            let handled = catch_panic(|| handle(component));
            handled.unwrap_or_else(|panic| Err(FmuError::Panic(panic).into()))
        } else {
            Err(Failure::Phase { phase })
        };
        let Err(failure) = handled else {
            return Status::Ok;
        };
        let status = failure.status();
        if status == Status::Fatal {
            component.phase = Phase::Fatal;
        }
        component.logger.log(status, &format!("{call}: {failure}"));
        status
    }

    pub(crate) fn instance(&mut self) -> &mut FmuInstance {
        &mut self.instance
    }

    pub(crate) fn enter(&mut self, phase: Phase) {
        self.phase = phase;
    }

    /// Ends the initialization: handles the events of the start.
    pub(crate) fn begin(&mut self) -> Result<(), Failure> {
        self.phase = Phase::Error;
        self.instance.begin()?;
        self.phase = Phase::Step;
        Ok(())
    }

    /// Sets inputs, all or none of them.
    pub(crate) fn set_numbers(
        &mut self,
        kind: &'static str,
        references: &[u32],
        values: &[f64],
    ) -> Result<(), Failure> {
        let set = self.instance.set_numbers(kind, references, values);
        self.checked(set)
    }

    /// Takes a step. After the failure of a part there is no further one; a step that is refused
    /// changes nothing.
    pub(crate) fn step(&mut self, current_s: f64, step_s: f64) -> Result<(), Failure> {
        let stepped = self.instance.step(current_s, step_s);
        self.checked(stepped)
    }

    /// Ends the steps after the failure of a part.
    fn checked(&mut self, result: Result<(), FmuError>) -> Result<(), Failure> {
        if let Err(FmuError::Failed(_)) = result {
            self.phase = Phase::Error;
        }
        Ok(result?)
    }

    /// Builds the instance anew.
    pub(crate) fn reset(&mut self) -> Result<(), Failure> {
        self.phase = Phase::Error;
        self.instance.reset()?;
        self.phase = Phase::Instantiated;
        Ok(())
    }

    /// Writes texts to the array of the master.
    pub(crate) fn read_texts(
        &mut self,
        references: &[u32],
        values: &mut [*const c_char],
    ) -> Result<(), Failure> {
        let texts = references.iter().map(|it| self.instance.text(*it));
        let texts: Result<Vec<String>, FmuError> = texts.collect();
        self.texts = texts?.iter().map(|text| c_text(text)).collect();
        for (value, text) in values.iter_mut().zip(&self.texts) {
            *value = text.as_ptr();
        }
        Ok(())
    }

    /// Saves the instance to `*state`, which is null or an earlier state, to be replaced.
    ///
    /// # Safety
    /// `state` is null, or points to null or to a state that was saved and not freed.
    pub(crate) unsafe fn save(&mut self, state: *mut *mut FmuState) -> Result<(), Failure> {
        // SAFETY: as the caller promises.
        let state = unsafe { raw::place(state, "FMUstate") }?;
        let saved = self.instance.save(self.phase.number())?;
        // SAFETY: as the caller promises.
        match unsafe { state.as_mut() } {
            Some(known) => *known = saved,
            None => *state = Box::into_raw(Box::new(saved)),
        }
        Ok(())
    }

    /// Writes the number of bytes of a serialised state to `*size`.
    ///
    /// # Safety
    /// `state` is null, or a state that was saved and not freed; `size` is null or a place of the
    /// master.
    pub(crate) unsafe fn serialised_size(
        &mut self,
        state: *mut FmuState,
        size: *mut usize,
    ) -> Result<(), Failure> {
        // SAFETY: as the caller promises.
        let (state, size) = unsafe { (known(state)?, raw::place(size, "size")?) };
        *size = self.instance.serialise(state).len();
        Ok(())
    }

    /// Writes a serialised state to a buffer of `size` bytes.
    ///
    /// # Safety
    /// `state` is null, or a state that was saved and not freed; `buffer` is null or an array of
    /// the master.
    pub(crate) unsafe fn serialise(
        &mut self,
        state: *mut FmuState,
        buffer: *mut u8,
        size: usize,
    ) -> Result<(), Failure> {
        // SAFETY: as the caller promises.
        let state = unsafe { known(state) }?;
        // SAFETY: as the caller promises.
        let buffer = unsafe { raw::slice_mut(buffer, size, "serializedState") }?;
        raw::write(&self.instance.serialise(state), buffer)
    }

    /// Makes a state of `size` serialised bytes, and writes it to `*state`, whose present value is
    /// not read: masters pass variables that they have not initialised.
    ///
    /// # Safety
    /// `bytes` is null or an array of the master, `state` null or a place of it.
    pub(crate) unsafe fn deserialise(
        &mut self,
        bytes: *const u8,
        size: usize,
        state: *mut *mut FmuState,
    ) -> Result<(), Failure> {
        // SAFETY: as the caller promises.
        let bytes = unsafe { raw::slice(bytes, size, "serializedState") }?;
        // SAFETY: as the caller promises.
        let place = unsafe { raw::place(state, "FMUstate") }?;
        *place = Box::into_raw(Box::new(self.instance.deserialise(bytes)?));
        Ok(())
    }

    /// Restores a state, with its phase.
    ///
    /// # Safety
    /// `state` is null, or a state that was saved and not freed.
    pub(crate) unsafe fn restore(&mut self, state: *mut FmuState) -> Result<(), Failure> {
        // SAFETY: as the caller promises.
        let number = self.instance.restore(unsafe { known(state) }?)?;
        // Numbers are those of phases, since no other ones are saved.
        self.phase = Phase::of_number(number).unwrap_or(Phase::Error);
        Ok(())
    }
}

/// Returns the state behind a pointer of the master.
///
/// # Safety
/// `state` is null, or points to a state that was saved and not freed.
unsafe fn known<'a>(state: *mut FmuState) -> Result<&'a FmuState, Failure> {
    // SAFETY: as the caller promises.
    unsafe { raw::place(state, "FMUstate") }.map(|state| &*state)
}

/// Frees a state, and sets the pointer to null.
///
/// # Safety
/// `state` is null, or points to null or to a state that was saved and not freed.
pub(crate) unsafe fn free_state(state: *mut *mut FmuState) {
    // SAFETY: as the caller promises.
    if let Some(state) = unsafe { state.as_mut() } {
        if !state.is_null() {
            // SAFETY: made by `Box::into_raw` in `Component::save` or at deserialisation.
            drop(unsafe { Box::from_raw(*state) });
        }
        *state = std::ptr::null_mut();
    }
}
