// Strips under the flight, all over the same time: Q(s, a), the value gap, actions, fuel and return.
import { signed } from "touchdown/common/format.js";
import { contextOf } from "touchdown/scene/frame.js";
import { gapOf } from "touchdown/play/insight.js";
import { RIVAL_COLOURS } from "touchdown/play/screens.js";

/** @typedef {import("touchdown/common/palette.js").Palette} Palette */
/** @typedef {import("touchdown/play/game.js").Game} Game */
/** @typedef {import("touchdown/play/insight.js").Insight} Insight */
/**
 * @typedef {object} Line
 * @property {(step: number) => number | null} value
 * @property {string} colour
 * @property {number} [width]
 */

const SHORTEST = 300; // steps that a strip shows at least

export class Strips {
  /**
   * @param {HTMLElement} place with a canvas and an output for each strip, by data-strip
   * @param {Palette} palette
   */
  constructor(place, palette) {
    this.place = place;
    this.palette = palette;
    /** @type {Map<string, Strip>} */
    this.strips = new Map();
    for (const element of place.querySelectorAll("[data-strip]")) {
      if (element instanceof HTMLElement) {
        this.strips.set(element.dataset.strip ?? "", new Strip(element));
      }
    }
  }

  /**
   * @param {Game} game
   * @param {Insight} insight of the lead
   */
  draw({ race }, insight) {
    const { lead, rivals, step } = race;
    const shown = Math.min(step, lead.steps);
    const last = Math.max(race.recorded, SHORTEST);
    const ink = this.palette.colour("--ink");
    const state = lead.at(shown);
    const values = insight.values(shown);
    const view = { last, until: shown, rule: this.palette.colour("--line"), ink };
    const known = (/** @type {number} */ at) => (at <= shown ? insight.values(at) : null);
    this.strips.get("values")?.drawLines(
      [0, 1, 2, 3].map((action) => ({
        value: (at) => known(at)?.[action] ?? null,
        colour: this.palette.ofAction(action),
      })),
      view,
    );
    this.say("values", values ? [...values].map((value) => signed(value, 1)) : []);
    this.strips.get("gap")?.drawLines(
      [{ value: (at) => mapped(known(at), gapOf), colour: this.palette.colour("--purple") }],
      { ...view, zero: true },
    );
    this.say("gap", [values ? gapOf(values).toFixed(2) : "none"]);
    this.strips.get("actions")?.drawBands(
      (at) => (at > 0 && at <= shown ? lead.at(at).action : null),
      (action) => this.palette.ofAction(action),
      view,
    );
    this.strips.get("fuel")?.drawLines(
      [{ value: (at) => lead.at(at).fuel, colour: this.palette.colour("--red") }],
      { ...view, zero: true },
    );
    this.say("fuel", [state.fuel.toFixed(1)]);
    const others = rivals.map((flight, i) => ({
      value: (/** @type {number} */ at) => (at <= flight.steps ? flight.at(at).return : null),
      colour: RIVAL_COLOURS[i % RIVAL_COLOURS.length] ?? ink,
      width: 1,
    }));
    this.strips.get("return")?.drawLines(
      [...others, { value: (at) => (at <= lead.steps ? lead.at(at).return : null), colour: ink }],
      { ...view, until: step, zero: true },
    );
    this.say("return", [signed(state.return, 1)]);
  }

  /**
   * @param {string} name
   * @param {string[]} texts one for each output of the strip
   */
  say(name, texts) {
    this.strips.get(name)?.outputs.forEach((output, i) => {
      const text = texts[i] ?? "–";
      if (output.textContent !== text) output.textContent = text;
    });
  }
}

/**
 * @typedef {object} View
 * @property {number} last step at the right edge
 * @property {number} until the moment shown
 * @property {boolean} [zero] whether 0 is in the picture
 * @property {string} rule colour
 * @property {string} ink colour
 */

class Strip {
  /** @param {HTMLElement} element */
  constructor(element) {
    const canvas = element.querySelector("canvas");
    if (!canvas) throw new Error("a strip needs a canvas");
    this.canvas = canvas;
    this.context = contextOf(canvas);
    this.outputs = [...element.querySelectorAll("[data-value]")];
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.resize();
  }

  resize() {
    const ratio = Math.min(devicePixelRatio, 2);
    this.canvas.width = Math.max(Math.round(this.canvas.clientWidth * ratio), 1);
    this.canvas.height = Math.max(Math.round(this.canvas.clientHeight * ratio), 1);
    this.ratio = ratio;
  }

  /**
   * @param {Line[]} lines
   * @param {View} view
   */
  drawLines(lines, view) {
    const { width, height } = this.canvas;
    const points = lines.map(({ value }) =>
      Array.from({ length: view.until + 1 }, (_, step) => value(step)),
    );
    const numbers = points.flat().filter((value) => value !== null);
    if (view.zero) numbers.push(0);
    let low = numbers.reduce((least, value) => Math.min(least, value), Infinity);
    let high = numbers.reduce((most, value) => Math.max(most, value), -Infinity);
    if (!(high - low > 1e-6)) [low, high] = [low - 1, high + 1];
    const margin = 3 * (this.ratio ?? 1);
    const row = (/** @type {number} */ value) =>
      height - margin - ((value - low) / (high - low)) * (height - 2 * margin);
    this.clear(view, low < 0 && high > 0 ? row(0) : null);
    lines.forEach(({ colour, width: thickness = 1.6 }, i) => {
      this.context.beginPath();
      points[i]?.forEach((value, step) => {
        if (value !== null) this.context.lineTo((step / view.last) * width, row(value));
      });
      this.context.strokeStyle = colour;
      this.context.lineWidth = thickness * (this.ratio ?? 1);
      this.context.lineJoin = "round";
      this.context.stroke();
    });
  }

  /**
   * @param {(step: number) => number | null} action
   * @param {(action: number) => string} colour
   * @param {View} view
   */
  drawBands(action, colour, view) {
    const { width, height } = this.canvas;
    this.clear(view, null);
    const lane = height / 3;
    for (let step = 1; step <= view.until; step++) {
      const done = action(step);
      if (!done) continue; // a gap shows that no engine fires
      this.context.fillStyle = colour(done);
      const left = ((step - 1) / view.last) * width;
      this.context.fillRect(left, (done - 1) * lane + 1, width / view.last + 0.5, lane - 2);
    }
  }

  /**
   * @param {View} view
   * @param {number | null} zero row of a line through 0
   */
  clear(view, zero) {
    const { width, height } = this.canvas;
    this.context.clearRect(0, 0, width, height);
    this.context.fillStyle = view.rule;
    if (zero !== null) this.context.fillRect(0, zero, width, 1);
    this.context.fillStyle = view.ink;
    this.context.globalAlpha = 0.35;
    this.context.fillRect((view.until / view.last) * width - 0.5, 0, this.ratio ?? 1, height);
    this.context.globalAlpha = 1;
  }
}

/**
 * @template T, R
 * @param {T | null} value
 * @param {(value: T) => R} map
 */
function mapped(value, map) {
  return value === null ? null : map(value);
}
