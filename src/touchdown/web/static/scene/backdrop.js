// The fixed part of a flight's picture: sky, stars, Earth, moon and landing pad.
import { DASHBOARD, HEIGHT, makeCanvas, UNITS_PER_METRE, WIDTH } from "touchdown/scene/frame.js";
import { Generator } from "touchdown/common/generator.js";
import { paintMoon } from "touchdown/scene/moon.js";
import { heightAt } from "touchdown/scene/terrain.js";

/** @typedef {import("touchdown/scene/frame.js").Frame} Frame */
/** @typedef {import("touchdown/scene/terrain.js").Terrain} Terrain */

const SKY = ["rgb(4 6 15)", "rgb(9 13 31)", "rgb(20 26 56)", "rgb(40 42 78)"]; // top to horizon
const STARS = 110;
const TINTS = ["255 255 255", "202 218 255", "255 232 205"];
const EARTH = { x: 16.9, y: 11.5, radius: 0.72 }; // metres
const SEA = [52, 112, 186];
const CLOUD = [226, 236, 246];
const SLAB = 0.1; // thickness of the pad in metres
const FLAG_HEIGHT = 50 / UNITS_PER_METRE; // metres, as in Gymnasium's picture
const PAD = { top: "rgb(236 239 247)", side: "rgb(128 132 150)", pole: "rgb(205 209 222)" };
const FLAG = { lit: "rgb(255 196 61)", shaded: "rgb(222 150 30)" };

/**
 * The backdrop of one start; the same start always looks the same.
 * @param {Frame} frame
 * @param {Terrain} terrain
 * @param {number} seed
 * @returns {HTMLCanvasElement}
 */
export function paintBackdrop(frame, terrain, seed) {
  const { canvas, context } = makeCanvas(frame.width, frame.height);
  paintSky(context, frame);
  paintStars(context, frame, new Generator(seed, 1));
  paintEarth(context, frame);
  paintMoon(context, frame, terrain, new Generator(seed, 2));
  paintPad(context, frame, terrain);
  return canvas;
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {Frame} frame
 */
function paintSky(context, frame) {
  const gradient = context.createLinearGradient(0, 0, 0, frame.row(0));
  SKY.forEach((colour, i) => gradient.addColorStop(i / (SKY.length - 1), colour));
  context.fillStyle = gradient;
  context.fillRect(0, 0, frame.width, frame.height);
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {Frame} frame
 * @param {Generator} generator
 */
function paintStars(context, frame, generator) {
  for (let i = 0; i < STARS; i++) {
    const x = frame.column(generator.uniform(0, WIDTH));
    const y = frame.row(generator.uniform(0, HEIGHT));
    const brightness = 0.12 + 0.75 * generator.uniform() ** (1 / 0.35);
    const tint = TINTS[generator.integer() % TINTS.length];
    const radius = frame.scale * (0.42 + 0.38 * brightness);
    const light = context.createRadialGradient(x, y, 0, x, y, 3 * radius);
    for (const distance of [0, 0.5, 1, 1.5, 2, 3]) {
      const share = brightness * Math.exp(-(distance ** 2) / 2);
      light.addColorStop(distance / 3, `rgb(${tint} / ${distance === 3 ? 0 : share})`);
    }
    context.fillStyle = light;
    context.fillRect(x - 3 * radius, y - 3 * radius, 6 * radius, 6 * radius);
  }
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {Frame} frame
 */
function paintEarth(context, frame) {
  const edge = EARTH.radius * frame.pixelsPerMetre;
  const [x, y] = [frame.column(EARTH.x), frame.row(EARTH.y)];
  const halo = context.createRadialGradient(x, y, 0.9 * edge, x, y, 2 * edge);
  for (const share of [0, 0.1, 0.25, 0.45, 0.7, 1]) {
    halo.addColorStop(share, `rgb(48 81 136 / ${0.3 * (1 - share) ** 4})`);
  }
  context.fillStyle = halo;
  context.fillRect(x - 2 * edge, y - 2 * edge, 4 * edge, 4 * edge);
  const size = Math.ceil(2 * edge) + 2;
  const globe = makeCanvas(size, size);
  const image = globe.context.createImageData(size, size);
  for (let row = 0, i = 0; row < size; row++) {
    for (let column = 0; column < size; column++, i += 4) {
      const across = (column + 0.5 - size / 2) / edge;
      const up = (size / 2 - row - 0.5) / edge;
      const distance = Math.hypot(across, up);
      const bulge = Math.sqrt(Math.max(1 - distance ** 2, 0));
      const sun = 0.12 + 1.1 * (-0.62 * across + 0.5 * up + 0.55 * bulge);
      const light = Math.min(Math.max(sun, 0.06), 1);
      const swirl =
        Math.sin(7.5 * up + 1.6 * Math.sin(3.1 * across + 1) + 2) +
        0.6 * Math.sin(5 * across - up);
      const clouds = Math.min(Math.max(0.8 * swirl - 0.35, 0), 0.6);
      SEA.forEach((sea, band) => {
        image.data[i + band] = (sea + ((CLOUD[band] ?? 0) - sea) * clouds) * light;
      });
      image.data[i + 3] = 255 * Math.min(Math.max((1 - distance) * edge + 0.5, 0), 1);
    }
  }
  globe.context.putImageData(image, 0, 0);
  context.drawImage(globe.canvas, x - size / 2, y - size / 2);
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {Frame} frame
 * @param {Terrain} terrain
 */
function paintPad(context, frame, terrain) {
  const { helipadX1: left, helipadX2: right, helipadY } = terrain;
  const ground = Math.max(heightAt(terrain, (left + right) / 2), -DASHBOARD);
  const mast = helipadY + FLAG_HEIGHT;
  /** @param {number[][]} corners @param {string} colour */
  const fill = (corners, colour) => {
    context.beginPath();
    for (const [x = 0, y = 0] of corners) context.lineTo(frame.column(x), frame.row(y));
    context.fillStyle = colour;
    context.fill();
  };
  /** @param {number} top @param {number} bottom @param {string} colour */
  const slab = (top, bottom, colour) =>
    fill([[left, bottom], [right, bottom], [right, top], [left, top]], colour);
  slab(ground, ground - SLAB, PAD.top);
  slab(ground - SLAB, ground - 1.8 * SLAB, PAD.side);
  for (const [x, outwards] of /** @type {const} */ ([[left, -1], [right, 1]])) {
    context.beginPath();
    context.moveTo(frame.column(x), frame.row(ground));
    context.lineTo(frame.column(x), frame.row(mast));
    context.strokeStyle = PAD.pole;
    context.lineWidth = 1.4 * frame.scale;
    context.stroke();
    const tip = [x + (outwards * 25) / UNITS_PER_METRE, mast - 1 / 6];
    fill([[x, mast], tip, [x, mast - 1 / 3]], FLAG.lit);
    fill([[x, mast - 1 / 6], tip, [x, mast - 1 / 3]], FLAG.shaded);
  }
}
