// A map of a policy's greedy action around the present state, over two of its numbers.
import { contextOf, makeCanvas } from "touchdown/scene/frame.js";

/** @typedef {import("touchdown/common/palette.js").Palette} Palette */
/** @typedef {import("touchdown/policies/policy.js").Policy} Policy */
/**
 * @typedef {object} Axes
 * @property {[number, number]} indices in the observation, across and up
 * @property {[number, number]} low of the map's edges
 * @property {[number, number]} high
 * @property {[string, string]} names with the edges in the units of the dials
 */

/** @type {Record<string, Axes>} */
export const MAPS = {
  position: {
    indices: [0, 1], low: [-1, -0.15], high: [1, 1.5],
    names: ["x, −10 to 10 m", "y, −1 to 10 m"],
  },
  velocity: {
    indices: [2, 3], low: [-1.6, -1.6], high: [1.6, 0.8],
    names: ["vx, −8 to 8 m/s", "vy, −12 to 6 m/s"],
  },
  rotation: {
    indices: [4, 5], low: [-1.0472, -1.3963], high: [1.0472, 1.3963],
    names: ["angle, −60 to 60°", "turning, −200 to 200°/s"],
  },
};
const COLUMNS = 48;
const ROWS = 36;
const BUDGET = 2.5; // milliseconds a frame
const STRONG = 0.85; // opacity of the actions' colours

export class ActionMap {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {Palette} palette
   */
  constructor(canvas, palette) {
    this.canvas = canvas;
    this.context = contextOf(canvas);
    this.palette = palette;
    this.cells = makeCanvas(COLUMNS, ROWS);
    this.axes = /** @type {Axes} */ (MAPS.position);
    this.next = 0; // cell to compute
    /** @type {Float32Array | null} the state whose map is being computed */
    this.around = null;
    /** @type {Float32Array | null} the state whose map is complete */
    this.complete = null;
    canvas.width = 2 * canvas.clientWidth || 600;
    canvas.height = Math.round((canvas.width * ROWS) / COLUMNS);
  }

  /** Begins a map of another policy or of other axes. */
  restart() {
    this.next = 0;
    this.around = null;
    this.complete = null;
  }

  /**
   * Whether the map is complete and of this state.
   * @param {Float32Array} observation
   */
  isOf(observation) {
    return this.complete?.every((value, i) => value === observation[i]) ?? false;
  }

  /**
   * Computes as much of the map as a frame has time for, and draws it.
   * @param {Policy} policy
   * @param {Float32Array} observation [8], the present state
   * @param {Float32Array[]} earlier states, the oldest first
   */
  draw(policy, observation, earlier) {
    const until = performance.now() + BUDGET;
    const { axes, cells } = this;
    this.around ??= observation.slice();
    const state = this.around.slice();
    do {
      const row = Math.floor(this.next / COLUMNS);
      const column = this.next % COLUMNS;
      state[axes.indices[0]] = between(axes, 0, (column + 0.5) / COLUMNS);
      state[axes.indices[1]] = between(axes, 1, 1 - (row + 0.5) / ROWS);
      cells.context.fillStyle = this.palette.ofAction(policy.act(state));
      cells.context.fillRect(column, row, 1, 1);
      this.next += 1;
      if (this.next === COLUMNS * ROWS) {
        this.next = 0;
        this.complete = this.around;
        this.around = null; // the next map is of the next state
        break;
      }
    } while (performance.now() < until);
    this.paint(observation, earlier);
  }

  /**
   * @param {Float32Array} observation
   * @param {Float32Array[]} earlier
   */
  paint(observation, earlier) {
    const { context, canvas } = this;
    const ink = this.palette.colour("--ink");
    const card = this.palette.colour("--card");
    context.clearRect(0, 0, canvas.width, canvas.height);
    context.globalAlpha = STRONG;
    context.imageSmoothingEnabled = false;
    context.drawImage(this.cells.canvas, 0, 0, canvas.width, canvas.height);
    context.globalAlpha = 1;
    context.beginPath();
    for (const state of earlier) context.lineTo(...this.place(state));
    this.strokeTwice(ink, card, 2);
    const [x, y] = this.place(observation);
    context.beginPath();
    context.arc(x, y, 9, 0, 2 * Math.PI);
    context.moveTo(x - 16, y);
    context.lineTo(x + 16, y);
    context.moveTo(x, y - 16);
    context.lineTo(x, y + 16);
    this.strokeTwice(ink, card, 2.5);
  }

  /**
   * A line that stands out from every colour.
   * @param {string} ink
   * @param {string} card
   * @param {number} width
   */
  strokeTwice(ink, card, width) {
    this.context.lineJoin = "round";
    this.context.lineWidth = width + 4;
    this.context.strokeStyle = card;
    this.context.stroke();
    this.context.lineWidth = width;
    this.context.strokeStyle = ink;
    this.context.stroke();
  }

  /**
   * @param {Float32Array} state
   * @returns {[number, number]} pixels
   */
  place(state) {
    const [across, up] = [0, 1].map((axis) => {
      const index = this.axes.indices[axis] ?? 0;
      const low = this.axes.low[axis] ?? 0;
      const high = this.axes.high[axis] ?? 1;
      return Math.min(Math.max(((state[index] ?? 0) - low) / (high - low), 0), 1);
    });
    return [(across ?? 0) * this.canvas.width, (1 - (up ?? 0)) * this.canvas.height];
  }
}

/**
 * @param {Axes} axes
 * @param {0 | 1} axis
 * @param {number} share 0 is the low edge, 1 the high one
 */
function between(axes, axis, share) {
  return axes.low[axis] + (axes.high[axis] - axes.low[axis]) * share;
}
