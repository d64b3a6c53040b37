//! One decoder, named by `GRIDEYE_FUZZ_DECODER`, fed by libFuzzer.

#![no_main]

mod decoders;

use decoders::DECODERS;
use libfuzzer_sys::fuzz_target;
use std::sync::OnceLock;

fuzz_target!(|data: &[u8]| {
    static DECODER: OnceLock<fn(&[u8])> = OnceLock::new();
    DECODER.get_or_init(decoder)(data);
});

fn decoder() -> fn(&[u8]) {
    let asked = std::env::var("GRIDEYE_FUZZ_DECODER");
    let found = DECODERS
        .iter()
        .find(|(name, _)| asked.as_deref() == Ok(name));
    let Some((_, decoder)) = found else {
        let names = DECODERS.map(|(name, _)| name).join(", ");
        panic!("GRIDEYE_FUZZ_DECODER: expected one of {names}, found {asked:?}")
    };
    *decoder
}
