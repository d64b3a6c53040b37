//! Tests what a sheet writes, element by element.

use super::super::tree::Tree;
use super::*;
use grideye_scene::Scene;
use std::time::Duration;

/// A room of 4 x 6 x 2.7 m as a map of 100 pixels per meter, its front left corner at 36, 636.
fn map() -> Camera {
    Camera::from_above(BOUNDS_M, &Panel::new(0.0, 0.0, 472.0, 672.0))
}

const BOUNDS_M: (DVec3, DVec3) = (DVec3::ZERO, DVec3::new(4.0, 6.0, 2.7));

fn drawn(draw: impl FnOnce(&mut Sheet)) -> Vec<String> {
    let mut sheet = Sheet {
        svg: Svg::default(),
    };
    draw(&mut sheet);
    sheet.svg.finish().lines().map(str::to_owned).collect()
}

/// A square on the floor, from the front left corner.
fn floor(size_m: f64) -> Vec<DVec3> {
    [(0.0, 0.0), (size_m, 0.0), (size_m, size_m), (0.0, size_m)]
        .map(|(x, y)| DVec3::new(x, y, 0.0))
        .to_vec()
}

fn parse(text: &str) -> Scene {
    let no_files = std::collections::HashMap::<String, String>::new();
    Scene::parse(text, "room.toml", &no_files).unwrap().scene
}

const ROOM: &str = "[room]\nsize_mm = [4000, 6000, 2700]\nambient_c = 20\n";

/// A sheet on the floor of the color 01 02 ff, whose top is darker by the light: 0.9272 of it.
fn square(size_mm: f64, edges: [bool; 4]) -> Vec<String> {
    let object = format!(
        "{ROOM}[[object]]\nname = \"o\"\nposition_mm = [0, 0, 0]\ncolor = \"#0102ff\"\nshape = \"polyhedron\"\n\
         vertices_mm = [[0, 0, 0], [{size_mm:?}, 0, 0], [{size_mm:?}, {size_mm:?}, 0], [0, {size_mm:?}, 0]]\nfaces = [[0, 1, 2, 3]]\n"
    );
    let mut bodies = Bodies::of(&parse(&object), Duration::ZERO, 10);
    let mut face = bodies.tree.nodes[0].faces[0].clone();
    face.edges = edges.to_vec();
    bodies.tree = Tree::new(vec![face]);
    drawn(|sheet| sheet.bodies(&map(), &bodies, &[]))
}

#[test]
fn a_page_has_its_size_and_its_head() {
    let page = Sheet::new((300.0, 200.0), "a < b", "c & d", ".more{}").finish();
    let lines: Vec<&str> = page.lines().collect();
    assert!(lines[0].contains(r#" width="300" height="200" viewBox="0 0 300 200" "#));
    assert!(lines[2].starts_with("<style>") && lines[2].ends_with(".more{}</style>"));
    let expected = [
        r#"<title>a &lt; b</title><text class="title" x="24.0" y="34.0">a &lt; b</text>"#,
        r#"<text class="faint" x="24.0" y="56.0">c &amp; d</text>"#,
        "</svg>",
    ];
    assert_eq!(lines[3..], expected);
}

#[test]
fn a_panel_has_its_title_inside() {
    let lines = drawn(|sheet| sheet.panel("map", &Panel::new(10.0, 20.0, 30.0, 40.0)));
    let frame = r#"<rect class="panel" x="10.0" y="20.0" width="30.0" height="40.0"/>"#;
    let title = r#"<text class="faint" x="22.0" y="40.0">map</text>"#;
    assert_eq!(lines, [frame, title]);
}

/// The floor is visible from above, a ceiling is not; a wall on edge counts as neither.
#[test]
fn walls_facing_the_eye_are_behind_all_others_in_front() {
    let floor = floor(1.0);
    let ceiling: Vec<DVec3> = floor.iter().rev().copied().collect();
    let upright: Vec<DVec3> = floor.iter().map(|at| DVec3::new(at.x, 0.0, at.y)).collect();
    let walls = [floor, ceiling, upright];
    let behind = drawn(|sheet| sheet.walls(&map(), "wall", &walls));
    let outline = r#"d="M36.0 636.0L136.0 636.0L136.0 536.0L36.0 536.0Z""#;
    assert_eq!(behind, [format!(r#"<path class="wall" {outline}/>"#)]);
    let before = drawn(|sheet| sheet.walls(&map(), "wire", &walls));
    assert_eq!(before.len(), 2);
}

/// A face of 5 pixels has edges, a smaller one has not.
#[test]
fn only_the_edges_that_are_to_be_are_drawn_and_none_of_tiny_faces() {
    let outline = "M36.0 636.0L136.0 636.0L136.0 536.0L36.0 536.0Z";
    let edge = |d: &str| format!(r##"<path d="{d}" fill="none" stroke="#00017f"/>"##);
    let full = format!(r##"<path d="{outline}" fill="#0102ec" stroke="#0102ec" class="seam"/>"##);
    let whole = format!(r##"<path d="{outline}" fill="#0102ec" stroke="#00017f"/>"##);
    let first = edge("M36.0 636.0L136.0 636.0");
    let last = edge("M36.0 536.0L36.0 636.0");
    for (edges, expected) in [
        ([true, false, false, false], vec![&full, &first]),
        ([false, false, false, true], vec![&full, &last]),
        ([false; 4], vec![&full]),
        ([true; 4], vec![&whole]),
    ] {
        let found = square(1000.0, edges);
        assert_eq!(found.iter().collect::<Vec<_>>(), expected, "{edges:?}");
    }
    let has_edges = |size_mm: f64| square(size_mm, [true; 4])[0].contains("#00017f");
    assert!(has_edges(50.1) && !has_edges(49.9));
}

#[test]
fn ways_are_open_lines_and_frames_are_circles() {
    let points_m = [DVec3::new(1.0, 1.0, 0.0), DVec3::new(2.0, 1.0, 0.0)];
    let lines = drawn(|sheet| sheet.way(&map(), &points_m, &points_m, [0, 16, 255]));
    let way = r##"<path class="way" d="M136.0 536.0L236.0 536.0" stroke="#0010ff"/>"##;
    let second = r##"<circle class="captured" cx="236.0" cy="536.0" r="3" stroke="#0010ff"/>"##;
    assert_eq!(
        (&lines[0][..], &lines[2][..], lines.len()),
        (way, second, 3)
    );
}

/// From the corner at 36, 636: to the right, to the back, and towards the eye, which has no length on the page.
#[test]
fn axes_are_34_pixels_long_and_named_beyond() {
    let lines = drawn(|sheet| sheet.axes(&map(), BOUNDS_M));
    for (index, tip, (x, y), name) in [
        (0, "70.0 636.0", ("82.0", "640.0"), 'x'),
        (2, "36.0 602.0", ("36.0", "594.0"), 'y'),
        (4, "36.0 636.0", ("36.0", "640.0"), 'z'),
    ] {
        let axis = format!(r#"<path class="axis" d="M36.0 636.0L{tip}"/>"#);
        let text = format!(r#"<text class="tick-label" x="{x}" y="{y}">{name}</text>"#);
        assert_eq!(lines[index..=index + 1], [axis, text]);
    }
}

/// 6 m in steps of 1 m: ticks at 0 to 4 m below the map and 0 to 6 m left of it, 5 pixels long, labeled 16 pixels away.
#[test]
fn rulers_have_a_tick_each_meter() {
    let lines = drawn(|sheet| sheet.ruler(&map(), BOUNDS_M));
    assert_eq!(lines.len(), 2 * (5 + 7));
    for (index, tick, (x, y), name) in [
        (0, "M36.0 636.0L36.0 641.0", ("36.0", "656.0"), "0 m"),
        (8, "M436.0 636.0L436.0 641.0", ("436.0", "656.0"), "4"),
        (10, "M36.0 636.0L31.0 636.0", ("20.0", "640.0"), "0 m"),
        (22, "M36.0 36.0L31.0 36.0", ("20.0", "40.0"), "6"),
    ] {
        let tick = format!(r#"<path class="tick" d="{tick}"/>"#);
        let text = format!(r#"<text class="tick-label" x="{x}" y="{y}">{name}</text>"#);
        assert_eq!(lines[index..=index + 1], [tick, text]);
    }
}

#[test]
fn a_key_is_a_box_and_its_meaning_and_the_next_begins_behind_it() {
    let mut next = DVec2::ZERO;
    let lines = drawn(|sheet| next = sheet.key(DVec2::new(24.0, 100.0), "#5b8dd9", "object"));
    let key = r##"<rect class="key" x="24.0" y="89.0" width="14" height="14" fill="#5b8dd9"/>"##;
    let text = r#"<text class="" x="44.0" y="100.0">object</text>"#;
    assert_eq!(lines, [format!("{key}{text}")]);
    assert_eq!(next, DVec2::new(24.0 + 44.0 + width("object"), 100.0));
}

/// Level, at 1, 1 m, looking to the right: a square of 9 points around its place, and a line of 0.25 m ahead.
#[test]
fn a_sensor_is_a_square_with_a_line_ahead() {
    let scene = parse(&format!(
        "{ROOM}[[sensor]]\nname = \"wall\"\npreset = \"grid-eye\"\nposition_mm = [1000, 1000, 1500]\nelevation_deg = 0\nazimuth_deg = 0\n"
    ));
    let corner_m = [DVec3::new(2.0, 1.0, 0.0)];
    let lines = drawn(|sheet| sheet.sensor(&map(), &scene.sensors()[0], &corner_m));
    let expected = [
        r#"<path class="ray" d="M136.0 536.0L236.0 536.0"/>"#,
        r#"<path class="ahead" d="M136.0 536.0L161.0 536.0"/>"#,
        r#"<rect class="sensor" x="131.5" y="531.5" width="9.0" height="9.0"/>"#,
    ];
    assert_eq!(lines, expected);
}
