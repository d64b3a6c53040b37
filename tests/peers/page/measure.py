"""Figures of the page: see `run`."""

import json
import os
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request

import editor as scene_editor
from browser import Browser

PROGRAMS = os.path.abspath(sys.argv[1])
FRAMES = 36_000
PER_POST = 1_000
CPU_S = 20
LATENCY_S = 60
SEEKS = 300


def program(name):
    return os.path.join(PROGRAMS, name)


def send(url, body=None, method=None):
    data = None if body is None else json.dumps(body).encode()
    request = urllib.request.Request(url, data, {"content-type": "application/json"}, method=method)
    with urllib.request.urlopen(request, timeout=120) as answer:
        text = answer.read()
    return json.loads(text) if text else None


def percentile(values, part):
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(part * len(ordered)))]


class Collector:
    def __init__(self, folder, *more):
        command = [program("grideye"), "collect", "--listen", "127.0.0.1:0", "--store", os.path.join(folder, "store.sqlite"), *more]
        self._child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.url = self._child.stdout.readline().split()[0].rstrip("/")

    def cpu_s(self):
        with open(f"/proc/{self._child.pid}/stat") as stat:
            fields = stat.read().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def end(self):
        self._child.terminate()
        self._child.wait()


def frame(seq, began_ns):
    at = seq * 100_000_000
    # A warm patch that wanders, and a little noise.
    pixels = [86 + (seq * 7 + pixel * 13) % 3 + (30 if (pixel - seq // 5) % 64 < 4 else 0) for pixel in range(64)]
    return {"seq": seq, "t_boot_ns": 1_000_000_000 + at, "t_utc_ns": began_ns + at, "clock": "synced", "thermistor_raw": 400, "pixels_raw": pixels}


def post(url, device, sensors, seqs, began_ns):
    frames = [frame(seq, began_ns) for seq in seqs]
    parts = [{"sensor": sensor, "frames": frames} for sensor in sensors]
    send(f"{url}/v1/frames", {"device": device, "boot": "b1", "t_sent_boot_ns": frames[-1]["t_boot_ns"] + 1_000_000, "sensors": parts})


class Feed:
    """Sensors at 10 Hz, posted twice a second, from now until the end."""

    def __init__(self, url, sensors):
        self._stop = threading.Event()
        self._devices = [(f"pi-{first // 10}", [f"s{n}" for n in range(min(10, sensors - first))]) for first in range(0, sensors, 10)]
        self._thread = threading.Thread(target=self._run, args=(url,), daemon=True)
        self._thread.start()

    def _run(self, url):
        began_ns, began, seq = time.time_ns(), time.monotonic(), 0
        while not self._stop.is_set():
            for device, names in self._devices:
                post(url, device, names, range(seq, seq + 5), began_ns)
            seq += 5
            self._stop.wait(max(0.0, began + seq / 10 - time.monotonic()))

    def end(self):
        self._stop.set()
        self._thread.join()


def first():
    with tempfile.TemporaryDirectory() as folder:
        began = time.monotonic()
        demo = subprocess.Popen([program("grideye"), "demo", "--out", folder], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        address = None
        for line in demo.stdout:
            address = re.search(r"http://[\d.:]+", line)
            if address:
                break
        threading.Thread(target=demo.stdout.read, daemon=True).start()
        while not any(sensor["frame"] for sensor in send(f"{address[0]}/v1/sensors")["sensors"]):
            time.sleep(0.02)
        print(f"from `grideye demo`, built, to the first frame at its page: {time.monotonic() - began:.1f} s")
        demo.terminate()
        demo.wait()


def weight(browser):
    with tempfile.TemporaryDirectory() as folder:
        collector = Collector(folder)
        browser.open(f"{collector.url}/")
        files, size = browser.run("""
            const all = [...performance.getEntriesByType('navigation'), ...performance.getEntriesByType('resource')];
            const own = all.filter(({ name }) => !name.includes('/v1/'));
            return [own.length, own.reduce((sum, { decodedBodySize }) => sum + decodedBodySize, 0)];""")
        print(f"weight of the page: {files} files, {size / 1000:.0f} kB, not compressed")
        browser.open("about:blank")
        collector.end()


def cpu(browser):
    for sensors in (1, 100):
        with tempfile.TemporaryDirectory() as folder:
            collector = Collector(folder)
            feed = Feed(collector.url, sensors)
            browser.open(f"{collector.url}/")
            browser.run("while (document.querySelectorAll('[data-state=live] .state').length < given[0]) await new Promise((wait) => setTimeout(wait, 100));", sensors)
            before, served, began = browser.cpu_s(), collector.cpu_s(), time.monotonic()
            time.sleep(CPU_S)
            passed = time.monotonic() - began
            share, of_collector = (browser.cpu_s() - before) / passed, (collector.cpu_s() - served) / passed
            print(f"{sensors} sensors at 10 Hz, a page open: browser {100 * share:.0f} % of one core, collector {100 * of_collector:.1f} %")
            feed.end()
            browser.open("about:blank")
            collector.end()


AGENT = """device = "pi-1"
collector = "{url}"
[[bus]]
path = "/dev/i2c-1"
[[bus.sensor]]
address = 0x69
"""


def latency(browser):
    with tempfile.TemporaryDirectory() as folder:
        collector = Collector(folder)
        recording = send(f"{collector.url}/v1/recordings", {"name": "latency"})["id"]
        with open(os.path.join(folder, "agent.toml"), "w") as config:
            config.write(AGENT.format(url=collector.url))
        agent = [program("grideye-agent"), "run", "--config", os.path.join(folder, "agent.toml")]
        emulated = [program("grideye"), "emulate", "--quiet", "--scene", "scenes/experiment-1.toml", "--"]
        emulator = subprocess.Popen(emulated + agent, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        browser.open(f"{collector.url}/")
        # The number changes in the same task in which the picture is drawn; it is seen with the next frame of the screen.
        drawn = browser.run("""
            while (!document.querySelector('.sensor [data-field=seq]')) await new Promise((wait) => setTimeout(wait, 100));
            const seen = [];
            const field = document.querySelector('.sensor [data-field=seq]');
            new MutationObserver(() => {
              const seq = Number(field.textContent.replace(/\\D/g, ''));
              requestAnimationFrame((now) => seen.push([seq, performance.timeOrigin + now]));
            }).observe(field, { childList: true, characterData: true, subtree: true });
            await new Promise((wait) => setTimeout(wait, given[0] * 1000));
            return seen;""", LATENCY_S)
        emulator.terminate()
        emulator.wait()
        rows = urllib.request.urlopen(f"{collector.url}/v1/recordings/{recording}.csv").read().decode().splitlines()
        rows = [row.split(",") for row in rows if not row.startswith("#")]
        seq, at = rows[0].index("seq"), rows[0].index("t_utc_ns")
        read = {int(row[seq]): int(row[at]) / 1e6 for row in rows[1:]}
        waits = [shown - read[number] for number, shown in drawn if number in read]
        print(
            f"from the read of a frame, which follows its update, to the screen: {len(waits)} frames, median {statistics.median(waits):.0f} ms, "
            f"95th percentile {percentile(waits, 0.95):.0f} ms, at most {max(waits):.0f} ms"
        )
        browser.open("about:blank")
        collector.end()


def recorded(collector):
    recording = send(f"{collector.url}/v1/recordings", {"name": "an hour"})["id"]
    began_ns = time.time_ns() - FRAMES * 100_000_000
    for seq in range(0, FRAMES, PER_POST):
        post(collector.url, "pi-1", ["s1"], range(seq, seq + PER_POST), began_ns)
    send(f"{collector.url}/v1/recordings/{recording}/stop", {}, "POST")
    return recording


def playback(browser):
    with tempfile.TemporaryDirectory() as folder:
        collector = Collector(folder)
        recording = recorded(collector)
        opened = []
        for _ in range(5):
            browser.open(f"{collector.url}/#recordings")
            opened.append(browser.run("""
                await new Promise((wait) => setTimeout(wait, 1000));
                const began = performance.now();
                location.hash = `recording=${given[0]}`;
                const time = document.querySelector('#time');
                while (document.querySelector('#transport').hidden || !time.textContent.startsWith('0:00.0')) await new Promise(requestAnimationFrame);
                await new Promise(requestAnimationFrame);
                return performance.now() - began;""", recording))
            if len(opened) < 5:
                browser.open("about:blank")
        print(f"{FRAMES} frames open in {statistics.median(opened):.0f} ms in the median of {len(opened)}, at most {max(opened):.0f} ms")
        seeks = browser.run("""
            const strip = document.querySelector('#scrub');
            const { left, width, top } = strip.getBoundingClientRect();
            const took = [];
            for (let index = 0; index < given[0]; index += 1) {
              const clientX = left + ((index * 0.618034) % 1) * width;
              const began = performance.now();
              strip.dispatchEvent(new PointerEvent('pointermove', { clientX, clientY: top + 5, buttons: 1, bubbles: true }));
              took.push(performance.now() - began);
              await new Promise(requestAnimationFrame);
            }
            return took;""", SEEKS)
        print(f"a move in the strip: median {statistics.median(seeks):.1f} ms, 99th percentile {percentile(seeks, 0.99):.1f} ms of {SEEKS}")
        browser.open("about:blank")
        collector.end()


def editor(browser):
    everything = []
    with tempfile.TemporaryDirectory() as folder:
        # Saved is nothing; yet nothing of the repository is within reach of the page.
        scenes = shutil.copytree("scenes", os.path.join(folder, "scenes"))
        collector = Collector(folder, "--scenes", scenes)
        wanted = [scene["name"] for scene in send(f"{collector.url}/v1/scenes")["scenes"] if scene["sensors"]]
        for scene in wanted:
            drags = scene_editor.waits(browser, collector.url, scene)
            waits = [wait for each in drags.values() for wait in each]
            everything += waits
            print(f"{scene:>21}: {', '.join(drags)} dragged; {said(waits)}")
        browser.open("about:blank")
        collector.end()
    print(f"from the hand to the picture of all: {len(wanted)} scenes, {said(everything)}; load of the machine {os.getloadavg()[0]:.1f}")


def said(waits):
    """Median and percentile of milliseconds."""
    if not waits:
        return "no picture"
    return f"{len(waits)} pictures, median {statistics.median(waits):.0f} ms, 95th percentile {percentile(waits, 0.95):.0f} ms, at most {max(waits):.0f} ms"


def export():
    with tempfile.TemporaryDirectory() as folder:
        collector = Collector(folder)
        recording = recorded(collector)
        addresses = {"csv": f"/v1/recordings/{recording}.csv"}
        addresses |= {end: f"/v1/exports/{recording}.{end}" for end in ("npz", "parquet", "mcap")}
        for end, address in addresses.items():
            began = time.monotonic()
            size = len(urllib.request.urlopen(collector.url + address).read())
            took = time.monotonic() - began
            print(f"{end:>8} from the collector: {FRAMES / took:9,.0f} frames/s, {size / FRAMES:6.1f} bytes a frame")
            if end == "csv":
                path = os.path.join(folder, "hour.csv")
                urllib.request.urlretrieve(collector.url + address, path)
        collector.end()
        for end in ("csv", "npz", "parquet", "mcap", "gif", "png"):
            out = os.path.join(folder, f"out.{end}")
            began = time.monotonic()
            converted = subprocess.run([program("grideye"), "convert", path, out], capture_output=True, text=True)
            took = time.monotonic() - began
            said = f"{FRAMES / took:9,.0f} frames/s, {os.path.getsize(out) / FRAMES:6.1f} bytes a frame" if converted.returncode == 0 else converted.stderr.strip()
            print(f"{end:>8} by grideye convert: {said}")


def main():
    wanted = sys.argv[2:] or ["first", "weight", "cpu", "latency", "playback", "editor", "export"]
    browser = Browser() if set(wanted) - {"first", "export"} else None
    for what in wanted:
        step = {"first": first, "export": export}.get(what)
        step() if step else {"weight": weight, "cpu": cpu, "latency": latency, "playback": playback, "editor": editor}[what](browser)
        sys.stdout.flush()
    if browser:
        browser.close()


main()
