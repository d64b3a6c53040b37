//! What was really there: frames of the sensor, times and the number of people, from a seed.

use grideye_frame::{COLUMNS, PIXELS, day_of};

/// SplitMix64 (Steele, Lea, Flood 2014): a seed and a name give the same file on every machine.
pub(crate) struct Random(u64);

impl Random {
    fn new(seed: u64, name: &str) -> Self {
        let name = name.bytes().fold(0xCBF2_9CE4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3)
        });
        Self(seed ^ name)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut word = self.0;
        word = (word ^ (word >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        word = (word ^ (word >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        word ^ (word >> 31)
    }

    /// From the first to the last, both included.
    pub(crate) fn between(&mut self, first: i64, last: i64) -> i64 {
        let count = u64::try_from(last - first + 1).unwrap();
        first + i64::try_from(self.next() % count).unwrap()
    }

    pub(crate) fn one_of<T: Clone>(&mut self, choices: &[T]) -> T {
        let last = i64::try_from(choices.len()).unwrap() - 1;
        choices[usize::try_from(self.between(0, last)).unwrap()].clone()
    }

    pub(crate) fn shuffle<T>(&mut self, items: &mut [T]) {
        for last in (1..items.len()).rev() {
            let other = self.between(0, i64::try_from(last).unwrap());
            items.swap(last, usize::try_from(other).unwrap());
        }
    }
}

/// One frame of the sensor.
#[derive(Debug, Clone)]
pub(crate) struct Shot {
    /// Among all frames of the sensor, from 0.
    pub(crate) index: usize,
    /// Steps of 0.25 °C.
    pub(crate) steps: [i16; PIXELS],
    /// Steps of 0.0625 °C.
    pub(crate) thermistor: i16,
    /// Since the first frame.
    pub(crate) t_ns: i64,
    /// Since 1970 in UTC.
    pub(crate) utc_ns: i64,
    pub(crate) people: u8,
}

impl Shot {
    pub(crate) fn celsius(&self) -> [f64; PIXELS] {
        self.steps.map(|steps| f64::from(steps) / 4.0)
    }

    pub(crate) fn thermistor_c(&self) -> f64 {
        f64::from(self.thermistor) / 16.0
    }
}

/// A person who walks through a room.
pub(crate) struct Scene {
    pub(crate) random: Random,
    pub(crate) shots: Vec<Shot>,
}

impl Scene {
    pub(crate) fn new(seed: u64, name: &str) -> Self {
        let mut random = Random::new(seed, name);
        let count = random.between(9, 40);
        let mut scene = Self {
            random,
            shots: Vec::new(),
        };
        scene.shots = scene.walk(usize::try_from(count).unwrap(), 0);
        scene.timed(100, 7);
        scene
    }

    /// Frames of another walk in the same room, by `warmer` steps, at the same times.
    pub(crate) fn second(&mut self, warmer: i16) -> Vec<Shot> {
        let times: Vec<(i64, i64)> = self
            .shots
            .iter()
            .map(|shot| (shot.t_ns, shot.utc_ns))
            .collect();
        let mut shots = self.walk(times.len(), warmer);
        for (shot, (t_ns, utc_ns)) in shots.iter_mut().zip(times) {
            (shot.t_ns, shot.utc_ns) = (t_ns + 40_000_000, utc_ns + 40_000_000);
        }
        shots
    }

    fn walk(&mut self, count: usize, warmer: i16) -> Vec<Shot> {
        let random = &mut self.random;
        let mut small = |first: i64, last: i64| i16::try_from(random.between(first, last)).unwrap();
        let room = small(68, 100) + warmer;
        let slope = [small(-1, 1), small(-1, 1)];
        let pattern: Vec<i16> = (0..PIXELS).map(|_| small(-2, 2)).collect();
        let warmth = small(14, 26);
        let (mut row, mut column) = (small(0, 56), small(0, 56));
        let pace = [small(-7, 7), small(2, 7)];
        let people_from = count / 4;
        let shot = |index: usize| {
            let present = index >= people_from;
            if present {
                row = (row + pace[0] + small(-2, 2)).clamp(-4, 60);
                column = (column + pace[1] + small(-2, 2)).rem_euclid(64);
            }
            let mut pixel = |place: usize| {
                let at = [place / COLUMNS, place % COLUMNS].map(|at| i16::try_from(at).unwrap());
                let away = [8 * at[0] - row, 8 * at[1] - column].map(|away| i32::from(away).pow(2));
                let near = (400 - away[0] - away[1]).max(0);
                let body = i16::try_from(i32::from(warmth) * near / 400).unwrap();
                let body = if present { body } else { 0 };
                let noise = (small(-2, 2) + small(-2, 2)) / 2;
                room + (slope[0] * at[0] + slope[1] * at[1]) / 2 + pattern[place] + body + noise
            };
            Shot {
                index,
                steps: std::array::from_fn(&mut pixel),
                thermistor: 4 * room + 61 + small(-1, 1),
                t_ns: 0,
                utc_ns: 0,
                people: u8::from(present) + u8::from(present && index % 7 > 3),
            }
        };
        (0..count).map(shot).collect()
    }

    /// From frame to frame, with a delay of each frame of at most as much.
    pub(crate) fn timed(&mut self, period_ms: i64, late_ms: i64) {
        // Days of 2023 to 2026; the milliseconds are such that no stamp of a frame is lost by rounding.
        let day = self.random.between(19_400, 20_700);
        let second = self.random.between(3_600, 80_000);
        let begin_ms = (day * 86_400 + second) * 1_000;
        let begin_ms = begin_ms + if late_ms > 0 { 100 } else { 0 };
        let mut first_ms = None;
        for index in 0..self.shots.len() {
            let late = self.random.between(0, late_ms);
            let at_ms = i64::try_from(index).unwrap() * period_ms + late;
            let first = *first_ms.get_or_insert(at_ms);
            let shot = &mut self.shots[index];
            shot.t_ns = (at_ms - first) * 1_000_000;
            shot.utc_ns = (begin_ms + at_ms - first) * 1_000_000;
        }
    }

    /// One frame a second, on the second.
    pub(crate) fn slow(&mut self) {
        self.timed(1_000, 0);
    }

    /// Every tenth of a second to the millisecond.
    pub(crate) fn punctual(&mut self) {
        self.timed(100, 0);
    }

    /// Moves to such a day of a month.
    pub(crate) fn on_day(&mut self, fits: impl Fn(i64) -> bool) {
        const DAY_NS: i64 = 86_400_000_000_000;
        while !fits(day_of(self.shots[0].utc_ns / DAY_NS).2) {
            let later = |shot: &mut Shot| shot.utc_ns += DAY_NS;
            self.shots.iter_mut().for_each(later);
        }
    }

    /// A room of -8 to -1 °C.
    pub(crate) fn cold(&mut self) {
        let first = &self.shots[0];
        let room = i64::from(first.steps.iter().min().copied().unwrap());
        let colder = room + self.random.between(12, 36);
        self.colder(i16::try_from(colder).unwrap());
    }

    pub(crate) fn colder(&mut self, colder: i16) {
        for shot in &mut self.shots {
            shot.steps = shot.steps.map(|steps| steps - colder);
            shot.thermistor -= 4 * colder;
        }
    }

    /// Some rooms are cold.
    pub(crate) fn any_room(&mut self) {
        if self.random.between(0, 2) == 0 {
            self.cold();
        }
    }

    /// Exactly as many frames.
    pub(crate) fn frames(&mut self, count: usize) {
        self.shots = self.walk(count, 0);
        self.timed(100, 7);
    }
}
