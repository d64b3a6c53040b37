//! A camera of Linux: frames from the driver's buffers, the thermistor from its thermometer in `/sys`.

use super::{Camera, CameraError, OpenCamera};
use crate::bus::by_errno;
use amg8833::FrameRate;
use amg8833::word;
use grideye_frame::{COLUMNS, Celsius, NoData, PIXELS, PixelWord, ROWS, RawFrame, ThermistorWord};
use linuxvideo::format::{PixFormat, PixelFormat};
use linuxvideo::stream::ReadStream;
use linuxvideo::{Device, Fract};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::fs;
use std::io;
use std::os::fd::AsFd as _;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Twelve bits in sixteen, low byte first, without a sign: what the chip's registers hold (`video-i2c.c`, amg88xx).
const FORMAT: [u8; 4] = *b"Y12 ";
const FRAME_BYTES: usize = 2 * PIXELS;
/// Where the kernel shows its cameras.
const CAMERAS: &str = "/sys/class/video4linux";
/// The bits of a pixel's word.
const WORD_BITS: u16 = 0x0FFF;

/// Opens `/dev/videoN`.
#[derive(Debug, Clone)]
pub struct VideoDevice {
    path: PathBuf,
    rate: FrameRate,
}

/// An open `/dev/videoN` that streams.
pub struct VideoStream {
    stream: ReadStream,
    thermometer: PathBuf,
}

impl VideoDevice {
    /// The camera behind a device file, to be read at this rate.
    pub fn new(path: impl Into<PathBuf>, rate: FrameRate) -> Self {
        let path = path.into();
        Self { path, rate }
    }

    fn refused(&self, source: io::Error) -> CameraError {
        let path = self.path.display().to_string();
        match source.kind() {
            io::ErrorKind::NotFound => CameraError::NoSuchCamera { path },
            io::ErrorKind::PermissionDenied => CameraError::PermissionDenied { path },
            _ => CameraError::Unusable { path, source },
        }
    }
}

impl OpenCamera for VideoDevice {
    type Camera = VideoStream;

    fn open(&mut self) -> Result<VideoStream, CameraError> {
        let refused = |error| self.refused(error);
        let device = Device::open(&self.path).map_err(refused)?;
        let (columns, rows) = (u32::try_from(COLUMNS), u32::try_from(ROWS));
        let (Ok(columns), Ok(rows)) = (columns, rows) else {
            return Err(refused(io::ErrorKind::InvalidInput.into()));
        };
        let wanted = PixFormat::new(columns, rows, PixelFormat::from_fourcc(FORMAT));
        let device = device.video_capture(wanted).map_err(refused)?;
        let format = device.format();
        let found = format.pixel_format().as_fourcc();
        if (format.width(), format.height(), found) != (columns, rows, FORMAT) {
            let code = String::from_utf8_lossy(&found);
            return Err(CameraError::OtherCamera {
                path: self.path.display().to_string(),
                found: format!("{} x {} in {code}", format.width(), format.height()),
            });
        }
        let interval = Fract::new(1, self.rate.fps().into());
        device.set_frame_interval(interval).map_err(refused)?;
        let thermometer = thermometer(Path::new(CAMERAS), &self.path);
        let thermometer = thermometer.ok_or_else(|| CameraError::NoThermometer {
            path: self.path.display().to_string(),
        })?;
        let stream = device.into_stream().map_err(refused)?;
        Ok(VideoStream {
            stream,
            thermometer,
        })
    }

    fn name(&self) -> String {
        self.path.display().to_string()
    }
}

impl Camera for VideoStream {
    fn frame(&mut self, longest: Duration) -> Result<Option<RawFrame>, NoData> {
        if !has_frame(&self.stream, longest)? {
            return Ok(None);
        }
        let taken = self.stream.dequeue(|buffer| {
            let pixels = (!buffer.is_error()).then(|| pixels(&buffer)).flatten();
            Ok(pixels)
        });
        let pixels = taken.map_err(|error| reason(&error))?;
        let thermistor = read_thermometer(&self.thermometer);
        match (pixels, thermistor) {
            (Some(pixels), Ok(thermistor)) => Ok(Some(RawFrame { thermistor, pixels })),
            (_, Err(error)) => Err(reason(&error)),
            // The driver says that a transfer failed, and not why.
            (None, Ok(_)) => Err(NoData::BusError),
        }
    }
}

/// Waits for a buffer that is full, good or bad.
fn has_frame(stream: &ReadStream, longest: Duration) -> Result<bool, NoData> {
    let longest = Timespec::try_from(longest).ok();
    let mut watched = [PollFd::from_borrowed_fd(stream.as_fd(), PollFlags::IN)];
    match poll(&mut watched, longest.as_ref()) {
        Ok(0) | Err(rustix::io::Errno::INTR) => Ok(false),
        Ok(_) if watched[0].revents().contains(PollFlags::IN) => Ok(true),
        Ok(_) => Err(NoData::Unplugged),
        Err(errno) => Err(by_errno(errno.raw_os_error())),
    }
}

fn reason(error: &io::Error) -> NoData {
    match error.kind() {
        // The driver is gone, and its files with it.
        io::ErrorKind::NotFound => NoData::Unplugged,
        _ => error.raw_os_error().map_or(NoData::BusError, by_errno),
    }
}

/// The words of a buffer, or nothing if it is too short for a frame.
fn pixels(bytes: &[u8]) -> Option<[PixelWord; PIXELS]> {
    let bytes = bytes.get(..FRAME_BYTES)?;
    let mut pixels = [PixelWord(0); PIXELS];
    for (pixel, bytes) in pixels.iter_mut().zip(bytes.chunks_exact(2)) {
        let word = u16::from_le_bytes(bytes.try_into().ok()?);
        *pixel = PixelWord(word & WORD_BITS);
    }
    Some(pixels)
}

/// The thermometer of the camera's own device.
fn thermometer(cameras: &Path, camera: &Path) -> Option<PathBuf> {
    let folder = cameras.join(camera.file_name()?).join("device/hwmon");
    let entries = fs::read_dir(folder).ok()?;
    let mut found = entries
        .filter_map(Result::ok)
        .map(|entry| entry.path().join("temp1_input"))
        .filter(|file| file.is_file());
    found.next()
}

fn read_thermometer(file: &Path) -> io::Result<ThermistorWord> {
    let text = fs::read_to_string(file)?;
    thermistor_word(text.trim()).ok_or_else(|| io::ErrorKind::InvalidData.into())
}

/// The chip's word for thousandths of a degree: the driver rounds its sixteenths down to these, so the nearest one is it.
fn thermistor_word(milli_celsius: &str) -> Option<ThermistorWord> {
    let milli_celsius: i32 = milli_celsius.parse().ok()?;
    let half = 500 * milli_celsius.signum();
    let sixteenths = (milli_celsius.checked_mul(16)?.checked_add(half)?) / 1000;
    let sixteenths = f32::from(i16::try_from(sixteenths).ok()?);
    word::thermistor_word(Celsius::new(sixteenths / 16.0)).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_step_of_the_thermistor_comes_back_from_what_the_driver_makes_of_it() {
        // video-i2c.c (6.1): sixteenths of a degree times 625 / 10, rounded towards zero.
        for sixteenths in -2047_i32..=2047 {
            let milli_celsius = sixteenths * 625 / 10;
            let sign = if sixteenths < 0 { 0x800 } else { 0 };
            let expected = u16::try_from(sixteenths.abs()).unwrap() | sign;
            let found = thermistor_word(&milli_celsius.to_string());
            assert_eq!(found, Some(ThermistorWord(expected)), "{milli_celsius}");
        }
        for bad in ["", "x", "999999999999", "200000"] {
            assert_eq!(thermistor_word(bad), None, "{bad}");
        }
    }

    #[test]
    fn words_are_twelve_bits_low_byte_first() {
        let mut bytes = [0; FRAME_BYTES];
        bytes[..4].copy_from_slice(&[0x56, 0x00, 0xD7, 0x0F]);
        bytes[126..].copy_from_slice(&[0x01, 0xF0]);
        let pixels = pixels(&bytes).unwrap();
        assert_eq!(
            [pixels[0], pixels[1], pixels[63]],
            [PixelWord(0x056), PixelWord(0xFD7), PixelWord(0x001)]
        );
        assert_eq!(super::pixels(&bytes[..127]), None);
    }

    #[test]
    fn the_thermometer_is_that_of_the_cameras_own_device() {
        let cameras = tempfile::tempdir().unwrap();
        let camera = Path::new("/dev/video3");
        assert_eq!(thermometer(cameras.path(), camera), None);
        let folder = cameras.path().join("video3/device/hwmon/hwmon7");
        fs::create_dir_all(&folder).unwrap();
        assert_eq!(thermometer(cameras.path(), camera), None);
        let file = folder.join("temp1_input");
        fs::write(&file, "26062\n").unwrap();
        assert_eq!(thermometer(cameras.path(), camera), Some(file.clone()));
        assert_eq!(read_thermometer(&file).unwrap(), ThermistorWord(0x1A1));
    }

    #[test]
    fn a_missing_camera_is_named_with_what_makes_one() {
        let error = VideoDevice::new("/nonexistent/video9", FrameRate::Ten).open();
        let said = error.err().unwrap().to_string();
        assert!(
            said.starts_with("/nonexistent/video9: no such camera\nhint: "),
            "{said}"
        );
        let error = VideoDevice::new("/dev/null", FrameRate::Ten).open();
        let said = error.err().unwrap().to_string();
        assert!(said.contains("cannot be used as a camera"), "{said}");
    }
}
