//! A model, compiled.

use std::path::Path;

use mujoco_rs::prelude::{MjModel, MjtEnableBit};
use mujoco_rs::wrappers::mj_editing::MjSpec;
use twinrig_kernel::SimDuration;

use crate::engine::Engine;
use crate::engine::refusal::refused;
use crate::model_file::error::ModelFileError;

/// What a compiled model begins with: whose it is. Then comes a checksum.
const HEADER: &[u8] = b"MuJoCo 3.17.0 model\n";

/// A model, compiled.
pub struct ModelFile {
    model: MjModel,
}

impl ModelFile {
    /// Compiles the model in the file at `path`; what it includes is seen from there.
    ///
    /// # Errors
    /// [`ModelFileError`], with what MuJoCo says of it.
    pub fn read(path: &Path) -> Result<Self, ModelFileError> {
        Engine::check_version()?;
        let sound = path.to_str().is_some_and(|path| !path.contains('\0'));
        if !sound {
            return Err(ModelFileError::Path);
        }
        let model = MjModel::from_xml(path);
        let model = model.map_err(|why| refused(&why, || MjSpec::from_xml(path)))?;
        Ok(Self::of(model))
    }

    /// Takes back what [`ModelFile::binary`] gave.
    ///
    /// # Errors
    /// [`ModelFileError::Binary`] for other bytes, or those of another version.
    pub fn of_binary(bytes: &[u8]) -> Result<Self, ModelFileError> {
        Engine::check_version()?;
        // MuJoCo would say of what it cannot read that it cannot, in a file and on standard error.
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
        // Whether energies are computed changes nothing else.
        model.opt_mut().enableflags |= MjtEnableBit::mjENBL_ENERGY as i32;
        Self { model }
    }

    /// The compiled model with all that it included: the same in every respect, for the same version of MuJoCo.
    pub fn binary(&self) -> Vec<u8> {
        let mut model = vec![0; self.model.size()];
        let saved = self.model.save_to_buffer(&mut model);
        debug_assert!(saved.is_ok(), "it has the size that the model said");
        [HEADER, &checksum(&model).to_le_bytes(), &model].concat()
    }

    /// The model's own step, in whole nanoseconds.
    ///
    /// # Errors
    /// [`ModelFileError::Step`] if that is no time, or longer than an hour.
    pub fn step(&self) -> Result<SimDuration, ModelFileError> {
        let seconds = self.model.opt().timestep;
        let nanos = libm::round(seconds * 1e9);
        if (1.0..3.6e12).contains(&nanos) {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "it is a whole number, and in range"
            )]
            return Ok(SimDuration::from_nanos(nanos as u64));
        }
        Err(ModelFileError::Step { seconds })
    }

    pub(crate) fn model(&self) -> &MjModel {
        &self.model
    }
}

/// FNV-1a: tells what is damaged or cut off.
fn checksum(bytes: &[u8]) -> u64 {
    let mix = |sum: u64, byte: &u8| (sum ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, mix)
}
