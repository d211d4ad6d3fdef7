mod protocol;
mod requests;
mod wired;
