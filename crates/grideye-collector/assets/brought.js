// What annexes add to the live page. Their scripts run before main.js and fill this in.

export const brought = {
  /**
   * The panel beside one sensor, or `null`: `{ title, key, says, Panel }`. It gets each frame, the image's orientation and the
   * state of the sensor that it follows.
   */
  panel: null,
  /** Other pages: `{ id, title, href, key, says }`. */
  links: [],
};
