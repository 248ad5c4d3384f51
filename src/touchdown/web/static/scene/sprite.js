// Draws the lander: hull, legs and the flames of its engines.
import { LEFT_ENGINE, MAIN_ENGINE, RIGHT_ENGINE } from "touchdown/common/actions.js";
import { makeCanvas, UNITS_PER_METRE } from "touchdown/scene/frame.js";

/** @typedef {import("touchdown/scene/frame.js").Frame} Frame */
/** @typedef {[number, number][]} Outline in the frame of a body and Gymnasium's units */
/** @typedef {{x: number, y: number, angle: number}} Body metres and radians */

/** From the outside inwards. */
export const FLAME = ["rgb(255 112 28)", "rgb(255 190 58)", "rgb(255 250 226)"];
export const PUFF = ["rgb(112 172 255)", "rgb(196 224 255)", "rgb(250 253 255)"];

// hull and leg are the bodies that collide; the rest is decoration inside or close to them
/** @type {Outline} */
const HULL = [[-14, 17], [-17, 0], [-17, -10], [17, -10], [17, 0], [14, 17]];
/** @type {Outline} */
const LEG = [[-2, -8], [2, -8], [2, 8], [-2, 8]];
/** @type {Outline} */
const NOZZLE = [[-4, -10], [4, -10], [6, -14.5], [-6, -14.5]];
/** @type {Outline} */
const SKIRT = [[-17, 0], [17, 0], [17, -10], [-17, -10]];
/** @type {[Outline, string][]} */
const BELOW_SKIRT = [
  [HULL, "rgb(222 227 238)"],
  [[[5, 17], [14, 17], [17, 0], [5, 0]], "rgb(172 180 200)"], // the cabin's shaded side
  [[[-14, 17], [14, 17], [14.3, 15.2], [-14.3, 15.2]], "rgb(250 251 255)"], // its rim
];
/** @type {[Outline, string][]} */
const ABOVE_SKIRT = [
  [[[5, 0], [17, 0], [17, -10], [5, -10]], "rgb(0 0 0 / 0.19)"], // the skirt's shaded side
  [[[-10, 13], [1.5, 13], [2.5, 4.5], [-11, 4.5]], "rgb(24 42 78)"], // the window
  [[[-9.4, 12.3], [-5.2, 12.3], [-7.6, 5.4], [-10.2, 5.4]], "rgb(104 158 214)"], // its glint
];
const SKIRT_COLOUR = "rgb(226 168 62)";
const METAL = "rgb(92 98 116)";
const STRUT = "rgb(150 157 176)";
const LEG_COLOUR = "rgb(196 202 217)";

const REACH = 2.1; // metres from the hull's centre to the end of the longest flame
const MAIN_LENGTH = 46;
const SIDE_LENGTH = 24;
/** Length and width of a flame's layers. */
const LAYERS = /** @type {const} */ ([[1, 1], [0.72, 0.66], [0.46, 0.36]]);

export class Sprite {
  constructor() {
    this.layer = makeCanvas(1, 1); // for landers that are not opaque
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {Frame} frame
   * @param {object} lander
   * @param {ArrayLike<number>} lander.bodies [9]: hull, leg, leg, each x, y in metres and angle
   * @param {Iterable<number>} lander.engines actions whose engines are firing
   * @param {number} lander.flicker step number, which varies the length of the flames
   * @param {number} lander.clearance metres from the hull's centre to the ground
   * @param {number} [lander.opacity]
   * @param {string} [lander.colour] of the skirt
   */
  draw(context, frame, lander) {
    const hull = bodyOf(lander.bodies, 0);
    const opacity = lander.opacity ?? 1;
    const engines = new Set(lander.engines);
    if (engines.has(MAIN_ENGINE)) drawGlow(context, frame, hull, 0.5 * opacity);
    if (opacity >= 1) {
      drawLander(context, frame, lander, engines);
      return;
    }
    // drawn apart: parts that lie over each other would show through
    const side = Math.ceil(2 * REACH * frame.pixelsPerMetre);
    const { canvas, context: apart } = this.layer;
    if (canvas.width !== side) {
      canvas.width = side;
      canvas.height = side;
    }
    const left = Math.round(frame.column(hull.x) - side / 2);
    const top = Math.round(frame.row(hull.y) - side / 2);
    apart.setTransform(1, 0, 0, 1, 0, 0);
    apart.clearRect(0, 0, side, side);
    apart.translate(-left, -top);
    drawLander(apart, frame, lander, engines);
    context.globalAlpha = opacity;
    context.drawImage(canvas, left, top);
    context.globalAlpha = 1;
  }
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {Frame} frame
 * @param {{bodies: ArrayLike<number>, flicker: number, clearance: number, colour?: string | undefined}} lander
 * @param {Set<number>} engines
 */
function drawLander(context, frame, { bodies, flicker, clearance, colour }, engines) {
  const hull = bodyOf(bodies, 0);
  within(context, frame, hull, () => {
    drawFlames(context, engines, flicker, clearance);
    for (const leg of [bodyOf(bodies, 1), bodyOf(bodies, 2)]) drawStruts(context, hull, leg);
  });
  for (const leg of [bodyOf(bodies, 1), bodyOf(bodies, 2)]) {
    within(context, frame, leg, () => fill(context, LEG, LEG_COLOUR));
  }
  within(context, frame, hull, () => {
    fill(context, NOZZLE, METAL);
    for (const [outline, shade] of BELOW_SKIRT) fill(context, outline, shade);
    fill(context, SKIRT, colour ?? SKIRT_COLOUR);
    for (const [outline, shade] of ABOVE_SKIRT) fill(context, outline, shade);
  });
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {Set<number>} engines
 * @param {number} flicker
 * @param {number} clearance
 */
function drawFlames(context, engines, flicker, clearance) {
  const flaring = 0.86 + 0.14 * Math.sin(2.4 * flicker) * Math.cos(0.9 * flicker);
  const side = SIDE_LENGTH * flaring;
  const main = Math.min(MAIN_LENGTH * flaring, Math.max(clearance * UNITS_PER_METRE - 12, 8));
  // an engine is named after its direction of thrust: the flame of the left one points right
  if (engines.has(MAIN_ENGINE)) drawPlume(context, [0, -13], [0, -1], main, 5.6, FLAME);
  if (engines.has(LEFT_ENGINE)) drawPlume(context, [15, 14], [1, 0], side, 3.4, PUFF);
  if (engines.has(RIGHT_ENGINE)) drawPlume(context, [-15, 14], [-1, 0], side, 3.4, PUFF);
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {[number, number]} root
 * @param {[number, number]} direction
 * @param {number} length
 * @param {number} width
 * @param {string[]} colours
 */
function drawPlume(context, root, direction, length, width, colours) {
  const along = Array.from({ length: 12 }, (_, i) => i / 11);
  LAYERS.forEach(([longer, wider], layer) => {
    const edge = along.map((share) => [
      share * length * longer,
      (0.62 + 1.5 * share) * (1 - share) ** 0.75 * (1 - 0.25 * share) * width * wider,
    ]);
    // out along one edge and back along the other
    const back = edge.map(([ahead = 0, aside = 0]) => [ahead, -aside]).reverse();
    const outline = [...edge, ...back].map(([ahead = 0, aside = 0]) => [
      root[0] + direction[0] * ahead - direction[1] * aside,
      root[1] + direction[1] * ahead + direction[0] * aside,
    ]);
    fill(context, /** @type {Outline} */ (outline), colours[layer] ?? "");
  });
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {Body} hull
 * @param {Body} leg
 */
function drawStruts(context, hull, leg) {
  const [dx, dy] = [leg.x - hull.x, leg.y - hull.y];
  const [cos, sin] = [Math.cos(hull.angle), Math.sin(hull.angle)];
  const x = (cos * dx + sin * dy) * UNITS_PER_METRE;
  const y = (cos * dy - sin * dx) * UNITS_PER_METRE;
  const side = x > 0 ? 1 : -1;
  context.beginPath();
  for (const [from, height] of /** @type {const} */ ([[15, -1], [12, -9]])) {
    context.moveTo(from * side, height);
    context.lineTo(x, y);
  }
  context.strokeStyle = STRUT;
  context.lineWidth = 1.3;
  context.stroke();
}

/**
 * A soft light around the main engine's nozzle.
 * @param {CanvasRenderingContext2D} context
 * @param {Frame} frame
 * @param {Body} hull
 * @param {number} opacity
 */
function drawGlow(context, frame, hull, opacity) {
  const below = 22 / UNITS_PER_METRE;
  const x = frame.column(hull.x + Math.sin(hull.angle) * below);
  const y = frame.row(hull.y - Math.cos(hull.angle) * below);
  const radius = 52 * frame.scale;
  const light = context.createRadialGradient(x, y, 0, x, y, radius);
  for (const share of [0, 0.25, 0.5, 0.75, 1]) {
    light.addColorStop(share, `rgb(255 112 28 / ${opacity * (1 - share) ** 2})`);
  }
  context.fillStyle = light;
  context.fillRect(x - radius, y - radius, 2 * radius, 2 * radius);
}

/**
 * Draws in a body's frame, in Gymnasium's units.
 * @param {CanvasRenderingContext2D} context
 * @param {Frame} frame
 * @param {Body} body
 * @param {() => void} draw
 */
function within(context, frame, body, draw) {
  context.save();
  context.translate(frame.column(body.x), frame.row(body.y));
  context.rotate(-body.angle);
  context.scale(frame.scale, -frame.scale);
  draw();
  context.restore();
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {Outline} outline
 * @param {string} colour
 */
function fill(context, outline, colour) {
  context.beginPath();
  for (const [x, y] of outline) context.lineTo(x, y);
  context.fillStyle = colour;
  context.fill();
}

/**
 * @param {ArrayLike<number>} bodies
 * @param {number} index
 * @returns {Body}
 */
function bodyOf(bodies, index) {
  const [x = NaN, y = NaN, angle = NaN] = [0, 1, 2].map((part) => bodies[3 * index + part]);
  return { x, y, angle };
}
