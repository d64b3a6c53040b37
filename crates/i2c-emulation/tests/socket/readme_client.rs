use embedded_hal::i2c::I2c;
use i2c_emulation::socket::{Client, ClientError};

/// One frame of the sensor at 0x69 on bus 1: 64 pixels of two bytes.
fn read_frame(socket: &str) -> Result<[u8; 128], ClientError> {
    let mut bus = Client::connect(socket, 1)?;
    let mut frame = [0; 128];
    bus.write_read(0x69, &[0x80], &mut frame)?;
    Ok(frame)
}
