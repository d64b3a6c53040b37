//! Thins long recordings to a fixed number of records.

use grideye_recording::Record;

/// Most records kept: half an hour at 10 Hz.
pub const RECORDS_MAX: usize = 20_000;
/// Records kept or dropped together, since repeats, torn frames and duplicates only show among neighbors.
pub const RUN_RECORDS: usize = 1_000;

/// Collects the records of a recording one by one, keeping at most [`RECORDS_MAX`].
///
/// Each time the limit is reached, every second run of [`RUN_RECORDS`] neighbors is dropped. The choice depends only on
/// the number of records, so reading from disk or memory keeps the same ones.
#[derive(Debug, Clone)]
pub struct Thinning {
    records: Vec<Record>,
    rows: usize,
    /// One run in this many is kept.
    stride: usize,
}

/// A thinned recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Thinned {
    /// The records kept, in order.
    pub records: Vec<Record>,
    /// Number of records in the recording.
    pub rows: usize,
}

impl Default for Thinning {
    fn default() -> Self {
        Self {
            records: Vec::new(),
            rows: 0,
            stride: 1,
        }
    }
}

impl Thinning {
    /// Adds the next record.
    pub fn push(&mut self, record: Record) {
        let run = self.rows / RUN_RECORDS;
        self.rows += 1;
        if run % self.stride != 0 {
            return;
        }
        if self.records.len() == RECORDS_MAX {
            self.thin();
            if run % self.stride != 0 {
                return;
            }
        }
        self.records.push(record);
    }

    /// The result.
    #[must_use]
    pub fn finish(self) -> Thinned {
        Thinned {
            records: self.records,
            rows: self.rows,
        }
    }

    /// Called only when all kept runs are complete: the limit is a whole number of runs.
    fn thin(&mut self) {
        self.stride *= 2;
        let mut place = 0;
        self.records.retain(|_| {
            place += 1;
            ((place - 1) / RUN_RECORDS) % 2 == 0
        });
    }
}

impl Extend<Record> for Thinning {
    fn extend<T: IntoIterator<Item = Record>>(&mut self, records: T) {
        for record in records {
            self.push(record);
        }
    }
}

impl Thinned {
    /// A note for the report, if records were dropped.
    #[must_use]
    pub fn note(&self) -> Option<String> {
        (self.records.len() < self.rows).then(|| {
            format!(
                "The recording has {} rows; {} of them, in runs of {RUN_RECORDS} spread evenly over it, were used.",
                self.rows,
                self.records.len()
            )
        })
    }
}
