//! Names that say where a pixel is.

use crate::loggers::print::{column, pixels, table, two, unix};
use crate::loggers::truth::Truth;
use crate::loggers::variant::Kind;

/// A column's name, of the row and the column of a pixel.
type Name = fn(usize, usize) -> String;

const NAMES: [(&str, Name); 27] = [
    ("W10 c0r0", |row, column| format!("c{column}r{row}")),
    ("col0_row0", |row, column| format!("col{column}_row{row}")),
    ("x0y0", |row, column| format!("x{column}y{row}")),
    ("x1_y1", |row, column| {
        format!("x{}_y{}", column + 1, row + 1)
    }),
    ("C1R1", |row, column| format!("C{}R{}", column + 1, row + 1)),
    ("column 0 row 0", |row, column| {
        format!("column {column} row {row}")
    }),
    ("r0c0", |row, column| format!("r{row}c{column}")),
    ("R1C1", |row, column| format!("R{}C{}", row + 1, column + 1)),
    ("row0_col0", |row, column| format!("row{row}_col{column}")),
    ("Row 1 Col 1", |row, column| {
        format!("Row {} Col {}", row + 1, column + 1)
    }),
    ("y0x0", |row, column| format!("y{row}x{column}")),
    ("p1 to p64", |row, column| {
        format!("p{}", 8 * row + column + 1)
    }),
    ("Pixel 01 to Pixel 64", |row, column| {
        format!("Pixel {:02}", 8 * row + column + 1)
    }),
    ("px00 to px77", |row, column| format!("px{row}{column}")),
    ("T11 to T88", |row, column| {
        format!("T{}{}", row + 1, column + 1)
    }),
    ("pixel[0][0]", |row, column| {
        format!("pixel[{row}][{column}]")
    }),
    ("(0, 0) in quotes", |row, column| {
        format!("\"({row}, {column})\"")
    }),
    ("t_0_0", |row, column| format!("t_{row}_{column}")),
    ("temperatures.0", |row, column| {
        format!("temperatures.{}", 8 * row + column)
    }),
    ("0 to 63", |row, column| format!("{}", 8 * row + column)),
    ("amg_px_0", |row, column| {
        format!("amg_px_{}", 8 * row + column)
    }),
    ("amg8833_0", |row, column| {
        format!("amg8833_{}", 8 * row + column)
    }),
    ("grideye1_p0", |row, column| {
        format!("grideye1_p{}", 8 * row + column)
    }),
    ("P00 in hexadecimal", |row, column| {
        format!("P{:02X}", 8 * row + column)
    }),
    ("пиксель0", |row, column| {
        format!("пиксель{}", 8 * row + column)
    }),
    ("画素0", |row, column| format!("画素{}", 8 * row + column)),
    ("Zeile0Spalte0", |row, column| {
        format!("Zeile{row}Spalte{column}")
    }),
];

pub(crate) fn kind() -> Kind {
    let mut kind = Kind::new("4 place");
    for (name, pixel) in NAMES {
        kind.file("walk.csv");
        kind.right(name, move |scene| {
            scene.any_room();
            let mut columns = vec![column("time", &scene.shots, |shot| unix(shot.utc_ns))];
            columns.extend(pixels(
                &scene.shots,
                |place| pixel(place / 8, place % 8),
                two,
            ));
            (table(",", &columns), Truth::of(scene).absolute(0))
        });
    }
    // The same names, where the order of the columns says nothing.
    for (name, at) in [
        ("c0r0, shuffled", 0),
        ("x0y0, shuffled", 2),
        ("r0c0, shuffled", 6),
        ("y0x0, shuffled", 10),
        ("p1 to p64, shuffled", 11),
        ("T11 to T88, shuffled", 14),
    ] {
        kind.right(name, move |scene| {
            let pixel = NAMES[at].1;
            let mut columns = pixels(&scene.shots, |place| pixel(place / 8, place % 8), two);
            columns.push(column("time", &scene.shots, |shot| unix(shot.utc_ns)));
            scene.random.shuffle(&mut columns);
            (table(",", &columns), Truth::of(scene).absolute(0))
        });
    }
    for (name, at) in [
        ("c0r0, column by column", 0),
        ("row0_col0, column by column", 8),
    ] {
        kind.right(name, move |scene| {
            let pixel = NAMES[at].1;
            let mut columns = pixels(&scene.shots, |place| pixel(place / 8, place % 8), two);
            let turned: Vec<_> = (0..64)
                .map(|place| columns[place % 8 * 8 + place / 8].clone())
                .collect();
            columns = turned;
            (table(",", &columns), Truth::of(scene))
        });
    }
    kind.right("p0, p1, p10, p11, as sorted texts", |scene| {
        let mut columns = pixels(&scene.shots, |place| format!("p{place}"), two);
        columns.sort();
        (table(",", &columns), Truth::of(scene))
    });
    kind.right("p63 down to p0", |scene| {
        let mut columns = pixels(&scene.shots, |place| format!("p{place}"), two);
        columns.reverse();
        (table(",", &columns), Truth::of(scene))
    });
    kind
}
