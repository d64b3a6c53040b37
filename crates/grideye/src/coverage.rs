//! `grideye coverage`: how well the sensors of a room see a person at every place, and where the best places for some
//! are.

use crate::cli::{Coverage, Posture as Asked, Where};
use crate::exit::{Outcome, bad_input};
use crate::output::out;
use crate::{files, progress};
use anyhow::{Result, anyhow};
use grideye_plan::coverage::{
    Candidate, CoverageError, Figure, Grain, Look, Mount, Mounts, Posture, Report, Rule, Survey,
    Wish, candidates, preset,
};
use grideye_scene::perceived::{ABSOLUTE_ZERO_C, Surface};
use grideye_scene::{Scene, Sensor};
use std::path::Path;

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
    let found = Report::new(
        (name_of(&options.scene), &scene),
        (&survey, &figure),
        wish,
        (&poses, kept.len()),
        &looks,
        (!options.candidates.is_empty()).then_some(options.best),
    )
    .map_err(bad_input)?;
    tell(options, &found)?;
    Ok(outcome(options, &found))
}

fn tell(options: &Coverage, found: &Report<'_>) -> Result<()> {
    for out in &options.out {
        write(out, found)?;
        progress::say(&format!("wrote the map to {}", out.display()));
    }
    if let Some(path) = &options.write {
        files::write_text(path, &found.tables())?;
        progress::say(&format!("wrote the poses to {}", path.display()));
    }
    if options.json {
        out!("{}", found.json())?;
    } else {
        out!("{}", found.text())?;
    }
    Ok(())
}

fn outcome(options: &Coverage, found: &Report<'_>) -> Outcome {
    let share = 100.0 * found.detected_share();
    match options.at_least {
        Some(wanted) if share < wanted => Outcome::Disagrees,
        _ => Outcome::Done,
    }
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

fn write(out: &Path, found: &Report<'_>) -> Result<()> {
    match extension(out) {
        Some("csv") => files::write_whole(out, |file| Ok(found.csv(file)?)),
        Some("png") => files::write_whole(out, |file| Ok(found.sketch().png(file)?)),
        _ => files::write_text(out, &found.sketch().svg()),
    }
}

fn extension(path: &Path) -> Option<&str> {
    path.extension().and_then(|extension| extension.to_str())
}

fn name_of(scene: &Path) -> String {
    scene
        .file_stem()
        .map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}
