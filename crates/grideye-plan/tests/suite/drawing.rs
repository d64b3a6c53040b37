//! The drawing of a scene, compared with the scene file and the geometry of a map.

use crate::{CEILING, ROOM, object, parse, scene};
use grideye_plan::drawing::{Drawing, limits, svg};
use grideye_scene::{Loaded, Scene};
use std::time::Duration;

/// From above, 4 m by 6 m fill the height between the margins: 512 of 584 points for 6 m.
const POINTS_PER_M: f64 = 512.0 / 6.0;

fn on_map(x_m: f64, y_m: f64) -> (f64, f64) {
    (
        808.0 + 224.0 + (x_m - 2.0) * POINTS_PER_M,
        84.0 + 292.0 - (y_m - 3.0) * POINTS_PER_M,
    )
}

fn walker(speed_mm_per_s: f64) -> Scene {
    let text = format!(
        "{ROOM}{CEILING}[[agent]]\nname = \"person\"\nsize_mm = [200, 500, 1750]\ntemperature_c = 28\n\
         trajectory = \"walk.csv\"\nspeed_mm_per_s = {speed_mm_per_s:?}\n"
    );
    let files = |_: &str| Ok("x_mm,y_mm,z_mm\n500,1000,0\n3500,1000,0\n3500,5000,0\n".to_owned());
    let loaded: Loaded = Scene::parse(&text, "room.toml", &files).unwrap();
    loaded.scene
}

fn draw(text: &str) -> String {
    svg(&scene(text), &Drawing::new("a room"))
}

/// The values of an attribute in all elements that contain `mark`, in page order.
fn attributes(svg: &str, mark: &str, name: &str) -> Vec<String> {
    let key = format!(" {name}=\"");
    svg.lines()
        .filter(|line| line.contains(mark))
        .filter_map(|line| line.split(&key).nth(1)?.split('"').next())
        .map(str::to_owned)
        .collect()
}

/// The colors of filled faces except those of the room and sensors, in painting order.
fn fills(svg: &str) -> Vec<String> {
    attributes(svg, "<path d=", "fill")
        .into_iter()
        .filter(|fill| fill != "none")
        .collect()
}

/// The page up to the second view, and the rest.
fn views(svg: &str) -> (&str, &str) {
    svg.split_at(svg.find("From above").unwrap())
}

#[test]
fn every_frame_has_a_circle() {
    let scene = walker(1000.0);
    let svg = svg(&scene, &Drawing::new("walk"));
    // 7 m at 1 m/s and 10 Hz: 71 frames, in either view.
    let (_, above) = views(&svg);
    let number = |text: &String| text.parse::<f64>().unwrap();
    let across: Vec<f64> = attributes(above, "class=\"captured\"", "cx")
        .iter()
        .map(number)
        .collect();
    let down: Vec<f64> = attributes(above, "class=\"captured\"", "cy")
        .iter()
        .map(number)
        .collect();
    assert_eq!(svg.matches("class=\"captured\"").count(), 2 * 71);
    assert_eq!(across.len(), 71);
    // From above only the standing person hides the path, so the order is the painter's: each place by the law of
    // motion is there, to a tenth of a point.
    for frame in 0..71 {
        let along_m = f64::from(frame) * 0.1;
        let (x, y) = on_map(0.5 + along_m.min(3.0), 1.0 + (along_m - 3.0).max(0.0));
        let found = across
            .iter()
            .zip(&down)
            .any(|(cx, cy)| (cx - x).abs() <= 0.051 && (cy - y).abs() <= 0.051);
        assert!(found, "frame {frame} at {x}, {y}");
    }
    assert!(svg.contains("a circle at every frame of ceiling at 10 Hz"));
    assert!(
        svg.contains(".way{fill:none;stroke-width:1.6;stroke-dasharray:.1 4"),
        "dotted"
    );
    assert!(svg.contains("path, and a circle where a frame is taken"));
}

#[test]
fn circles_follow_the_chosen_sensor_and_are_thinned_on_a_long_path() {
    let mut text = ROOM.to_owned();
    text.push_str(CEILING);
    let slow = CEILING.replace("\"ceiling\"", "\"slow\"") + "sampling_hz = 1\n";
    text.push_str(&slow);
    text.push_str("[[agent]]\nname = \"person\"\nsize_mm = [200, 500, 1750]\ntemperature_c = 28\ntrajectory = \"walk.csv\"\nspeed_mm_per_s = 100\n");
    let files = |_: &str| Ok("x_mm,y_mm,z_mm\n500,1000,0\n3500,1000,0\n3500,5100,0\n".to_owned());
    let scene = Scene::parse(&text, "room.toml", &files).unwrap().scene;
    let by = |name: &str| {
        let drawing = Drawing {
            sampled_by: Some(scene.sensor(name).unwrap()),
            ..Drawing::new("walk")
        };
        svg(&scene, &drawing)
    };
    // 71 s: 72 frames at 1 Hz; at 10 Hz 711, of which every second fits below the limit.
    assert_eq!(by("slow").matches("class=\"captured\"").count(), 2 * 72);
    let fast = by("ceiling");
    assert_eq!(fast.matches("class=\"captured\"").count(), 2 * 356);
    assert_eq!(711_usize.div_ceil(limits::CIRCLES_MAX), 2);
    assert!(
        fast.contains("a circle at every second frame of ceiling"),
        "the thinning is stated"
    );
}

#[test]
fn objects_are_blue_agents_red_unless_they_have_a_color() {
    let mut text = format!("{ROOM}{CEILING}");
    text.push_str(&object(
        "table",
        [2000.0, 3000.0, 0.0],
        [1000.0, 1000.0, 750.0],
        0.0,
        21.0,
    ));
    text.push_str(&object(
        "lamp",
        [3000.0, 5000.0, 0.0],
        [300.0, 300.0, 300.0],
        0.0,
        40.0,
    ));
    text.push_str("color = \"#00ff00\"\n[[agent]]\nname = \"person\"\nsize_mm = [200, 500, 1750]\ntemperature_c = 28\nposition_mm = [1000, 1000, 0]\n");
    let page = draw(&text);
    let (_, above) = views(&page);
    // From above each box shows its top, of full color times 0.72 + 0.28 * 0.74.
    let lit = |part: u32| {
        format!(
            "{:02x}",
            (f64::from(part) * (0.72 + 0.28 * 0.74)).round() as u8
        )
    };
    let top = |rgb: [u32; 3]| format!("#{}", rgb.map(lit).concat());
    let mut found = fills(above);
    found.sort();
    let mut expected = vec![
        top([0x5b, 0x8d, 0xd9]),
        top([0, 255, 0]),
        top([0xd6, 0x3b, 0x33]),
    ];
    expected.sort();
    // The legend follows the second view: a dotted line without a fill.
    assert_eq!(found, expected);
    // In perspective three faces of each are seen.
    assert_eq!(fills(views(&page).0).len(), 9);
    for label in ["table, 21 °C", "lamp, 40 °C", "person, 28 °C", ">ceiling<"] {
        assert_eq!(page.matches(label).count(), 2, "{label}");
    }
}

#[test]
fn the_pyramid_ends_at_the_floor_and_at_the_walls() {
    let page = draw(&format!("{ROOM}{CEILING}"));
    let (_, above) = views(&page);
    let views = attributes(above, "class=\"view\"", "d");
    // 2.7 m up with 60 degrees: 2 * 2.7 * tan 30° = 3.1177 m on the floor, all within the walls.
    assert_eq!(views.len(), 1, "{views:?}");
    let half = 0.5 * 3.117_691_453_6;
    for (x, y) in [(2.0 - half, 3.0 - half), (2.0 + half, 3.0 + half)] {
        let (across, down) = on_map(x, y);
        assert!(
            views[0].contains(&format!("{across:.1} {down:.1}")),
            "{views:?}"
        );
    }
    // Close to a wall the same sensor also sees that wall, so its pyramid has a face there.
    let beside = CEILING.replace("[2000, 3000, 2700]", "[500, 3000, 2700]");
    let page = draw(&format!("{ROOM}{beside}"));
    let (across, _) = on_map(0.0, 0.0);
    let outline = &attributes(self::views(&page).1, "class=\"view\"", "d")[0];
    let numbers: Vec<f64> = outline
        .split(['M', 'L', 'Z', ' '])
        .filter_map(|text| text.parse().ok())
        .collect();
    let leftmost = numbers
        .iter()
        .step_by(2)
        .copied()
        .fold(f64::INFINITY, f64::min);
    assert!((leftmost - across).abs() < 0.06, "{outline}");
}

#[test]
fn lower_bodies_are_painted_first_and_agents_at_their_place() {
    let mut text = format!("{ROOM}{CEILING}");
    text.push_str(&object(
        "top",
        [2000.0, 3000.0, 700.0],
        [1500.0, 1500.0, 50.0],
        30.0,
        21.0,
    ));
    text.push_str("color = \"#ff0000\"\n");
    text.push_str(&object(
        "box",
        [2000.0, 3000.0, 0.0],
        [300.0, 300.0, 300.0],
        0.0,
        30.0,
    ));
    text.push_str("color = \"#0000ff\"\n");
    let page = draw(&text);
    assert_eq!(fills(views(&page).1), ["#0000ec", "#ec0000"]);

    let scene = walker(1000.0);
    let at = |time: u64| {
        let drawing = Drawing {
            time: Duration::from_secs(time),
            ..Drawing::new("walk")
        };
        let page = svg(&scene, &drawing);
        attributes(views(&page).1, "fill=\"#c6372f\"", "d")[0].clone()
    };
    // The center of the person's outline moves with it: 200 x 500 mm around the path.
    for (time, x, y) in [(0, 0.5, 1.0), (2, 2.5, 1.0), (5, 3.5, 3.0)] {
        let (across, down) = on_map(x - 0.1, y - 0.25);
        let corner = format!("{across:.1} {down:.1}");
        assert!(at(time).contains(&corner), "{}: {corner}", at(time));
    }
}

#[test]
fn the_page_is_self_contained_and_no_name_can_break_it() {
    let named = object("named", [1000.0, 1000.0, 0.0], [500.0; 3], 0.0, 30.0);
    let named = named.replace("\"named\"", "'<script>&\"x'");
    let text = format!("{ROOM}{CEILING}{named}");
    let page = svg(&scene(&text), &Drawing::new("</svg> & \"more\""));
    assert!(page.contains("&lt;script&gt;&amp;&quot;x"));
    assert!(page.contains("&lt;/svg&gt; &amp; &quot;more&quot;"));
    assert!(!page.contains("<script") && !page.contains("href") && !page.contains("url("));
    assert_eq!(
        page.matches("http").count(),
        1,
        "the name of the language only"
    );
    assert_eq!(page.matches("</svg>").count(), 1);
    assert_balanced(&page);
    assert_balanced(&svg(&walker(800.0), &Drawing::new("walk")));
    assert_balanced(&draw(
        "[room]\nsize_mm = [4000, 6000, 2700]\nambient_c = 20\n",
    ));
}

/// Every element is closed, in order.
fn assert_balanced(page: &str) {
    let mut open = Vec::new();
    for tag in page.split('<').skip(1) {
        let (inside, _) = tag.split_once('>').unwrap();
        let name: String = inside
            .trim_start_matches('/')
            .chars()
            .take_while(char::is_ascii_alphanumeric)
            .collect();
        if inside.starts_with('!') || inside.ends_with('/') {
            continue;
        }
        if inside.starts_with('/') {
            assert_eq!(open.pop(), Some(name));
        } else {
            open.push(name);
        }
        assert_eq!(inside.matches('"').count() % 2, 0, "{inside}");
    }
    assert!(open.is_empty(), "{open:?}");
}

#[test]
fn the_same_scene_gives_the_same_page() {
    let scene = walker(800.0);
    assert_eq!(
        svg(&scene, &Drawing::new("a")),
        svg(&scene, &Drawing::new("a"))
    );
}

/// A strip of `faces` triangles, open.
fn strip(name: &str, faces: usize, y_mm: f64) -> String {
    let vertices: Vec<String> = (0..faces + 2)
        .map(|index| {
            format!(
                "[{:?}, {:?}, 0]",
                index as f64 * 0.1,
                (index % 2) as f64 * 10.0
            )
        })
        .collect();
    let corners: Vec<String> = (0..faces)
        .map(|face| format!("[{face}, {}, {}]", face + 1, face + 2))
        .collect();
    format!(
        "[[object]]\nname = \"{name}\"\nposition_mm = [500, {y_mm:?}, 100]\nshape = \"polyhedron\"\nvertices_mm = [{}]\nfaces = [{}]\n",
        vertices.join(", "),
        corners.join(", ")
    )
}

/// Faces of one strip.
const NET: usize = limits::FACES_MAX / 2;

#[test]
fn a_body_of_too_many_faces_is_drawn_as_its_box() {
    let both = |more: usize| {
        let first = strip("net", NET, 500.0);
        let page = draw(&format!("{ROOM}{first}{}", strip("other", more, 1500.0)));
        fills(views(&page).1).len()
    };
    assert_eq!(both(NET), limits::FACES_MAX);
    assert_eq!(both(NET + 1), NET + 1, "the top of a box");
}

#[test]
fn bodies_beyond_the_face_limit_are_boxes() {
    let nets = [
        ("first", NET, 500.0),
        ("second", NET, 1500.0),
        ("last", 7, 4000.0),
    ];
    let nets = nets.map(|(name, faces, y_mm)| strip(name, faces, y_mm));
    let page = draw(&format!("{ROOM}{}", nets.concat()));
    assert_eq!(fills(views(&page).1).len(), limits::FACES_MAX + 1);
}

#[test]
fn names_without_room_are_left_out_and_counted() {
    let mut text = format!("{ROOM}{CEILING}");
    for index in 0..60 {
        let (x, y) = (f64::from(index % 6), f64::from(index / 6));
        text.push_str(&object(
            &format!("b{index}"),
            [300.0 + 620.0 * x, 300.0 + 580.0 * y, 0.0],
            [50.0; 3],
            0.0,
            21.0,
        ));
    }
    let page = draw(&text);
    let (_, above) = views(&page);
    let named = above.matches(" °C</text>").count() + above.matches(">ceiling<").count();
    assert!(
        named <= limits::LABELS_MAX && named > limits::LABELS_MAX / 2,
        "{named}"
    );
    assert!(above.contains(&format!("<!-- no room for {} names -->", 61 - named)));
}

/// The place of a name, if it is drawn.
fn place_of(view: &str, name: &str) -> Option<(f64, f64)> {
    let mark = format!(">{name}</text>");
    let number = |attribute: &str| attributes(view, &mark, attribute).first()?.parse().ok();
    Some((number("x")?, number("y")?))
}

#[test]
fn a_name_moves_with_its_agent() {
    let scene = walker(1000.0);
    for (time, x, y) in [(0, 0.5, 1.0), (2, 2.5, 1.0), (5, 3.5, 3.0)] {
        let drawing = Drawing {
            time: Duration::from_secs(time),
            ..Drawing::new("walk")
        };
        let page = svg(&scene, &drawing);
        let found = place_of(views(&page).1, "person, 28 °C").unwrap();
        let (across, down) = on_map(x, y);
        let (across_off, down_off) = (found.0 - across, found.1 - (down - 8.0));
        assert!(
            across_off.abs() < 0.11 && down_off.abs() < 0.11,
            "{time} s: {found:?}"
        );
    }
}

#[test]
fn a_name_avoids_an_earlier_one() {
    let near = |name: &str, x_mm: f64| object(name, [x_mm, 3000.0, 0.0], [50.0; 3], 0.0, 21.0);
    let page = draw(&format!(
        "{ROOM}{}{}",
        near("one", 2000.0),
        near("two", 2040.0)
    ));
    let (_, above) = views(&page);
    let (x, y) = on_map(2.0, 3.0);
    let first = place_of(above, "one, 21 °C").unwrap();
    assert!((first.0 - x).abs() < 0.11 && (first.1 - (y - 8.0)).abs() < 0.11);
    // The place above is taken, so the name is below.
    let second = place_of(above, "two, 21 °C").unwrap();
    assert!((second.1 - (y + 16.0)).abs() < 0.11, "{second:?}");
}

#[test]
fn a_name_is_at_the_top_of_its_thing_and_a_mosaic_has_one() {
    let tower = object(
        "tower",
        [1000.0, 1000.0, 0.0],
        [100.0, 100.0, 2000.0],
        0.0,
        21.0,
    );
    let tower = draw(&format!("{ROOM}{tower}"));
    let sensor = CEILING.replace("[2000, 3000, 2700]", "[1000, 1000, 2000]");
    let sensor = draw(&format!("{ROOM}{sensor}"));
    let of_tower = place_of(views(&tower).0, "tower, 21 °C");
    assert!(of_tower.is_some());
    assert_eq!(of_tower, place_of(views(&sensor).0, "ceiling"));
    let rug = draw(&format!(
        "{ROOM}[[mosaic]]\nname = \"rug\"\nposition_mm = [2000, 3000, 0]\nsize_mm = [1000, 1000, 10]\n\
         temperatures_c = [[21, 22], [23, 24]]\n"
    ));
    assert_eq!(views(&rug).1.matches(">rug</text>").count(), 1);
}

#[test]
fn the_rulers_steps_are_round_and_stand_outside_the_map() {
    let ticks = |room: &str| -> Vec<[f64; 4]> {
        let page = draw(room);
        let above = views(&page).1;
        let ticks = attributes(above, "class=\"tick\"", "d");
        let ends = |tick: &String| match corners(tick)[..] {
            [(x1, y1), (x2, y2)] => [x1, y1, x2, y2],
            _ => panic!("{tick}"),
        };
        ticks.iter().map(ends).collect()
    };
    // 4 m by 6 m: a seventh of 6 m is less than 1 m. Outwards is down at the front and left at the left.
    let mut expected = Vec::new();
    for along_m in 0..=4 {
        let (x, y) = on_map(f64::from(along_m), 0.0);
        expected.push([x, y, x, y + 5.0]);
    }
    for along_m in 0..=6 {
        let (x, y) = on_map(0.0, f64::from(along_m));
        expected.push([x, y, x - 5.0, y]);
    }
    let found = ticks(ROOM);
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().flatten().zip(expected.iter().flatten()) {
        assert!((found - expected).abs() < 0.051, "{found} {expected}");
    }
    // A seventh of 10 m is 1.43 m: every 2 m, six along 10 m and three along 4 m.
    let wide = "[room]\nsize_mm = [10000, 4000, 2500]\nambient_c = 20\n";
    assert_eq!(ticks(wide).len(), 6 + 3);
}

#[test]
fn insides_are_not_drawn_but_sheets_have_two_sides() {
    let sheet = |corners: &str| {
        format!(
            "{ROOM}[[object]]\nname = \"screen\"\nposition_mm = [2000, 3000, 500]\nshape = \"polyhedron\"\n\
             vertices_mm = [[0, 0, 0], [500, 0, 0], [500, 500, 0], [0, 500, 0]]\nfaces = [{corners}]\n"
        )
    };
    for corners in ["[0, 1, 2, 3]", "[3, 2, 1, 0]"] {
        let text = sheet(corners);
        assert!(parse(&text).is_ok());
        assert_eq!(fills(views(&draw(&text)).1).len(), 1, "{corners}");
    }
}

/// The corners of a path on the page.
fn corners(path: &str) -> Vec<(f64, f64)> {
    let numbers: Vec<f64> = path
        .split(['M', 'L', 'Z', ' '])
        .filter_map(|text| text.parse().ok())
        .collect();
    numbers
        .chunks_exact(2)
        .map(|pair| (pair[0], pair[1]))
        .collect()
}

fn area(path: &str) -> f64 {
    let corners = corners(path);
    let next = corners.iter().cycle().skip(1);
    let doubled: f64 = corners
        .iter()
        .zip(next)
        .map(|((x, y), (next_x, next_y))| x * next_y - next_x * y)
        .sum();
    0.5 * doubled.abs()
}

#[test]
fn a_room_with_a_floor_plan_is_drawn_in_its_shape() {
    let room = "[room]\nplan_mm = [[0, 0], [5000, 0], [5000, 2500], [2500, 2500], [2500, 5000], [0, 5000]]\nheight_mm = 2500\nambient_c = 20\n";
    let looks = CEILING
        .replace("[2000, 3000, 2700]", "[1250, 3250, 2500]")
        .replace("grid-eye", "grid-eye-wide");
    let page = draw(&format!("{room}{looks}"));
    let (perspective, above) = views(&page);
    // 5 m fill the narrower side of the right panel between its margins.
    let points_per_m = (448.0_f64 - 72.0) / 5.0;
    let floor = attributes(above, "class=\"wall\"", "d");
    let largest = floor.iter().map(|path| area(path)).fold(0.0, f64::max);
    assert!(
        (largest / points_per_m.powi(2) - 18.75).abs() < 0.05,
        "{floor:?}"
    );
    assert_eq!(
        corners(
            &floor
                .iter()
                .max_by(|a, b| area(a).total_cmp(&area(b)))
                .unwrap()[..]
        )
        .len(),
        6
    );
    // 90 degrees from 2.5 m: 2.5 m to each side. On the floor, all of the sensor's own arm from y = 0.75 on, 2.5 *
    // 4.25; of the other arm, up to x = 3.75, the part below the line past the corner, y = 2.5 - 0.6 (x - 2.5).
    let expected = 2.5 * 4.25 + 1.25 * (1.75 - 0.5 * 0.75);
    let seen: f64 = attributes(above, "class=\"view\"", "d")
        .iter()
        .map(|path| area(path))
        .sum();
    let seen = seen / points_per_m.powi(2);
    assert!((seen - expected).abs() < 0.03, "{seen} of {expected}");
    // Both walls that jut in face the eye, and things behind them show through; the other six are drawn.
    assert!(perspective.contains("class=\"jutting\"") && !above.contains("class=\"jutting\""));
    assert!(page.contains(".jutting{fill:#e6e6e6;fill-opacity:.6"));
    assert_eq!(
        perspective.matches("class=\"wall\"").count()
            + perspective.matches("class=\"wire\"").count(),
        6
    );
    assert!(page.contains("5000 x 5000 x 2500 mm"));
    assert_balanced(&page);
}

#[test]
fn agents_are_drawn_with_their_rotation_and_temperature_at_the_time() {
    let text = format!(
        "{ROOM}{CEILING}[[agent]]\nname = \"cart\"\ntrajectory = \"walk.csv\"\nspeed_mm_per_s = 1000\nfaces = \"way\"\n\
         [[agent.part]]\nname = \"body\"\nposition_mm = [0, 0, 0]\nsize_mm = [1000, 200, 500]\ntemperature_c = 60\ntime_constant_s = 4\n\
         [[object]]\nname = \"pot\"\nposition_mm = [3000, 1000, 0]\nsize_mm = [200, 200, 200]\ntemperature_c = 80\ntime_constant_s = 2\n"
    );
    let files = |_: &str| Ok("x_mm,y_mm,z_mm\n1000,1000,0\n2000,1000,0\n2000,5000,0\n".to_owned());
    let scene = Scene::parse(&text, "room.toml", &files).unwrap().scene;
    let page = |time_s: u64| {
        let drawing = Drawing {
            time: Duration::from_secs(time_s),
            ..Drawing::new("cart")
        };
        svg(&scene, &drawing)
    };
    let red = |page: &str| {
        let paths = attributes(views(page).1, "fill=\"#c6372f\"", "d");
        corners(&paths[0])
    };
    let extent = |corners: &[(f64, f64)]| {
        let (mut low, mut high) = ((f64::INFINITY, f64::INFINITY), (0.0_f64, 0.0_f64));
        for (x, y) in corners {
            low = (low.0.min(*x), low.1.min(*y));
            high = (high.0.max(*x), high.1.max(*y));
        }
        (high.0 - low.0, high.1 - low.1)
    };
    // Along x first, along y after the corner.
    let (first, then) = (extent(&red(&page(0))), extent(&red(&page(3))));
    let (long, short) = (POINTS_PER_M, 0.2 * POINTS_PER_M);
    assert!(
        (first.0 - long).abs() < 0.11 && (first.1 - short).abs() < 0.11,
        "{first:?}"
    );
    assert!(
        (then.0 - short).abs() < 0.11 && (then.1 - long).abs() < 0.11,
        "{then:?}"
    );
    // 20.1 + 59.9 exp(-t / 2): 80 at the start, 33.5 after 3 s.
    assert!(page(0).contains("pot, 80 °C") && page(3).contains("pot, 33.5 °C"));
}

#[test]
fn a_cooling_agent_is_labeled_with_its_temperature_at_the_time() {
    let text = format!(
        "{ROOM}{CEILING}[[agent]]\nname = \"cup\"\nposition_mm = [1000, 1000, 0]\n\
         [[agent.part]]\nname = \"body\"\nposition_mm = [0, 0, 0]\nsize_mm = [100, 100, 100]\ntemperature_c = 90.1\ntime_constant_s = 10\n"
    );
    let scene = scene(&text);
    let drawing = Drawing {
        time: Duration::from_secs(10),
        ..Drawing::new("cup")
    };
    // 20.1 + 70 / e.
    assert!(svg(&scene, &drawing).contains("cup, 45.9 °C"));
    assert!(svg(&scene, &Drawing::new("cup")).contains("cup, 90.1 °C"));
}
