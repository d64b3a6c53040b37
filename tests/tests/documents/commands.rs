//! Every command of the documents, and what keeps each from rotting.

/// How a documented command is kept from rotting.
pub(crate) enum Kept {
    /// It is run as it stands, behind what makes its files, and must end with 0 and print these words.
    Run(&'static str, &'static [&'static str]),
    /// The same, as a program on the emulated sensor.
    Emulated(&'static [&'static str]),
    /// It serves until Ctrl-C, which comes once it has printed these words, and must end with 0.
    Serves(&'static str, &'static [&'static str]),
    /// A test of the repository runs it, or the same with another port, speed or length: file and function.
    By(&'static str, &'static str),
    /// It needs what no test has.
    Not(&'static str),
}

use Kept::{By, Emulated, Not, Run, Serves};

pub(crate) const PIPELINE: &str = "tests/tests/pipeline.rs";
pub(crate) const JOINING: &str = "tests/tests/joining/pasted.rs";
pub(crate) const JOINING_CHECK: &str = "tests/tests/joining/check.rs";
pub(crate) const PASTED: &str =
    "a_line_pasted_into_a_shell_ends_with_the_first_frame_at_the_collector";
pub(crate) const DRIVER_CI: &str = "tests/tests/driver_ci.rs";
pub(crate) const DRIVER_CI_PYTHON: &str = "the_python_suite_passes_on_the_emulated_sensor";
pub(crate) const ARDUINO: &str = "tests/tests/arduino/example.rs";
pub(crate) const ARDUINO_RED: &str = "the_examples_driver_is_green_and_one_without_a_sign_is_red";
pub(crate) const C_RED: &str = "the_driver_in_c_is_green_and_one_without_a_sign_is_red";
pub(crate) const C_LIBRARY: &str = "tests/tests/c_library/main.rs";
pub(crate) const C_LIBRARY_README: &str = "the_readme_is_a_test_that_passes";
pub(crate) const PACKAGES: &str = "tests/tests/packages/main.rs";
pub(crate) const INSTALLED: &str = "the_packages_are_installed_started_upgraded_removed_and_purged";
pub(crate) const TUTORIALS: &str = "tests/tests/documents/tutorials.rs";
pub(crate) const DRIVER_TUTORIAL: &str =
    "a_driver_is_red_below_zero_and_on_a_loose_wire_then_green_then_in_a_workflow";
pub(crate) const WALK: &str = "grideye simulate scenes/experiment-3.toml --out walk.csv";

/// Every command of the documents.
pub(crate) const COMMANDS: &[(&str, Kept)] = &[
    // README.md
    (
        "cargo run --release -- demo",
        By(
            "tests/tests/page/demo.rs",
            "the_demonstration_shows_its_sensor_live_until_it_is_interrupted",
        ),
    ),
    (
        "cargo run --release -- demo --once --out out",
        By(
            PIPELINE,
            "the_demonstration_ends_with_delivery_scores_and_report",
        ),
    ),
    (
        "cargo run --release -p grideye-hardware -- device.toml",
        By(
            "tests/tests/bus/hardware.rs",
            "every_check_passes_on_the_emulated_sensor",
        ),
    ),
    (
        "cargo run --release -- demo --replay recordings/linaige/Session2_2021-07-01_RoomB_v2.csv --once --speed 20",
        By(
            PIPELINE,
            "a_real_recording_comes_out_as_it_went_in_through_registers_bus_http_and_store",
        ),
    ),
    (
        "grideye emulate --scene scenes/experiment-1.toml -- i2ctransfer -y 1 w1@0x69 0x80 r8",
        Run("", &["0x5d 0x00 0x5f 0x00 0x5e 0x00 0x5d 0x00"]),
    ),
    (
        "grideye-agent check --bus /dev/i2c-1 --address 0x69",
        Emulated(&["i2c-1:0x69: ok"]),
    ),
    (
        "grideye enroll pi-1 --url https://192.168.1.20:8833",
        Run(
            "",
            &[
                "echo 'grideye:https://192.168.1.20:8833,device=pi-1,token=grideye-",
                ",pin=sha256-",
                "' | sudo grideye-agent join -",
            ],
        ),
    ),
    (
        "grideye collect --listen 192.168.1.20:8833",
        Serves("grideye enroll pi-1", &["http://127.0.0.1:"]),
    ),
    (
        "grideye count recordings/linaige/Session2_2021-07-01_RoomB_v2.csv",
        Run("", &["  1 person", "  nobody"]),
    ),
    (
        "grideye count recording.csv --line -0.5,3.5,7.5,3.5",
        By(
            "crates/grideye/tests/commands/count.rs",
            "json_lines_and_the_column_of_convert_have_the_same_counts",
        ),
    ),
    (
        "grideye collect --count",
        By(
            "tests/tests/page/people.rs",
            "a_card_says_how_many_people_there_are_and_outlines_them",
        ),
    ),
    (
        "grideye collect --scenes scenes",
        By(
            "tests/tests/page/beside.rs",
            "a_sensor_stands_beside_its_scene_with_difference_scores_and_verdict",
        ),
    ),
    (
        "echo 'grideye:https://192.168.1.20:8833,device=pi-1,token=…,pin=…' | sudo grideye-agent join -",
        By(JOINING, PASTED),
    ),
    (
        "grideye token make me --scope admin --out me.token",
        Run("", &["written to me.token"]),
    ),
    (
        "grideye record evening --seconds 60 --out evening.csv --collector https://192.168.1.20:8833 --token-file me.token --authority grideye-access/authority.pem",
        By(
            "tests/tests/joining/one_machine.rs",
            "the_recipe_for_one_machine_runs_as_it_stands",
        ),
    ),
    (
        "grideye compare --scene my-room.toml --recording evening.csv --report evening.html --json evening.json",
        Run(
            "cp scenes/experiment-1.toml my-room.toml; grideye simulate my-room.toml --seed 2 --out evening.csv",
            &["Agrees: "],
        ),
    ),
    (
        "grideye compare --scene my-room.toml --recording evening.csv --profile my-sensor.toml --thresholds my-thresholds.toml --junit evening.xml",
        Run(
            "cp scenes/experiment-1.toml my-room.toml; cp scenes/profiles/ideal.toml my-sensor.toml; printf '[frames_min]\\nvalue = 5\\nsource = \"half a second\"\\n' > my-thresholds.toml; grideye simulate my-room.toml --seed 2 --out evening.csv",
            &["Agrees: "],
        ),
    ),
    // firmware-config/README.md
    (
        "sudo cp 99-grideye-i2c.rules /etc/udev/rules.d/",
        Not("a Raspberry Pi"),
    ),
    (
        "sudo mkdir -p /etc/grideye && sudo cp agent.toml /etc/grideye/",
        Not("a Raspberry Pi"),
    ),
    (
        "sudo cp grideye-agent.service /etc/systemd/system/",
        Not("a Raspberry Pi"),
    ),
    (
        "sudo cp grideye-agent.sysusers /etc/sysusers.d/grideye-agent.conf && sudo systemd-sysusers",
        By(PACKAGES, INSTALLED),
    ),
    (
        "sudo apt install ./grideye-agent_0.2.0_arm64.deb",
        By(PACKAGES, INSTALLED),
    ),
    ("sudo usermod -aG i2c $USER", Not("a Raspberry Pi")),
    (
        "sudo -u grideye-collector grideye enroll pi-1 --access /var/lib/grideye-collector/access",
        Not("a machine with the service"),
    ),
    (
        "sudo systemctl enable --now grideye-collector",
        Not("a machine with the service"),
    ),
    (
        "grideye orient --sensor pi-1/i2c-1:0x69",
        By(
            "tests/tests/orient.rs",
            "live_frames_of_the_emulated_sensor_are_asked_for_and_told",
        ),
    ),
    ("sudo reboot", Not("a Raspberry Pi")),
    ("grideye-agent check", Emulated(&["i2c-1:0x69: ok"])),
    (
        "sudo systemctl enable --now grideye-agent",
        Not("a Raspberry Pi"),
    ),
    (
        "grideye collect --listen 0.0.0.0:8833",
        Serves("grideye enroll pi-1", &["https://0.0.0.0:"]),
    ),
    (
        "echo 'CODE' | sudo grideye-agent join -",
        By(JOINING, PASTED),
    ),
    // crates/grideye-agent/README.md
    (
        "grideye-agent check --config agent.toml",
        By(
            JOINING_CHECK,
            "check_says_whether_the_collector_takes_the_frames_and_what_to_do_if_not",
        ),
    ),
    (
        "grideye-agent run --config agent.toml",
        By(
            PIPELINE,
            "the_agent_delivers_from_a_device_file_to_a_collector",
        ),
    ),
    (
        "grideye-agent resend --config agent.toml",
        By(
            "crates/grideye-agent/tests/agent/program.rs",
            "rejected_records_are_sent_again_and_those_that_are_rejected_again_stay",
        ),
    ),
    // crates/i2c-emulation/README.md
    (
        "cargo run -p i2c-emulation --example with_a_chip -- i2cget -y 1 0x50 0x10 i 4",
        Run("", &["0x10 0x11 0x12 0x13"]),
    ),
    // scenes/README.md
    (
        "grideye simulate scenes/experiment-3.toml --view room.svg --out walk.gif",
        Run("", &[]),
    ),
    (
        "grideye simulate scenes/clothed-walk.toml --model paper",
        Run("", &[]),
    ),
    (
        "grideye fuse scenes/scenario-a-3x3.toml --out fused.png",
        Run("", &["26 x 26", "22 x 22", "least squares"]),
    ),
    (
        "grideye distinguish scenes/scenario-b-before.toml scenes/scenario-b-after.toml scenes/scenario-b-standing.toml",
        Run("", &["A + B + C"]),
    ),
    (
        "grideye coverage scenes/bedroom.toml",
        Run("", &["floor: ", "contrast of a person standing"]),
    ),
    (
        "grideye coverage scenes/l-shaped-flat.toml --candidates corners,ceiling --best 2",
        Run("", &["k=2: "]),
    ),
    // crates/grideye/DATASET.md
    (
        "grideye dataset scenes/experiment-1.toml --frames 200 --vary agent.person.position=floor --vary room.ambient_c=18..26 --out people",
        Run("", &["200 of 200 frames in people; parts: 1 made"]),
    ),
    (
        "grideye dataset --preset counting --frames 10000 --out people",
        Run("", &["10000 of 10000 frames in people; parts: 10 made"]),
    ),
    (
        "grideye dataset --preset counting --like recordings/linaige/Session3_2021-07-06_RoomA_v2.csv --vary sensor.ceiling.position_mm.z=2500 --frames 1000 --out own",
        Run("", &["1000 of 1000 frames in own; parts: 1 made"]),
    ),
    (
        "grideye dataset --preset falls --frames 5000 --clip 50 --out falls",
        Run("", &["5000 of 5000 frames in falls; parts: 5 made"]),
    ),
    (
        "grideye dataset scenes/people.toml --frames 5000 --clip 50 --vary \"agent.walking.acts=enter stand:1..2 leave,walk fall,walk walk\" --out clips",
        Run("", &["5000 of 5000 frames in clips; parts: 5 made"]),
    ),
    (
        "grideye dataset scenes/experiment-1.toml --frames 5000 --out frames --shard 2/4",
        Run("", &["shard 2 of 4: 1000 of 5000 frames in frames"]),
    ),
    // crates/grideye/tutorials
    (
        "python3 -m venv ~/grideye && . ~/grideye/bin/activate && pip install pytest smbus2 && export GRIDEYE=$PWD",
        By(TUTORIALS, DRIVER_TUTORIAL),
    ),
    (
        "mkdir ~/driver && cd ~/driver",
        By(TUTORIALS, DRIVER_TUTORIAL),
    ),
    (
        "mkdir scenes && grideye collect --scenes scenes",
        By(
            "tests/tests/page/tutorial.rs",
            "the_room_that_the_tutorial_draws_is_the_file_that_it_shows",
        ),
    ),
    // crates/grideye-homeassistant/README.md
    (
        "grideye collect --mqtt mqtt://homeassistant.local",
        By(
            "tests/tests/home_assistant/values.rs",
            "a_sensor_is_discovered_with_its_values_and_its_picture",
        ),
    ),
    (
        "grideye collect --mqtt mqtt://grideye@homeassistant.local --mqtt-password-file mqtt-password",
        By(
            "tests/tests/home_assistant/trust.rs",
            "a_refused_password_is_told_with_what_to_do_and_stands_nowhere",
        ),
    ),
    (
        "mosquitto_pub -q 1 -t grideye/esp-1/lounge/pixels -m \"$(yes 21.25 | head -64 | paste -sd,)\"",
        By(
            "tests/tests/home_assistant/taken.rs",
            "pixels_without_a_number_are_numbered_and_stamped_on_arrival",
        ),
    ),
    (
        "grideye mqtt forget pi-1 i2c-1:0x69 --mqtt mqtt://homeassistant.local",
        By(
            "tests/tests/home_assistant/removed.rs",
            "a_sensor_that_is_removed_leaves_nothing_behind",
        ),
    ),
    // crates/grideye-python/README.md
    (
        "cargo build --release -p grideye-hil -p grideye-python && pip install $(crates/grideye-python/wheel --from target/release dist)",
        By(
            "tests/tests/python_package.rs",
            "the_wheel_installs_without_rust_and_its_suite_passes",
        ),
    ),
    // tests/examples/driver-ci/README.md
    (
        "cp -r tests/examples/driver-ci /tmp/driver && ln -s \"$PWD\" /tmp/driver/grideye-hil",
        By(DRIVER_CI, DRIVER_CI_PYTHON),
    ),
    (
        "cd /tmp/driver && python3 -m venv venv && . venv/bin/activate && pip install -r python/requirements.txt",
        By(DRIVER_CI, DRIVER_CI_PYTHON),
    ),
    // crates/amg8833-c/README.md
    (
        "cargo build --release -p amg8833-c",
        By(C_LIBRARY, C_LIBRARY_README),
    ),
    (
        "cc -I crates/amg8833-c/include test.c target/release/libamg8833_c.a -lm -lpthread -ldl -o test && ./test",
        By(C_LIBRARY, C_LIBRARY_README),
    ),
    // tests/examples/firmware-ci/README.md
    (
        "cp -r tests/examples/firmware-ci /tmp/firmware && ln -s \"$PWD\" /tmp/firmware/grideye-hil",
        By(ARDUINO, ARDUINO_RED),
    ),
    ("make -C /tmp/firmware test-c", By(ARDUINO, C_RED)),
    (
        "make -C /tmp/firmware -B -k test-c CXXFLAGS=-DWRONG_BELOW_ZERO",
        By(ARDUINO, C_RED),
    ),
    ("make -C /tmp/firmware test", By(ARDUINO, ARDUINO_RED)),
    (
        "make -C /tmp/firmware -B test-driver CXXFLAGS=-DWRONG_BELOW_ZERO",
        By(ARDUINO, ARDUINO_RED),
    ),
    (
        "make -C /tmp/firmware uno mega",
        By(ARDUINO, "the_firmware_is_built_for_the_boards"),
    ),
    (
        "make -C /tmp/firmware test-avr",
        By(ARDUINO, "the_firmware_runs_on_both_boards"),
    ),
    // the helps
    ("grideye completions bash", Run("", &["_grideye()"])),
    ("grideye man man1", Run("", &["man pages to man1"])),
    (
        "grideye coverage scenes/bedroom.toml --candidates all --write best.toml",
        Run("", &["k=1: ", "k=2: ", "wrote the poses to best.toml"]),
    ),
    (
        "grideye calibrate --scene scenes/calibration.toml --recording walk.csv",
        Run(WALK, &["sensor.ceiling.elevation_deg"]),
    ),
    (
        "grideye coverage scenes/bedroom.toml --candidates all --best 2 --out coverage.svg --write best.toml",
        Run("", &["k=1: ", "k=2: ", "wrote the poses to best.toml"]),
    ),
    (
        "grideye simulate scenes/experiment-3.toml --out walk.parquet",
        Run("", &[]),
    ),
    (
        "grideye simulate scenes/experiment-3.toml --out walk.gif --view room.svg",
        Run("", &[]),
    ),
    (
        "grideye distinguish scenes/scenario-b-before.toml scenes/scenario-b-after.toml",
        Run("", &["A + B + C"]),
    ),
    (
        "grideye view recording.csv --open",
        By(
            "tests/tests/page/demo.rs",
            "any_recording_is_played_and_nothing_is_kept",
        ),
    ),
    (
        "grideye demo --once --out out",
        By(
            PIPELINE,
            "the_demonstration_ends_with_delivery_scores_and_report",
        ),
    ),
    (
        "grideye emulate --scene scenes/experiment-1.toml -- i2cdetect -y 1",
        Run("", &["60: -- -- -- -- -- -- -- -- -- 69"]),
    ),
    (
        "grideye characterize empty-room.csv --profile my-sensor.toml",
        Run(
            "printf '[room]\\nsize_mm = [4000, 6000, 2700]\\nambient_c = 20\\n[[sensor]]\\nname = \"ceiling\"\\npreset = \"grid-eye\"\\nsampling_hz = 10\\nposition_mm = [2000, 3000, 2700]\\nelevation_deg = 90\\nazimuth_deg = 0\\n' > room.toml; grideye simulate room.toml --frames 600 --out empty-room.csv",
            &["its background is in the profile"],
        ),
    ),
    (
        "grideye calibrate --scene scenes/calibration.toml --recording walk.csv --out scenes/calibrated.toml",
        Run(
            "grideye simulate scenes/experiment-3.toml --out walk.csv",
            &["sensor.ceiling.elevation_deg", "agent.person.temperature_c"],
        ),
    ),
    (
        "grideye emulate --recording walk.csv --socket /tmp/amg.sock",
        Serves(WALK, &["/tmp/amg.sock"]),
    ),
    (
        "grideye enroll pi-1",
        Run("", &[",device=pi-1,token=grideye-"]),
    ),
    (
        "grideye token make ana --scope read",
        Run("", &["grideye-"]),
    ),
    ("grideye token list", Run("", &["no token yet"])),
    (
        "grideye token revoke pi-1",
        Run("grideye enroll pi-1", &["revoked "]),
    ),
    (
        "grideye collect --store frames.sqlite",
        Serves("", &["http://127.0.0.1:"]),
    ),
    (
        "grideye collect --store postgres://grideye@db.local/frames",
        By(
            "tests/tests/collectors/several.rs",
            "agents_that_move_between_three_collectors_lose_nothing_when_one_is_killed",
        ),
    ),
    (
        "grideye backup --store frames.sqlite monday.sqlite",
        By(
            "tests/tests/collectors/careless_store.rs",
            "a_backup_has_every_frame_that_was_acknowledged_before_it_and_is_restored_by_its_name",
        ),
    ),
    (
        "grideye restore monday.sqlite --store frames.sqlite",
        By(
            "crates/grideye-collector/tests/collector/overwritten.rs",
            "a_restore_waits_for_no_collector_and_keeps_the_store_that_it_replaces",
        ),
    ),
    (
        "pg_dump --format=custom --schema=grideye --file=frames.dump postgres://grideye@db.local/frames",
        By(
            "tests/tests/collectors/several.rs",
            "a_database_that_is_dumped_and_restored_is_the_same_store",
        ),
    ),
    (
        "pg_restore --no-owner --dbname=postgres://grideye@db.local/restored frames.dump",
        By(
            "tests/tests/collectors/several.rs",
            "a_database_that_is_dumped_and_restored_is_the_same_store",
        ),
    ),
    (
        "grideye migrate frames.sqlite postgres://grideye@db.local/frames",
        By(
            "tests/tests/collectors/several.rs",
            "a_migration_that_is_killed_goes_on_where_it_was_and_ends_with_the_same_books_and_frames",
        ),
    ),
    (
        "grideye record empty-room --seconds 60 --out empty-room.csv",
        By(
            PIPELINE,
            "what_arrives_is_recorded_under_a_name_and_fetched",
        ),
    ),
    (
        "grideye compare --scene scenes/experiment-1.toml --recording out/recording.csv",
        Run(
            "mkdir out; grideye simulate scenes/experiment-1.toml --seed 2 --out out/recording.csv",
            &["Agrees: "],
        ),
    ),
    (
        "grideye convert recordings/linaige/Session2_2021-07-01_RoomB_v2.csv session2.parquet",
        Run("", &[]),
    ),
    (
        "grideye convert frames.txt frames.parquet",
        Run(
            "for n in 1 2; do seq -s , 20 .25 35.75; done > frames.txt",
            &[],
        ),
    ),
    (
        "grideye convert walk.csv walk.parquet",
        Run(
            "{ printf when; printf ',p%d' $(seq 0 63); echo ,people; for n in 0 1 2; do printf 1790000000.$n; printf ',24.5%.0s' $(seq 64); echo ,1; done; } > walk.csv",
            &[],
        ),
    ),
    (
        "grideye audit --json",
        By(
            PIPELINE,
            "the_agent_delivers_from_a_device_file_to_a_collector",
        ),
    ),
];
