use super::*;

/// What looks like each orientation, half of it as far as it goes.
fn found(upright: f64, half: f64, most: f64) -> Option<OrientationFound> {
    best_orientation(
        |orientation| match orientation {
            Orientation::Upright => upright,
            Orientation::Half => half,
            _ => 0.0,
        },
        Orientation::is_mirrored,
        most,
    )
}

#[test]
fn another_orientation_has_to_be_better_by_a_margin_and_to_resemble_the_scene_at_all() {
    let expect = |(upright, half): (f64, f64), orientation, likeness| {
        let found = found(upright, half, 1.0).unwrap();
        assert_eq!((found.orientation, found.likeness), (orientation, likeness));
        assert_eq!((found.upright, found.applied), (upright, false));
    };
    expect((0.5, 0.7), Orientation::Half, 0.7);
    expect((0.5, 0.55), Orientation::Upright, 0.5);
    expect((0.0, 0.25), Orientation::Upright, 0.0);
    expect((0.8, 0.7), Orientation::Upright, 0.8);
    // Shares of the most that can be.
    let shares = found(0.5, 1.0, 2.0).unwrap();
    assert_eq!((shares.upright, shares.likeness), (0.25, 0.5));
}

#[test]
fn what_looks_like_the_scene_itself_is_no_other_orientation() {
    assert_eq!(best_orientation(|_| 0.9, |_| true, 1.0), None);
    let found = best_orientation(
        |orientation| if orientation.is_mirrored() { 0.9 } else { 0.1 },
        Orientation::is_mirrored,
        1.0,
    );
    assert_eq!(found.unwrap().orientation, Orientation::Upright);
}

#[test]
fn bounds_are_searched_further_than_they_reach_and_hold_back_what_is_beyond() {
    let bounds = Bounds {
        origin_s: 3.0,
        shift_max_s: 0.5,
        rate_max: 0.1,
    };
    let wider = bounds.wider();
    assert_eq!((wider.origin_s, wider.shift_max_s), (3.0, 0.8));
    assert!((wider.rate_max - 0.16).abs() < 1e-12);
    let line = |shift_s, rate| Line {
        shift_s,
        rate,
        origin_s: 3.0,
    };
    assert_eq!(bounds.excess_s(&line(-0.75, 0.0)), 0.25);
    assert_eq!(bounds.excess_s(&line(0.25, 0.0)), -0.25);
    assert!((bounds.rate_excess(&line(0.0, -0.15)) - 0.05).abs() < 1e-12);
    // Both ends at more than 98 % of the half second.
    let law = |begins_late_s, ends_late_s| Law {
        begins_late_s,
        ends_late_s,
        ease: 0.0,
        lean: 0.0,
        scene_s: (0.0, 10.0),
    };
    assert!(bounds.holds_back(&law(-0.5, 0.495)));
    assert!(!bounds.holds_back(&law(-0.5, 0.48)));
    assert!(!bounds.holds_back(&law(0.3, 0.5)));
    let none = Bounds {
        shift_max_s: 0.0,
        ..bounds
    };
    assert!(!none.holds_back(&law(0.1, 0.1)));
}
