//! A model, compiled.

use std::path::Path;

use mujoco_rs::prelude::{MjModel, MjtEnableBit};
use twinrig_kernel::SimDuration;

use crate::engine::{Engine, EngineError};
use crate::model_file::error::ModelFileError;

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
        let model = model.map_err(|why| EngineError::Model(in_one_line(&why.to_string())))?;
        Ok(Self::of(model))
    }

    /// Takes back what [`ModelFile::binary`] gave.
    ///
    /// # Errors
    /// [`ModelFileError::Binary`] for other bytes, or those of another version.
    pub fn of_binary(bytes: &[u8]) -> Result<Self, ModelFileError> {
        Engine::check_version()?;
        let model = MjModel::from_buffer(bytes);
        Ok(Self::of(model.map_err(|_| ModelFileError::Binary)?))
    }

    fn of(mut model: MjModel) -> Self {
        // Whether energies are computed changes nothing else.
        model.opt_mut().enableflags |= MjtEnableBit::mjENBL_ENERGY as i32;
        Self { model }
    }

    /// The compiled model with all that it included: the same in every respect, for the same version of MuJoCo.
    pub fn binary(&self) -> Vec<u8> {
        let mut bytes = vec![0; self.model.size()];
        let saved = self.model.save_to_buffer(&mut bytes);
        debug_assert!(saved.is_ok(), "it has the size that the model said");
        bytes
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

/// What MuJoCo says over several lines, its own prefix first, in one.
fn in_one_line(message: &str) -> String {
    message.split_whitespace().collect::<Vec<_>>().join(" ")
}
