//! What the datasheet promises, and what it leaves open. Sections are those of its 2016 edition ("AMG88 spec").

use crate::sensor::{Fault, Sensor};
use amg8833::{
    FrameRate, InterruptControl, InterruptLevels, InterruptMode, MovingAverage, Settings, Status,
    word,
};
use grideye_frame::{Celsius, PIXELS};
use std::time::Duration;

pub(crate) struct Outcome {
    pub(crate) passed: bool,
    pub(crate) measured: String,
}

type Check = fn(&mut Sensor) -> Result<Outcome, Fault>;
type Question = fn(&mut Sensor) -> Result<String, Fault>;

pub(crate) const ALL: [(&str, Check); 8] = [
    ("settings are kept (4-10)", settings_are_kept),
    ("temperatures within the range (4-4)", temperatures),
    ("unused bits of a word are 0 (4-11-9, 4-11-11)", unused_bits),
    ("10 frames a second (4-11-3)", ten_frames),
    ("1 frame a second (4-11-3)", one_frame),
    (
        "interrupt table and flag above the level (4-11-8, 4-11-10)",
        interrupt,
    ),
    (
        "no interrupt within the levels (4-11-5, 4-11-6)",
        no_interrupt,
    ),
    ("frames go on after sleep and wake (4-11-1)", sleep_and_wake),
];

pub(crate) const QUESTIONS: [(&str, Question); 5] = [
    (
        "moving average, read back after it was switched on (4-11-7)",
        average_read_back,
    ),
    (
        "interrupt table after the flag was cleared (4-11-6, 4-11-10)",
        table_after_clear,
    ),
    (
        "levels after the initial reset (4-11-2)",
        levels_after_reset,
    ),
    (
        "thermistor and power registers in sleep (4-11-1)",
        sleep_image,
    ),
    (
        "settings after sleep and wake (4-11-1, 4-11-2)",
        settings_after_wake,
    ),
];

/// Settings that no register has after power-on.
fn unusual() -> Settings {
    Settings {
        frame_rate: FrameRate::One,
        interrupt: InterruptControl {
            pin_active: true,
            mode: InterruptMode::Absolute,
        },
        ..Settings::default()
    }
}

fn settings_are_kept(sensor: &mut Sensor) -> Result<Outcome, Fault> {
    let settings = unusual();
    sensor.start(&settings)?;
    let deviation = sensor.driver().configuration()?.deviation(&settings);
    Ok(Outcome {
        passed: deviation.is_none(),
        measured: deviation.map_or_else(|| "as written".to_owned(), |found| found.to_string()),
    })
}

fn temperatures(sensor: &mut Sensor) -> Result<Outcome, Fault> {
    sensor.start(&Settings::default())?;
    let frame = word::frame(&sensor.driver().read_frame()?);
    let pixels = frame.pixels.map(Celsius::get);
    let (lowest, highest) = pixels
        .iter()
        .fold((f32::MAX, f32::MIN), |(low, high), pixel| {
            (low.min(*pixel), high.max(*pixel))
        });
    let thermistor = frame.thermistor.get();
    Ok(Outcome {
        // The high-gain type measures 0 to 80 °C, within 2.5 °C; the thermistor -20 to 80 °C.
        passed: lowest >= -2.5 && highest <= 82.5 && (-20.0..=80.0).contains(&thermistor),
        measured: format!("pixels {lowest} to {highest} °C, thermistor {thermistor} °C"),
    })
}

fn unused_bits(sensor: &mut Sensor) -> Result<Outcome, Fault> {
    let pixels: [u8; 2 * PIXELS] = sensor.registers(0x80)?;
    let thermistor: [u8; 2] = sensor.registers(0x0E)?;
    let high = pixels
        .chunks_exact(2)
        .chain([&thermistor[..]])
        .map(|word| word[1]);
    let set = high.filter(|byte| byte & 0xF0 != 0).count();
    Ok(Outcome {
        passed: set == 0,
        measured: format!("{set} of 65 words have one set"),
    })
}

fn ten_frames(sensor: &mut Sensor) -> Result<Outcome, Fault> {
    sensor.start(&Settings::default())?;
    frames(sensor, FrameRate::Ten, Duration::from_secs(3))
}

fn one_frame(sensor: &mut Sensor) -> Result<Outcome, Fault> {
    sensor.start(&Settings {
        frame_rate: FrameRate::One,
        ..Settings::default()
    })?;
    frames(sensor, FrameRate::One, Duration::from_secs(6))
}

/// A frame may equal the one before, so fewer changes than frames are no fault; more are, or two within a period.
fn frames(sensor: &mut Sensor, rate: FrameRate, time: Duration) -> Result<Outcome, Fault> {
    let seen = sensor.watch(time, rate)?;
    let nominal = time.as_secs_f64() * f64::from(rate.fps());
    let changes = f64::from(u32::try_from(seen.changes.len()).unwrap_or(u32::MAX));
    let gap = seen.shortest_gap();
    let is_apart = gap.is_none_or(|gap| gap >= rate.period() * 8 / 10);
    let nearest = gap.map_or_else(String::new, |gap| {
        format!(", the nearest two {} ms apart", gap.as_millis())
    });
    Ok(Outcome {
        passed: changes >= 0.5 * nominal && changes <= 1.1 * nominal + 1.0 && is_apart,
        measured: format!("{changes} changes in {} s{nearest}", time.as_secs()),
    })
}

/// Levels that every pixel is above.
fn below_all(sensor: &mut Sensor) -> Result<InterruptLevels, Fault> {
    let pixels = sensor
        .driver()
        .read_pixels()?
        .map(|pixel| word::pixel_celsius(pixel).get());
    let upper = pixels.into_iter().fold(f32::MAX, f32::min) - 5.0;
    let levels = InterruptLevels::new(
        Celsius::new(upper),
        Celsius::new(upper - 5.0),
        Celsius::new(0.0),
    );
    levels.map_err(|error| Fault::Bus(error.to_string()))
}

fn set_off(sensor: &mut Sensor) -> Result<(), Fault> {
    sensor.start(&Settings {
        interrupt: InterruptControl {
            pin_active: false,
            mode: InterruptMode::Absolute,
        },
        ..Settings::default()
    })?;
    let levels = below_all(sensor)?;
    sensor.driver().set_interrupt_levels(&levels)?;
    sensor.let_frames_pass();
    Ok(())
}

fn interrupt(sensor: &mut Sensor) -> Result<Outcome, Fault> {
    set_off(sensor)?;
    let (pixels, flag) = (
        sensor.driver().interrupt_table()?.len(),
        sensor.driver().status()?.interrupt,
    );
    Ok(Outcome {
        passed: pixels == PIXELS && flag,
        measured: format!("{pixels} of 64 pixels in the table, flag {flag}"),
    })
}

fn no_interrupt(sensor: &mut Sensor) -> Result<Outcome, Fault> {
    sensor
        .driver()
        .set_interrupt_levels(&InterruptLevels::NEVER)?;
    sensor.let_frames_pass();
    sensor.driver().clear_flags(Status::ALL)?;
    sensor.let_frames_pass();
    let (pixels, flag) = (
        sensor.driver().interrupt_table()?.len(),
        sensor.driver().status()?.interrupt,
    );
    Ok(Outcome {
        passed: pixels == 0 && !flag,
        measured: format!("{pixels} of 64 pixels in the table, flag {flag}"),
    })
}

fn sleep_and_wake(sensor: &mut Sensor) -> Result<Outcome, Fault> {
    sensor.sleep()?;
    sensor.start(&Settings::default())?;
    frames(sensor, FrameRate::Ten, Duration::from_secs(2))
}

fn average_read_back(sensor: &mut Sensor) -> Result<String, Fault> {
    sensor.driver().set_moving_average(MovingAverage::Twice)?;
    let found = sensor.driver().moving_average()?;
    sensor.driver().set_moving_average(MovingAverage::Off)?;
    Ok(format!("{found:?}"))
}

fn table_after_clear(sensor: &mut Sensor) -> Result<String, Fault> {
    set_off(sensor)?;
    sensor.driver().clear_flags(Status::ALL)?;
    Ok(format!(
        "{} of 64 pixels",
        sensor.driver().interrupt_table()?.len()
    ))
}

fn levels_after_reset(sensor: &mut Sensor) -> Result<String, Fault> {
    let before = sensor.driver().interrupt_levels()?;
    sensor.initial_reset()?;
    Ok(kept(before == sensor.driver().interrupt_levels()?))
}

fn sleep_image(sensor: &mut Sensor) -> Result<String, Fault> {
    sensor.sleep()?;
    let ([power], thermistor): ([u8; 1], [u8; 2]) =
        (sensor.registers(0x00)?, sensor.registers(0x0E)?);
    sensor.wake()?;
    Ok(format!("power {power:#04x}, thermistor {thermistor:02x?}"))
}

fn settings_after_wake(sensor: &mut Sensor) -> Result<String, Fault> {
    let settings = unusual();
    sensor.start(&settings)?;
    sensor.sleep()?;
    sensor.wake()?;
    let configuration = sensor.driver().configuration()?;
    sensor.start(&Settings::default())?;
    Ok(kept(configuration.deviation(&settings).is_none()))
}

fn kept(is_kept: bool) -> String {
    if is_kept { "kept" } else { "not kept" }.to_owned()
}
