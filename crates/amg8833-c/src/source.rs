//! What a sensor sees: what the caller handed, in its memory.
#![expect(unsafe_code, reason = "frames and functions are the caller's")]

use amg8833_emulator::FrameSource;
use core::ffi::c_void;
use core::time::Duration;
use grideye_frame::{Celsius, Frame, PIXELS};

/// `amg8833_frame` of the header, in degrees Celsius.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
#[expect(missing_docs, reason = "the header says what they are")]
pub struct FrameC {
    pub pixels_c: [f32; PIXELS],
    pub thermistor_c: f32,
}

impl FrameC {
    pub(crate) fn frame(&self) -> Frame {
        Frame {
            thermistor: Celsius::new(self.thermistor_c),
            pixels: self.pixels_c.map(Celsius::new),
        }
    }
}

/// `amg8833_callback` of the header. An exception that leaves it ends the process.
pub type Callback = unsafe extern "C-unwind" fn(*mut c_void, u64, *mut FrameC);

#[expect(clippy::large_enum_variant, reason = "nothing is allocated")]
pub(crate) enum Source {
    Still(Frame),
    /// One frame for each measurement; the last one stays.
    Recording {
        frames: *const FrameC,
        count: usize,
        shown: usize,
    },
    Call {
        callback: Callback,
        user: *mut c_void,
    },
    #[cfg(feature = "scene")]
    Scene(Box<dyn FrameSource>),
}

impl FrameSource for Source {
    fn frame_at(&mut self, t: Duration) -> Frame {
        match self {
            Self::Still(frame) => *frame,
            Self::Recording {
                frames,
                count,
                shown,
            } => {
                let place = (*shown).min(*count - 1);
                *shown = place + 1;
                // SAFETY: the header says that `count` frames stay there while the sensor is plugged in, and `count` is not 0.
                unsafe { frames.add(place).read() }.frame()
            }
            Self::Call { callback, user } => {
                let mut frame = FrameC {
                    pixels_c: [0.0; PIXELS],
                    thermistor_c: 0.0,
                };
                let now_ns = u64::try_from(t.as_nanos()).unwrap_or(u64::MAX);
                // SAFETY: the caller's function, with the caller's pointer and a frame that lives until it returns.
                unsafe { callback(*user, now_ns, &raw mut frame) };
                frame.frame()
            }
            #[cfg(feature = "scene")]
            Self::Scene(scene) => scene.frame_at(t),
        }
    }

    fn measuring_from(&mut self, _t: Duration) {
        match self {
            Self::Recording { shown, .. } => *shown = 0,
            #[cfg(feature = "scene")]
            Self::Scene(scene) => scene.measuring_from(_t),
            _ => {}
        }
    }
}
