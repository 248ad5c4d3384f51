// One lander's flight from a start, recorded step by step.
import { actionOf, AUTOPILOT, IDLE } from "touchdown/play/commands.js";
import { engineSettings, withFaults, withNoise } from "touchdown/play/conditions.js";

/** @typedef {import("touchdown/engine/engine.js").Engine} Engine */
/** @typedef {import("touchdown/policies/policy.js").Policy} Policy */
/** @typedef {import("touchdown/play/conditions.js").Conditions} Conditions */
/**
 * @typedef {object} FlightState the flight after a number of steps
 * @property {Float32Array} bodies [9]: hull, leg, leg, each x, y in metres, angle in radians
 * @property {Float32Array} observation [8]
 * @property {number} action that led here: what the engines did
 * @property {number} return so far
 * @property {number} fuel return points spent on the engines
 */

export class Flight {
  /**
   * @param {Engine} engine
   * @param {object} plan
   * @param {string} plan.name
   * @param {number} plan.seed
   * @param {Conditions} plan.conditions
   * @param {Policy | null} plan.autopilot null does nothing
   */
  constructor(engine, { name, seed, conditions, autopilot }) {
    this.name = name;
    this.seed = seed;
    this.conditions = conditions;
    this.autopilot = autopilot;
    this.lander = engine.newLander(engineSettings(conditions));
    /** @type {FlightState[]} after 0, 1, 2, ... steps */
    this.states = [];
    /** @type {[number, number][]} x, y of the hull in metres in each state */
    this.path = [];
    /** @type {number[]} */
    this.commands = [];
    /** @type {import("touchdown/engine/lander.js").Outcome | null} */
    this.outcome = null;
    this.reset();
    this.terrain = this.lander.terrain();
  }

  /** Steps flown. */
  get steps() {
    return this.commands.length;
  }

  get over() {
    return this.outcome !== null;
  }

  /** Whether a person commanded at least one step. */
  get byHand() {
    return this.commands.some((command) => command !== AUTOPILOT);
  }

  /**
   * @param {number} step
   * @returns {FlightState} the last one if the flight was shorter
   */
  at(step) {
    const state = this.states[Math.min(step, this.steps)];
    if (!state) throw new RangeError(`step ${step} of ${this.steps}`);
    return state;
  }

  /**
   * What the autopilot sees after `step` steps.
   * @param {number} step
   */
  seen(step) {
    return withNoise(this.conditions, this.seed, step, this.at(step).observation);
  }

  /**
   * One step, unless the flight is over.
   * @param {number} command
   */
  fly(command) {
    if (this.over) return;
    const step = this.steps;
    let action = IDLE;
    if (command !== AUTOPILOT) action = actionOf(command, step);
    else if (this.autopilot) action = this.autopilot.act(this.seen(step));
    const done = withFaults(this.conditions, this.seed, step, action);
    const { observation } = this.lander.step(done);
    this.commands.push(command);
    this.record(observation, done);
    this.outcome = this.lander.outcome ?? null;
  }

  /**
   * Goes back to a step and forgets what came later.
   * @param {number} step
   */
  rewind(step) {
    const commands = this.commands.slice(0, step);
    this.reset();
    // flown again: the lander and the autopilot are then as they were
    for (const command of commands) this.fly(command);
  }

  /** Frees the memory of its lander. */
  close() {
    this.lander.free();
  }

  reset() {
    this.states = [];
    this.path = [];
    this.commands = [];
    this.outcome = null;
    this.autopilot?.reset?.();
    this.record(this.lander.reset(this.seed), IDLE);
  }

  /**
   * @param {Float32Array} observation
   * @param {number} action
   */
  record(observation, action) {
    const bodies = this.lander.bodies().slice();
    this.states.push({
      bodies,
      observation: observation.slice(),
      action,
      return: this.lander.episodeReturn,
      fuel: this.lander.fuel,
    });
    this.path.push([Number(bodies[0]), Number(bodies[1])]);
  }
}
