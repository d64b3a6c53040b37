//! What `firmware-config/release` makes: the quick parts of it here and now, and all of it where it was made before.

use super::{check_on_its_processor, field, native, text_of};
use grideye_tests::programs::{Ended, folder, grideye, is_left_out, root, run};
use grideye_tests::skip;
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

const CRATES_IO: &str = "GRIDEYE_WITHOUT_CRATES_IO";
/// Without skopeo, umoci and runc, or without root.
const IMAGE: &str = "GRIDEYE_WITHOUT_IMAGE";
/// The folder of a whole release.
const RELEASE: &str = "GRIDEYE_RELEASE";
const LIBRARIES: [&str; 4] = [
    "amg8833",
    "amg8833-emulator",
    "grideye-frame",
    "i2c-emulation",
];

fn release(at: &Path, arguments: &[&str]) -> Ended {
    let mut command = Command::new(at.join("firmware-config/release"));
    run(command.args(arguments))
}

/// A draft of some parts, by the programs of this build.
fn draft(out: &Path, parts: &[&str]) -> Ended {
    let (out, programs) = (out.to_str().unwrap(), folder().canonicalize().unwrap());
    let options = ["--draft", "--out", out, "--programs"];
    let options = [options.as_slice(), &[programs.to_str().unwrap()], parts].concat();
    let ended = release(&root(), &options);
    assert_eq!(ended.code, 0, "{ended:?}");
    ended
}

fn packages_of(at: &Path) -> Vec<Value> {
    let mut cargo = Command::new(env!("CARGO"));
    cargo
        .args(["metadata", "--offline", "--locked", "--no-deps"])
        .args(["--format-version", "1"])
        .current_dir(at);
    let said: Value = serde_json::from_str(&text_of(&mut cargo)).unwrap();
    said["packages"].as_array().unwrap().clone()
}

/// Whoever gets the folder can see that nothing was changed, and that nothing lacks a sum.
fn check_sums(out: &Path) {
    let check = ["--check", "--strict", "--quiet", "SHA256SUMS"];
    text_of(Command::new("sha256sum").args(check).current_dir(out));
    let sums = std::fs::read_to_string(out.join("SHA256SUMS")).unwrap();
    let files = std::fs::read_dir(out).unwrap().count();
    assert_eq!(sums.lines().count(), files - 1, "{sums}");
}

#[test]
fn crates_io_takes_four_crates_with_their_license_and_nothing_else() {
    if is_left_out(CRATES_IO, "the crates as crates.io takes them") {
        return;
    }
    let out = tempfile::tempdir().unwrap();
    let said = draft(out.path(), &["crates"]).stderr;
    assert!(said.contains("there is nothing to compare with"), "{said}");
    check_sums(out.path());
    let published: BTreeSet<String> = packages_of(&root())
        .iter()
        .filter(|package| package["publish"].is_null())
        .map(|package| package["name"].as_str().unwrap().to_owned())
        .collect();
    assert_eq!(published, LIBRARIES.map(str::to_owned).into());
    for name in LIBRARIES {
        let version = env!("CARGO_PKG_VERSION");
        let archive = out.path().join(format!("{name}-{version}.crate"));
        let read = |file: &str| {
            let inside = format!("{name}-{version}/{file}");
            text_of(Command::new("tar").arg("-xzOf").arg(&archive).arg(inside))
        };
        let license = std::fs::read_to_string(root().join("LICENSE")).unwrap();
        assert_eq!(read("LICENSE"), license);
        assert!(!read("README.md").is_empty());
        let manifest: toml::Table = read("Cargo.toml").parse().unwrap();
        let package = manifest["package"].as_table().unwrap();
        for key in [
            "categories",
            "description",
            "documentation",
            "keywords",
            "license",
            "readme",
            "repository",
            "rust-version",
        ] {
            assert!(package.contains_key(key), "{name} has no {key}");
        }
        for (dependency, value) in manifest["dependencies"].as_table().unwrap() {
            let kept = value.get("version").is_some() && value.get("path").is_none();
            assert!(kept, "{name}: {dependency} = {value}");
        }
    }
}

#[test]
fn one_command_sets_the_version_everywhere() {
    let copy = tempfile::tempdir().unwrap();
    let line = "git ls-files -coz --exclude-standard | xargs -0 cp -P --parents -t \"$0\"; cd \"$0\"; git init -q; git add -A";
    let copied = run(Command::new("bash")
        .args(["-ec", line])
        .arg(copy.path())
        .current_dir(root()));
    assert_eq!(copied.code, 0, "{copied:?}");
    let old = env!("CARGO_PKG_VERSION");
    for (version, why) in [
        ("7.8", "is no version"),
        ("", "is no version"),
        (old, "is not later"),
    ] {
        let refused = release(copy.path(), &["version", version]);
        assert_eq!(refused.code, 2, "{refused:?}");
        assert!(refused.stderr.contains(why), "{refused:?}");
    }
    let set = release(copy.path(), &["version", "7.8.9"]);
    assert_eq!(set.code, 0, "{set:?}");
    for package in packages_of(copy.path()) {
        assert_eq!(package["version"], "7.8.9", "{package}");
    }
    // Every lock file, of which cargo would find out only where it builds; and crates of others keep their numbers.
    let names: BTreeSet<String> = packages_of(copy.path())
        .iter()
        .map(|package| package["name"].as_str().unwrap().to_owned())
        .collect();
    for lock in [
        "Cargo.lock",
        "crates/amg8833-emulator/third-party/Cargo.lock",
        "tests/no-std/Cargo.lock",
        "tests/examples/driver-ci/rust/Cargo.lock",
    ] {
        let read = |at: &Path| -> toml::Table {
            std::fs::read_to_string(at.join(lock))
                .unwrap()
                .parse()
                .unwrap()
        };
        let (before, after) = (read(&root()), read(copy.path()));
        let pairs = before["package"].as_array().unwrap().iter();
        for (before, after) in pairs.zip(after["package"].as_array().unwrap()) {
            let is_ours =
                names.contains(before["name"].as_str().unwrap()) && before.get("source").is_none();
            let expected = if is_ours {
                "7.8.9"
            } else {
                before["version"].as_str().unwrap()
            };
            assert_eq!(after["version"].as_str(), Some(expected), "{lock}: {after}");
        }
    }
    let read = |file: &str| std::fs::read_to_string(copy.path().join(file)).unwrap();
    let (changes, setup) = (read("CHANGELOG.md"), read("firmware-config/README.md"));
    assert!(
        changes.contains("## Unreleased\n\n## 7.8.9, 20"),
        "{changes:.400}"
    );
    assert!(
        setup.contains("_7.8.9_arm64.deb") && !setup.contains(old),
        "{setup}"
    );
    let interface: Value =
        serde_json::from_str(&read("crates/grideye-collector/openapi.json")).unwrap();
    assert_eq!(interface["info"]["version"], "7.8.9");
}

#[test]
fn the_workflow_calls_that_script_and_nothing_else() {
    let path = root().join(".github/workflows/release.yml");
    let text = std::fs::read_to_string(path).unwrap();
    let runs: Vec<&str> = text.lines().filter(|line| line.contains("run:")).collect();
    assert_eq!(runs, ["      - run: firmware-config/release"]);
}

/// A container that is killed when it is dropped.
struct Container {
    bundle: PathBuf,
    child: Child,
}

impl Container {
    /// The image's own command in a container with this machine's network, on a free port of it.
    fn start(image: &Path, at: &Path, architecture: &str) -> Self {
        let layout = format!("oci:{}:image", at.join("layout").display());
        let archive = format!("oci-archive:{}", image.display());
        let copy = ["--override-arch", architecture, "copy", "--quiet"];
        text_of(Command::new("skopeo").args(copy).args([&archive, &layout]));
        let bundle = at.join("bundle");
        let mut unpack = Command::new("umoci");
        unpack.args(["unpack", "--image", layout.trim_start_matches("oci:")]);
        text_of(unpack.arg(&bundle));
        let file = bundle.join("config.json");
        let text = std::fs::read_to_string(&file).unwrap();
        let text = text.replace("0.0.0.0:8833", "127.0.0.1:0");
        let mut config: Value = serde_json::from_str(&text).unwrap();
        config["process"]["terminal"] = false.into();
        let namespaces = config["linux"]["namespaces"].as_array_mut().unwrap();
        namespaces.retain(|namespace| namespace["type"] != "network");
        // umoci puts an empty folder of root's there; a volume begins as what the image has.
        let mounts = config["mounts"].as_array_mut().unwrap();
        mounts.retain(|mount| mount["destination"] != "/var/lib/grideye-collector");
        std::fs::write(&file, config.to_string()).unwrap();
        let out = std::fs::File::create(at.join("out")).unwrap();
        let mut run = Command::new("runc");
        run.arg("--root")
            .arg(at.join("runc"))
            .args(["run", "--bundle"]);
        run.arg(&bundle).arg(Self::name(at));
        let child = run.stdin(Stdio::null()).stdout(out).spawn().unwrap();
        Self { bundle, child }
    }

    fn name(at: &Path) -> String {
        format!("grideye-{}", at.file_name().unwrap().to_str().unwrap())
    }

    fn stop(&mut self, at: &Path) -> i32 {
        let mut kill = Command::new("runc");
        kill.arg("--root").arg(at.join("runc")).arg("kill");
        text_of(kill.arg(Self::name(at)).arg("TERM"));
        self.child.wait().unwrap().code().unwrap_or(-1)
    }
}

impl Drop for Container {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The image runs as nobody in particular, stores a frame and ends when it is told to.
fn check_image(image: &Path) {
    let at = tempfile::tempdir().unwrap();
    let mut container = Container::start(image, at.path(), "amd64");
    let url = grideye_tests::patience::wait_for("the address of the collector", || {
        let said = std::fs::read_to_string(at.path().join("out")).unwrap();
        said.lines().next().map(str::to_owned)
    });
    let frame = serde_json::json!({"seq": 1, "t_boot_ns": 1, "t_utc_ns": 1_700_000_000_000_000_000_u64,
        "clock": "synced", "thermistor_raw": 402, "pixels_raw": vec![100; 64]});
    let batch = serde_json::json!({"device": "pi-1", "boot": "0b7c3c52-7a4e-4e0f-8f6e-2b1f0f4c9d11",
        "sensors": [{"sensor": "i2c-1:0x69", "frames": [frame]}]});
    let posted = ureq::post(format!("{url}v1/frames")).send_json(&batch);
    let answer: Value = posted.unwrap().body_mut().read_json().unwrap();
    assert_eq!(answer["durable_through"]["i2c-1:0x69"], 1, "{answer}");
    assert_eq!(container.stop(at.path()), 0);
    let store = container
        .bundle
        .join("rootfs/var/lib/grideye-collector/frames.sqlite");
    let owner = text_of(Command::new("stat").args(["-c", "%u:%g %a"]).arg(store));
    assert_eq!(owner.trim(), "65532:65532 600");
}

#[test]
fn the_image_has_the_same_bytes_twice_and_runs_the_collector() {
    if is_left_out(IMAGE, "the OCI image of the collector") {
        return;
    }
    if native() != "amd64" {
        skip::test("the OCI image: made and run on amd64");
        return;
    }
    let out = tempfile::tempdir().unwrap();
    let [first, second] = ["first", "second"].map(|name| out.path().join(name));
    let name = format!("grideye_{}_oci.tar", env!("CARGO_PKG_VERSION"));
    for folder in [&first, &second] {
        draft(folder, &["image"]);
        check_sums(folder);
    }
    let bytes = |folder: &Path| std::fs::read(folder.join(&name)).unwrap();
    assert!(
        bytes(&first) == bytes(&second),
        "the same program, other bytes"
    );
    check_image(&first.join(name));
}

#[test]
fn a_whole_release_runs_where_it_can() {
    let Some(out) = std::env::var_os(RELEASE).map(PathBuf::from) else {
        skip::test("a whole release: set GRIDEYE_RELEASE to what firmware-config/release made");
        return;
    };
    check_sums(&out);
    let version = env!("CARGO_PKG_VERSION");
    let file = |name: &str| out.join(name.replace("VERSION", version));
    for name in ["grideye", "grideye-agent"] {
        for architecture in ["amd64", "arm64"] {
            let program = file(&format!("{name}_VERSION_{architecture}"));
            let linked = text_of(Command::new("readelf").arg("-ld").arg(&program));
            let is_static = !linked.contains("NEEDED") && !linked.contains("INTERP");
            assert!(is_static, "{}: {linked}", program.display());
        }
        let document = std::fs::read(file(&format!("{name}_VERSION.cdx.json"))).unwrap();
        let document: Value = serde_json::from_slice(&document).unwrap();
        assert_eq!(document["bomFormat"], "CycloneDX");
        let parts = document["components"].as_array().unwrap();
        let has = |name: &str| parts.iter().any(|part| part["name"] == name);
        assert!(has("rustls") && has("grideye-frame") && !has("proptest"));
    }
    check_on_its_processor(&file("grideye-agent_VERSION_amd64"), &["env"]);
    let emulated: &[&str] = &["qemu-aarch64-static"];
    check_on_its_processor(&file("grideye-agent_VERSION_arm64"), emulated);
    // The same frames on any machine, and with any C library.
    let simulated = |program: &mut Command| {
        let at = tempfile::tempdir().unwrap();
        let arguments = ["simulate", "scenes/experiment-3.toml", "--out"];
        let frames = at.path().join("frames.csv");
        let ended = run(program.args(arguments).arg(&frames).current_dir(root()));
        assert_eq!(ended.code, 0, "{ended:?}");
        std::fs::read_to_string(frames).unwrap()
    };
    let expected = simulated(&mut grideye());
    let mut on_arm = Command::new(emulated[0]);
    on_arm.arg(file("grideye_VERSION_arm64"));
    for mut program in [Command::new(file("grideye_VERSION_amd64")), on_arm] {
        assert!(simulated(&mut program) == expected, "{program:?}");
    }
    let mut emulate = Command::new(file("grideye_VERSION_amd64"));
    emulate.args(["emulate", "--quiet", "--constant", "24"]);
    let read = emulate.args(["--", "i2ctransfer", "-y", "1", "w1@0x69", "0x80", "r2"]);
    assert_eq!(text_of(read), "0x60 0x00\n");
    check_image(&file("grideye_VERSION_oci.tar"));
    for (package, architecture) in [
        ("grideye-agent_VERSION_amd64.deb", "amd64"),
        ("grideye-agent_VERSION_arm64.deb", "arm64"),
        ("grideye-agent_VERSION_armhf.deb", "armhf"),
        ("grideye-agent-armv6_VERSION_armhf.deb", "armhf"),
        ("grideye_VERSION_amd64.deb", "amd64"),
        ("grideye_VERSION_arm64.deb", "arm64"),
    ] {
        assert_eq!(field(&file(package), "Architecture"), architecture);
        assert_eq!(field(&file(package), "Version"), version);
    }
}
