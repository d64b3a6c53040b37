//! How good a count is, beside how many people were there.

use crate::network::CLASSES;
use crate::numbers::double;

/// A frame within this time of a change of the truth may be labeled early or late.
pub const NEAR_CHANGE_S: f64 = 0.5;
/// Frames of a majority.
pub const VOTES: usize = 7;

/// One frame with both counts; 3 is three and more.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Labeled {
    /// When, in seconds.
    pub at_s: f64,
    /// How many people there were.
    pub truth: u8,
    /// How many were counted; `None` for no answer yet.
    pub counted: Option<u8>,
}

/// Frames by truth (first) and count (second).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Confusion(pub [[u64; CLASSES]; CLASSES]);

impl Confusion {
    fn add(&mut self, truth: u8, counted: u8) {
        let index = |count: u8| usize::from(count).min(CLASSES - 1);
        self.0[index(truth)][index(counted)] += 1;
    }

    /// The mean over the counts that occur of the share that is right; `None` without a frame.
    #[must_use]
    pub fn balanced_accuracy(&self) -> Option<f64> {
        let shares = self
            .0
            .iter()
            .enumerate()
            .filter_map(|(truth, row)| share(row[truth], row.iter().sum()));
        let (sum, count) =
            shares.fold((0.0, 0.0), |(sum, count), share| (sum + share, count + 1.0));
        (count > 0.0).then_some(sum / count)
    }

    /// The share of empty frames that are called occupied, and of occupied ones called empty.
    #[must_use]
    pub fn presence_errors(&self) -> [Option<f64>; 2] {
        let [empty, occupied @ ..] = &self.0;
        let all: u64 = empty.iter().sum();
        let of_occupied = occupied.iter().flatten().sum();
        let missed = occupied.iter().map(|row| row[0]).sum();
        [share(all - empty[0], all), share(missed, of_occupied)]
    }
}

fn share(part: u64, of: u64) -> Option<f64> {
    (of > 0).then(|| double(part) / double(of))
}

/// What became of a recording's frames.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Evaluation {
    /// Frames with an answer.
    pub all: Confusion,
    /// Of these, the ones more than [`NEAR_CHANGE_S`] from a change of the truth.
    pub steady: Confusion,
    /// The count that most of the last [`VOTES`] frames have, the lower one of a tie.
    pub majority: Confusion,
    /// Frames without an answer.
    pub not_yet: u64,
    /// The longest time that the count was wrong without a break, in seconds.
    pub longest_wrong_s: f64,
}

impl Evaluation {
    /// Evaluates frames in the order of their times.
    #[must_use]
    pub fn of(frames: &[Labeled]) -> Self {
        let mut judged = Self::default();
        let mut wrong_since = None;
        let mut votes = [0; CLASSES];
        for (at, frame) in frames.iter().enumerate() {
            let Some(counted) = frame.counted else {
                judged.not_yet += 1;
                wrong_since = None;
                continue;
            };
            judged.all.add(frame.truth, counted);
            if is_steady(frames, at) {
                judged.steady.add(frame.truth, counted);
            }
            let left = at.checked_sub(VOTES).and_then(|old| frames[old].counted);
            for (vote, change) in [(Some(counted), 1_i32), (left, -1)] {
                if let Some(votes) = vote.and_then(|vote| votes.get_mut(usize::from(vote))) {
                    *votes += change;
                }
            }
            let most = (0_u8..)
                .zip(votes)
                .max_by_key(|(count, votes)| (*votes, core::cmp::Reverse(*count)));
            judged
                .majority
                .add(frame.truth, most.map_or(0, |(count, _)| count));
            if counted == frame.truth {
                wrong_since = None;
            } else {
                let since = *wrong_since.get_or_insert(frame.at_s);
                judged.longest_wrong_s = judged.longest_wrong_s.max(frame.at_s - since);
            }
        }
        judged
    }
}

fn is_steady(frames: &[Labeled], at: usize) -> bool {
    let frame = frames[at];
    let near = |other: &&Labeled| (other.at_s - frame.at_s).abs() <= NEAR_CHANGE_S;
    let (before, after) = frames.split_at(at);
    let beside = before
        .iter()
        .rev()
        .take_while(near)
        .chain(after.iter().take_while(near));
    beside.into_iter().all(|other| other.truth == frame.truth)
}
