//! Warnings about times of an expectation that lie beyond its window.

use twinrig_document::Item;
use twinrig_kernel::{SimDuration, SimTime};

use crate::body::BodyClaim;
use crate::expect::{Claim, Expectation};
use crate::read::{code, print_duration};

/// Warns about `within` and `by` of the claim in the table `subject`, in a run of duration `run`.
pub(super) fn warn(subject: &Item<'_>, expectation: &Expectation, run: SimDuration) {
    let run = SimTime::ZERO + run;
    let end = expectation.before.map_or(run, |before| before.min(run));
    let interval = if end < run { "its window" } else { "the run" };
    let ends = format!("{interval} ends at {}", print_duration(end.since_start()));
    if expectation.settled_by().is_some_and(|by| by >= end)
        && let Some(by) = subject.peek("settles").and_then(|item| item.peek("by"))
    {
        let message = format!("there is no observation from `by` on: {ends}");
        by.warn(code::BY, message, "give an earlier time");
    }
    let is_rising = matches!(expectation.claim, Claim::Body(BodyClaim::GetsUp(_)));
    let rising = subject.peek("gets_up").filter(|_| is_rising);
    let claimed = rising.as_ref().unwrap_or(subject);
    let until = expectation
        .within()
        .map(|within| expectation.after.checked_add(within));
    if until.is_some_and(|until| until.is_none_or(|until| until > end))
        && let Some(within) = claimed.peek("within")
    {
        let reaching = if is_rising {
            "`within` and `hold` reach"
        } else {
            "`within` reaches"
        };
        let message = format!("{reaching} beyond the end: {ends}");
        let help = match expectation.claim {
            Claim::Sequence(_) => "no time window of this length is observed completely",
            Claim::Body(_) => "they count from the instant at which the trunk lies",
            _ => "it counts from `after` on",
        };
        within.warn(code::WITHIN, message, help);
    }
}
