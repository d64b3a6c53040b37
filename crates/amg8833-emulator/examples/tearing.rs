//! Prints the table of torn frames per way of reading: `cargo run --release -p amg8833-emulator --example tearing --
//! [READS]`.
#![expect(clippy::unwrap_used, reason = "what fails here has to end the program")]

#[path = "../tests/common/random.rs"]
mod random;
#[path = "../tests/common/tearing.rs"]
mod tearing;

fn main() {
    let reads = std::env::args().nth(1).map(|text| text.parse());
    let (table, _) = tearing::table(reads.unwrap_or(Ok(50_000)).unwrap());
    print!("{table}");
}
