//! The shipped program with the sensor at /dev/i2c-1, which shows `room.toml`.

use std::process::Command;

#[test]
fn the_program_says_where_the_person_is() {
    let output = Command::new(env!("CARGO_BIN_EXE_presence"))
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    let said = String::from_utf8(output.stdout).unwrap();
    println!("{said}");
    let mut lines = said.lines();
    let room = lines.next().unwrap();
    assert!(
        ["room 19.25 °C", "room 19.50 °C", "room 19.75 °C"].contains(&room),
        "{said}"
    );
    let places: Vec<&str> = lines.map(|line| line.split(':').next().unwrap()).collect();
    let person = [
        "row 2 column 0",
        "row 2 column 1",
        "row 3 column 0",
        "row 3 column 1",
    ];
    assert_eq!(places, person);
}
