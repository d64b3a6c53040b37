//! Scenes as the header has them: text in memory.
#![expect(unsafe_code, reason = "the text is the caller's")]

use crate::error::Error;
use crate::source::Source;
use core::ffi::c_char;

/// `amg8833_file` of the header: the name and the text of a file, both of them C strings.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
#[expect(missing_docs, reason = "the header says what they are")]
pub struct File {
    pub name: *const c_char,
    pub text: *const c_char,
}

/// `amg8833_scene` of the header.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
#[expect(missing_docs, reason = "the header says what they are")]
pub struct Scene {
    pub text: *const c_char,
    pub files: *const File,
    pub file_count: usize,
    pub sensor: *const c_char,
    pub seed: u64,
}

/// # Safety
/// As the header says: what points to nothing is refused, and the message has room for so many bytes.
#[cfg(not(feature = "scene"))]
pub(crate) unsafe fn source(_: &Scene, _: (*mut c_char, usize)) -> Result<Source, Error> {
    Err(Error::NoScenes)
}

#[cfg(feature = "scene")]
pub(crate) use with::source;

#[cfg(feature = "scene")]
mod with {
    use super::{Error, File, Scene, Source, c_char};
    use amg8833_emulator::FrameSource;
    use core::ffi::CStr;
    use core::time::Duration;
    use grideye_frame::{COLUMNS, Celsius, Frame, ROWS};
    use grideye_scene::{Scene as Parsed, Simulator};
    use std::collections::HashMap;

    /// How much warmer than the room the chip is: as `grideye emulate` has it.
    const SELF_HEATING_C: f32 = 4.5;

    /// A scene that a sensor looks into.
    struct Watched {
        simulator: Simulator,
        thermistor: Celsius,
        seed: u64,
        begun: Duration,
    }

    impl FrameSource for Watched {
        fn frame_at(&mut self, t: Duration) -> Frame {
            let image = (self.simulator).noisy(t.saturating_sub(self.begun), self.seed);
            let frame = image.to_frame(self.thermistor);
            // Sensors of another size were refused before.
            frame.unwrap_or(Frame::uniform(self.thermistor))
        }

        /// Its time begins with the sensor's first measurement.
        fn measuring_from(&mut self, t: Duration) {
            self.begun = t;
        }
    }

    /// # Safety
    /// As the header says: what points to nothing is refused, and the message has room for so many bytes.
    pub(crate) unsafe fn source(
        scene: &Scene,
        message: (*mut c_char, usize),
    ) -> Result<Source, Error> {
        // SAFETY: as the caller says.
        let watched = unsafe { watched(scene)? };
        watched
            .map(|watched| Source::Scene(Box::new(watched)))
            .map_err(|why| {
                // SAFETY: as the caller says.
                unsafe { tell(message, &why) };
                Error::Scene
            })
    }

    unsafe fn watched(scene: &Scene) -> Result<Result<Watched, String>, Error> {
        let mut files = HashMap::new();
        if scene.file_count > 0 && scene.files.is_null() {
            return Err(Error::Null);
        }
        for place in 0..scene.file_count {
            // SAFETY: the header says that so many files are there, each with its text.
            let (name, text) = unsafe {
                let File { name, text } = scene.files.add(place).read();
                (string(name)?, string(text)?)
            };
            files.insert(name.to_owned(), text.to_owned());
        }
        // SAFETY: the header says that a text is there.
        let text = unsafe { string(scene.text)? };
        let sensor = if scene.sensor.is_null() {
            None
        } else {
            // SAFETY: the header says that a name is there.
            Some(unsafe { string(scene.sensor)? })
        };
        Ok(look(text, &files, sensor, scene.seed))
    }

    fn look(
        text: &str,
        files: &HashMap<String, String>,
        sensor: Option<&str>,
        seed: u64,
    ) -> Result<Watched, String> {
        let loaded = Parsed::parse(text, "scene", files).map_err(|error| error.to_string())?;
        let first = loaded.scene.sensors().first();
        let sensor = sensor.or_else(|| first.map(|sensor| sensor.name.as_str()));
        let sensor = sensor.ok_or("the scene has no sensor")?;
        let simulator = Simulator::new(&loaded.scene, sensor).map_err(|error| error.to_string())?;
        let seen = simulator.sensor();
        if (seen.columns, seen.rows) != (COLUMNS, ROWS) {
            let (columns, rows) = (seen.columns, seen.rows);
            return Err(format!(
                "{sensor} has {columns} x {rows} pixels; an AMG8833 has 8 x 8"
            ));
        }
        Ok(Watched {
            thermistor: Celsius::new(loaded.scene.ambient().get() + SELF_HEATING_C),
            simulator,
            seed,
            begun: Duration::ZERO,
        })
    }

    unsafe fn string<'a>(text: *const c_char) -> Result<&'a str, Error> {
        if text.is_null() {
            return Err(Error::Null);
        }
        // SAFETY: the header says that a C string is there.
        let text = unsafe { CStr::from_ptr(text) };
        text.to_str().or(Err(Error::Value))
    }

    /// Cut to the room that there is, between two characters.
    unsafe fn tell((message, size): (*mut c_char, usize), why: &str) {
        if message.is_null() || size == 0 {
            return;
        }
        let mut length = why.len().min(size - 1);
        while !why.is_char_boundary(length) {
            length -= 1;
        }
        // SAFETY: the header says that so many bytes are there.
        unsafe {
            message.copy_from_nonoverlapping(why.as_ptr().cast(), length);
            message.add(length).write(0);
        }
    }
}
