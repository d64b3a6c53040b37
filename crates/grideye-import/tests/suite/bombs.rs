//! Small files that unpack to large ones, or take long to read: each is read by a process of its own, which says what it took.

use crate::support::{printed, said};
use flate2::Compression;
use flate2::write::GzEncoder;
use parquet::basic::{Compression as Packing, ZstdLevel};
use parquet::data_type::{DoubleType, Int32Type};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;
use std::io::Write as _;
use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use std::{env, fs};
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

/// What reading a file of at most a megabyte may take: the peak of its memory, and processor time.
const PEAK_MIB: u64 = 640;
const CPU_S: f64 = 12.0;
const FILE: &str = "GRIDEYE_BOMB";

/// The process that reads. Prints how many frames it read and how that ended, its peak in MiB, and its processor time.
#[test]
fn reads_the_file_that_it_is_handed() {
    let Ok(path) = env::var(FILE) else {
        return;
    };
    let file = fs::File::open(&path).unwrap();
    let name = Path::new(&path).file_name().unwrap().to_str().unwrap();
    let (mut frames, mut ended) = (0_u64, "ends".to_owned());
    match grideye_import::open(file, name, &grideye_import::Options::default()) {
        Err(error) => ended = error.to_string(),
        Ok(import) => {
            for row in import {
                match row {
                    Ok(_) => frames += 1,
                    Err(error) => ended = error.to_string(),
                }
            }
        }
    }
    let status = fs::read_to_string("/proc/self/status").unwrap();
    let peak = status
        .lines()
        .find(|line| line.starts_with("VmHWM"))
        .unwrap();
    let peak: u64 = peak.split_whitespace().nth(1).unwrap().parse().unwrap();
    let stat = fs::read_to_string("/proc/self/stat").unwrap();
    let ticks = stat.rsplit(')').next().unwrap().split_whitespace();
    let ticks: u32 = ticks
        .skip(11)
        .take(2)
        .map(|text| text.parse::<u32>().unwrap())
        .sum();
    println!(
        "\nread {frames} {} {} {}",
        peak / 1024,
        f64::from(ticks) / 100.0,
        ended.replace('\n', " ")
    );
}

/// The frames that are read of a file, and how that ends.
fn read(name: &str, bytes: &[u8]) -> (u64, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, bytes).unwrap();
    // More is killed, so that a failure takes neither the machine nor the day.
    let limited = "ulimit -v 6000000; ulimit -t 100; exec \"$@\"";
    let reader = "bombs::reads_the_file_that_it_is_handed";
    let told = Command::new("sh")
        .args(["-c", limited, "sh"])
        .arg(env::current_exe().unwrap())
        .args(["--exact", reader, "--nocapture"])
        .env(FILE, &path)
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&told.stdout);
    let kib = bytes.len() / 1024;
    let line = text.lines().find_map(|line| line.strip_prefix("read "));
    let line = line.unwrap_or_else(|| panic!("{name} ({kib} KiB): {told:?}"));
    let mut words = line.splitn(4, ' ');
    let mut word = || words.next().unwrap();
    let frames = word().parse().unwrap();
    let (peak, cpu) = (
        word().parse::<u64>().unwrap(),
        word().parse::<f64>().unwrap(),
    );
    let ended = word().to_owned();
    println!("{name}: {kib} KiB, {peak} MiB, {cpu} s, {frames} frames: {ended}");
    assert!(
        peak < PEAK_MIB,
        "{name} ({kib} KiB) took {peak} MiB: {ended}"
    );
    assert!(cpu < CPU_S, "{name} ({kib} KiB) took {cpu} s: {ended}");
    (frames, ended)
}

/// That a file is refused for what it becomes, and that the error says the bound, the place and the way out.
fn assert_bounded(name: &str, place: &str, bytes: &[u8]) {
    let (_, ended) = read(name, bytes);
    assert!(ended.contains(place), "{name}: {ended}");
    for word in ["it becomes more than ", "64 MiB and 32 for each", "hint: "] {
        assert!(ended.contains(word), "{name}: {ended}");
    }
}

fn gz(bytes: &[u8]) -> Vec<u8> {
    let mut packed = GzEncoder::new(Vec::new(), Compression::best());
    packed.write_all(bytes).unwrap();
    packed.finish().unwrap()
}

fn zip(files: &[(&str, &[u8])]) -> Vec<u8> {
    let mut archive = ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, bytes) in files {
        archive
            .start_file(*name, SimpleFileOptions::default())
            .unwrap();
        archive.write_all(bytes).unwrap();
    }
    archive.finish().unwrap().into_inner()
}

fn npy(kind: &str, shape: &str, numbers: &[u8]) -> Vec<u8> {
    let dictionary = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
    let padded = format!("{dictionary:117}\n");
    [b"\x93NUMPY\x01\x00\x76\x00", padded.as_bytes(), numbers].concat()
}

#[test]
fn what_is_packed_small_is_not_unpacked_without_end() {
    let zeros = vec![0; 200 << 20];
    let lines = (printed(1, ",") + "\n").repeat(300_000);
    let array = npy("|u1", "(3276800, 8, 8)", &zeros);
    assert_bounded("dense.npz", "frames.npy", &zip(&[("frames.npy", &array)]));
    assert_bounded("once.csv.gz", "line ", &gz(lines.as_bytes()));
    assert_bounded("twice.csv.gz", "line ", &gz(&gz(lines.as_bytes())));
    assert_bounded(
        "long.zip",
        "long.csv",
        &zip(&[("long.csv", lines.as_bytes())]),
    );
    let (_, ended) = read("nothing.gz", &gz(&zeros));
    assert!(
        ended.contains("line 1: more than 262144 bytes without a newline"),
        "{ended}"
    );
    // What fits is read value by value, and not held.
    let half = ((19_u16 << 10) | 288).to_le_bytes();
    let array = npy("<f2", "(400000, 8, 8)", &half.repeat(400_000 * 64));
    assert_bounded("values.npz", "row ", &zip(&[("frames.npy", &array)]));
    let names: Vec<String> = (0..60_000).map(|file| format!("{file}.npy")).collect();
    let files: Vec<(&str, &[u8])> = names.iter().map(|name| (&**name, &b""[..])).collect();
    let (_, ended) = read("many.npz", &zip(&files));
    assert!(ended.starts_with("expected an array of shape"), "{ended}");
    // An honest file of a day's constant frames: no bound of a small file is in its way.
    let hour = npy(
        "<f4",
        "(36000, 8, 8)",
        &20.5_f32.to_le_bytes().repeat(36_000 * 64),
    );
    assert_eq!(
        read("hour.npz", &zip(&[("frames.npy", &hour)])),
        (36_000, "ends".to_owned())
    );
}

#[test]
fn a_heading_is_not_believed() {
    for shape in [
        "(1000000000000000000, 8, 8)",
        "(1000000000000000000, 64)",
        "(18446744073709551615, 8, 8)",
    ] {
        let (frames, ended) = read(
            "huge.npy",
            &npy("<f4", shape, &20.5_f32.to_le_bytes().repeat(64 * 8)),
        );
        assert!(frames <= 8 && ended.contains("its heading says"), "{ended}");
    }
    let axes = "2, ".repeat(20_000);
    let (_, ended) = read("axes.npy", &npy("<f4", &format!("({axes})"), &[0; 64]));
    assert!(ended.starts_with("expected "), "{ended}");
}

#[test]
fn json_is_read_in_time_and_memory_of_its_length() {
    let object = |row: usize, keys: usize, name: &str| {
        let keys =
            (0..keys).map(|key| format!("\"{name}{}\":{}.25", key + keys * row, 20 + key % 9));
        format!("{{{}}}", keys.collect::<Vec<_>>().join(","))
    };
    for (name, others) in [("same", 0), ("other", 1)] {
        for key in ["a", "t_ms_", "p"] {
            let rows: Vec<String> = (0..20)
                .map(|row| object(row * others, 20_000, key))
                .collect();
            let (_, ended) = read(
                &format!("{name}.json"),
                format!("[{}]", rows.join(",")).as_bytes(),
            );
            assert!(
                ended.starts_with("expected at most 4096 values in a row, found "),
                "{ended}"
            );
            assert!(ended.contains("hint: "), "{ended}");
        }
    }
    // What stands beside rows holds for each of them.
    let beside = object(0, 3_000, "a");
    let rows = vec!["{}"; 100_000].join(",");
    let text = format!("{},\"rows\":[{rows}]}}", beside.trim_end_matches('}'));
    assert_bounded("beside.json", "value ", text.as_bytes());
    let text = format!("{{\"a\":\"{}\",\"rows\":[{rows}]}}", "x".repeat(500_000));
    assert_bounded("long.json", "value ", text.as_bytes());
    // A list that lacks is one of nothing.
    let list = vec!["20.25"; 4_000].join(",");
    let others = vec!["{\"b\":1}"; 100_000].join(",");
    let text = format!("[{{\"a\":[{list}]}},{others}]");
    assert_bounded("lacks.json", "objects", text.as_bytes());
    // A key is in the name of everything below it.
    let text = format!("[{{\"{}\":{beside}}}]", "k".repeat(500_000));
    read("key.json", text.as_bytes());
    for text in [
        "[".repeat(1_000_000),
        "{\"a\":".repeat(200_000),
        "[{\"a\":".repeat(200_000),
        "{} ".repeat(300_000),
        format!("{{\"a\":[{}]}}", "[],".repeat(300_000) + "[]"),
        "\"".repeat(1_000_000),
    ] {
        let (frames, ended) = read("deep.json", text.as_bytes());
        assert!(frames == 0 && ended != "ends", "{ended}");
    }
}

#[test]
fn a_text_is_read_in_time_and_memory_of_its_length() {
    let frame = printed(0, ",");
    for (name, text) in [
        ("columns.csv", "20.25,".repeat(1_000_000) + "\n"),
        (
            "names.csv",
            (0..1_000_000).map(|name| format!("p{name},")).collect(),
        ),
        ("line.csv", "a".repeat(5_000_000)),
        ("wide.csv", ("1 ".repeat(100_000) + "\n").repeat(8)),
        ("stamps.txt", ("1:1 2-3 ".repeat(20_000) + "\n").repeat(10)),
        ("quotes.txt", ("\"[".repeat(50_000) + "\n").repeat(10)),
        (
            "escapes.txt",
            "\u{1b}".repeat(200_000) + "\n" + &"\u{1b}[".repeat(100_000),
        ),
        ("blanks.txt", "\n".repeat(3_000_000)),
        ("returns.txt", "\r".repeat(3_000_000)),
    ] {
        let (frames, ended) = read(name, text.as_bytes());
        assert!(frames == 0 && ended != "ends", "{name}: {ended}");
    }
    // A name is in the name of each value of its list.
    let list = format!("\"[{}]\"", vec!["20.25"; 4_000].join(","));
    let named = format!("time,{}\n1,{list}\n2,{list}\n", "n".repeat(200_000));
    read("named.csv", named.as_bytes());
    // Rows of a frame that never ends.
    let rows = format!("{frame}\n").replace(',', " ").repeat(3);
    let rows = rows + "\n\n" + &"20.25 20.5 20.75 21 20.25 20.5 20.75 21\n".repeat(100_000);
    read("rows.txt", rows.as_bytes());
    assert!(said(format!("{frame}\n"), "one.csv", "").is_ok());
}

#[cfg(feature = "xlsx")]
mod books {
    use super::{assert_bounded, read, zip};
    use crate::support::celsius;

    const RELATIONS: &str = r#"<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship Id="r1" Type="http://schemas.openxmlformats.org/officeDocument/2006/relationships/worksheet" Target="worksheets/sheet1.xml"/></Relationships>"#;
    const BOOK: &str = r#"<workbook xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main" xmlns:r="http://schemas.openxmlformats.org/officeDocument/2006/relationships"><sheets>"#;

    /// A workbook with so many sheets of one part.
    fn book(sheets: usize, sheet: &str, strings: &str) -> Vec<u8> {
        let names =
            (1..=sheets).map(|id| format!("<sheet name=\"S{id}\" sheetId=\"{id}\" r:id=\"r1\"/>"));
        let book = format!("{BOOK}{}</sheets></workbook>", names.collect::<String>());
        let sheet = format!("<worksheet><sheetData>{sheet}</sheetData></worksheet>");
        zip(&[
            ("xl/workbook.xml", book.as_bytes()),
            ("xl/_rels/workbook.xml.rels", RELATIONS.as_bytes()),
            ("xl/worksheets/sheet1.xml", sheet.as_bytes()),
            ("xl/sharedStrings.xml", strings.as_bytes()),
        ])
    }

    fn strings(count: &str, strings: &str) -> String {
        format!("<sst uniqueCount{count}>{strings}</sst>")
    }

    #[test]
    fn a_workbook_is_read_in_time_and_memory_of_its_length() {
        let cells: String = (0..64)
            .map(|pixel| format!("<c><v>{}</v></c>", celsius(0)[pixel]))
            .collect();
        let frames = |count: usize| format!("<row>{cells}</row>").repeat(count);
        assert_eq!(
            read("good.xlsx", &book(1, &frames(3), &strings("=\"0\"", ""))).0,
            3
        );
        // One cell at the end of each row.
        let sparse: String = (1..=300_000)
            .map(|row| format!("<row r=\"{row}\"><c r=\"BZT{row}\"><v>1</v></c></row>"))
            .collect();
        assert_bounded(
            "sparse.xlsx",
            "S1, row ",
            &book(1, &sparse, &strings("=\"0\"", "")),
        );
        let many = strings("=\"0\"", &"<si><t>a</t></si>".repeat(12_000_000));
        assert_bounded("strings.xlsx", "sharedStrings", &book(1, &frames(3), &many));
        let long = strings(
            "=\"1\"",
            &format!("<si><t>{}</t></si>", "a".repeat(50_000_000)),
        );
        let shared = "<row><c t=\"s\"><v>0</v></c></row>".repeat(10_000);
        assert_bounded("shared.xlsx", "S1, row ", &book(1, &shared, &long));
        for count in [
            "=\"4000000000\"",
            " = '99999999999999999999'",
            "=\"1000000000\"",
        ] {
            let (_, ended) = read("count.xlsx", &book(1, &frames(3), &strings(count, "")));
            assert!(
                ended.contains("texts that are not there, in xl/sharedStrings.xml"),
                "{ended}"
            );
        }
        let attributes: String = (0..200_000).map(|name| format!(" a{name}=\"\"")).collect();
        let tag = format!("<row{attributes}>{cells}</row>");
        let (_, ended) = read("tag.xlsx", &book(1, &tag, &strings("=\"0\"", "")));
        assert!(
            ended.contains("bytes, in xl/worksheets/sheet1.xml"),
            "{ended}"
        );
        let laughs: String = (1..30)
            .map(|level| format!("<!ENTITY a{level} \"&a{};&a{};\">", level - 1, level - 1))
            .collect();
        let laughs = format!(
            "<!DOCTYPE sst [<!ENTITY a0 \"ha\">{laughs}]>{}",
            strings("=\"1\"", "<si><t>&a29;</t></si>")
        );
        read("laughs.xlsx", &book(1, &frames(3), &laughs));
        let dimension = format!("<dimension ref=\"A1:XFD1048576\"/>{}", frames(3));
        read(
            "dimension.xlsx",
            &book(1, &dimension, &strings("=\"0\"", "")),
        );
        // Sheets that have one part.
        let part = format!("{}{}", "<row></row>".repeat(1_000_000), frames(3));
        assert_bounded(
            "sheets.xlsx",
            "S",
            &book(1_000, &part, &strings("=\"0\"", "")),
        );
    }
}

/// 64 columns of one value.
fn table(rows: usize, packing: Packing, is_dictionary: bool) -> Vec<u8> {
    let columns: String = (0..64)
        .map(|pixel| format!("required double p{pixel};"))
        .collect();
    let schema = Arc::new(parse_message_type(&format!("message frames {{ {columns} }}")).unwrap());
    let properties = WriterProperties::builder()
        .set_compression(packing)
        .set_dictionary_enabled(is_dictionary)
        .set_data_page_size_limit(64 << 20)
        .build();
    let mut bytes = Vec::new();
    let mut writer = SerializedFileWriter::new(&mut bytes, schema, Arc::new(properties)).unwrap();
    let mut group = writer.next_row_group().unwrap();
    let values = vec![20.5; rows];
    while let Some(mut column) = group.next_column().unwrap() {
        column
            .typed::<DoubleType>()
            .write_batch(&values, None, None)
            .unwrap();
        column.close().unwrap();
    }
    group.close().unwrap();
    writer.close().unwrap();
    bytes
}

/// A list of one value, as long as `length`, in one row.
fn list(length: usize) -> Vec<u8> {
    let schema = "message frames { required group pixels (LIST) { repeated group list { required int32 element; } } }";
    let schema = Arc::new(parse_message_type(schema).unwrap());
    let mut bytes = Vec::new();
    let mut writer = SerializedFileWriter::new(&mut bytes, schema, Arc::default()).unwrap();
    let mut group = writer.next_row_group().unwrap();
    let mut column = group.next_column().unwrap().unwrap();
    let (values, levels) = (vec![82; length], vec![1; length]);
    let mut repeated = levels.clone();
    repeated[0] = 0;
    column
        .typed::<Int32Type>()
        .write_batch(&values, Some(&levels), Some(&repeated))
        .unwrap();
    column.close().unwrap();
    group.close().unwrap();
    writer.close().unwrap();
    bytes
}

#[test]
fn a_table_is_read_in_time_and_memory_of_its_length() {
    let zstd = Packing::ZSTD(ZstdLevel::default());
    assert_eq!(
        read("good.parquet", &table(1_000, zstd, false)),
        (1_000, "ends".to_owned())
    );
    assert_eq!(read("hour.parquet", &table(36_000, zstd, true)).0, 36_000);
    for (name, packing, is_dictionary) in [
        ("zstd.parquet", zstd, false),
        ("repeated.parquet", Packing::UNCOMPRESSED, true),
    ] {
        assert_bounded(name, "", &table(1_200_000, packing, is_dictionary));
    }
    assert_bounded("list.parquet", "", &list(60_000_000));
}
