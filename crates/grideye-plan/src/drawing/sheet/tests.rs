//! What a sheet writes, element by element.

use super::*;

/// A room of 4 x 6 x 2.7 m as a map of 100 pixels a meter, its front left corner at 36, 636.
fn map() -> Camera {
    let panel = Panel {
        left: 0.0,
        top: 0.0,
        width: 472.0,
        height: 672.0,
    };
    Camera::from_above(BOUNDS_M, &panel)
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
fn square(size_m: f64, opacity: f64, edges: [bool; 4]) -> Vec<String> {
    let points_m = [(0.0, 0.0), (size_m, 0.0), (size_m, size_m), (0.0, size_m)]
        .map(|(x, y)| DVec3::new(x, y, 0.0));
    let paint = Paint::Face {
        fill: [1, 2, 255],
        opacity,
        edge: [16, 17, 18],
    };
    let piece = Piece {
        points_m: points_m.to_vec(),
        edges: edges.to_vec(),
        paint,
    };
    drawn(|sheet| sheet.piece(&map(), &piece))
}

#[test]
fn a_page_has_its_size_and_its_head() {
    let mut sheet = Sheet::new(300.0, 200.0);
    sheet.head("a < b", "c & d");
    let page = sheet.finish();
    let lines: Vec<&str> = page.lines().collect();
    assert!(lines[0].contains(" width=\"300\" height=\"200\" viewBox=\"0 0 300 200\" "));
    let expected = [
        "<rect width=\"300\" height=\"200\" fill=\"#ffffff\"/>",
        "<title>a &lt; b</title>",
        "<text x=\"24\" y=\"34\" font-size=\"19\" font-weight=\"bold\">a &lt; b</text>",
        "<text x=\"24\" y=\"56\" fill=\"#555555\">c &amp; d</text>",
        "</svg>",
    ];
    assert_eq!(lines[1..], expected);
}

#[test]
fn a_panel_has_its_title_inside() {
    let panel = Panel {
        left: 10.0,
        top: 20.0,
        width: 30.0,
        height: 40.0,
    };
    let lines = drawn(|sheet| sheet.panel("map", &panel));
    assert!(lines[0].starts_with("<rect x=\"10\" y=\"20\" width=\"30\" height=\"40\" "));
    assert_eq!(
        lines[1],
        "<text x=\"22\" y=\"40\" fill=\"#777777\">map</text>"
    );
}

/// The floor is seen from above, a ceiling is not; a wall on edge is neither.
#[test]
fn walls_are_behind_or_before_by_their_side() {
    let floor: Vec<DVec3> = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
        .map(|(x, y)| DVec3::new(x, y, 0.0))
        .to_vec();
    let ceiling: Vec<DVec3> = floor.iter().rev().copied().collect();
    let upright: Vec<DVec3> = floor.iter().map(|at| DVec3::new(at.x, 0.0, at.y)).collect();
    let walls = [floor, ceiling, upright];
    let behind = drawn(|sheet| sheet.walls_behind(&map(), &walls));
    let outline = "d=\"M36.0 636.0L136.0 636.0L136.0 536.0L36.0 536.0Z\"";
    assert_eq!(behind.len(), 1);
    assert!(
        behind[0].starts_with(&format!("<path class=\"wall\" {outline} ")),
        "{behind:?}"
    );
    let before = drawn(|sheet| sheet.walls_before(&map(), &walls));
    assert_eq!(before.len(), 2, "{before:?}");
    assert!(before[0].contains("d=\"M36.0 536.0L136.0 536.0L136.0 636.0L36.0 636.0Z\""));
}

/// 5 pixels are an edge's worth, less is not.
#[test]
fn faces_are_filled_as_they_are_opaque_and_have_edges_unless_tiny() {
    let outline = |end: f64| {
        let (right, back) = (36.0 + end, 636.0 - end);
        format!("M36.0 636.0L{right:.1} 636.0L{right:.1} {back:.1}L36.0 {back:.1}Z")
    };
    let edge = |d: &str| {
        format!(
            "<path d=\"{d}\" fill=\"none\" stroke=\"#101112\" stroke-width=\"0.8\" stroke-linecap=\"round\"/>"
        )
    };
    let full = format!(
        "<path d=\"{}\" fill=\"#0102ff\" stroke=\"#0102ff\" stroke-width=\"0.4\"/>",
        outline(100.0)
    );
    let first = edge("M36.0 636.0L136.0 636.0");
    assert_eq!(
        square(1.0, 1.0, [true, false, false, false]),
        [full.clone(), first.clone()]
    );
    let last = edge("M36.0 536.0L36.0 636.0");
    assert_eq!(
        square(1.0, 1.0, [false, false, false, true]),
        [full.clone(), last]
    );
    assert_eq!(square(1.0, 1.0, [false; 4]), [full]);
    assert_eq!(
        square(1.0, 0.0, [true, false, false, false]),
        std::slice::from_ref(&first)
    );
    let glass = format!(
        "<path class=\"view\" d=\"{}\" fill=\"#0102ff\" fill-opacity=\"0.250\"/>",
        outline(100.0)
    );
    assert_eq!(
        square(1.0, 0.25, [true, false, false, false]),
        [glass, first]
    );
    assert_eq!(square(0.0501, 1.0, [true; 4]).len(), 2);
    assert_eq!(square(0.0499, 1.0, [true; 4]).len(), 1);
}

#[test]
fn ways_are_open_lines_and_frames_are_circles() {
    let points_m = vec![DVec3::new(1.0, 1.0, 0.0), DVec3::new(2.0, 1.0, 0.0)];
    let piece = |paint| Piece {
        points_m: points_m.clone(),
        edges: Vec::new(),
        paint,
    };
    let way = piece(Paint::Line {
        color: [0, 16, 255],
    });
    let lines = drawn(|sheet| sheet.piece(&map(), &way));
    assert!(
        lines[0].starts_with(
            "<path class=\"way\" d=\"M136.0 536.0L236.0 536.0\" fill=\"none\" stroke=\"#0010ff\" "
        ),
        "{lines:?}"
    );
    let circles = piece(Paint::Circle {
        color: [0, 16, 255],
        radius: 3.0,
    });
    let lines = drawn(|sheet| sheet.piece(&map(), &circles));
    assert_eq!(lines.len(), 2);
    assert_eq!(
        lines[1],
        "<circle class=\"captured\" cx=\"236.0\" cy=\"536.0\" r=\"3\" fill=\"#ffffff\" stroke=\"#0010ff\" stroke-width=\"1.1\"/>"
    );
}

/// From the corner at 36, 636: to the right, to the back, and towards the eye, which is nowhere.
#[test]
fn axes_are_34_pixels_long_and_named_beyond() {
    let lines = drawn(|sheet| sheet.axes(&map(), BOUNDS_M));
    let tips = [("70.0", "636.0"), ("36.0", "602.0"), ("36.0", "636.0")];
    let names = [
        ("82.0", "640.0", 'x'),
        ("36.0", "594.0", 'y'),
        ("36.0", "640.0", 'z'),
    ];
    for (index, ((x, y), (text_x, text_y, name))) in tips.into_iter().zip(names).enumerate() {
        let line = &lines[2 * index];
        let ends = format!("x1=\"36.0\" y1=\"636.0\" x2=\"{x}\" y2=\"{y}\" ");
        assert!(line.contains(&ends), "{line}");
        let text = &lines[2 * index + 1];
        assert!(
            text.starts_with(&format!("<text x=\"{text_x}\" y=\"{text_y}\" ")),
            "{text}"
        );
        assert!(text.ends_with(&format!(">{name}</text>")), "{text}");
    }
}

/// 6 m in steps of 1 m: ticks at 0 to 4 m below the map and at 0 to 6 m left of it, 5 pixels long, named 16 pixels away.
#[test]
fn rulers_have_a_tick_each_meter() {
    let lines = drawn(|sheet| sheet.ruler(&map(), BOUNDS_M));
    assert_eq!(lines.len(), 2 * (5 + 7));
    let begins =
        |index: usize, begin: &str| assert!(lines[index].starts_with(begin), "{}", lines[index]);
    begins(
        0,
        "<line class=\"tick\" x1=\"36.0\" y1=\"636.0\" x2=\"36.0\" y2=\"641.0\" ",
    );
    begins(1, "<text x=\"36.0\" y=\"656.0\" ");
    begins(
        8,
        "<line class=\"tick\" x1=\"436.0\" y1=\"636.0\" x2=\"436.0\" y2=\"641.0\" ",
    );
    begins(
        22,
        "<line class=\"tick\" x1=\"36.0\" y1=\"36.0\" x2=\"31.0\" y2=\"36.0\" ",
    );
    begins(23, "<text x=\"20.0\" y=\"40.0\" ");
    let names = [(1, "0 m"), (3, "1"), (9, "4"), (11, "0 m"), (23, "6")];
    for (index, name) in names {
        assert!(
            lines[index].ends_with(&format!(">{name}</text>")),
            "{}",
            lines[index]
        );
    }
}

#[test]
fn steps_are_the_next_of_1_2_and_5() {
    let cases = [
        (0.0005, 0.001),
        (0.15, 0.2),
        (0.3, 0.5),
        (0.6, 1.0),
        (1.0, 1.0),
        (1.01, 2.0),
        (2.5, 5.0),
        (30.0, 50.0),
    ];
    for (length, step) in cases {
        let found = round_step(length);
        assert!((found / step - 1.0_f64).abs() < 1e-9, "{length}: {found}");
    }
}

#[test]
fn the_legend_names_what_there_is() {
    let still = drawn(|sheet| sheet.legend(100.0, false));
    assert_eq!(still.len(), 6);
    assert!(
        still[0]
            .starts_with("<rect x=\"24\" y=\"89\" width=\"14\" height=\"14\" fill=\"#5b8dd9\" ")
    );
    assert_eq!(still[1], "<text x=\"44\" y=\"100\">object</text>");
    let next = 24.0 + 44.0 + width("object");
    assert_eq!(
        still[3],
        format!("<text x=\"{}\" y=\"100\">agent</text>", next + 20.0)
    );
    let walks = drawn(|sheet| sheet.legend(100.0, true));
    let end = next + 88.0 + width("agent") + width("sensor and what it has in view");
    assert_eq!(walks[..6], still);
    assert!(
        walks[6].starts_with(&format!("<path d=\"M{end} 96h34\" ")),
        "{}",
        walks[6]
    );
    assert!(walks[6].contains(&format!("<circle cx=\"{}\" cy=\"96\" r=\"3\" ", end + 17.0)));
    let text = format!(
        "<text x=\"{}\" y=\"100\">way, and where a frame is taken</text>",
        end + 42.0
    );
    assert_eq!(walks[7], text);
}

/// Level, at 1, 1 m, looking to the right: a square of 9 points about its place, and a line of a quarter of a meter ahead.
#[test]
fn a_sensor_is_a_square_with_a_line_ahead() {
    let text = "[room]\nsize_mm = [4000, 6000, 2700]\nambient_c = 20\n[[sensor]]\nname = \"wall\"\npreset = \"grid-eye\"\n\
         position_mm = [1000, 1000, 1500]\nelevation_deg = 0\nazimuth_deg = 0\n";
    let no_files = std::collections::HashMap::<String, String>::new();
    let scene = grideye_scene::Scene::parse(text, "room.toml", &no_files)
        .unwrap()
        .scene;
    let lines = drawn(|sheet| sheet.sensors(&map(), scene.sensors()));
    assert_eq!(
        lines,
        [
            "<g class=\"sensor\" stroke=\"#b88600\"><line x1=\"136.0\" y1=\"536.0\" x2=\"161.0\" y2=\"536.0\" stroke-width=\"1.5\"/>\
          <rect x=\"131.5\" y=\"531.5\" width=\"9\" height=\"9\" fill=\"#ffd52e\" stroke-width=\"1.2\"/></g>"
        ]
    );
}
