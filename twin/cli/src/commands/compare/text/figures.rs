//! Numbers with few digits and unit prefixes.

/// Formats a number with at least three significant digits.
pub(super) fn figure(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 {
        return "0".to_owned();
    }
    if !(1e-3..1e5).contains(&size) {
        return format!("{value:.2e}");
    }
    let digits = if size < 0.01 {
        5
    } else if size < 0.1 {
        4
    } else if size < 10.0 {
        3
    } else if size < 100.0 {
        2
    } else {
        1
    };
    let text = format!("{value:.digits$}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Formats a share in per cent; empty without a share.
pub(super) fn percent(share: Option<f64>) -> String {
    share.map_or_else(String::new, |share| format!("{} %", figure(share * 100.0)))
}

/// Formats a quantity with three significant digits; metres and seconds with unit prefixes.
pub(super) fn quantity(value: f64, unit: &str) -> String {
    let scale = Scale::of(value, unit);
    let text = three(value * scale.factor);
    match scale.unit.as_str() {
        _ if value == 0.0 => text,
        "" => text,
        unit => format!("{text} {unit}"),
    }
}

/// Scale factor of numbers and the resulting unit.
pub(super) struct Scale {
    pub(super) factor: f64,
    pub(super) unit: String,
}

impl Scale {
    /// Returns the scale for numbers of the magnitude of `value`.
    pub(super) fn of(value: f64, unit: &str) -> Self {
        const PREFIXES: [(f64, &str); 4] = [(1.0, ""), (1e3, "m"), (1e6, "µ"), (1e9, "n")];
        let size = value.abs();
        let (factor, prefix) = match unit {
            // Numbers that round up to 1000 of the smaller unit are shown as 1 of the larger one.
            "m" | "s" => PREFIXES
                .into_iter()
                .find(|(factor, _)| size * factor >= 0.9995)
                .filter(|_| size.is_finite())
                .unwrap_or(if size > 0.0 && size.is_finite() {
                    PREFIXES[3]
                } else {
                    PREFIXES[0]
                }),
            _ => PREFIXES[0],
        };
        let unit = if unit == "1" { "" } else { unit };
        Self {
            factor,
            unit: format!("{prefix}{unit}"),
        }
    }
}

/// Formats a number with three significant digits.
pub(super) fn three(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 || !(1e-3..1e5).contains(&size) {
        return figure(value);
    }
    let digits = match size {
        _ if size < 0.009_995 => 5,
        _ if size < 0.099_95 => 4,
        _ if size < 0.9995 => 3,
        _ if size < 9.995 => 2,
        _ if size < 99.95 => 1,
        _ => return format!("{value:.0}"),
    };
    let text = format!("{value:.digits$}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_few_digits() {
        let all = [
            0.0,
            1.0,
            -0.00123,
            0.0123,
            0.123,
            12.3456,
            1234.56,
            1e-7,
            f64::INFINITY,
        ];
        let shown = all.map(figure);
        let expected = [
            "0", "1", "-0.00123", "0.0123", "0.123", "12.35", "1234.6", "1.00e-7", "inf",
        ];
        assert_eq!(shown, expected);
    }

    #[test]
    fn lengths_and_times_have_prefixes() {
        let of = |value, unit| quantity(value, unit);
        assert_eq!(of(8.2872, "m"), "8.29 m");
        assert_eq!(of(-0.0123, "m"), "-12.3 mm");
        assert_eq!(of(0.999_9, "m"), "1 m");
        assert_eq!(of(0.0404, "s"), "40.4 ms");
        assert_eq!(of(60.0, "s"), "60 s");
        assert_eq!(of(3.2e-11, "m"), "0.032 nm");
        assert_eq!(of(1234.5, "N"), "1234 N");
        assert_eq!(of(0.5, "1"), "0.5");
        assert_eq!(of(0.0, "m"), "0");
    }
}
