use crate::FrameError;

/// Fields of a frame, read in order.
///
/// ```
/// use twinrig_wire::{Fields, FrameError};
///
/// let mut fields = Fields::new(&[7, 1, 2, 3, 4, 5, 6]);
/// let [header] = fields.array()?;
/// let word = u16::from_be_bytes(fields.array()?);
/// let words = fields.numbers(u16::from_le_bytes)?;
/// fields.end()?;
/// assert_eq!((header, word, words), (7, 0x0102, [0x0403, 0x0605]));
/// # Ok::<(), FrameError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Fields<'f>(&'f [u8]);

impl<'f> Fields<'f> {
    /// Starts at the first of these bytes.
    pub const fn new(bytes: &'f [u8]) -> Self {
        Self(bytes)
    }

    /// Returns the next `N` bytes.
    ///
    /// # Errors
    /// [`FrameError::Length`] if fewer are left.
    pub fn array<const N: usize>(&mut self) -> Result<[u8; N], FrameError> {
        let (array, rest) = self.0.split_first_chunk().ok_or(FrameError::Length)?;
        self.0 = rest;
        Ok(*array)
    }

    /// Returns the next `N` numbers of `W` bytes each.
    ///
    /// # Errors
    /// [`FrameError::Length`] if fewer are left.
    pub fn numbers<T: Copy + Default, const N: usize, const W: usize>(
        &mut self,
        number: impl Fn([u8; W]) -> T,
    ) -> Result<[T; N], FrameError> {
        let mut numbers = [T::default(); N];
        for place in &mut numbers {
            *place = number(self.array()?);
        }
        Ok(numbers)
    }

    /// Checks that no bytes are left.
    ///
    /// # Errors
    /// [`FrameError::Length`] if some are.
    pub fn end(&self) -> Result<(), FrameError> {
        self.0.is_empty().then_some(()).ok_or(FrameError::Length)
    }
}

/// Returns the lowest `N` bits of `mask`, the lowest first.
pub fn bits<const N: usize>(mask: u32) -> [bool; N] {
    std::array::from_fn(|n| mask >> n & 1 == 1)
}

/// Returns the mask of these bits, the lowest first; the inverse of [`bits`].
pub fn mask(bits: &[bool]) -> u32 {
    let bits = bits.iter().rev();
    bits.fold(0, |mask, &bit| mask << 1 | u32::from(bit))
}
