//! Store of the searches of a fit, from which an interrupted one continues.

use std::path::Path;

use serde::{Deserialize, Serialize};
use twinrig_campaign::identification::FitSpace;
use twinrig_campaign::sweep::{Partition, RowKey, RowStore};

use super::model::Recorded;
use super::twin::Twin;
use crate::error::Error;

/// End of a search.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct SearchEnd {
    /// Shares of the ranges.
    pub point: Vec<f64>,
    /// Sum of the costs.
    pub cost: f64,
    /// Steps of least squares.
    pub steps: usize,
    /// Whether the last one was small enough.
    pub converged: bool,
    /// Evaluations before them.
    pub evaluations: u64,
}

/// Searches that are done.
pub(super) struct Searches {
    rows: RowStore<SearchEnd, SearchEnd>,
    /// Everything that all searches of a fit depend on.
    shared: RowKey,
    /// Searches that were done before.
    reused: usize,
}

impl Searches {
    /// Opens the store in a folder; without one it is in memory.
    ///
    /// # Errors
    /// Errors of the store, and of the files of the twin.
    pub(super) fn open(
        folder: Option<&Path>,
        build: &str,
        space: &FitSpace,
        twin: &Twin<'_>,
    ) -> Result<Self, Error> {
        let rows = match folder {
            Some(folder) => RowStore::open(folder, Partition::WHOLE, None, |end| end)?,
            None => RowStore::in_memory(|end| end),
        };
        let contents = twin.contents()?;
        let identity = space.identity();
        let shared = RowKey::of([build.as_bytes(), identity.as_bytes(), &contents]);
        Ok(Self {
            rows,
            shared,
            reused: 0,
        })
    }

    /// Returns the key of a search from a seed in some recordings.
    pub(super) fn key(&self, data: &[&Recorded<'_>], seed: u64) -> RowKey {
        let parts = [self.shared.to_string(), seed.to_string()];
        let parts = parts.iter().map(String::as_bytes);
        RowKey::of(parts.chain(data.iter().map(|it| it.data.hash.as_bytes())))
    }

    /// Returns the end of a search that was done before.
    pub(super) fn take(&mut self, key: &RowKey) -> Option<SearchEnd> {
        let end = self.rows.get(key).cloned()?;
        self.reused += 1;
        Some(end)
    }

    /// Appends the end of a search.
    ///
    /// # Errors
    /// It cannot be written.
    pub(super) fn append(&mut self, key: RowKey, end: SearchEnd) -> Result<(), Error> {
        self.rows.append(key, end)?;
        Ok(())
    }

    /// Returns damages of the store, and whether searches were there.
    pub(super) fn notes(&self) -> Vec<String> {
        let reused = self.reused;
        let reused = (reused > 0).then(|| format!("searches that were done before: {reused}"));
        self.rows.warnings().iter().cloned().chain(reused).collect()
    }
}
