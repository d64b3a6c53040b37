//! The scene as one self-contained SVG (PeerJ CS 11:e3124, Figures 3, 11, 12, 14, 24).
//!
//! Objects are blue and agents red unless they have a color; yellow pyramids are views, dotted lines paths, circles
//! frames. Perspective at the left, top view at the right. Faces are cut where they meet and painted from far to near.

mod camera;
mod labels;
pub mod limits;
mod options;
mod painter;
mod pieces;
mod sheet;

use camera::{Camera, Panel};
use grideye_scene::Scene;
use labels::Labels;
pub use options::Drawing;
use sheet::Sheet;

/// The scene in perspective and from above, as a self-contained SVG of 1280 x 720.
#[must_use]
pub fn svg(scene: &Scene, drawing: &Drawing<'_>) -> String {
    let mut sheet = Sheet::new(WIDTH, HEIGHT);
    let way = trajectory_text(scene, drawing);
    sheet.head(drawing.title, &summary(scene, way.as_deref()));
    let bounds_m = pieces::bounds_m(scene);
    for (title, panel, is_perspective) in [
        ("Perspective", PERSPECTIVE, true),
        ("From above", FROM_ABOVE, false),
    ] {
        let camera = if is_perspective {
            Camera::perspective(bounds_m, &panel)
        } else {
            Camera::from_above(bounds_m, &panel)
        };
        sheet.panel(title, &panel);
        draw(&mut sheet, &camera, scene, drawing, is_perspective);
    }
    sheet.legend(LEGEND_Y, way.is_some());
    sheet.finish()
}

fn draw(
    sheet: &mut Sheet,
    camera: &Camera,
    scene: &Scene,
    drawing: &Drawing<'_>,
    is_perspective: bool,
) {
    let walls = pieces::Walls::new(scene.room());
    sheet.walls_behind(camera, &walls.around);
    let all = pieces::of_scene((scene, &walls), drawing, camera, is_perspective);
    for piece in painter::far_to_near(all, camera) {
        sheet.piece(camera, &piece);
    }
    sheet.walls_before(camera, &walls.around);
    sheet.walls_before(camera, &walls.jutting);
    sheet.sensors(camera, scene.sensors());
    if is_perspective {
        sheet.axes(camera, pieces::bounds_m(scene));
    } else {
        sheet.ruler(camera, pieces::bounds_m(scene));
    }
    sheet.labels(&Labels::of(scene, drawing, camera));
}

fn summary(scene: &Scene, way: Option<&str>) -> String {
    let (low, high) = pieces::bounds_m(scene);
    let [width, depth, height] = ((high - low) * 1000.0).round().to_array();
    let mut line = format!(
        "{width} x {depth} x {height} mm, {} °C; {}, {}, {}",
        scene.room().ambient_c,
        counted(scene.objects().len(), "object"),
        counted(scene.agents().len(), "agent"),
        counted(scene.sensors().len(), "sensor"),
    );
    if let Some(way) = way {
        line.push_str("; ");
        line.push_str(way);
    }
    line
}

fn counted(count: usize, what: &str) -> String {
    match count {
        0 => format!("no {what}s"),
        1 => format!("1 {what}"),
        _ => format!("{count} {what}s"),
    }
}

fn trajectory_text(scene: &Scene, drawing: &Drawing<'_>) -> Option<String> {
    let sensor = drawing.sampled_by.or(scene.sensors().first())?;
    let every = scene
        .agents()
        .iter()
        .filter(|agent| agent.trajectory.is_some())
        .map(|agent| pieces::circle_step(agent, sensor))
        .max()?;
    let which = match every {
        1 => "a circle at every frame".to_owned(),
        2 => "a circle at every second frame".to_owned(),
        step => format!("a circle at every {step}th frame"),
    };
    Some(format!(
        "{which} of {} at {} Hz",
        sensor.name, sensor.sampling_hz
    ))
}

const WIDTH: f64 = 1280.0;
const HEIGHT: f64 = 720.0;
const LEGEND_Y: f64 = 696.0;
const PERSPECTIVE: Panel = Panel::new(24.0, 84.0, 760.0, 584.0);
const FROM_ABOVE: Panel = Panel::new(808.0, 84.0, 448.0, 584.0);
