//! The plant as a whole.

mod books;
mod cuts;
mod drives;
mod errors;
mod faults;
mod ground;
mod passive;
mod restore;
mod scene;
mod starts;
