//! When the frames were read.

use crate::loggers::print::{
    Civil, clock, column, each, iso, joined, p, pixels, table, timed, two, unix,
};
use crate::loggers::scene::Shot;
use crate::loggers::truth::{Times, Truth};
use crate::loggers::variant::Accept::{self, Asked, Right, RightOrAsked};
use crate::loggers::variant::Kind;

const MS: i64 = 1_000_000;
const S: i64 = 1_000_000_000;

pub(crate) fn kind() -> Kind {
    let mut kind = Kind::new("3 times");
    numbers(&mut kind);
    stamps(&mut kind);
    dates(&mut kind);
    days(&mut kind);
    zones(&mut kind);
    sheets(&mut kind);
    serials(&mut kind);
    repeated(&mut kind);
    wrapped(&mut kind);
    kind
}

/// A column of the time, and how exact it is since 1970 or from frame to frame.
fn named(
    kind: &mut Kind,
    name: &'static str,
    column: &'static str,
    times: Times,
    stamp: impl Fn(&Shot) -> String + 'static,
) {
    kind.right(name, move |scene| {
        let text = timed(column, &scene.shots, &stamp, Vec::new());
        let mut truth = Truth::of(scene);
        truth.times = times;
        (text, truth)
    });
}

/// A frame a second.
fn slow(
    kind: &mut Kind,
    name: &'static str,
    column: &'static str,
    accept: Accept,
    times: Times,
    stamp: impl Fn(&Shot) -> String + 'static,
) {
    kind.add(name, accept, move |scene| {
        scene.slow();
        let text = timed(column, &scene.shots, &stamp, Vec::new());
        let mut truth = Truth::of(scene);
        truth.times = times;
        (text, truth)
    });
}

fn ms(after_s: i64, shot: &Shot) -> String {
    (after_s * 1_000 + shot.t_ns / MS).to_string()
}

fn us(after_s: i64, shot: &Shot) -> String {
    (after_s * 1_000_000 + shot.t_ns / 1_000).to_string()
}

/// A variant's name, the name of its column, and its stamp.
type Stamped = (&'static str, &'static str, Stamp);
type Stamp = fn(&Shot) -> String;

const SINCE_1970: [Stamped; 8] = [
    ("Unix seconds", "time", |shot| unix(shot.utc_ns)),
    ("Unix seconds of Python", "timestamp", |shot| {
        unix(shot.utc_ns) + "0004"
    }),
    ("Unix milliseconds", "ts", |shot| {
        (shot.utc_ns / MS).to_string()
    }),
    ("Unix microseconds", "time", |shot| {
        (shot.utc_ns / 1_000).to_string()
    }),
    ("Unix nanoseconds", "time", |shot| shot.utc_ns.to_string()),
    ("Unix nanoseconds, time_ns", "time_ns", |shot| {
        shot.utc_ns.to_string()
    }),
    ("Unix milliseconds with decimals", "epoch_ms", |shot| {
        format!("{}.001", shot.utc_ns / MS)
    }),
    ("Unix milliseconds, scientific", "time", |shot| {
        let ms = (shot.utc_ns / MS).to_string();
        format!("{}.{}e12", &ms[..1], &ms[1..])
    }),
];

const SINCE_START: [Stamped; 24] = [
    ("W08 millis after 28 hours", "millis", |shot| {
        ms(100_800, shot)
    }),
    ("W09 time_us after 2 minutes", "time_us", |shot| {
        us(120, shot)
    }),
    ("time_us after 30 hours", "time_us", |shot| {
        us(108_000, shot)
    }),
    ("millis from 0", "millis", |shot| ms(0, shot)),
    ("millis()", "millis()", |shot| ms(1, shot)),
    ("t_ms", "t_ms", |shot| ms(144_000, shot)),
    ("Time [ms]", "Time [ms]", |shot| ms(324_000, shot)),
    ("uptime_ms", "uptime_ms", |shot| ms(2_520_000, shot)),
    ("timeMs", "timeMs", |shot| ms(9_000, shot)),
    ("micros", "micros", |shot| us(4, shot)),
    ("t_us", "t_us", |shot| us(400, shot)),
    ("Time (µs)", "Time (µs)", |shot| us(400, shot)),
    ("esp_timer_us", "esp_timer_us", |shot| us(9, shot)),
    ("monotonic_ns", "monotonic_ns", |shot| {
        us(10_800, shot) + "000"
    }),
    ("elapsed_s", "elapsed_s", |shot| unix(shot.t_ns)),
    ("Zeit [s]", "Zeit [s]", |shot| unix(shot.t_ns)),
    ("t (s)", "t (s)", |shot| unix(shot.t_ns + 17 * S)),
    ("Tiempo (s)", "Tiempo (s)", |shot| unix(shot.t_ns)),
    ("temps (ms)", "temps (ms)", |shot| ms(0, shot)),
    ("czas [ms]", "czas [ms]", |shot| ms(61, shot)),
    ("seconds since start", "seconds_since_start", |shot| {
        unix(shot.t_ns)
    }),
    ("elapsed with its unit in the value", "elapsed", |shot| {
        unix(shot.t_ns) + "s"
    }),
    ("milliseconds in the value", "t", |shot| ms(3, shot) + "ms"),
    ("uptime as hours, minutes, seconds", "uptime", |shot| {
        clock(shot.t_ns + 7_000 * S, ".")
    }),
];

/// A frame a second.
const SINCE_START_SLOWLY: [Stamped; 4] = [
    ("W12 elapsed_s, one a second", "elapsed_s", |shot| {
        unix(shot.t_ns)
    }),
    ("elapsed_s, one a second, whole", "elapsed_s", |shot| {
        (shot.t_ns / S).to_string()
    }),
    ("Zeit [s], one a second", "Zeit [s]", |shot| unix(shot.t_ns)),
    ("t_ms, one a second", "t_ms", |shot| ms(8, shot)),
];

fn numbers(kind: &mut Kind) {
    let absolute = Times::Absolute(2_000);
    for (name, column, stamp) in SINCE_1970 {
        named(kind, name, column, absolute, stamp);
    }
    let whole = |shot: &Shot| (shot.utc_ns / S).to_string();
    slow(kind, "whole Unix seconds", "time", Right, absolute, whole);
    let relative = Times::Relative(2_000);
    for (name, column, stamp) in SINCE_START {
        named(kind, name, column, relative, stamp);
    }
    for (name, column, stamp) in SINCE_START_SLOWLY {
        slow(kind, name, column, Right, relative, stamp);
    }
    let minutes = |shot: &Shot| {
        let minutes = f64::from(i32::try_from(shot.t_ns / MS).unwrap()) / 60_000.0;
        format!("{minutes:.5}")
    };
    let about = Times::Relative(2 * MS);
    slow(
        kind,
        "time in minutes",
        "time_min",
        RightOrAsked,
        about,
        minutes,
    );
    kind.unsure("t, without a unit", |scene| {
        let text = timed(
            "t",
            &scene.shots,
            |shot| (shot.t_ns / MS).to_string(),
            Vec::new(),
        );
        (text, Truth::of(scene).relative(0))
    });
}

const STAMPS: [Stamped; 8] = [
    ("ISO with Z", "time", |shot| {
        iso(shot.utc_ns, "T", ".") + "Z"
    }),
    ("ISO without a zone", "datetime", |shot| {
        iso(shot.utc_ns, " ", ".")
    }),
    ("ISO with +01:00", "time", |shot| {
        iso(shot.utc_ns + 3_600 * S, "T", ".") + "+01:00"
    }),
    ("ISO with -0730", "time", |shot| {
        iso(shot.utc_ns - 27_000 * S, "T", ".") + "-0730"
    }),
    ("ISO with six decimals", "time", |shot| {
        iso(shot.utc_ns, " ", ".") + "000"
    }),
    ("ISO with a colon before milliseconds", "time", |shot| {
        iso(shot.utc_ns, " ", ":")
    }),
    ("ISO basic", "time", |shot| {
        iso(shot.utc_ns, "T", ".").replace(['-', ':'], "") + "Z"
    }),
    ("stamp of a file's name", "stamp", |shot| {
        iso(shot.utc_ns, "_", ".").replace(':', "-")
    }),
];

/// `Mon Nov 24 16:00:00 2025`.
fn ctime(shot: &Shot) -> String {
    let (civil, weekday) = (Civil::of(shot.utc_ns), Civil::weekday(shot.utc_ns));
    let (year, _, day) = civil.date;
    format!(
        "{weekday} {} {day:>2} {} {year}",
        civil.month(),
        civil.clock()
    )
}

/// A frame a second.
const SLOW_STAMPS: [Stamped; 5] = [
    ("ctime", "time", ctime),
    ("RFC 2822", "Date", |shot| {
        let (civil, weekday) = (Civil::of(shot.utc_ns), Civil::weekday(shot.utc_ns));
        let (year, _, day) = civil.date;
        format!(
            "\"{weekday}, {day:02} {} {year} {} +0000\"",
            civil.month(),
            civil.clock()
        )
    }),
    ("with AM and PM", "time", |shot| {
        let civil = Civil::of(shot.utc_ns);
        let half = if civil.hour < 12 { "AM" } else { "PM" };
        let hour = (civil.hour + 11) % 12 + 1;
        format!(
            "{} {hour}:{:02}:{:02} {half}",
            civil.day(),
            civil.minute,
            civil.second
        )
    }),
    ("day, month's name, year", "time", |shot| {
        let civil = Civil::of(shot.utc_ns);
        let (year, _, day) = civil.date;
        format!("{day:02}-{}-{year} {}", civil.month(), civil.clock())
    }),
    ("digits of a day and a time", "time", |shot| {
        iso(shot.utc_ns, "", ".")[..18].replace(['-', ':'], "")
    }),
];

fn stamps(kind: &mut Kind) {
    let exact = Times::Absolute(2_000);
    for (name, column, stamp) in STAMPS {
        named(kind, name, column, exact, stamp);
    }
    let clock = |shot: &Shot| clock(shot.utc_ns, ".");
    named(kind, "a time of day", "time", Times::Relative(2_000), clock);
    for (name, column, stamp) in SLOW_STAMPS {
        let accept = if name.starts_with('d') {
            RightOrAsked
        } else {
            Right
        };
        slow(kind, name, column, accept, exact, stamp);
    }
}

fn dates(kind: &mut Kind) {
    for (name, day_first, sign) in [
        ("day first, dots", true, "."),
        ("day first, slashes", true, "/"),
        ("month first, slashes", false, "/"),
    ] {
        kind.right(name, move |scene| {
            scene.on_day(|day| day > 12);
            let text = timed(
                "time",
                &scene.shots,
                |shot| dated(shot, day_first, sign),
                Vec::new(),
            );
            (text, Truth::of(scene).absolute(0))
        });
    }
    kind.add("day or month first", Asked, |scene| {
        let month = Civil::of(scene.shots[0].utc_ns).date.1;
        scene.on_day(|day| day <= 12 && day != month);
        let text = timed(
            "time",
            &scene.shots,
            |shot| dated(shot, true, "/"),
            Vec::new(),
        );
        (text, Truth::of(scene).absolute(0))
    });
    for (name, comma) in [
        ("W14 a comma before milliseconds", ","),
        ("a comma before milliseconds, semicolons", ";"),
    ] {
        kind.right(name, move |scene| {
            let text = each(&scene.shots, |shot| {
                format!(
                    "{}{comma}{}\n",
                    iso(shot.utc_ns, " ", ","),
                    joined(shot, two, comma)
                )
            });
            (text, Truth::of(scene).absolute(0))
        });
    }
    kind.right("a time of day with a comma before milliseconds", |scene| {
        let text = each(&scene.shots, |shot| {
            format!("{},{}\n", clock(shot.utc_ns, ","), joined(shot, two, ","))
        });
        (text, Truth::of(scene).relative(0))
    });
}

fn days(kind: &mut Kind) {
    kind.right("day and time in two columns", |scene| {
        let mut columns = vec![
            column("Date", &scene.shots, |shot| Civil::of(shot.utc_ns).day()),
            column("Time", &scene.shots, |shot| clock(shot.utc_ns, ".")),
        ];
        columns.extend(pixels(&scene.shots, p, two));
        (table(",", &columns), Truth::of(scene).absolute(0))
    });
    kind.right("time and day in the last columns", |scene| {
        scene.on_day(|day| day > 12);
        let mut columns = pixels(&scene.shots, p, two);
        columns.push(column("Uhrzeit", &scene.shots, |shot| {
            clock(shot.utc_ns, ".")
        }));
        columns.push(column("Datum", &scene.shots, |shot| {
            dated(shot, true, ".")[..10].to_owned()
        }));
        (table(";", &columns), Truth::of(scene).absolute(0))
    });
    kind.right("past midnight", |scene| {
        let before = 86_400 * S - scene.shots[4].t_ns - 30 * MS;
        let text = timed(
            "time",
            &scene.shots,
            |shot| clock(before + shot.t_ns, "."),
            Vec::new(),
        );
        (text, Truth::of(scene).relative(0))
    });
    kind.unsure("the last frame first", |scene| {
        let shots: Vec<Shot> = scene.shots.iter().rev().cloned().collect();
        let text = timed(
            "time",
            &shots,
            |shot| iso(shot.utc_ns, "T", ".") + "Z",
            Vec::new(),
        );
        (text, Truth::of(scene).absolute(0))
    });
    kind.right("a number and a time of a lost frame", |scene| {
        let at = usize::try_from(scene.random.between(2, 7)).unwrap();
        let mut shots = scene.shots.clone();
        shots.remove(at);
        let mut columns = vec![
            column("frame", &shots, |shot| (shot.index + 40).to_string()),
            column("time", &shots, |shot| unix(shot.utc_ns)),
        ];
        columns.extend(pixels(&shots, p, two));
        (
            table(",", &columns),
            Truth::of(scene).absolute(0).numbered().gone(at),
        )
    });
}

fn dated(shot: &Shot, day_first: bool, sign: &str) -> String {
    let civil = Civil::of(shot.utc_ns);
    let (year, month, day) = civil.date;
    let (first, second) = if day_first {
        (day, month)
    } else {
        (month, day)
    };
    format!(
        "{first:02}{sign}{second:02}{sign}{year} {}",
        clock(shot.utc_ns, ".")
    )
}

fn zones(kind: &mut Kind) {
    for (name, zone, hours, accept) in [
        ("a zone UTC", "UTC", 0, Right),
        ("a zone GMT", "GMT", 0, Right),
        ("a zone CET", "CET", 1, RightOrAsked),
        ("a zone JST", "JST", 9, RightOrAsked),
        ("a zone EST", "EST", -5, Asked),
        ("a zone MST", "MST", -7, Asked),
        ("a zone CST", "CST", -6, Asked),
    ] {
        kind.add(name, accept, move |scene| {
            let stamp =
                |shot: &Shot| format!("{} {zone}", iso(shot.utc_ns + hours * 3_600 * S, " ", "."));
            let text = timed("time", &scene.shots, stamp, Vec::new());
            (text, Truth::of(scene).absolute(0))
        });
    }
    kind.unsure("ctime with CET", |scene| {
        scene.slow();
        let stamp = |shot: &Shot| {
            let local = shot.utc_ns + 3_600 * S;
            let civil = Civil::of(local);
            format!(
                "{} {} {:>2} {} CET {}",
                Civil::weekday(local),
                civil.month(),
                civil.date.2,
                civil.clock(),
                civil.date.0
            )
        };
        let text = timed("time", &scene.shots, stamp, Vec::new());
        (text, Truth::of(scene).absolute(0))
    });
}

fn sheets(kind: &mut Kind) {
    let minutes = |shot: &Shot| {
        let civil = Civil::of(shot.utc_ns);
        format!("{:02}:{:02}.{}", civil.minute, civil.second, civil.ms / 100)
    };
    slow(
        kind,
        "W25 minutes and seconds",
        "time",
        RightOrAsked,
        Times::Relative(101 * MS),
        minutes,
    );
    kind.unsure("minutes and seconds, ten a second", move |scene| {
        scene.punctual();
        let text = timed("Time", &scene.shots, minutes, Vec::new());
        (text, Truth::of(scene).relative(1))
    });
    kind.unsure("minutes and seconds past the hour", move |scene| {
        scene.slow();
        let later = 3_600 * S - scene.shots[5].utc_ns % (3_600 * S);
        scene.shots.iter_mut().for_each(|shot| shot.utc_ns += later);
        let text = timed("time", &scene.shots, minutes, Vec::new());
        (text, Truth::of(scene).relative(1))
    });
    kind.unsure("hours and minutes, ten a second", |scene| {
        scene.punctual();
        let minutes = |shot: &Shot| Civil::of(shot.utc_ns).clock()[..5].to_owned();
        let text = timed("time", &scene.shots, minutes, Vec::new());
        let mut truth = Truth::of(scene);
        truth.times = Times::Equal;
        (text, truth)
    });
}

/// Days since 1899-12-30, as spreadsheets count.
fn serial(shot: &Shot) -> String {
    let days = shot.utc_ns / (86_400 * S) + 25_569;
    let part = i128::from(shot.utc_ns % (86_400 * S)) * 10_000_000_000 / i128::from(86_400 * S);
    format!("{days}.{part:010}")
}

fn serials(kind: &mut Kind) {
    for (name, column) in [
        ("days of a spreadsheet, Date", "Date"),
        ("days of a spreadsheet, time", "time"),
    ] {
        named(kind, name, column, Times::Absolute(MS), serial);
    }
    let cut = |shot: &Shot| serial(shot)[..11].to_owned();
    let (name, to_seconds) = ("days of a spreadsheet, five decimals", Times::Absolute(S));
    slow(kind, name, "timestamp", RightOrAsked, to_seconds, cut);
    // Steps of 100 ns since the year 1.
    let ticks = |shot: &Shot| (i128::from(shot.utc_ns) / 100 + 621_355_968_000_000_000).to_string();
    slow(
        kind,
        "ticks of .NET",
        "Ticks",
        RightOrAsked,
        Times::Absolute(2_000),
        ticks,
    );
    kind.right("decimal commas in the times", |scene| {
        let mut columns = vec![column("Zeit [s]", &scene.shots, |shot| {
            unix(shot.t_ns).replace('.', ",")
        })];
        columns.extend(pixels(&scene.shots, p, |celsius| {
            two(celsius).replace('.', ",")
        }));
        (table(";", &columns), Truth::of(scene).relative(0))
    });
}

fn repeated(kind: &mut Kind) {
    let stamps: [(&str, Stamp); 4] = [
        ("ten frames within each second, a time of day", |shot| {
            Civil::of(shot.utc_ns).clock()
        }),
        ("ten frames within each second, ISO", |shot| {
            iso(shot.utc_ns, "T", ".")[..19].to_owned()
        }),
        ("ten frames within each second, Unix time", |shot| {
            (shot.utc_ns / S).to_string()
        }),
        ("ten frames within each second, ctime", ctime),
    ];
    for (name, stamp) in stamps {
        kind.unsure(name, move |scene| {
            scene.punctual();
            (
                timed("time", &scene.shots, stamp, Vec::new()),
                Truth::of(scene).said(),
            )
        });
    }
    let equal: [(&str, &str, &str); 3] = [
        ("W26 all stamps are 1.76E+09", "time", "1.76E+09"),
        ("all stamps are of one day", "date", "2025-11-24"),
        ("all stamps are of one minute", "time", "24.11.2025 16:00"),
    ];
    for (name, called, stamp) in equal {
        kind.unsure(name, move |scene| {
            scene.punctual();
            let text = timed(called, &scene.shots, |_| stamp.to_owned(), Vec::new());
            let mut truth = Truth::of(scene);
            truth.times = Times::Equal;
            (text, truth)
        });
    }
}

fn wrapped(kind: &mut Kind) {
    for (name, called, ns, bits) in [
        ("millis() after 49.7 days", "millis", MS, 32),
        ("micros() after 71.6 minutes", "micros", 1_000, 32),
        ("16 bits of milliseconds", "t_ms", MS, 16),
        ("signed 32 bits of milliseconds", "ms", MS, 31),
    ] {
        kind.right(name, move |scene| {
            let limit = 1_i64 << bits;
            let begin = limit - scene.shots[5].t_ns / ns - 3;
            let stamp = |shot: &Shot| {
                let count = begin + shot.t_ns / ns;
                let again = if bits == 31 {
                    count - 2 * limit
                } else {
                    count - limit
                };
                (if count < limit { count } else { again }).to_string()
            };
            let text = timed(called, &scene.shots, stamp, Vec::new());
            (text, Truth::of(scene).relative(0))
        });
    }
    for (name, bits) in [("a number of 8 bits", 8), ("a number of 16 bits", 16)] {
        kind.right(name, move |scene| {
            let number = |shot: &Shot| {
                let limit = 1_usize << bits;
                ((limit - 6 + shot.index) % limit).to_string()
            };
            let mut columns = vec![
                column("seq", &scene.shots, number),
                column("ts", &scene.shots, |shot| unix(shot.utc_ns)),
            ];
            columns.extend(pixels(&scene.shots, p, two));
            (
                table(",", &columns),
                Truth::of(scene).absolute(0).numbered(),
            )
        });
    }
}
