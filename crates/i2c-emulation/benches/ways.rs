//! Measures one call on `/dev/i2c-N`. `cargo bench -p i2c-emulation --bench ways`
//!
//! The client is this same program, started again with the device. To compare with another build of this benchmark, name
//! its file: `I2C_EMULATION_BENCH_OTHER=/path/to/ways-0123`. The two take turns, and the ratio is that of their best.
#![expect(
    unsafe_code,
    clippy::unwrap_used,
    reason = "the client makes the system calls that are measured, and what fails ends the benchmark"
)]

use std::convert::Infallible;
use std::ffi::OsStr;
use std::fs::File;
use std::hint::black_box;
use std::os::fd::{AsRawFd, RawFd};
use std::process::Command;
use std::time::Instant;

use embedded_hal::i2c::{ErrorType, I2c, Operation, SevenBitAddress};
use i2c_emulation::adapter::HalAdapter;
use i2c_emulation::program::{self, Options};
use i2c_emulation::rack::{Rack, SharedAdapter};

const ROLE: &str = "I2C_EMULATION_BENCH_DEVICE";
/// Another build of this benchmark.
const OTHER: &str = "I2C_EMULATION_BENCH_OTHER";
const TURNS: usize = 3;
const NUMBER: u32 = 7_777;
/// Calls per round. The fastest round counts, since every disturbance makes a round slower.
const CALLS: u32 = 100;
const ROUNDS: u32 = 400;
const KINDS: [&str; 5] = [
    "I2C_FUNCS",
    "I2C_SMBUS read of a byte",
    "I2C_RDWR write 1 + read 128",
    "another file: read 1 byte",
    "another file: open and close",
];

/// Answers at once, so that only the way is measured.
struct Instantly;

impl ErrorType for Instantly {
    type Error = Infallible;
}

impl I2c for Instantly {
    fn transaction(
        &mut self,
        _: SevenBitAddress,
        operations: &mut [Operation<'_>],
    ) -> Result<(), Infallible> {
        for operation in operations {
            if let Operation::Read(buffer) = operation {
                buffer.fill(0xA5);
            }
        }
        Ok(())
    }
}

fn main() {
    match std::env::var(ROLE) {
        Ok(device) => client(&device),
        Err(_) => measure(),
    }
}

fn measure() {
    println!("microseconds a call, best of {ROUNDS} rounds of {CALLS} calls\n");
    let other = std::env::var_os(OTHER);
    let (mut here, mut there): (Figures, Figures) = (Vec::new(), Vec::new());
    for _ in 0..TURNS {
        keep_best(&mut here, under_the_filter());
        if let Some(other) = &other {
            keep_best(&mut there, told_by(other));
        }
    }
    let without = figures(Command::new(std::env::current_exe().unwrap()).env(ROLE, ""));
    println!("| call | without | syscalls | other build | syscalls : other |");
    println!("|---|---|---|---|---|");
    let show = |figure: Option<f64>| figure.map_or("-".to_owned(), |figure| format!("{figure:.2}"));
    for (index, kind) in KINDS.iter().enumerate() {
        let figure = |figures: &Figures| figures.get(index).copied().flatten();
        let [without, here, there] = [&without, &here, &there].map(figure);
        let ratio = here.zip(there).map(|(here, there)| here / there);
        let [without, here, there, ratio] = [without, here, there, ratio].map(show);
        println!("| {kind} | {without} | {here} | {there} | {ratio} |");
    }
}

/// Microseconds by kind; none where a kind was not measured.
type Figures = Vec<Option<f64>>;

fn keep_best(best: &mut Figures, figures: Figures) {
    best.resize(figures.len(), None);
    for (best, figure) in best.iter_mut().zip(figures) {
        *best = [*best, figure].into_iter().flatten().reduce(f64::min);
    }
}

/// The third column of the table that another build prints.
fn told_by(program: &OsStr) -> Figures {
    let said = Command::new(program).env_remove(OTHER).output().unwrap();
    let said = String::from_utf8(said.stdout).unwrap();
    let of_kind = |kind: &&str| {
        let row = said
            .lines()
            .find(|line| line.starts_with(&format!("| {kind} |")));
        row?.split('|').nth(3)?.trim().parse().ok()
    };
    KINDS.iter().map(of_kind).collect()
}

fn under_the_filter() -> Figures {
    let mut rack = Rack::new();
    let bus = HalAdapter::with_faults(Instantly, |never| match *never {});
    rack.insert(NUMBER, SharedAdapter::new(bus));
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.env(ROLE, format!("/dev/i2c-{NUMBER}"));
    let file = tempfile::NamedTempFile::new().unwrap();
    command.stdout(file.reopen().unwrap());
    let ended = program::run(&rack, &Options::default(), &mut command).unwrap();
    assert!(ended.status.success());
    parse(&std::fs::read_to_string(file.path()).unwrap())
}

fn figures(command: &mut Command) -> Figures {
    parse(&String::from_utf8(command.output().unwrap().stdout).unwrap())
}

fn parse(text: &str) -> Figures {
    text.lines().map(|line| line.parse().ok()).collect()
}

/// Prints the microseconds of each kind of call, in the order of [`KINDS`].
fn client(device: &str) {
    let zero = File::open("/dev/zero").unwrap();
    if device.is_empty() {
        (0..3).for_each(|_| println!("-"));
    } else {
        let device = File::options().read(true).write(true).open(device).unwrap();
        let device = device.as_raw_fd();
        println!("{}", timed(|| functionality(device)));
        println!("{}", timed(|| smbus_byte(device)));
        println!("{}", timed(|| frame(device)));
    }
    println!("{}", timed(|| plain_read(zero.as_raw_fd())));
    println!(
        "{}",
        timed(|| drop(black_box(File::open("/dev/zero").unwrap())))
    );
}

fn timed(call: impl Fn()) -> f64 {
    let round = || {
        let start = Instant::now();
        (0..CALLS).for_each(|_| call());
        start.elapsed().as_secs_f64() * 1e6 / f64::from(CALLS)
    };
    (0..ROUNDS).map(|_| round()).fold(f64::INFINITY, f64::min)
}

fn functionality(device: RawFd) {
    let mut bits: libc::c_ulong = 0;
    // SAFETY: I2C_FUNCS writes an unsigned long.
    let result = unsafe { libc::ioctl(device, 0x0705, &raw mut bits) };
    assert!(result == 0 && black_box(bits) != 0);
}

#[repr(C)]
struct Smbus {
    read_write: u8,
    command: u8,
    size: u32,
    data: *mut u8,
}

fn smbus_byte(device: RawFd) {
    let mut data = [0u8; 34];
    let call = Smbus {
        read_write: 1,
        command: 0x0E,
        size: 2,
        data: data.as_mut_ptr(),
    };
    // SAFETY: I2C_SMBUS reads this structure and writes at most 34 bytes at `data`.
    let result = unsafe { libc::ioctl(device, 0x0720, &raw const call) };
    assert!(result == 0 && black_box(data)[0] == 0xA5);
}

#[repr(C)]
struct Message {
    address: u16,
    flags: u16,
    length: u16,
    buffer: *mut u8,
}

#[repr(C)]
struct Transfer {
    messages: *mut Message,
    count: u32,
}

fn frame(device: RawFd) {
    let mut register = [0x80u8];
    let mut pixels = [0u8; 128];
    let mut messages = [
        Message {
            address: 0x69,
            flags: 0,
            length: 1,
            buffer: register.as_mut_ptr(),
        },
        Message {
            address: 0x69,
            flags: 1,
            length: 128,
            buffer: pixels.as_mut_ptr(),
        },
    ];
    let transfer = Transfer {
        messages: messages.as_mut_ptr(),
        count: 2,
    };
    // SAFETY: I2C_RDWR reads these structures and writes only into the read message's buffer.
    let result = unsafe { libc::ioctl(device, 0x0707, &raw const transfer) };
    assert!(result == 2 && black_box(pixels)[127] == 0xA5);
}

fn plain_read(file: RawFd) {
    let mut byte = [1u8];
    // SAFETY: there is room for one byte.
    let result = unsafe { libc::read(file, byte.as_mut_ptr().cast(), 1) };
    assert!(result == 1 && black_box(byte)[0] == 0);
}
