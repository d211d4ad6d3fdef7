//! Requests of visitors: services, parameters and playback controls, in one queue.

use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use foxglove::Schema;
use foxglove::websocket::service::{Handler, Request as Call, Responder, Service, ServiceSchema};
use foxglove::websocket::{
    AnyClient, GetParametersResponder, Parameter, ParameterHandler, ParameterValue,
    PlaybackCommand, PlaybackControlRequest, PlaybackState, PlaybackStatus, ServerListener,
    SetParametersResponder,
};
use serde_json::Value;
use twinrig_kernel::Unit;
use twinrig_record::EPOCH;
use twinrig_runtime::ProcessVariable;

use crate::control::Control;
use crate::live_run::LiveRun;
use crate::request::{Request, SERVICES};

/// Number of requests that wait at most.
const WAITING: usize = 256;
/// Length of a request at most \[bytes\].
const LONGEST: usize = 4096;
const NOT_NOW: &str = "too many requests wait";

/// A request with its reply.
pub(super) struct Asked {
    pub(super) request: Request,
    reply: Option<Reply>,
}

enum Reply {
    Call(Responder),
    /// With the names of the parameters.
    Parameters(SetParametersResponder, Vec<String>),
}

impl Asked {
    pub(super) fn reply(self, answered: Result<Value, String>, run: &dyn LiveRun) {
        match self.reply {
            Some(Reply::Call(responder)) => responder.respond(answered.map(|it| it.to_string())),
            Some(Reply::Parameters(responder, names)) => {
                let mut all = parameters(run);
                all.retain(|it| names.contains(&it.name));
                responder.respond(all);
            }
            None => {}
        }
    }
}

/// What visitors see without a request to the run.
#[derive(Default)]
struct Seen {
    parameters: Vec<Parameter>,
    playback: Option<PlaybackState>,
}

/// Receiving end of the requests.
pub(super) struct Requests {
    queue: Receiver<Asked>,
    seen: Arc<Mutex<Seen>>,
}

/// Sending end of the requests, in the threads of the server.
#[derive(Clone)]
pub(super) struct Asking {
    queue: SyncSender<Asked>,
    seen: Arc<Mutex<Seen>>,
}

pub(super) fn channel() -> (Requests, Asking) {
    let (send, queue) = sync_channel(WAITING);
    let seen = Arc::new(Mutex::new(Seen::default()));
    let asking = Asking {
        queue: send,
        seen: seen.clone(),
    };
    (Requests { queue, seen }, asking)
}

impl Requests {
    /// Returns the next request, after `wait` at most.
    pub(super) fn next(&self, wait: Duration) -> Option<Asked> {
        match self.queue.recv_timeout(wait) {
            Ok(asked) => Some(asked),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => {
                std::thread::sleep(wait);
                None
            }
        }
    }

    /// Lets visitors see the present values; returns the parameters if they have changed.
    pub(super) fn show(
        &self,
        run: &dyn LiveRun,
        playback: Option<PlaybackState>,
    ) -> Option<Vec<Parameter>> {
        let parameters = parameters(run);
        let mut seen = self.seen.lock().unwrap_or_else(PoisonError::into_inner);
        seen.playback = playback;
        let is_new = seen.parameters != parameters;
        seen.parameters.clone_from(&parameters);
        is_new.then_some(parameters)
    }
}

/// Returns the state of playback.
pub(super) fn playback(control: &Control<'_>) -> PlaybackState {
    let session = control.session();
    #[expect(clippy::cast_possible_truncation, reason = "a factor for a display")]
    let speed = control.speed().min(1e6) as f32;
    PlaybackState {
        status: match (session.ended(), control.is_playing()) {
            (Some(_), _) => PlaybackStatus::Ended,
            (None, true) => PlaybackStatus::Playing,
            (None, false) => PlaybackStatus::Paused,
        },
        current_time: session.now().as_nanos().saturating_add(EPOCH.as_nanos()),
        playback_speed: speed,
        did_seek: false,
        request_id: None,
    }
}

/// Suffix of the parameter with range and unit of a variable.
const ABOUT: &str = ".about";

/// Returns the values that the process variables are to have, with their ranges and units.
fn parameters(run: &dyn LiveRun) -> Vec<Parameter> {
    let variables = run.variables().iter().enumerate();
    let parameter = |(index, variable): (usize, &ProcessVariable)| {
        let name = variable.name();
        let value = run.target(index).unwrap_or_else(|| variable.value());
        let unit = match variable.unit() {
            Unit::One => "",
            unit => unit.symbol(),
        };
        let (range, default) = (variable.range_text(), variable.default());
        let about = format!("{range} {unit}, default {default} {unit}").replace(" ,", ",");
        [
            Parameter::float64(name, value),
            Parameter::string(format!("{name}{ABOUT}"), about.trim_end()),
        ]
    };
    variables.flat_map(parameter).collect()
}

impl Asking {
    /// Queues a request, or refuses it by its reply.
    fn ask(&self, request: Request, reply: Option<Reply>) {
        let asked = Asked { request, reply };
        let refused = match self.queue.try_send(asked) {
            Ok(()) => return,
            Err(TrySendError::Full(refused) | TrySendError::Disconnected(refused)) => refused,
        };
        match refused.reply {
            Some(Reply::Call(responder)) => responder.respond(Err::<&str, _>(NOT_NOW)),
            Some(Reply::Parameters(responder, _)) => responder.respond(Vec::new()),
            None => {}
        }
    }

    fn seen(&self) -> (Vec<Parameter>, Option<PlaybackState>) {
        let seen = self.seen.lock().unwrap_or_else(PoisonError::into_inner);
        (seen.parameters.clone(), seen.playback.clone())
    }
}

impl ParameterHandler for Asking {
    fn get(
        &self,
        _: AnyClient,
        names: Vec<String>,
        _: Option<String>,
        responder: GetParametersResponder,
    ) {
        let (mut parameters, _) = self.seen();
        parameters.retain(|it| names.is_empty() || names.contains(&it.name));
        responder.respond(parameters);
    }

    fn set(
        &self,
        _: AnyClient,
        parameters: Vec<Parameter>,
        _: Option<String>,
        responder: SetParametersResponder,
    ) {
        let names: Vec<String> = parameters.iter().map(|it| it.name.clone()).collect();
        let requests = parameters.into_iter().filter_map(|parameter| {
            #[expect(clippy::cast_precision_loss, reason = "a value that someone has typed")]
            let value = match parameter.value? {
                ParameterValue::Float64(value) => value,
                ParameterValue::Integer(value) => value as f64,
                _ => return None,
            };
            let variable = parameter.name;
            Some(Request::Set { variable, value })
        });
        let mut requests = requests.collect::<Vec<_>>();
        let Some(last) = requests.pop() else {
            responder.respond(Vec::new());
            return;
        };
        for request in requests {
            self.ask(request, None);
        }
        self.ask(last, Some(Reply::Parameters(responder, names)));
    }
}

impl ServerListener for Asking {
    fn on_playback_control_request(&self, asked: PlaybackControlRequest) -> Option<PlaybackState> {
        let (_, seen) = self.seen();
        let mut state = seen?;
        if let Some(at) = asked.seek_time {
            let since = at.saturating_sub(EPOCH.as_nanos());
            #[expect(
                clippy::cast_precision_loss,
                reason = "an instant that someone points at"
            )]
            let at_s = since as f64 * 1e-9;
            self.ask(Request::Seek { at_s }, None);
            state.current_time = at;
            state.did_seek = true;
        }
        let factor = f64::from(asked.playback_speed);
        if factor > 0.0 {
            self.ask(Request::Speed { factor }, None);
            state.playback_speed = asked.playback_speed;
        }
        state.status = match asked.playback_command {
            PlaybackCommand::Play => {
                self.ask(Request::Play, None);
                PlaybackStatus::Playing
            }
            PlaybackCommand::Pause => {
                self.ask(Request::Pause, None);
                PlaybackStatus::Paused
            }
        };
        Some(state)
    }
}

/// A service, which has its name in its requests.
struct Named {
    name: &'static str,
    asking: Asking,
}

impl Handler for Named {
    fn call(&self, call: Call, responder: Responder) {
        match self.read(call.payload()) {
            Ok(request) => self.asking.ask(request, Some(Reply::Call(responder))),
            Err(why) => responder.respond(Err::<&str, _>(why)),
        }
    }
}

impl Named {
    fn read(&self, payload: &[u8]) -> Result<Request, String> {
        if payload.len() > LONGEST {
            return Err(format!("a request is at most {LONGEST} bytes long"));
        }
        let mut value = match payload {
            [] => Value::Object(serde_json::Map::new()),
            payload => serde_json::from_slice(payload).map_err(|error| error.to_string())?,
        };
        let Value::Object(map) = &mut value else {
            return Err("a request is a JSON object".to_owned());
        };
        map.insert("service".to_owned(), self.name.into());
        serde_json::from_value(value).map_err(|error| error.to_string())
    }
}

/// Returns the services.
pub(super) fn services(asking: &Asking) -> Vec<Service> {
    let json = || Schema::new("json", "jsonschema", br#"{"type":"object"}"#.to_vec());
    let service = |name: &'static str| {
        let schema = ServiceSchema::new(format!("twinrig/{name}"))
            .with_request("json", json())
            .with_response("json", json());
        let asking = asking.clone();
        Service::builder(name, schema).handler(Named { name, asking })
    };
    SERVICES.map(service).into()
}
