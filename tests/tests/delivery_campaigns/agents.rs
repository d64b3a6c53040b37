//! An agent on an emulated sensor that is started again whenever it ends, as systemd does.

use crate::delays::Delays;
use crate::seeded::kills;
use crate::spooled;
use grideye_tests::emulated::{Words, recording};
use grideye_tests::patience::wait_or_explain;
use grideye_tests::programs::{grideye, grideye_agent, wait};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// Frames that the sensor shows before it stands still: more than any campaign takes.
pub(crate) fn source_frames() -> usize {
    2000 + 100 * usize::try_from(kills()).unwrap()
}

/// The agent's exit code where frames could not be read, or are lost.
const DATA_LOST: i32 = 3;

const LOOP: &str = r#"while [ ! -e "$1/stop" ]; do "$2" run --config "$1/agent.toml" >>"$1/out" 2>>"$1/log" &
echo $! >"$1/pid.new"; mv "$1/pid.new" "$1/pid"; wait $!; done"#;

pub(crate) struct Agents {
    emulator: Child,
    folder: PathBuf,
    spool: PathBuf,
    /// What was on the spool's disk, by run and number, at the moments of all kills together.
    pub(crate) on_disk: BTreeSet<(String, u64)>,
    pub(crate) killed: u32,
    delays: Delays,
    /// At each kill: the looks of [`Delays::until_now`].
    delayed: Vec<Vec<(f64, f64)>>,
}

impl Agents {
    /// Starts it in `folder`, where [`Agents::trace`] comes to lie too.
    pub(crate) fn start(folder: &Path, collector: &str, spool: &Path, mode: &str) -> Self {
        let source = recording(folder, "source.csv", (0..source_frames()).map(identifiable));
        std::fs::write(folder.join("agent.toml"), config(collector, spool, mode)).unwrap();
        let emulator = grideye()
            .args(["emulate", "--quiet"])
            .args(["--replay", "frames", "--recording"])
            .arg(source)
            .arg("--trace")
            .arg(Self::trace(folder))
            .args(["--", "bash", "-c", LOOP, "agents"])
            .arg(folder)
            .arg(grideye_agent().get_program())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let delays = Delays::follow(folder.join("pid"), emulator.id());
        let agents = Self {
            emulator,
            folder: folder.to_owned(),
            spool: spool.to_owned(),
            on_disk: BTreeSet::new(),
            killed: 0,
            delays,
            delayed: Vec::new(),
        };
        agents.pid_other_than("");
        agents
    }

    /// What passed on the bus, as the emulated sensor wrote it down.
    pub(crate) fn trace(folder: &Path) -> PathBuf {
        folder.join("bus.csv")
    }

    fn pid_other_than(&self, old: &str) -> String {
        let pid = || {
            let pid = std::fs::read_to_string(self.folder.join("pid")).unwrap_or_default();
            let pid = pid.trim();
            (!pid.is_empty() && pid != old).then(|| pid.to_owned())
        };
        wait_or_explain(pid, || format!("an agent: {}", self.log()))
    }

    /// `kill -9`, after a look at what its spool held at that moment.
    pub(crate) fn kill(&mut self) {
        let pid = self.pid_other_than("");
        signal("STOP", &pid);
        self.delayed
            .push(self.delays.until_now(&pid, self.emulator.id()));
        self.on_disk.extend(self.spooled());
        signal("KILL", &pid);
        self.killed += 1;
        self.pid_other_than(&pid);
    }

    /// Lets the agent that runs end well; where this machine was too busy to read a frame, it says so in its end too. Returns
    /// how many frames it leaves on the disk for its next start: those for which a busy machine had no time before.
    pub(crate) fn stop(&mut self) -> u64 {
        std::fs::write(self.folder.join("stop"), "").unwrap();
        signal("TERM", &self.pid_other_than(""));
        let code = wait(&mut self.emulator);
        let said = std::fs::read_to_string(self.folder.join("out")).unwrap();
        let is_whole = said.trim_end().ends_with("; 0 missing");
        let expected = if is_whole { 0 } else { DATA_LOST };
        assert_eq!(code, expected, "{said}{}", self.log());
        let last = said.lines().last().unwrap_or_default();
        let on_disk = last.split_once(" on disk; ").map(|(before, _)| before);
        let frames = on_disk.and_then(|before| before.rsplit(' ').next());
        frames.map_or(0, |frames| frames.parse().unwrap())
    }

    /// How long this machine delayed the agent within so many seconds before it was killed: the longest at any kill, as a run
    /// that was killed before it read has no end in the trace.
    pub(crate) fn delay_s(&self, within_s: f64) -> f64 {
        let of_kill = |looks: &Vec<(f64, f64)>| {
            let since = looks.iter().rev().find(|(ago_s, _)| *ago_s >= within_s);
            since.or(looks.first()).map_or(0.0, |(_, delay_s)| *delay_s)
        };
        self.delayed.iter().map(of_kill).fold(0.0, f64::max)
    }

    /// What stands in the spool now, by run and number.
    pub(crate) fn spooled(&self) -> BTreeSet<(String, u64)> {
        spooled::records(&self.spool)
    }

    pub(crate) fn log(&self) -> String {
        std::fs::read_to_string(self.folder.join("log")).unwrap_or_default()
    }

    pub(crate) fn wait_for_log(&self, said: &str) {
        let is_said = || self.log().contains(said).then_some(());
        wait_or_explain(is_said, || format!("{said:?} in {}", self.log()));
    }

    /// Frames and seconds that a kill may cost, as the agent says when it starts.
    pub(crate) fn guarantee(&self) -> (u64, f64) {
        self.wait_for_log("costs at most ");
        let log = self.log();
        let number = |before: &str| {
            let text = log.split(before).nth(1).unwrap();
            text.split(' ').next().unwrap().to_owned()
        };
        let frames = number("costs at most ").parse().unwrap();
        (frames, number("those read in the last ").parse().unwrap())
    }
}

impl Drop for Agents {
    fn drop(&mut self) {
        let _ = std::fs::write(self.folder.join("stop"), "");
        if let Ok(pid) = std::fs::read_to_string(self.folder.join("pid")) {
            let _ = Command::new("kill")
                .args(["-KILL", pid.trim()])
                .stderr(Stdio::null())
                .status();
        }
        let _ = self.emulator.kill();
        let _ = self.emulator.wait();
    }
}

fn signal(name: &str, pid: &str) {
    let sent = Command::new("kill")
        .args([&format!("-{name}"), pid])
        .status()
        .unwrap();
    assert!(sent.success(), "no process {pid}");
}

pub(crate) fn config(collector: &str, spool: &Path, mode: &str) -> String {
    format!(
        "device = \"pi-1\"\ncollector = \"{collector}\"\npost_every_ms = 100\nrequest_timeout_ms = 1500\n\
         [spool]\nfolder = \"{}\"\nfree_mib_min = 0\n{mode}\n\
         [[bus]]\npath = \"/dev/i2c-1\"\n[[bus.sensor]]\naddress = 0x69\n",
        spool.display()
    )
}

/// A frame that shows its number: in quarters of a degree on the first two pixels, and spread over the others.
pub(crate) fn identifiable(index: usize) -> Words {
    let quarters = |pixel: usize| match pixel {
        0 => index % 512,
        1 => index / 512,
        _ => (index * 2_654_435_761 + pixel * 40_503) / 512 % 480,
    };
    Words {
        pixels: std::array::from_fn(|pixel| {
            let quarters = i16::try_from(quarters(pixel)).unwrap() - 160;
            u16::from_ne_bytes(quarters.to_ne_bytes()) & 0xFFF
        }),
        thermistor: u16::try_from(160 + index % 1000).unwrap(),
    }
}
