//! Dates of reports and files; no result has one.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// Returns the present since 1970: that of the variable `SOURCE_DATE_EPOCH`, so that files can be
/// reproduced.
pub(crate) fn now() -> Duration {
    let fixed = std::env::var("SOURCE_DATE_EPOCH").ok();
    let fixed = fixed.and_then(|seconds| seconds.parse().ok());
    #[expect(
        clippy::disallowed_methods,
        reason = "a file has a date; no result has"
    )]
    let present = || {
        SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .unwrap_or_default()
    };
    fixed.map_or_else(present, Duration::from_secs)
}

/// Returns a time since 1970 as the schemas of `JUnit` require it: UTC, without a zone.
pub(crate) fn timestamp(since_1970: Duration) -> String {
    let seconds = since_1970.as_secs();
    let (days, second) = (seconds / 86_400, seconds % 86_400);
    // Days since 1 March of year 0: leap days are then the last ones of their years.
    let days = days + 719_468;
    let (era, day_of_era) = (days / 146_097, days % 146_097);
    let year_of_era =
        (day_of_era - day_of_era / 1_460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * from_march + 2) / 5 + 1;
    let month = (from_march + 2) % 12 + 1;
    let year = era * 400 + year_of_era + u64::from(month <= 2);
    let (hour, minute) = (second / 3_600, second / 60 % 60);
    // The schemas have four digits for the year.
    format!(
        "{:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{:02}",
        year.min(9999),
        second % 60
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The expected dates are those of `date --utc --date=@SECONDS`.
    #[test]
    fn timestamps_are_dates_of_the_gregorian_calendar() {
        for (seconds, date) in [
            (0, "1970-01-01T00:00:00"),
            (951_782_399, "2000-02-28T23:59:59"),
            (951_782_400, "2000-02-29T00:00:00"),
            (951_868_800, "2000-03-01T00:00:00"),
            (1_735_689_599, "2024-12-31T23:59:59"),
            (4_107_542_400, "2100-03-01T00:00:00"),
        ] {
            assert_eq!(timestamp(Duration::from_secs(seconds)), date);
        }
    }
}
