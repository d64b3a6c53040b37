//! Draws the way of a person who does something: places, speeds and times, as the waypoints of a trajectory.

use crate::acts::{Act, Does};
use crate::chance::{below, share};
use glam::{DMat3, DVec2, DVec3};
use grideye_scene::perceived::Surface;
use grideye_scene::{Agent, Body, Cuboid, FreeSpace, Mesh, Posture, Scene, Stop};
use rand_chacha::ChaCha12Rng;
use std::time::Duration;

/// Walking indoors, m/s: people in `grideye compare`'s recordings walk at a median of 0.4 to 0.6, at most at 0.9.
const WALK_M_PER_S: [f64; 2] = [0.4, 1.2];
/// Sitting down and standing up take 1.97 and 1.91 s on the mean, leaning forward included (Kerr et al. 1997, Clin.
/// Biomech. 12:236, 50 adults); young people need less than 2 s.
const SIT_DOWN_S: [f64; 2] = [1.2, 2.0];
/// **Assumption**.
const LIE_DOWN_S: [f64; 2] = [1.5, 3.0];
/// From the start of the descent, the pelvis reaches the floor after 0.58 s (sd 0.26; Choi et al. 2015, J. Biomech.
/// 48:911, 25 falls on video) or 0.72 s (sd 0.16; Robinovitch et al. 2005, J. Gerontol. A 60:1553).
const FALL_S: [f64; 2] = [0.5, 1.0];
/// **Assumption**.
const GET_UP_S: [f64; 2] = [3.0, 6.0];
/// The shortest walk, meters.
const WALK_MIN_M: f64 = 0.8;
/// Of stature: from hip to knee, and how high beds and seats are (as a person sits).
const THIGH: f64 = 0.245;
const SEAT: f64 = 0.25;
/// Places tried for one act before the whole way starts again.
const PLACES_MAX: usize = 40;
/// People's distances are looked at this often; between two looks they come nearer by 0.12 m at most.
const LOOK_S: f64 = 0.1;
/// The least distance between two bodies then, meters.
const APART_M: f64 = 0.2;
/// Half the width and the height of who lies, meters.
const LYING_M: [f64; 2] = [0.35, 0.5];

/// A waypoint, and what the body covers there: a line on the floor, with the person's radius around.
#[derive(Debug, Clone, Copy)]
struct Point {
    from_s: f64,
    until_s: f64,
    at_m: DVec3,
    /// `None` while the person is away.
    posture: Option<Posture>,
    covers_m: [DVec2; 2],
}

/// A drawn way.
#[derive(Debug, Clone)]
pub(crate) struct Way {
    points: Vec<Point>,
    /// Where the person faces before it first walks, degrees from +x.
    pub(crate) yaw_deg: f64,
    radius_m: f64,
}

impl Way {
    /// As the scene has it: places to a tenth of a millimeter.
    pub(crate) fn stops(&self) -> Vec<Stop> {
        let stops = self.points.iter().map(|point| Stop {
            at_mm: (10.0 * (1000.0 * point.at_m)).round() / 10.0,
            from_s: point.from_s,
            stays_s: point.until_s - point.from_s,
            posture: point.posture,
        });
        stops.collect()
    }

    fn end_s(&self) -> f64 {
        self.points.last().map_or(0.0, |point| point.until_s)
    }

    /// What the body covers at a time; `None` while it is away.
    fn covers_m(&self, time_s: f64) -> Option<[DVec2; 2]> {
        let begun = self.points.partition_point(|point| point.from_s <= time_s);
        let from = self.points.get(begun.saturating_sub(1))?;
        let Some(to) = self.points.get(begun).filter(|_| time_s > from.until_s) else {
            return from.posture.is_some().then_some(from.covers_m);
        };
        let passed = (time_s - from.until_s) / (to.from_s - from.until_s);
        Some([0, 1].map(|end| from.covers_m[end].lerp(to.covers_m[end], passed)))
    }

    /// Whether two people come closer than their bodies allow, until both have done everything.
    pub(crate) fn meets(&self, other: &Self) -> bool {
        let end_s = self.end_s().max(other.end_s());
        self.moments(end_s).any(
            |time_s| match (self.covers_m(time_s), other.covers_m(time_s)) {
                (Some(one), Some(two)) => {
                    distance_m(one, two) < self.radius_m + other.radius_m + APART_M
                }
                _ => false,
            },
        )
    }

    /// The same with an agent that the file moves.
    pub(crate) fn meets_agent(&self, agent: &Agent) -> bool {
        let radius_m = radius_m(agent);
        let end_s = self.end_s().max(agent.duration().as_secs_f64());
        self.moments(end_s).any(|time_s| {
            let time = Duration::try_from_secs_f64(time_s).unwrap_or_default();
            let at_m = agent.position_m(time).truncate();
            let is_near =
                |covers_m| distance_m(covers_m, [at_m; 2]) < self.radius_m + radius_m + APART_M;
            agent.is_here(time) && self.covers_m(time_s).is_some_and(is_near)
        })
    }

    fn moments(&self, end_s: f64) -> impl Iterator<Item = f64> + use<> {
        let steps = (0_u32..).map(|step| f64::from(step) * LOOK_S);
        steps.take_while(move |time_s| *time_s < end_s + LOOK_S)
    }
}

const AWAY: Option<Posture> = None;
const STAND: Option<Posture> = Some(Posture::Stand);
const WALK: Option<Posture> = Some(Posture::Walk);

/// The room in which ways are drawn.
pub(crate) struct Stage {
    free: FreeSpace,
    low_m: DVec2,
    high_m: DVec2,
}

/// A person at the end of what it has done so far.
struct Person<'a> {
    stage: &'a Stage,
    generator: &'a mut ChaCha12Rng,
    height_m: f64,
    way: Way,
    time_s: f64,
    /// Where the feet are, or were before the person sat or lay down.
    feet_m: DVec2,
    front: DVec2,
    is: Is,
}

#[derive(Clone, Copy, PartialEq)]
enum Is {
    Away,
    Upright,
    Seated,
    InBed,
    Fallen,
}

impl Stage {
    /// The room with its objects and those of these agents who stand still.
    pub(crate) fn of(scene: &Scene, others: &[&Agent]) -> Self {
        let (low_m, high_m) = scene.room().bounds_m();
        let mut free = FreeSpace::of(scene);
        for agent in others.iter().filter(|agent| agent.trajectory.is_none()) {
            free.fill(&agent.parts);
        }
        Self {
            free,
            low_m: low_m.truncate(),
            high_m: high_m.truncate(),
        }
    }

    /// A way on which a person meets neither walls nor objects; `None` if some act found no place.
    pub(crate) fn way(
        &self,
        [radius_m, height_m]: [f64; 2],
        acts: &[Act],
        generator: &mut ChaCha12Rng,
    ) -> Option<Way> {
        let yaw_deg = 360.0 * share(generator);
        let mut person = Person {
            stage: self,
            way: Way {
                points: Vec::new(),
                yaw_deg,
                radius_m,
            },
            generator,
            height_m,
            time_s: 0.0,
            feet_m: DVec2::ZERO,
            front: toward(yaw_deg),
            is: Is::Away,
        };
        person.start(acts.first()?.does)?;
        for act in acts {
            person.does(act)?;
        }
        Some(person.way)
    }

    /// Whether a box is free: its middle line on the floor, half its width, and its height.
    fn is_free(&self, line_m: [DVec2; 2], [half_m, height_m]: [f64; 2]) -> bool {
        let [from, to] = line_m;
        let along = (to - from).try_normalize().unwrap_or(DVec2::X);
        let size_m = DVec3::new(from.distance(to) + 2.0 * half_m, 2.0 * half_m, height_m);
        let turn = DMat3::from_cols(along.extend(0.0), along.perp().extend(0.0), DVec3::Z);
        let mesh = Mesh::of_cuboid(&Cuboid::new(DVec3::ZERO, size_m, 0.0));
        let mesh = mesh.placed(turn, (0.5 * (from + to)).extend(0.0));
        // Only its place matters.
        let surface = Surface {
            celsius: 0.0,
            emissivity: 1.0,
        };
        self.free
            .holds(&[Body::new("", DVec3::ZERO, mesh, surface)])
    }
}

impl Person<'_> {
    fn between(&mut self, [low, high]: [f64; 2]) -> f64 {
        low + (high - low) * share(self.generator)
    }

    fn place(&mut self) -> DVec2 {
        let margin = DVec2::splat(self.way.radius_m);
        let (low, high) = (self.stage.low_m + margin, self.stage.high_m - margin);
        let (x, y) = (share(self.generator), share(self.generator));
        low + DVec2::new(x, y) * (high - low)
    }

    /// A place beside a wall.
    fn door(&mut self) -> DVec2 {
        let place = self.place();
        let margin = DVec2::splat(self.way.radius_m + 0.01);
        let (low, high) = (self.stage.low_m + margin, self.stage.high_m - margin);
        match below(self.generator, 4) {
            0 => DVec2::new(low.x, place.y),
            1 => DVec2::new(high.x, place.y),
            2 => DVec2::new(place.x, low.y),
            _ => DVec2::new(place.x, high.y),
        }
    }

    /// The first place, drawn from those where the person can stand.
    fn start(&mut self, first: Does) -> Option<()> {
        let is_outside = matches!(first, Does::Enter | Does::Away);
        for _ in 0..PLACES_MAX {
            self.feet_m = if is_outside {
                self.door()
            } else {
                self.place()
            };
            if self.stage.is_free([self.feet_m; 2], self.upright_m()) {
                self.is = if is_outside { Is::Away } else { Is::Upright };
                return Some(());
            }
        }
        None
    }

    fn upright_m(&self) -> [f64; 2] {
        [self.way.radius_m, self.height_m + 0.05]
    }

    fn does(&mut self, act: &Act) -> Option<()> {
        let lasts_s = self.between(act.lasts_s);
        match act.does {
            Does::Away => self.arrive(self.standing(AWAY), lasts_s),
            Does::Enter => {
                if self.way.points.is_empty() {
                    self.arrive(self.standing(AWAY), 0.0);
                }
                self.is = Is::Upright;
                self.walk(WALK, Self::place)?;
            }
            Does::Walk => {
                self.rise();
                self.walk(WALK, Self::place)?;
            }
            Does::Leave => {
                self.rise();
                self.walk(AWAY, Self::door)?;
                self.is = Is::Away;
            }
            Does::Stand => {
                self.rise();
                self.stay(STAND, lasts_s);
            }
            Does::Sit => self.sit(lasts_s)?,
            Does::Lie => self.lie(lasts_s)?,
            Does::Fall => self.fall(lasts_s)?,
        }
        Some(())
    }

    /// A waypoint of who stands at its feet's place.
    fn standing(&self, posture: Option<Posture>) -> Point {
        Point {
            from_s: self.time_s,
            until_s: self.time_s,
            at_m: self.feet_m.extend(0.0),
            posture,
            covers_m: [self.feet_m; 2],
        }
    }

    /// Adds a waypoint that is reached now; a posture that a person has already is kept for longer.
    fn arrive(&mut self, point: Point, lasts_s: f64) {
        self.time_s += lasts_s;
        let until_s = self.time_s;
        match self.way.points.last_mut() {
            Some(last) if last.until_s == point.from_s => last.until_s = until_s,
            _ => self.way.points.push(Point { until_s, ..point }),
        }
    }

    fn stay(&mut self, posture: Option<Posture>, lasts_s: f64) {
        self.arrive(self.standing(posture), lasts_s);
    }

    fn walk(&mut self, posture: Option<Posture>, place: fn(&mut Self) -> DVec2) -> Option<()> {
        if self.way.points.is_empty() {
            self.stay(WALK, 0.0);
        }
        for _ in 0..PLACES_MAX {
            let to_m = place(self);
            let line_m = [self.feet_m, to_m];
            let length_m = self.feet_m.distance(to_m);
            if length_m >= WALK_MIN_M && self.stage.is_free(line_m, self.upright_m()) {
                self.time_s += length_m / self.between(WALK_M_PER_S);
                self.front = (to_m - self.feet_m) / length_m;
                self.feet_m = to_m;
                self.stay(posture, 0.0);
                return Some(());
            }
        }
        None
    }

    /// Stands up from where the person sits or lies.
    fn rise(&mut self) {
        match self.is {
            Is::Away | Is::Upright => return,
            Is::Seated => self.time_s += self.between(SIT_DOWN_S),
            Is::InBed => {
                self.time_s += self.between(LIE_DOWN_S);
                self.arrive(self.seated(), 0.0);
                self.time_s += self.between(SIT_DOWN_S);
            }
            Is::Fallen => self.time_s += self.between(GET_UP_S),
        }
        self.is = Is::Upright;
        self.stay(STAND, 0.0);
    }

    /// The hips go back, the feet stay.
    fn seated(&self) -> Point {
        let hips_m = self.feet_m - THIGH * self.height_m * self.front;
        Point {
            at_m: hips_m.extend(0.0),
            covers_m: [hips_m, self.feet_m],
            ..self.standing(Some(Posture::Sit))
        }
    }

    fn sit(&mut self, lasts_s: f64) -> Option<()> {
        if self.is == Is::Seated {
            self.arrive(self.seated(), lasts_s);
            return Some(());
        }
        self.rise();
        let covers_m = self.seated().covers_m;
        if !self.stage.is_free(covers_m, self.upright_m()) {
            return None;
        }
        if !self.way.points.is_empty() {
            self.time_s += self.between(SIT_DOWN_S);
        }
        self.arrive(self.seated(), lasts_s);
        self.is = Is::Seated;
        Some(())
    }

    fn lie(&mut self, lasts_s: f64) -> Option<()> {
        let begins = self.way.points.is_empty();
        if self.is == Is::Upright && !begins {
            self.sit(0.0)?;
        } else if self.is == Is::Fallen {
            self.rise();
            self.sit(0.0)?;
        }
        let seated = self.seated();
        let half_m = 0.5 * self.height_m * self.front;
        let middle_m = seated.at_m.truncate();
        let covers_m = [middle_m - half_m, middle_m + half_m];
        if !self
            .stage
            .is_free(covers_m, [LYING_M[0], SEAT * self.height_m + LYING_M[1]])
        {
            return None;
        }
        if self.is != Is::InBed && !begins {
            self.time_s += self.between(LIE_DOWN_S);
        }
        let lying = Point {
            at_m: middle_m.extend(SEAT * self.height_m),
            covers_m,
            ..self.standing(Some(Posture::Lie))
        };
        self.arrive(lying, lasts_s);
        self.is = Is::InBed;
        Some(())
    }

    /// In any direction about the feet.
    fn fall(&mut self, lasts_s: f64) -> Option<()> {
        self.rise();
        if self.way.points.is_empty() {
            self.stay(STAND, 0.0);
        }
        for _ in 0..PLACES_MAX {
            let along = toward(360.0 * share(self.generator));
            let covers_m = [self.feet_m, self.feet_m + self.height_m * along];
            if self.stage.is_free(covers_m, [LYING_M[0], self.height_m]) {
                self.time_s += self.between(FALL_S);
                let middle_m = self.feet_m + 0.5 * self.height_m * along;
                let lying = Point {
                    at_m: middle_m.extend(0.0),
                    covers_m,
                    ..self.standing(Some(Posture::Lie))
                };
                self.arrive(lying, lasts_s);
                self.is = Is::Fallen;
                return Some(());
            }
        }
        None
    }
}

fn toward(yaw_deg: f64) -> DVec2 {
    let (sin, cos) = libm::sincos(yaw_deg.to_radians());
    DVec2::new(cos, sin)
}

/// How far a person's body reaches from its place, and how high; `None` for another agent.
pub(crate) fn size_m(agent: &Agent) -> Option<[f64; 2]> {
    let person = agent.person.as_ref()?;
    Some([radius_m(agent), person.height_m])
}

/// How far a standing body reaches from its place.
fn radius_m(agent: &Agent) -> f64 {
    let corners = agent.parts.iter().flat_map(|part| part.mesh.vertices_m());
    let reaches_m = corners.map(|corner| (*corner - agent.start_m).truncate().length());
    reaches_m.fold(0.0, f64::max)
}

/// The distance of two lines on the floor.
fn distance_m(one: [DVec2; 2], other: [DVec2; 2]) -> f64 {
    let sides = |line: [DVec2; 2], point: DVec2| (line[1] - line[0]).perp_dot(point - line[0]);
    let crosses = |line: [DVec2; 2], by: [DVec2; 2]| sides(line, by[0]) * sides(line, by[1]) < 0.0;
    if crosses(one, other) && crosses(other, one) {
        return 0.0;
    }
    let to = |line: [DVec2; 2], point: DVec2| {
        let along = line[1] - line[0];
        let share = (point - line[0]).dot(along) / along.length_squared();
        let share = if share.is_finite() {
            share.clamp(0.0, 1.0)
        } else {
            0.0
        };
        point.distance(line[0] + share * along)
    };
    let ends = [
        to(one, other[0]),
        to(one, other[1]),
        to(other, one[0]),
        to(other, one[1]),
    ];
    ends.into_iter().fold(f64::INFINITY, f64::min)
}
