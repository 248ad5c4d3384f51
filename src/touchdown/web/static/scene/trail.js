// The path that a lander has flown: its latest part is the brightest.
import { STEPS_PER_SECOND } from "touchdown/common/units.js";

/** @typedef {import("touchdown/scene/frame.js").Frame} Frame */

const COLOUR = "rgb(150 196 255)";
const FADING = 0.8; // seconds in which a fresh trail fades to 1/e
const STEADY = 0.45; // opacity of the trail of a flight that is over
const SHADES = 24; // lines of one shade are drawn in one stroke: all but the latest few

/**
 * @param {CanvasRenderingContext2D} context
 * @param {Frame} frame
 * @param {object} craft
 * @param {ArrayLike<ArrayLike<number>>} craft.trail x, y in metres after each step, the latest last
 * @param {number} [craft.opacity]
 * @param {string} [craft.colour]
 * @param {string | null} [craft.outcome] of a flight that is over
 */
export function drawTrail(context, frame, { trail, opacity = 1, colour, outcome }) {
  const shadeOf = (/** @type {number} */ age) =>
    Math.round(SHADES * (outcome ? STEADY : freshness(age)));
  const newest = trail.length - 1;
  context.strokeStyle = colour ?? COLOUR;
  context.lineWidth = 1.6 * frame.scale;
  context.lineJoin = "round";
  for (let last = newest; last > 0; ) {
    const shade = shadeOf(newest - last);
    let first = last - 1;
    while (first > 0 && shadeOf(newest - first) === shade) first -= 1;
    context.globalAlpha = (opacity * shade) / SHADES;
    context.beginPath();
    for (let i = first; i <= last; i++) {
      const point = trail[i];
      context.lineTo(frame.column(point?.[0] ?? NaN), frame.row(point?.[1] ?? NaN));
    }
    context.stroke();
    last = first;
  }
  context.globalAlpha = 1;
}

/**
 * Opacity of a line that is so many steps old.
 * @param {number} steps
 */
function freshness(steps) {
  return 0.16 + 0.62 * Math.exp(-steps / STEPS_PER_SECOND / FADING);
}
