//! Compiles the preload library for this crate's target machine and embeds it, so that a program needs nothing
//! installed beside it.
//!
//! If the toolchain cannot make a shared library, the build continues without: the program then reports that, and only
//! FUSE works.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const SOURCES: &str = "src/preload";
const ROOT: &str = "src/preload/library.rs";
/// Set this variable to build without the library, for example to test that.
const WITHOUT: &str = "I2C_EMULATION_WITHOUT_LIBRARY";

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed={SOURCES}");
    println!("cargo::rerun-if-env-changed={WITHOUT}");
    println!("cargo::rustc-check-cfg=cfg(preload_library)");
    let built = if env::var_os(WITHOUT).is_some() {
        Err(format!("{WITHOUT} was set"))
    } else {
        compile()
    };
    match built {
        Ok(library) => {
            println!("cargo::rustc-cfg=preload_library");
            println!(
                "cargo::rustc-env=I2C_EMULATION_LIBRARY={}",
                library.display()
            );
            println!("cargo::rustc-env=I2C_EMULATION_NO_LIBRARY=");
        }
        Err(reason) => {
            println!("cargo::warning=built without the preload library: {reason}");
            println!("cargo::rustc-env=I2C_EMULATION_NO_LIBRARY={reason}");
        }
    }
}

/// The library's path, or in one line why there is none.
fn compile() -> Result<PathBuf, String> {
    if variable("CARGO_CFG_TARGET_OS")? != "linux" {
        return Err("only Linux has a /dev/i2c-N".to_owned());
    }
    let library = Path::new(&variable("OUT_DIR")?).join("libi2c_emulation_preload.so");
    // An earlier build's library must not pass for this one's.
    let _ = fs::remove_file(&library);
    let mut rustc = Command::new(variable("RUSTC")?);
    rustc
        .args(["--edition", "2024", "--crate-name", "i2c_emulation_preload"])
        .args(["--crate-type", "cdylib", "--target", &variable("TARGET")?])
        .args([
            "-C",
            "opt-level=s",
            "-C",
            "panic=abort",
            "-C",
            "debuginfo=0",
        ])
        .args(["-C", "strip=symbols", "-C", "codegen-units=1"])
        .args(flags_of_cargo())
        // A shared library even where programs are static; it needs neither start files nor libraries.
        .args(["-C", "target-feature=-crt-static"])
        .args(["-C", "link-arg=-nostdlib"])
        .args(["-D", "warnings"]);
    if let Some(linker) = env::var_os("RUSTC_LINKER") {
        let mut flag = std::ffi::OsString::from("linker=");
        flag.push(linker);
        rustc.arg("-C").arg(flag);
    }
    let output = rustc
        .arg("-o")
        .arg(&library)
        .arg(ROOT)
        .output()
        .map_err(|error| format!("rustc does not start: {error}"))?;
    if output.status.success() && library.exists() {
        Ok(library)
    } else {
        let said = String::from_utf8_lossy(&output.stderr);
        let line = said.lines().find(|line| line.starts_with("error"));
        Err(format!(
            "rustc cannot make a shared library for this target: {}",
            line.unwrap_or("no reason given")
        ))
    }
}

fn variable(name: &str) -> Result<String, String> {
    env::var(name).map_err(|error| format!("{name}: {error}"))
}

/// Cargo's flags for paths and linking; the others concern only the crate.
fn flags_of_cargo() -> Vec<String> {
    const WANTED: [&str; 7] = [
        "linker=",
        "linker-flavor=",
        "link-arg=",
        "link-args=",
        "link-self-contained=",
        "target-cpu=",
        "target-feature=",
    ];
    let encoded = env::var("CARGO_ENCODED_RUSTFLAGS").unwrap_or_default();
    let mut flags = Vec::new();
    let mut given = encoded.split('\u{1f}').filter(|flag| !flag.is_empty());
    while let Some(flag) = given.next() {
        let (name, value) = match flag {
            "-C" | "--codegen" | "-L" | "--sysroot" => (flag, given.next().unwrap_or_default()),
            _ if flag.starts_with("-C") || flag.starts_with("-L") => flag.split_at(2),
            _ => match flag.split_once('=') {
                Some(("--sysroot", value)) => ("--sysroot", value),
                Some(("--codegen", value)) => ("-C", value),
                _ => continue,
            },
        };
        let codegen = matches!(name, "-C" | "--codegen");
        if !codegen || WANTED.iter().any(|wanted| value.starts_with(wanted)) {
            flags.extend([name.to_owned(), value.to_owned()]);
        }
    }
    flags
}
