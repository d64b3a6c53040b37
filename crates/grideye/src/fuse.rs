//! `grideye fuse`: the sensors of a scene as one of more pixels, and how near each way of it comes to the truth.

use crate::cli::Fuse;
use crate::exit::{Outcome, bad_input};
use crate::output::{answer, outln};
use crate::{export, files};
use anyhow::Result;
use grideye_plan::fusion::{Comparison, SensorArray};
use grideye_scene::Image;

pub(crate) fn run(options: &Fuse) -> Result<Outcome> {
    let loaded = files::load_scene(&options.scene)?;
    files::keep_apart(&loaded.files, options.out.iter().chain(&options.json))?;
    let scene = loaded.scene;
    let sensors = files::sensors(&scene, &options.sensors)?;
    let array = SensorArray::new(&sensors).map_err(bad_input)?;
    let found = Comparison::new(&scene, &sensors, array, options.frames, options.seed)
        .map_err(bad_input)?;
    answer(options.json.as_ref(), || found.json(), || found.text())?;
    if let Some(out) = &options.out {
        let (names, pictures): (Vec<&str>, Vec<&Image>) = found.images().unzip();
        export::write_tiles(&pictures, out)?;
        let names = names.join(", ");
        outln!("pictures of {}, from the left: {names}", out.display())?;
    }
    Ok(Outcome::Done)
}
