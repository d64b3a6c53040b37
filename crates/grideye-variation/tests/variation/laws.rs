//! The laws of what is drawn: uniform, normal, and choices.

use crate::{drawn, files, number, recipe, text};
use grideye_variation::{Draw, Recipe};
use std::collections::BTreeMap;

#[test]
fn a_range_is_uniform_and_is_what_the_scene_has() {
    let recipe = recipe(&["room.ambient_c=18..26"]).unwrap();
    let draws: Vec<Draw> = (0..4000).map(|index| recipe.draw(7, index)).collect();
    let numbers: Vec<f64> = draws.iter().map(|draw| number(draw, 0)).collect();
    assert!(numbers.iter().all(|number| (18.0..26.0).contains(number)));
    let mean = numbers.iter().sum::<f64>() / 4000.0;
    let variance = numbers.iter().map(|n| (n - mean).powi(2)).sum::<f64>() / 4000.0;
    // Of a uniform distribution of width w: (low + high) / 2 and w² / 12, here within four standard errors.
    assert!(
        (mean - 22.0).abs() < 4.0 * (64.0_f64 / 12.0 / 4000.0).sqrt(),
        "{mean}"
    );
    assert!((variance - 64.0 / 12.0).abs() < 0.35, "{variance}");
    for (index, draw) in draws.iter().enumerate().take(5) {
        let scene = recipe.scene(7, index as u64, draw, &files()).unwrap().scene;
        assert_eq!(scene.room().ambient_c.to_bits(), numbers[index].to_bits());
    }
}

/// Against the closed form of a normal law cut at a and b standard deviations: with φ and Φ of the standard normal law
/// and Z = Φ(b) - Φ(a), the mean is (φ(a) - φ(b)) / Z and the variance 1 + (a φ(a) - b φ(b)) / Z - mean².
#[test]
fn a_key_alone_has_the_law_of_its_table() {
    let tables = "\n[[uncertain]]\nkey = \"agent.person.temperature_c\"\nbounds = [27, 30]\nsd = 1\n\
        [[uncertain]]\nkey = \"sensor.ceiling.position_mm.x\"\nbounds = [1900, 2100]\n\
        [[uncertain]]\nkey = \"sensor.ceiling.elevation_deg\"\nsd = 3\n\
        [[uncertain]]\nkey = \"agent.person.aside_m\"\nsd = 0.05\n";
    let asked = [
        "agent.person.temperature_c",
        "sensor.ceiling.position_mm.across",
        "sensor.ceiling.elevation_deg",
        "room.ambient_c=20+-0.5",
    ]
    .map(String::from);
    let text = text() + tables;
    let recipe = Recipe::new(&text, "room.toml", &asked).unwrap();
    recipe.check(&files()).unwrap();
    let draws: Vec<Draw> = (0..4000).map(|index| recipe.draw(7, index)).collect();
    let column = |at: usize| draws.iter().map(move |draw| number(draw, at));
    let mean_and_variance = |at: usize| {
        let mean = column(at).sum::<f64>() / 4000.0;
        let squares = column(at).map(|number| (number - mean).powi(2));
        (mean, squares.sum::<f64>() / 4000.0)
    };
    // a = -1, b = 2: φ = 0.241971, 0.053991; Z = 0.818595.
    let (mean, variance) = mean_and_variance(0);
    assert!(
        (mean - 28.2296).abs() < 4.0 * (0.5198_f64 / 4000.0).sqrt(),
        "{mean}"
    );
    assert!((variance - 0.5198).abs() < 0.04, "{variance}");
    assert!(column(0).all(|number| (27.0..=30.0).contains(&number)));
    // Without sd uniform: width² / 12.
    let (mean, variance) = mean_and_variance(1);
    assert!((mean - 2000.0).abs() < 4.0, "{mean}");
    assert!(
        (variance / (200.0 * 200.0 / 12.0) - 1.0).abs() < 0.07,
        "{variance}"
    );
    // Cut at 90°, the most that the scene allows, and so half a normal law below it.
    let (mean, variance) = mean_and_variance(2);
    assert!((mean - (90.0 - 3.0 * 0.79767)).abs() < 0.12, "{mean}");
    assert!((variance / (9.0 * 0.36266) - 1.0).abs() < 0.1, "{variance}");
    let (mean, variance) = mean_and_variance(3);
    assert!(
        (mean - 20.0).abs() < 4.0 * 0.5 / 4000.0_f64.sqrt(),
        "{mean}"
    );
    assert!((variance / 0.25 - 1.0).abs() < 0.1, "{variance}");
    assert!(recipe.scene(7, 0, &draws[0], &files()).is_ok());
    let claim = ["agent.person.aside_m".to_owned()];
    let refused = Recipe::new(&text, "room.toml", &claim).unwrap_err();
    assert!(refused.to_string().contains("missing `=`"), "{refused}");
}

#[test]
fn choices_are_equally_likely_and_independent() {
    let draws = drawn(&["law=A,B", "object.table.present=on,off"], 4000);
    let mut counts = BTreeMap::new();
    for draw in &draws {
        let key = format!("{:?}", draw.values);
        *counts.entry(key).or_insert(0_u32) += 1;
    }
    assert_eq!(counts.len(), 4, "{counts:?}");
    // 1000 each, with a standard deviation of √(4000 · 1/4 · 3/4) = 27.
    assert!(
        counts.values().all(|count| count.abs_diff(1000) < 110),
        "{counts:?}"
    );
}
