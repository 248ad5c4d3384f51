// Plays the playground's games without a page.
import { base64, fromBase64 } from "tests/base64.js";
import { decodeCommands, encodeCommands } from "touchdown/play/commands.js";
import { normalConditions, withFaults, withNoise } from "touchdown/play/conditions.js";
import { loadEngine } from "touchdown/engine/engine.js";
import { Game } from "touchdown/play/game.js";
import { checkOf, readLink, writeLink } from "touchdown/play/link.js";
import { makePolicies } from "touchdown/policies/registry.js";

const POLICIES = /** @type {const} */ ([
  { name: "ace", kind: "network" },
  { name: "pid", kind: "pid" },
  { name: "random", kind: "random" },
]);

/** @param {{commands: number[]}[]} request */
export function roundTrips(request) {
  return request.map(({ commands }) => {
    const text = encodeCommands(commands);
    return { text, commands: decodeCommands(text) };
  });
}

/** @param {string[]} links */
export function readings(links) {
  return links.map((link) => {
    try {
      return readLink(link);
    } catch (error) {
      return error instanceof RangeError ? error.message : `wrong kind of error: ${error}`;
    }
  });
}

/** @param {{faults: number, noise: number, seed: number, steps: number}} request */
export function disturbances({ seed, steps, ...disturbed }) {
  const conditions = { ...normalConditions(), ...disturbed };
  const observation = Float32Array.of(0, 0, 0, 0, 0, 0, 1, 0);
  const rows = Array.from({ length: steps }, (_, step) => ({
    actions: [0, 2].map((action) => withFaults(conditions, seed, step, action)),
    seen: [...withNoise(conditions, seed, step, observation)],
  }));
  return rows;
}

/**
 * Plays games, each by a script of what a person does.
 * @param {object} request
 * @param {string} request.module lander.wasm
 * @param {string} request.ace its weights
 * @param {{link: string, script: [string, number][]}[]} request.games what a person does, each with
 *   a number: "hold" a command for so many steps of 1/50 s (command · 1000 + steps), "release" for
 *   so many, "seek" a step, "autopilot", "frames" of so many milliseconds to the end
 */
export async function play({ module, ace, games }) {
  const engine = await loadEngine(fromBase64(module));
  const policies = makePolicies(engine, [...POLICIES], () => fromBase64(ace));
  return games.map(({ link, script }) => {
    const shared = readLink(link);
    if (!shared) throw new Error("no link");
    /** @type {string[]} */
    const events = [];
    const game = new Game(engine, policies, shared.setup, (event) => events.push(event));
    game.begin(shared.setup, shared.commands);
    game.play();
    for (const [deed, number] of script) act(game, deed, number);
    return reportOf(game, events, shared.setup);
  });
}

/**
 * @param {Game} game
 * @param {string} deed
 * @param {number} number
 */
function act(game, deed, number) {
  if (deed === "hold") {
    game.takeOver();
    for (let i = 0; i < number % 1000; i++) game.tick(0.02, Math.floor(number / 1000));
  } else if (deed === "release") {
    for (let i = 0; i < number; i++) game.tick(0.02, null);
  } else if (deed === "seek") {
    game.seek(number);
  } else if (deed === "step") {
    game.step(number);
  } else if (deed === "tick") {
    game.tick(number / 1000, null);
  } else if (deed === "autopilot") {
    game.toggleAutopilot();
  } else {
    if (!game.playing && !game.race.over) game.play();
    for (let i = 0; i < 100_000 && game.playing; i++) game.tick(number / 1000, null);
  }
}

/**
 * @param {Game} game
 * @param {string[]} events
 * @param {import("touchdown/play/link.js").Setup} setup
 */
function reportOf(game, events, setup) {
  const { flights, lead, step } = game.race;
  return {
    events,
    step,
    flownBy: game.flownBy,
    engaged: game.engaged,
    link: writeLink(setup, lead.commands, checkOf(flights)),
    flights: flights.map((flight) => ({
      name: flight.name,
      outcome: flight.outcome,
      commands: flight.commands,
      actions: flight.states.slice(1).map((state) => state.action),
      returns: flight.states.map((state) => state.return),
      observations: base64(
        new Uint8Array(Float32Array.from(flight.states.flatMap((state) => [...state.observation])).buffer),
      ),
    })),
  };
}
