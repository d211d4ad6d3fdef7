//! Conversion of the numbers of a log to those of a recording.

use twinrig_document::WrittenUnit;
use twinrig_document::declaration::Words;

use super::error::LogFault;

/// Word in two's complement that a log has as a number without a sign.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Word {
    /// 8 bits.
    I8,
    /// 16 bits.
    I16,
    /// 32 bits.
    I32,
}

impl Words for Word {
    const WORDS: &'static [(&'static str, Self)] =
        &[("i8", Self::I8), ("i16", Self::I16), ("i32", Self::I32)];
}

impl Word {
    fn bits(self) -> u32 {
        match self {
            Self::I8 => 8,
            Self::I16 => 16,
            Self::I32 => 32,
        }
    }

    /// Returns the signed value of a word, which may have a sign already; none for other numbers.
    fn signed(self, number: f64) -> Option<f64> {
        let range = (1_u64 << self.bits()) as f64;
        let is_word = number.trunc() == number && (-range / 2.0..range).contains(&number);
        let signed = if number < range / 2.0 {
            number
        } else {
            number - range
        };
        is_word.then_some(signed)
    }
}

/// A factor as a ratio of two numbers, so that a division is one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ratio {
    /// Number above the line.
    pub numerator: f64,
    /// Number below the line; not 0.
    pub denominator: f64,
}

impl Ratio {
    /// Returns a number as a ratio; it may be 0.
    pub fn of(numerator: f64) -> Self {
        Self {
            numerator,
            denominator: 1.0,
        }
    }

    /// Returns the ratio of a text such as `1/885`; none for other texts, and if either is 0.
    pub fn parse(text: &str) -> Option<Self> {
        let (above, below) = text.split_once('/')?;
        let number = |text: &str| text.trim().parse::<f64>().ok();
        let ratio = Self {
            numerator: number(above)?,
            denominator: number(below)?,
        };
        let is_factor = |number: f64| number.is_finite() && number != 0.0;
        (is_factor(ratio.numerator) && is_factor(ratio.denominator)).then_some(ratio)
    }
}

/// Conversion of a number `x` of a log: `x`, with the sign of its word, times the numerator of
/// `scale`, divided by its denominator, times `sign`, plus `offset`, and that from the unit of the
/// log to the SI unit. A step with a factor of 1 or an offset of 0 changes no bit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conversion {
    /// Size of a word.
    pub word: Option<Word>,
    /// Factor.
    pub scale: Ratio,
    /// 1 or −1.
    pub sign: f64,
    /// Number that is added, in the unit of the log.
    pub offset: f64,
    /// Unit of the log.
    pub unit: WrittenUnit,
}

impl Conversion {
    /// Converts a number of the column `column`.
    ///
    /// # Errors
    /// It is not a word of the size, or the result is not finite.
    pub(super) fn convert(&self, number: f64, column: &str) -> Result<f64, LogFault> {
        let signed = match self.word {
            None => number,
            Some(word) => word.signed(number).ok_or_else(|| LogFault::NotAWord {
                column: column.to_owned(),
                value: number,
                bits: word.bits(),
            })?,
        };
        let scaled = signed * self.scale.numerator / self.scale.denominator * self.sign;
        // An addition of 0 would make 0 of −0.
        let shifted = if self.offset == 0.0 {
            scaled
        } else {
            scaled + self.offset
        };
        let value = self.unit.to_si(shifted);
        if value.is_finite() {
            Ok(value)
        } else {
            let column = column.to_owned();
            Err(LogFault::NotFinite { column, value })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_have_the_sign_of_twos_complement() {
        for unsigned in 0..=u16::MAX {
            let signed = f64::from(unsigned.cast_signed());
            assert_eq!(Word::I16.signed(unsigned.into()), Some(signed));
            assert_eq!(Word::I16.signed(signed), Some(signed));
        }
        assert_eq!(Word::I8.signed(200.0), Some(-56.0));
        assert_eq!(Word::I32.signed(4_294_967_295.0), Some(-1.0));
        for number in [65536.0, -32769.0, 0.5, f64::NAN, f64::INFINITY] {
            assert_eq!(Word::I16.signed(number), None, "{number}");
        }
    }

    #[test]
    fn identity_keeps_every_bit() {
        let identity = Conversion {
            word: None,
            scale: Ratio::of(1.0),
            sign: 1.0,
            offset: 0.0,
            unit: WrittenUnit::parse("rad").unwrap(),
        };
        for number in [0.0, -0.0, 0.1, f64::MIN_POSITIVE, 5e-324, f64::MAX] {
            let converted = identity.convert(number, "x").unwrap();
            assert_eq!(converted.to_bits(), number.to_bits());
        }
        assert!(identity.convert(f64::INFINITY, "x").is_err());
    }

    #[test]
    fn steps_are_applied_in_order() {
        let conversion = Conversion {
            word: Some(Word::I16),
            scale: Ratio::parse("1/885").unwrap(),
            sign: -1.0,
            offset: 2.0,
            unit: WrittenUnit::parse("mA").unwrap(),
        };
        let expected = (-(-1.0 / 885.0) + 2.0) / 1000.0;
        assert_eq!(conversion.convert(65535.0, "x").unwrap(), expected);
        assert!(Ratio::parse("1/0").is_none() && Ratio::parse("x").is_none());
    }
}
