//! Pages of recorded runs, without a browser: `tests/check.py` opens them in one, and
//! `tests/check_live.py` the page of a live run.

use std::path::{Path, PathBuf};

use nalgebra::{Quaternion, Rotation3, UnitQuaternion, Vector3};
use twinrig_campaign::spread::Magnitude;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_record::Recording;
use twinrig_rig::{Assembly, Execution, Registry, StartPerturbation, execute_observed};
use twinrig_runtime::{Group, Observer, RunEvent};
use twinrig_testing::folder::Folder;
use twinrig_view::live::LivePoses;
use twinrig_view::{Run, page, picture};

const SCENARIO: &str = "
    name = 'a <b> of the trunk'
    robot = 'cheetah-cub'
    duration = '300 ms'
    plant = { model = 'massless', ground = {} }
    controller = { kind = 'stand', period = '2 ms' }
    record = { signals = ['body/position'], frames = '50 Hz' }
    [[expect]]
    name = 'stays low'
    signal = { name = 'body/position', component = 'z', always = { max = '1 mm' } }
";

/// Runs the scenario and returns the path of its recording.
fn recorded(registry: &Registry, folder: &Path) -> PathBuf {
    recorded_from(registry, folder, None)
}

fn recorded_from(registry: &Registry, folder: &Path, start: Option<StartPerturbation>) -> PathBuf {
    let assembly = Assembly::builder(registry);
    let assembly = assembly.text("low.toml", SCENARIO, "".as_ref()).unwrap();
    let assembly = match start {
        Some(start) => assembly.with_start(start),
        None => assembly,
    };
    let path = folder.join("low.mcap");
    let execution = Execution {
        recording: Some(path.clone()),
        ..Execution::default()
    };
    execute_observed(&assembly, &execution, &mut ()).unwrap();
    path
}

/// Samples of the plant, with their instants.
struct Samples(Vec<(SimTime, Vec<f64>)>);

impl Observer for Samples {
    fn event(&mut self, _: SimTime, _: RunEvent) {}

    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        if group == Group::Plant {
            self.0.push((now, values.to_vec()));
        }
    }
}

/// The feet of the live figure of a robot whose legs abduct are where the plant has them.
#[test]
fn legs_that_abduct_are_drawn_where_they_are() {
    let scenario = "
        name = 'splayed'
        robot = 'oncilla'
        duration = '400 ms'
        plant = { model = 'massless', base = 'fixed', abduction = 'free' }
        controller = { kind = 'stand', period = '2 ms', abduction = 'hold', splay = '12 deg' }
        record = { signals = ['leg/LF/foot/position', 'leg/RH/foot/position'], frames = '50 Hz' }
    ";
    let registry = Registry::standard();
    let assembly = Assembly::builder(&registry);
    let assembly = assembly
        .text("splayed.toml", scenario, "".as_ref())
        .unwrap();
    let (mut rig, mut samples) = (assembly.rig().unwrap(), Samples(Vec::new()));
    rig.run_until(SimTime::ZERO + SimDuration::from_millis(400), &mut samples)
        .unwrap();
    let layout = rig.layout(Group::Plant);
    let poses = LivePoses::new(&assembly, layout).unwrap();
    let (now, values) = samples.0.last().unwrap();
    let (figure, frame) = (
        poses.figure(values).unwrap(),
        poses.at(*now, values).unwrap(),
    );
    let [x, y, z, turn @ ..] = frame.trunk;
    let attitude = UnitQuaternion::from_quaternion(Quaternion::from(turn));
    for (leg, name) in [(0, "LF"), (3, "RH")] {
        let drawn = &figure.legs[leg];
        assert_eq!(drawn.name, name);
        let axis = Vector3::from(drawn.abduction.as_ref().unwrap().axis);
        let aside = frame.abduction.as_ref().unwrap()[leg];
        assert!(aside.abs() > 0.1, "{aside}");
        let mut foot = Vector3::from(drawn.offsets[0]) - axis;
        let mut angle = 0.0;
        for (joint, by) in frame.angles[leg].into_iter().enumerate() {
            angle += by;
            let segment = Rotation3::from_axis_angle(&Vector3::y_axis(), -angle);
            foot += segment * Vector3::from(drawn.offsets[joint + 1]);
        }
        let foot = axis + Rotation3::from_axis_angle(&Vector3::x_axis(), aside) * foot;
        let found = Vector3::new(x, y, z) + attitude * foot;
        let range = layout.find(&format!("leg/{name}/foot/position")).unwrap();
        let expected = Vector3::from_column_slice(&values[range]);
        assert!(
            (found - expected).norm() < 1e-12,
            "{name}: {found} {expected}"
        );
    }
}

#[test]
fn page_of_a_run_has_its_verdict_and_no_address() {
    let folder = Folder::new("view");
    let registry = Registry::standard();
    let recorded = Recording::open(&recorded(&registry, folder.path())).unwrap();
    let run = Run::open(&registry, "low.mcap", recorded, None);
    assert_eq!(run.is_repeated(), Ok(()));
    let page = page(&[run], false, "twin report low.mcap").unwrap();
    assert_eq!(page.opened_at_s, 0.0);
    assert!(
        page.html
            .contains("FAIL: 0 of 1 expectation holds; first violated at 0.000 s: stays low.")
    );
    assert!(page.html.contains("a &lt;b&gt; of the trunk"));
    assert!(
        page.html
            .contains("the repetition has the recorded fingerprint")
    );
    for address in ["src=\"http", "href=\"http", "url(", "import("] {
        assert!(!page.html.contains(address), "{address}");
    }
}

#[test]
fn picture_has_the_legs_at_an_instant() {
    let folder = Folder::new("view-picture");
    let registry = Registry::standard();
    let recorded = Recording::open(&recorded(&registry, folder.path())).unwrap();
    let run = Run::open(&registry, "low.mcap", recorded, None);
    let at = |instant: f64| picture(&run, instant).unwrap().unwrap();
    for leg in ["LF", "RF", "LH", "RH"] {
        // At the foot, and at its lane.
        assert_eq!(at(0.2).matches(&format!(">{leg}</text>")).count(), 2);
    }
    assert!(at(0.2).contains("a &lt;b&gt; of the trunk at 0.200 s"));
    assert_ne!(at(0.0), at(0.2));
}

#[test]
fn pages_of_equal_runs_are_equal() {
    let folder = Folder::new("view-twice");
    let registry = Registry::standard();
    let path = recorded(&registry, folder.path());
    let page = || {
        let recorded = Recording::open(&path).unwrap();
        let run = Run::open(&registry, "low.mcap", recorded, None);
        page(&[run], false, "twin report low.mcap").unwrap().html
    };
    assert!(page() == page());
}

#[test]
fn recording_that_cannot_be_repeated_is_shown_alone() {
    let folder = Folder::new("view-alone");
    let registry = Registry::standard();
    let bytes = std::fs::read(recorded(&registry, folder.path())).unwrap();
    // It was cut off before its verdict.
    let cut = Recording::from_bytes(bytes[..bytes.len() * 6 / 10].to_vec()).unwrap();
    let run = Run::open(&registry, "low.mcap", cut, None);
    assert_eq!(run.is_repeated(), Err("the recording was cut off"));
    let cut = page(&[run], false, "twin report low.mcap").unwrap().html;
    assert!(cut.contains("The recording was cut off, so that there is no verdict."));
    assert!(cut.contains("it was not repeated"));

    // Of another start, as if the build had changed since.
    let other = recorded_from(
        &registry,
        folder.path(),
        Some(StartPerturbation {
            seed: 1,
            member: 1,
            magnitude: Magnitude::UpTo(1e-6),
        }),
    );
    let other = Recording::open(&other).unwrap();
    let run = Run::open(&registry, "low.mcap", other, None);
    let why = run.is_repeated().unwrap_err();
    assert!(why.contains("another fingerprint"), "{why}");
    let other = page(&[run], false, "twin report low.mcap").unwrap();
    // The verdict is the recorded one.
    assert!(other.html.contains("FAIL: 0 of 1 expectation holds"));
}

#[test]
fn two_runs_are_aligned_and_compared() {
    let folder = Folder::new("view-two");
    let registry = Registry::standard();
    let path = recorded(&registry, folder.path());
    let run = |name: &str| Run::open(&registry, name, Recording::open(&path).unwrap(), None);
    let page = page(
        &[run("a.mcap"), run("b.mcap")],
        false,
        "twin report a.mcap b.mcap",
    )
    .unwrap();
    assert!(page.html.contains("Comparison of two runs"));
    assert!(page.html.contains("a &lt;b&gt; of the trunk, two runs"));
    assert!(
        page.html
            .contains("B equals A as far as both go. A: FAIL: 0 of 1")
    );
}

/// The library is the one that its authors publish as `uplot` 1.6.32.
#[test]
fn library_of_others_is_unchanged() {
    let of = |name: &str| {
        let path = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("assets/uplot")
            .join(name);
        blake3::hash(&std::fs::read(path).unwrap())
            .to_hex()
            .to_string()
    };
    assert_eq!(of("uPlot.iife.min.js"), UPLOT);
    assert_eq!(of("uPlot.min.css"), STYLE);
}

/// BLAKE3 of the files of the package.
const UPLOT: &str = "ea2d16ff65797375a846049c0f0a17f68b47a2850b9c73f2816ecf040ec9f2ce";
const STYLE: &str = "70ead7542eab83ef6ff4269c1f139e3c40f5f59f98302552320b9f79188abba1";
