//! What brokers, databases and dashboards export: JSON and tables of theirs.

use crate::loggers::print::{
    Civil, Column, column, each, iso, joined, nested, p, pixels, python, short, table, two, unix,
};
use crate::loggers::scene::Shot;
use crate::loggers::truth::Truth;
use crate::loggers::variant::Accept::{Right, RightOrAsked, RightOrNamed};
use crate::loggers::variant::Kind;

const S: i64 = 1_000_000_000;
const LONG: &[&str] = &[
    "one pixel",
    "a pixel a line",
    "one value",
    "a value a line",
    "long",
];

pub(crate) fn kind() -> Kind {
    let mut kind = Kind::new("7 brokers and databases");
    topics(&mut kind);
    messages(&mut kind);
    objects(&mut kind);
    lists(&mut kind);
    frames_of_pandas(&mut kind);
    keyed(&mut kind);
    keyed_otherwise(&mut kind);
    databases(&mut kind);
    tables(&mut kind);
    long_tables(&mut kind);
    feeds(&mut kind);
    kind
}

fn z(shot: &Shot) -> String {
    iso(shot.utc_ns, "T", ".") + "Z"
}

fn list(shot: &Shot) -> String {
    format!("[{}]", joined(shot, short, ","))
}

fn topics(kind: &mut Kind) {
    for (name, is_text) in [
        ("R04 mosquitto_sub -v", true),
        ("mosquitto_sub -v with JSON", false),
    ] {
        kind.file("capture.txt");
        kind.right(name, move |scene| {
            let topic = scene.random.one_of(&[
                "hall/thermal",
                "home/kitchen/amg8833",
                "tele/grid-eye/SENSOR",
                "esp32_4A1C/pixels",
            ]);
            let text = each(&scene.shots, |shot| match is_text {
                true => format!("{topic} {}\n", joined(shot, two, ",")),
                false => format!(
                    "{topic} {{\"ts\":{},\"pixels\":{},\"people\":{}}}\n",
                    unix(shot.utc_ns),
                    list(shot),
                    shot.people
                ),
            });
            let truth = Truth::of(scene).label(scene, "", |_| topic.to_owned());
            (
                text,
                if is_text {
                    truth
                } else {
                    truth.absolute(0).people(scene, "people")
                },
            )
        });
    }
    kind.right("mosquitto_sub -F with a time and JSON", |scene| {
        let text = each(&scene.shots, |shot| {
            format!(
                "{}000+0000 hall/thermal {{\"pixels\":{}}}\n",
                iso(shot.utc_ns, "T", "."),
                list(shot)
            )
        });
        (text, Truth::of(scene).absolute(0))
    });
    kind.file("capture.jsonl");
    kind.right("mosquitto_sub -F %J with a text", |scene| {
        let text = each(&scene.shots, |shot| {
            format!("{{\"tst\":\"{}000Z+0000\",\"topic\":\"hall/thermal\",\"qos\":0,\"retain\":0,\"payloadlen\":383,\"payload\":\"{}\"}}\n", iso(shot.utc_ns, "T", "."), joined(shot, two, ","))
        }).replace("Z+0000", "+0000");
        (text, Truth::of(scene).absolute(0).label(scene, "topic", |_| "hall/thermal".to_owned()))
    });
    kind.right("mosquitto_sub -F %J with an object", |scene| {
        let text = each(&scene.shots, |shot| {
            format!("{{\"tst\":\"{}000+0000\",\"topic\":\"hall/thermal\",\"qos\":0,\"retain\":0,\"payloadlen\":383,\"payload\":{{\"pixels\":{}}}}}\n", iso(shot.utc_ns, "T", "."), list(shot))
        });
        (text, Truth::of(scene).absolute(0))
    });
    kind.file("capture.txt");
}

fn messages(kind: &mut Kind) {
    kind.right("Tasmota's telemetry", |scene| {
        scene.slow();
        let text = each(&scene.shots, |shot| {
            format!(
                "{{\"Time\":\"{}\",\"AMG88XX\":{{\"Pixels\":{}}},\"TempUnit\":\"C\"}}\n",
                &iso(shot.utc_ns, "T", ".")[..19],
                list(shot)
            )
        });
        (text, Truth::of(scene).absolute(0))
    });
    kind.file("capture.jsonl");
    kind.right("Node-RED's messages", |scene| {
        let text = each(&scene.shots, |shot| {
            format!("{{\"_msgid\":\"{:08x}.{:06x}\",\"topic\":\"amg\",\"payload\":{},\"timestamp\":{}}}\n", shot.index * 77_711 + 3_000_000, shot.index * 1_013, list(shot), shot.utc_ns / 1_000_000)
        });
        (text, Truth::of(scene).absolute(1))
    });
    kind.file("capture.log");
    kind.right("a log of posts before JSON", |scene| {
        let text = each(&scene.shots, |shot| {
            format!(
                "{} DEBUG http: POST /frames {{\"seq\":{},\"pixels\":{}}}\n",
                iso(shot.utc_ns, " ", ","),
                shot.index,
                list(shot)
            )
        });
        (text, Truth::of(scene).absolute(0))
    });
    kind.file("metrics.out");
    kind.right("telegraf's line protocol", |scene| {
        let text = each(&scene.shots, |shot| {
            let values = shot.celsius();
            let fields: Vec<String> = values
                .iter()
                .enumerate()
                .map(|(place, value)| format!("p{place}={value}"))
                .collect();
            format!(
                "grideye,host=pi,room=hall {} {}\n",
                fields.join(","),
                shot.utc_ns
            )
        });
        (text, Truth::of(scene).absolute(0))
    });
}

fn objects(kind: &mut Kind) {
    kind.file("walk.jsonl");
    kind.right("R14 a list in a text in JSON", |scene| {
        let separator = scene.random.one_of(&[",", ", ", " ", ";"]);
        let text = each(&scene.shots, |shot| {
            format!(
                "{{\"ts\": {}, \"data\": \"{}\"}}\n",
                unix(shot.utc_ns),
                joined(shot, two, separator)
            )
        });
        (text, Truth::of(scene).absolute(0))
    });
    kind.right("a list with brackets in a text in JSON", |scene| {
        let is_nested = scene.random.between(0, 1) == 1;
        let text = each(&scene.shots, |shot| {
            let list = if is_nested {
                nested(shot, python, ", ")
            } else {
                format!("[{}]", joined(shot, python, ", "))
            };
            format!("{{\"ts\": \"{}\", \"pixels\": \"{list}\"}}\n", z(shot))
        });
        (text, Truth::of(scene).absolute(0))
    });
    kind.unsure("JSON in a text in JSON", |scene| {
        let text = each(&scene.shots, |shot| {
            format!(
                "{{\"time\":\"{}\",\"message\":\"{{\\\"pixels\\\":{}}}\"}}\n",
                z(shot),
                list(shot)
            )
        });
        (text, Truth::of(scene).absolute(0))
    });
}

fn lists(kind: &mut Kind) {
    kind.right("numbers as texts in JSON", |scene| {
        let text = each(&scene.shots, |shot| {
            format!(
                "{{\"ts\":{},\"pixels\":[{}]}}\n",
                unix(shot.utc_ns),
                joined(shot, |celsius| format!("\"{celsius:.2}\""), ",")
            )
        });
        (text, Truth::of(scene).absolute(0))
    });
    kind.right("eight lists of rows in JSON", |scene| {
        let text = each(&scene.shots, |shot| {
            let rows = crate::loggers::print::grid(shot, short, ",");
            let rows: Vec<String> = rows
                .iter()
                .enumerate()
                .map(|(row, values)| format!("\"row{row}\":[{values}]"))
                .collect();
            format!("{{\"t\":{},{}}}\n", unix(shot.utc_ns), rows.join(","))
        });
        (text, Truth::of(scene).absolute(0))
    });
    kind.right("64 keys in JSON, sorted as texts", |scene| {
        let text = each(&scene.shots, |shot| {
            let values = shot.celsius();
            let mut keys: Vec<String> = values
                .iter()
                .enumerate()
                .map(|(place, value)| format!("\"p{place}\":{value}"))
                .collect();
            keys.sort();
            format!("{{{},\"ts\":{}}}\n", keys.join(","), unix(shot.utc_ns))
        });
        (text, Truth::of(scene).absolute(0))
    });
    kind.file("walk.json");
    kind.right("an array over many lines", |scene| {
        let text = each(&scene.shots, |shot| {
            format!("  {{\n    \"time\": \"{}\",\n    \"people\": {},\n    \"pixels\": [\n      {}\n    ]\n  }},\n", z(shot), shot.people, joined(shot, python, ",\n      "))
        });
        (format!("[\n{}\n]\n", text.trim_end_matches([',', '\n'])), Truth::of(scene).absolute(0).people(scene, "people"))
    });
    kind.right("an object of arrays", |scene| {
        let of = |text: &dyn Fn(&Shot) -> String| {
            scene.shots.iter().map(text).collect::<Vec<_>>().join(",")
        };
        let text = format!(
            "{{\"time\":[{}],\"frames\":[{}],\"people\":[{}]}}",
            of(&|shot| unix(shot.utc_ns)),
            of(&list),
            of(&|shot| shot.people.to_string())
        );
        (text, Truth::of(scene).absolute(0).people(scene, "people"))
    });
}

fn frames_of_pandas(kind: &mut Kind) {
    kind.unsure("pandas' to_json", |scene| {
        let mut columns = vec![column("time", &scene.shots, |shot| {
            (shot.utc_ns / 1_000_000).to_string()
        })];
        columns.extend(pixels(&scene.shots, p, short));
        let columns: Vec<String> = columns
            .iter()
            .map(|(name, values)| {
                let values: Vec<String> = values
                    .iter()
                    .enumerate()
                    .map(|(row, value)| format!("\"{row}\":{value}"))
                    .collect();
                format!("\"{name}\":{{{}}}", values.join(","))
            })
            .collect();
        (
            format!("{{{}}}", columns.join(",")),
            Truth::of(scene).absolute(1),
        )
    });
    kind.unsure("pandas' to_json, split", |scene| {
        let names: Vec<String> = (0..64).map(|place| format!("\"p{place}\"")).collect();
        let index: Vec<String> = scene
            .shots
            .iter()
            .map(|shot| (shot.utc_ns / 1_000_000).to_string())
            .collect();
        let rows: Vec<String> = scene.shots.iter().map(list).collect();
        (
            format!(
                "{{\"columns\":[{}],\"index\":[{}],\"data\":[{}]}}",
                names.join(","),
                index.join(","),
                rows.join(",")
            ),
            Truth::of(scene).absolute(1),
        )
    });
}

type Key = fn(&Shot) -> String;

fn keyed(kind: &mut Kind) {
    let keys: [(&str, Key); 5] = [
        ("R15 keyed by time", |shot| iso(shot.utc_ns, " ", ".") + "Z"),
        ("keyed by ISO time", z),
        ("keyed by Unix milliseconds", |shot| {
            (shot.utc_ns / 1_000_000).to_string()
        }),
        ("keyed by Unix seconds", |shot| unix(shot.utc_ns)),
        ("keyed by a time of Firebase's keys", |shot| {
            iso(shot.utc_ns, "_", "-").replace(':', "-")
        }),
    ];
    for (name, key) in keys {
        kind.file("export.json");
        let accept = if name.contains("Firebase") {
            RightOrAsked
        } else {
            Right
        };
        kind.add(name, accept, move |scene| {
            let is_object = scene.random.between(0, 1) == 1;
            let entries: Vec<String> = scene
                .shots
                .iter()
                .map(|shot| match is_object {
                    true => format!(
                        "\"{}\": {{\"pixels\": {}, \"people\": {}}}",
                        key(shot),
                        list(shot),
                        shot.people
                    ),
                    false => format!("\"{}\": {}", key(shot), list(shot)),
                })
                .collect();
            let truth = Truth::of(scene).absolute(1);
            (
                format!("{{{}}}", entries.join(", ")),
                if is_object {
                    truth.people(scene, "people")
                } else {
                    truth
                },
            )
        });
    }
}

fn keyed_otherwise(kind: &mut Kind) {
    kind.right("Firebase's push keys", |scene| {
        let entries: Vec<String> = scene
            .shots
            .iter()
            .map(|shot| {
                format!(
                    "\"-OEx{:04}aQzk\": {{\"ts\": {}, \"pixels\": {}}}",
                    shot.index,
                    shot.utc_ns / 1_000_000,
                    list(shot)
                )
            })
            .collect();
        (
            format!("{{{}}}", entries.join(",\n")),
            Truth::of(scene).absolute(1),
        )
    });
    kind.right("Firebase's path before the keys", |scene| {
        let entries: Vec<String> = scene
            .shots
            .iter()
            .map(|shot| format!("\"{}\": {}", shot.utc_ns / 1_000_000, list(shot)))
            .collect();
        (
            format!(
                "{{\"devices\": {{\"esp32\": {{\"frames\": {{{}}}}}}}}}",
                entries.join(", ")
            ),
            Truth::of(scene).absolute(1),
        )
    });
    kind.right("keyed by numbers of frames", |scene| {
        let entries: Vec<String> = scene
            .shots
            .iter()
            .map(|shot| format!("\"frame_{}\": {}", shot.index, list(shot)))
            .collect();
        (format!("{{{}}}", entries.join(", ")), Truth::of(scene))
    });
}

fn databases(kind: &mut Kind) {
    kind.file("export.json");
    kind.unsure("Firestore's documents", |scene| {
        let entries: Vec<String> = scene.shots.iter().map(|shot| {
            let values = joined(shot, |celsius| format!("{{\"doubleValue\": {celsius:?}}}"), ", ");
            format!("{{\"name\": \"projects/x/databases/(default)/documents/frames/{:04}\", \"fields\": {{\"time\": {{\"timestampValue\": \"{}\"}}, \"pixels\": {{\"arrayValue\": {{\"values\": [{values}]}}}}}}}}", shot.index, z(shot))
        }).collect();
        (format!("{{\"documents\": [{}]}}", entries.join(",\n")), Truth::of(scene).absolute(0))
    });
    kind.right("MongoDB's extended JSON", |scene| {
        let text = each(&scene.shots, |shot| {
            format!("{{\"_id\":{{\"$oid\":\"6744a0c0{:016x}\"}},\"ts\":{{\"$date\":\"{}\"}},\"pixels\":{},\"people\":{}}}\n", shot.index + 77, z(shot), list(shot), shot.people)
        });
        (text, Truth::of(scene).absolute(0).people(scene, "people"))
    });
    kind.unsure("MongoDB's extended JSON, canonical", |scene| {
        let text = each(&scene.shots, |shot| {
            let values = joined(
                shot,
                |celsius| format!("{{\"$numberDouble\":\"{celsius:?}\"}}"),
                ",",
            );
            format!(
                "{{\"ts\":{{\"$date\":{{\"$numberLong\":\"{}\"}}}},\"pixels\":[{values}]}}\n",
                shot.utc_ns / 1_000_000
            )
        });
        (text, Truth::of(scene).absolute(1))
    });
    kind.file("journal.jsonl");
    kind.right("journalctl -o json", |scene| {
        let text = each(&scene.shots, |shot| {
            format!("{{\"__REALTIME_TIMESTAMP\":\"{}\",\"_PID\":\"812\",\"PRIORITY\":\"6\",\"MESSAGE\":\"{}\"}}\n", shot.utc_ns / 1_000, joined(shot, two, " "))
        });
        (text, Truth::of(scene).absolute(0))
    });
    kind.file("export.jsonl");
    kind.unsure("DynamoDB's items", |scene| {
        let text = each(&scene.shots, |shot| {
            let values = joined(shot, |celsius| format!("{{\"N\":\"{celsius}\"}}"), ",");
            format!(
                "{{\"Item\":{{\"ts\":{{\"N\":\"{}\"}},\"pixels\":{{\"L\":[{values}]}}}}}}\n",
                shot.utc_ns / 1_000_000
            )
        });
        (text, Truth::of(scene).absolute(1))
    });
    kind.file("dump.sql");
    kind.unsure("a dump of SQL's inserts", |scene| {
        let text = each(&scene.shots, |shot| {
            format!(
                "INSERT INTO frames VALUES({},'{}',{});\n",
                shot.index + 1,
                iso(shot.utc_ns, " ", "."),
                joined(shot, python, ",")
            )
        });
        (
            format!("BEGIN TRANSACTION;\n{text}COMMIT;\n"),
            Truth::of(scene).absolute(0),
        )
    });
    kind.file("dump.txt");
    kind.unsure("psql's print of a table", |scene| {
        let lines = each(&scene.shots, |shot| {
            format!(" {} | {{{}}}\n", iso(shot.utc_ns, " ", "."), joined(shot, short, ","))
        });
        (format!("           ts            | pixels\n-------------------------+--------\n{lines}({} rows)\n", scene.shots.len()), Truth::of(scene).absolute(0))
    });
}

fn tables(kind: &mut Kind) {
    kind.file("query.csv");
    kind.right("InfluxDB's table with a column a pixel", |scene| {
        let mut columns: Vec<Column> = vec![
            column("", &scene.shots, |_| String::new()),
            column("result", &scene.shots, |_| "_result".to_owned()),
            column("table", &scene.shots, |_| "0".to_owned()),
            column("_time", &scene.shots, z),
            column("host", &scene.shots, |_| "pi".to_owned()),
        ];
        columns.extend(pixels(&scene.shots, p, short));
        (table(",", &columns), Truth::of(scene).absolute(0))
    });
    kind.unsure("InfluxDB's annotated table with a column a pixel", |scene| {
        let mut columns: Vec<Column> = vec![
            column("", &scene.shots, |_| String::new()),
            column("result", &scene.shots, |_| String::new()),
            column("table", &scene.shots, |_| "0".to_owned()),
            column("_time", &scene.shots, z),
        ];
        columns.extend(pixels(&scene.shots, p, short));
        let head = format!("#group,false,false,true{}\n#datatype,string,long,dateTime:RFC3339{}\n#default,_result,,{}\n", ",false".repeat(64), ",double".repeat(64), ",".repeat(64));
        (head + &table(",", &columns), Truth::of(scene).absolute(0))
    });
}

fn long_tables(kind: &mut Kind) {
    kind.add(
        "InfluxDB's table with a value a line",
        RightOrNamed(LONG),
        |scene| {
            let text: String = (0..64)
                .map(|place| {
                    each(&scene.shots, |shot| {
                        format!(
                            ",,{place},{},{},p{place},grideye\n",
                            z(shot),
                            short(shot.celsius()[place])
                        )
                    })
                })
                .collect();
            (
                format!(",result,table,_time,_value,_field,_measurement\n{text}"),
                Truth::of(scene).absolute(0),
            )
        },
    );
    kind.file("history.csv");
    kind.add(
        "Home Assistant's history of 64 entities",
        RightOrNamed(LONG),
        |scene| {
            let text: String = (0..64)
                .map(|place| {
                    each(&scene.shots, |shot| {
                        format!(
                            "sensor.amg8833_pixel_{place},{},{}\n",
                            short(shot.celsius()[place]),
                            z(shot)
                        )
                    })
                })
                .collect();
            (
                format!("entity_id,state,last_changed\n{text}"),
                Truth::of(scene).absolute(0),
            )
        },
    );
    kind.right("Home Assistant's history of lists", |scene| {
        let text = each(&scene.shots, |shot| {
            format!(
                "sensor.amg8833_pixels,\"{}\",{}\n",
                joined(shot, short, ","),
                z(shot)
            )
        });
        (
            format!("entity_id,state,last_changed\n{text}"),
            Truth::of(scene).absolute(0),
        )
    });
    kind.file("feed.csv");
}

fn feeds(kind: &mut Kind) {
    kind.right("ThingSpeak's feed", |scene| {
        scene.slow();
        let text = each(&scene.shots, |shot| {
            format!(
                "{} UTC,{},\"{}\"\n",
                &iso(shot.utc_ns, " ", ".")[..19],
                shot.index + 1,
                joined(shot, short, ",")
            )
        });
        (
            format!("created_at,entry_id,field1\n{text}"),
            Truth::of(scene).absolute(0),
        )
    });
    kind.file("panel.csv");
    kind.right("Grafana's table", |scene| {
        let mut columns: Vec<Column> = vec![column("\"Time\"", &scene.shots, |shot| {
            iso(shot.utc_ns, " ", ".")
        })];
        columns.extend(pixels(&scene.shots, |place| format!("\"p{place}\""), short));
        (table(",", &columns), Truth::of(scene).absolute(0))
    });
    kind.file("sheet.csv");
    kind.right("a form's answers, day and time", |scene| {
        scene.slow();
        let days = 14 - Civil::of(scene.shots[0].utc_ns).date.2;
        scene
            .shots
            .iter_mut()
            .for_each(|shot| shot.utc_ns += days * 86_400 * S);
        let text = each(&scene.shots, |shot| {
            let civil = Civil::of(shot.utc_ns);
            format!(
                "{}/{}/{} {},\"[{}]\"\n",
                civil.date.1,
                civil.date.2,
                civil.date.0,
                civil.clock(),
                joined(shot, short, ", ")
            )
        });
        (
            format!("Timestamp,Pixels\n{text}"),
            Truth::of(scene).absolute(0),
        )
    });
}
