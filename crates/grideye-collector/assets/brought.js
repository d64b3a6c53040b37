// What annexes of the program bring to the live page: their scripts run before main.js, and each adds itself here.

export const brought = {
  /**
   * What opens beside one sensor: `{ title, key, says, Panel }`. A panel is made in a place, follows whom it is told to, and
   * is told of each frame, of how the picture lies, and of the state; `null` where there is none.
   */
  panel: null,
  /** Other pages: `{ id, title, href, key, says }`. */
  links: [],
};
