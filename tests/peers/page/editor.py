"""What the scene editor's hand waits for: things dragged at 60 Hz, by the browser's own input, in every scene with a sensor."""

import math

STEP_MS = 16
DRAG_S = 2
# Around where it stood, so that nothing leaves its room for long; at another place of the centimeter's grid every time.
SWING_PX = 18
# The measure that the page keeps: from the time of the hand's event until the page has painted all that came of it. What the
# browser's compositor and the screen take from there is beyond a page's sight.
NAME = "hand to picture"

# A place of the window at which a thing of that kind is in front of all others.
PLACE = """
    const [kind] = given;
    document.querySelector('#plan').scrollIntoView({ block: 'center' });
    await new Promise(requestAnimationFrame);
    for (const shape of document.querySelectorAll(`#plan [data-kind=${kind}]:not([data-row])`)) {
      const { x, y, width, height } = shape.getBoundingClientRect();
      for (let index = 0; index < 100; index += 1) {
        const at = [x + width * (((index * 0.618034) + 0.5) % 1), y + height * ((index + 0.5) / 100)].map(Math.round);
        const found = document.elementFromPoint(...at)?.closest('[data-kind]')?.dataset;
        if (found?.kind === kind && found.row === undefined) return at;
      }
    }
    return null;"""
READY = "while (document.querySelector('main')?.dataset.ready !== 'true') await new Promise((wait) => setTimeout(wait, 20));"
# As long as answers still come, the hand's last ones are under way.
WAITS = """
    const count = () => performance.getEntriesByName(given[0]).length;
    for (let before = -1; before < count(); ) {
      before = count();
      await new Promise((wait) => setTimeout(wait, 500));
    }
    const waits = performance.getEntriesByName(given[0]).map(({ duration }) => duration);
    performance.clearMeasures(given[0]);
    return waits;"""


def swing(x, y):
    steps = DRAG_S * 1000 // STEP_MS
    angles = [2 * math.pi * step / steps for step in range(steps + 1)]
    return [(x, y)] + [(round(x + SWING_PX * math.sin(3 * angle)), round(y + SWING_PX * math.sin(2 * angle))) for angle in angles]


def waits(browser, url, scene):
    """How long each picture of the drags took, in milliseconds, of every kind of thing that could be taken hold of."""
    browser.open("about:blank")
    browser.open(f"{url}/editor#scene={scene}")
    browser.run(READY)
    found = {}
    for kind, words in (("sensor", "a sensor"), ("agent", "a person"), ("object", "an object")):
        place = browser.run(PLACE, kind)
        if place is None:
            continue
        browser.run("performance.clearMeasures(given[0])", NAME)
        browser.drag(swing(*place), STEP_MS)
        found[words] = browser.run(WAITS, NAME)
    return found
