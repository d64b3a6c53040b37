"""The real Home Assistant, without its web server and its page, on a broker: prints what it shows, one JSON line a change.

    home.py PORT [USER PASSWORD]

A line `remove NAME` on standard input removes the device of that name as the page's button does. Ends with its input.
"""

import asyncio
import base64
import json
import logging
import pathlib
import sys
import tempfile
import types

from homeassistant import auth, bootstrap, config_entries, const, core, loader
from homeassistant.components import camera
from homeassistant.components.mqtt import async_remove_config_entry_device
from homeassistant.helpers import device_registry
from homeassistant.setup import async_setup_component

# What is looked at, a few times a second.
LOOK_S = 0.2


class Faults(logging.Handler):
    """What Home Assistant complains of."""

    def __init__(self):
        super().__init__(logging.WARNING)
        self.said = []

    def emit(self, record):
        self.said.append(f"{record.name}: {record.getMessage()}")


async def home(folder, port, user):
    (pathlib.Path(folder) / "configuration.yaml").touch()
    hass = core.HomeAssistant(folder)
    hass.config.skip_pip = True
    hass.http = types.SimpleNamespace(register_view=lambda *_: None)
    loader.async_setup(hass)
    hass.config_entries = config_entries.ConfigEntries(hass, {})
    await bootstrap.async_load_base_functionality(hass)
    hass.auth = await auth.auth_manager_from_config(hass, [], [])
    # The web server and what needs one.
    hass.config.components.update({"http", "file_upload", "websocket_api"})
    await async_setup_component(hass, "homeassistant", {})
    data = {"broker": "127.0.0.1", "port": port, "discovery": True}
    if user:
        data.update({"username": user[0], "password": user[1]})
    entry = config_entries.ConfigEntry(
        version=1, minor_version=1, domain="mqtt", title="broker", data=data, source=config_entries.SOURCE_USER
    )
    await hass.config_entries.async_add(entry)
    hass.set_state(core.CoreState.running)
    hass.bus.async_fire(const.EVENT_HOMEASSISTANT_STARTED)
    return hass, entry


async def shown(hass):
    states = {}
    for state in hass.states.async_all(("sensor", "binary_sensor", "camera")):
        states[state.entity_id] = {"state": state.state, "attributes": dict(state.attributes)}
        if state.domain == "camera" and state.state != const.STATE_UNAVAILABLE:
            try:
                image = await camera.async_get_image(hass, state.entity_id, timeout=1)
                states[state.entity_id]["image"] = base64.b64encode(image.content).decode()
            except Exception:  # No picture yet.
                pass
    return states


async def remove(hass, entry, name):
    registry = device_registry.async_get(hass)
    device = next(device for device in registry.devices.values() if device.name == name)
    assert await async_remove_config_entry_device(hass, entry, device)
    registry.async_update_device(device.id, remove_config_entry_id=entry.entry_id)


async def main():
    port, user = int(sys.argv[1]), sys.argv[2:]
    faults = Faults()
    logging.getLogger().addHandler(faults)
    said = asyncio.Queue()
    loop = asyncio.get_running_loop()
    loop.add_reader(sys.stdin, lambda: said.put_nowait(sys.stdin.readline()))
    with tempfile.TemporaryDirectory() as folder:
        hass, entry = await home(folder, port, user)
        last = None
        while True:
            now = {"states": await shown(hass), "faults": faults.said}
            text = json.dumps(now, default=str, sort_keys=True)
            if text != last:
                print(text, flush=True)
                last = text
            try:
                line = await asyncio.wait_for(said.get(), LOOK_S)
            except asyncio.TimeoutError:
                continue
            if not line:
                break
            if line.startswith("remove "):
                await remove(hass, entry, line.removeprefix("remove ").strip())
        await hass.async_stop(force=True)


asyncio.run(main())
