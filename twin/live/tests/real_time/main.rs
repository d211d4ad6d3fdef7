//! Tests of live runs in real time, and of their server.

mod hardware;
mod server;
