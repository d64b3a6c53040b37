//! What stands beside the frames: labels, numbers, headers, the thermistor, and names in any script.

use crate::loggers::print::{
    column, each, grid, iso, joined, nested, p, pixels, python, short, table, timed, two, unix,
};
use crate::loggers::scene::Shot;
use crate::loggers::truth::Truth;
use crate::loggers::variant::Accept::{Right, RightOrAsked};
use crate::loggers::variant::Kind;

pub(crate) fn kind() -> Kind {
    let mut kind = Kind::new("6 beside");
    lines(&mut kind);
    columns(&mut kind);
    notes(&mut kind);
    more_columns(&mut kind);
    scripts(&mut kind);
    more_scripts(&mut kind);
    restarts(&mut kind);
    lost(&mut kind);
    lost_rows(&mut kind);
    thermistors(&mut kind);
    thermistors_of_words(&mut kind);
    kind
}

fn people(shot: &Shot) -> String {
    shot.people.to_string()
}

fn lines(kind: &mut Kind) {
    kind.file("capture.txt");
    kind.right("W17 a label after each frame", |scene| {
        let text = each(&scene.shots, |shot| {
            format!("{}\npeople: {}\n", joined(shot, two, ","), shot.people)
        });
        (text, Truth::of(scene).people(scene, ""))
    });
    kind.right("a label before each frame", |scene| {
        let text = each(&scene.shots, |shot| {
            format!("people: {}\n{}\n", shot.people, joined(shot, two, ","))
        });
        (text, Truth::of(scene).people(scene, ""))
    });
    kind.right("a label after each block", |scene| {
        let text = each(&scene.shots, |shot| {
            format!(
                "{}\npeople = {}\n\n",
                grid(shot, two, " ").join("\n"),
                shot.people
            )
        });
        (text, Truth::of(scene).people(scene, ""))
    });
    kind.right("a label before each block", |scene| {
        let text = each(&scene.shots, |shot| {
            format!(
                "label {}\n{}\n\n",
                shot.people,
                grid(shot, two, " ").join("\n")
            )
        });
        (text, Truth::of(scene).people(scene, ""))
    });
    kind.right("a time after each block", |scene| {
        let text = each(&scene.shots, |shot| {
            format!(
                "{}\nt={} ms\n\n",
                grid(shot, two, "\t").join("\n"),
                shot.t_ns / 1_000_000
            )
        });
        (text, Truth::of(scene).relative(0))
    });
    kind.unsure("a time before and a label after each block", |scene| {
        let text = each(&scene.shots, |shot| {
            format!(
                "{}\n{}\npeople: {}\n\n",
                iso(shot.utc_ns, " ", "."),
                grid(shot, two, " ").join("\n"),
                shot.people
            )
        });
        (text, Truth::of(scene).absolute(0).people(scene, ""))
    });
    kind.unsure("a label in words after each frame", |scene| {
        let word = |shot: &Shot| if shot.people > 0 { "someone" } else { "empty" };
        let text = each(&scene.shots, |shot| {
            format!("{}\nlabel: {}\n", joined(shot, two, " "), word(shot))
        });
        (
            text,
            Truth::of(scene).label(scene, "", |shot| word(shot).to_owned()),
        )
    });
    kind.right("a label at the end of the line", |scene| {
        let text = each(&scene.shots, |shot| {
            format!("{}, people={}\n", joined(shot, two, ", "), shot.people)
        });
        (text, Truth::of(scene).people(scene, ""))
    });
}

fn columns(kind: &mut Kind) {
    for (name, called) in [
        ("people", "people"),
        ("n_people", "n_people"),
        ("count", "count"),
        ("Anzahl Personen", "Anzahl Personen"),
        ("label of a class", "class"),
        ("y", "y"),
        ("occupancy", "occupancy"),
    ] {
        kind.file("walk.csv");
        kind.right(name, move |scene| {
            let text = timed(
                "time",
                &scene.shots,
                |shot| unix(shot.utc_ns),
                vec![column(called, &scene.shots, people)],
            );
            (text, Truth::of(scene).absolute(0).people(scene, called))
        });
    }
    kind.right("a label of true and false", |scene| {
        let is_there = |shot: &Shot| (shot.people > 0).to_string();
        let text = timed(
            "time",
            &scene.shots,
            |shot| unix(shot.utc_ns),
            vec![column("present", &scene.shots, is_there)],
        );
        (
            text,
            Truth::of(scene)
                .absolute(0)
                .label(scene, "present", is_there),
        )
    });
}

fn notes(kind: &mut Kind) {
    kind.right("a note with a comma in quotes", |scene| {
        let note = |shot: &Shot| {
            if shot.people > 1 {
                "\"two, at the door\""
            } else {
                "nobody else"
            }
            .to_owned()
        };
        let text = timed(
            "time",
            &scene.shots,
            |shot| unix(shot.utc_ns),
            vec![
                column("note", &scene.shots, note),
                column("people", &scene.shots, people),
            ],
        );
        let note = move |shot: &Shot| note(shot).trim_matches('"').to_owned();
        (
            text,
            Truth::of(scene)
                .absolute(0)
                .label(scene, "note", note)
                .people(scene, "people"),
        )
    });
    kind.right("empty labels", |scene| {
        let rare = |shot: &Shot| if shot.index % 5 == 2 { "fall" } else { "" }.to_owned();
        let text = timed(
            "time",
            &scene.shots,
            |shot| unix(shot.utc_ns),
            vec![column("event", &scene.shots, rare)],
        );
        (
            text,
            Truth::of(scene).absolute(0).label(scene, "event", rare),
        )
    });
    kind.right("a session's constant", |scene| {
        let text = timed(
            "time",
            &scene.shots,
            |shot| unix(shot.utc_ns),
            vec![
                column("session", &scene.shots, |_| "S07".to_owned()),
                column("people", &scene.shots, people),
            ],
        );
        let truth = Truth::of(scene).absolute(0).people(scene, "people");
        (text, truth.label(scene, "session", |_| "S07".to_owned()))
    });
    kind.right("a label that looks like a temperature", |scene| {
        let text = timed(
            "time",
            &scene.shots,
            |shot| unix(shot.utc_ns),
            vec![column("ambient", &scene.shots, |shot| {
                two(f64::from(shot.people) + 21.25)
            })],
        );
        let truth = Truth::of(scene)
            .absolute(0)
            .label(scene, "ambient", |shot| two(f64::from(shot.people) + 21.25));
        (text, truth)
    });
}

fn more_columns(kind: &mut Kind) {
    kind.right("two labels of one name", |scene| {
        let other = |shot: &Shot| (shot.index % 3).to_string();
        let text = timed(
            "time",
            &scene.shots,
            |shot| unix(shot.utc_ns),
            vec![
                column("label", &scene.shots, people),
                column("label", &scene.shots, other),
            ],
        );
        let truth = Truth::of(scene).absolute(0).people(scene, "label");
        (text, truth.label(scene, "label", other))
    });
    kind.right("a confidence", |scene| {
        let confidence = |shot: &Shot| format!("0.{}5", shot.index % 9 + 1);
        let text = timed(
            "time",
            &scene.shots,
            |shot| unix(shot.utc_ns),
            vec![column("confidence", &scene.shots, confidence)],
        );
        (
            text,
            Truth::of(scene)
                .absolute(0)
                .label(scene, "confidence", confidence),
        )
    });
    kind.right("labels before the pixels", |scene| {
        let mut columns = vec![
            column("people", &scene.shots, people),
            column("activity", &scene.shots, |shot| {
                if shot.people > 0 { "walk" } else { "none" }.to_owned()
            }),
            column("ts", &scene.shots, |shot| unix(shot.utc_ns)),
        ];
        columns.extend(pixels(&scene.shots, p, python));
        let truth = Truth::of(scene).absolute(0).people(scene, "people");
        (table(",", &columns), truth)
    });
    kind.right("an index without a name", |scene| {
        let mut columns = vec![
            column("", &scene.shots, |shot| shot.index.to_string()),
            column("time", &scene.shots, |shot| iso(shot.utc_ns, " ", ".")),
        ];
        columns.extend(pixels(&scene.shots, p, python));
        columns.push(column("people", &scene.shots, people));
        (
            table(",", &columns),
            Truth::of(scene).absolute(0).people(scene, "people"),
        )
    });
}

fn scripts(kind: &mut Kind) {
    kind.file("walk.csv");
    kind.right("W30 Japanese", |scene| {
        let room = |_: &Shot| "3".to_owned();
        let text = timed(
            "時刻",
            &scene.shots,
            |shot| iso(shot.utc_ns, " ", "."),
            vec![
                column("人数", &scene.shots, people),
                column("部屋", &scene.shots, room),
            ],
        );
        let truth = Truth::of(scene).absolute(0).people(scene, "人数");
        (text, truth.label(scene, "部屋", room))
    });
    kind.right("Russian", |scene| {
        let text = timed(
            "время",
            &scene.shots,
            |shot| iso(shot.utc_ns, " ", "."),
            vec![
                column("человек", &scene.shots, people),
                column("комната", &scene.shots, |_| "кухня".to_owned()),
            ],
        );
        let truth = Truth::of(scene).absolute(0).people(scene, "человек");
        (text, truth.label(scene, "комната", |_| "кухня".to_owned()))
    });
    kind.unsure("umlauts in Latin-1", |scene| {
        let text = timed(
            "Zeit",
            &scene.shots,
            |shot| iso(shot.utc_ns, " ", "."),
            vec![
                column("Größe", &scene.shots, people),
                column("Tür", &scene.shots, |shot| (shot.index % 2).to_string()),
            ],
        );
        let bytes: Vec<u8> = text
            .chars()
            .map(|letter| u8::try_from(u32::from(letter)).unwrap())
            .collect();
        let truth = Truth::of(scene).absolute(0).people(scene, "größe");
        (
            bytes,
            truth.label(scene, "tür", |shot| (shot.index % 2).to_string()),
        )
    });
}

fn more_scripts(kind: &mut Kind) {
    kind.right("Greek and Chinese", |scene| {
        let text = timed(
            "时间",
            &scene.shots,
            |shot| unix(shot.utc_ns),
            vec![
                column("άτομα", &scene.shots, people),
                column("人", &scene.shots, |shot| (2 - shot.people).to_string()),
            ],
        );
        let truth = Truth::of(scene).absolute(0).people(scene, "άτομα");
        (
            text,
            truth.label(scene, "人", |shot| (2 - shot.people).to_string()),
        )
    });
    kind.right("values in another script", |scene| {
        let who = |shot: &Shot| if shot.people > 0 { "一人" } else { "無人" }.to_owned();
        let text = timed(
            "time",
            &scene.shots,
            |shot| unix(shot.utc_ns),
            vec![column("状態", &scene.shots, who)],
        );
        (text, Truth::of(scene).absolute(0).label(scene, "状態", who))
    });
}

fn restarts(kind: &mut Kind) {
    for (name, between) in [
        ("W19 the header again", ""),
        ("the header again after a blank line", "\n"),
        (
            "the header again after boot messages",
            "ets Jun  8 2016 00:22:57\nrst:0x1 (POWERON_RESET),boot:0x13\nAMG88xx ready\n",
        ),
        ("the header again after a comment", "# restarted\n"),
    ] {
        kind.file("walk.csv");
        kind.right(name, move |scene| {
            let text = timed(
                "time",
                &scene.shots,
                |shot| unix(shot.utc_ns),
                vec![column("people", &scene.shots, people)],
            );
            let mut lines: Vec<&str> = text.split_inclusive('\n').collect();
            let again = format!("{between}{}", lines[0]);
            let at = usize::try_from(scene.random.between(3, 7)).unwrap();
            lines.insert(at, &again);
            (
                lines.concat(),
                Truth::of(scene).absolute(0).people(scene, "people"),
            )
        });
    }
    kind.file("capture.txt");
    kind.right("boot messages among lines", |scene| {
        let at = usize::try_from(scene.random.between(3, 7)).unwrap();
        let text = each(&scene.shots, |shot| {
            let boot = "\nload:0x3fff0030,len:1184\nentry 0x400805e4\nAMG88xx test\n\n";
            format!(
                "{}{}\n",
                if shot.index == at { boot } else { "" },
                joined(shot, two, ",")
            )
        });
        (text, Truth::of(scene))
    });
    kind.file("walk.csv");
    kind.right("lines of a program before the header", |scene| {
        let text = timed("time", &scene.shots, |shot| unix(shot.utc_ns), Vec::new());
        (
            format!("Logger v1.2\nSerial 0042\n\n{text}"),
            Truth::of(scene).absolute(0),
        )
    });
    kind.right("sums below the table", |scene| {
        let text = timed("time", &scene.shots, |shot| unix(shot.utc_ns), Vec::new());
        (
            format!("{text}\n# {} frames\n", scene.shots.len()),
            Truth::of(scene).absolute(0),
        )
    });
}

fn lost(kind: &mut Kind) {
    kind.file("capture.txt");
    kind.right("a time whose frame is lost", |scene| {
        let at = usize::try_from(scene.random.between(2, 7)).unwrap();
        let text = each(&scene.shots, |shot| match shot.index == at {
            true => format!("{}\n", unix(shot.utc_ns)),
            false => format!("{}\n{}\n", unix(shot.utc_ns), joined(shot, two, " ")),
        });
        (text, Truth::of(scene).absolute(0).gone(at))
    });
    kind.right("a number whose frame is lost", |scene| {
        let at = usize::try_from(scene.random.between(2, 7)).unwrap();
        let text = each(&scene.shots, |shot| match shot.index == at {
            true => format!("Frame {}\nread error\n", shot.index),
            false => format!(
                "Frame {}\n{}\n\n",
                shot.index,
                grid(shot, two, " ").join("\n")
            ),
        });
        (text, Truth::of(scene).numbered().gone(at))
    });
    kind.unsure("a label whose frame is lost", |scene| {
        let at = usize::try_from(scene.random.between(2, 7)).unwrap();
        let text = each(&scene.shots, |shot| match shot.index == at {
            true => format!("t: {}\n\n", unix(shot.t_ns)),
            false => format!(
                "t: {}\n{}\n\n",
                unix(shot.t_ns),
                grid(shot, two, ", ").join("\n")
            ),
        });
        (text, Truth::of(scene).relative(0).gone(at))
    });
    kind.file("walk.csv");
}

fn lost_rows(kind: &mut Kind) {
    kind.right("a row of error texts", |scene| {
        let at = usize::try_from(scene.random.between(2, 7)).unwrap();
        let text = timed(
            "time",
            &scene.shots,
            |shot| unix(shot.utc_ns),
            vec![column("people", &scene.shots, people)],
        );
        let lines: Vec<String> = text
            .split_inclusive('\n')
            .enumerate()
            .map(|(line, text)| match line == at + 1 {
                true => format!("{},I2C error\n", unix(scene.shots[at].utc_ns)),
                false => text.to_owned(),
            })
            .collect();
        (
            lines.concat(),
            Truth::of(scene)
                .absolute(0)
                .people(scene, "people")
                .torn(at),
        )
    });
    kind.right("a row of empty cells", |scene| {
        let at = usize::try_from(scene.random.between(2, 7)).unwrap();
        let mut columns = vec![
            column("frame", &scene.shots, |shot| shot.index.to_string()),
            column("time", &scene.shots, |shot| unix(shot.utc_ns)),
        ];
        columns.extend(pixels(&scene.shots, p, two));
        for (_, values) in &mut columns[2..] {
            values[at] = String::new();
        }
        (
            table(",", &columns),
            Truth::of(scene).absolute(0).numbered().gone(at),
        )
    });
}

fn thermistors(kind: &mut Kind) {
    let four = |celsius: f64| format!("{celsius:.4}");
    let names = [
        ("thermistor", "thermistor"),
        ("Thermistor (C)", "Thermistor (C)"),
        ("therm_temp", "therm_temp"),
        ("sensor_temp", "sensor_temp"),
    ];
    for (name, called) in names {
        let accept = if called == "sensor_temp" {
            RightOrAsked
        } else {
            Right
        };
        kind.add(name, accept, move |scene| {
            scene.any_room();
            let text = timed(
                "time",
                &scene.shots,
                |shot| unix(shot.utc_ns),
                vec![column(called, &scene.shots, |shot| {
                    four(shot.thermistor_c())
                })],
            );
            (text, Truth::of(scene).absolute(0).thermistor(0.001))
        });
    }
    kind.file("capture.txt");
    kind.right("Adafruit's line of the thermistor", |scene| {
        let text = each(&scene.shots, |shot| {
            format!(
                "Thermistor Temperature = {:.2} *C\n[{}]\n\n",
                shot.thermistor_c(),
                grid(shot, two, ", ").join(", \n")
            )
        });
        (text, Truth::of(scene).thermistor(0.04))
    });
    kind.unsure("a line of the thermistor after each frame", |scene| {
        let text = each(&scene.shots, |shot| {
            format!(
                "{}\nThermistor: {:.4}\n\n",
                grid(shot, two, "\t").join("\n"),
                shot.thermistor_c()
            )
        });
        (text, Truth::of(scene).thermistor(0.001))
    });
    kind.file("walk.tsv");
}

fn thermistors_of_words(kind: &mut Kind) {
    kind.unsure("R19 words, the thermistor first", |scene| {
        let text = each(&scene.shots, |shot| {
            let words = joined(shot, |celsius| format!("{:.0}", celsius * 4.0), "\t");
            format!("{}\t{words}\n", shot.thermistor)
        });
        (
            format!("one person\n{text}"),
            Truth::of(scene).thermistor(0.001),
        )
    });
    kind.file("walk.csv");
    kind.right("words, the thermistor named", |scene| {
        let mut columns = vec![column("thermistor", &scene.shots, |shot| {
            shot.thermistor.to_string()
        })];
        columns.extend(pixels(&scene.shots, p, |celsius| {
            format!("{:.0}", celsius * 4.0)
        }));
        (table(",", &columns), Truth::of(scene).thermistor(0.001))
    });
    for (name, head, tail) in [
        (
            "sensor.thermistor in JSON",
            "{\"sensor\":{\"thermistor\":",
            "}",
        ),
        ("a thermistor in JSON", "{\"thermistor\":", ""),
        (
            "amg.thermistor_c in JSON",
            "{\"amg\":{\"thermistor_c\":",
            "}",
        ),
    ] {
        kind.file("walk.jsonl");
        kind.right(name, move |scene| {
            let text = each(&scene.shots, |shot| {
                format!(
                    "{head}{}{tail},\"t\":{},\"pixels\":{}}}\n",
                    short(shot.thermistor_c()),
                    unix(shot.utc_ns),
                    nested(shot, short, ",")
                )
            });
            (text, Truth::of(scene).absolute(0).thermistor(0.001))
        });
    }
}
