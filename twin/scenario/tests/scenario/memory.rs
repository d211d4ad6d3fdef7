//! The memory of a judge depends on its expectations, not on the length of the run.

use crate::common::run::trot_load;
use crate::common::{facts, legs, scene, text};
use twinrig_kernel::{Direction, Layout, SimDuration, SimTime};
use twinrig_runtime::{Group, Observer, RunEvent};
use twinrig_scenario::{Judge, Layouts, LegFact, RunEnd, Scene};

/// One expectation of each kind.
const EXPECTATIONS: [&str; 37] = [
    "footstep = { slip = { max = '1 mm' } }",
    "footstep = { slip_share = { max = 0.3 } }",
    "footstep = { stance = { max = '1 s' } }",
    "footstep = { swing = { max = '1 s' } }",
    "footstep = { stride = { max = '1 m' } }",
    "footstep = { impulse = { max = '9 N s' } }",
    "footstep = { peak_load = { max = '6 N' } }",
    "footstep = { position = { max = '9 m' } }",
    "footstep = { duty_factor = { max = 0.6 } }",
    "footstep = { frequency = { min = '3 Hz' } }",
    "footstep = { count = { max = 99 } }",
    "footstep = { phase = 'trot', tolerance = 0.05 }",
    "footstep = { phase_spread = { max = 0.05 } }",
    "footstep = { phase_spread = { max = 0.05 }, by = 'touch-down' }",
    "footstep = { contacts = { max = 2 } }",
    "footstep = { order = [['LF', 'RH'], ['RF', 'LH']] }",
    "footstep = { displacement = { max = '1 m' }, against = 'without changes', cycle = 3000 }",
    "body = { fall = false }",
    "body = { speed = { max = '1 m/s' } }",
    "body = { yaw_drift = { max = '1 deg' } }",
    "body = { settles = { within = '1 mm', by = '9 s' } }",
    "body = { gets_up = { within = '9 s' } }",
    "signal = { name = 'leg/*/cable/tension', always = { max = '2 N' } }",
    "signal = { name = 'leg/*/cable/tension', eventually = { max = '2 N' } }",
    "compare = { signal = 'leg/LF/foot/load', with = 'leg/RF/foot/load', error = { max = '1 N' } }",
    "compare = { signal = 'leg/LF/foot/load', with = 'leg/RF/foot/load', error_peak = { max = '1 N' } }",
    "compare = { signal = 'leg/LF/foot/load', with = 'leg/RH/foot/load', delay = { max = '1 s' } }",
    "compare = { signal = 'leg/LF/foot/load', with = 'leg/RF/foot/load', correlation = { max = 0.5 } }",
    "compare = { signal = 'leg/LF/foot/load', with = 'leg/RF/foot/load', gain = { max = 1 } }",
    "compare = { signal = 'leg/LF/foot/load', with = 'leg/RF/foot/load', peaks = { max = 1 } }",
    "response = { whenever = { name = 'leg/LF/foot/load', min = '5 N' }, then = { name = 'leg/RF/foot/load', max = '1 N' }, within = '1 s' }",
    "precedence = { whenever = { name = 'leg/LF/foot/load', min = '5 N' }, before = { name = 'leg/RF/foot/load', max = '1 N' }, within = '1 s' }",
    "precedence = { whenever = { name = 'leg/LF/foot/load', min = '5 N' }, before = { name = 'leg/RF/foot/load', max = '1 N' } }",
    "body = { recovers = { after = '500 s', within = '2 s', roll = '2 deg', yaw = '2 deg', speed = '1 m/s' } }",
    "signal = { name = 'leg/LF/foot/load', always = { max = '9 N' }, until = { name = 'leg/RF/foot/load', min = '99 N' } }",
    "timing = { of = 'control', jitter = { max = '1 ms' } }",
    "timing = { of = 'control', cycle_rate = { min = '10 Hz' } }",
];

/// Observation period: the longest that footsteps allow.
const PERIOD_MS: u64 = 10;

/// Trot as input of a judge.
struct Feed {
    layout: Layout,
    values: Vec<f64>,
    /// Legs and indices of their loads.
    loads: Vec<(String, usize)>,
    ms: u64,
    footsteps: usize,
}

impl Feed {
    fn new(scene: &Scene) -> Self {
        let layout = Layout::of(&facts(legs()).plant_outputs, Direction::Output);
        let range = |name: &str| layout.find(name).unwrap();
        let mut values = vec![0.5; layout.len()];
        values[range("body/rpy")].fill(0.0);
        let load = |leg: &LegFact| {
            let load = range(&format!("leg/{}/foot/load", leg.name));
            (leg.name.clone(), load.start)
        };
        let loads = scene.legs.iter().map(load).collect();
        Feed {
            layout,
            values,
            loads,
            ms: 0,
            footsteps: 0,
        }
    }

    fn judge(&self, scene: &Scene) -> Judge {
        let none = Layout::default();
        let layouts = Layouts {
            plant: &self.layout,
            process_inputs: &none,
            process_outputs: &none,
            diagnostics: &none,
            tasks: &[],
        };
        Judge::new(scene, layouts)
    }

    fn until(&mut self, seconds: u64, judge: &mut Judge) {
        while self.ms < 1000 * seconds {
            let now = SimTime::ZERO + SimDuration::from_millis(self.ms);
            for (leg, load) in &self.loads {
                // Occasional bounces, scuffs, and long stances.
                self.values[*load] = match (leg.as_str(), self.ms % 60_000) {
                    ("LF", 30_000..33_000) => 3.0,
                    ("RH", phase) if phase % 300 == 20 => 0.0,
                    ("LH", 40_000..40_010) => 0.6,
                    _ => trot_load(leg, self.ms),
                };
            }
            judge.samples(now, Group::Plant, &self.values);
            self.footsteps += judge.closed().len();
            let elapsed = SimDuration::ZERO;
            judge.event(now, RunEvent::ProcessBegin { elapsed });
            judge.event(now, RunEvent::ProcessEnd);
            self.ms += PERIOD_MS;
        }
    }
}

#[test]
fn memory_of_a_judge_is_independent_of_the_run_length() {
    let change = "[[change]]\nat = '5 s'\nset = 'step_length'\nby = '-1 cm'\n";
    let expectation = |expect: &&str| format!("[[expect]]\n{expect}\n");
    let expectations: String = EXPECTATIONS.iter().map(expectation).collect();
    let text = text(&format!("{change}{expectations}"));
    let text = text.replace("\"10 s\"", "\"10000 s\"");
    let scene = scene(&text).unwrap_or_else(|error| panic!("{error}"));
    let mut feed = Feed::new(&scene);
    let mut later = allocation_counter::AllocationInfo::default();
    let total = allocation_counter::measure(|| {
        let mut judge = feed.judge(&scene);
        feed.until(100, &mut judge);
        later = allocation_counter::measure(|| feed.until(2000, &mut judge));
        let at = scene.scenario.end();
        let end = RunEnd {
            at,
            energy: None,
            work: None,
            real_time_factor: None,
            buses: &[],
        };
        assert_eq!(judge.finish(&end).len(), EXPECTATIONS.len());
    });
    assert!(feed.footsteps > 25_000, "{} footsteps", feed.footsteps);
    assert_eq!((later.count_total, later.bytes_total), (0, 0));
    // Measured: 362 kB. The loads of the last 27 s take 264 kB; each element of a `settles` takes 4
    // kB, for the instant at which it was last outside.
    assert!(total.bytes_max < 380_000, "{} bytes", total.bytes_max);
}
