//! Warm patches, structure, chi squared, and skills, against values by hand and from tables.

use grideye_validator::align::Orientation;
use grideye_validator::metrics::{
    Blob, ChiSquared, angle_between, chi_squared, overlap, structural_similarity, structure_map,
    survival, warm,
};
use grideye_validator::{Measure, Score, Shuffled};

fn frame(warm: &[(usize, usize, f64)]) -> Vec<f64> {
    let mut frame = vec![20.0; 64];
    for &(column, row, excess) in warm {
        frame[row * 8 + column] += excess;
    }
    frame
}

/// Weights 3 and 1 on columns 2 and 3, rows 4 and 5: the centroid is a quarter of the way.
#[test]
fn the_centroid_is_weighted_and_the_patch_goes_over_corners() {
    let blob = Blob::find(&frame(&[(2, 4, 3.0), (3, 5, 1.0)]), 8, 0.5).unwrap();
    assert_eq!((blob.column, blob.row, blob.pixels), (2.25, 4.25, 2));
}

#[test]
fn the_warmer_of_two_patches_counts_whatever_its_size() {
    let two = frame(&[(0, 0, 1.0), (1, 0, 1.0), (0, 1, 1.0), (7, 7, 9.0)]);
    let blob = Blob::find(&two, 8, 0.5).unwrap();
    assert_eq!((blob.column, blob.row, blob.pixels), (7.0, 7.0, 1));
    assert_eq!(warm(&two, 0.5).iter().filter(|&&warm| warm).count(), 4);
}

#[test]
fn patches_do_not_wrap_around_rows() {
    let blob = Blob::find(&frame(&[(7, 2, 2.0), (0, 3, 1.0)]), 8, 0.5).unwrap();
    assert_eq!((blob.column, blob.row, blob.pixels), (7.0, 2.0, 1));
}

#[test]
fn nothing_warm_has_no_blob() {
    assert_eq!(Blob::find(&frame(&[(1, 1, 0.5)]), 8, 0.5), None);
    assert_eq!(Blob::find(&[], 8, 0.5), None);
    assert_eq!(Blob::find(&[20.0; 9], 8, 0.5), None);
    assert_eq!(Blob::find(&[20.0; 8], 0, 0.5), None);
    assert_eq!(warm(&[20.0, f64::NAN, 90.0], 0.5), [false; 3]);
}

/// 60 degrees: 30 from the middle of the view to its edge, 60 from edge to edge.
#[test]
fn angles_are_those_of_a_planar_grid() {
    let at = |column: f64, row: f64| Blob {
        column,
        row,
        pixels: 1,
    };
    let sixty = [60.0_f64.to_radians(); 2];
    let angle = |a, b| angle_between(&a, &b, (8, 8), sixty).unwrap();
    assert!((angle(at(3.5, 3.5), at(7.5, 3.5)) - 30.0).abs() < 1e-9);
    assert!((angle(at(3.5, -0.5), at(3.5, 7.5)) - 60.0).abs() < 1e-9);
    // The centers of the outer pixels, 7/8 of the way to the edge: atan(7/8 tan 30°).
    assert!((angle(at(3.5, 3.5), at(7.0, 3.5)) - 26.80).abs() < 0.01);
    assert_eq!(angle(at(1.0, 2.0), at(1.0, 2.0)), 0.0);
    assert_eq!(at(1.0, 2.0).distance_pixels(&at(4.0, 6.0)), 5.0);
}

#[test]
fn overlap_is_intersection_over_union() {
    let (a, b) = ([true, true, false, false], [false, true, true, false]);
    assert_eq!(overlap(&a, &b), Some(1.0 / 3.0));
    assert_eq!(overlap(&a, &a), Some(1.0));
    assert_eq!(overlap(&[false; 4], &[false; 4]), None);
    assert_eq!(overlap(&a, &b[..3]), None);
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

#[test]
fn a_frame_is_like_itself_and_unlike_its_mirror() {
    let frame: Vec<f64> = (0..64_u32).map(|i| 20.0 + f64::from(i % 8)).collect();
    let mirrored: Vec<f64> = (0..64_u32).map(|i| 27.0 - f64::from(i % 8)).collect();
    let own = structural_similarity(&frame, &frame, 8, 20.0).unwrap();
    assert!((own - 1.0).abs() < 1e-12);
    assert!(structural_similarity(&frame, &mirrored, 8, 20.0).unwrap() < 0.0);
}

/// In the window of nine: mean 1/3, squares 9 - 1, so the variance is 1.
#[test]
fn one_warm_pixel_by_hand() {
    let (mut one, flat) = ([20.0; 25], [20.0; 25]);
    one[12] = 23.0;
    let map = structure_map(&one, &flat, 5, 20.0).unwrap();
    let expected = 0.01 * 0.09 / ((1.0 / 9.0 + 0.01) * (1.0 + 0.09));
    assert!((map[12] - expected).abs() < 1e-12);
    // The corner sees nothing of it.
    assert!((map[0] - 1.0).abs() < 1e-12);
    let mean = structural_similarity(&one, &flat, 5, 20.0).unwrap();
    assert!((mean - expected).abs() < 1e-12);
}

/// The map of 4 x 3 pixels is the inside of a 6 x 5 map whose outer pixels repeat their neighbors.
#[test]
fn borders_are_mirrored() {
    let x: Vec<f64> = (1..=12_u32).map(f64::from).collect();
    let y: Vec<f64> = (1..=12_u32).map(|n| f64::from(n * n % 7)).collect();
    let wider = |frame: &[f64]| -> Vec<f64> {
        let inner = |place: usize, of: usize| place.clamp(1, of) - 1;
        let source = |place: usize| 4 * inner(place / 6, 3) + inner(place % 6, 4);
        (0..30).map(|place| frame[source(place)]).collect()
    };
    let map = structure_map(&x, &y, 4, 0.0).unwrap();
    let wide = structure_map(&wider(&x), &wider(&y), 6, 0.0).unwrap();
    for (place, structure) in map.iter().enumerate() {
        let inside = wide[6 * (place / 4 + 1) + place % 4 + 1];
        assert!((structure - inside).abs() < 1e-12, "{place}: {structure}");
    }
}

#[test]
fn frames_without_a_neighborhood_have_none() {
    assert_eq!(structure_map(&[1.0; 4], &[1.0; 4], 2, 0.0), None);
    assert_eq!(structure_map(&[1.0; 10], &[1.0; 10], 3, 0.0), None);
    assert_eq!(structure_map(&[1.0; 9], &[1.0; 9], 0, 0.0), None);
    let odd = structural_similarity(&[f64::NAN; 9], &[1.0; 9], 3, 0.0);
    assert_eq!(odd, None);
}

/// Critical values from printed tables; with two degrees of freedom it is `exp(-x / 2)`.
#[test]
fn survival_is_that_of_the_tables() {
    for (value, degrees, p) in [
        (3.841_458_820_694_124, 1, 0.05),
        (18.307_038_053_275_146, 10, 0.05),
        (82.528_726_541_471_7, 63, 0.05),
        (124.342_113_404_004_08, 100, 0.05),
        (92.010_023_614_132_15, 63, 0.01),
        (45.741_376_841_650_34, 63, 0.95),
    ] {
        let found = survival(value, degrees).unwrap();
        assert!((found - p).abs() < 1e-9, "{degrees}: {found}");
    }
    for value in [0.0, 0.1, 1.0, 7.0, 40.0] {
        let expected = f64::exp(-value / 2.0);
        assert!((survival(value, 2).unwrap() - expected).abs() < 1e-14);
    }
}

/// Beyond a few thousand degrees of freedom the distribution is almost normal (Wilson and Hilferty).
#[test]
fn survival_of_many_degrees_of_freedom() {
    for degrees in [6_300_u32, 630_000, 63_000_000] {
        let n = f64::from(degrees);
        let at = |z: f64| n * (1.0 - 2.0 / (9.0 * n) + z * (2.0 / (9.0 * n)).sqrt()).powi(3);
        let beyond = |z: f64| survival(at(z), usize::try_from(degrees).unwrap()).unwrap();
        assert!((beyond(1.644_853_626_951_472_7) - 0.05).abs() < 1e-4);
        assert!((beyond(-1.0) - 0.841_344_746).abs() < 1e-4);
    }
}

#[test]
fn chi_squared_by_hand() {
    // Differences 1, -1, 2, -2 around an offset of 3, sigma 2: (1 + 1 + 4 + 4) / 4.
    let chi = chi_squared(&[24.0, 22.0, 25.0, 21.0], &[20.0; 4], 2.0).unwrap();
    assert_eq!((chi.value, chi.degrees_of_freedom), (2.5, 3));
    assert_eq!(chi.per_degree(), Some(2.5 / 3.0));
    assert_eq!(chi_squared(&[1.0], &[1.0], 1.0), None);
    for sigma_c in [0.0, -1.0, f64::NAN] {
        assert_eq!(chi_squared(&[1.0, 2.0], &[1.0, 1.0], sigma_c), None);
    }
    assert_eq!(ChiSquared::default().per_degree(), None);
    assert_eq!((survival(1.0, 0), survival(-1.0, 3)), (None, None));
    assert_eq!(survival(0.0, 3), Some(1.0));
}

#[test]
fn independent_frames_add_up() {
    let frames = [(2.5, 3), (1.5, 4)].map(|(value, degrees_of_freedom)| ChiSquared {
        value,
        degrees_of_freedom,
    });
    let all: ChiSquared = frames.into_iter().sum();
    assert_eq!((all.value, all.degrees_of_freedom), (4.0, 7));
}

fn score(measure: Measure, value: f64, blank: f64, mean: f64, p95: f64, ceiling: f64) -> Score {
    Score {
        measure,
        value: Some(value),
        blank: Some(blank),
        shuffled: Some(Shuffled { mean, p95, p: None }),
        noise: None,
        ceiling: Some(ceiling),
    }
}

#[test]
fn skill_runs_from_the_better_floor_to_the_ceiling() {
    let similarity = score(Measure::ImageSimilarity, 0.95, 0.90, 0.80, 0.85, 1.0);
    assert!((similarity.skill().unwrap() - 0.5).abs() < 1e-12);
    for (value, skill) in [(0.5, 0.8), (3.0, 0.0), (0.1, 1.0)] {
        let rmse = score(Measure::Rmse, value, 0.9, 1.1, 1.0, 0.4);
        assert_eq!(rmse.floor(), Some(0.9));
        assert!((rmse.skill().unwrap() - skill).abs() < 1e-12, "{value}");
    }
}

#[test]
fn a_ceiling_within_chance_gives_no_skill() {
    let grey = score(Measure::MutualInformationGrey, 2.62, 0.0, 2.58, 2.70, 2.66);
    assert_eq!(grey.skill(), None);
    assert!(grey.headroom().unwrap() < 0.0);
    assert_eq!(score(Measure::Bias, 0.1, 0.0, 0.0, 0.0, 0.0).skill(), None);
}

#[test]
fn images_of_noise_are_a_floor_like_the_others() {
    let mut grey = score(Measure::MutualInformationGrey, 2.62, 0.0, 2.4, 2.5, 2.9);
    assert_eq!((grey.floor(), grey.chance()), (Some(2.4), Some(2.5)));
    grey.noise = Some(2.7);
    assert_eq!((grey.floor(), grey.chance()), (Some(2.7), Some(2.7)));
    assert_eq!(grey.skill(), Some(0.0));
    let mut rmse = score(Measure::Rmse, 0.5, 0.9, 1.1, 1.0, 0.4);
    rmse.noise = Some(0.6);
    assert!((rmse.skill().unwrap() - 0.5).abs() < 1e-12);
}

#[test]
fn every_measure_has_a_name_of_its_own() {
    for (index, measure) in Measure::ALL.iter().enumerate() {
        let mut before = Measure::ALL[..index].iter();
        assert!(
            before.all(|other| other.name() != measure.name()),
            "{measure}"
        );
    }
}
