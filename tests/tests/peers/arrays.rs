//! The files for numpy and other programs, read by those programs.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use grideye_tests::programs::{folder, root, run};
use grideye_tests::python::peer;

/// Runs a script of the peers with the program and a folder of its own, and prints what it measured.
fn script(name: &str, what: &str) {
    let out = tempfile::tempdir().unwrap();
    let Some(mut command) = peer(name, &[], what) else {
        return;
    };
    command
        .current_dir(root())
        .arg(folder().join("grideye"))
        .arg(out.path());
    let ended = run(&mut command);
    assert_eq!(ended.code, 0, "{}\n{}", ended.stdout, ended.stderr);
    println!("{}", ended.stdout);
}

#[test]
fn numpy_reads_what_simulate_writes() {
    script("npz.py", "arrays of simulated frames in numpy");
}

#[test]
fn a_dataset_is_the_same_in_numpy_pandas_pyarrow_polars_and_duckdb() {
    script(
        "dataset.py",
        "datasets in numpy, pandas, pyarrow, Polars and DuckDB",
    );
}

#[test]
fn keras_trains_with_the_documented_loader() {
    script("loader.py", "the documented loader in Keras on JAX");
}

#[test]
fn what_convert_writes_is_the_recording_to_every_reader() {
    script(
        "exports.py",
        "exports in numpy, pandas, pyarrow, Polars, DuckDB, Pillow, mcap-ros2-support and rosbags",
    );
}

#[test]
fn a_tracked_walk_becomes_a_recording_and_a_scene_that_agree() {
    script("tracked/check.py", "recordings of a tracked person");
}
