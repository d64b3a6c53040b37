// Choices stored in the browser. The page also works where nothing can be stored.

const PREFIX = "grideye.";

export function kept(name, otherwise) {
  try {
    const text = localStorage.getItem(PREFIX + name);
    return text === null ? otherwise : { ...otherwise, ...JSON.parse(text) };
  } catch {
    return otherwise;
  }
}

export function keep(name, value) {
  try {
    localStorage.setItem(PREFIX + name, JSON.stringify(value));
  } catch {
    // In private windows and on full disks a choice lasts as long as the page.
  }
}
