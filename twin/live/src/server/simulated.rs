//! A session in virtual time with its visitors: the clock decides how far it is advanced.

use std::time::{Duration, Instant};

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_rig::Assembly;
use twinrig_rig::run::recording::{description, encoder};
use twinrig_runtime::interrupt;

use super::published::Published;
use super::requests::{Asked, playback};
use super::sink::Topics;
use super::visitors::{Shown, TICK, Visitors, clock};
use super::{Options, Places, ServeError};
use crate::control::Control;
use crate::session::Session;

/// Delay behind the wall clock that is caught up; a longer one is dropped.
const LAG_MAX: Duration = Duration::from_millis(100);
/// Simulated time that is advanced between two looks at the clock.
const SLICE: SimDuration = SimDuration::from_millis(2);

/// A session that is served until the program is requested to end.
pub struct Server<'a> {
    control: Control<'a>,
    published: Published,
    visitors: Visitors,
    /// Pair of wall-clock and simulated time from which time goes on.
    anchor: (Instant, SimTime),
}

impl<'a> Server<'a> {
    /// Begins to listen. The run is advanced by [`Self::run`].
    ///
    /// # Errors
    /// [`ServeError`].
    pub fn new(assembly: &'a Assembly<'a>, options: &Options) -> Result<Self, ServeError> {
        let session = Session::new(assembly, options.memory)?;
        let end = session.reach().is_ok().then(|| assembly.end());
        let visitors = Visitors::new(assembly, session.rig(), options, end)?;
        let topics = Topics::new(visitors.context());
        let published = encoder(assembly, session.rig(), Published::FRAMES, topics)?;
        let description = description(assembly);
        let published = Published::new(published, session.rig(), description, Published::SAMPLES)?;
        let mut control = Control::new(session, &options.folder);
        control.begin(options.speed, options.paused);
        Ok(Self {
            control,
            published,
            visitors,
            anchor: (clock(), SimTime::ZERO),
        })
    }

    /// Returns where it listens.
    pub fn places(&self) -> Places {
        self.visitors.places()
    }

    /// Returns the session with its visitors.
    pub fn control(&self) -> &Control<'a> {
        &self.control
    }

    /// Serves until the program is requested to end; `note` receives what its user should see.
    pub fn run(&mut self, note: &mut dyn FnMut(&str)) {
        while !interrupt::is_requested() {
            let next = clock() + TICK;
            let mut wait = TICK;
            while let Some(asked) = self.visitors.next(wait) {
                self.answer(asked);
                wait = next.saturating_duration_since(clock());
                // However many are asked, time goes on.
                if wait.is_zero() {
                    break;
                }
            }
            self.advance_to_clock(next + TICK);
            self.show(note);
        }
        self.show(note);
    }

    /// Advances to where the clock is, at most until `deadline`.
    fn advance_to_clock(&mut self, deadline: Instant) {
        if !self.control.is_playing() {
            self.anchor = (clock(), self.control.session().now());
            return;
        }
        loop {
            let wall = clock();
            let now = self.control.session().now();
            let due = self.due(wall);
            if now >= due || wall >= deadline || !self.control.is_playing() {
                break;
            }
            self.control
                .advance((now + SLICE).min(due), &mut self.published);
        }
    }

    /// Returns the simulated time that a run at its speed has at `wall`.
    fn due(&mut self, wall: Instant) -> SimTime {
        let now = self.control.session().now();
        let speed = self.control.speed();
        if speed.is_infinite() {
            self.anchor = (wall, now);
            return SimTime::MAX;
        }
        let at = |(from, since): (Instant, SimTime)| {
            let passed = wall.saturating_duration_since(from).as_secs_f64() * speed;
            let passed = SimDuration::try_from_secs_f64(passed);
            passed
                .and_then(|it| since.checked_add(it))
                .unwrap_or(SimTime::MAX)
        };
        let due = at(self.anchor);
        let lag = SimDuration::try_from_secs_f64(LAG_MAX.as_secs_f64() * speed);
        if lag
            .and_then(|lag| now.checked_add(lag))
            .is_some_and(|most| due > most)
        {
            // Too slow for its speed: from here on.
            self.anchor = (wall, now);
            return now + SLICE;
        }
        due
    }

    fn answer(&mut self, asked: Asked) {
        let speed = self.control.speed();
        let answered = self.control.handle(&asked.request, &mut self.published);
        let jumped = self.control.take_jump();
        if jumped {
            self.published.restart();
        }
        if jumped || speed.to_bits() != self.control.speed().to_bits() {
            self.anchor = (clock(), self.control.session().now());
        }
        asked.reply(answered, self.control.session());
    }

    /// Publishes what visitors see, where it is due.
    fn show(&mut self, note: &mut dyn FnMut(&str)) {
        let session = self.control.session();
        self.visitors.show(session.now(), &self.published);
        if !self.visitors.is_due(self.control.changes) {
            return;
        }
        match self.control.write_branches() {
            Ok(new) => {
                for path in new {
                    note(&format!("branch: {}", path.display()));
                }
            }
            Err(why) => {
                note(&why);
                self.control.note(why);
            }
        }
        let (control, published) = (&self.control, &mut self.published);
        let playback = playback(control);
        self.visitors.show_playback(playback.clone());
        let shown = Shown {
            run: control.session(),
            changes: control.changes,
            playback: Some(playback),
        };
        let state = self.visitors.is_watched().then(|| control.state());
        self.visitors.show_state(shown, published, state.as_ref());
    }
}
