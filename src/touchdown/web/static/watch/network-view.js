// The network while it flies: what each unit puts out, and which ones never do.

/** @typedef {import("touchdown/engine/engine.js").NetworkPolicy} NetworkPolicy */
/** @typedef {import("touchdown/watch/flight.js").Flown} Flown */
/** @typedef {import("touchdown/watch/theme.js").Colours} Colours */

const INPUTS = ["x", "y", "vx", "vy", "angle", "spin", "leg", "leg"];
const ACTIONS = ["none", "left", "main", "right"];
const GAP = 14;

/**
 * The largest output of each unit over a flight, by layer, for the scale of the picture; a ReLU
 * unit whose largest output is 0 is dead in this flight.
 * @param {NetworkPolicy} policy
 * @param {Flown} flown
 * @returns {Float32Array[]}
 */
export function largestOutputs(policy, flown) {
  /** @type {Float32Array[]} */
  let largest = [];
  for (const observation of flown.observations) {
    policy.values(observation);
    const layers = policy.activations();
    if (!largest.length) largest = layers.map((layer) => new Float32Array(layer.length));
    layers.forEach((layer, place) => {
      const most = /** @type {Float32Array} */ (largest[place]);
      layer.forEach((value, unit) => {
        most[unit] = Math.max(most[unit] ?? 0, Math.abs(value));
      });
    });
  }
  return largest;
}

/** The number of dead units in each layer. @param {Float32Array[]} largest */
export function deadUnits(largest) {
  return largest.map((layer) => layer.filter((value) => value === 0).length);
}

export class NetworkView {
  /** @type {Float32Array[]} */
  #largest = [];

  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
  }

  /** The network and the flight that are shown next. @param {NetworkPolicy} policy @param {Flown} flown */
  take(policy, flown) {
    this.#largest = largestOutputs(policy, flown);
    return deadUnits(this.#largest);
  }

  /**
   * @param {NetworkPolicy} policy
   * @param {Float32Array} observation
   * @param {Colours} colours
   * @param {number} scale of the rewards that it was trained with
   */
  draw(policy, observation, colours, scale) {
    const ratio = Math.min(devicePixelRatio, 2);
    const width = this.canvas.clientWidth;
    const height = this.canvas.clientHeight;
    if (!width) return;
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
    const context = this.canvas.getContext("2d");
    if (!context) return;
    context.scale(ratio, ratio);
    context.font = "11px system-ui, sans-serif";
    context.textBaseline = "middle";
    const values = policy.values(observation);
    const layers = policy.activations();
    const sides = 62;
    const room = (width - 2 * sides - GAP * (layers.length + 1)) / Math.max(1, layers.length);
    inputs(context, observation, colours, height);
    layers.forEach((layer, place) => {
      const left = sides + GAP + place * (room + GAP);
      block(context, layer, this.#largest[place], colours, left, room, height);
    });
    outputs(context, Array.from(values, (value) => value / scale), colours, width - sides, sides, height);
  }
}

/** @param {CanvasRenderingContext2D} context @param {Float32Array} observation @param {Colours} colours @param {number} height */
function inputs(context, observation, colours, height) {
  const row = height / INPUTS.length;
  INPUTS.forEach((name, index) => {
    const value = Number(observation[index]);
    const middle = (index + 0.5) * row;
    context.fillStyle = colours.muted;
    context.textAlign = "left";
    context.fillText(name, 0, middle);
    context.strokeStyle = colours.line;
    context.strokeRect(40.5, Math.round(middle - 6) + 0.5, 12, 12);
    context.globalAlpha = Math.min(1, Math.abs(value));
    context.fillStyle = value < 0 ? colours.red : colours.blue;
    context.fillRect(41, Math.round(middle - 6) + 1, 11, 11);
    context.globalAlpha = 1;
  });
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {Float32Array} layer
 * @param {Float32Array|undefined} largest
 * @param {Colours} colours
 * @param {number} left
 * @param {number} room
 * @param {number} height
 */
function block(context, layer, largest, colours, left, room, height) {
  const text = 16;
  const columns = Math.max(1, Math.ceil(Math.sqrt((layer.length * room) / (height - text))));
  const rows = Math.ceil(layer.length / columns);
  const cell = Math.min(room / columns, (height - text) / rows, 22);
  const top = (height - text - rows * cell) / 2;
  const start = left + (room - columns * cell) / 2;
  const inner = Math.max(1, cell - (cell > 5 ? 1.5 : 0.5));
  layer.forEach((value, unit) => {
    const x = start + (unit % columns) * cell;
    const y = top + Math.floor(unit / columns) * cell;
    const most = largest?.[unit] ?? 0;
    if (most === 0) {
      context.strokeStyle = colours.red;
      context.globalAlpha = 0.7;
      context.strokeRect(x + 0.5, y + 0.5, inner - 1, inner - 1);
    } else {
      context.fillStyle = colours.line;
      context.globalAlpha = 0.45;
      context.fillRect(x, y, inner, inner);
      context.fillStyle = value < 0 ? colours.red : colours.blue;
      context.globalAlpha = Math.min(1, Math.abs(value) / most);
      context.fillRect(x, y, inner, inner);
    }
    context.globalAlpha = 1;
  });
  context.fillStyle = colours.muted;
  context.textAlign = "center";
  context.fillText(`${layer.length} units`, left + room / 2, height - text / 2);
}

/** @param {CanvasRenderingContext2D} context @param {number[]} values @param {Colours} colours @param {number} left @param {number} width @param {number} height */
function outputs(context, values, colours, left, width, height) {
  const best = values.indexOf(Math.max(...values));
  const row = height / ACTIONS.length;
  ACTIONS.forEach((name, action) => {
    const middle = (action + 0.5) * row;
    context.textAlign = "left";
    context.fillStyle = action === best ? colours.ink : colours.muted;
    context.font = `${action === best ? "bold " : ""}11px system-ui, sans-serif`;
    context.fillText(name, left, middle - 8);
    context.fillText((values[action] ?? 0).toFixed(1), left, middle + 8);
    if (action === best) {
      context.fillStyle = colours.blue;
      context.fillRect(left, middle + 17, width * 0.6, 3);
    }
  });
}
