// Uses of a lander, each under the name of what it shows.
import { fromBase64 } from "tests/base64.js";
import { Engine, loadEngine } from "touchdown/engine/engine.js";
import { HeuristicPolicy } from "touchdown/policies/heuristic.js";

/** @import { Exports, Lander } from "touchdown/engine/engine.js" */

/** @type {Record<string, (engine: Engine, memory: WebAssembly.Memory) => unknown>} */
const USES = {
  aSnapshotContinues(engine) {
    const lander = engine.newLander({ enableWind: true });
    lander.reset(5);
    fly(lander, 60);
    const saved = lander.snapshot();
    const steps = lander.steps;
    const expected = trace(lander);
    const other = engine.newLander({ gravity: -3 });
    other.restore(saved);
    const restoredSteps = other.steps;
    const restored = trace(other);
    lander.reset(9);
    lander.restore(saved);
    return { steps, restoredSteps, expected, restored, again: trace(lander) };
  },
  aSnapshotHasTheEnd(engine) {
    const lander = engine.newLander();
    lander.reset(1);
    fly(lander, 1000);
    const saved = lander.snapshot();
    const end = [lander.outcome, lander.steps, lander.episodeReturn, lander.fuel];
    lander.reset(0);
    lander.restore(saved);
    return [end, [lander.outcome, lander.steps, lander.episodeReturn, lander.fuel]];
  },
  settingsChangeAtTheNextReset(engine) {
    const lander = engine.newLander();
    lander.reset(3);
    fly(lander, 5);
    const saved = lander.snapshot();
    lander.configure({ gravity: -2 });
    const same = trace(lander);
    lander.restore(saved);
    const afterRestoring = trace(lander);
    const first = lander.reset(3);
    const changed = trace(lander);
    const fresh = engine.newLander({ gravity: -2 });
    const expectedFirst = fresh.reset(3);
    return {
      same, afterRestoring, changed, expected: trace(fresh),
      first: [...first], expectedFirst: [...expectedFirst],
    };
  },
  theEndStays(engine) {
    const lander = engine.newLander();
    lander.reset(1);
    fly(lander, 1000);
    const end = [lander.outcome, lander.steps, lander.episodeReturn, lander.fuel];
    const before = [...lander.bodies()];
    for (let i = 0; i < 5; i++) lander.step(2);
    return [end, [lander.outcome, lander.steps, lander.episodeReturn, lander.fuel],
      before, [...lander.bodies()]];
  },
  resultsAreOnesOwn(engine) {
    const lander = engine.newLander();
    const first = lander.reset(0);
    const copy = [...first];
    const bodies = lander.bodies();
    const bodiesBefore = [...bodies];
    const result = lander.step(2);
    return { kept: [...first], copy, differs: [...result.observation],
      bodies: [...bodies], bodiesBefore };
  },
  manyLandersFlyApart(engine) {
    const landers = Array.from({ length: 300 }, () => engine.newLander());
    landers.forEach((lander, seed) => lander.reset(seed % 3));
    const traces = landers.map((lander) => trace(lander, 30));
    landers.forEach((lander) => lander.free());
    return traces.map((all) => JSON.stringify(all)).filter((text, i, all) => all.indexOf(text) === i)
      .length;
  },
  freedMemoryIsUsedAgain(engine, memory) {
    const live = () => {
      const lander = engine.newLander();
      lander.reset(0);
      lander.restore(lander.snapshot());
      lander.free();
    };
    live();
    const before = memory.buffer.byteLength;
    for (let i = 0; i < 2000; i++) live();
    return memory.buffer.byteLength - before;
  },
};

/** @type {Record<string, (engine: Engine, lander: Lander) => unknown>} */
const MISUSES = {
  "gravity = 0: must be between -12 and 0": (engine) => engine.newLander({ gravity: 0 }),
  "gravity = NaN: must be between": (_, lander) => lander.configure({ gravity: NaN }),
  "windPower = Infinity: must be a finite": (engine) => engine.newLander({ windPower: Infinity }),
  "enableWind = 1: must be true or false": (_, lander) =>
    lander.configure({ enableWind: /** @type {any} */ (1) }),
  "unknown setting \"wind\"": (_, lander) => lander.configure(/** @type {any} */ ({ wind: true })),
  "seed = -1: must be a whole number": (_, lander) => lander.reset(-1),
  "seed = 0.5: must be a whole number": (_, lander) => lander.reset(0.5),
  "seed = 9007199254740992: must be": (_, lander) => lander.reset(2 ** 53),
  "action = 4: must be a whole number from 0 to 3": (_, lander) => lander.step(4),
  "action = 1.5: must be": (_, lander) => lander.step(1.5),
  "action = undefined: must be": (_, lander) => lander.step(/** @type {any} */ (undefined)),
  "reset the lander first": (engine) => engine.newLander().step(0),
  "reset the lander first ": (engine) => engine.newLander().bodies(),
  "reset the lander first  ": (engine) => engine.newLander().snapshot(),
  "not a snapshot of a lander": (_, lander) => lander.restore(new Uint8Array(9)),
  "the snapshot is damaged": (_, lander) => lander.restore(lander.snapshot().subarray(0, 99)),
  "the snapshot is damaged ": (_, lander) => {
    const saved = lander.snapshot();
    saved.set([1 ^ (saved.at(-100) ?? 0)], saved.length - 100);
    lander.restore(saved);
  },
  "another version of the engine": (_, lander) => {
    const saved = lander.snapshot();
    saved.set([99], 8);
    lander.restore(saved);
  },
  "the lander was freed": (engine) => {
    const other = engine.newLander();
    other.reset(0);
    other.free();
    other.free();
    other.step(0);
  },
};

/**
 * @param {Lander} lander
 * @param {number} steps
 */
function fly(lander, steps) {
  const policy = new HeuristicPolicy();
  let observation = lander.step(0).observation;
  for (let i = 1; i < steps && lander.outcome === null; i++) {
    observation = lander.step(policy.act(observation)).observation;
  }
}

/**
 * What a lander says over the next steps.
 *
 * @param {Lander} lander
 */
function trace(lander, steps = 200) {
  const said = [];
  for (let i = 0; i < steps; i++) {
    const { observation, reward, terminated, truncated } = lander.step((i >> 2) % 4);
    said.push([...observation, reward, terminated, truncated, lander.steps, lander.episodeReturn,
      lander.fuel, lander.outcome, ...lander.bodies()]);
  }
  return said;
}

/** @param {{module: string, name: string}} request */
export async function use({ module, name }) {
  const { instance } = await WebAssembly.instantiate(fromBase64(module), {});
  const exports = /** @type {Exports} */ (/** @type {unknown} */ (instance.exports));
  exports._initialize();
  return USES[name]?.(new Engine(exports), exports.memory);
}

/**
 * What is expected and what is said of each misuse, and whether the lander flies on as before.
 *
 * @param {{module: string}} request
 */
export async function misuse({ module }) {
  const engine = await loadEngine(fromBase64(module));
  return Object.entries(MISUSES).map(([expected, misused]) => {
    const lander = engine.newLander();
    const untouched = engine.newLander();
    lander.reset(1);
    untouched.reset(1);
    let said = "nothing";
    try {
      misused(engine, lander);
    } catch (error) {
      said = /** @type {Error} */ (error).message;
    }
    const unharmed = JSON.stringify(trace(lander)) === JSON.stringify(trace(untouched));
    return { expected: expected.trim(), said, unharmed };
  });
}
