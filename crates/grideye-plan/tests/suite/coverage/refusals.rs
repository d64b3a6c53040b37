//! Invalid values are refused by name.

use super::{cells_of, survey};
use crate::{ROOM, scene};
use grideye_plan::coverage::{
    CoverageError, Figure, Grain, Mount, Mounts, Rule, Survey, Wish, candidates, limits, preset,
    search,
};
use grideye_scene::{Clothing, Person, Posture};

/// An error names the mistake and what to do.
fn assert_said(error: &CoverageError, words: &str) {
    let found = error.to_string();
    assert!(found.contains(words) && found.contains("hint: "), "{found}");
}

#[test]
fn invalid_floors_are_refused_by_name() {
    let empty = scene(ROOM);
    let figure = Figure::standing();
    let turns = |turns: usize| Grain {
        turns,
        ..Grain::default()
    };
    let no_frames = Grain {
        frames: 0,
        ..Grain::default()
    };
    for (grain, words) in [
        (cells_of(f64::NAN), "the length of a cell"),
        (cells_of(0.0), "1 mm or more"),
        (cells_of(10.0), "240000 cells of the floor"),
        (turns(0), "1 to 36"),
        (turns(limits::TURNS_MAX + 1), "1 to 36"),
        (no_frames, "the number of frames"),
    ] {
        assert_said(&Survey::new(&empty, &figure, &grain).unwrap_err(), words);
    }
    let giant = Person::new(2.8, 1.0, Posture::Stand, Clothing::INDOOR);
    let giant = Figure::new(giant);
    let error = Survey::new(&empty, &giant, &Grain::default()).unwrap_err();
    assert_said(&error, "there is no place for a person");
}

#[test]
fn too_many_poses_are_refused() {
    let survey = survey(&scene(ROOM), 100.0);
    let like = preset("grid-eye").unwrap();
    let none = survey.look_all(&[], 1, &|| ());
    assert!(matches!(none, Err(CoverageError::NoCandidates)));
    let many = |count: usize| {
        let error = survey.look_all(&vec![like.clone(); count], 1, &|| ());
        error.unwrap_err().to_string()
    };
    // 2,400 cells.
    let found = many(limits::PAIRS_MAX / 2_400 + 1);
    assert!(
        found.contains("8334 poses times 2400 cells are 20001600 pairs"),
        "{found}"
    );
    let found = many(limits::CANDIDATES_MAX + 1);
    assert!(found.contains("20001 candidate poses"), "{found}");
    for threads in [0, limits::THREADS_MAX + 1] {
        let found = survey.look_all(std::slice::from_ref(&like), threads, &|| ());
        assert_said(&found.unwrap_err(), "1 to 256");
    }
    let mut quiet = like;
    quiet.noise_sigma = 0.0;
    assert_said(&survey.look(&quiet).unwrap_err(), "no noise");
    assert!(preset("grid-ear").is_err());
}

#[test]
fn invalid_mounts_are_refused_by_name() {
    let survey = survey(&scene(ROOM), 500.0);
    let like = preset("grid-eye").unwrap();
    let changed = |change: &dyn Fn(&mut Mounts)| {
        let mut mounts = Mounts::default();
        change(&mut mounts);
        mounts
    };
    for (mounts, words) in [
        (
            changed(&|mounts| mounts.mounts.clear()),
            "no candidate pose",
        ),
        (
            changed(&|mounts| mounts.spacing_m = 0.01),
            "expected at most 20000",
        ),
        (
            changed(&|mounts| mounts.spacing_m = -1.0),
            "the spacing of the poses",
        ),
        (
            changed(&|mounts| mounts.ceiling_tilts_deg = vec![91.0]),
            "a tilt is 91°",
        ),
        (
            changed(&|mounts| mounts.wall_downs_deg = vec![-1.0]),
            "an angle below horizontal",
        ),
        (
            changed(&|mounts| mounts.wall_headings_deg = vec![f64::NAN]),
            "a heading on a wall",
        ),
        (
            changed(&|mounts| mounts.wall_heights_m = vec![0.0]),
            "a height on a wall",
        ),
        (
            changed(&|mounts| mounts.ceiling_headings = 0),
            "the number of headings",
        ),
        (
            changed(&|mounts| {
                (mounts.mounts, mounts.wall_heights_m) = (vec![Mount::Wall], vec![2.9]);
            }),
            "no candidate pose",
        ),
    ] {
        assert_said(&candidates(&survey, &mounts, &like).unwrap_err(), words);
    }
}

#[test]
fn invalid_wishes_are_refused_by_name() {
    let survey = survey(&scene(ROOM), 500.0);
    let mounts = Mounts::default();
    let poses = candidates(&survey, &mounts, &preset("grid-eye").unwrap()).unwrap();
    let wish = |sigma_min: f64, sensors_min: usize, rule: Rule| Wish {
        sigma_min,
        sensors_min,
        rule,
    };
    for (count, wish, words) in [
        (0, Wish::default(), "1 to 100"),
        (limits::PICKED_MAX + 1, Wish::default(), "1 to 100"),
        (1, wish(3.0, 0, Rule::Alone), "at each place"),
        (1, wish(0.0, 1, Rule::Alone), "above 0"),
        (1, wish(f64::NAN, 1, Rule::Alone), "above 0"),
        (1, wish(3.0, 2, Rule::Together), "detect together"),
    ] {
        let wanted = (count, &wish);
        let error = search(&survey, (&poses, &mounts), &[], wanted, 1, &|_, _| ());
        assert_said(&error.unwrap_err(), words);
    }
}
