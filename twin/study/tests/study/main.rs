//! Studies of oscillators, of which all is known.

mod engines;
mod oscillator;
mod pages;
mod precision;
mod stability;
mod walker;
