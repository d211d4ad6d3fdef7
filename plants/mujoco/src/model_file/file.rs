//! Compiled models.

use std::path::Path;

use mujoco_rs::prelude::{MjModel, MjtEnableBit};
use mujoco_rs::wrappers::mj_editing::MjSpec;
use twinrig_kernel::SimDuration;

use crate::engine::Engine;
use crate::engine::refusal::refused;
use crate::model_file::error::ModelFileError;

/// Header of a serialised model with the engine's version. A checksum follows.
const HEADER: &[u8] = b"MuJoCo 3.17.0 model\n";

/// A compiled model.
pub struct ModelFile {
    model: MjModel,
}

impl ModelFile {
    /// Compiles the model in the file at `path`; includes are relative to it.
    ///
    /// # Errors
    /// [`ModelFileError`] with MuJoCo's message.
    pub fn read(path: &Path) -> Result<Self, ModelFileError> {
        Engine::check_version()?;
        let valid = path.to_str().is_some_and(|path| !path.contains('\0'));
        if !valid {
            return Err(ModelFileError::Path);
        }
        let model = MjModel::from_xml(path);
        let model = model.map_err(|why| refused(&why, || MjSpec::from_xml(path)))?;
        Ok(Self::of(model))
    }

    /// Restores a model from the bytes of [`ModelFile::binary`].
    ///
    /// # Errors
    /// [`ModelFileError::Binary`] for other bytes, or those of another version.
    pub fn of_binary(bytes: &[u8]) -> Result<Self, ModelFileError> {
        Engine::check_version()?;
        // MuJoCo reports unreadable bytes to a file and to standard error; these checks prevent
        // that.
        let rest = bytes.strip_prefix(HEADER);
        let (sum, model) = rest
            .and_then(<[u8]>::split_first_chunk)
            .ok_or(ModelFileError::Binary)?;
        if u64::from_le_bytes(*sum) != checksum(model) {
            return Err(ModelFileError::Binary);
        }
        let model = MjModel::from_buffer(model);
        Ok(Self::of(model.map_err(|_| ModelFileError::Binary)?))
    }

    fn of(mut model: MjModel) -> Self {
        // Computing energies has no other effect.
        model.opt_mut().enableflags |= MjtEnableBit::mjENBL_ENERGY as i32;
        Self { model }
    }

    /// Returns the compiled model with all its includes. It is identical for the same version of
    /// MuJoCo.
    pub fn binary(&self) -> Vec<u8> {
        let mut model = vec![0; self.model.size()];
        let saved = self.model.save_to_buffer(&mut model);
        debug_assert!(
            saved.is_ok(),
            "the buffer has the size that the model reports"
        );
        [HEADER, &checksum(&model).to_le_bytes(), &model].concat()
    }

    /// Returns the model's own step, in whole nanoseconds.
    ///
    /// # Errors
    /// [`ModelFileError::Step`] if it is less than 1 ns, an hour or more, or NaN.
    pub fn step(&self) -> Result<SimDuration, ModelFileError> {
        let seconds = self.model.opt().timestep;
        let nanos = libm::round(seconds * 1e9);
        if (1.0..3.6e12).contains(&nanos) {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "an integer in range"
            )]
            return Ok(SimDuration::from_nanos(nanos as u64));
        }
        Err(ModelFileError::Step { seconds })
    }

    pub(crate) fn model(&self) -> &MjModel {
        &self.model
    }
}

/// Returns the FNV-1a checksum, which detects damaged or truncated bytes.
fn checksum(bytes: &[u8]) -> u64 {
    let mix = |sum: u64, byte: &u8| (sum ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, mix)
}
