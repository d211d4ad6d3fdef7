//! What visitors ask of a session, and what they see of it. No clock and no socket: who calls it
//! has both.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_report::comparison::{Comparison, Shown};
use twinrig_runtime::{Bound, Observer};
use twinrig_scenario::{Outcome, Verdict};

use crate::futures;
use crate::request::{Request, StepTo};
use crate::session::{Ended, Session};
use crate::sets::{Sets, write_whole};
use crate::watch::EventKind;

/// Greatest factor of time.
const SPEED_MAX: f64 = 1000.0;

/// Folder of the sets of values, in that of the branches.
const SETS: &str = "sets";

/// Number of events that are shown.
const EVENTS: usize = 50;

/// A session with its visitors.
pub struct Control<'a> {
    session: Session<'a>,
    is_playing: bool,
    /// Simulated time over wall-clock time; infinite: as fast as possible.
    speed: f64,
    slew: f64,
    /// Last refusal or note.
    message: Option<String>,
    /// Folder of the scenarios of branches.
    folder: PathBuf,
    /// Number of the first of them: files of earlier sessions stay.
    first: usize,
    sets: Sets,
    /// Number of acts of each branch that its file has.
    written: Vec<usize>,
    /// Number of requests that were carried out.
    pub(crate) changes: u64,
    /// Whether the run was sought since the last call of [`Self::take_jump`].
    has_jumped: bool,
}

impl<'a> Control<'a> {
    /// Creates the control of a session, whose branches are written to a folder.
    pub fn new(session: Session<'a>, folder: &Path) -> Self {
        Self {
            first: first_free(folder, &stem(&session)),
            session,
            is_playing: true,
            speed: 1.0,
            slew: 0.0,
            message: None,
            folder: folder.to_owned(),
            sets: Sets::new(folder.join(SETS)),
            written: Vec::new(),
            changes: 0,
            has_jumped: false,
        }
    }

    /// Sets the speed at the start, 0 for as fast as possible, and whether time stands still.
    pub fn begin(&mut self, speed: f64, paused: bool) {
        self.speed = if speed > 0.0 { speed } else { f64::INFINITY };
        self.is_playing = !paused;
    }

    /// Returns the session.
    pub fn session(&self) -> &Session<'a> {
        &self.session
    }

    /// Returns whether time goes on.
    pub fn is_playing(&self) -> bool {
        self.is_playing && self.session.ended().is_none()
    }

    /// Returns simulated time over wall-clock time; infinite: as fast as possible.
    pub fn speed(&self) -> f64 {
        self.speed
    }

    /// Returns whether the run was sought since the last call.
    pub fn take_jump(&mut self) -> bool {
        std::mem::take(&mut self.has_jumped)
    }

    /// Advances to `to`, or to the end.
    pub fn advance(&mut self, to: SimTime, caller: &mut dyn Observer) {
        self.session.advance(to, caller);
    }

    /// Carries out a request; returns the response.
    ///
    /// # Errors
    /// A refusal, which says why.
    pub fn handle(
        &mut self,
        request: &Request,
        caller: &mut dyn Observer,
    ) -> Result<Value, String> {
        let handled = self.carry_out(request, caller);
        self.message = handled.clone().err();
        self.changes += 1;
        handled
    }

    fn carry_out(&mut self, request: &Request, caller: &mut dyn Observer) -> Result<Value, String> {
        match *request {
            Request::Play => {
                if let Some(ended) = self.session.ended() {
                    return Err(format!("{}; go back first", ended_text(ended)));
                }
                self.is_playing = true;
            }
            Request::Pause => self.is_playing = false,
            Request::Step { to } => {
                self.is_playing = false;
                let end = self.session.end();
                match to {
                    StepTo::Event => {
                        self.session.advance_to_event(end, caller);
                    }
                    StepTo::Control => {
                        let step = self.session.next_control_step();
                        self.session.advance(step.min(end), caller);
                    }
                }
            }
            Request::Seek { at_s } => {
                self.has_jumped = true;
                let sought = self.session.seek(instant(at_s)?, caller);
                sought.map_err(|error| error.to_string())?;
            }
            Request::Speed { factor } => {
                if !(0.0..=SPEED_MAX).contains(&factor) {
                    return Err(format!("a speed of {factor} is not from 0 to {SPEED_MAX}"));
                }
                self.speed = if factor == 0.0 { f64::INFINITY } else { factor };
            }
            Request::Set {
                ref variable,
                value,
            } => {
                let slew = self.slew_of(variable);
                let set = self.session.set(variable, value, slew);
                set.map_err(|error| error.to_string())?;
            }
            Request::Slew { rate } => {
                if !(rate >= 0.0 && rate.is_finite()) {
                    return Err(format!("{rate} is no rate of a change"));
                }
                self.slew = rate;
            }
            Request::Branch { number, at_s } => {
                self.has_jumped = true;
                let at = at_s.map(instant).transpose()?;
                let selected = self.session.select(number, at, caller);
                selected.map_err(|error| error.to_string())?;
            }
            Request::Compare { one, other } => {
                let compared = futures::compare(&self.session, [one, other]);
                let compared = compared.map_err(|error| error.to_string())?;
                return Ok(json!({ "ok": true, "futures": compared }));
            }
            Request::Save { ref name } => self.save_set(name)?,
            Request::Recall { ref name } => {
                let values = self.sets.read(name, self.session.variables())?;
                let values = values.iter();
                let values = values.map(|(name, value)| (&**name, *value, self.slew_of(name)));
                let values: Vec<_> = values.collect();
                let set = self.session.set_all(&values);
                set.map_err(|error| error.to_string())?;
            }
        }
        Ok(json!({ "ok": true }))
    }

    fn save_set(&mut self, name: &str) -> Result<(), String> {
        let session = &self.session;
        let variables = session.variables().iter().enumerate();
        let values = variables.map(|(index, variable)| {
            let target = session.target(index);
            (variable, target.unwrap_or_else(|| variable.value()))
        });
        let values: Vec<_> = values.collect();
        let comment = format!(
            "Process variables of {} at {}.",
            session.name(),
            session.now()
        );
        self.sets.save(name, &comment, &values)
    }

    /// Returns the greatest change of a variable per second; none without a limit.
    fn slew_of(&self, name: &str) -> Option<f64> {
        let mut variables = self.session.variables().iter();
        let variable = variables.find(|it| it.name() == name)?;
        let scale = match variable.default().abs() {
            0.0 => variable.value().abs(),
            default => default,
        };
        let scale = if scale > 0.0 { scale } else { 1.0 };
        (self.slew > 0.0).then_some(scale * self.slew)
    }

    /// Writes the scenarios of the branches that have changed; returns the paths of new files.
    ///
    /// # Errors
    /// The text of the first that cannot be written; the others are.
    pub fn write_branches(&mut self) -> Result<Vec<PathBuf>, String> {
        let mut new = Vec::new();
        let mut failed = None;
        for number in 0..self.session.branches().len() {
            let count = self.session.branches()[number].acts.len();
            let written = self.written.get(number).copied().unwrap_or(0);
            if self.written.len() <= number {
                self.written.push(0);
            }
            if count == written {
                continue;
            }
            let path = self.path(number);
            match self.write(number, &path) {
                Ok(()) if written == 0 => new.push(path),
                Ok(()) => {}
                Err(why) => failed = failed.or(Some(why)),
            }
            self.written[number] = count;
        }
        failed.map_or(Ok(new), Err)
    }

    fn write(&self, number: usize, path: &Path) -> Result<(), String> {
        let text = self.session.text_of(number, &self.folder);
        let text = text.map_err(|error| error.to_string())?;
        let failed = |error: std::io::Error| format!("cannot write {}: {error}", path.display());
        std::fs::create_dir_all(&self.folder).map_err(failed)?;
        write_whole(path, &text).map_err(failed)
    }

    /// Returns the path of the scenario of a branch.
    pub fn path(&self, branch: usize) -> PathBuf {
        let number = self.first + branch;
        self.folder
            .join(format!("{}-{number}.toml", stem(&self.session)))
    }

    /// Shows a note to visitors.
    pub fn note(&mut self, text: String) {
        self.message = Some(text);
    }

    /// Returns what visitors see, apart from signals and poses.
    pub fn state(&self) -> Value {
        let session = &self.session;
        let (events, _) = session.events();
        let events: Vec<Value> = events
            .map(|event| json!({ "at_s": event.at.as_secs_f64(), "text": self.event(&event.kind) }))
            .collect();
        let events = &events[events.len().saturating_sub(EVENTS)..];
        let reach = session.reach().ok().map(|reach| {
            json!({
                "from_s": reach.from.as_secs_f64(),
                "spacing_s": reach.spacing.as_secs_f64(),
                "count": reach.count,
                "bytes": reach.bytes[0],
                "limit": reach.bytes[1],
            })
        });
        let branches = session.branches().iter().enumerate().map(|(number, branch)| {
            json!({
                "number": number,
                "parent": branch.parent,
                "begin_s": branch.begin.as_secs_f64(),
                "reached_s": branch.reached.as_secs_f64(),
                "acts": branch.acts.len(),
                "file": (!branch.acts.is_empty()).then(|| self.path(number).display().to_string()),
                "fingerprint": branch.fingerprint.map(|it| it.to_string()),
            })
        });
        let outcomes = session.outcomes();
        json!({
            "now_s": session.now().as_secs_f64(),
            "status": match (session.ended(), self.is_playing) {
                (Some(_), _) => "ended",
                (None, true) => "playing",
                (None, false) => "paused",
            },
            "ended": session.ended().map(ended_text),
            "speed": if self.speed.is_finite() { self.speed } else { 0.0 },
            "branch": session.present(),
            "branches": branches.collect::<Vec<_>>(),
            "reach": reach,
            "variables": self.variables(),
            "events": events,
            "expectations": outcomes.iter().map(expectation).collect::<Vec<_>>(),
            "slew": self.slew,
            "sets": self.sets.names(),
            "message": self.message,
        })
    }

    fn variables(&self) -> Vec<Value> {
        let variables = self.session.variables().iter().enumerate();
        let end = |bound: Bound<f64>| match bound {
            Bound::Included(at) | Bound::Excluded(at) => Some(at),
            Bound::Unbounded => None,
        };
        variables
            .map(|(index, variable)| {
                let (min, max) = variable.range();
                json!({
                    "name": variable.name(),
                    "unit": variable.unit().symbol(),
                    "value": variable.value(),
                    "target": self.session.target(index),
                    "default": variable.default(),
                    "min": end(min),
                    "max": end(max),
                    "range": variable.range_text(),
                })
            })
            .collect()
    }

    fn event(&self, kind: &EventKind) -> String {
        match kind {
            EventKind::TouchDown(leg) => format!("{leg} touches down"),
            EventKind::LiftOff(leg) => format!("{leg} lifts off"),
            EventKind::Change { variable, value } => {
                let variable = &self.session.variables()[*variable];
                format!("{} = {value} {}", variable.name(), variable.unit().symbol())
            }
            EventKind::Skipped(task) => {
                let name = self.session.rig().task_names().nth(*task);
                format!("{} is busy beyond its period", name.unwrap_or_default())
            }
            EventKind::Overrun => "the controller is busy beyond its period".to_owned(),
            EventKind::Opened => "all devices are open".to_owned(),
            EventKind::Fall => "the robot falls".to_owned(),
        }
    }
}

/// Returns the name of the file of a scenario.
fn stem(session: &Session<'_>) -> String {
    let file = Path::new(&session.assembly().scenario().file);
    let stem = file.file_stem().unwrap_or_default();
    stem.to_string_lossy().into_owned()
}

/// Returns the first number after those of the files `STEM-NUMBER.toml` in a folder.
fn first_free(folder: &Path, stem: &str) -> usize {
    let files = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let number = |file: std::fs::DirEntry| {
        let name = file.file_name().into_string().ok()?;
        let rest = name.strip_prefix(stem)?.strip_prefix('-')?;
        rest.strip_suffix(".toml")?.parse::<usize>().ok()
    };
    let last = files.filter_map(number).max();
    last.map_or(0, |last| last.saturating_add(1))
}

/// Returns the time that a number of seconds is.
fn instant(at_s: f64) -> Result<SimTime, String> {
    let since = SimDuration::try_from_secs_f64(at_s);
    let since = since.ok_or_else(|| format!("{at_s} s is no instant of a run"))?;
    Ok(SimTime::ZERO + since)
}

/// Returns in words why a run does not go on.
pub fn ended_text(ended: &Ended) -> String {
    match ended {
        Ended::Scenario => "the scenario has ended".to_owned(),
        Ended::Fall => "the robot has fallen, which ends the run".to_owned(),
        Ended::Plant => "the plant has ended the run".to_owned(),
        Ended::Failed(why) => why.clone(),
    }
}

/// Returns an expectation as visitors see it.
fn expectation(outcome: &Outcome) -> Value {
    let comparison = Comparison {
        measured: outcome.measured,
        bound: outcome.bound,
        other_bound: outcome.other_bound,
        margin: outcome.margin,
    };
    let shown = Shown::of(&comparison, outcome.unit.symbol());
    let bound = outcome.bound.map(|bound| {
        // The margin grows with the distance above a lower bound.
        let above = outcome.measured.map(|measured| measured - bound);
        let is_lower = above
            .zip(outcome.margin)
            .is_some_and(|(above, margin)| above * margin > 0.0);
        let relation = if is_lower { "≥" } else { "≤" };
        format!("{relation} {}", shown.with_unit(bound))
    });
    json!({
        "name": outcome.name,
        "verdict": match outcome.verdict {
            Verdict::Pass => "pass",
            Verdict::Fail => "fail",
            Verdict::Unobserved => "unobserved",
        },
        "measured": outcome.measured.map(|it| shown.with_unit(it)),
        "bound": bound,
    })
}
