// What a person tells the lander to do at each step, and its short form for a link.
import { LEFT_ENGINE, MAIN_ENGINE, RIGHT_ENGINE } from "touchdown/common/actions.js";

export const IDLE = 0;
/** Commands below 4 are the lander's actions; this one leaves the action to the autopilot. */
export const AUTOPILOT = 4;
/** Two engines are held, but only one may fire at a step: they take turns. */
const MAIN_AND_LEFT = 5;
const MAIN_AND_RIGHT = 6;
const NUM_COMMANDS = 7;

/** Steps after which an episode is truncated. */
export const MAX_STEPS = 1000;

/**
 * The command of the engines that a person holds.
 * @param {ReadonlySet<number>} held actions
 */
export function commandOf(held) {
  const side = Number(held.has(RIGHT_ENGINE)) - Number(held.has(LEFT_ENGINE));
  if (!held.has(MAIN_ENGINE)) return side < 0 ? LEFT_ENGINE : side > 0 ? RIGHT_ENGINE : IDLE;
  return side < 0 ? MAIN_AND_LEFT : side > 0 ? MAIN_AND_RIGHT : MAIN_ENGINE;
}

/**
 * The action that a command asks for at a step.
 * @param {number} command any but AUTOPILOT
 * @param {number} step
 */
export function actionOf(command, step) {
  if (command < AUTOPILOT) return command;
  if (step % 2 === 0) return MAIN_ENGINE;
  return command === MAIN_AND_LEFT ? LEFT_ENGINE : RIGHT_ENGINE;
}

/**
 * Commands as text for a URL. Each run of equal commands is one number, command + 7 · (length - 1),
 * in groups of seven bits, the lowest first; the bytes are base64url.
 * @param {ArrayLike<number>} commands
 */
export function encodeCommands(commands) {
  /** @type {number[]} */
  const bytes = [];
  for (let first = 0; first < commands.length; ) {
    let last = first + 1;
    while (last < commands.length && commands[last] === commands[first]) last += 1;
    let value = Number(commands[first]) + NUM_COMMANDS * (last - first - 1);
    for (; value > 127; value >>>= 7) bytes.push((value & 127) | 128);
    bytes.push(value);
    first = last;
  }
  const encoded = btoa(String.fromCharCode(...bytes));
  return encoded.replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}

/**
 * @param {string} text as `encodeCommands` wrote it
 * @returns {number[]}
 * @throws {RangeError} if it is damaged
 */
export function decodeCommands(text) {
  if (!/^[\w-]*$/.test(text) || text.length % 4 === 1) throw new RangeError("not base64url");
  const bytes = atob(text.replaceAll("-", "+").replaceAll("_", "/"));
  /** @type {number[]} */
  const commands = [];
  let value = 0;
  let shift = 0;
  for (const character of bytes) {
    const byte = character.charCodeAt(0);
    value += (byte & 127) * 2 ** shift;
    shift += 7;
    if (byte > 127) {
      if (shift > 14) throw new RangeError("a number of more than two bytes");
      continue;
    }
    const length = Math.floor(value / NUM_COMMANDS) + 1;
    if (commands.length + length > MAX_STEPS) throw new RangeError("more steps than an episode has");
    for (let i = 0; i < length; i++) commands.push(value % NUM_COMMANDS);
    value = 0;
    shift = 0;
  }
  if (shift > 0) throw new RangeError("it ends within a number");
  return commands;
}
