mod laws;
mod protocol;
mod requests;
mod wired;
