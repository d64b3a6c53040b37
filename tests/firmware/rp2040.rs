//! Firmware of an RP2040 without a library: I2C0, UART0 and a GPIO by the registers of its datasheet (RP-008371-DS, sections 4.3,
//! 4.2, 2.3.1 and 2.19.6). Reads the thermistor and a whole frame, switches INT on for pixels above 30 °C, and waits for it at GPIO 2.
#![no_std]
#![no_main]

use core::ptr::{read_volatile, write_volatile};

const UART0: usize = 0x4003_4000;
const I2C0: usize = 0x4004_4000;
const SIO_GPIO_IN: usize = 0xD000_0004;
const SENSOR: u32 = 0x69;

unsafe extern "C" {
    static STACK_TOP: u32;
}

#[repr(C)]
union Vector {
    stack: &'static u32,
    entry: unsafe extern "C" fn() -> !,
}

// The first two words that the processor reads.
#[unsafe(link_section = ".vectors")]
#[unsafe(no_mangle)]
static VECTORS: [Vector; 2] = [Vector { stack: unsafe { &STACK_TOP } }, Vector { entry: main }];

fn set(register: usize, value: u32) {
    unsafe { write_volatile(register as *mut u32, value) }
}

fn get(register: usize) -> u32 {
    unsafe { read_volatile(register as *const u32) }
}

fn say(text: &[u8]) {
    for byte in text {
        set(UART0, u32::from(*byte));
    }
}

fn say_hex(word: u16) {
    for shift in [12, 8, 4, 0] {
        say(&[b"0123456789abcdef"[usize::from(word >> shift & 0xF)]]);
    }
}

/// Reads bytes from a register on, in one transaction; the abort source if nobody acknowledges.
fn read(address: u32, first: u8, bytes: &mut [u8]) -> u32 {
    set(I2C0 + 0x6C, 0); // IC_ENABLE
    set(I2C0 + 0x04, address); // IC_TAR
    set(I2C0 + 0x1C, 120); // IC_FS_SCL_HCNT and _LCNT: 400 kHz of 125 MHz
    set(I2C0 + 0x20, 192);
    set(I2C0 + 0x6C, 1);
    set(I2C0 + 0x10, u32::from(first)); // IC_DATA_CMD
    let last = bytes.len() - 1;
    for (at, byte) in bytes.iter_mut().enumerate() {
        let restart = u32::from(at == 0) << 10;
        let stop = u32::from(at == last) << 9;
        set(I2C0 + 0x10, 1 << 8 | restart | stop);
        while get(I2C0 + 0x78) == 0 {
            // IC_RXFLR; IC_TX_ABRT_SOURCE
            let aborted = get(I2C0 + 0x80);
            if aborted != 0 {
                return aborted;
            }
        }
        *byte = get(I2C0 + 0x10) as u8;
    }
    while get(I2C0 + 0x70) & 1 << 5 != 0 {} // IC_STATUS, MST_ACTIVITY
    0
}

fn write(register: u8, value: u8) {
    set(I2C0 + 0x10, u32::from(register));
    set(I2C0 + 0x10, u32::from(value) | 1 << 9);
    while get(I2C0 + 0x70) & 0x24 != 0x04 {} // IC_STATUS: MST_ACTIVITY and TFE
}

fn word(bytes: &[u8]) -> u16 {
    u16::from(bytes[0]) | u16::from(bytes[1]) << 8
}

unsafe extern "C" fn main() -> ! {
    let mut pixels = [0; 128];
    let mut thermistor = [0; 2];
    set(UART0 + 0x30, 0x301); // UARTCR: on
    set(0x4001_C00C, 1 << 6); // GPIO2 of PADS_BANK0: input
    set(0x4001_4014, 5); // GPIO2_CTRL of IO_BANK0: SIO
    read(SENSOR, 0x0E, &mut thermistor);
    say_hex(word(&thermistor));
    say(b"\n");
    read(SENSOR, 0x80, &mut pixels);
    for pixel in pixels.chunks(2) {
        say_hex(word(pixel));
        say(b" ");
    }
    for (register, value) in [(0x08, 120), (0x09, 0), (0x03, 0x03)] {
        write(register, value);
    }
    let nobody = read(0x20, 0, &mut thermistor);
    say(if nobody & 1 != 0 { b"\nnobody" } else { b"\nsomebody" });
    say(b"\nread all\n");
    while get(SIO_GPIO_IN) & 1 << 2 != 0 {}
    say(b"interrupt\n");
    loop {}
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}
