//! Archives that would exhaust the memory are refused early.

use super::rows::{Rows, blob, framed, sha256, within};
use super::study;
use gaitwright_store::archived_row::Row;
use serde_json::json;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

/// Imports a decompression bomb with the command line. Returns its message and its peak memory in bytes.
fn detonate(folder: &Path, bomb: &[u8]) -> (bool, String, u64) {
    let file = folder.join("bomb.gait");
    std::fs::write(&file, bomb).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_gaitwright-cli"));
    for (name, _) in std::env::vars().filter(|(name, _)| name.starts_with("GAITWRIGHT_")) {
        command.env_remove(name);
    }
    let mut child = command
        .args(["import", "bomb.gait", "--database", "bombed.db"])
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let status = format!("/proc/{}/status", child.id());
    let mut peak = 0_u64;
    while child.try_wait().unwrap().is_none() {
        let text = std::fs::read_to_string(&status).unwrap_or_default();
        let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap_or("0");
        peak = peak.max(line.trim().trim_end_matches(" kB").trim().parse::<u64>().unwrap_or(0) * 1024);
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    let output = child.wait_with_output().unwrap();
    (output.status.code() == Some(2), String::from_utf8_lossy(&output.stderr).into_owned(), peak)
}

/// Maximum memory of an import, whatever the archive.
const MAX_MEMORY_BYTES: u64 = 320 << 20;

/// A compressed archive of content that is made as it is compressed.
fn streamed(write: impl FnOnce(&mut dyn Write)) -> Vec<u8> {
    let mut encoder = zstd::Encoder::new(b"gaitwright study 5\n".to_vec(), 1).unwrap();
    write(&mut encoder);
    encoder.finish().unwrap()
}

fn repeated(out: &mut dyn Write, piece: &str, bytes: usize) {
    let block = piece.repeat((1 << 20) / piece.len());
    for _ in 0..bytes / block.len() {
        out.write_all(block.as_bytes()).unwrap();
    }
}

const GIGABYTE: usize = 1 << 30;

#[cfg(target_os = "linux")]
#[tokio::test]
async fn decompression_bombs_are_refused_within_bounded_memory() {
    let (folder, service, _, file) = study().await;
    service.stop().await;
    let whole = Rows::of(&file);
    // A value of a gigabyte and more in some kilobytes, as a compressed column of an archive that is right otherwise.
    let zeros = |bytes: usize| {
        let mut encoder = zstd::Encoder::new(Vec::new(), 1).unwrap();
        repeated(&mut encoder, " ", bytes);
        json!({"hexadecimal": hex::encode(encoder.finish().unwrap())})
    };
    let with = |change: &dyn Fn(&mut Rows)| {
        let mut rows = whole.clone();
        change(&mut rows);
        rows.packed()
    };
    let huge = zeros(2 * GIGABYTE);
    let row = |cell: &str| format!("{{\"table\":\"subjects\",\"sha256\":\"\",\"row\":{{\"id\":{cell}");
    let mut bombs: Vec<(&str, Vec<u8>)> = vec![
        ("a line of a gigabyte", streamed(|out| repeated(out, "a", GIGABYTE))),
        ("a gigabyte of brackets", streamed(|out| repeated(out, "[", GIGABYTE))),
        ("a gigabyte of empty lines", streamed(|out| repeated(out, "\n", GIGABYTE))),
        ("a gigabyte of objects", streamed(|out| repeated(out, "{\"row\":", GIGABYTE))),
        (
            "a deep value",
            streamed(|out| {
                out.write_all(row("").as_bytes()).unwrap();
                repeated(out, "[", 30 << 20);
                out.write_all(b"\n").unwrap();
            }),
        ),
        (
            "a deep object",
            streamed(|out| {
                out.write_all(row("").as_bytes()).unwrap();
                repeated(out, "{\"hexadecimal\":", 30 << 20);
                out.write_all(b"\n").unwrap();
            }),
        ),
        (
            "a text of a gigabyte",
            streamed(|out| {
                out.write_all(row("\"").as_bytes()).unwrap();
                repeated(out, "x", GIGABYTE);
            }),
        ),
        (
            "a text of 30 MB in escapes",
            streamed(|out| {
                out.write_all(row("\"").as_bytes()).unwrap();
                repeated(out, "\\u0041", 30 << 20);
                out.write_all(b"\"}}\n").unwrap();
            }),
        ),
        (
            "a number of a gigabyte",
            streamed(|out| {
                out.write_all(row("").as_bytes()).unwrap();
                repeated(out, "1", GIGABYTE);
            }),
        ),
        (
            "a number of 30 MB",
            streamed(|out| {
                out.write_all(row("").as_bytes()).unwrap();
                repeated(out, "1", 30 << 20);
                out.write_all(b"}}\n").unwrap();
            }),
        ),
        (
            "bytes of 60 MB",
            streamed(|out| {
                out.write_all(row("{\"hexadecimal\":\"").as_bytes()).unwrap();
                repeated(out, "00", 60 << 20);
                out.write_all(b"\"}}}\n").unwrap();
            }),
        ),
        (
            "a row of a million columns",
            streamed(|out| {
                out.write_all(b"{\"table\":\"subjects\",\"sha256\":\"\",\"row\":{").unwrap();
                for number in 0..1_000_000 {
                    write!(out, "\"c{number}\":1,").unwrap();
                }
                out.write_all(b"\"x\":1}}\n").unwrap();
            }),
        ),
        (
            "a name of 30 MB",
            streamed(|out| {
                out.write_all(b"{\"table\":\"subjects\",\"sha256\":\"\",\"row\":{\"").unwrap();
                repeated(out, "n", 30 << 20);
                out.write_all(b"\":1}}\n").unwrap();
            }),
        ),
        (
            "a table with a name of 30 MB",
            streamed(|out| {
                out.write_all(b"{\"table\":\"").unwrap();
                repeated(out, "n", 30 << 20);
                out.write_all(b"\",\"sha256\":\"\",\"row\":{}}\n").unwrap();
            }),
        ),
        ("a gait of 2 GB", with(&|rows| rows.first("gaits")["gait"] = huge.clone())),
        ("a warm start of 2 GB", with(&|rows| rows.first("gaits")["warm_start"] = huge.clone())),
        ("iterations of 2 GB", with(&|rows| rows.first("gaits")["iterations"] = huge.clone())),
        (
            "a gait of 31 MB of brackets",
            with(&|rows| {
                let text = format!("{{\"domains\":{}", "[".repeat(31 << 20));
                rows.first("gaits")["gait"] = blob(text.as_bytes());
                rows.first("gaits")["gait_sha256"] = sha256(text.as_bytes()).into();
            }),
        ),
        (
            "iterations of 31 MB of empty objects",
            with(&|rows| {
                rows.first("gaits")["iterations"] = blob(format!("[{}{{}}]", "{},".repeat(10 << 20)).as_bytes());
            }),
        ),
        (
            "settings of four million lists",
            with(&|rows| {
                let text = format!("{{\"mesh\":[{}[]]}}", "[],".repeat(1 << 20));
                rows.first("studies")["gait_settings"] = text.into();
            }),
        ),
        (
            "a search space of a million values",
            with(&|rows| {
                within(rows.first("studies"), "search_space", |space| {
                    space["dimensions"][0]["values"] = (0..400_000).map(f64::from).collect();
                });
            }),
        ),
        ("a deep report", with(&|rows| rows.first("trials")["report"] = "[".repeat(900).into())),
        ("a study within ten frames", (0..10).fold(framed("x\n"), |inner, _| framed(&hex::encode(inner)))),
    ];
    // Many rows, each of which is valid.
    let mut rows = whole.clone();
    let trial = rows.first("assessments").clone();
    bombs.push((
        "forty thousand assessments, cut off",
        streamed(|out| {
            for (table, row) in whole.0.iter().take_while(|(table, _)| table != "assessment_retractions") {
                let known: Row = serde_json::from_value(row.clone()).unwrap();
                writeln!(out, "{}", json!({"table": table, "sha256": known.sha256(), "row": row})).unwrap();
            }
            for number in 0..40_000 {
                let mut row = trial.clone();
                row["id"] = format!("01900000-0000-7000-8000-{number:012}").into();
                row["note"] = "n".repeat(2000).into();
                let known: Row = serde_json::from_value(row.clone()).unwrap();
                writeln!(out, "{}", json!({"table": "assessments", "sha256": known.sha256(), "row": row})).unwrap();
            }
        }),
    ));
    let mut window = zstd::Encoder::new(b"gaitwright study 5\n".to_vec(), 1).unwrap();
    window.window_log(27).unwrap();
    repeated(&mut window, "w", 512 << 20);
    bombs.push(("a window of 128 MB", window.finish().unwrap()));

    let mut failed = Vec::new();
    for (what, bomb) in &bombs {
        let (refused, text, peak) = detonate(folder.path(), bomb);
        println!(
            "{what}: {} bytes, peak {} MiB: {}",
            bomb.len(),
            peak >> 20,
            text.trim().chars().take(160).collect::<String>()
        );
        if !refused || peak > MAX_MEMORY_BYTES || folder.path().join("bombed.db").exists() {
            failed.push(format!("{what}: refused {refused}, peak {} MiB, {text}", peak >> 20));
        }
    }
    assert!(bombs.len() >= 20 && failed.is_empty(), "{}", failed.join("\n"));
}
