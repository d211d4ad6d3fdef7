//! wip
mod articulated;
mod body;
mod carried;
mod chain;
mod constants;
mod contacts;
mod dense;
mod drives;
mod euler;
mod events;
mod flow;
mod guards;
mod hold;
mod jacobian;
mod lanewise;
mod log;
mod march;
mod mode;
mod model;
mod moreau;
mod motion;
mod motors;
mod options;
mod plant;
mod real;
mod rk4;
mod rodas4;
mod root;
#[cfg(test)]
mod scenes;
mod site;
mod state;
mod thesis;
mod trunk;
mod vigil;

pub use options::{LcpError, Method, Options};
pub use plant::Lcp;
