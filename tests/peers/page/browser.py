"""Headless Chromium by W3C WebDriver, and what its processes cost."""

import json
import os
import subprocess
import tempfile
import time
import urllib.request


class Browser:
    def __init__(self, width=1280, height=800):
        self._profile = tempfile.TemporaryDirectory()
        self._driver = subprocess.Popen(["chromedriver", "--port=0"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        for line in self._driver.stdout:
            if "successfully on port" in line:
                self._base = f"http://127.0.0.1:{line.rsplit(' ', 1)[1].strip().rstrip('.')}"
                break
        arguments = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync",
                     "--disable-background-networking", "--disable-component-update", f"--window-size={width},{height}",
                     f"--user-data-dir={self._profile.name}"]
        options = {"goog:chromeOptions": {"args": arguments}}
        answer = self._ask("POST", "/session", {"capabilities": {"alwaysMatch": options}})
        self._session = f"/session/{answer['sessionId']}"
        self._ask("POST", f"{self._session}/timeouts", {"script": 120_000})

    def _ask(self, method, path, body=None):
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(self._base + path, data, {"content-type": "application/json"}, method=method)
        with urllib.request.urlopen(request, timeout=180) as answer:
            return json.load(answer)["value"]

    def open(self, url):
        self._ask("POST", f"{self._session}/url", {"url": url})

    def run(self, script, *arguments):
        """The value of a script, which is the body of an async function."""
        wrapped = f"const done = arguments[arguments.length - 1]; (async (...given) => {{ {script} }})(...arguments).then(done)"
        return self._ask("POST", f"{self._session}/execute/async", {"script": wrapped, "args": list(arguments)})

    def drag(self, places, step_ms):
        """Takes hold at the first place of the window, goes to each other one in so many milliseconds, and lets go."""
        (x, y), *others = places
        moves = [{"type": "pointerMove", "x": x, "y": y, "duration": step_ms} for x, y in others]
        actions = [{"type": "pointerMove", "x": x, "y": y, "duration": 0}, {"type": "pointerDown", "button": 0}, *moves, {"type": "pointerUp", "button": 0}]
        hand = {"type": "pointer", "id": "hand", "parameters": {"pointerType": "mouse"}, "actions": actions}
        self._ask("POST", f"{self._session}/actions", {"actions": [hand]})

    def cpu_s(self):
        """Seconds of CPU time of all its processes until now."""
        ticks = 0
        for pid in self._family():
            try:
                with open(f"/proc/{pid}/stat") as stat:
                    fields = stat.read().rsplit(")", 1)[1].split()
            except OSError:
                continue
            ticks += int(fields[11]) + int(fields[12])
        return ticks / os.sysconf("SC_CLK_TCK")

    def _family(self):
        parents = {}
        for name in filter(str.isdigit, os.listdir("/proc")):
            try:
                with open(f"/proc/{name}/stat") as stat:
                    parents[int(name)] = int(stat.read().rsplit(")", 1)[1].split()[1])
            except OSError:
                continue
        family, more = set(), {self._driver.pid}
        while more:
            family |= more
            more = {pid for pid, parent in parents.items() if parent in more} - family
        return family - {self._driver.pid}

    def close(self):
        self._ask("DELETE", self._session)
        self._driver.terminate()
        self._driver.wait()
        for _ in range(50):
            try:
                self._profile.cleanup()
                return
            except OSError:
                time.sleep(0.1)
