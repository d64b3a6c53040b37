//! Tests what a sheet writes, element by element.

use super::*;

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

fn assert_begins(line: &str, begin: &str) {
    assert!(line.starts_with(begin), "{line}\nexpected {begin}");
}

/// A square on the floor, from the front left corner.
fn floor(size_m: f64) -> Vec<DVec3> {
    [(0.0, 0.0), (size_m, 0.0), (size_m, size_m), (0.0, size_m)]
        .map(|(x, y)| DVec3::new(x, y, 0.0))
        .to_vec()
}

fn square(size_m: f64, opacity: f64, edges: [bool; 4]) -> Vec<String> {
    let piece = Piece {
        points_m: floor(size_m),
        edges: edges.to_vec(),
        paint: Paint::Face {
            fill: [1, 2, 255],
            opacity,
            edge: [16, 17, 18],
        },
    };
    drawn(|sheet| sheet.piece(&map(), &piece))
}

#[test]
fn a_page_has_its_size_and_its_head() {
    let mut sheet = Sheet::new(300.0, 200.0);
    sheet.head("a < b", "c & d");
    let page = sheet.finish();
    let lines: Vec<&str> = page.lines().collect();
    assert!(lines[0].contains(r#" width="300" height="200" viewBox="0 0 300 200" "#));
    let expected = [
        r##"<rect width="300" height="200" fill="#ffffff"/>"##,
        "<title>a &lt; b</title>",
        r#"<text x="24" y="34" font-size="19" font-weight="bold">a &lt; b</text>"#,
        r##"<text x="24" y="56" fill="#555555">c &amp; d</text>"##,
        "</svg>",
    ];
    assert_eq!(lines[1..], expected);
}

#[test]
fn a_panel_has_its_title_inside() {
    let lines = drawn(|sheet| sheet.panel("map", &Panel::new(10.0, 20.0, 30.0, 40.0)));
    assert_begins(&lines[0], r#"<rect x="10" y="20" width="30" height="40" "#);
    let title = r##"<text x="22" y="40" fill="#777777">map</text>"##;
    assert_eq!(lines[1], title);
}

/// The floor is visible from above, a ceiling is not; a wall on edge counts as neither.
#[test]
fn walls_facing_the_eye_are_behind_all_others_in_front() {
    let floor = floor(1.0);
    let ceiling: Vec<DVec3> = floor.iter().rev().copied().collect();
    let upright: Vec<DVec3> = floor.iter().map(|at| DVec3::new(at.x, 0.0, at.y)).collect();
    let walls = [floor, ceiling, upright];
    let behind = drawn(|sheet| sheet.walls_behind(&map(), &walls));
    assert_eq!(behind.len(), 1);
    let outline = r#"d="M36.0 636.0L136.0 636.0L136.0 536.0L36.0 536.0Z""#;
    assert_begins(&behind[0], &format!(r#"<path class="wall" {outline} "#));
    let before = drawn(|sheet| sheet.walls_before(&map(), &walls));
    assert_eq!(before.len(), 2, "{before:?}");
    assert!(before[0].contains(r#"d="M36.0 536.0L136.0 536.0L136.0 636.0L36.0 636.0Z""#));
}

/// A piece of 5 pixels has edges, a smaller one has not.
#[test]
fn opacity_decides_the_fill_and_tiny_faces_have_no_edges() {
    let outline = "M36.0 636.0L136.0 636.0L136.0 536.0L36.0 536.0Z";
    let edge = |d: &str| {
        format!(
            r##"<path d="{d}" fill="none" stroke="#101112" stroke-width="0.8" stroke-linecap="round"/>"##
        )
    };
    let full =
        format!(r##"<path d="{outline}" fill="#0102ff" stroke="#0102ff" stroke-width="0.4"/>"##);
    let whole =
        format!(r##"<path d="{outline}" fill="#0102ff" stroke="#101112" stroke-width="0.8"/>"##);
    let glass =
        format!(r##"<path class="view" d="{outline}" fill="#0102ff" fill-opacity="0.250"/>"##);
    let first = edge("M36.0 636.0L136.0 636.0");
    let last = edge("M36.0 536.0L36.0 636.0");
    for (opacity, edges, expected) in [
        (1.0, [true, false, false, false], vec![&full, &first]),
        (1.0, [false, false, false, true], vec![&full, &last]),
        (1.0, [false; 4], vec![&full]),
        (1.0, [true; 4], vec![&whole]),
        (0.0, [true, false, false, false], vec![&first]),
        (0.25, [true, false, false, false], vec![&glass, &first]),
    ] {
        let found = square(1.0, opacity, edges);
        assert_eq!(
            found.iter().collect::<Vec<_>>(),
            expected,
            "{opacity} {edges:?}"
        );
    }
    let has_edges = |size_m: f64| square(size_m, 1.0, [true; 4])[0].contains("#101112");
    assert!(has_edges(0.0501) && !has_edges(0.0499));
}

#[test]
fn paths_are_open_lines_and_frames_are_circles() {
    let color = [0, 16, 255];
    let drawn = |paint| {
        let points_m = vec![DVec3::new(1.0, 1.0, 0.0), DVec3::new(2.0, 1.0, 0.0)];
        drawn(|sheet| sheet.piece(&map(), &Piece::without_edges(points_m, paint)))
    };
    let way = r##"<path class="way" d="M136.0 536.0L236.0 536.0" fill="none" stroke="#0010ff" "##;
    assert_begins(&drawn(Paint::Line { color })[0], way);
    let circles = drawn(Paint::Circle { color, radius: 3.0 });
    assert_eq!(circles.len(), 2);
    let second = r##"<circle class="captured" cx="236.0" cy="536.0" r="3" fill="#ffffff" stroke="#0010ff" stroke-width="1.1"/>"##;
    assert_eq!(circles[1], second);
}

/// From the corner at 36, 636: to the right, to the back, and towards the eye, which has no length on the page.
#[test]
fn axes_are_34_pixels_long_and_named_beyond() {
    let lines = drawn(|sheet| sheet.axes(&map(), BOUNDS_M));
    for (index, tip, at, name) in [
        (0, ("70.0", "636.0"), ("82.0", "640.0"), 'x'),
        (2, ("36.0", "602.0"), ("36.0", "594.0"), 'y'),
        (4, ("36.0", "636.0"), ("36.0", "640.0"), 'z'),
    ] {
        let (line, text) = (&lines[index], &lines[index + 1]);
        let ends = format!(r#"x1="36.0" y1="636.0" x2="{}" y2="{}" "#, tip.0, tip.1);
        assert!(line.contains(&ends), "{line}");
        assert_begins(text, &format!(r#"<text x="{}" y="{}" "#, at.0, at.1));
        assert!(text.ends_with(&format!(">{name}</text>")), "{text}");
    }
}

/// 6 m in steps of 1 m: ticks at 0 to 4 m below the map and 0 to 6 m left of it, 5 pixels long, labeled 16 pixels away.
#[test]
fn rulers_have_a_tick_each_meter() {
    let lines = drawn(|sheet| sheet.ruler(&map(), BOUNDS_M));
    assert_eq!(lines.len(), 2 * (5 + 7));
    for (index, begin) in [
        (
            0,
            r#"<line class="tick" x1="36.0" y1="636.0" x2="36.0" y2="641.0" "#,
        ),
        (1, r#"<text x="36.0" y="656.0" "#),
        (
            8,
            r#"<line class="tick" x1="436.0" y1="636.0" x2="436.0" y2="641.0" "#,
        ),
        (
            22,
            r#"<line class="tick" x1="36.0" y1="36.0" x2="31.0" y2="36.0" "#,
        ),
        (23, r#"<text x="20.0" y="40.0" "#),
    ] {
        assert_begins(&lines[index], begin);
    }
    for (index, name) in [(1, "0 m"), (3, "1"), (9, "4"), (11, "0 m"), (23, "6")] {
        let line = &lines[index];
        assert!(line.ends_with(&format!(">{name}</text>")), "{line}");
    }
}

#[test]
fn the_legend_names_paths_only_if_there_are_any() {
    let still = drawn(|sheet| sheet.legend(100.0, false));
    assert_eq!(still.len(), 6);
    let object = r##"<rect x="24" y="89" width="14" height="14" fill="#5b8dd9" "##;
    assert_begins(&still[0], object);
    assert_eq!(still[1], r#"<text x="44" y="100">object</text>"#);
    let next = 24.0 + 44.0 + width("object");
    let agent = format!(r#"<text x="{}" y="100">agent</text>"#, next + 20.0);
    assert_eq!(still[3], agent);
    let walks = drawn(|sheet| sheet.legend(100.0, true));
    let end = next + 88.0 + width("agent") + width("sensor and its field of view");
    assert_eq!(walks[..6], still);
    assert_begins(&walks[6], &format!(r#"<path d="M{end} 96h34" "#));
    let circle = format!(r#"<circle cx="{}" cy="96" r="3" "#, end + 17.0);
    assert!(walks[6].contains(&circle), "{}", walks[6]);
    let text = "path, and where frames are taken";
    let text = format!(r#"<text x="{}" y="100">{text}</text>"#, end + 42.0);
    assert_eq!(walks[7], text);
}

/// Level, at 1, 1 m, looking to the right: a square of 9 points around its place, and a line of 0.25 m ahead.
#[test]
fn a_sensor_is_a_square_with_a_line_ahead() {
    let text = "[room]\nsize_mm = [4000, 6000, 2700]\nambient_c = 20\n[[sensor]]\nname = \"wall\"\npreset = \"grid-eye\"\n\
         position_mm = [1000, 1000, 1500]\nelevation_deg = 0\nazimuth_deg = 0\n";
    let no_files = std::collections::HashMap::<String, String>::new();
    let loaded = grideye_scene::Scene::parse(text, "room.toml", &no_files).unwrap();
    let lines = drawn(|sheet| sheet.sensors(&map(), loaded.scene.sensors()));
    let expected = "<g class=\"sensor\" stroke=\"#b88600\"><line x1=\"136.0\" y1=\"536.0\" x2=\"161.0\" y2=\"536.0\" stroke-width=\"1.5\"/>\
         <rect x=\"131.5\" y=\"531.5\" width=\"9\" height=\"9\" fill=\"#ffd52e\" stroke-width=\"1.2\"/></g>";
    assert_eq!(lines, [expected]);
}
