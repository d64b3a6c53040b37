//! Warm patches, orientations and skills, against values by hand.

use grideye_validator::align::Orientation;
use grideye_validator::metrics::Blob;
use grideye_validator::{Measure, Score, Shuffled};

fn frame(warm: &[(usize, usize, f64)]) -> [f64; 64] {
    let mut frame = [20.0; 64];
    for &(column, row, excess) in warm {
        frame[row * 8 + column] += excess;
    }
    frame
}

/// Weights 3 and 1 on columns 2 and 3, rows 4 and 5: the centroid is a quarter of the way.
#[test]
fn the_centroid_is_weighted_and_the_patch_goes_over_corners() {
    let blob = Blob::find(&frame(&[(2, 4, 3.0), (3, 5, 1.0)]), 0.5).unwrap();
    assert_eq!((blob.column, blob.row, blob.pixels), (2.25, 4.25, 2));
}

#[test]
fn the_warmer_of_two_patches_counts_whatever_its_size() {
    let two = frame(&[(0, 0, 1.0), (1, 0, 1.0), (0, 1, 1.0), (7, 7, 9.0)]);
    let blob = Blob::find(&two, 0.5).unwrap();
    assert_eq!((blob.column, blob.row, blob.pixels), (7.0, 7.0, 1));
}

#[test]
fn patches_do_not_wrap_around_rows() {
    let blob = Blob::find(&frame(&[(7, 2, 2.0), (0, 3, 1.0)]), 0.5).unwrap();
    assert_eq!((blob.column, blob.row, blob.pixels), (7.0, 2.0, 1));
}

#[test]
fn nothing_warm_has_no_blob() {
    assert_eq!(Blob::find(&frame(&[(1, 1, 0.5)]), 0.5), None);
    assert_eq!(
        Blob::find(&frame(&[(1, 1, 90.0), (5, 5, f64::NAN)]), 0.5),
        None
    );
}

#[test]
fn centroids_are_as_far_apart_as_by_pythagoras() {
    let [one, other] = [(1.0, 2.0), (4.0, 6.0)].map(|(column, row)| Blob {
        column,
        row,
        pixels: 1,
    });
    assert_eq!(one.distance_pixels(&other), 5.0);
}

/// Top left 1, top right 2, bottom left 3, bottom right 4, checked on a sheet of paper.
#[test]
fn orientations_turn_like_a_sheet_of_paper() {
    let mut sheet = [0.0; 64];
    (sheet[0], sheet[7], sheet[56], sheet[63]) = (1.0, 2.0, 3.0, 4.0);
    let corners = [
        1234.0, 3142.0, 4321.0, 2413.0, 2143.0, 3412.0, 1324.0, 4231.0,
    ];
    for (orientation, expected) in Orientation::ALL.into_iter().zip(corners) {
        let seen = orientation.apply(&sheet);
        let corners = [seen[0], seen[7], seen[56], seen[63]];
        let found = corners.iter().fold(0.0, |all, corner| 10.0 * all + corner);
        assert_eq!(found, expected, "{orientation}");
        assert_eq!(orientation.inverse().apply(&seen), sheet, "{orientation}");
        if orientation.is_mirrored() {
            assert_eq!(orientation.apply(&seen), sheet, "{orientation}");
        }
    }
}

fn score(measure: Measure, value: f64, blank: f64, mean: f64, p95: f64, ceiling: f64) -> Score {
    Score {
        measure,
        value: Some(value),
        blank: Some(blank),
        shuffled: Some(Shuffled { mean, p95 }),
        ceiling: Some(ceiling),
    }
}

#[test]
fn skill_runs_from_the_better_floor_to_the_ceiling() {
    let similarity = score(Measure::ImageSimilarity, 0.95, 0.90, 0.80, 0.85, 1.0);
    assert!((similarity.skill().unwrap() - 0.5).abs() < 1e-12);
    for (value, skill) in [(0.5, 0.8), (3.0, 0.0), (0.1, 1.0)] {
        let rmse = score(Measure::Rmse, value, 0.9, 1.1, 1.0, 0.4);
        assert!((rmse.skill().unwrap() - skill).abs() < 1e-12, "{value}");
    }
}

#[test]
fn a_ceiling_within_chance_gives_no_skill() {
    let grey = score(Measure::MutualInformation, 2.62, 0.0, 2.58, 2.70, 2.66);
    assert_eq!(grey.skill(), None);
    assert_eq!(score(Measure::Bias, 0.1, 0.0, 0.0, 0.0, 0.0).skill(), None);
}

/// Names in files, which stay, and what other bins than the paper's are called.
#[test]
fn every_measure_has_a_name_of_its_own() {
    let names = Measure::ALL.map(Measure::name);
    assert_eq!(
        names,
        [
            "correlation",
            "entropy_real_grey",
            "entropy_simulated_grey",
            "joint_entropy_grey",
            "mutual_information_grey",
            "image_similarity",
            "rmse",
            "bias",
            "centroid_error_pixels",
        ]
    );
}
