//! How many people each sensor sees, if the collector counts.

use grideye_count::{Count, Counter, Gate, Line, Network, celsius};
use grideye_recording::Record;
use serde_json::{Value, json};
use std::time::Duration;

/// Counts the people of every sensor, from the frames as they come.
#[derive(Debug, Clone, Copy, Default)]
pub struct Counting {
    /// What counts.
    pub network: Network<'static>,
    /// The line across every image whose crossings are counted.
    pub line: Option<Line>,
}

/// The people of one sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct People {
    /// `None` while the empty room is not known yet.
    pub count: Option<Count>,
    /// How many entered and left since the collector started, if there is a line.
    pub crossed: Option<[u64; 2]>,
}

/// The counter of one sensor.
pub(super) struct Counted {
    counter: Box<Counter>,
    gate: Option<Gate>,
    count: Option<Count>,
}

impl Counted {
    pub(super) fn new(counting: &Counting) -> Self {
        Self {
            counter: Box::default(),
            gate: counting.line.map(Gate::new),
            count: None,
        }
    }

    pub(super) fn see<'r>(&mut self, counting: &Counting, shown: impl Iterator<Item = &'r Record>) {
        for record in shown {
            let Some(frame) = record.reading.frame() else {
                continue;
            };
            let at_s = Duration::from_nanos(record.stamp.t_boot_ns).as_secs_f64();
            self.count = self.counter.see(&counting.network, at_s, &celsius(frame));
            if let (Some(gate), Some(count)) = (&mut self.gate, &self.count) {
                gate.see(at_s, &count.excess);
            }
        }
    }

    pub(super) fn people(&self) -> People {
        let crossed = self.gate.as_ref();
        People {
            count: self.count,
            crossed: crossed.map(|gate| [gate.entered, gate.left]),
        }
    }

    /// For the page and `GET /v1/sensors`.
    pub(super) fn json(&self) -> Vec<(&'static str, Value)> {
        let count = self.count.as_ref();
        let is_set = |pixels: u64| (0..u64::BITS).filter(move |bit| pixels >> bit & 1 == 1);
        let mut json = vec![
            ("people", json!(count.map(|count| count.people))),
            ("people_p", json!(count.map(|count| count.chances))),
            (
                "people_pixels",
                json!(count.map(|count| is_set(count.pixels).collect::<Vec<u32>>())),
            ),
        ];
        if let Some(gate) = &self.gate {
            json.extend([("entered", json!(gate.entered)), ("left", json!(gate.left))]);
        }
        json
    }
}
