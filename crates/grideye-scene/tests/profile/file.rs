//! Reading and writing profile files.

use super::*;

pub(super) const EVERYTHING: &str = r#"name = "a \"specimen\""

[noise]
sigma_c = 0.3

[common_mode]
sd_c = 0.1
correlation_s = 30
octaves = 2
cycle_depth_c = 0.15

[fixed_pattern]
offset_c = -0.5
spread_c = 0.2

[background]
offset_c = 0.7

[warm_up]
start_c = -1
time_constant_s = 600
drift_c_per_hour = 0.1

[thermistor]
offset_c = 4.5
sigma_c = 0.02
lag_s = 120

[glitches]
probability = 0.001

[clock]
error_ppm = -42000
drift_ppm_per_hour = 15
"#;

#[test]
fn the_built_in_profiles_are_profiles() {
    for (name, text) in BUILT_IN {
        Profile::parse(text, name).unwrap();
    }
}

#[test]
fn a_profile_is_written_as_it_is_read() {
    let mut profile = parse(EVERYTHING);
    assert_eq!(profile.clock_error_ppm(), -42_000);
    assert_eq!(profile.clock_drift_ppm_per_hour(), 15);
    assert_eq!(parse(&profile.to_toml()), profile);
    for (pixel, sigma) in profile.noise_sigma_c.iter_mut().enumerate() {
        *sigma = 0.1 + pixel as f64 / 7.0;
    }
    profile.fixed_pattern.offset_c[63] = -1e-7;
    profile.name = "tab\tand \\ \u{e9} 'quote'".replace('\t', " ");
    assert_eq!(parse(&profile.to_toml()), profile, "{}", profile.to_toml());
}

#[test]
fn a_background_of_zero_is_not_an_unknown_one() {
    let zero = parse("[background]\noffset_c = 0\n");
    assert_eq!(zero.background_c, Some([0.0; PIXELS]));
    assert_eq!(parse(&zero.to_toml()), zero);
    assert_eq!(parse("[background]\n").background_c, None);
}

#[test]
fn every_key_is_read_into_its_field() {
    for line in EVERYTHING.lines().filter(|line| line.contains(" = ")) {
        let changed = match line.split_once(" = ") {
            Some((key, value)) if value.starts_with('"') => format!("{key} = \"other\""),
            Some(("octaves", _)) => "octaves = 3".to_owned(),
            Some((key, value)) => format!("{key} = {value}1"),
            None => unreachable!(),
        };
        let replaced = EVERYTHING.replacen(line, &changed.replace("0.0011", "0.0021"), 1);
        if line.starts_with("drift_ppm") {
            assert_eq!(parse(&replaced).clock_drift_ppm_per_hour(), 151);
        }
        if !line.starts_with("error_ppm") {
            assert_ne!(parse(&replaced), parse(EVERYTHING), "{line}");
        }
    }
}

#[test]
fn lists_of_another_length_and_bad_numbers_in_them_are_named() {
    let sixty_three = format!("[noise]\nsigma_c = [{}]\n", vec!["0.3"; 63].join(", "));
    let sixty_five = format!(
        "[fixed_pattern]\noffset_c = [{}]\n",
        vec!["0.3"; 65].join(", ")
    );
    let one_negative = format!("[noise]\nsigma_c = [0.3, -0.1{}]\n", ", 0.3".repeat(62));
    let one_text = "[noise]\nsigma_c = [0.1, \"a\"]\n";
    for (text, place, message) in [
        (
            sixty_three.as_str(),
            "sensor.toml:2:11",
            "`noise.sigma_c` has 63 numbers, expected 64",
        ),
        (
            &sixty_five,
            "sensor.toml:2:12",
            "`fixed_pattern.offset_c` has 65 numbers, expected 64",
        ),
        (
            &one_negative,
            "sensor.toml:2:17",
            "`noise.sigma_c` is -0.1, expected 0 to 100 °C",
        ),
        (one_text, "sensor.toml:2:17", "expected a number"),
    ] {
        assert_refused(text, &[place, message]);
    }
}

#[test]
fn every_mistake_is_reported_with_its_place_and_a_hint() {
    for (text, expected) in MISTAKES {
        assert_refused(text, expected);
    }
}

fn assert_refused(text: &str, expected: &[&str]) {
    let found = refusal(text);
    for part in expected {
        assert!(
            found.contains(part),
            "{text}\ngives: {found}\nwithout: {part}"
        );
    }
    let first = found.lines().next().unwrap();
    assert!(
        !first.ends_with('.') && found.contains("\nhint: "),
        "{found}"
    );
}

const MISTAKES: &[(&str, &[&str])] = &[
    (
        "[common_mode]\noctaves = 11\n",
        &["`common_mode.octaves` is 11, expected a whole number, 1 to 10"],
    ),
    (
        "[common_mode]\noctaves = 0\n",
        &["`common_mode.octaves` is 0"],
    ),
    (
        "[common_mode]\noctaves = 1.5\n",
        &["`common_mode.octaves` is 1.5"],
    ),
    (
        "[noise]\nsigma = 0.3\n",
        &[
            "sensor.toml:2:1",
            "unknown field `sigma`",
            "expected `sigma_c`",
        ],
    ),
    (
        "[nois]\nsigma_c = 0.3\n",
        &["sensor.toml:1:2", "unknown field `nois`"],
    ),
    (
        "[noise]\nsigma_c = nan\n",
        &["sensor.toml:2:11", "`noise.sigma_c` is nan"],
    ),
    (
        "[noise]\nsigma_c = -0.3\n",
        &["`noise.sigma_c` is -0.3, expected 0 to 100 °C"],
    ),
    ("[noise]\nsigma_c = inf\n", &["`noise.sigma_c` is inf"]),
    (
        "[noise]\nsigma_c = \"data sheet\"\n",
        &["`noise.sigma_c` is \"data sheet\"", "\"datasheet\""],
    ),
    (
        "[fixed_pattern]\noffset_c = \"datasheet\"\n",
        &["`fixed_pattern.offset_c` is \"datasheet\""],
    ),
    (
        "[background]\noffset_c = 101\n",
        &["`background.offset_c` is 101, expected -100 to 100 °C"],
    ),
    (
        "[noise]\nsigma_c = true\n",
        &[
            "sensor.toml:2:11",
            "`sigma_c`",
            "a number, or a list of 64 numbers",
        ],
    ),
    (
        "[common_mode]\nsd_c = 0.1\n",
        &[
            "sensor.toml:2:8",
            "`common_mode.sd_c` also needs `common_mode.correlation_s`",
        ],
    ),
    (
        "[common_mode]\nsd_c = 0.1\ncorrelation_s = 0\n",
        &["sensor.toml:3:17", "`common_mode.correlation_s` is 0"],
    ),
    (
        "[common_mode]\ncycle_depth_c = -0.1\n",
        &["`common_mode.cycle_depth_c` is -0.1"],
    ),
    (
        "[warm_up]\nstart_c = 1\n",
        &["`warm_up.start_c` also needs `warm_up.time_constant_s`"],
    ),
    ("[thermistor]\nlag_s = -1\n", &["`thermistor.lag_s` is -1"]),
    (
        "[glitches]\nprobability = 1.01\n",
        &["`glitches.probability` is 1.01, expected 0 to 1"],
    ),
    (
        "[clock]\nerror_ppm = 0.5\n",
        &["`clock.error_ppm` is 0.5, expected a whole number"],
    ),
    (
        "[clock]\nerror_ppm = 500001\n",
        &["`clock.error_ppm` is 500001"],
    ),
    (
        "[clock]\ndrift_ppm_per_hour = nan\n",
        &["`clock.drift_ppm_per_hour` is nan"],
    ),
    (
        "[clock]\nerror_ppm = \"fast\"\n",
        &["sensor.toml:2:13", "`error_ppm`", "expected a number"],
    ),
    ("name = \"a\\nb\"\n", &["`name` is", "visible characters"]),
    ("name = 7\n", &["sensor.toml:1:8", "`name`"]),
    (
        "[noise]\nsigma_c = 1\nsigma_c = 2\n",
        &["sensor.toml:3:1", "duplicate key"],
    ),
    (
        "[noise\n",
        &["sensor.toml:1:", "hint: the file must be TOML"],
    ),
];

#[test]
fn text_and_name_are_bounded() {
    let full = format!("#{}\n", "x".repeat(TEXT_BYTES_MAX - 2));
    assert_eq!(full.len(), TEXT_BYTES_MAX);
    assert_eq!(refusal(&full), "accepted");
    let error = Profile::parse(&format!("{full}#"), "big.toml").unwrap_err();
    assert_eq!(error.problem, "65537 bytes of text, expected at most 65536");
    let name = |length: usize| format!("name = \"{}\"\n", "é".repeat(length));
    assert_eq!(refusal(&name(NAME_CHARACTERS_MAX)), "accepted");
    assert!(refusal(&name(NAME_CHARACTERS_MAX + 1)).contains("up to 100 visible characters"));
}

/// All shipped profiles can be read, and the specification's example is one.
#[test]
fn shipped_profiles_and_the_example_of_the_specification_are_profiles() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/profiles");
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    let mut shipped = 0;
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        if path
            .extension()
            .is_some_and(|extension| extension == "toml")
        {
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            assert!(
                !Profile::parse(&read(&name), &name).unwrap().name.is_empty(),
                "{name}"
            );
            assert!(
                read("README.md").contains(&format!("`{name}`")),
                "{name} is not in the list"
            );
            shipped += 1;
        }
    }
    assert!(shipped >= 2);
    let specification = read("README.md");
    let example = specification
        .split("```")
        .nth(1)
        .unwrap()
        .strip_prefix("toml\n")
        .unwrap();
    let profile = Profile::parse(example, "README.md").unwrap();
    assert_eq!(profile.name, "unit 7");
    assert_eq!(profile.noise_sigma_c, [0.3; 64]);
    let named = |name: &str| Profile {
        name: String::new(),
        ..Profile::parse(&read(name), name).unwrap()
    };
    assert_eq!(named("ideal.toml"), Profile::default());
    assert_eq!(
        named("datasheet.toml"),
        parse("[noise]\nsigma_c = \"datasheet\"\n")
    );
}
