//! The drawing against the kinematics, and its labels against each other, for the robots of this
//! repository and for random ones.

use std::path::Path;

use proptest::prelude::*;
use twinrig_robot::leg::Pantograph;

use super::*;

fn file(name: &str) -> RobotFile {
    RobotFile::find(name, Path::new("")).unwrap()
}

/// Returns the pages of the repository's robots.
fn page(name: &str) -> (Robot, Page) {
    let file = file(name);
    let robot = file.robot().unwrap();
    let page = drawing(&file, &robot).unwrap();
    (robot, page)
}

/// Asserts that no two texts overlap and that none leaves the page.
fn assert_labels_are_apart(page: &Page) {
    let [width, height] = page.size;
    for (n, a) in page.labels.iter().enumerate() {
        let is_inside = a.left >= 0.0 && a.top >= 0.0 && a.right <= width && a.bottom <= height;
        assert!(is_inside, "{a:?} in {width} × {height}");
        for b in &page.labels[..n] {
            let apart =
                a.right <= b.left || b.right <= a.left || a.bottom <= b.top || b.bottom <= a.top;
            assert!(apart, "{a:?} {b:?}");
        }
    }
}

/// Asserts that elements nest and that every coordinate is a number on the page.
fn assert_well_formed(page: &Page) {
    let mut open: Vec<&str> = Vec::new();
    let body = page.text.split_once("?>").unwrap().1;
    for part in body.split('<').skip(1) {
        let (tag, text) = part.split_once('>').unwrap();
        assert!(
            !text.contains('>') && !text.contains('&') || text.contains(';'),
            "{text}"
        );
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name), "{tag}");
        } else if !tag.ends_with('/') {
            open.push(tag.split_whitespace().next().unwrap());
        }
        assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");
        if let Some(points) = attribute(tag, "points") {
            for [x, y] in pairs(points) {
                assert!((0.0..=page.size[0]).contains(&x), "{tag}");
                assert!((0.0..=page.size[1]).contains(&y), "{tag}");
            }
        }
    }
    assert!(open.is_empty(), "{open:?}");
}

fn attribute<'a>(tag: &'a str, name: &str) -> Option<&'a str> {
    let start = tag.find(&format!(" {name}=\""))? + name.len() + 3;
    let length = tag[start..].find('"')?;
    Some(&tag[start..start + length])
}

fn pairs(points: &str) -> Vec<[f64; 2]> {
    let numbers = |pair: &str| {
        let (x, y) = pair.split_once(',').unwrap();
        [x.parse().unwrap(), y.parse().unwrap()]
    };
    points.split(' ').map(numbers).collect()
}

/// Returns the lines of a class in a group, in metres, by the scale that the group states.
fn lines(page: &Page, group: &str, class: &str) -> Vec<Vec<[f64; 2]>> {
    let (_, rest) = page.text.split_once(&format!("<g id=\"{group}\"")).unwrap();
    let (group, _) = rest.split_once("</g>").unwrap();
    let scale: f64 = attribute(group, "data-scale").unwrap().parse().unwrap();
    let origin = attribute(group, "data-origin").unwrap().replace(' ', ",");
    let [x0, y0] = pairs(&origin)[0];
    let elements = group
        .lines()
        .filter(|line| line.contains(&format!("class=\"{class}\"")));
    let metres = |[x, y]: [f64; 2]| [(x - x0) / scale, (y0 - y) / scale];
    elements
        .map(|line| {
            pairs(attribute(line, "points").unwrap())
                .into_iter()
                .map(metres)
                .collect()
        })
        .collect()
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    libm::hypot(a[0] - b[0], a[1] - b[1])
}

#[test]
fn points_of_the_legs_are_those_of_the_kinematics() {
    for name in ["cheetah-cub", "oncilla"] {
        let (robot, page) = page(name);
        let leg = &robot.legs[0].leg;
        let mechanism = Pantograph::new(leg).unwrap();
        // Three decimals of a pixel, at some 1000 px/m or more.
        let near = |a: f64, b: f64| assert!((a - b).abs() < 3e-6, "{name}: {a} {b}");
        for (pose, reach, diagonal) in [
            ("extended", mechanism.length_max(), mechanism.diagonal_max()),
            ("bent", mechanism.length_min(), leg.diagonal_min),
        ] {
            let group = format!("aslp-{pose}");
            let segments = lines(&page, &group, "segment");
            let ([hip, knee, ankle], [outer, foot]) = (
                <[_; 3]>::try_from(segments[0].clone()).unwrap(),
                <[_; 2]>::try_from(segments[1].clone()).unwrap(),
            );
            near(distance(hip, knee), leg.l1);
            near(distance(knee, ankle), leg.l2);
            near(distance(outer, foot), leg.l3);
            near(distance(outer, ankle), leg.l_delta);
            near(distance(hip, foot), reach);
            near(foot[0], hip[0]);
            let springs = lines(&page, &group, "spring");
            let ends = |line: &Vec<[f64; 2]>| distance(line[0], line[line.len() - 1]);
            near(ends(&springs[0]), diagonal);
            // The pantograph is closed.
            near(ends(&springs[1]), leg.l2);
            near(distance(springs[0][0], knee), leg.l_delta);
            let cable = &lines(&page, &group, "cable")[0];
            near(ends(cable), distance(hip, ankle));
        }
        // Knee angles: q2_ref, and that of the bottomed diagonal.
        let feet = lines(&page, "side", "toe");
        assert_eq!(feet.len(), 4);
        for (mount, leg) in robot.legs.iter().zip(feet) {
            near(leg[0][0], mount.hip[0]);
            near(leg[0][1] - leg[3][1], mechanism.length_max());
        }
    }
}

#[test]
fn labels_name_the_values_of_the_file() {
    let text = page("cheetah-cub").1.text;
    for label in [
        "l1 = 44.2 mm",
        "l2 = 71.4 mm",
        "l3 = 54.4 mm",
        "l_Δ = 15 mm",
        "q2_ref = 35 °",
        "diagonal k_d = 4400 N/m",
        "parallel k_p = 1800 N/m",
        "pulley r = 25 mm",
        "L_max = 147.9 mm",
        "l_d,min = 62.82 mm",
        "q2_ref - q2 = 130 °",
        "hips apart 200 mm",
        "hip LF, RF",
        "leg.aslp.diagonal.stiffness",
    ] {
        assert!(text.contains(&format!(">{label}</text>")), "{label}");
    }
}

#[test]
fn drawing_is_the_same_each_time() {
    assert_eq!(page("oncilla").1.text, page("oncilla").1.text);
}

#[test]
fn labels_are_apart_in_the_robots_of_the_repository() {
    for name in ["cheetah-cub", "oncilla"] {
        let page = page(name).1;
        assert_labels_are_apart(&page);
        assert_well_formed(&page);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn labels_are_apart_in_any_robot(
        lengths in prop::array::uniform4(0.001..2.0_f64),
        q2_ref in 0.01..3.1_f64,
        share in 0.01..0.99_f64,
        radius in 0.0005..1.0_f64,
        toe in 0.001..1.0_f64,
        hips in prop::collection::vec((-3.0..3.0_f64, -1.0..1.0_f64, -1.0..1.0_f64), 1..12),
        name in "[ -~°<&\"]{1,300}",
    ) {
        let file = file("cheetah-cub");
        let mut robot = file.robot().unwrap();
        robot.name = name;
        let mut leg = robot.legs[0].clone();
        let [l1, l2, l3, offset] = lengths;
        let shortest = l1.min(l2).min(l3);
        let l = &mut leg.leg;
        (l.l1, l.l2, l.l3, l.q2_ref, l.pulley_radius) = (l1, l2, l3, q2_ref, radius);
        l.l_delta = shortest * (0.05 + 0.9 * offset / 2.0);
        let (flat, third) = (l.l2 - l.l_delta, 2.0 * l.l2 * l.l_delta * libm::cos(q2_ref));
        let diagonal = (l.l2 * l.l2 + l.l_delta * l.l_delta + third).sqrt();
        l.diagonal_min = flat + share * (diagonal - flat);
        l.parallel_travel = share * (diagonal + l.l_delta - l.l2);
        if let Some(segment) = &mut l.toe {
            segment.length = toe;
        }
        robot.legs = hips.iter().enumerate().map(|(n, &(x, y, z))| {
            let mut mount = leg.clone();
            (mount.name, mount.hip) = (format!("leg-{n}"), [x, y, z]);
            mount
        }).collect();
        // The file gives the names of the kinds of legs only.
        let page = drawing(&file, &robot);
        // Poses in which two segments are in line cannot be drawn, and say so.
        if let Ok(page) = page {
            assert_labels_are_apart(&page);
            assert_well_formed(&page);
        }
    }
}
