//! Long recordings in memory that does not grow with their length.

use grideye_recording::Record;

/// Most records of a recording that are kept to be looked at: half an hour at 10 Hz.
pub const RECORDS_MAX: usize = 20_000;
/// Records that are kept or left out together: repeats, torn frames and duplicates are seen among neighbors only.
pub const RUN_RECORDS: usize = 1_000;

/// Takes the records of a recording one by one, and keeps [`RECORDS_MAX`] at most.
///
/// Beyond that, every second run of [`RUN_RECORDS`] neighbors is dropped, as often as it takes. The choice depends on the number
/// of records alone: read from a disk or from memory, the same are kept.
#[derive(Debug, Clone)]
pub struct Thinning {
    records: Vec<Record>,
    rows: usize,
    /// Of so many runs one is kept.
    stride: usize,
}

/// What was kept of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Thinned {
    /// The records kept, in their order.
    pub records: Vec<Record>,
    /// How many there were.
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
    /// Takes the next record.
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

    /// What was kept.
    #[must_use]
    pub fn finish(self) -> Thinned {
        Thinned {
            records: self.records,
            rows: self.rows,
        }
    }

    /// The runs kept so far are whole when this is called: the limit is a whole number of them.
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
    /// What the reader of a comparison has to be told, if anything was left out.
    #[must_use]
    pub fn note(&self) -> Option<String> {
        (self.records.len() < self.rows).then(|| {
            format!(
                "The recording has {} rows; {} of them, in runs of {RUN_RECORDS} spread evenly over it, were looked at.",
                self.rows,
                self.records.len()
            )
        })
    }
}
