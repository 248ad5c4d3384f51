// The picture of a start with landers that fly from it, on a canvas of the page.
import { paintBackdrop } from "touchdown/scene/backdrop.js";
import {
  drawDials,
  drawHeightMarker,
  drawName,
  drawOutcome,
  drawTitle,
} from "touchdown/scene/dials.js";
import { LONGEST_NAME, shortened } from "touchdown/common/format.js";
import { ASPECT, contextOf, Frame, HEIGHT } from "touchdown/scene/frame.js";
import { Sprite } from "touchdown/scene/sprite.js";
import { heightAt } from "touchdown/scene/terrain.js";
import { drawTrail } from "touchdown/scene/trail.js";

/** @typedef {import("touchdown/scene/terrain.js").Terrain} Terrain */
/** @typedef {import("touchdown/scene/dials.js").Dials} Dials */
/**
 * @typedef {object} Craft a lander at one moment
 * @property {ArrayLike<number>} bodies [9]: hull, leg, leg, each x, y in metres, angle in radians
 * @property {Iterable<number>} engines actions whose engines are firing
 * @property {ArrayLike<ArrayLike<number>>} trail x, y in metres after each step, the latest last
 * @property {number} [opacity] 0 to 1
 * @property {string} [colour] CSS colour of its skirt, trail and name
 * @property {string} [label] its name
 * @property {Dials} [dials] shown for the first craft that has them
 * @property {string | null} [outcome] of a flight that has ended, such as "landed"
 */
/**
 * @typedef {object} DrawOptions
 * @property {boolean} [banner] whether the outcome of the craft with the dials is written over the
 *   scene; by default only where it is alone
 */

const LARGEST = 1600; // pixels of width; a backdrop takes time to paint

export class SceneView {
  /**
   * Draws on a canvas and follows its size on the page.
   * @param {HTMLCanvasElement} canvas
   */
  constructor(canvas) {
    this.canvas = canvas;
    this.context = contextOf(canvas);
    this.sprite = new Sprite();
    this.frame = new Frame(600);
    /** @type {{terrain: Terrain, seed: number} | null} */
    this.start = null;
    /** @type {HTMLCanvasElement | null} */
    this.backdrop = null;
    /** @type {[Craft[], DrawOptions] | null} */
    this.latest = null;
    canvas.style.aspectRatio = String(ASPECT);
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(canvas);
    this.resize();
  }

  /**
   * The start from which the next landers fly; the same start always looks the same.
   * @param {Terrain} terrain
   * @param {number} seed
   */
  setStart(terrain, seed) {
    this.start = { terrain, seed };
    this.backdrop = null;
    this.latest = null;
  }

  /**
   * @param {Craft[]} craft the last one is drawn over the others
   * @param {DrawOptions} [options]
   */
  draw(craft, options = {}) {
    if (!this.start) return;
    this.latest = [craft, options];
    const { context, frame } = this;
    const { terrain, seed } = this.start;
    this.backdrop ??= paintBackdrop(frame, terrain, seed);
    context.drawImage(this.backdrop, 0, 0);
    for (const each of craft) drawTrail(context, frame, each);
    for (const each of craft) {
      const [x = NaN, y = NaN] = Array.from({ length: 2 }, (_, i) => each.bodies[i]);
      const clearance = y - heightAt(terrain, x);
      this.sprite.draw(context, frame, { ...each, flicker: each.trail.length, clearance });
    }
    this.drawTexts(craft, options, seed);
  }

  /** Stops following the size of the canvas. */
  close() {
    this.observer.disconnect();
  }

  /**
   * @param {Craft[]} craft
   * @param {DrawOptions} options
   * @param {number} seed
   */
  drawTexts(craft, options, seed) {
    const { context, frame } = this;
    const writing = { context, frame, pixelRatio: frame.width / (this.canvas.clientWidth || 600) };
    const alone = craft.length === 1 ? craft[0] : undefined;
    drawTitle(writing, shortened(alone?.label ?? "", LONGEST_NAME), `start ${seed}`);
    /** @type {[number, number][]} */
    const taken = []; // where names are
    for (const each of [...craft].reverse()) {
      const hull = { x: Number(each.bodies[0]), y: Number(each.bodies[1]) };
      if (hull.y > HEIGHT + 0.6) drawHeightMarker(writing, hull, each.colour);
      if (!alone && each.label) {
        const name = shortened(each.label, LONGEST_NAME);
        taken.push(drawName(writing, hull, name, each.colour, taken));
      }
    }
    const shown = craft.find((each) => each.dials);
    if (shown?.dials) drawDials(writing, shown.dials, new Set(shown.engines));
    if (shown?.dials && shown.outcome && (options.banner ?? shown === alone)) {
      drawOutcome(writing, shown.outcome, shown.dials.return);
    }
  }

  resize() {
    const shown = this.canvas.clientWidth || 600;
    const width = Math.min(Math.round(shown * Math.min(devicePixelRatio, 3)), LARGEST);
    if (width === this.canvas.width && this.frame.width === width) return;
    this.frame = new Frame(width);
    this.canvas.width = width;
    this.canvas.height = this.frame.height;
    this.backdrop = null;
    if (this.latest) this.draw(...this.latest);
  }
}
