"""Draws mutants of nine areas by a seed, has cargo-mutants test each with its area's tests, and prints the share caught."""

import argparse
import json
import os
import random
import re
import subprocess
import sys
from pathlib import Path

SHARE_ASKED = 0.9

AGENT = "crates/grideye-agent/src/"
COLLECTOR = "crates/grideye-collector/src/"
VALIDATOR = "crates/grideye-validator/src/"
# area: its files (as globs), and the arguments of the `cargo test` that a developer would trust for it, the quickest
# first: what one has caught, the next one is not asked about.
AREAS = {
    "driver": (
        ["crates/amg8833/src/**"],
        [
            "-p amg8833 --lib --test traffic",
            "-p amg8833-emulator --test bus -- driver",
        ],
    ),
    "emulator": (
        ["crates/amg8833-emulator/src/**"],
        ["-p amg8833-emulator --lib --test device", "-p amg8833-emulator --tests"],
    ),
    "sampler": (
        [AGENT + "sampler/**"],
        ["-p grideye-agent --lib -- sampler", "-p grideye-agent --test agent -- acquisition faults hung clocks"],
    ),
    "ring": (
        [AGENT + "queue/ring.rs"],
        ["-p grideye-agent --lib -- ring", "-p grideye-agent --test agent -- delivery held spool"],
    ),
    "spool": (
        [AGENT + "spool/**"],
        ["-p grideye-agent --lib -- spool", "-p grideye-agent --test agent -- spool files outage"],
    ),
    "store": (
        [COLLECTOR + "store/**"],
        ["-p grideye-collector --lib -- store", "-p grideye-collector --test collector -- store tend settle recordings retain layouts gone backup"],
    ),
    "metrics": (
        [VALIDATOR + "metrics/**", VALIDATOR + "numbers.rs"],
        ["-p grideye-validator --lib -- metrics numbers", "-p grideye-validator --test validator"],
    ),
    "alignment": (
        [VALIDATOR + "align/**"],
        ["-p grideye-validator --lib -- align", "-p grideye-validator --test validator", "-p grideye-validator --test recordings -- alignment"],
    ),
    "verdict": (
        [VALIDATOR + "verdict/**"],
        ["-p grideye-validator --lib -- verdict", "-p grideye-validator --test validator", "-p grideye-validator --test recordings -- faults"],
    ),
}
# The store on PostgreSQL needs a server that not every machine has; its tests are the same as SQLite's.
POSTGRES = COLLECTOR + "store/postgres/**"
# Only the tests of the whole move a store into a database (tests/tests/collectors/several.rs).
MIGRATION = COLLECTOR + "store/migrate/**"


def copy_sources(tree: Path) -> None:
    """Brings `tree` to what the working tree has; what is equal keeps its time, so that it is not built again."""
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        check=True,
        capture_output=True,
    ).stdout
    files = {Path(os.fsdecode(name)) for name in listed.split(b"\0") if name}
    tree.mkdir(parents=True, exist_ok=True)
    for old in tree.rglob("*"):
        if not old.is_dir() and old.relative_to(tree) not in files:
            old.unlink()
    for file in files:
        if not file.is_file():
            continue
        copy = tree / file
        content = file.read_bytes()
        if copy.is_file() and copy.read_bytes() == content:
            continue
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_bytes(content)
        copy.chmod(file.stat().st_mode)


class Campaign:
    """The copy that is changed, its build, and cargo-mutants on it."""

    def __init__(self, target: Path) -> None:
        self.target = target
        self.tree = target / "tree"
        self.left_out = {MIGRATION: "tested by the tests of the whole alone"}
        if "GRIDEYE_WITHOUT_POSTGRES" in os.environ:
            self.left_out[POSTGRES] = "GRIDEYE_WITHOUT_POSTGRES is set"
        self.environment = {
            **os.environ,
            "CARGO_TARGET_DIR": str(target / "build"),
            "CARGO_INCREMENTAL": "1",
            "CARGO_PROFILE_DEV_DEBUG": "0",
            "RUST_TEST_THREADS": os.environ.get("RUST_TEST_THREADS", "2"),
        }

    def cargo_mutants(self, globs: list[str], *arguments: str) -> list[str]:
        files = [argument for glob in globs for argument in ("--file", glob)]
        for glob in self.left_out:
            files += ["--exclude", glob]
        tool = self.target / "tool/bin/cargo-mutants"
        return [str(tool), "mutants", "--workspace", "--no-config", *files, *arguments]

    def mutants(self, area: str) -> list[str]:
        """The names of all mutants of an area: where, and what is changed."""
        listed = subprocess.run(
            self.cargo_mutants(AREAS[area][0], "--list", "--json"),
            cwd=self.tree,
            env=self.environment,
            check=True,
            capture_output=True,
        ).stdout
        return sorted(mutant["name"] for mutant in json.loads(listed))

    def test(self, area: str, names: list[str]) -> dict[str, str]:
        """What became of each: caught, missed, timeout or unviable."""
        outcomes: dict[str, str] = {}
        left = names
        for stage, command in enumerate(AREAS[area][1]):
            if left:
                outcomes |= self.stage(area, f"{area}-{stage}", left, command)
            if set(outcomes) != set(names):
                sys.exit(f"error: {area}: other mutants were tested than were drawn")
            left = [name for name in names if outcomes[name] == "missed"]
        return outcomes

    def stage(self, area: str, log: str, names: list[str], command: str) -> dict[str, str]:
        output = self.target / "log" / log
        output.mkdir(parents=True, exist_ok=True)
        packages = re.findall(r"-p (\S+)", command)
        targets, _, filters = re.sub(r"-p \S+ ", "", command).partition(" -- ")
        files = sorted({name.split(":", 1)[0] for name in names})
        arguments = [argument for name in names for argument in ("--re", f"^{rust_escape(name)}$")]
        arguments += [argument for package in packages for argument in ("--test-package", package)]
        arguments += ["--in-place", "--timeout-multiplier", "4", "--minimum-test-timeout", "60"]
        arguments += ["--output", str(output), "--colors", "never"]
        arguments += [f"--cargo-arg=--config={setting}" for setting in profile(command)]
        # Handed to the build too, which would else build every test of the package for every mutant.
        arguments += [f"--cargo-arg={target}" for target in targets.split()]
        with open(output / "log", "wb") as file:
            run = subprocess.run(
                self.cargo_mutants(files, *arguments, "--", "--", *filters.split()),
                cwd=self.tree,
                env=self.environment,
                stdout=file,
                stderr=subprocess.STDOUT,
            )
        # 0: all caught, 2: some missed, 3: some timed out; else the tests fail without a change, or the tool does.
        if run.returncode not in (0, 2, 3):
            sys.exit(f"error: {area}: {command}: see {output}/log\n{(output / 'log').read_text()[-3000:]}")
        outcomes = json.loads((output / "mutants.out/outcomes.json").read_text())["outcomes"]
        found = {
            outcome["scenario"]["Mutant"]["name"]: SUMMARY[outcome["summary"]]
            for outcome in outcomes
            if outcome["scenario"] != "Baseline"
        }
        # The tool tests every deleted field of a struct, whatever names it is given.
        return {name: outcome for name, outcome in found.items() if name in names}


def profile(command: str) -> list[str]:
    """Every mutant is built once and tested once: what the build costs counts for more than what optimization gains, but
    where the validator's tests compare whole films."""
    crates = ["grideye-agent", "grideye-collector"]
    if "--lib" in command:
        crates.append("grideye-validator")
    return [f"profile.dev.package.{crate}.opt-level=0" for crate in crates]


SUMMARY = {"CaughtMutant": "caught", "MissedMutant": "missed", "Timeout": "timeout", "Unviable": "unviable"}


def rust_escape(name: str) -> str:
    return re.sub(r"([\\.+*?()|\[\]{}^$#&~-])", r"\\\1", name)


def draw(campaign: Campaign, seed: int, count: int) -> dict[str, list[str]]:
    """The same number of each area, so that each is met; what an area has too few of goes to the others."""
    chance = random.Random(seed)
    every = {area: campaign.mutants(area) for area in AREAS}
    drawn = {area: chance.sample(names, len(names)) for area, names in every.items()}
    number = dict.fromkeys(AREAS, 0)
    while sum(number.values()) < min(count, sum(map(len, every.values()))):
        for area in AREAS:
            if number[area] < len(every[area]) and sum(number.values()) < count:
                number[area] += 1
    print("mutants of each area:", ", ".join(f"{area} {len(names)}" for area, names in every.items()))
    return {area: sorted(drawn[area][: number[area]]) for area in AREAS}


def survivors(campaign: Campaign) -> dict[str, list[str]]:
    """What the run before did not catch and is still there."""
    before = json.loads((campaign.target / "survivors.json").read_text())
    still = {area: set(campaign.mutants(area)) for area in before}
    for area, names in before.items():
        for name in sorted(set(names) - still[area]):
            print(f"no longer there: {name}")
    return {area: [name for name in names if name in still[area]] for area, names in before.items()}


def main() -> int:
    parser = argparse.ArgumentParser(prog="tests/mutants/run", description=__doc__)
    parser.add_argument("seed", type=int, nargs="?", default=1, help="1 unless named")
    parser.add_argument("count", type=int, nargs="?", default=200, help="mutants, 200 unless named")
    parser.add_argument("--survivors", action="store_true", help="test what the run before did not catch, instead of a draw")
    parser.add_argument("--target", type=Path, required=True, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    campaign = Campaign(asked.target)
    copy_sources(campaign.tree)
    if asked.survivors:
        chosen = survivors(campaign)
    else:
        print(f"seed {asked.seed}, {asked.count} mutants")
        chosen = draw(campaign, asked.seed, asked.count)
    for glob, why in campaign.left_out.items():
        print(f"left out: {glob} ({why})")
    row = "{:10} {:>6} {:>6} {:>7} {:>8}  {:>7}".format
    print(row("area", *SUMMARY.values(), "share"), flush=True)
    total = dict.fromkeys(SUMMARY.values(), 0)
    missed: dict[str, list[str]] = {}
    for area, names in chosen.items():
        outcomes = campaign.test(area, names)
        number = {outcome: list(outcomes.values()).count(outcome) for outcome in total}
        total = {outcome: total[outcome] + number[outcome] for outcome in total}
        missed[area] = [name for name, outcome in outcomes.items() if outcome == "missed"]
        print(row(area, *number.values(), share(number)), flush=True)
    (campaign.target / "survivors.json").write_text(json.dumps(missed, indent=1))
    print(row("all", *total.values(), share(total)))
    for area, names in missed.items():
        for name in names:
            print(f"not caught: {area}: {name}")
    return 0 if caught(total) >= SHARE_ASKED * (caught(total) + total["missed"]) else 1


def caught(number: dict[str, int]) -> int:
    """A change that makes a test hang is seen; one that does not compile says nothing."""
    return number["caught"] + number["timeout"]


def share(number: dict[str, int]) -> str:
    viable = caught(number) + number["missed"]
    return f"{100 * caught(number) / viable:.1f} %" if viable else "-"


if __name__ == "__main__":
    sys.exit(main())
