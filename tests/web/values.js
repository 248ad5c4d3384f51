// What a policy does for given observations.
import { fromBase64 } from "tests/base64.js";
import { loadEngine } from "touchdown/engine/engine.js";
import { HeuristicPolicy } from "touchdown/policies/heuristic.js";
import { PidPolicy, TUNED } from "touchdown/policies/pid.js";

/** @param {number[][]} rows */
function toObservations(rows) {
  return rows.map((row) => Float32Array.from(row));
}

/**
 * The values, actions and activations of several networks for each observation.
 *
 * @param {{module: string, files: string[], observations: number[][]}} request
 */
export async function ofNetworks({ module, files, observations }) {
  const engine = await loadEngine(fromBase64(module));
  return files.map((file) => {
    const network = engine.newNetwork(fromBase64(file));
    const rows = toObservations(observations).map((observation) => ({
      action: network.act(observation),
      values: [...network.values(observation)],
      activations: network.activations().map((layer) => [...layer]),
    }));
    network.free();
    const { name, layerSizes, rewardScale } = network;
    return { name, layerSizes, rewardScale, rows };
  });
}

/**
 * What `newNetwork` says of each of several files; null if it takes one.
 *
 * @param {{module: string, files: string[]}} request
 */
export async function complaints({ module, files }) {
  const engine = await loadEngine(fromBase64(module));
  return files.map((file) => {
    try {
      engine.newNetwork(fromBase64(file)).free();
      return null;
    } catch (error) {
      return String(error);
    }
  });
}

/**
 * The actions of the controllers for each observation.
 *
 * @param {{observations: number[][]}} request
 */
export function ofControllers({ observations }) {
  const policies = {
    heuristic: new HeuristicPolicy(),
    signed: new PidPolicy(TUNED.signed),
    absolute: new PidPolicy(TUNED.absolute),
  };
  return Object.fromEntries(Object.entries(policies).map(([name, policy]) =>
    [name, toObservations(observations).map((observation) => policy.act(observation))]));
}
