//! `[[vary]]` tables: weights, all agents at once, how many are there, and keys that go together.

use crate::{files, number, text};
use grideye_variation::{Draw, Recipe};

fn recipe(tables: &str, asked: &[&str]) -> Result<Recipe, String> {
    let text = text() + tables;
    let asked: Vec<String> = asked.iter().map(|asked| (*asked).to_owned()).collect();
    let recipe = Recipe::new(&text, "room.toml", &asked).map_err(|error| error.to_string())?;
    recipe.check(&files()).map_err(|error| error.to_string())?;
    Ok(recipe)
}

const DRAWS: u32 = 4_000;

fn draws(recipe: &Recipe) -> Vec<Draw> {
    (0..u64::from(DRAWS))
        .map(|index| recipe.draw(3, index))
        .collect()
}

/// Within four standard errors of the binomial law.
#[test]
fn choices_come_as_often_as_their_weights() {
    let tables =
        "\n[[vary]]\nkey = \"room.ambient_c\"\nvalues = \"18, 20, 22\"\nweights = [1, 0, 3]\n";
    let draws = draws(&recipe(tables, &[]).unwrap());
    let share = |celsius: f64| {
        let times = draws.iter().filter(|draw| number(draw, 0) == celsius);
        times.map(|_| 1.0).sum::<f64>() / f64::from(DRAWS)
    };
    let error = 4.0 * (0.25_f64 * 0.75 / f64::from(DRAWS)).sqrt();
    assert!((share(18.0) - 0.25).abs() < error, "{}", share(18.0));
    assert_eq!(share(20.0), 0.0);
    assert!((share(22.0) - 0.75).abs() < error);
}

/// The file's first agents; each number of a range alike.
#[test]
fn people_says_how_many_of_the_agents_are_there() {
    let recipe = recipe("\n[[vary]]\nkey = \"people\"\nvalues = \"0..2\"\n", &[]).unwrap();
    let mut times = [0_u32; 3];
    for (index, draw) in draws(&recipe).iter().enumerate() {
        let sought = [0.0, 1.0, 2.0]
            .iter()
            .position(|people| *people == number(draw, 0));
        let people = sought.unwrap();
        times[people] += 1;
        if index < 40 {
            let scene = recipe.scene(3, index as u64, draw, &files()).unwrap().scene;
            let names: Vec<&str> = scene.agents().iter().map(|agent| &*agent.name).collect();
            assert_eq!(names, ["person", "walker"][..people]);
        }
    }
    let error = 4.0 * (f64::from(DRAWS) / 3.0 * 2.0 / 3.0).sqrt();
    for times in times {
        assert!(
            (f64::from(times) - f64::from(DRAWS) / 3.0).abs() < error,
            "{times}"
        );
    }
}

/// Correlation and slope of the drawn pairs, by least squares.
#[test]
fn a_law_moves_with_another_key_by_its_slope() {
    let tables = "\n[[vary]]\nkey = \"room.ambient_c\"\nvalues = \"18..26\"\n\
        [[vary]]\nkey = \"agent.person.temperature_c\"\nvalues = \"28+-0.5\"\nwith = \"room.ambient_c\"\nslope = 0.3\n";
    let draws = draws(&recipe(tables, &[]).unwrap());
    let mean =
        |at: usize| draws.iter().map(|draw| number(draw, at)).sum::<f64>() / f64::from(DRAWS);
    let (x, y) = (mean(0), mean(1));
    let products = |one: usize, other: usize| -> f64 {
        let of = |draw: &Draw, at: usize| number(draw, at) - [x, y][at];
        draws
            .iter()
            .map(|draw| of(draw, one) * of(draw, other))
            .sum()
    };
    let slope = products(0, 1) / products(0, 0);
    // Standard error: 0.5 / (8 / √12 · √4000).
    assert!((slope - 0.3).abs() < 4.0 * 0.0035, "{slope}");
    assert!((y - 28.0).abs() < 0.06, "{y}");
    // At most 4 sd and 4 °C off: 28 + 4 · 0.5 + 0.3 · 4. Some are farther than the law alone goes.
    let all = || draws.iter().map(|draw| number(draw, 1));
    assert!(all().all(|celsius| (24.8..=31.2).contains(&celsius)));
    assert!(all().any(|celsius| celsius > 30.0));
    // In another range it is as far from the middle of the table's: 28 + 0.3 · (25 - 22).
    let warmer = recipe(tables, &["room.ambient_c=24..26"]).unwrap();
    let draws = self::draws(&warmer);
    let mean =
        |at: usize| draws.iter().map(|draw| number(draw, at)).sum::<f64>() / f64::from(DRAWS);
    assert!((mean(0) - 25.0).abs() < 0.06 && (mean(1) - 28.9).abs() < 0.06);
}

#[test]
fn a_star_is_each_table_and_an_option_replaces_one() {
    let tables = "\n[[vary]]\nkey = \"agent.*.temperature_c\"\nvalues = \"26..30\"\n";
    let all = recipe(tables, &[]).unwrap();
    let names = |recipe: &Recipe| -> Vec<String> {
        recipe
            .columns()
            .iter()
            .map(|column| column.name.clone())
            .collect()
    };
    assert_eq!(
        names(&all),
        ["agent.person.temperature_c", "agent.walker.temperature_c"]
    );
    assert_eq!(all.asked(), ["agent.*.temperature_c=26..30"]);
    let draw = all.draw(1, 0);
    assert_ne!(number(&draw, 0), number(&draw, 1), "each by itself");

    let one = recipe(tables, &["agent.walker.temperature_c=35"]).unwrap();
    let draw = one.draw(1, 0);
    assert_eq!(number(&draw, 0), number(&all.draw(1, 0), 0));
    assert_eq!(number(&draw, 1), 35.0);
}

#[test]
fn tables_that_contradict_themselves_are_refused_at_their_line() {
    let line = text().lines().count() + 3;
    for (table, says) in [
        (
            "key = \"room.ambient_c\"\nvalues = \"18,20\"\nweights = [1]",
            "1 weights for 2 choices",
        ),
        (
            "key = \"room.ambient_c\"\nvalues = \"18,20\"\nweights = [1, -1]",
            "numbers from 0 on",
        ),
        (
            "key = \"room.ambient_c\"\nvalues = \"18..20\"\nslope = 1",
            "has no `with`",
        ),
        (
            "key = \"room.ambient_c\"\nvalues = \"18..20\"\nwith = \"time_s\"\nslope = 1",
            "`time_s` does not",
        ),
        ("key = \"people\"\nvalues = \"0..3\"", "at most 2"),
        ("key = \"people\"\nvalues = \"0.5\"", "must be whole"),
        ("key = \"room.ambient_c\"\nvalues = \"26..18\"", "is empty"),
        (
            "key = \"agent.*.wings\"\nvalues = \"1\"",
            "unknown field `wings`",
        ),
    ] {
        let error = recipe(&format!("\n[[vary]]\n{table}\n"), &[]).unwrap_err();
        assert!(error.contains(says), "{error}");
        let is_at_line = (0..3).any(|more| error.contains(&format!("room.toml:{}:", line + more)));
        assert!(is_at_line, "{error}");
    }
}
