// A flight as the part of a URL after #, and back.
import { decodeCommands, encodeCommands } from "touchdown/play/commands.js";
import { normalConditions, RANGES } from "touchdown/play/conditions.js";
import { Generator } from "touchdown/common/generator.js";

/** @typedef {import("touchdown/play/conditions.js").Conditions} Conditions */
/**
 * @typedef {object} Setup what determines the flights
 * @property {number} seed of the start
 * @property {boolean} byHand whether the lead begins with its autopilot off
 * @property {string} autopilot of the lead
 * @property {string[]} rivals
 * @property {Conditions} conditions
 */
/**
 * @typedef {object} Shared
 * @property {Setup} setup
 * @property {number[]} commands of the lead
 * @property {string | null} check of how the flights went on the page that made the link
 */

export const MAX_SEED = 2 ** 31 - 1;
/** Who flies by hand, in a link. */
export const YOU = "you";
const DIGITS = 1e4; // of conditions in a link

/**
 * @param {Setup} setup
 * @param {ArrayLike<number>} commands
 * @param {string | null} check
 */
export function writeLink(setup, commands, check) {
  const { seed, byHand, autopilot, rivals, conditions } = setup;
  const fields = new URLSearchParams({ start: String(seed) });
  fields.set("by", byHand ? YOU : autopilot);
  if (byHand) fields.set("autopilot", autopilot);
  for (const name of rivals) fields.append("against", name);
  for (const { name, normal } of RANGES) {
    if (conditions[name] !== normal) fields.set(name, String(conditions[name]));
  }
  if (commands.length > 0) fields.set("flight", encodeCommands(commands));
  if (commands.length > 0 && check) fields.set("check", check);
  return fields.toString();
}

/**
 * @param {string} hash with or without its #
 * @returns {Shared | null} null if it is empty
 * @throws {RangeError} in words for the reader, if a field is wrong
 */
export function readLink(hash) {
  const text = hash.replace(/^#/, "");
  if (text === "") return null;
  const fields = new URLSearchParams(text);
  const start = fields.get("start");
  if (start === null) throw new RangeError("it has no start");
  const seed = Number(start);
  if (!/^\d+$/.test(start) || seed > MAX_SEED) {
    throw new RangeError(`start ${start} is not a whole number from 0 to ${MAX_SEED}`);
  }
  const conditions = normalConditions();
  for (const { name, low, high } of RANGES) {
    const given = fields.get(name);
    if (given === null) continue;
    const value = Math.round(Number(given) * DIGITS) / DIGITS;
    if (!(value >= low && value <= high)) {
      throw new RangeError(`${name} ${given} is not a number from ${low} to ${high}`);
    }
    conditions[name] = value;
  }
  /** @type {number[]} */
  let commands = [];
  try {
    commands = decodeCommands(fields.get("flight") ?? "");
  } catch {
    throw new RangeError("the flight in this link is damaged");
  }
  const by = fields.get("by") ?? YOU;
  const byHand = by === YOU;
  const autopilot = (byHand ? fields.get("autopilot") : by) ?? "";
  const rivals = [...new Set(fields.getAll("against"))];
  const setup = { seed, byHand, autopilot, rivals, conditions };
  return { setup, commands, check: fields.get("check") };
}

/**
 * A digest of the last states of flights: equal only if they went the same way.
 * @param {readonly import("touchdown/play/flight.js").Flight[]} flights
 */
export function checkOf(flights) {
  const bits = flights.flatMap((flight) => {
    const { observation, return: episodeReturn } = flight.at(flight.steps);
    const numbers = new Uint32Array(new Float64Array([...observation, episodeReturn]).buffer);
    return [flight.steps, ...numbers];
  });
  return new Generator(...bits).integer().toString(36);
}
