//! No camera of Linux: the library that reads them does not compile for 32 bits.

use super::{Camera, CameraError, OpenCamera};
use amg8833::FrameRate;
use grideye_frame::{NoData, RawFrame};
use std::path::PathBuf;
use std::time::Duration;

/// A `/dev/videoN` that is not opened.
#[derive(Debug, Clone)]
pub struct VideoDevice {
    path: PathBuf,
}

/// There is none.
#[derive(Debug)]
pub enum VideoStream {}

impl VideoDevice {
    /// The camera behind a device file.
    pub fn new(path: impl Into<PathBuf>, _rate: FrameRate) -> Self {
        Self { path: path.into() }
    }
}

impl OpenCamera for VideoDevice {
    type Camera = VideoStream;

    fn open(&mut self) -> Result<VideoStream, CameraError> {
        let path = self.path.display().to_string();
        Err(CameraError::Of32Bits { path })
    }

    fn name(&self) -> String {
        self.path.display().to_string()
    }
}

impl Camera for VideoStream {
    fn frame(&mut self, _longest: Duration) -> Result<Option<RawFrame>, NoData> {
        match *self {}
    }
}
