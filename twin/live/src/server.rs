//! Visitors of a session by WebSocket, in Foxglove's protocol, and a page over HTTP.
//!
//! The run has one thread, which never waits for a visitor: messages go to queues of a limited
//! length, from which the oldest is dropped, and requests come from one.

mod page;
mod published;
mod requests;
mod sink;

use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use foxglove::websocket::Capability;
use foxglove::{Context, FoxgloveError, WebSocketServerHandle};
use thiserror::Error;
use tokio::runtime::Runtime;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_record::{EPOCH, RecordError};
use twinrig_rig::Assembly;
use twinrig_rig::run::recording::{description, encoder};
use twinrig_runtime::interrupt;
use twinrig_view::live::LivePoses;

use self::page::Page;
use self::published::Published;
use self::requests::{Asked, Requests, services};
use self::sink::{Json, Topics};
use crate::control::Control;
use crate::error::LiveError;
use crate::session::Session;

/// Wall-clock time between two looks at the clock.
const TICK: Duration = Duration::from_millis(10);
/// Wall-clock time between two states, if nothing changes.
const STATE_PERIOD: Duration = Duration::from_millis(200);
/// Wall-clock time between two descriptions of the robot.
const DESCRIPTION_PERIOD: Duration = Duration::from_secs(2);
/// Delay behind the wall clock that is caught up; a longer one is dropped.
const LAG_MAX: Duration = Duration::from_millis(100);
/// Simulated time that is advanced between two looks at the clock.
const SLICE: SimDuration = SimDuration::from_millis(2);

/// How a session is served.
#[derive(Clone, Debug)]
pub struct Options {
    /// Address of the interface: loopback, or one that other machines reach.
    pub host: String,
    /// Port of the WebSocket, and of the page; 0: any that is free.
    pub ports: [u16; 2],
    /// Folder of the scenarios of branches.
    pub folder: PathBuf,
    /// Limit of the memory of saved states \[bytes\].
    pub memory: usize,
    /// Simulated time over wall-clock time; 0: as fast as possible.
    pub speed: f64,
    /// Whether time stands still at the start.
    pub paused: bool,
}

/// Where a session is served.
#[derive(Clone, Copy, Debug)]
pub struct Places {
    /// Address of the WebSocket.
    pub socket: SocketAddr,
    /// Address of the page.
    pub page: SocketAddr,
}

/// Failure to serve a session.
#[derive(Debug, Error)]
pub enum ServeError {
    /// The session cannot be created.
    #[error(transparent)]
    Live(#[from] LiveError),
    /// A port cannot be listened at.
    #[error("cannot listen at {place}: {why}; another program may, --port 0 takes a free one")]
    Listen {
        /// Address and port.
        place: String,
        /// Cause.
        why: String,
    },
    /// A channel cannot be declared.
    #[error("cannot declare the channels of the run: {0}")]
    Channels(#[from] FoxgloveError),
    /// The signals cannot be described.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The threads of the server cannot be started.
    #[error("cannot start the server: {0}")]
    Start(#[from] io::Error),
}

/// A session that is served until the program is requested to end.
pub struct Server<'a> {
    control: Control<'a>,
    published: Published,
    requests: Requests,
    socket: WebSocketServerHandle,
    state: Json,
    frame: Json,
    /// Time of the last frame.
    drawn: Option<SimTime>,
    poses: Option<LivePoses>,
    places: Places,
    /// Number of requests that the last state had, and its time.
    shown: (u64, Instant),
    /// Time of the last description of the robot.
    described: Instant,
    /// Pair of wall-clock and simulated time from which time goes on.
    anchor: (Instant, SimTime),
    _page: Page,
    _runtime: Runtime,
}

#[expect(
    clippy::disallowed_methods,
    reason = "wall-clock time decides how far a run is advanced, and nothing in it"
)]
fn clock() -> Instant {
    Instant::now()
}

impl<'a> Server<'a> {
    /// Begins to listen. The run is advanced by [`Self::run`].
    ///
    /// # Errors
    /// [`ServeError`].
    pub fn new(assembly: &'a Assembly<'a>, options: &Options) -> Result<Self, ServeError> {
        let session = Session::new(assembly, options.memory)?;
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .thread_name("visitors")
            .enable_all()
            .build()?;
        let context = Context::new();
        let topics = Topics::new(&context);
        let published = encoder(assembly, session.rig(), Published::FRAMES, topics)?;
        let published = Published::new(published, session.rig(), description(assembly))?;
        let state = Json::new(&context, "/live/state")?;
        let frame = Json::new(&context, "/live/frame")?;
        let (requests, asked) = requests::channel();
        let end = assembly.end().as_nanos().saturating_add(EPOCH.as_nanos());
        let mut server = context
            .websocket_server()
            .name(format!("twinrig, {}", assembly.scenario().name))
            .bind(options.host.clone(), options.ports[0])
            .tokio_runtime(runtime.handle())
            .message_backlog_size(256)
            .capabilities([Capability::Time])
            .parameter_handler(Arc::new(asked.clone()))
            .services(services(&asked));
        if session.reach().is_ok() {
            server = server.playback_time_range(EPOCH.as_nanos(), end);
        }
        let server = server.listener(Arc::new(asked));
        let socket = server
            .start_blocking()
            .map_err(|error| ServeError::Listen {
                place: format!("{}:{}", options.host, options.ports[0]),
                why: error.to_string(),
            })?;
        let poses = LivePoses::new(
            assembly,
            session.rig().layout(twinrig_runtime::Group::Plant),
        );
        let text = page::text(assembly, socket.port(), poses.as_ref(), session.rig());
        let page = Page::listen(&runtime, &options.host, options.ports[1], text);
        let page = page.map_err(|error| ServeError::Listen {
            place: format!("{}:{}", options.host, options.ports[1]),
            why: error.to_string(),
        })?;
        let places = Places {
            socket: SocketAddr::new(page.address.ip(), socket.port()),
            page: page.address,
        };
        let mut control = Control::new(session, &options.folder);
        control.begin(options.speed, options.paused);
        let now = clock();
        Ok(Self {
            control,
            published,
            requests,
            socket,
            state,
            frame,
            drawn: None,
            poses,
            places,
            shown: (u64::MAX, now),
            described: now,
            anchor: (now, SimTime::ZERO),
            _page: page,
            _runtime: runtime,
        })
    }

    /// Returns where it listens.
    pub fn places(&self) -> Places {
        self.places
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
            while let Some(asked) = self.requests.next(wait) {
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
        asked.reply(answered, &self.control);
    }

    /// Publishes what visitors see, where it is due.
    fn show(&mut self, note: &mut dyn FnMut(&str)) {
        let session = self.control.session();
        let now = session.now();
        self.socket
            .broadcast_time(now.as_nanos().saturating_add(EPOCH.as_nanos()));
        if let Some(changed) = self.requests.show(&self.control) {
            self.socket.publish_parameter_values(changed);
        }
        self.show_frame();
        let (changes, at) = self.shown;
        let wall = clock();
        if changes == self.control.changes && wall < at + STATE_PERIOD {
            return;
        }
        self.shown = (self.control.changes, wall);
        if wall >= self.described + DESCRIPTION_PERIOD {
            self.described = wall;
            self.published.describe(now);
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
        if self.state.is_wanted() {
            self.state.publish(now, &self.control.state());
        }
        self.socket
            .broadcast_playback_state(requests::playback(&self.control));
    }

    /// Publishes the pose of the robot, if there is a new one or that of the last state may have
    /// been missed.
    fn show_frame(&mut self) {
        let Some(poses) = &self.poses else {
            return;
        };
        let is_due = clock() >= self.shown.1 + STATE_PERIOD;
        if self.frame.is_wanted()
            && let Some((at, values)) = self.published.plant()
            && (is_due || self.drawn != Some(at))
            && let Some(frame) = poses.at(at, values)
        {
            self.frame.publish(at, &frame);
            self.drawn = Some(at);
        }
    }
}
