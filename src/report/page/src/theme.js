// Light, dark, or what the system has; and colours of the style sheet as numbers.

const NAMES = ["system", "light", "dark"];
const listeners = new Set();
const probe = document.createElement("span");

/** Tells a function when colours change. */
export function onColours(listener) {
  listeners.add(listener);
}

function changed() {
  listeners.forEach((listener) => listener());
}

export function startTheme(button) {
  probe.hidden = true;
  document.body.append(probe);
  let place = 0;
  button.addEventListener("click", () => {
    place = (place + 1) % NAMES.length;
    const name = NAMES[place];
    if (name === "system") delete document.documentElement.dataset.theme;
    else document.documentElement.dataset.theme = name;
    button.textContent = `Theme: ${name}`;
    changed();
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", changed);
  // Paper is white.
  addEventListener("beforeprint", () => {
    document.documentElement.dataset.print = "";
    changed();
  });
  addEventListener("afterprint", () => {
    delete document.documentElement.dataset.print;
    changed();
  });
}

/** The colour that a class has: text of CSS. */
export function colour(classes) {
  probe.className = `probe ${classes}`;
  return getComputedStyle(probe).color;
}

/** The same as red, green and blue from 0 to 1. */
export function rgb(classes) {
  const canvas = (rgb.canvas ??= new OffscreenCanvas(1, 1).getContext("2d", { willReadFrequently: true }));
  canvas.fillStyle = colour(classes);
  canvas.fillRect(0, 0, 1, 1);
  return Array.from(canvas.getImageData(0, 0, 1, 1).data.slice(0, 3), (part) => part / 255);
}
