//! A transaction that a client carries out byte by byte: it holds the bus on a thread of its own between two packets.

use crate::adapter::{Carry, EmulatedAdapter as _, Fault};
use crate::rack::SharedAdapter;
use embedded_hal::i2c::{NoAcknowledgeSource, Operation};
use std::sync::mpsc::{self, Receiver, Sender};
use std::thread::{self, JoinHandle};
use std::time::Duration;

/// The longest pause between two steps of a transaction; then the bus is free for others.
pub const STEP_WAIT_MAX: Duration = Duration::from_secs(5);

/// What one step does: the bytes to write, or how many to read. No bytes at all only send the address.
#[derive(Debug)]
pub(super) enum Step {
    Write(Vec<u8>),
    Read(usize),
}

impl Step {
    /// The direction of a transaction that begins with this step.
    pub(super) fn reads(&self) -> bool {
        matches!(self, Self::Read(_))
    }
}

/// A transaction between its START and its STOP.
pub(super) struct Conversation {
    pub(super) bus: u32,
    pub(super) address: u16,
    steps: Sender<Step>,
    answers: Receiver<Result<Vec<u8>, Fault>>,
    thread: JoinHandle<()>,
}

impl Conversation {
    /// Waits for the bus, and holds it until the STOP. `None` if no thread starts.
    pub(super) fn begin(
        mut adapter: SharedAdapter,
        bus: u32,
        address: u16,
        reads: bool,
    ) -> Option<Self> {
        let (steps, to_do) = mpsc::channel();
        let (answer, answers) = mpsc::channel();
        let carry_out = move || {
            let mut is_open = false;
            let outcome = adapter.converse(address, reads, &mut |carry| {
                is_open = true;
                // Ends with the STOP, with the client, or when the client is silent for too long.
                while let Ok(step) = to_do.recv_timeout(STEP_WAIT_MAX) {
                    if answer.send(carried(&step, &mut *carry)).is_err() {
                        return;
                    }
                }
            });
            if let (Err(fault), false) = (outcome, is_open) {
                // The client may be gone.
                let _ = answer.send(Err(fault));
            }
        };
        let builder = thread::Builder::new().name("i2c transaction".to_owned());
        Some(Self {
            bus,
            address,
            steps,
            answers,
            thread: builder.spawn(carry_out).ok()?,
        })
    }

    /// Carries out the next step; returns the bytes it read.
    pub(super) fn step(&self, step: Step) -> Result<Vec<u8>, Fault> {
        // A transaction that has ended by itself was held for too long, unless it left its fault.
        let _ = self.steps.send(step);
        self.answers.recv().unwrap_or(Err(Fault::Timeout))
    }

    /// Sends the STOP, and returns once the bus is free.
    pub(super) fn stop(self) {
        drop(self.steps);
        // The thread has reported its panic.
        let _ = self.thread.join();
    }
}

fn carried(step: &Step, carry: Carry<'_>) -> Result<Vec<u8>, Fault> {
    let mut arrived = Vec::new();
    let mut operation = match step {
        Step::Write(bytes) => Operation::Write(bytes),
        Step::Read(count) => {
            arrived.resize(*count, 0);
            Operation::Read(&mut arrived)
        }
    };
    match carry(&mut operation) {
        Ok(()) => Ok(arrived),
        Err(NoAcknowledgeSource::Data) => Err(Fault::NackData),
        Err(_) => Err(Fault::NackAddress),
    }
}
