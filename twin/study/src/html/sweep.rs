//! Page of a sweep.

use twinrig_campaign::sweep::SweepResult;

/// Returns the page.
pub fn sweep_page(result: &SweepResult) -> String {
    result.name.clone()
}
