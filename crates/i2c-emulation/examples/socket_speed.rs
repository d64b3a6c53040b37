//! Measures the socket: frame and byte reads in this process, and from Python over the socket.
//!
//! `cargo run --release -p i2c-emulation --example socket_speed` prints microseconds, reads per second and ratios.
#![expect(clippy::unwrap_used, reason = "a measurement that fails has no result")]

use std::path::Path;
use std::process::Command;
use std::time::Instant;

use embedded_hal::i2c::Operation;
use i2c_emulation::adapter::{EmulatedAdapter, Message, TransferError};
use i2c_emulation::rack::{Rack, SharedAdapter};
use i2c_emulation::socket::{Options, Server};

const REPEATS: u32 = 60;
const READS: u32 = 1_000;
const READS_IN_PROCESS: u32 = 100_000;

/// 256 registers; a minimal target, so that the way is measured and not the target.
struct Registers([u8; 256], u8);

impl EmulatedAdapter for Registers {
    fn transfer(&mut self, messages: &mut [Message<'_>]) -> Result<(), TransferError> {
        for message in messages {
            match &mut message.operation {
                Operation::Write(bytes) => self.1 = bytes.first().copied().unwrap_or(self.1),
                Operation::Read(buffer) => {
                    for byte in buffer.iter_mut() {
                        *byte = self.0[usize::from(self.1)];
                        self.1 = self.1.wrapping_add(1);
                    }
                }
            }
        }
        Ok(())
    }
}

fn main() {
    let mut bus = SharedAdapter::new(Registers(std::array::from_fn(|n| n.to_le_bytes()[0]), 0));
    let near = best_microseconds(READS_IN_PROCESS, || read_frame_near(&mut bus));
    row("in process, write 1 + read 128", near, near);

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bus.sock");
    let mut rack = Rack::new();
    rack.insert(1, bus);
    let server = Server::bind(&path, rack, Options::default()).unwrap();
    let stop = server.stop_handle();
    let serving = std::thread::spawn(move || server.serve());

    python_rows(&path, near);

    stop.stop();
    serving.join().unwrap();
}

fn read_frame_near(bus: &mut SharedAdapter) {
    let mut frame = [0; 128];
    let message = |operation| Message {
        address: 0x69,
        ten_bit: false,
        operation,
    };
    bus.transfer(&mut [
        message(Operation::Write(std::hint::black_box(&[0x80]))),
        message(Operation::Read(std::hint::black_box(&mut frame))),
    ])
    .unwrap();
    std::hint::black_box(frame);
}

/// The best of [`REPEATS`] short runs, in microseconds per call: on a busy machine, the shortest was disturbed least.
fn best_microseconds(calls: u32, mut call: impl FnMut()) -> f64 {
    (0..REPEATS)
        .map(|_| {
            let begin = Instant::now();
            (0..calls).for_each(|_| call());
            begin.elapsed().as_secs_f64() / f64::from(calls) * 1e6
        })
        .fold(f64::INFINITY, f64::min)
}

fn python_rows(path: &Path, near: f64) {
    let script = format!(
        "import timeit\n\
         from grideye_i2c import SMBus, I2C, i2c_msg\n\
         bus, i2c, frame = SMBus(1), I2C(), bytearray(128)\n\
         def opened():\n\
         \x20   with SMBus(1) as fresh: fresh.read_byte_data(0x69, 0x80)\n\
         def row(name, call, number={READS} // 2):\n\
         \x20   best = min(timeit.repeat(call, number=number, repeat={REPEATS})) / number * 1e6\n\
         \x20   print('%s;%f' % (name, best))\n\
         row('SMBus.i2c_rdwr, write 1 + read 128', lambda: bus.i2c_rdwr(i2c_msg.write(0x69, [0x80]), i2c_msg.read(0x69, 128)))\n\
         row('I2C.writeto_then_readfrom, write 1 + read 128', lambda: i2c.writeto_then_readfrom(0x69, b'\\x80', frame))\n\
         row('SMBus.read_i2c_block_data, 32 bytes', lambda: bus.read_i2c_block_data(0x69, 0x80, 32))\n\
         row('SMBus.read_byte_data', lambda: bus.read_byte_data(0x69, 0x80))\n\
         row('open, SMBus.read_byte_data, close (as melopero)', opened)\n"
    );
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("python");
    let output = Command::new("python3")
        .args(["-c", &script])
        .env("PYTHONPATH", folder)
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .env("GRIDEYE_I2C_SOCKET", path)
        .output();
    match output {
        Ok(output) if output.status.success() => {
            for line in String::from_utf8_lossy(&output.stdout).lines() {
                let (name, microseconds) = line.split_once(';').unwrap();
                row(
                    &format!("Python {name}"),
                    microseconds.parse().unwrap(),
                    near,
                );
            }
        }
        Ok(output) => eprintln!("{}", String::from_utf8_lossy(&output.stderr)),
        Err(error) => eprintln!("LEFT OUT: the Python client: {error}"),
    }
}

fn row(name: &str, microseconds: f64, near: f64) {
    println!(
        "{name:<62} {microseconds:8.2} us {:10.0} /s {:7.0} x in process",
        1e6 / microseconds,
        microseconds / near
    );
}
