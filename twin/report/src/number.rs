//! Formatting of numbers for readers.

use twinrig_kernel::{SimDuration, SimTime};

/// Formats a quantity with an SI prefix and three digits: `1.3e-7`, `m` is `130 nm`.
pub fn si(value: f64, unit: &str) -> String {
    const PREFIXES: [(f64, &str); 9] = [
        (1e9, "G"),
        (1e6, "M"),
        (1e3, "k"),
        (1.0, ""),
        (1e-3, "m"),
        (1e-6, "µ"),
        (1e-9, "n"),
        (1e-12, "p"),
        (1e-15, "f"),
    ];
    if value == 0.0 {
        return format!("0 {unit}").trim_end().to_owned();
    }
    let size = value.abs();
    // A value that rounds to 1000 of one prefix takes the next.
    let fits = PREFIXES.iter().find(|(scale, _)| size >= 0.9995 * scale);
    match fits {
        Some((scale, prefix)) if size < 0.9995e12 => {
            format!("{} {prefix}{unit}", digits(value / scale, 3))
                .trim_end()
                .to_owned()
        }
        _ => format!("{} {unit}", power(value, 2)).trim_end().to_owned(),
    }
}

/// Formats a value in the unit with this symbol: angles in degrees, numbers without a prefix.
pub fn quantity(value: f64, unit: &str) -> String {
    match unit {
        "1" => plain(value),
        "rad" => format!("{}°", plain(value.to_degrees())),
        unit => si(value, unit),
    }
}

/// Formats an instant with three digits.
pub fn instant(at: SimTime) -> String {
    si(at.as_secs_f64(), "s")
}

/// Formats a duration with three digits.
pub fn duration(duration: SimDuration) -> String {
    si(duration.as_secs_f64(), "s")
}

/// Formats a number in decimal notation near one, as a power of ten elsewhere.
pub fn plain(value: f64) -> String {
    if value == 0.0 || (1e-3..1e5).contains(&value.abs()) {
        digits(value, 3)
    } else {
        power(value, 2)
    }
}

/// Formats a number with so many decimal places: `−0.25`.
pub fn fixed(value: f64, places: usize) -> String {
    format!("{value:.places$}").replace('-', "−")
}

/// Formats a quantity with six digits and no prefix: `0.963952 m/s`.
pub fn precise(value: f64, unit: &str) -> String {
    let rounded: f64 = format!("{value:.5e}").parse().unwrap_or(value);
    let text = if rounded == 0.0 || (1e-4..1e7).contains(&rounded.abs()) {
        rounded.to_string()
    } else {
        format!("{rounded:e}")
    };
    match unit {
        "" | "1" => text,
        unit => format!("{text} {unit}"),
    }
}

/// Formats a share: `82.5 %`.
pub fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

/// Formats an interval of a share: `73.3 … 88.3 %`.
pub fn percent_range([low, high]: [f64; 2]) -> String {
    format!("{:.1} … {}", 100.0 * low, percent(high))
}

/// Formats a setting: `2 ms`, or `tolerance 10⁻⁸`.
pub fn method_setting(step_s: Option<f64>, tolerance: Option<f64>) -> String {
    match (step_s, tolerance) {
        (Some(step), _) => si(step, "s"),
        (None, Some(tolerance)) => format!("tolerance {}", power(tolerance, 2)),
        (None, None) => String::new(),
    }
}

/// Formats a factor with grouped digits: `1230 ×`.
pub fn grouped_factor(value: f64) -> String {
    if value < 1e3 {
        return format!("{} ×", plain(value));
    }
    let unit = libm::pow(10.0, libm::floor(libm::log10(value)) - 2.0);
    let rounded = libm::round(value / unit) * unit;
    format!("{} ×", grouped(&format!("{rounded:.0}")))
}

/// Groups digits by three.
pub fn grouped(digits: &str) -> String {
    let mut out = String::new();
    for (n, digit) in digits.chars().enumerate() {
        if n > 0 && (digits.len() - n).is_multiple_of(3) {
            out.push('\u{202f}');
        }
        out.push(digit);
    }
    out
}

/// Formats a number in scientific notation: `1.3 × 10⁻⁷`.
pub fn power(value: f64, significant: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let text = format!("{value:.*e}", significant.saturating_sub(1));
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let mantissa = trimmed(mantissa);
    let exponent = exponent.parse().unwrap_or(0);
    match mantissa {
        "1" => ten_to(exponent),
        _ => format!("{mantissa} × {}", ten_to(exponent)),
    }
}

/// Formats a power of ten: `10⁻⁶`.
pub fn ten_to(exponent: i32) -> String {
    match exponent {
        0 => "1".to_owned(),
        1 => "10".to_owned(),
        _ => format!("10{}", raised(exponent)),
    }
}

fn raised(exponent: i32) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let letter = |letter: char| match letter.to_digit(10) {
        Some(digit) => DIGITS[digit as usize],
        None => '⁻',
    };
    exponent.to_string().chars().map(letter).collect()
}

/// Formats `value` with so many significant digits, without exponent and trailing zeros.
fn digits(value: f64, significant: i32) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let magnitude = libm::floor(libm::log10(value.abs()) + 1e-9);
    let places = (f64::from(significant - 1) - magnitude).max(0.0);
    let count = (0..16).take_while(|&n| f64::from(n) < places).count();
    trimmed(&format!("{value:.count$}")).to_owned()
}

fn trimmed(text: &str) -> &str {
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.')
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantities_have_three_digits_and_a_prefix() {
        for (value, text) in [
            (0.0, "0 m"),
            (1.3e-7, "130 nm"),
            (0.002, "2 ms"),
            (1.661e-4, "166 µm"),
            (0.099_96, "100 mm"),
            (0.000_999_9, "1 mm"),
            (0.000_999_9, "1 mm"),
            (0.9993, "999 mm"),
            (12.34, "12.3 m"),
            (4e-20, "4 × 10⁻²⁰ m"),
        ] {
            let text = text.trim_end_matches('s');
            assert!(
                si(value, "m").starts_with(text),
                "{value}: {}",
                si(value, "m")
            );
        }
    }

    #[test]
    fn powers_of_ten_use_superscripts() {
        assert_eq!(power(1.34e-7, 2), "1.3 × 10⁻⁷");
        assert_eq!(power(1e-12, 2), "10⁻¹²");
        assert_eq!(plain(1200.0), "1200");
        assert_eq!(plain(0.25), "0.25");
        assert_eq!(plain(1e6), "10⁶");
        assert_eq!(plain(1e6), "10⁶");
    }

    #[test]
    fn factors_have_three_digits_in_groups() {
        assert_eq!(grouped_factor(12.34), "12.3 ×");
        assert_eq!(grouped_factor(1234.0), "1\u{202f}230 ×");
    }
}
