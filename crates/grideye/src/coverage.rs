//! `grideye coverage`: how well a room's sensors see a person at every place, and the best places for sensors.

use crate::cli::Coverage;
use crate::exit::{Outcome, bad_input};
use crate::output::out;
use crate::{files, progress};
use anyhow::{Result, anyhow};
use grideye_plan::coverage::{
    Candidate, Choice, CoverageError, Figure, Grain, Look, Mount, Mounts, Report, Rule, Survey,
    Wish, candidates, preset, search,
};
use grideye_scene::{Person, Scene, Sensor};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::time::Duration;

pub(crate) fn run(options: &Coverage) -> Result<Outcome> {
    let is_known = |out: &PathBuf| ["svg", "csv"].map(Some).contains(&files::end(out));
    if let Some(out) = options.out.iter().find(|out| !is_known(out)) {
        return Err(files::unknown_end(out, ".svg or .csv"));
    }
    check_own(options)?;
    let loaded = files::load_scene(&options.scene)?;
    files::keep_apart(&loaded.files, options.out.iter().chain(&options.write))?;
    let scene = loaded.scene;
    let figure = figure(options, &scene)?;
    let wish = Wish {
        sigma_min: options.sigma,
        sensors_min: options.sensors_min,
        rule: match options.together {
            true => Rule::Together,
            false => Rule::Alone,
        },
    };
    let grain = Grain {
        cell_m: options.cell_mm / 1000.0,
        turns: options.turns,
        frames: options.frames,
    };
    let survey = Survey::new(&scene, &figure, &grain).map_err(bad_input)?;
    let kept = own_poses(options, &scene)?;
    let looks = look(&survey, &kept, options)?;
    let choice = choose(&survey, &looks, &wish, options, &scene)?;
    let found = Report::new(
        (files::stem(&options.scene), &scene),
        (&survey, &figure),
        wish,
        (&kept, &looks),
        choice.as_ref(),
    )
    .map_err(bad_input)?;
    for out in &options.out {
        write(out, &found)?;
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
    let share = 100.0 * found.detected_share();
    Ok(match options.at_least {
        Some(wanted) if share < wanted => Outcome::Disagrees,
        _ => Outcome::Done,
    })
}

fn look(survey: &Survey, kept: &[Candidate], options: &Coverage) -> Result<Vec<Look>> {
    if kept.is_empty() && !options.candidates.is_empty() {
        return Ok(Vec::new());
    }
    let sensors: Vec<Sensor> = kept.iter().map(|pose| pose.sensor.clone()).collect();
    let bar = progress::bar(u64::try_from(sensors.len())?, "looking");
    let looks = survey.look_all(&sensors, threads(options), &|| bar.inc(1));
    bar.finish_and_clear();
    looks.map_err(|error| match error {
        CoverageError::NoCandidates => bad_input(anyhow!(
            "the scene has no sensor\nhint: add [[sensor]] tables, or try poses with --candidates all"
        )),
        other => bad_input(other),
    })
}

fn choose(
    survey: &Survey,
    kept: &[Look],
    wish: &Wish,
    options: &Coverage,
    scene: &Scene,
) -> Result<Option<Choice>> {
    if options.candidates.is_empty() {
        return Ok(None);
    }
    let mounts = mounts(options);
    let poses = candidates(survey, &mounts, &like(options, scene)?).map_err(bad_input)?;
    let bar = progress::bar(1, "searching");
    bar.enable_steady_tick(TICK);
    let show = |done: usize, whole: usize| {
        let [done, whole] = [done, whole].map(|steps| u64::try_from(steps).unwrap_or(u64::MAX));
        bar.set_length(whole);
        bar.set_position(done);
    };
    let wanted = (options.best, wish);
    let choice = search(
        survey,
        (&poses, &mounts),
        kept,
        wanted,
        threads(options),
        &show,
    );
    bar.finish_and_clear();
    Ok(Some(choice.map_err(bad_input)?))
}

fn threads(options: &Coverage) -> usize {
    options.threads.unwrap_or_else(progress::cores)
}

/// The scene's sensors that count: all, the named ones, or none besides candidates.
fn own_poses(options: &Coverage, scene: &Scene) -> Result<Vec<Candidate>> {
    if !options.candidates.is_empty() && !options.keep {
        return Ok(Vec::new());
    }
    let named = files::sensors(scene, &options.sensors)?;
    Ok(named.into_iter().map(Candidate::of_sensor).collect())
}

fn like(options: &Coverage, scene: &Scene) -> Result<Sensor> {
    if let Some(name) = &options.poses.preset {
        return preset(name).map_err(|_scene_of_one_sensor| {
            bad_input(anyhow!("there is no preset `{name}`\nhint: grid-eye, grid-eye-wide or lepton; of any other sensor put one into the scene, and name it with --like"))
        });
    }
    if let Some(name) = &options.poses.like {
        return Ok(scene.sensor(name).map_err(bad_input)?.clone());
    }
    match scene.sensors().first() {
        Some(first) => Ok(first.clone()),
        None => preset("grid-eye").map_err(bad_input),
    }
}

fn mounts(options: &Coverage) -> Mounts {
    let all = [Mount::Ceiling, Mount::Wall, Mount::Corner].into_iter();
    let asked = |mount: &Mount| {
        options.candidates.contains(&None) || options.candidates.contains(&Some(*mount))
    };
    let poses = &options.poses;
    let meters = |height: &f64| height / 1000.0;
    Mounts {
        mounts: all.filter(asked).collect(),
        spacing_m: poses.spacing_mm / 1000.0,
        ceiling_tilts_deg: poses.tilts_deg.clone(),
        ceiling_headings: poses.headings,
        wall_heights_m: poses.heights_mm.iter().map(meters).collect(),
        wall_downs_deg: poses.downs_deg.clone(),
        wall_headings_deg: poses.wall_headings_deg.clone(),
    }
}

fn figure(options: &Coverage, scene: &Scene) -> Result<Figure> {
    if let Some(name) = &options.agent {
        let agent = scene.agents().iter().find(|agent| agent.name == *name);
        return agent.map(Figure::of_agent).ok_or_else(|| {
            let known = scene.agents().iter().map(|agent| agent.name.as_str());
            let known = match known.collect::<Vec<_>>().join(", ") {
                none if none.is_empty() => "none".to_owned(),
                known => known,
            };
            bad_input(anyhow!(
                "no agent `{name}` in this scene\nhint: it has {known}"
            ))
        });
    }
    let height_mm = options.person_height_mm;
    if !HEIGHTS_MM.contains(&height_mm) {
        return Err(bad_input(anyhow!(
            "--person-height-mm is {height_mm}, expected 500 to 2800 mm\nhint: a person's height when standing, as height_mm in a scene"
        )));
    }
    let height_m = height_mm / 1000.0;
    Ok(Figure::new(Person::new(
        height_m,
        options.build,
        options.posture,
        options.clothing,
    )))
}

/// How often the estimate of the time left is drawn.
const TICK: Duration = Duration::from_millis(250);

/// As a scene's `height_mm`.
const HEIGHTS_MM: RangeInclusive<f64> = 500.0..=2800.0;

/// With candidates, the scene's own sensors count only with `--keep`.
fn check_own(options: &Coverage) -> Result<()> {
    if options.sensors.is_empty() || options.candidates.is_empty() || options.keep {
        return Ok(());
    }
    Err(bad_input(anyhow!(
        "--sensors names sensors of the scene, and beside --candidates none of them counts\nhint: add --keep to pick poses beside those, or leave --sensors out"
    )))
}

fn write(out: &Path, found: &Report<'_>) -> Result<()> {
    match files::end(out) {
        Some("csv") => files::write_whole(out, |file| Ok(found.csv(file)?)),
        _ => files::write_text(out, &found.svg()),
    }
}
