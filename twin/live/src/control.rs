//! What visitors ask of a session, and what they see of it. No clock and no socket: who calls it
//! has both.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::Observer;

use crate::files::Files;
use crate::request::{Request, StepTo};
use crate::session::{Ended, Session};
use crate::tuning::Tuning;
use crate::{futures, live_run};

/// Greatest factor of time.
const SPEED_MAX: f64 = 1000.0;

/// A session with its visitors.
pub struct Control<'a> {
    session: Session<'a>,
    is_playing: bool,
    /// Simulated time over wall-clock time; infinite: as fast as possible.
    speed: f64,
    tuning: Tuning,
    /// Last refusal or note.
    message: Option<String>,
    files: Files,
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
            files: Files::new(session.assembly(), folder),
            session,
            is_playing: true,
            speed: 1.0,
            tuning: Tuning::new(folder, 0.0),
            message: None,
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
            Request::Set { .. }
            | Request::Slew { .. }
            | Request::Save { .. }
            | Request::Recall { .. } => self.tuning.handle(request, &mut self.session)?,
        }
        Ok(json!({ "ok": true }))
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
            match self.write(number) {
                Ok(path) if written == 0 => new.push(path),
                Ok(_) => {}
                Err(why) => failed = failed.or(Some(why)),
            }
            self.written[number] = count;
        }
        failed.map_or(Ok(new), Err)
    }

    fn write(&self, number: usize) -> Result<PathBuf, String> {
        let session = &self.session;
        let branch = &session.branches()[number];
        let (assembly, variables) = (session.assembly(), session.units());
        self.files.write(number, branch, assembly, variables)
    }

    /// Returns the path of the scenario of a branch.
    pub fn path(&self, branch: usize) -> PathBuf {
        self.files.scenario(branch)
    }

    /// Shows a note to visitors.
    pub fn note(&mut self, text: String) {
        self.message = Some(text);
    }

    /// Returns what visitors see, apart from signals and poses.
    pub fn state(&self) -> Value {
        let session = &self.session;
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
        let mut state = self.tuning.state(session);
        let own = json!({
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
            "message": self.message,
        });
        live_run::extend(&mut state, own);
        state
    }
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
