//! A recorded run, repeated where that is possible.

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_record::{RecordError, Recording, VerdictMessage};
use twinrig_rig::run::observers::RunObserver;
use twinrig_rig::run::recorded::assembly_of;
use twinrig_rig::run::repetition::{Detail, Repetition, repeat};
use twinrig_rig::{Assembly, Error, Registry, Report};

/// Greatest number of sets of coordinate frames, and least time between two: half of a frame of a
/// screen, so that slow motion is smooth.
const FRAMES_MAX: u64 = 6000;
const FRAME_MIN: SimDuration = SimDuration::from_millis(5);

/// Instants at which the expectations are evaluated: the dots of a plot.
const INSTANTS: u64 = 250;

/// Reason without a fingerprint.
const CUT_OFF: &str = "the recording was cut off";

/// A recorded run, with its repetition.
pub struct Run<'r> {
    /// Path of the recording, for the reader.
    pub path: String,
    recorded: Recording,
    assembly: Option<Assembly<'r>>,
    repetition: Result<Repetition, String>,
}

impl<'r> Run<'r> {
    /// Reads a recorded run and repeats it; `caller` is polled meanwhile.
    pub fn open(
        registry: &'r Registry,
        path: &str,
        recorded: Recording,
        caller: Option<&mut dyn RunObserver>,
    ) -> Self {
        let is_cut = recorded.fingerprint().is_none();
        let (assembly, repetition) = match assembly_of(registry, &recorded) {
            Ok(assembly) => {
                let repetition = repeated(&assembly, &recorded, caller);
                (Some(assembly), repetition)
            }
            Err(_) if is_cut => (None, Err(CUT_OFF.to_owned())),
            Err(why) => (None, Err(why.to_string())),
        };
        Self {
            path: path.to_owned(),
            recorded,
            assembly,
            repetition,
        }
    }

    /// Runs a scenario in memory; `path` is its name for the reader. `caller` is polled meanwhile.
    ///
    /// # Errors
    /// [`Error`] if the run cannot start. One that starts and fails is shown.
    pub fn compute(
        assembly: Assembly<'r>,
        path: &str,
        caller: Option<&mut dyn RunObserver>,
    ) -> Result<Self, Error> {
        let end = assembly.end();
        let computed = repeat(&assembly, detail(end), end, caller)?;
        Ok(Self {
            path: path.to_owned(),
            recorded: computed.recording.clone(),
            assembly: Some(assembly),
            repetition: Ok(computed),
        })
    }

    /// Returns the report of the run; none of a recording that is not repeated.
    pub fn report(&self) -> Option<&Report> {
        self.repetition().map(|repetition| &repetition.report)
    }

    /// Returns whether the page has more than the recording; if not, the reason.
    ///
    /// # Errors
    /// The reason for which there is no repetition.
    pub fn is_repeated(&self) -> Result<(), &str> {
        match &self.repetition {
            Ok(_) => Ok(()),
            Err(why) => Err(why),
        }
    }

    /// Returns the shown recording: that of the repetition, if there is one.
    pub(crate) fn shown(&self) -> &Recording {
        match &self.repetition {
            Ok(repetition) => &repetition.recording,
            Err(_) => &self.recorded,
        }
    }

    /// Returns the recording on which the page is.
    pub(crate) fn recorded(&self) -> &Recording {
        &self.recorded
    }

    pub(crate) fn assembly(&self) -> Option<&Assembly<'r>> {
        self.assembly.as_ref()
    }

    pub(crate) fn repetition(&self) -> Option<&Repetition> {
        self.repetition.as_ref().ok()
    }

    /// Returns the name of the scenario.
    pub(crate) fn name(&self) -> &str {
        self.recorded.note("scenario").unwrap_or(&self.path)
    }

    /// Returns the end of the run.
    pub(crate) fn end(&self) -> SimTime {
        let reached = self.recorded.reached();
        reached
            .or_else(|| self.recorded.last_sample())
            .unwrap_or(SimTime::ZERO)
    }

    /// Returns the verdict; none of a run that was cut off.
    ///
    /// # Errors
    /// The message cannot be decoded.
    pub(crate) fn verdict(&self) -> Result<Option<VerdictMessage>, RecordError> {
        let verdicts = self.recorded.messages::<VerdictMessage>()?;
        Ok(verdicts.into_iter().next_back().map(|(_, verdict)| verdict))
    }
}

/// Returns the detail of a page of a run up to `end`.
fn detail(end: SimTime) -> Detail {
    Detail {
        frames: SimDuration::from_nanos(end.as_nanos() / FRAMES_MAX).max(FRAME_MIN),
        instants: INSTANTS,
    }
}

/// Repeats a run; the reason if there is no repetition of it.
fn repeated(
    assembly: &Assembly<'_>,
    recorded: &Recording,
    caller: Option<&mut dyn RunObserver>,
) -> Result<Repetition, String> {
    let (Some(fingerprint), Some(end)) = (recorded.fingerprint(), recorded.reached()) else {
        return Err(CUT_OFF.to_owned());
    };
    let repetition =
        repeat(assembly, detail(end), end, caller).map_err(|error| error.to_string())?;
    match repetition.recording.fingerprint() {
        Some(repeated) if repeated == fingerprint => Ok(repetition),
        _ => Err(
            "its repetition by this build has another fingerprint, so that this build is another \
             one, or the recording was changed"
                .to_owned(),
        ),
    }
}
