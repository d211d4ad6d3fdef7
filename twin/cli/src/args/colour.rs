//! Option `--color`.

use anstream::ColorChoice;
use clap::ValueEnum;

/// When output has colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Colour {
    /// On terminals, unless `NO_COLOR` is set; elsewhere if `CLICOLOR_FORCE` is set.
    Auto,
    /// Also in files and pipes.
    Always,
    /// Nowhere.
    Never,
}

impl Colour {
    /// Returns whether a stream has styles that would have them by itself if `by_itself`, and makes
    /// the choice that of the standard streams.
    pub fn styles(self, by_itself: bool) -> bool {
        match self {
            Self::Auto => return by_itself,
            Self::Always => ColorChoice::Always.write_global(),
            Self::Never => ColorChoice::Never.write_global(),
        }
        self == Self::Always
    }
}
