//! A run on hardware with visitors, which are served between its records. The control thread and
//! those of the devices never wait for them.

use std::path::Path;
use std::time::{Duration, Instant};

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_rig::run::hardware::HardwareRun;
use twinrig_rig::run::recording::{description, encoder};
use twinrig_rig::{Assembly, Execution, Report, RunObserver, RunProgress};
use twinrig_runtime::{Group, RunEvent};

use super::published::Published;
use super::sink::Topics;
use super::visitors::{Shown, TICK, Visitors, clock};
use super::{Options, Places, ServeError};
use crate::files::Files;
use crate::hardware::HardwareControl;

/// Number of requests that are carried out between two looks at the clock at most.
const REQUESTS: usize = 64;

/// Time between two samples of a group, as a screen shows them: each message takes time from the
/// processors that transfers need as well.
const SAMPLES: SimDuration = SimDuration::from_millis(20);

/// A run on hardware that is served while it goes on.
pub struct HardwareServer<'a> {
    run: HardwareRun<'a>,
    control: HardwareControl<'a>,
    visitors: Visitors,
    published: Published,
}

impl<'a> HardwareServer<'a> {
    /// Opens the devices of `execution`, whose recording is a file of the folder of `options`, and
    /// begins to listen. The run begins with [`Self::run`].
    ///
    /// # Errors
    /// [`ServeError`].
    pub fn new(
        assembly: &'a Assembly<'a>,
        execution: Execution,
        options: &Options,
    ) -> Result<Self, ServeError> {
        let recording = Files::new(assembly, &options.folder).recording();
        let execution = Execution {
            recording: Some(recording),
            ..execution
        };
        let mut run = HardwareRun::new(assembly, execution)?;
        let steering = run.steering();
        let rig = run.rig();
        let control = HardwareControl::new(assembly, rig, steering, &options.folder)?;
        let visitors = Visitors::new(assembly, rig, options, None)?;
        let topics = Topics::new(visitors.context());
        let published = encoder(assembly, rig, Published::FRAMES, topics)?;
        let published = Published::new(published, rig, description(assembly), SAMPLES)?;
        Ok(Self {
            run,
            control,
            visitors,
            published,
        })
    }

    /// Returns where it listens.
    pub fn places(&self) -> Places {
        self.visitors.places()
    }

    /// Runs to the end of the scenario, or until the program is requested to end; `note` receives
    /// what its user should see.
    ///
    /// # Errors
    /// [`ServeError::Run`] if the recording cannot be created. A run that starts and fails is
    /// reported in the [`Report`].
    pub fn run(self, note: &mut dyn FnMut(&str)) -> Result<Report, ServeError> {
        let mut served = Served {
            control: self.control,
            visitors: self.visitors,
            published: self.published,
            due: clock(),
            note,
        };
        let report = self.run.run(&mut served)?;
        let control = &served.control;
        match control.write_scenario() {
            Ok(Some(path)) => (served.note)(&changes(&path)),
            Ok(None) => {}
            Err(why) => (served.note)(&why),
        }
        Ok(report)
    }
}

fn changes(path: &Path) -> String {
    format!("changes: {}", path.display())
}

/// Observer of the run that serves its visitors.
struct Served<'a, 'n> {
    control: HardwareControl<'a>,
    visitors: Visitors,
    published: Published,
    /// Instant at which visitors are served next.
    due: Instant,
    note: &'n mut dyn FnMut(&str),
}

impl Served<'_, '_> {
    fn serve(&mut self) {
        let Self {
            control,
            visitors,
            published,
            ..
        } = self;
        for _ in 0..REQUESTS {
            let Some(asked) = visitors.next(Duration::ZERO) else {
                break;
            };
            let answered = control.handle(&asked.request);
            asked.reply(answered, control.run());
        }
        visitors.show(control.run().now(), published);
        if visitors.is_due(control.changes) {
            let state = visitors.is_watched().then(|| control.state());
            let shown = Shown {
                run: control.run(),
                changes: control.changes,
                playback: None,
            };
            visitors.show_state(shown, published, state.as_ref());
        }
    }
}

impl RunObserver for Served<'_, '_> {
    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        self.control
            .samples(now, group, values, &mut self.published);
    }

    fn event(&mut self, now: SimTime, event: RunEvent) {
        self.control.event(now, event, &mut self.published);
    }

    fn poll(&mut self, _: &RunProgress<'_>) {
        let now = clock();
        if now >= self.due {
            self.due = now + TICK;
            self.serve();
        }
    }

    fn note(&mut self, text: &str) {
        (self.note)(text);
    }
}
