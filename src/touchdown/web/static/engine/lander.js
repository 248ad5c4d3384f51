/**
 * One lander.
 *
 * @typedef {object} Settings
 * @property {number} [gravity] Between -12 and 0, m/s².
 * @property {boolean} [enableWind]
 * @property {number} [windPower] Force of the wind, N.
 * @property {number} [turbulencePower] Torque of the wind, N m.
 *
 * @typedef {object} StepResult
 * @property {Float32Array} observation [8]
 * @property {number} reward
 * @property {boolean} terminated Whether the lander has crashed, left the screen or come to rest.
 * @property {boolean} truncated Whether the time limit of 1000 steps is reached.
 *
 * @typedef {"landed" | "crashed" | "out of bounds" | "timed out"} Outcome
 *
 * @typedef {object} Terrain The ground, in metres.
 * @property {Float64Array} xs [11] Corners of the surface, left to right.
 * @property {Float64Array} heights [11]
 * @property {number} helipadX1 The flag on the left.
 * @property {number} helipadX2 The flag on the right.
 * @property {number} helipadY
 */
import { seal, unseal } from "touchdown/engine/snapshot.js";

const DEFAULTS = { gravity: -10, enableWind: false, windPower: 15, turbulencePower: 1.5 };
const CORNERS = 11;
const WIDTH = 20; // of the ground, metres
const HEIGHT = 400 / 30; // of the screen, metres

/** @type {readonly (Outcome | null)[]} */
const OUTCOMES = [null, "landed", "crashed", "out of bounds", "timed out"];

// where the numbers are in a report of csrc/web/lander.cpp, in bytes
const REWARD = 0;
const TOTAL = 8;
const FUEL = 16;
const STEPS = 24;
const OUTCOME = 28;
const HEIGHTS = 32;
const OBSERVATION = 120;
const BODIES = 152;
const TERMINATED = 188;
const TRUNCATED = 192;

/**
 * LunarLander-v3 with discrete actions, as Gymnasium computes it. As there, it can be stepped on
 * after the end of an episode; step count, return, fuel and outcome then stay those of the end.
 */
export class Lander {
  #exports;
  #address;
  #started = false;
  #settings = DEFAULTS;

  /**
   * Made by `Engine.newLander`.
   *
   * @param {import("touchdown/engine/engine.js").Exports} exports
   * @param {Settings} settings
   */
  constructor(exports, settings) {
    const checked = check({ ...DEFAULTS, ...defined(settings) });
    this.#exports = exports;
    this.#address = exports.lander_new();
    this.#configure(checked);
  }

  /**
   * Start an episode, as Gymnasium's `reset(seed=seed)`.
   *
   * @param {number} seed A whole number from 0 to 2^53 - 1.
   * @returns {Float32Array} The first observation, [8].
   * @throws {Error} The seed is out of range.
   */
  reset(seed) {
    if (!Number.isSafeInteger(seed) || seed < 0) {
      throw new Error(`seed = ${seed}: must be a whole number from 0 to 2^53 - 1`);
    }
    this.#exports.lander_reset(this.#use(), seed >>> 0, Math.floor(seed / 2 ** 32));
    this.#started = true;
    return this.#floats(OBSERVATION, 8);
  }

  /**
   * Advance by one step, 1/50 s.
   *
   * @param {number} action 0 none, 1 left engine, 2 main engine, 3 right engine.
   * @returns {StepResult}
   * @throws {Error} It is no such number, or the lander was not reset.
   */
  step(action) {
    if (!(action === 0 || action === 1 || action === 2 || action === 3)) {
      throw new Error(`action = ${action}: must be a whole number from 0 to 3`);
    }
    this.#exports.lander_step(this.#flying(), action);
    const view = this.#view();
    return {
      observation: this.#floats(OBSERVATION, 8),
      reward: view.getFloat64(REWARD, true),
      terminated: view.getInt32(TERMINATED, true) !== 0,
      truncated: view.getInt32(TRUNCATED, true) !== 0,
    };
  }

  /** Steps of this episode. */
  get steps() {
    return this.#view().getInt32(STEPS, true);
  }

  /** The sum of this episode's rewards. */
  get episodeReturn() {
    return this.#view().getFloat64(TOTAL, true);
  }

  /** Return points spent on the engines in this episode. */
  get fuel() {
    return this.#view().getFloat64(FUEL, true);
  }

  /** How the episode ended; null while it has not. */
  get outcome() {
    return OUTCOMES[this.#view().getInt32(OUTCOME, true)] ?? null;
  }

  /**
   * Where hull, leg and leg are: x and y of their origins in metres, and their angles in radians.
   *
   * @returns {Float32Array} [9]: x, y, angle of each.
   * @throws {Error} The lander was not reset.
   */
  bodies() {
    this.#flying();
    return this.#floats(BODIES, 9);
  }

  /**
   * The ground of this episode.
   *
   * @returns {Terrain}
   * @throws {Error} The lander was not reset.
   */
  terrain() {
    const at = this.#flying() + HEIGHTS;
    const heights = new Float64Array(this.#exports.memory.buffer, at, CORNERS).slice();
    const chunk = WIDTH / (CORNERS - 1);
    const xs = Float64Array.from(heights, (_, corner) => chunk * corner);
    return { xs, heights, helipadX1: chunk * 4, helipadX2: chunk * 6, helipadY: HEIGHT / 4 };
  }

  /**
   * The whole state: physics, settings, random generator, step count and return.
   *
   * @returns {Uint8Array}
   * @throws {Error} The lander was not reset.
   */
  snapshot() {
    const { memory, allocate, release, lander_snapshot, snapshot_size } = this.#exports;
    const address = this.#flying();
    const size = snapshot_size();
    const block = allocate(size);
    lander_snapshot(address, block);
    const sealed = seal(new Uint8Array(memory.buffer, block, size));
    release(block);
    return sealed;
  }

  /**
   * Restore a snapshot exactly. The episode keeps the settings that it began with; this lander's own
   * settings apply from its next reset on. Nothing changes if the snapshot is refused.
   *
   * @param {Uint8Array} snapshot
   * @throws {Error} It is not a snapshot of this version of the engine, or it is damaged.
   */
  restore(snapshot) {
    const { memory, allocate, release, lander_restore, snapshot_size } = this.#exports;
    const address = this.#use();
    const content = unseal(snapshot, snapshot_size());
    const block = allocate(content.length);
    new Uint8Array(memory.buffer).set(content, block);
    const restored = lander_restore(address, block);
    release(block);
    if (!restored) throw new Error("the snapshot is damaged");
    this.#started = true;
  }

  /**
   * Change settings from the next reset on; those left out stay as they are.
   *
   * @param {Settings} settings
   * @throws {Error} A setting is out of range.
   */
  configure(settings) {
    this.#configure(check({ ...this.#settings, ...defined(settings) }));
  }

  /** Give its memory back. It cannot be used afterwards. */
  free() {
    if (this.#address) this.#exports.lander_free(this.#address);
    this.#address = 0;
  }

  /** @param {Required<Settings>} settings */
  #configure(settings) {
    const { gravity, enableWind, windPower, turbulencePower } = settings;
    const wind = Number(enableWind);
    this.#exports.lander_configure(this.#use(), gravity, wind, windPower, turbulencePower);
    this.#settings = settings;
  }

  #use() {
    if (!this.#address) throw new Error("the lander was freed");
    return this.#address;
  }

  #flying() {
    if (!this.#started) throw new Error("reset the lander first");
    return this.#use();
  }

  #view() {
    return new DataView(this.#exports.memory.buffer, this.#use());
  }

  /**
   * A copy.
   *
   * @param {number} offset
   * @param {number} count
   */
  #floats(offset, count) {
    return new Float32Array(this.#exports.memory.buffer, this.#use() + offset, count).slice();
  }
}

/**
 * Settings without those that are undefined.
 *
 * @param {Settings} settings
 * @returns {Settings}
 */
function defined(settings) {
  return Object.fromEntries(Object.entries(settings).filter(([, value]) => value !== undefined));
}

/**
 * @param {Required<Settings>} settings
 * @returns {Required<Settings>}
 */
function check(settings) {
  const unknown = Object.keys(settings).find((name) => !Object.hasOwn(DEFAULTS, name));
  if (unknown !== undefined) throw new Error(`unknown setting ${JSON.stringify(unknown)}`);
  const { gravity, enableWind, windPower, turbulencePower } = settings;
  if (!(gravity > -12 && gravity < 0)) {
    throw new Error(`gravity = ${gravity}: must be between -12 and 0`);
  }
  if (typeof enableWind !== "boolean") {
    throw new Error(`enableWind = ${enableWind}: must be true or false`);
  }
  for (const [name, value] of Object.entries({ windPower, turbulencePower })) {
    if (!Number.isFinite(value)) throw new Error(`${name} = ${value}: must be a finite number`);
  }
  return { gravity, enableWind, windPower, turbulencePower };
}
