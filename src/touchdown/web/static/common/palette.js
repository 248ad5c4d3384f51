// The colours of the page's palette, for what is drawn on a canvas.

import { onTheme } from "touchdown/common/theme.js";

/** Colours of actions 0 to 3: nothing, left, main, right. */
const ACTION_COLOURS = ["--muted", "--blue", "--orange", "--green"];

export class Palette {
  constructor() {
    this.probe = document.createElement("i");
    this.probe.hidden = true;
    document.body.append(this.probe);
    /** @type {Map<string, string>} */
    this.known = new Map();
    onTheme(() => this.known.clear());
  }

  /**
   * A colour as the page shows it now, in light or dark.
   * @param {string} name of a custom property, such as --ink
   */
  colour(name) {
    let colour = this.known.get(name);
    if (colour === undefined) {
      this.probe.style.color = `var(${name})`;
      colour = getComputedStyle(this.probe).color;
      this.known.set(name, colour);
    }
    return colour;
  }

  /** @param {number} action */
  ofAction(action) {
    return this.colour(ACTION_COLOURS[action] ?? "--ink");
  }
}
