//! The fourth-order Runge–Kutta method, stage by stage.

use mujoco_rs::prelude::{MjData, MjModel};

type Data = MjData<Box<MjModel>>;

/// Working memory of a step of stages. Models with activations (muscles), which are states, too,
/// are not supported.
#[derive(Debug, Clone)]
pub(crate) struct Stages {
    qpos: Vec<f64>,
    qvel: Vec<f64>,
    /// Weighted sums of velocities and accelerations over the stages.
    velocity: Vec<f64>,
    acceleration: Vec<f64>,
    /// Velocity of the last stage times its node, and the resulting positions.
    scaled: Vec<f64>,
    positions: Vec<f64>,
}

impl Stages {
    pub(crate) fn new(positions: usize, rates: usize) -> Self {
        Self {
            qpos: vec![0.0; positions],
            qvel: vec![0.0; rates],
            velocity: vec![0.0; rates],
            acceleration: vec![0.0; rates],
            scaled: vec![0.0; rates],
            positions: vec![0.0; positions],
        }
    }

    /// Stores the state at the beginning of the step.
    pub(crate) fn begin(&mut self, data: &Data) {
        self.qpos.copy_from_slice(data.qpos());
        self.qvel.copy_from_slice(data.qvel());
        self.velocity.fill(0.0);
        self.acceleration.fill(0.0);
    }

    /// Adds the present stage to the sums.
    pub(crate) fn accumulate(&mut self, data: &Data, weight: f64) {
        for (sum, rate) in self.velocity.iter_mut().zip(data.qvel()) {
            *sum += weight * rate;
        }
        for (sum, rate) in self.acceleration.iter_mut().zip(data.qacc()) {
            *sum += weight * rate;
        }
    }

    /// Advances from the beginning of the step to `node` of it, with velocity and acceleration of
    /// the present stage.
    pub(crate) fn advance_to(&mut self, data: &mut Data, node: f64, seconds: f64) {
        for (scaled, rate) in self.scaled.iter_mut().zip(data.qvel()) {
            *scaled = node * rate;
        }
        for dof in 0..self.qvel.len() {
            let rate = self.qvel[dof] + node * data.qacc()[dof] * seconds;
            data.qvel_mut()[dof] = rate;
        }
        self.positions.copy_from_slice(&self.qpos);
        let model = data.model();
        model.integrate_pos(&mut self.positions, &self.scaled, seconds);
        data.qpos_mut().copy_from_slice(&self.positions);
    }

    /// Advances to the end of the step.
    pub(crate) fn finish(&mut self, data: &mut Data, seconds: f64) {
        for dof in 0..self.qvel.len() {
            let rate = self.qvel[dof] + self.acceleration[dof] * seconds;
            data.qvel_mut()[dof] = rate;
        }
        // Warm start of MuJoCo's next solution.
        for dof in 0..self.qvel.len() {
            let last = data.qacc()[dof];
            data.qacc_warmstart_mut()[dof] = last;
        }
        self.positions.copy_from_slice(&self.qpos);
        let model = data.model();
        model.integrate_pos(&mut self.positions, &self.velocity, seconds);
        data.qpos_mut().copy_from_slice(&self.positions);
        let time = data.time();
        data.set_time(time + seconds);
    }
}
