//! The page of a session, over HTTP.

use std::convert::Infallible;
use std::future::ready;
use std::io;
use std::net::SocketAddr;
use std::sync::Arc;

use http_body_util::Full;
use hyper::body::{Bytes, Incoming};
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper::{Method, Request, Response, StatusCode, header};
use hyper_util::rt::TokioIo;
use tokio::net::TcpListener;
use tokio::runtime::Runtime;
use tokio::sync::Semaphore;
use tokio::task::JoinHandle;
use twinrig_rig::Assembly;
use twinrig_rig::run::executor::Executor;
use twinrig_runtime::Group;
use twinrig_view::live::LivePoses;

/// Number of connections at a time.
const CONNECTIONS: usize = 16;

/// A page that is served until this value is dropped.
pub(super) struct Page {
    pub(super) address: SocketAddr,
    task: JoinHandle<()>,
}

impl Drop for Page {
    fn drop(&mut self) {
        self.task.abort();
    }
}

impl Page {
    pub(super) fn listen(
        runtime: &Runtime,
        host: &str,
        port: u16,
        text: String,
    ) -> io::Result<Self> {
        let listener = runtime.block_on(TcpListener::bind((host, port)))?;
        let address = listener.local_addr()?;
        let task = runtime.spawn(serve(listener, Bytes::from(text)));
        Ok(Self { address, task })
    }
}

async fn serve(listener: TcpListener, text: Bytes) {
    let room = Arc::new(Semaphore::new(CONNECTIONS));
    loop {
        let Ok(permit) = room.clone().acquire_owned().await else {
            return;
        };
        // A connection that cannot be accepted is the visitor's loss.
        let Ok((stream, _)) = listener.accept().await else {
            continue;
        };
        let text = text.clone();
        tokio::spawn(async move {
            let service = service_fn(move |request| {
                let answer = answer(&request, text.clone());
                ready(Ok::<_, Infallible>(answer))
            });
            let mut http = http1::Builder::new();
            let connection = http.keep_alive(false).max_buf_size(16 << 10);
            let _ = connection
                .serve_connection(TokioIo::new(stream), service)
                .await;
            drop(permit);
        });
    }
}

fn answer(request: &Request<Incoming>, text: Bytes) -> Response<Full<Bytes>> {
    let (status, text) = match (request.method(), request.uri().path()) {
        (&Method::GET, "/") => (StatusCode::OK, text),
        // Browsers ask for it, and report each error.
        (&Method::GET, "/favicon.ico") => (StatusCode::NO_CONTENT, Bytes::new()),
        _ => (
            StatusCode::NOT_FOUND,
            Bytes::from_static(b"there is one page, /\n"),
        ),
    };
    let mut response = Response::new(Full::new(text));
    *response.status_mut() = status;
    let html = header::HeaderValue::from_static("text/html; charset=utf-8");
    response.headers_mut().insert(header::CONTENT_TYPE, html);
    response
}

/// Returns the text of the page.
pub(super) fn text(
    assembly: &Assembly<'_>,
    socket: u16,
    poses: Option<&LivePoses>,
    executor: &dyn Executor,
) -> String {
    let zeros = vec![0.0; executor.layout(Group::Plant).len()];
    let figure = poses.and_then(|poses| poses.figure(&zeros));
    twinrig_view::live::page(assembly, socket, executor.on_hardware(), figure)
}
