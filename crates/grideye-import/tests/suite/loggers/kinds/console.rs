//! Captures of terminals and logs: a prefix before each line.

use crate::loggers::print::{
    Civil, USUAL, clock, each, grid, iso, joined, nested, one, python, two, unix,
};
use crate::loggers::scene::Shot;
use crate::loggers::truth::Truth;
use crate::loggers::variant::Accept::{self, Right, RightOrAsked};
use crate::loggers::variant::Kind;

const MS: i64 = 1_000_000;
const S: i64 = 1_000_000_000;

pub(crate) fn kind() -> Kind {
    let mut kind = Kind::new("7 console logs");
    on_lines(&mut kind);
    on_slow_lines(&mut kind);
    on_blocks(&mut kind);
    terminals(&mut kind);
    named_numbers(&mut kind);
    kind
}

#[derive(Clone, Copy)]
pub(super) enum When {
    Not,
    Relative,
    Absolute,
}

use When::{Absolute, Not, Relative};

pub(super) fn truth_of(scene: &crate::loggers::scene::Scene, when: When) -> Truth {
    match when {
        Not => Truth::of(scene),
        Relative => Truth::of(scene).relative(1),
        Absolute => Truth::of(scene).absolute(1),
    }
}

/// A syslog stamp.
fn month_first(ns: i64) -> String {
    let civil = Civil::of(ns);
    format!("{} {:>2} {}", civil.month(), civil.date.2, civil.clock())
}

pub(super) type Prefix = fn(&Shot) -> String;

fn esp(shot: &Shot) -> String {
    format!("I ({}) grideye: ", 812 + shot.t_ns / MS)
}

/// What stands before 64 numbers on a line, and after them.
pub(super) const PREFIXES: [(&str, When, Prefix, &str); 26] = [
    (
        "R01 Arduino's stamp",
        Relative,
        |shot| format!("{} -> ", clock(shot.utc_ns, ".")),
        "",
    ),
    (
        "Arduino's stamp and a caption",
        Relative,
        |shot| format!("{} -> pixels: ", clock(shot.utc_ns, ".")),
        "",
    ),
    ("ESP-IDF", Relative, esp, ""),
    (
        "ESP-IDF with a color",
        Relative,
        |shot| format!("\u{1b}[0;32m{}", esp(shot)),
        "\u{1b}[0m",
    ),
    (
        "ESP-IDF with a time of day",
        Relative,
        |shot| format!("I ({}) grideye: ", clock(shot.utc_ns, ".")),
        "",
    ),
    (
        "R03 ESPHome",
        Relative,
        |shot| format!("[{}][D][amg:042]: ", clock(shot.utc_ns, ".")),
        "",
    ),
    (
        "ESPHome with a color and a name",
        Relative,
        |shot| {
            format!(
                "\u{1b}[0;36m[{}][D][grideye.sensor:117]: Frame: ",
                clock(shot.utc_ns, ".")
            )
        },
        "\u{1b}[0m",
    ),
    (
        "Arduino-ESP32's log",
        Relative,
        |shot| format!("[{:>6}][I][main.cpp:42] loop(): ", 812 + shot.t_ns / MS),
        "",
    ),
    (
        "R06 Python's logging",
        Absolute,
        |shot| format!("{} - grid - INFO - ", iso(shot.utc_ns, " ", ",")),
        "",
    ),
    (
        "Python's logging with brackets",
        Absolute,
        |shot| format!("[{}] INFO in amg: ", iso(shot.utc_ns, " ", ",")),
        "",
    ),
    (
        "Python's logging with a dot",
        Absolute,
        |shot| format!("{} INFO amg8833 ", iso(shot.utc_ns, " ", ".")),
        "",
    ),
    (
        "Python's logging with a line's number",
        Absolute,
        |shot| format!("{} logger.py:42 DEBUG ", iso(shot.utc_ns, " ", ",")),
        "",
    ),
    (
        "Python's logging without a time",
        Not,
        |_| "INFO:root:".to_owned(),
        "",
    ),
    (
        "Python's loguru",
        Absolute,
        |shot| {
            format!(
                "{} | INFO     | __main__:loop:42 - ",
                iso(shot.utc_ns, " ", ".")
            )
        },
        "",
    ),
    (
        "journalctl with a precise stamp",
        Absolute,
        |shot| format!("{}000+00:00 pi grideye[812]: ", iso(shot.utc_ns, "T", ".")),
        "",
    ),
    (
        "rsyslog's stamp",
        Absolute,
        |shot| format!("{}123+00:00 pi grideye: ", iso(shot.utc_ns, "T", ".")),
        "",
    ),
    (
        "docker logs -t",
        Absolute,
        |shot| format!("{}123456Z ", iso(shot.utc_ns, "T", ".")),
        "",
    ),
    (
        "dmesg",
        Relative,
        |shot| {
            format!(
                "[{:>5}.{:06}] amg88xx: ",
                12 + shot.t_ns / S,
                shot.t_ns / 1_000 % 1_000_000
            )
        },
        "",
    ),
    (
        "RTT's stamp",
        Relative,
        |shot| format!("<info> app: [{:08}] ", shot.t_ns / MS + 5_000),
        "",
    ),
    (
        "Zephyr's stamp",
        Relative,
        |shot| format!("[{},000] <inf> amg88xx: ", clock(shot.t_ns + 12 * S, ".")),
        "",
    ),
    (
        "ts -s with decimals",
        Relative,
        |shot| clock(shot.t_ns, ".") + "000 ",
        "",
    ),
    (
        "ts with Unix time",
        Absolute,
        |shot| unix(shot.utc_ns) + "000 ",
        "",
    ),
    (
        "candump's stamp",
        Absolute,
        |shot| format!("({}000) ", unix(shot.utc_ns)),
        "",
    ),
    ("a tag", Not, |_| "AMG: ".to_owned(), ""),
    ("a tag with a number", Not, |_| "AMG8833: ".to_owned(), ""),
    (
        "a dollar and a checksum's star",
        Not,
        |_| "$GRID,".to_owned(),
        "*",
    ),
];

fn on_lines(kind: &mut Kind) {
    for (name, when, prefix, after) in PREFIXES {
        kind.file("capture.log");
        kind.right(name, move |scene| {
            let number = scene.random.one_of(&USUAL);
            let separator = scene.random.one_of(&[",", ", ", " "]);
            let end = scene.random.one_of(&["\n", "\r\n"]);
            let text = each(&scene.shots, |shot| {
                let after = match after {
                    "*" => format!("*{:02X}", shot.index * 7 % 256),
                    after => after.to_owned(),
                };
                format!(
                    "{}{}{after}{end}",
                    prefix(shot),
                    joined(shot, number, separator)
                )
            });
            (text, truth_of(scene, when))
        });
    }
    let lists: [(&str, When, Prefix); 5] = [
        ("Arduino's stamp before a list", Relative, |shot| {
            format!("{} -> ", clock(shot.utc_ns, "."))
        }),
        ("Python's logging before a list", Absolute, |shot| {
            format!("{} - grid - INFO - ", iso(shot.utc_ns, " ", ","))
        }),
        ("Python's print of a time and a list", Absolute, |shot| {
            format!("{}123 ", unix(shot.utc_ns))
        }),
        (
            "Python's print of a datetime and a list",
            Absolute,
            |shot| iso(shot.utc_ns, " ", ".") + "000 ",
        ),
        ("Python's print of a tuple", Absolute, |shot| {
            format!("({}, ", unix(shot.utc_ns))
        }),
    ];
    for (name, when, prefix) in lists {
        kind.right(name, move |scene| {
            let is_nested = scene.random.between(0, 1) == 1;
            let text = each(&scene.shots, |shot| {
                let list = match is_nested {
                    true => nested(shot, python, ", "),
                    false => format!("[{}]", joined(shot, python, ", ")),
                };
                let prefix = prefix(shot);
                let end = if prefix.starts_with('(') { ")" } else { "" };
                format!("{prefix}{list}{end}\n")
            });
            (text, truth_of(scene, when))
        });
    }
}

/// Stamps of seconds: a frame a second.
fn on_slow_lines(kind: &mut Kind) {
    let prefixes: [(&str, Accept, When, Prefix); 11] = [
        (
            "Arduino's stamp without milliseconds",
            Right,
            Relative,
            |shot| Civil::of(shot.utc_ns).clock() + " -> ",
        ),
        ("ESPHome without milliseconds", Right, Relative, |shot| {
            format!("[{}][I][amg:042]: ", Civil::of(shot.utc_ns).clock())
        }),
        ("syslog", Right, Relative, |shot| {
            format!("{} pi python3[812]: ", month_first(shot.utc_ns))
        }),
        ("journalctl -o short-iso", Right, Absolute, |shot| {
            format!(
                "{}+0000 pi grideye[812]: ",
                &iso(shot.utc_ns, "T", ".")[..19]
            )
        }),
        ("ts", Right, Relative, |shot| month_first(shot.utc_ns) + " "),
        ("ts -s", Right, Relative, |shot| {
            Civil::of(shot.t_ns).clock() + " "
        }),
        ("mosquitto_sub -F %I %t %p", Right, Absolute, |shot| {
            format!("{}+0000 hall/thermal ", &iso(shot.utc_ns, "T", ".")[..19])
        }),
        ("mosquitto_sub -F %U %p", Right, Absolute, |shot| {
            format!("{}.000000000 ", shot.utc_ns / S)
        }),
        ("pm2", Right, Absolute, |shot| {
            format!("0|grideye  | {}Z: ", &iso(shot.utc_ns, "T", ".")[..19])
        }),
        ("minicom's stamp", Right, Absolute, |shot| {
            format!("[{}] ", &iso(shot.utc_ns, " ", ".")[..19])
        }),
        (
            "PuTTY's stamp of a plug-in, day first",
            RightOrAsked,
            Absolute,
            |shot| {
                let civil = Civil::of(shot.utc_ns);
                format!(
                    "[{:02}.{:02}.{} {}] ",
                    civil.date.2,
                    civil.date.1,
                    civil.date.0,
                    civil.clock()
                )
            },
        ),
    ];
    for (name, accept, when, prefix) in prefixes {
        kind.file("capture.log");
        kind.add(name, accept, move |scene| {
            scene.slow();
            let number = scene.random.one_of(&USUAL);
            let separator = scene.random.one_of(&[",", ", ", " "]);
            let text = each(&scene.shots, |shot| {
                format!("{}{}\n", prefix(shot), joined(shot, number, separator))
            });
            (text, truth_of(scene, when))
        });
    }
}

/// The prefix before every line of a block.
fn on_blocks(kind: &mut Kind) {
    let prefixes: [(&str, When, Prefix); 6] = [
        ("Arduino's stamp before each row", Relative, |shot| {
            format!("{} -> ", clock(shot.utc_ns, "."))
        }),
        ("ESP-IDF before each row", Relative, esp),
        ("ESPHome before each row", Relative, |shot| {
            format!("[{}][D][amg:042]: ", clock(shot.utc_ns, "."))
        }),
        ("Python's logging before each row", Absolute, |shot| {
            format!("{} - grid - INFO - ", iso(shot.utc_ns, " ", ","))
        }),
        ("a prompt before each row", Not, |_| "> ".to_owned()),
        ("colors in each row", Not, |_| "\u{1b}[31m".to_owned()),
    ];
    for (name, when, prefix) in prefixes {
        kind.file("capture.log");
        kind.right(name, move |scene| {
            let number = scene.random.one_of(&[two, one]);
            let separator = scene.random.one_of(&[", ", " ", "\t"]);
            let border = scene.random.one_of(&["", "-----------"]);
            let text = each(&scene.shots, |shot| {
                let before = prefix(shot);
                let after = if before.starts_with('\u{1b}') {
                    "\u{1b}[0m"
                } else {
                    ""
                };
                let rows = grid(shot, number, separator);
                let row = |row: &String| format!("{before}{row}{after}\n");
                rows.iter().map(row).collect::<String>() + &format!("{before}{border}{after}\n")
            });
            (text, truth_of(scene, when))
        });
    }
    kind.file("capture.txt");
    kind.right("Adafruit's example under Arduino's stamp", |scene| {
        let text = each(&scene.shots, |shot| {
            let before = format!("{} -> ", clock(shot.utc_ns, "."));
            let rows = grid(shot, two, ", ").join(&format!(", \n{before}"));
            format!("{before}[{rows}, \n{before}]\n{before}\n")
        });
        (text, Truth::of(scene).relative(1))
    });
}

fn terminals(kind: &mut Kind) {
    let terminals: [(&str, &str, &str, &str); 6] = [
        (
            "PuTTY's log",
            "=~=~=~=~=~=~=~=~=~=~=~= PuTTY log 2025.11.24 16:00:00 =~=~=~=~=~=~=~=~=~=~=~=\r\n",
            "\r\n",
            "",
        ),
        (
            "minicom's capture",
            "Welcome to minicom 2.8\r\n\r\nPort /dev/ttyUSB0, 10:12:33\r\n\r\nPress CTRL-A Z for help on special keys\r\n\r\n",
            "\r\n",
            "",
        ),
        ("screen's hardcopy log", "", "\r\r\n", ""),
        (
            "a cleared screen before each",
            "",
            "\r\n",
            "\u{1b}[2J\u{1b}[H",
        ),
        (
            "script's typescript",
            "Script started on 2025-11-24 16:00:00+00:00\n",
            "\r\n",
            "",
        ),
        (
            "miniterm's capture",
            "--- Miniterm on /dev/ttyACM0  115200,8,N,1 ---\n--- Quit: Ctrl+] | Menu: Ctrl+T ---\n",
            "\r\n",
            "",
        ),
    ];
    for (name, head, end, before) in terminals {
        kind.file("capture.log");
        kind.right(name, move |scene| {
            let number = scene.random.one_of(&[two, one]);
            let in_rows = scene.random.between(0, 1) == 1;
            let text = each(&scene.shots, |shot| match in_rows {
                true => format!("{before}{}{end}{end}", grid(shot, number, " ").join(end)),
                false => format!("{before}{}{end}", joined(shot, number, ",")),
            });
            (format!("{head}{text}"), Truth::of(scene))
        });
    }
}

fn named_numbers(kind: &mut Kind) {
    kind.right("bytes that are no text at the start", |scene| {
        let text = each(&scene.shots, |shot| joined(shot, two, ",") + "\r\n");
        (
            [b"\xff\xfe\x80\x00\xf8\r\n", text.as_bytes()].concat(),
            Truth::of(scene),
        )
    });
    kind.file("capture.txt");
    kind.right("the serial plotter's names", |scene| {
        let separator = scene.random.one_of(&[",", "\t", " "]);
        let text = each(&scene.shots, |shot| {
            let values = shot.celsius();
            let named: Vec<String> = values
                .iter()
                .enumerate()
                .map(|(place, value)| format!("p{place}:{value:.2}"))
                .collect();
            named.join(separator) + "\n"
        });
        (text, Truth::of(scene))
    });
    kind.right("Python's print of a dictionary", |scene| {
        let text = each(&scene.shots, |shot| {
            format!(
                "{{'time': {}, 'pixels': [{}], 'people': {}}}\n",
                unix(shot.utc_ns),
                joined(shot, python, ", "),
                shot.people
            )
        });
        (text, Truth::of(scene).absolute(0).people(scene, "people"))
    });
    kind.right("keys and values on a line", |scene| {
        let text = each(&scene.shots, |shot| {
            format!(
                "t={} therm={:.4} pixels={}\n",
                unix(shot.t_ns),
                shot.thermistor_c(),
                joined(shot, two, ",")
            )
        });
        (text, Truth::of(scene).relative(0).thermistor(0.001))
    });
}
