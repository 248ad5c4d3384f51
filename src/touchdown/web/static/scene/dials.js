// Text and dials over the picture of a flight.
import { LEFT_ENGINE, MAIN_ENGINE, RIGHT_ENGINE } from "touchdown/common/actions.js";
import { signed } from "touchdown/common/format.js";
import { STEPS_PER_SECOND } from "touchdown/common/units.js";
import { HEIGHT } from "touchdown/scene/frame.js";
import { FLAME, PUFF } from "touchdown/scene/sprite.js";

/** @typedef {import("touchdown/scene/frame.js").Frame} Frame */
/**
 * @typedef {object} Dials
 * @property {number} step steps flown
 * @property {number} return return so far
 * @property {number} fuel return points spent on the engines
 * @property {number} vx m/s
 * @property {number} vy m/s
 * @property {number} angle radians
 */
/**
 * @typedef {object} Writing how to write on a picture
 * @property {CanvasRenderingContext2D} context
 * @property {Frame} frame
 * @property {number} pixelRatio pixels of the picture per pixel of the page
 */

export const OUTCOME_COLOURS = /** @type {Record<string, string>} */ ({
  landed: "rgb(94 222 160)",
  crashed: "rgb(255 112 82)",
  "out of bounds": "rgb(255 190 72)",
  "timed out": "rgb(140 190 245)",
});
const BRIGHT = "rgb(240 243 250)";
const MUTED = "rgb(150 156 174)";
const DARK = "rgb(62 65 78)";
const NIGHT = "rgb(9 12 28)";
const NARROW = 480; // pixels of the page; a narrower picture has fewer and larger dials
/** Name and left edge, of 600, on a wide picture. */
const WIDE_DIALS = /** @type {const} */ ([
  ["time", 22], ["return", 92], ["fuel spent", 172], ["vx", 246], ["vy", 336], ["angle", 426],
]);
const NARROW_DIALS = /** @type {const} */ ([
  ["time", 16], ["return", 130], ["vx", 252], ["vy", 382], ["angle", 508],
]);
const LAMPS_AT = 506;
/** Triangles around the centre of the lamp that point in the direction of thrust. */
const LAMPS = /** @type {const} */ ([
  [LEFT_ENGINE, -20, [[5, -5], [5, 5], [-5, 0]], PUFF[1]],
  [MAIN_ENGINE, 0, [[-6, 4], [6, 4], [0, -6]], FLAME[1]],
  [RIGHT_ENGINE, 20, [[-5, -5], [-5, 5], [5, 0]], PUFF[1]],
]);

/**
 * @param {Writing} writing
 * @param {Dials} dials
 * @param {Set<number>} engines that are firing
 */
export function drawDials(writing, dials, engines) {
  const { frame } = writing;
  const narrow = isNarrow(writing);
  const texts = {
    time: `${(dials.step / STEPS_PER_SECOND).toFixed(2)} s`,
    return: signed(dials.return, 1),
    "fuel spent": dials.fuel.toFixed(1),
    vx: `${signed(dials.vx, 2)}${narrow ? "" : " m/s"}`,
    vy: `${signed(dials.vy, 2)}${narrow ? "" : " m/s"}`,
    angle: `${signed((dials.angle * 180) / Math.PI, 0)}°`,
  };
  for (const [name, left] of narrow ? NARROW_DIALS : WIDE_DIALS) {
    write(writing, name, [left, narrow ? 409 : 414], { size: 10, colour: MUTED });
    write(writing, texts[name], [left, narrow ? 431 : 430], { size: 13, bold: true });
  }
  if (narrow) return;
  write(writing, "engines", [LAMPS_AT, 414], { size: 10, colour: MUTED });
  for (const [engine, offset, outline, colour] of LAMPS) {
    writing.context.beginPath();
    for (const [x, y] of outline) {
      writing.context.lineTo((LAMPS_AT + 26 + offset + x) * frame.scale, (430 + y) * frame.scale);
    }
    writing.context.fillStyle = engines.has(engine) ? (colour ?? BRIGHT) : DARK;
    writing.context.fill();
  }
}

/**
 * The policy's name, if there is a single one, and the start, in the upper left corner.
 * @param {Writing} writing
 * @param {string} name
 * @param {string} start
 */
export function drawTitle(writing, name, start) {
  if (name) write(writing, name, [16, 22], { size: 15, bold: true });
  write(writing, start, [16, name ? 42 : 21], { size: 11, colour: MUTED });
}

/**
 * The outcome and the episode return, in large letters.
 * @param {Writing} writing
 * @param {string} outcome
 * @param {number} episodeReturn
 */
export function drawOutcome(writing, outcome, episodeReturn) {
  const colour = OUTCOME_COLOURS[outcome] ?? BRIGHT;
  const common = /** @type {const} */ ({ bold: true, align: "center", outlined: true });
  write(writing, outcome.toUpperCase(), [300, 128], { ...common, size: 42, colour });
  write(writing, `return ${signed(episodeReturn, 1)}`, [300, 166], { ...common, size: 18 });
}

/**
 * A name above a lander, where several fly.
 * @param {Writing} writing
 * @param {{x: number, y: number}} hull metres
 * @param {string} name
 * @param {string | undefined} colour
 * @param {readonly [number, number][]} taken places of other names, which are to stay readable
 * @returns {[number, number]} its place
 */
export function drawName(writing, hull, name, colour, taken) {
  const { frame } = writing;
  const line = isNarrow(writing) ? 20 : 14;
  const x = Math.min(Math.max(frame.column(hull.x) / frame.scale, 30), 570);
  let y = Math.max(frame.row(hull.y) / frame.scale - 30, 36);
  const away = y < 120 ? line : -line;
  while (taken.some(([left, top]) => Math.abs(left - x) < 5 * line && Math.abs(top - y) < line)) {
    y += away;
  }
  const style = /** @type {const} */ ({ size: 11, bold: true, align: "center", outlined: true });
  write(writing, name, [x, y], { ...style, colour: colour ?? BRIGHT });
  return [x, y];
}

/**
 * Marks a lander above the picture: its x, and its distance above the edge in metres.
 * @param {Writing} writing
 * @param {{x: number, y: number}} hull metres
 * @param {string | undefined} colour
 */
export function drawHeightMarker(writing, hull, colour) {
  const { context, frame } = writing;
  const [left, right] = [(isNarrow(writing) ? 150 : 110) * frame.scale, 560 * frame.scale]; // beside the title
  const column = Math.min(Math.max(frame.column(hull.x), left), right);
  context.beginPath();
  context.moveTo(column, 6 * frame.scale);
  context.lineTo(column - 6 * frame.scale, 14 * frame.scale);
  context.lineTo(column + 6 * frame.scale, 14 * frame.scale);
  context.fillStyle = colour ?? BRIGHT;
  context.fill();
  write(writing, `${(hull.y - HEIGHT).toFixed(1)} m`, [column / frame.scale, 22], {
    size: 10, align: "center",
  });
}

/** @param {Writing} writing */
function isNarrow({ frame, pixelRatio }) {
  return frame.width / pixelRatio < NARROW;
}

/**
 * @param {Writing} writing
 * @param {string} text
 * @param {[number, number]} place of its middle line, on a picture 600 pixels wide
 * @param {object} style
 * @param {number} style.size of the letters there; never smaller on the page than 10 pixels
 * @param {string} [style.colour]
 * @param {boolean} [style.bold]
 * @param {CanvasTextAlign} [style.align]
 * @param {boolean} [style.outlined] a lander may be behind it
 */
function write(writing, text, [x, y], style) {
  const { context, frame, pixelRatio } = writing;
  const smallest = (style.bold ? 12 : 10) * pixelRatio;
  const size = Math.max(style.size * frame.scale, smallest);
  const family = 'system-ui, -apple-system, "Segoe UI", Roboto, "DejaVu Sans", sans-serif';
  context.font = `${style.bold ? "700 " : ""}${size}px ${family}`;
  context.textBaseline = "middle";
  context.textAlign = style.align ?? "left";
  if (style.outlined) {
    context.lineJoin = "round";
    context.lineWidth = 4 * Math.max(frame.scale, 0.5 * pixelRatio);
    context.strokeStyle = NIGHT;
    context.strokeText(text, x * frame.scale, y * frame.scale);
  }
  context.fillStyle = style.colour ?? BRIGHT;
  context.fillText(text, x * frame.scale, y * frame.scale);
}
