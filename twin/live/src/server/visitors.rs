//! Sockets of a run, and what its visitors see.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};

use foxglove::websocket::{Capability, PlaybackState};
use foxglove::{Context, WebSocketServerHandle};
use serde_json::Value;
use tokio::runtime::Runtime;
use twinrig_kernel::SimTime;
use twinrig_record::EPOCH;
use twinrig_rig::Assembly;
use twinrig_rig::run::executor::Executor;
use twinrig_runtime::Group;
use twinrig_view::live::LivePoses;

use super::page::{self, Page};
use super::published::Published;
use super::requests::{self, Asked, Requests, services};
use super::sink::Json;
use super::{Options, Places, ServeError};
use crate::live_run::LiveRun;

/// Wall-clock time between two looks at the clock.
pub(super) const TICK: Duration = Duration::from_millis(10);
/// Wall-clock time between two states, if nothing changes.
const STATE_PERIOD: Duration = Duration::from_millis(200);
/// Wall-clock time between two descriptions of the robot.
const DESCRIPTION_PERIOD: Duration = Duration::from_secs(2);

/// Sockets of a run.
pub(super) struct Visitors {
    context: Arc<Context>,
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
    _page: Page,
    _runtime: Runtime,
}

/// A run of which visitors are shown the state.
pub(super) struct Shown<'r> {
    pub(super) run: &'r dyn LiveRun,
    /// Number of requests that were carried out.
    pub(super) changes: u64,
    pub(super) playback: Option<PlaybackState>,
}

#[expect(
    clippy::disallowed_methods,
    reason = "wall-clock time decides when visitors are served and how far a run is advanced, and \
              nothing in it"
)]
pub(super) fn clock() -> Instant {
    Instant::now()
}

impl Visitors {
    /// Begins to listen. A run with an `end` can be played back up to there.
    pub(super) fn new(
        assembly: &Assembly<'_>,
        executor: &dyn Executor,
        options: &Options,
        end: Option<SimTime>,
    ) -> Result<Self, ServeError> {
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .thread_name("visitors")
            .enable_all()
            .build()?;
        let context = Context::new();
        let state = Json::new(&context, "/live/state")?;
        let frame = Json::new(&context, "/live/frame")?;
        let (requests, asked) = requests::channel();
        let mut server = context
            .websocket_server()
            .name(format!("twinrig, {}", assembly.scenario().name))
            .bind(options.host.clone(), options.ports[0])
            .tokio_runtime(runtime.handle())
            .message_backlog_size(256)
            .capabilities([Capability::Time])
            .parameter_handler(Arc::new(asked.clone()))
            .services(services(&asked));
        if let Some(end) = end {
            server = server.playback_time_range(EPOCH.as_nanos(), since_epoch(end));
        }
        let server = server.listener(Arc::new(asked));
        let failed = |port: u16, why: String| ServeError::Listen {
            place: format!("{}:{port}", options.host),
            why,
        };
        let [socket, port] = options.ports;
        let socket = server
            .start_blocking()
            .map_err(|error| failed(socket, error.to_string()))?;
        let poses = LivePoses::new(assembly, executor.layout(Group::Plant));
        let text = page::text(assembly, socket.port(), poses.as_ref(), executor);
        let page = Page::listen(&runtime, &options.host, port, text)
            .map_err(|error| failed(port, error.to_string()))?;
        let now = clock();
        Ok(Self {
            context,
            requests,
            state,
            frame,
            drawn: None,
            poses,
            places: Places {
                socket: SocketAddr::new(page.address.ip(), socket.port()),
                page: page.address,
            },
            socket,
            shown: (u64::MAX, now),
            described: now,
            _page: page,
            _runtime: runtime,
        })
    }

    pub(super) fn context(&self) -> &Arc<Context> {
        &self.context
    }

    pub(super) fn places(&self) -> Places {
        self.places
    }

    /// Returns the next request, after `wait` at most.
    pub(super) fn next(&self, wait: Duration) -> Option<Asked> {
        self.requests.next(wait)
    }

    /// Publishes the time and the pose of the robot.
    pub(super) fn show(&mut self, now: SimTime, published: &Published) {
        self.socket.broadcast_time(since_epoch(now));
        self.show_frame(published);
    }

    /// Returns whether a state is due after so many requests.
    pub(super) fn is_due(&self, changes: u64) -> bool {
        let (shown, at) = self.shown;
        shown != changes || clock() >= at + STATE_PERIOD
    }

    /// Returns whether a visitor wants the state.
    pub(super) fn is_watched(&self) -> bool {
        self.state.is_wanted()
    }

    /// Publishes the state of a run and its variables, and the description of its robot.
    pub(super) fn show_state(
        &mut self,
        shown: Shown<'_>,
        published: &mut Published,
        state: Option<&Value>,
    ) {
        let (wall, now) = (clock(), shown.run.now());
        self.shown = (shown.changes, wall);
        if let Some(changed) = self.requests.show(shown.run, shown.playback) {
            self.socket.publish_parameter_values(changed);
        }
        if wall >= self.described + DESCRIPTION_PERIOD {
            self.described = wall;
            published.describe(now);
        }
        if let Some(state) = state {
            self.state.publish(now, state);
        }
    }

    pub(super) fn show_playback(&self, playback: PlaybackState) {
        self.socket.broadcast_playback_state(playback);
    }

    /// Publishes the pose of the robot, if there is a new one or that of the last state may have
    /// been missed.
    fn show_frame(&mut self, published: &Published) {
        let Some(poses) = &self.poses else {
            return;
        };
        let is_due = clock() >= self.shown.1 + STATE_PERIOD;
        if self.frame.is_wanted()
            && let Some((at, values)) = published.plant()
            && (is_due || self.drawn != Some(at))
            && let Some(frame) = poses.at(at, values)
        {
            self.frame.publish(at, &frame);
            self.drawn = Some(at);
        }
    }
}

/// Converts `now` to the time line of recordings \[ns\].
pub(super) fn since_epoch(now: SimTime) -> u64 {
    now.as_nanos().saturating_add(EPOCH.as_nanos())
}
