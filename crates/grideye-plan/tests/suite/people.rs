//! People from above and in drawings, and the picture of them in `scenes/PEOPLE.md`.

use crate::scene;
use grideye_draw::palette::{INFERNO, color, hex};
use grideye_plan::drawing::{Drawing, svg};
use grideye_scene::{Scene, Simulator};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;
use std::time::Duration;

const ROOM: &str = "model = \"physical\"\n[room]\nsize_mm = [4000, 3400, 2500]\nambient_c = 20\n[[sensor]]\nname = \"ceiling\"\npreset = \"grid-eye\"\nposition_mm = [2000, 1700, 2500]\nelevation_deg = 90\nazimuth_deg = -90\n";

fn person_at(x_mm: f64, keys: &str) -> Scene {
    scene(&format!(
        "{ROOM}[[agent]]\nname = \"p\"\nposition_mm = [{x_mm:?}, 1700, 0]\nperson = {{}}\n{keys}"
    ))
}

#[test]
fn the_front_turns_with_the_way() {
    let files = |_: &str| Ok("x_mm,y_mm,z_mm\n500,1000,0\n2500,1000,0\n2500,3000,0\n".to_owned());
    for keys in [
        "person = {}",
        "size_mm = [200, 500, 1700]\ntemperature_c = 28\nfaces = \"way\"",
    ] {
        let text = format!(
            "{ROOM}[[agent]]\nname = \"p\"\ntrajectory = \"way.csv\"\nspeed_mm_per_s = 1000\n{keys}\n"
        );
        let scene = Scene::parse(&text, "room.toml", &files).unwrap().scene;
        let front = |seconds: u64| scene.agents()[0].front_rad(Duration::from_secs(seconds));
        assert!(front(1).abs() < 1e-9, "{keys}: {}", front(1));
        assert!(
            (front(3).to_degrees() - 90.0).abs() < 1e-9,
            "{keys}: {}",
            front(3)
        );
    }
}

/// Two silhouettes for each of the 18 segments, one in each view; a few are cut where they meet.
#[test]
fn a_drawing_shows_every_segment_once_in_each_view() {
    let page = svg(
        &person_at(1000.0, "color = \"#ff0000\""),
        &Drawing::new("p"),
    );
    let is_red = |line: &&str| line.contains("0000\" stroke=\"#");
    let drawn = page.lines().filter(is_red).count();
    assert!((36..60).contains(&drawn), "{drawn}");
}

/// The left half of the picture is the drawing of `scenes/people.toml` without its sensor; the right half, frames of one person in it.
fn picture() -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let files = |name: &str| std::fs::read_to_string(folder.join(name));
    let text = files("people.toml").unwrap();
    let people = Scene::parse(&text, "people.toml", &files).unwrap().scene;
    let people = people.with_sensors(Vec::new());
    let drawing = Drawing {
        time: Duration::from_millis(1500),
        ..Drawing::new("people.toml")
    };
    let page = svg(&people, &drawing);
    let (perspective, _) = page.split_at(page.find("From above").unwrap());
    // Without the frame of the second view.
    let mut picture = perspective[..perspective.rfind("<rect").unwrap()].to_owned();
    for (row, clothing) in ["indoor", "coat"].into_iter().enumerate() {
        for (column, away_mm) in [0.0, 600.0, 1200.0].into_iter().enumerate() {
            let text = format!(
                "{ROOM}[[agent]]\nname = \"p\"\nposition_mm = [{:?}, 1700, 0]\nperson = {{ posture = \"walk\", clothing = \"{clothing}\" }}\n",
                2000.0 + away_mm
            );
            let image = Simulator::new(&crate::scene(&text), "ceiling").unwrap();
            let celsius = image.image(Duration::ZERO).celsius;
            let corner = (812 + 152 * column, 120 + 250 * row);
            let peak = celsius.iter().copied().fold(0.0, f64::max) - 20.0;
            let _ = writeln!(
                picture,
                "<text x=\"{}\" y=\"{}\">{clothing}, {} m: +{peak:.1} °C</text>",
                corner.0,
                corner.1 - 8,
                away_mm / 1000.0
            );
            // One path for each color, in steps of 0.25 °C.
            let mut cells: BTreeMap<u32, String> = BTreeMap::new();
            for (pixel, celsius) in celsius.iter().enumerate() {
                let step = ((celsius - 20.0) * 4.0).round() as u32;
                let (x, y) = (corner.0 + 18 * (pixel % 8), corner.1 + 18 * (pixel / 8));
                let _ = write!(cells.entry(step).or_default(), "M{x} {y}h18v18h-18z");
            }
            for (step, cells) in cells {
                let fill = hex(color(&INFERNO, f64::from(step) / 20.0));
                let _ = writeln!(picture, "<path fill=\"{fill}\" d=\"{cells}\"/>");
            }
        }
    }
    picture + "</svg>\n"
}

/// `GRIDEYE_WRITE_PICTURE=1 cargo test -p grideye-plan --test suite picture` draws it again.
#[test]
fn the_picture_in_the_documents_is_what_the_code_draws() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/people.svg");
    let drawn = picture();
    if std::env::var_os("GRIDEYE_WRITE_PICTURE").is_some() {
        std::fs::write(&path, &drawn).unwrap();
    }
    assert!(drawn.len() < 40_000, "{} bytes", drawn.len());
    assert!(
        std::fs::read_to_string(path).unwrap() == drawn,
        "draw it again"
    );
}
