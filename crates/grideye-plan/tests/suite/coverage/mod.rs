//! Where sensors see what.

mod candidates;
mod people;
mod refusals;
mod search;
mod sight;

use grideye_plan::coverage::{Figure, Grain, Look, Survey};
use grideye_scene::{Clothing, Person, Posture, Scene};

/// A person of 1.75 m.
fn person(posture: Posture) -> Figure {
    Figure::new(Person::new(1.75, 1.0, posture, Clothing::INDOOR))
}

fn sensor(name: &str, position_mm: [f64; 3], elevation_deg: f64, azimuth_deg: f64) -> String {
    format!(
        "[[sensor]]\nname = \"{name}\"\npreset = \"grid-eye\"\nposition_mm = {position_mm:?}\nelevation_deg = {elevation_deg:?}\nazimuth_deg = {azimuth_deg:?}\n"
    )
}

fn cells_of(cell_mm: f64) -> Grain {
    Grain {
        cell_m: cell_mm / 1000.0,
        ..Grain::default()
    }
}

fn survey(scene: &Scene, cell_mm: f64) -> Survey {
    Survey::new(scene, &Figure::standing(), &cells_of(cell_mm)).unwrap()
}

fn looks(survey: &Survey, scene: &Scene) -> Vec<Look> {
    survey.look_all(scene.sensors(), 1, &|| ()).unwrap()
}
