//! The best law of pace: when the walk begins and ends, and how speed is spread over it.

use crate::align::bounds::Bounds;
use crate::align::clock::Law;
use crate::align::film::{Film, Fit, Sample};
use crate::numbers::count;

/// The best law: begin and end are no further from the scene's than the bounds allow a shift to be.
pub(crate) fn best_law(sample: &Sample, film: &Film, bounds: &Bounds) -> (Law, Fit) {
    const STEPS: usize = 3;
    const SHAPES: [(f64, f64); 7] = [
        (0.0, 0.0),
        (0.5, 0.0),
        (1.0, 0.0),
        (-0.5, 0.0),
        (-1.0, 0.0),
        (0.0, 0.4),
        (0.0, -0.4),
    ];
    let law = |begin: f64, end: f64, (ease, lean): (f64, f64)| Law {
        begins_late_s: begin,
        ends_late_s: end,
        ease,
        lean,
        scene_s: (film.first_s(), film.last_s()),
    };
    let coarse = sample.thinned(128);
    let likeness = |law: &Law| coarse.fit(film, |time_s| law.scene_s(time_s)).likeness;
    let late = |index: usize| bounds.shift_max_s * (count(index) / count(STEPS) - 1.0);
    let mut starts: Vec<(f64, Law)> = Vec::new();
    for begin in 0..=2 * STEPS {
        for end in 0..=2 * STEPS {
            for shape in SHAPES {
                let law = law(late(begin), late(end), shape);
                if law.rises() {
                    starts.push((likeness(&law), law));
                }
            }
        }
    }
    starts.sort_by(|left, right| right.0.total_cmp(&left.0));
    let best = starts
        .into_iter()
        .take(3)
        .map(|(_, start)| downhill(&coarse, film, start, bounds))
        .max_by(|left, right| left.0.total_cmp(&right.0))
        .map_or(law(0.0, 0.0, (0.0, 0.0)), |(_, law)| law);
    (best, sample.fit(film, |time_s| best.scene_s(time_s)))
}

/// Compass search over the four parameters.
fn downhill(sample: &Sample, film: &Film, start: Law, bounds: &Bounds) -> (f64, Law) {
    let likeness = |law: &Law| sample.fit(film, |time_s| law.scene_s(time_s)).likeness;
    let (mut best, mut value, mut step) = (start, likeness(&start), 0.25);
    while step > 0.002 {
        let better = neighbours(&best, step, bounds.shift_max_s)
            .filter(Law::rises)
            .map(|law| (likeness(&law), law))
            .max_by(|left, right| left.0.total_cmp(&right.0))
            .filter(|(other, _)| *other > value);
        match better {
            Some((other, law)) => (value, best) = (other, law),
            None => step /= 2.0,
        }
    }
    (value, best)
}

fn neighbours(law: &Law, step: f64, most_s: f64) -> impl Iterator<Item = Law> {
    let law = *law;
    let moves: [[f64; 4]; 6] = [
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0, 0.0],
        [1.0, -1.0, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ];
    moves.into_iter().flat_map(move |by| {
        [step, -step].map(|step| Law {
            begins_late_s: (law.begins_late_s + by[0] * step * most_s).clamp(-most_s, most_s),
            ends_late_s: (law.ends_late_s + by[1] * step * most_s).clamp(-most_s, most_s),
            ease: (law.ease + by[2] * step).clamp(-1.0, 1.0),
            lean: (law.lean + by[3] * step).clamp(-1.0, 1.0),
            ..law
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law(ease: f64, lean: f64) -> Law {
        Law {
            begins_late_s: 0.5,
            ends_late_s: -0.5,
            ease,
            lean,
            scene_s: (0.0, 10.0),
        }
    }

    #[test]
    fn the_ends_are_where_they_are_said_to_be_and_time_runs_on_beyond() {
        for law in [law(0.0, 0.0), law(1.0, 0.0), law(-1.0, 0.0), law(0.2, 0.3)] {
            for (time_s, expected) in [(0.5, 0.0), (9.5, 10.0), (0.0, -0.5), (10.5, 11.0)] {
                assert!((law.scene_s(time_s) - expected).abs() < 1e-12, "{time_s}");
            }
            assert!(law.rises());
        }
    }

    /// Minimum jerk (Flash and Hogan 1985): a quarter of the time is 0.103516 of the way; speed is 15/8 half way.
    #[test]
    fn ease_is_minimum_jerk_and_lean_goes_first() {
        assert!((law(1.0, 0.0).scene_s(0.5 + 9.0 / 4.0) - 1.035_156_25).abs() < 1e-12);
        assert!((law(0.0, 0.0).scene_s(0.5 + 9.0 / 4.0) - 2.5).abs() < 1e-12);
        assert!((law(0.0, 0.4).scene_s(5.0) - 6.0).abs() < 1e-12);
        assert!(!law(1.0, 0.4).rises() && !law(0.0, 1.5).rises());
    }

    /// A step of 0.25 is half a second of ends that may be 2 s late: at one end, at both, at both against each other; then
    /// the shape.
    #[test]
    fn neighbours_are_one_step_away_and_within_the_bounds() {
        let of = |law: Law, most_s: f64| -> Vec<[f64; 4]> {
            neighbours(&law, 0.25, most_s)
                .map(|law| [law.begins_late_s, law.ends_late_s, law.ease, law.lean])
                .collect()
        };
        assert_eq!(
            of(law(0.5, -0.25), 2.0),
            [
                [1.0, -0.5, 0.5, -0.25],
                [0.0, -0.5, 0.5, -0.25],
                [0.5, 0.0, 0.5, -0.25],
                [0.5, -1.0, 0.5, -0.25],
                [1.0, 0.0, 0.5, -0.25],
                [0.0, -1.0, 0.5, -0.25],
                [1.0, -1.0, 0.5, -0.25],
                [0.0, 0.0, 0.5, -0.25],
                [0.5, -0.5, 0.75, -0.25],
                [0.5, -0.5, 0.25, -0.25],
                [0.5, -0.5, 0.5, 0.0],
                [0.5, -0.5, 0.5, -0.5],
            ]
        );
        let bounded = of(law(1.0, -1.0), 0.5);
        assert_eq!(bounded[0], [0.5, -0.5, 1.0, -1.0]);
        assert_eq!(bounded[3], [0.5, -0.5, 1.0, -1.0]);
        assert_eq!(bounded[8], [0.5, -0.5, 1.0, -1.0]);
        assert_eq!(bounded[11], [0.5, -0.5, 1.0, -1.0]);
    }
}
