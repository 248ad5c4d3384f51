// The moon's surface, pixel by pixel: light that falls off below the ground, craters, a lit rim.
import { HEIGHT, makeCanvas, WIDTH } from "touchdown/scene/frame.js";
import { heightAt } from "touchdown/scene/terrain.js";

/** @typedef {import("touchdown/scene/frame.js").Frame} Frame */
/** @typedef {import("touchdown/scene/terrain.js").Terrain} Terrain */
/** @typedef {import("touchdown/common/generator.js").Generator} Generator */
/** @typedef {{x: number, y: number, below: number, radius: number}} Crater */

const LIT = [150, 152, 164];
const DEEP = [23, 24, 33];
const RIM = [226, 228, 238];
const DEPTH = 1.5; // metres in which the light falls to 1/e
const SUN = { x: -0.55, y: 0.835 }; // towards the light
const SMOOTHED = 1.6; // metres over which light and ground are averaged
const CRATERS = 16;
const FLATTENED = 0.42; // craters are seen from the side

/**
 * @param {CanvasRenderingContext2D} context
 * @param {Frame} frame
 * @param {Terrain} terrain
 * @param {Generator} generator
 */
export function paintMoon(context, frame, terrain, generator) {
  const columns = surfaceOf(frame, terrain);
  const top = Math.max(Math.floor(frame.row(Math.max(...columns.surface))) - 2, 0);
  const rows = frame.height - top;
  if (rows <= 0) return;
  const shades = craterShades(frame, cratersOf(terrain, generator), top, rows);
  const layer = makeCanvas(frame.width, rows);
  const image = layer.context.createImageData(frame.width, rows);
  const rimWidth = 10 * frame.scale; // beyond it nothing is seen
  /** @param {number} across @param {number} facing */
  const rimAt = (across, facing) =>
    Math.exp(-Math.max(across, 0) / (1.3 * frame.scale)) * (0.25 + 0.5 * facing);
  for (let row = 0, pixel = 0; row < rows; row++) {
    const y = HEIGHT - (top + row + 0.5) / frame.pixelsPerMetre;
    const dimmed = clamp((y + 0.2) / 0.8); // the dials need a dark background
    for (let column = 0; column < frame.width; column++, pixel++) {
      // measured across the slope, so that a steep edge is as smooth as a flat one
      const metres = (of(columns.surface, column) - y) / of(columns.steepness, column);
      const across = metres * frame.pixelsPerMetre;
      const cover = clamp(across + 0.5);
      if (cover === 0) continue;
      const below = Math.max(of(columns.smooth, column) - y, 0);
      const light = Math.exp(-below / DEPTH) * of(columns.light, column) * dimmed;
      const rim = across < rimWidth ? rimAt(across, of(columns.facing, column)) : 0;
      for (let band = 0; band < 3; band++) {
        const deep = of(DEEP, band);
        const ground = (deep + (of(LIT, band) - deep) * light) * of(shades, pixel);
        image.data[4 * pixel + band] = ground + (of(RIM, band) - ground) * rim;
      }
      image.data[4 * pixel + 3] = 255 * cover;
    }
  }
  layer.context.putImageData(image, 0, 0);
  context.drawImage(layer.canvas, 0, top);
}

/**
 * What each column of pixels needs to know of the ground.
 * @param {Frame} frame
 * @param {Terrain} terrain
 */
function surfaceOf(frame, terrain) {
  const surface = Float64Array.from({ length: frame.width }, (_, column) =>
    heightAt(terrain, (column + 0.5) / frame.pixelsPerMetre),
  );
  const slope = surface.map((height, column) => {
    const left = surface[column - 1];
    const right = surface[column + 1];
    const run = (left === undefined || right === undefined ? 1 : 2) / frame.pixelsPerMetre;
    return ((right ?? height) - (left ?? height)) / run;
  });
  const steepness = slope.map((each) => Math.hypot(each, 1));
  const facing = slope.map((each, column) =>
    clamp((-SUN.x * each + SUN.y) / of(steepness, column)),
  );
  const reach = Math.round((SMOOTHED * frame.pixelsPerMetre) / 2);
  return {
    surface,
    steepness,
    facing, // the sun, 0 to 1
    // light fades below a smoothed surface, or every corner would cast a column of light
    smooth: blurred(surface, reach),
    light: blurred(facing, reach).map((each) => 0.5 + 0.3 * each),
  };
}

/**
 * Mean over 2 · reach + 1 places; the outermost values continue beyond the ends.
 * @param {Float64Array} values
 * @param {number} reach
 */
function blurred(values, reach) {
  const last = values.length - 1;
  const near = (/** @type {number} */ i) => of(values, Math.min(Math.max(i, 0), last));
  let sum = 0;
  for (let i = -reach; i <= reach; i++) sum += near(i);
  return values.map((_, i) => {
    const mean = sum / (2 * reach + 1);
    sum += near(i + reach + 1) - near(i - reach);
    return mean;
  });
}

/**
 * @param {Terrain} terrain
 * @param {Generator} generator
 * @returns {Crater[]}
 */
function cratersOf(terrain, generator) {
  const craters = [];
  for (let i = 0; i < CRATERS; i++) {
    const x = generator.uniform(0, WIDTH);
    const below = 0.35 + 2.6 * (1 - Math.sqrt(generator.uniform()));
    const radius = generator.uniform(0.14, 0.34) * (1 + 0.35 * below);
    const y = heightAt(terrain, x) - below;
    if (y >= radius) craters.push({ x, y, below, radius }); // lower down are the dials
  }
  return craters;
}

/**
 * Factors on the ground's brightness, one for each pixel below `top`.
 * @param {Frame} frame
 * @param {Crater[]} craters
 * @param {number} top
 * @param {number} rows
 */
function craterShades(frame, craters, top, rows) {
  const shades = new Float32Array(frame.width * rows).fill(1);
  for (const { x, y, below, radius } of craters) {
    const [wide, high] = [1.4 * radius, 1.4 * FLATTENED * radius];
    const left = Math.max(Math.floor(frame.column(x - wide)), 0);
    const right = Math.min(Math.ceil(frame.column(x + wide)), frame.width);
    const first = Math.max(Math.floor(frame.row(y + high)) - top, 0);
    const last = Math.min(Math.ceil(frame.row(y - high)) - top, rows);
    for (let row = first; row < last; row++) {
      const height = HEIGHT - (top + row + 0.5) / frame.pixelsPerMetre;
      const up = (height - y) / (FLATTENED * radius);
      for (let column = left; column < right; column++) {
        const across = ((column + 0.5) / frame.pixelsPerMetre - x) / radius;
        const distance = Math.hypot(across, up);
        const away = -SUN.x * across - SUN.y * up; // from the sun, in radii
        const inside = clamp((1 - distance) * 5);
        const wall = Math.exp(-(((distance - 1) / 0.14) ** 2));
        // a crater's wall towards the sun is in shadow, the opposite one is lit
        const shade = inside * (0.16 * away - 0.2) + wall * 0.3 * clamp(away);
        const pixel = row * frame.width + column;
        shades[pixel] = of(shades, pixel) * (1 + shade * Math.exp(-below / 2.4));
      }
    }
  }
  return shades;
}

/** @param {number} value */
function clamp(value) {
  return Math.min(Math.max(value, 0), 1);
}

/**
 * @param {ArrayLike<number>} values
 * @param {number} index that exists
 */
function of(values, index) {
  return /** @type {number} */ (values[index]);
}
