"""Long calls let other threads run, and stop on Ctrl-C."""

import os
import signal
import subprocess
import sys
import threading
import time

import pytest
from conftest import PROGRAM, SCENES

import grideye_hil as ge

# Each call would take minutes.
PATIENCE_S = 300
CALLS = {
    "simulate": "ge.Scene.load(scene).simulate(frames=4_000_000)",
    "advance": "ge.emulate(ge.Scene.load(scene)).advance(1e9)",
}


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS.keys())
def test_ctrl_c_ends_a_long_call(call):
    code = f"import grideye_hil as ge\nscene = {str(SCENES / 'experiment-3.toml')!r}\nprint('go', flush=True)\n{call}\n"
    program = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        assert program.stdout.readline() == "go\n"
        time.sleep(0.5)
        assert program.poll() is None
        program.send_signal(signal.SIGINT)
        _, told = program.communicate(timeout=PATIENCE_S)
        assert told.endswith("KeyboardInterrupt\n")
    finally:
        program.kill()


def test_a_long_call_shows_its_progress():
    scene = ge.Scene.load(SCENES / "experiment-3.toml")
    shown = []
    # A bar's own clock shows it after a second: the host may be slower or faster than that.
    while not shown or shown[-1] < 100:
        shown.clear()
        scene._native.simulate(20_000, 1, None, shown.append)
    assert shown == sorted(shown) and shown[-1] <= 20_000


def test_the_work_ends_with_the_call(walk):
    code = f"""
import time
import grideye_hil as ge
scene, recording = ge.Scene.load({str(SCENES / "experiment-3.toml")!r}), ge.Recording.read({str(walk)!r})
try:
    print("go", flush=True)
    while True:
        ge.compare(scene, recording)
except KeyboardInterrupt:
    time.sleep(0.5)
    before_s = time.process_time()
    time.sleep(1)
    print(time.process_time() - before_s)
"""
    program = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    try:
        assert program.stdout.readline() == "go\n"
        time.sleep(0.5)
        program.send_signal(signal.SIGINT)
        told, _ = program.communicate(timeout=PATIENCE_S)
        assert float(told) < 0.1
    finally:
        program.kill()


def test_other_threads_run_meanwhile():
    turns = 0

    def count():
        nonlocal turns
        while not done.wait(0.001):
            turns += 1

    done = threading.Event()
    other = threading.Thread(target=count)
    other.start()
    scene = ge.Scene.load(SCENES / "experiment-1.toml")
    during = []
    while max(during, default=0) <= 20 and len(during) < 8:
        before = turns
        scene.simulate(frames=2000 << len(during))
        during.append(turns - before)
    done.set()
    other.join()
    assert during[-1] > 20, during


def test_ctrl_c_reaches_the_program_that_pip_installed():
    command = [PROGRAM, "emulate", "--constant", "20", "--", sys.executable, "-c", "import time; print(1, flush=True); time.sleep(60)"]
    program = subprocess.Popen(command, stdout=subprocess.PIPE, start_new_session=True)
    assert program.stdout.readline() == b"1\n"
    os.killpg(program.pid, signal.SIGINT)
    assert program.wait(timeout=PATIENCE_S) != 0
