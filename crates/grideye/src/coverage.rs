//! `grideye coverage`: how well the sensors of a room see a person at every place, and where the best places for some
//! are.

mod csv;
mod json;
mod table;

use crate::cli::{Coverage, Posture as Asked, Where};
use crate::exit::{Outcome, bad_input};
use crate::export::raster;
use crate::output::out;
use crate::{files, progress};
use anyhow::{Result, anyhow};
use grideye_scene::coverage::{
    Candidate, CoverageError, Figure, Grain, Look, Map, Mount, Mounts, Pick, Picture, Posture,
    Rule, Sketch, Survey, Wish, candidates, pick, preset,
};
use grideye_scene::perceived::{ABSOLUTE_ZERO_C, Surface};
use grideye_scene::{Scene, Sensor};
use std::path::Path;

/// All that was found.
struct Found<'a> {
    scene_name: String,
    scene: &'a Scene,
    survey: &'a Survey,
    figure: &'a Figure,
    wish: Wish,
    /// The poses that were looked from: first those that are kept, then the candidates.
    poses: &'a [Candidate],
    kept: usize,
    looks: &'a [Look],
    /// The candidates that were picked; `None` if the scene's own sensors were asked for.
    pick: Option<Pick>,
    /// The poses of the map, by their places among all.
    shown: Vec<usize>,
    /// What the shown poses do together, and what they did with each pose more, the kept ones first.
    map: Map,
    steps: Vec<Map>,
}

/// Looks from all poses, picks the best, and prints and writes what was asked for.
pub(crate) fn run(options: &Coverage) -> Result<Outcome> {
    options.out.iter().try_for_each(|out| check_name(out))?;
    check_own(options)?;
    let loaded = files::load_scene(Some(&options.scene))?;
    files::keep_apart(
        [&options.scene].into_iter().chain(&loaded.trajectories),
        options.out.iter().chain(&options.write),
    )?;
    let scene = loaded.scene;
    let figure = figure(options, &scene)?;
    let wish = Wish {
        sigma_min: options.sigma,
        sensors_min: options.sensors_min,
        rule: if options.together {
            Rule::Together
        } else {
            Rule::Alone
        },
    };
    let grain = Grain {
        cell_m: options.cell_mm / 1000.0,
        turns: options.turns,
        frames: options.frames,
    };
    let survey = Survey::new(&scene, &figure, &grain).map_err(bad_input)?;
    let kept = own_poses(options, &scene)?;
    let mut poses = kept.clone();
    if !options.candidates.is_empty() {
        let like = like(options, &scene)?;
        poses.extend(candidates(&survey, &mounts(options), &like).map_err(bad_input)?);
    }
    let looks = look(&survey, &poses, options)?;
    let found = found(
        options,
        &scene,
        &survey,
        &figure,
        wish,
        (&poses, kept.len()),
        &looks,
    )?;
    tell(options, &found)?;
    Ok(outcome(options, &found))
}

fn tell(options: &Coverage, found: &Found<'_>) -> Result<()> {
    for out in &options.out {
        write(out, found)?;
        progress::say(&format!("wrote the map to {}", out.display()));
    }
    if let Some(path) = &options.write {
        files::write_text(path, &table::tables(found))?;
        progress::say(&format!("wrote the poses to {}", path.display()));
    }
    if options.json {
        out!("{}", json::text(found))?;
    } else {
        out!("{}", table::text(found))?;
    }
    Ok(())
}

fn outcome(options: &Coverage, found: &Found<'_>) -> Outcome {
    let share = 100.0 * share(found.map.totals.detected, found.map.totals.places);
    match options.at_least {
        Some(wanted) if share < wanted => Outcome::Disagrees,
        _ => Outcome::Done,
    }
}

fn found<'a>(
    options: &Coverage,
    scene: &'a Scene,
    survey: &'a Survey,
    figure: &'a Figure,
    wish: Wish,
    (poses, kept): (&'a [Candidate], usize),
    looks: &'a [Look],
) -> Result<Found<'a>> {
    let own: Vec<usize> = (0..kept).collect();
    // Asked for or not: it is what refuses a wish that makes no sense.
    let picked = pick(survey.floor(), looks, &own, options.best, &wish).map_err(bad_input)?;
    let picked = (!options.candidates.is_empty()).then_some(picked);
    let mut shown = own;
    let steps = picked.iter().flat_map(|pick| &pick.steps);
    shown.extend(steps.map(|step| step.chosen));
    let map_of = |poses: &[usize]| {
        let looks: Vec<&Look> = poses.iter().filter_map(|pose| looks.get(*pose)).collect();
        Map::new(survey.floor(), &looks, &wish)
    };
    Ok(Found {
        scene_name: name_of(&options.scene),
        scene,
        survey,
        figure,
        wish,
        poses,
        kept,
        looks,
        pick: picked,
        map: map_of(&shown),
        steps: (1..=shown.len())
            .map(|count| map_of(&shown[..count]))
            .collect(),
        shown,
    })
}

fn look(survey: &Survey, poses: &[Candidate], options: &Coverage) -> Result<Vec<Look>> {
    let sensors: Vec<Sensor> = poses.iter().map(|pose| pose.sensor.clone()).collect();
    let cores = || std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let threads = options.threads.unwrap_or_else(cores);
    let bar = progress::bar(u64::try_from(sensors.len())?, "looking");
    let looks = survey.look_all(&sensors, threads, &|| bar.inc(1));
    bar.finish_and_clear();
    looks.map_err(|error| match error {
        CoverageError::NoCandidates => bad_input(anyhow!(
            "the scene has no sensor\nhint: add [[sensor]] tables, or try poses with --candidates all"
        )),
        other => bad_input(other),
    })
}

/// The scene's sensors that count: all, those that were named, or none beside candidates.
fn own_poses(options: &Coverage, scene: &Scene) -> Result<Vec<Candidate>> {
    if !options.candidates.is_empty() && !options.keep {
        return Ok(Vec::new());
    }
    if options.sensors.is_empty() {
        return Ok(scene.sensors().iter().map(Candidate::of_sensor).collect());
    }
    let named = options.sensors.iter().map(|name| scene.sensor(name));
    let poses = named.map(|sensor| sensor.map(Candidate::of_sensor));
    poses.collect::<Result<_, _>>().map_err(bad_input)
}

fn like(options: &Coverage, scene: &Scene) -> Result<Sensor> {
    if let Some(name) = &options.preset {
        return preset(name).map_err(|_scene_of_one_sensor| {
            bad_input(anyhow!("there is no preset `{name}`\nhint: grid-eye, grid-eye-wide or lepton; of any other sensor put one into the scene, and name it with --like"))
        });
    }
    if let Some(name) = &options.like {
        return Ok(scene.sensor(name).map_err(bad_input)?.clone());
    }
    match scene.sensors().first() {
        Some(first) => Ok(first.clone()),
        None => preset("grid-eye").map_err(bad_input),
    }
}

fn mounts(options: &Coverage) -> Mounts {
    let has =
        |one: Where| options.candidates.contains(&Where::All) || options.candidates.contains(&one);
    let all = [
        (Where::Ceiling, Mount::Ceiling),
        (Where::Walls, Mount::Wall),
        (Where::Corners, Mount::Corner),
    ];
    Mounts {
        mounts: all
            .iter()
            .filter(|(one, _)| has(*one))
            .map(|(_, mount)| *mount)
            .collect(),
        spacing_m: options.spacing_mm / 1000.0,
        ceiling_tilts_deg: options.tilts_deg.clone(),
        ceiling_headings: options.headings,
        wall_heights_m: options
            .heights_mm
            .iter()
            .map(|height| height / 1000.0)
            .collect(),
        wall_downs_deg: options.downs_deg.clone(),
        wall_headings_deg: options.wall_headings_deg.clone(),
    }
}

fn figure(options: &Coverage, scene: &Scene) -> Result<Figure> {
    if let Some(name) = &options.agent {
        let agent = scene.agents().iter().find(|agent| agent.name == *name);
        return agent.map(Figure::of_agent).ok_or_else(|| {
            let known: Vec<&str> = scene
                .agents()
                .iter()
                .map(|agent| agent.name.as_str())
                .collect();
            bad_input(anyhow!(
                "no agent `{name}` in this scene\nhint: it has {}",
                if known.is_empty() {
                    "none".to_owned()
                } else {
                    known.join(", ")
                }
            ))
        });
    }
    let [depth, width, height] = options.person_mm.as_slice() else {
        return Err(bad_input(anyhow!(
            "--person-mm has {} lengths, expected 3\nhint: depth, width and height, as in --person-mm 200,500,1750",
            options.person_mm.len()
        )));
    };
    let size_m = glam_size([*depth, *width, *height])?;
    let celsius = options.person_c;
    if !(celsius.is_finite() && celsius > ABSOLUTE_ZERO_C && celsius <= 1000.0) {
        return Err(bad_input(anyhow!(
            "--person-c is {celsius}, expected degrees Celsius up to 1000\nhint: 28 is clothed, 34 is skin"
        )));
    }
    let posture = match options.posture {
        Asked::Standing => Posture::Standing,
        Asked::Sitting => Posture::Sitting,
        Asked::Lying => Posture::Lying,
    };
    let surface = Surface {
        celsius,
        emissivity: 0.8,
    };
    Ok(Figure::new(posture, size_m.into(), surface))
}

/// A size in metres that a person may have.
fn glam_size(size_mm: [f64; 3]) -> Result<[f64; 3]> {
    for length_mm in size_mm {
        if !(10.0..=10_000.0).contains(&length_mm) {
            return Err(bad_input(anyhow!(
                "a length of --person-mm is {length_mm}, expected 10 to 10000 mm\nhint: depth, width and height, as in --person-mm 200,500,1750"
            )));
        }
    }
    Ok(size_mm.map(|length_mm| length_mm / 1000.0))
}

/// Beside candidates the scene's own sensors count only if they stay.
fn check_own(options: &Coverage) -> Result<()> {
    if options.sensors.is_empty() || options.candidates.is_empty() || options.keep {
        return Ok(());
    }
    Err(bad_input(anyhow!(
        "--sensors names sensors of the scene, and beside --candidates none of them counts\nhint: add --keep to pick poses beside those, or leave --sensors out"
    )))
}

fn check_name(out: &Path) -> Result<()> {
    match extension(out) {
        Some("svg" | "png" | "csv") => Ok(()),
        _ => Err(bad_input(anyhow!(
            "cannot tell what to write from the name {}\nhint: end it with .svg, .png or .csv",
            out.display()
        ))),
    }
}

fn write(out: &Path, found: &Found<'_>) -> Result<()> {
    match extension(out) {
        Some("csv") => files::write_whole(out, |file| csv::write(found, file)),
        Some("png") => files::write_whole(out, |file| raster::write(&sketch(found), file)),
        _ => files::write_text(out, &sketch(found).svg()),
    }
}

fn sketch(found: &Found<'_>) -> Sketch {
    let sensors: Vec<(String, &Sensor)> = found
        .shown
        .iter()
        .enumerate()
        .map(|(index, pose)| {
            (
                found.shown_name(index).unwrap_or_default(),
                &found.poses[*pose].sensor,
            )
        })
        .collect();
    Picture {
        title: &format!("{}: coverage", found.scene_name),
        summary: &table::summary_of_picture(found),
        scene: found.scene,
        floor: found.survey.floor(),
        map: &found.map,
        wish: &found.wish,
        sensors: &sensors,
    }
    .sketch()
}

fn extension(path: &Path) -> Option<&str> {
    path.extension().and_then(|extension| extension.to_str())
}

fn name_of(scene: &Path) -> String {
    scene
        .file_stem()
        .map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}

/// A part of a count, 0 of nothing.
#[expect(
    clippy::as_conversions,
    clippy::cast_precision_loss,
    reason = "a floor has far fewer cells than 2^52"
)]
fn share(part: usize, whole: usize) -> f64 {
    part as f64 / whole.max(1) as f64
}
