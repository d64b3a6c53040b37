//! Checks `CONFORMANCE.md` against the tests and options: each row has its tests here, and each of them exists.

use std::collections::BTreeSet;
use std::path::Path;

const OPTIONS: &str = "## Where sources disagree\n";
const STATEMENTS: &str = "## What the emulator does\n";

/// The options of the page, each with the tests of its readings.
const TESTS_OF_OPTIONS: &[(&str, &[&str])] = &[
    ("stand_by", &["stand_by_in_the_three_readings"]),
    (
        "initial_reset",
        &[
            "an_initial_reset_holds_the_settings_or_restores_defaults_by_option",
            "settings_written_before_an_initial_reset_survive_it",
        ],
    ),
    (
        "status_clear",
        &["the_status_clear_register_clears_the_table_by_option"],
    ),
    (
        "interrupt_flag",
        &[
            "flag_and_table_hold_until_cleared_by_option",
            "a_flag_reset_releases_what_only_the_hysteresis_holds",
        ],
    ),
    ("overflow_flag", &["the_overflow_flags_in_both_readings"]),
    (
        "thermistor_overflow_flag",
        &["the_thermistors_overflow_by_option"],
    ),
    (
        "thermistor_at_power_on",
        &["the_thermistor_at_power_on_by_option"],
    ),
    ("thermistor_update", &["the_thermistor_in_both_readings"]),
    (
        "average_readback",
        &["the_moving_average_may_read_zero_by_option"],
    ),
    (
        "warm_up",
        &[
            "the_two_frames_after_an_initial_reset_in_both_readings",
            "two_frames_at_one_fps_are_two_means_and_the_rate_can_still_change",
        ],
    ),
    (
        "after_wake",
        &[
            "sleep_to_normal_without_a_reset_goes_on_with_the_next_tick",
            "nothing_is_certain_between_wake_and_reset_by_option",
            "a_sensor_that_never_slept_is_never_undefined",
        ],
    ),
    (
        "sleep_image",
        &[
            "line_8_the_sleep_image_and_the_only_write_that_wakes",
            "line_8_another_sleep_image_by_option",
            "the_mode_reads_by_turns_in_sleep_by_option",
        ],
    ),
    (
        "freezes_on_fast_wake",
        &[
            "a_wake_too_fast_freezes_by_option",
            "a_wake_too_fast_freezes_by_fault",
        ],
    ),
    (
        "zero_levels",
        &[
            "int_as_data_ready",
            "line_7_levels_of_zero_trip_on_any_change_or_on_any_pixel_but_zero",
            "levels_that_are_not_all_zero_are_compared_whatever_the_option",
        ],
    ),
    (
        "interrupt_output",
        &[
            "the_idle_pin_is_driven_by_option",
            "the_int_pin_is_an_input_pin_beside_the_driver",
        ],
    ),
    (
        "unspecified_bits",
        &[
            "upper_nibbles_read_zero",
            "unspecified_bits_read_ones_by_option",
        ],
    ),
    (
        "past_the_end",
        &[
            "line_2_past_the_end_reading_goes_on_at_the_start",
            "the_pointer_stays_at_the_end_by_option",
        ],
    ),
    ("silent_start", &["the_silent_start_by_option"]),
    (
        "clock_error_ppm",
        &["a_sensor_four_percent_slow_gives_576_frames_a_minute"],
    ),
    (
        "clock_drift",
        &[
            "a_drifting_day_has_the_frames_of_the_integral",
            "a_drift_curve_counts_from_power_on_and_restarts_with_it",
            "a_drift_by_call_over_a_day_loses_nothing",
        ],
    ),
    ("phase", &["the_source_is_asked_for_the_times_of_the_ticks"]),
    (
        "catch_up_frames_max",
        &[
            "a_day_at_ten_frames_a_second_is_exact",
            "the_frames_to_catch_up_can_be_few",
            "a_stall_does_not_move_the_second_at_one_fps",
        ],
    ),
];

/// The statements of the page, each with the tests that hold it.
const TESTS_OF_STATEMENTS: &[(&str, &[&str])] = &[
    (
        "addresses 0x68 and 0x69, no others",
        &["only_the_sensors_addresses_are_acknowledged"],
    ),
    (
        "256 registers of 8 bits, all readable; always acknowledges; no identification; unknown values never block the sensor",
        &["line_4_every_register_answers_and_nothing_wedges_the_sensor"],
    ),
    (
        "reserved and read-only registers take writes and ignore them (counted in `Refusals`); reserved, SCLR and 0x1F read 0x00; FPSC and levels keep only their bits",
        &["line_4_write_only_reserved_and_read_only_registers_keep_nothing"],
    ),
    (
        "RST, AVE, 0x06 can be read before a write, and each register after one",
        &[
            "every_setting_can_be_read_before_it_is_written",
            "a_read_behind_each_write_is_of_the_register_after_it",
        ],
    ),
    (
        "low byte at the even address; every printed row of the datasheet",
        &["the_datasheets_rows_through_the_registers"],
    ),
    (
        "pixels and levels: 12-bit two's complement, 0.25 °C",
        &[
            "pixels_of_the_datasheet",
            "levels_of_the_datasheet",
            "every_pixel_word_means_its_own_steps",
            "pixels",
        ],
    ),
    (
        "thermistor: sign and magnitude, 0.0625 °C; 0x800 is -0",
        &[
            "thermistor_of_the_datasheet",
            "nearest_step_and_no_negative_zero_by_rounding",
            "every_thermistor_word_comes_back_from_a_replay",
            "thermistor",
        ],
    ),
    (
        "no clamping at 0 °C: cold objects read down to -50 °C and below",
        &["nothing_is_clamped_at_zero"],
    ),
    (
        "values saturate at 0x7FF and 0x800 with OVF_IRS, which stays until cleared; what is not a number reads 0x7FF",
        &[
            "words_saturate",
            "a_value_that_is_no_number_is_an_overflow",
            "the_overflow_stays_until_cleared",
        ],
    ),
    (
        "SCLR clears STAT bit by bit",
        &["the_status_clear_register_clears_what_is_selected_and_reads_zero"],
    ),
    (
        "INTn bit b is pixel 8n+b+1",
        &["each_pixel_has_its_bit_in_the_table"],
    ),
    (
        "acknowledges empty writes, bare reads at a stale pointer, empty reads and probes, in every mode",
        &[
            "line_1_empty_writes_and_bare_reads_are_acknowledged",
            "line_5_empty_reads_are_fine",
            "probes_are_acknowledged_in_every_mode",
        ],
    ),
    (
        "reads of any length, in any chunks, after STOP or repeated START; the pointer stays",
        &[
            "line_2_every_way_of_reading_a_frame_gives_the_same_bytes",
            "line_2_chunks_after_repeated_starts_continue_where_the_last_ended",
            "line_2_odd_starts_begin_in_the_middle_of_a_pixel",
            "the_pointer_continues_across_stops",
        ],
    ),
    (
        "writes advance the pointer; one byte too many shifts the value",
        &[
            "line_3_writing_moves_the_pointer_on",
            "a_byte_too_many_shifts_the_value_to_the_next_register",
            "writes_without_a_stop",
        ],
    ),
    (
        "pairs after repeated STARTs, or an address alone",
        &[
            "pairs_after_repeated_starts_in_one_transaction",
            "an_address_alone_before_a_repeated_start",
        ],
    ),
    (
        "more than nine clocks with SDA high, then STOP, free the bus",
        &["clocks_and_a_stop_free_the_bus_wherever_a_transfer_was_left"],
    ),
    (
        "9 bits a byte at the bus's frequency; no clock stretching. Set-up and hold times are not emulated",
        &[
            "a_frame_costs_what_the_reference_says",
            "a_stop_in_between_costs_a_bit",
            "odd_frequencies_lose_no_time_over_many_transfers",
            "a_burst_takes_its_bits_and_no_more",
        ],
    ),
    (
        "one transaction never mixes frames, nor pixels with the interrupt table",
        &[
            "a_frame_that_falls_due_in_an_open_transaction_waits_for_stop",
            "a_burst_over_the_wire_never_mixes_and_two_transactions_can",
            "several_reads_in_one_transaction_are_one_snapshot",
            "the_table_belongs_to_the_same_snapshot",
            "a_frame_that_trips_during_the_clearing_trips_after_it",
        ],
    ),
    (
        "several transactions tear as often as their time predicts",
        &[
            "each_way_of_reading_tears_as_often_as_its_time_says",
            "the_estimates_of_the_reference_are_of_the_right_size",
        ],
    ),
    (
        "faults are the controller's errors (Errno 121 and 5)",
        &["faults_of_the_bus_are_the_controllers_errors"],
    ),
    (
        "PCTL 0x00, 0x10, 0x20, 0x21; other values keep the mode",
        &[
            "the_modes_and_their_transitions",
            "from_one_stand_by_to_the_other_the_interval_restarts",
        ],
    ),
    (
        "in sleep only PCTL = 0x00 has an effect, and nothing is measured",
        &["years_asleep_cost_nothing"],
    ),
    (
        "wake: 0x00, 50 ms, 0x3F, 2 ms, 0x30, two frames",
        &["the_wake_sequence_of_the_datasheet"],
    ),
    (
        "stand-by measures every 60 or 10 s, with INT",
        &[
            "stand_by_measures_every_ten_or_sixty_seconds",
            "stand_by_still_interrupts",
        ],
    ),
    (
        "RST 0x30 clears flags and table; 0x3F pixels too; a power cycle everything; other bytes nothing",
        &[
            "the_table_of_resets",
            "no_other_byte_resets_anything",
            "nothing_panics_and_a_power_cycle_leaves_nothing",
        ],
    ),
    (
        "pixels are 0 until the first frame, two frames after 0x3F",
        &[
            "line_6_pixels_are_zero_until_the_first_frame",
            "line_6_an_initial_reset_empties_the_pixels_for_two_frames_and_no_more",
            "nothing_trips_during_the_two_frames",
            "a_change_of_mode_does_not_shorten_the_warm_up",
        ],
    ),
    (
        "10 fps; polling faster gives the same frame",
        &["ten_frames_a_second_each_once"],
    ),
    (
        "1 fps is the mean of ten internal frames; a change of rate starts it again",
        &[
            "one_frame_a_second_is_the_mean_of_the_last_ten",
            "means_are_taken_before_the_quantization",
            "a_change_of_rate_restarts_both_averages",
        ],
    ),
    (
        "the moving average is of two output frames, and only with its key",
        &[
            "line_9_the_moving_average_needs_its_key",
            "line_9_the_key_in_one_transaction",
            "line_9_keys_that_drivers_got_wrong",
            "the_moving_average_halves_a_step",
            "the_moving_average_at_one_frame_a_second_is_of_two_means_of_ten",
        ],
    ),
    (
        "trip beyond a level, not on it; release a hysteresis inside, or never if it is beyond the level",
        &[
            "absolute_mode_trips_beyond_a_level_not_on_it_and_releases_a_hysteresis_inside",
            "a_hysteresis_beyond_the_level_never_releases",
        ],
    ),
    (
        "difference mode: the signed change since the previous frame; 0 in the first",
        &[
            "difference_mode_compares_with_the_frame_before",
            "extreme_differences_stay_within_twelve_bits",
            "the_first_frame_after_a_wake_or_reset_has_nothing_to_differ_from",
        ],
    ),
    (
        "INTF is set whatever INTEN is; cleared while a pixel is outside, it comes back",
        &["the_flag_does_not_need_the_pin_and_the_pin_needs_the_flag"],
    ),
    (
        "frozen, glitching, torn, drifting, restarting sensors; stuck lines",
        &[
            "a_frozen_sensor_answers_and_measures_no_more",
            "a_glitch_spoils_frames_and_trips_the_interrupt",
            "a_glitch_without_a_pixel_strikes_any",
            "torn_registers_do_not_stand_still",
            "a_brown_out_silently_restores_the_defaults",
            "stuck_lines_read_all_ones_or_all_zeros",
        ],
    ),
];

/// The first cells of the rows between a heading and the next one.
fn first_cells(heading: &str) -> Vec<String> {
    let page = std::fs::read_to_string("CONFORMANCE.md").unwrap();
    let (_, section) = page.split_once(heading).unwrap();
    let section = section.split("\n## ").next().unwrap();
    let mut found = Vec::new();
    let mut lines = section.lines().peekable();
    while let Some(line) = lines.next() {
        let is_head = lines.peek().is_some_and(|next| next.starts_with("|---"));
        if !line.starts_with("| ") || is_head {
            continue;
        }
        let cells = line.trim_matches('|').split('|').map(str::trim);
        let cells: Vec<&str> = cells.collect();
        assert!(cells.iter().all(|cell| !cell.is_empty()), "{line}");
        found.push(cells[0].to_owned());
    }
    found
}

/// Reads the names of all `#[test]` functions in this folder and below.
fn tests(folder: &Path, found: &mut BTreeSet<String>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() && !path.ends_with("target") {
            tests(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let text = std::fs::read_to_string(&path).unwrap();
            for behind in text.split("#[test]").skip(1) {
                let name = behind.split("fn ").nth(1).unwrap();
                found.insert(name.split('(').next().unwrap().to_owned());
            }
        }
    }
}

/// All tests of this crate.
fn tests_of_the_crate() -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for folder in ["src", "tests", "third-party/tests"] {
        tests(Path::new(folder), &mut found);
    }
    found
}

fn named() -> impl Iterator<Item = (&'static str, &'static str)> {
    let rows = TESTS_OF_OPTIONS.iter().chain(TESTS_OF_STATEMENTS);
    rows.flat_map(|(row, tests)| tests.iter().map(|test| (*row, *test)))
}

#[test]
fn every_row_of_the_page_has_tests_and_each_exists() {
    let options = first_cells(OPTIONS);
    let options: Vec<&str> = options.iter().map(|cell| cell.trim_matches('`')).collect();
    let known: Vec<&str> = TESTS_OF_OPTIONS.iter().map(|(option, _)| *option).collect();
    assert_eq!(options, known, "left the page, right its tests");
    let known: Vec<&str> = TESTS_OF_STATEMENTS
        .iter()
        .map(|(statement, _)| *statement)
        .collect();
    assert_eq!(
        first_cells(STATEMENTS),
        known,
        "left the page, right its tests"
    );
    let found = tests_of_the_crate();
    assert!(found.contains("every_row_of_the_page_has_tests_and_each_exists"));
    for (row, tests) in TESTS_OF_OPTIONS.iter().chain(TESTS_OF_STATEMENTS) {
        assert!(!tests.is_empty(), "\"{row}\" has no test");
    }
    for (row, name) in named() {
        assert!(
            found.contains(name),
            "\"{row}\" names {name}, which is no test"
        );
    }
}

/// Tests that are named after a line of what the drivers need, `line_1_…` to `line_9_…`.
#[test]
fn every_line_that_the_drivers_need_is_there() {
    let found = tests_of_the_crate();
    let named: BTreeSet<&str> = named().map(|(_, name)| name).collect();
    for line in 1..=9 {
        let prefix = format!("line_{line}_");
        let of_the_line = || found.iter().filter(|name| name.starts_with(&prefix));
        assert!(of_the_line().next().is_some(), "{prefix}");
        for name in of_the_line() {
            assert!(
                named.contains(name.as_str()),
                "no row of the page has {name}"
            );
        }
    }
}

/// Each option exists because sources or sensors differ, and the page says how.
#[test]
fn every_option_has_its_row() {
    let source = std::fs::read_to_string("src/device/options.rs").unwrap();
    let fields = source.split("pub struct Options {").nth(1).unwrap();
    let fields = fields.split("\n}").next().unwrap();
    let options: BTreeSet<&str> = fields
        .lines()
        .filter_map(|line| line.trim().strip_prefix("pub "))
        .filter_map(|line| line.split(':').next())
        .collect();
    assert!(options.len() >= 21, "{options:?}");
    let rows = first_cells(OPTIONS);
    let named: BTreeSet<&str> = rows.iter().map(|cell| cell.trim_matches('`')).collect();
    assert_eq!(named, options);
}
