//! Studies of oscillators, of which all is known.

mod coupling;
mod engines;
mod oscillator;
mod pages;
mod precision;
mod stability;
mod walker;
