// The conditions of a flight: the environment's settings, and what goes wrong on board.
import { Generator } from "touchdown/common/generator.js";
import { IDLE } from "touchdown/play/commands.js";

/**
 * @typedef {object} Conditions
 * @property {number} gravity m/s², downwards
 * @property {number} wind wind power
 * @property {number} turbulence turbulence power
 * @property {number} faults probability that a firing engine does nothing at a step
 * @property {number} noise standard deviation of the autopilot's sensors, in units of observations
 */
/**
 * @typedef {object} Range
 * @property {keyof Conditions} name
 * @property {number} normal Gymnasium's value
 * @property {number} low
 * @property {number} high
 * @property {number} step
 */

/** @type {readonly Range[]} */
export const RANGES = [
  { name: "gravity", normal: 10, low: 0.5, high: 11.9, step: 0.1 },
  { name: "wind", normal: 0, low: 0, high: 20, step: 0.5 },
  { name: "turbulence", normal: 0, low: 0, high: 2, step: 0.1 },
  { name: "faults", normal: 0, low: 0, high: 0.5, step: 0.01 },
  { name: "noise", normal: 0, low: 0, high: 0.3, step: 0.01 },
];
const MEASURED = 6; // numbers of an observation that are measured; the others are contacts
const FAULTS_KEY = 11;
const NOISE_KEY = 12;

/** @returns {Conditions} */
export function normalConditions() {
  return { gravity: 10, wind: 0, turbulence: 0, faults: 0, noise: 0 };
}

/** @param {Conditions} conditions */
export function engineSettings({ gravity, wind, turbulence }) {
  return {
    gravity: -gravity,
    enableWind: wind > 0 || turbulence > 0,
    windPower: wind,
    turbulencePower: turbulence,
  };
}

/**
 * The action that the engines carry out: at a fault, nothing.
 * @param {Conditions} conditions
 * @param {number} seed of the start
 * @param {number} step
 * @param {number} action
 */
export function withFaults({ faults }, seed, step, action) {
  if (faults === 0 || action === IDLE) return action;
  return new Generator(seed, FAULTS_KEY, step).uniform() < faults ? IDLE : action;
}

/**
 * What the sensors measure.
 * @param {Conditions} conditions
 * @param {number} seed of the start
 * @param {number} step
 * @param {Float32Array} observation [8]
 * @returns {Float32Array} [8]
 */
export function withNoise({ noise }, seed, step, observation) {
  if (noise === 0) return observation;
  const generator = new Generator(seed, NOISE_KEY, step);
  return observation.map((value, i) => (i < MEASURED ? value + noise * generator.normal() : value));
}
