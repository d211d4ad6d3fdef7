//! Columns of numbers in a page: rounded to what a screen shows, compressed, in Base64.
//!
//! A number is stored as its count of steps above the least one of its column, of 16 bits, or of
//! 32 for times; a page that reads them with less code than this has no exact numbers.

use std::io::{self, Write};

use flate2::Compression;
use flate2::write::ZlibEncoder;
use serde::Serialize;

/// Columns of a page.
#[derive(Debug, Default)]
pub(crate) struct Columns {
    bytes: Vec<u8>,
}

/// Place of a column among the others, and the scale of its numbers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(untagged)]
pub(crate) enum Column {
    /// The same number at each place.
    Constant {
        /// Number; none if it is not finite.
        c: Option<f64>,
        /// Places.
        n: usize,
    },
    /// Different numbers.
    Stored {
        /// Offset of its first byte.
        at: usize,
        /// Places.
        n: usize,
        /// Least number.
        lo: f64,
        /// Step.
        step: f64,
        /// Bytes of a number.
        bytes: u32,
    },
}

impl Columns {
    /// Adds numbers rounded to 1/65 534 of their range; those that are not finite, or
    /// above 10³⁰⁰, are gaps.
    pub(crate) fn add(&mut self, values: &[f64]) -> Column {
        self.rounded(values, 2)
    }

    /// Adds numbers rounded to 2⁻³² of their range: times.
    pub(crate) fn add_fine(&mut self, values: &[f64]) -> Column {
        self.rounded(values, 4)
    }

    fn rounded(&mut self, values: &[f64], bytes: u32) -> Column {
        let finite = || values.iter().copied().filter(|value| is_shown(*value));
        let lo = finite().fold(f64::INFINITY, f64::min);
        let hi = finite().fold(f64::NEG_INFINITY, f64::max);
        let n = values.len();
        let all_finite = finite().count() == n;
        // The greatest code is a gap.
        let gap = u32::MAX >> (32 - 8 * bytes);
        let step = (hi - lo) / f64::from(gap - 1);
        if lo > hi {
            return Column::Constant { c: None, n };
        }
        if all_finite && (lo == hi || step == 0.0) {
            return Column::Constant { c: Some(lo), n };
        }
        let step = if step > 0.0 { step } else { 1.0 };
        let code = |value: f64| {
            if is_shown(value) {
                to_u32(((value - lo) / step).round()).min(gap - 1)
            } else {
                gap
            }
        };
        let mut last = 0;
        let differences = values.iter().map(|&value| {
            let code = code(value);
            let difference = code.wrapping_sub(last);
            last = code;
            difference.to_le_bytes()
        });
        let differences: Vec<[u8; 4]> = differences.collect();
        let at = self.bytes.len();
        // Bytes of equal weight side by side are more alike.
        for place in 0..bytes as usize {
            let plane = differences.iter().map(|difference| difference[place]);
            self.bytes.extend(plane);
        }
        Column::Stored {
            at,
            n,
            lo,
            step,
            bytes,
        }
    }

    /// Returns all columns, [packed].
    pub(crate) fn text(&self) -> io::Result<String> {
        packed(&self.bytes)
    }
}

/// Returns bytes compressed by zlib, in Base64: as the data of a page.
///
/// # Errors
/// None: it writes to memory.
pub fn packed(bytes: &[u8]) -> io::Result<String> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(bytes)?;
    Ok(base64(&encoder.finish()?))
}

/// Returns whether a number is not a gap; differences of those that are none are finite.
fn is_shown(value: f64) -> bool {
    value.abs() < 1e300
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "between 0 and the greatest code"
)]
fn to_u32(value: f64) -> u32 {
    value as u32
}

/// Returns bytes in Base64, with padding (RFC 4648).
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let byte = |n: usize| u32::from(chunk.get(n).copied().unwrap_or(0));
        let word = byte(0) << 16 | byte(1) << 8 | byte(2);
        for place in 0..4 {
            let letter = LETTERS[(word >> (18 - 6 * place)) as usize & 63];
            let is_filled = place <= chunk.len();
            text.push(if is_filled { char::from(letter) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use flate2::read::ZlibDecoder;

    use super::*;

    /// Decodes a column as the script does.
    fn decoded(columns: &Columns, column: Column) -> Vec<f64> {
        match column {
            Column::Constant { c, n } => vec![c.unwrap_or(f64::NAN); n],
            Column::Stored {
                at,
                n,
                lo,
                step,
                bytes,
            } => {
                let mask = u32::MAX >> (32 - 8 * bytes);
                let mut code = 0_u32;
                let number = |i: usize| {
                    let planes = (0..bytes as usize).rev();
                    let difference = planes.fold(0_u32, |sum, plane| {
                        sum << 8 | u32::from(columns.bytes[at + plane * n + i])
                    });
                    code = code.wrapping_add(difference) & mask;
                    if code == mask {
                        f64::NAN
                    } else {
                        lo + f64::from(code) * step
                    }
                };
                (0..n).map(number).collect()
            }
        }
    }

    #[test]
    fn numbers_are_within_half_a_step_and_gaps_are_gaps() {
        let mut columns = Columns::default();
        let values = [-3.0, 1e-3, f64::NAN, 7.5, 7.5, f64::INFINITY, 2.0];
        for (column, share) in [
            (columns.add(&values), 0.5 / 65_534.0),
            (columns.add_fine(&values), 0.5 / 4.29e9),
        ] {
            for (decoded, value) in decoded(&columns, column).into_iter().zip(values) {
                assert_eq!(decoded.is_finite(), value.is_finite());
                assert!(!value.is_finite() || (decoded - value).abs() <= share * 10.5 * 1.01);
            }
        }
        assert_eq!(
            columns.add(&[4.2; 3]),
            Column::Constant { c: Some(4.2), n: 3 }
        );
        assert_eq!(
            columns.add(&[f64::NAN; 2]),
            Column::Constant { c: None, n: 2 }
        );
        let with_gap = columns.add(&[4.2, f64::NAN, 4.2]);
        assert_eq!(decoded(&columns, with_gap)[..1], [4.2]);
        // Numbers whose difference is not finite are gaps.
        let wide = columns.add(&[-f64::MAX, 1.0, 3.0, f64::MAX]);
        assert!(decoded(&columns, wide)[3].is_nan());
        assert_eq!(decoded(&columns, wide)[1..3], [1.0, 3.0]);
    }

    fn unpacked(text: &str) -> Vec<u8> {
        let letters = text.bytes().filter(|letter| *letter != b'=');
        let mut bits = letters.flat_map(|letter| {
            let code = match letter {
                b'A'..=b'Z' => letter - b'A',
                b'a'..=b'z' => letter - b'a' + 26,
                b'0'..=b'9' => letter - b'0' + 52,
                b'+' => 62,
                _ => 63,
            };
            (0..6).rev().map(move |bit| code >> bit & 1)
        });
        let bytes = std::iter::from_fn(|| {
            let bits: Vec<u8> = bits.by_ref().take(8).collect();
            (bits.len() == 8).then(|| bits.iter().fold(0, |byte, bit| byte << 1 | bit))
        });
        bytes.collect()
    }

    #[test]
    fn text_is_zlib_in_base64() {
        assert_eq!(base64(b""), "");
        // RFC 4648, section 10.
        for (bytes, text) in [
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
        ] {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
        let mut columns = Columns::default();
        columns.add(&[1.0, 2.0, 3.0]);
        let text = columns.text().unwrap();
        let mut bytes = Vec::new();
        let compressed = unpacked(&text);
        let mut decoder = ZlibDecoder::new(&*compressed);
        decoder.read_to_end(&mut bytes).unwrap();
        assert_eq!(bytes, columns.bytes);
    }
}
