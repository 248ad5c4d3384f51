// The colours of the page as they are now, for what does not understand CSS variables.

const NAMES = /** @type {const} */ ([
  "ink", "muted", "line", "page", "card", "link", "brand", "blue", "orange", "green", "red", "purple",
]);

/** @typedef {Record<typeof NAMES[number], string>} Colours */

/** @returns {Colours} */
export function readColours() {
  const probe = document.createElement("i");
  document.body.append(probe);
  const found = /** @type {Colours} */ ({});
  for (const name of NAMES) {
    probe.style.color = `var(--${name})`;
    found[name] = getComputedStyle(probe).color;
  }
  probe.remove();
  return found;
}

/** The colour of an outcome. */
export function outcomeColour(/** @type {Colours} */ colours, /** @type {string} */ outcome) {
  if (outcome === "landed") return colours.green;
  if (outcome === "crashed") return colours.red;
  if (outcome === "out of bounds") return colours.purple;
  if (outcome === "timed out") return colours.orange;
  return colours.blue;
}

/** Colours of their own that there are; of more runs, those alike but for the seed share one. */
export const MOST_COLOURS = 6;

/**
 * A colour of its own for each group.
 * @param {Colours} colours
 * @param {number} index
 * @param {number} count
 */
export function groupColour(colours, index, count) {
  const own = [colours.blue, colours.red, colours.green, colours.purple, colours.orange, colours.brand];
  if (count <= MOST_COLOURS) return own[index] ?? colours.blue;
  return `hsl(${Math.round((360 * index) / count)} 65% 50%)`;
}

/** A colour with less of it. @param {string} colour @param {number} alpha */
export function faded(colour, alpha) {
  const parts = colour.match(/[\d.]+/g) ?? ["0", "0", "0"];
  return colour.startsWith("rgb")
    ? `rgba(${parts.slice(0, 3).join(", ")}, ${alpha})`
    : `hsla(${parts[0]}, 65%, 50%, ${alpha})`;
}
