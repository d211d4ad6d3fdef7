//! The method of fourth order, a stage at a time.

use mujoco_rs::prelude::{MjData, MjModel};

type Data = MjData<Box<MjModel>>;

/// What a step of stages has to remember. A model of muscles, whose activations are states, too, is none for it.
#[derive(Debug, Clone)]
pub(crate) struct Stages {
    qpos: Vec<f64>,
    qvel: Vec<f64>,
    /// Weighted sums of velocities and accelerations.
    velocity: Vec<f64>,
    acceleration: Vec<f64>,
    /// The last stage's velocity, times something; where that leads.
    scaled: Vec<f64>,
    places: Vec<f64>,
}

impl Stages {
    pub(crate) fn new(places: usize, rates: usize) -> Self {
        Self {
            qpos: vec![0.0; places],
            qvel: vec![0.0; rates],
            velocity: vec![0.0; rates],
            acceleration: vec![0.0; rates],
            scaled: vec![0.0; rates],
            places: vec![0.0; places],
        }
    }

    /// Remembers where the step begins.
    pub(crate) fn begin(&mut self, data: &Data) {
        self.qpos.copy_from_slice(data.qpos());
        self.qvel.copy_from_slice(data.qvel());
        self.velocity.fill(0.0);
        self.acceleration.fill(0.0);
    }

    /// Adds the present stage to the sums.
    pub(crate) fn note(&mut self, data: &Data, weight: f64) {
        for (sum, rate) in self.velocity.iter_mut().zip(data.qvel()) {
            *sum += weight * rate;
        }
        for (sum, rate) in self.acceleration.iter_mut().zip(data.qacc()) {
            *sum += weight * rate;
        }
    }

    /// Goes from the step's begin to `node` of it, at the present stage's velocity and acceleration.
    pub(crate) fn go(&mut self, data: &mut Data, node: f64, seconds: f64) {
        for (scaled, rate) in self.scaled.iter_mut().zip(data.qvel()) {
            *scaled = node * rate;
        }
        for dof in 0..self.qvel.len() {
            let rate = self.qvel[dof] + node * data.qacc()[dof] * seconds;
            data.qvel_mut()[dof] = rate;
        }
        self.places.copy_from_slice(&self.qpos);
        let model = data.model();
        model.integrate_pos(&mut self.places, &self.scaled, seconds);
        data.qpos_mut().copy_from_slice(&self.places);
    }

    /// Goes to the step's end.
    pub(crate) fn end(&mut self, data: &mut Data, seconds: f64) {
        for dof in 0..self.qvel.len() {
            let rate = self.qvel[dof] + self.acceleration[dof] * seconds;
            data.qvel_mut()[dof] = rate;
        }
        // MuJoCo begins its search for the next forces at these accelerations.
        for dof in 0..self.qvel.len() {
            let last = data.qacc()[dof];
            data.qacc_warmstart_mut()[dof] = last;
        }
        self.places.copy_from_slice(&self.qpos);
        let model = data.model();
        model.integrate_pos(&mut self.places, &self.velocity, seconds);
        data.qpos_mut().copy_from_slice(&self.places);
        let time = data.time();
        data.set_time(time + seconds);
    }
}
