//! Prints the room's temperature and the position of any person, from the sensor at 0x69 on
//! /dev/i2c-1.

use grideye::{Address, GridEye};
use linux_embedded_hal::I2cdev;
use presence::{picture, room_c, somebody};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut sensor = GridEye::new(I2cdev::new("/dev/i2c-1")?, Address::Standard);
    let picture = picture(&mut sensor)?;
    println!("room {:.2} °C", room_c(&picture));
    for (row, column) in somebody(&picture) {
        let celsius = picture[row][column];
        println!("row {row} column {column}: {celsius:.2} °C");
    }
    Ok(())
}
