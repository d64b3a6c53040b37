//! What a reader has to find in a file.

use super::scene::{Scene, Shot};

/// What a file has of one frame.
#[derive(Debug, Clone)]
pub(crate) enum Event {
    Whole(Box<Shot>),
    /// A part: no frame, and it has to be said.
    Torn,
    /// Nothing but what a number or a time shows.
    Gone,
}

/// What a file says of the times.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Times {
    /// Nothing.
    Rate,
    /// From frame to frame, to so many nanoseconds.
    Relative(i64),
    /// Since 1970, to so many nanoseconds.
    Absolute(i64),
    /// Less than one stamp a frame: the rate or the stamp is taken, and it is said.
    Said,
    /// One stamp for all: the rate is taken, and it is said.
    Equal,
}

#[derive(Debug, Clone)]
pub(crate) struct Label {
    /// In the name of the label, if the file names it.
    pub(crate) name: Option<String>,
    /// One for each frame of the sensor.
    pub(crate) values: Vec<String>,
}

#[derive(Debug, Clone)]
pub(crate) struct Truth {
    /// What each stream has, in the order of the file.
    pub(crate) streams: Vec<Vec<Event>>,
    pub(crate) times: Times,
    /// Steps of 0.25 °C that the format rounds away.
    pub(crate) tolerance: i16,
    pub(crate) labels: Vec<Label>,
    /// To so many °C, if the file has it.
    pub(crate) thermistor: Option<f64>,
    /// Whether numbers of frames show those that are gone.
    pub(crate) is_numbered: bool,
}

impl Truth {
    /// Every frame is there, and nothing else.
    pub(crate) fn of(scene: &Scene) -> Self {
        Self::of_streams(&[&scene.shots])
    }

    pub(crate) fn of_streams(streams: &[&[Shot]]) -> Self {
        let whole = |shot: &Shot| Event::Whole(Box::new(shot.clone()));
        Self {
            streams: streams
                .iter()
                .map(|shots| shots.iter().map(whole).collect())
                .collect(),
            times: Times::Rate,
            tolerance: 0,
            labels: Vec::new(),
            thermistor: None,
            is_numbered: false,
        }
    }

    /// To so many milliseconds.
    pub(crate) fn absolute(mut self, ms: i64) -> Self {
        self.times = Times::Absolute(ms * 1_000_000 + 2_000);
        self
    }

    pub(crate) fn relative(mut self, ms: i64) -> Self {
        self.times = Times::Relative(ms * 1_000_000 + 2_000);
        self
    }

    pub(crate) fn said(mut self) -> Self {
        self.times = Times::Said;
        self
    }

    pub(crate) fn within(mut self, steps: i16) -> Self {
        self.tolerance = steps;
        self
    }

    pub(crate) fn thermistor(mut self, celsius: f64) -> Self {
        self.thermistor = Some(celsius);
        self
    }

    pub(crate) fn numbered(mut self) -> Self {
        self.is_numbered = true;
        self
    }

    pub(crate) fn label(
        mut self,
        scene: &Scene,
        name: &str,
        value: impl Fn(&Shot) -> String,
    ) -> Self {
        self.labels.push(Label {
            name: (!name.is_empty()).then(|| name.to_owned()),
            values: scene.shots.iter().map(value).collect(),
        });
        self
    }

    /// The number of people under such a name.
    pub(crate) fn people(self, scene: &Scene, name: &str) -> Self {
        self.label(scene, name, |shot| shot.people.to_string())
    }

    pub(crate) fn torn(mut self, index: usize) -> Self {
        self.streams[0][index] = Event::Torn;
        self
    }

    pub(crate) fn gone(mut self, index: usize) -> Self {
        self.streams[0][index] = Event::Gone;
        self
    }
}
