/**
 * Reads and checks a file of a network's weights.
 *
 * @typedef {object} Network What a file of weights says about its network; see NetworkConfig in
 *   touchdown.config.sections.
 * @property {number[]} hidden_sizes
 * @property {"relu" | "tanh" | "silu"} activation
 * @property {boolean} dueling
 * @property {boolean} layer_norm
 * @property {number} quantiles
 * @property {number} atoms
 * @property {number} v_min
 * @property {number} v_max
 * @property {boolean} noisy
 * @property {number} noisy_sigma Of use only in training.
 *
 * @typedef {object} Contents
 * @property {Network} network
 * @property {Float32Array} params [P], in the order of the module.
 * @property {string | undefined} preset That trained the network.
 * @property {number} rewardScale The factor of the rewards that the values estimate; 1 if the file
 *   does not say.
 */
import { parse } from "touchdown/engine/safetensors.js";

const ENV_ID = "LunarLander-v3";
const FORMAT_VERSION = "2";
export const INPUTS = 8;
export const ACTIONS = 4;
/** In the order of the module. */
export const ACTIVATIONS = ["relu", "tanh", "silu"];
/** @type {Readonly<Network>} */
const DEFAULTS = {
  hidden_sizes: [100, 100, 100],
  activation: "relu",
  dueling: false,
  layer_norm: false,
  quantiles: 0,
  atoms: 0,
  v_min: -10,
  v_max: 10,
  noisy: false,
  noisy_sigma: 0.5,
};
const MOST_LAYERS = 16;
const MOST_NODES = 100_000;

/**
 * @param {ArrayBuffer | Uint8Array} file
 * @returns {Contents}
 * @throws {Error} It is no file of weights for the lander; one line says why.
 */
export function readNetwork(file) {
  const { tensors, metadata } = parse(file);
  const network = networkOf(metadata);
  const params = paramsOf(network, tensors);
  return { network, params, preset: metadata.preset, rewardScale: rewardScaleOf(metadata) };
}

/**
 * @param {Record<string, string>} metadata
 * @returns {Network}
 */
function networkOf(metadata) {
  if (metadata.format_version !== FORMAT_VERSION) {
    const given = JSON.stringify(metadata.format_version) ?? "missing";
    throw refusal(`format_version = ${given}: must be "${FORMAT_VERSION}"`);
  }
  if (metadata.env_id !== ENV_ID) {
    throw refusal(`env_id = ${JSON.stringify(metadata.env_id)}: must be "${ENV_ID}"`);
  }
  if (metadata.network === undefined) throw refusal("it describes no network");
  /** @type {unknown} */
  let given;
  try {
    given = JSON.parse(metadata.network);
  } catch {
    throw refusal("its description of the network is not JSON");
  }
  if (typeof given !== "object" || given === null) {
    throw refusal("its description of the network is not a JSON object");
  }
  const unknown = Object.keys(given).find((name) => !Object.hasOwn(DEFAULTS, name));
  if (unknown !== undefined) throw refusal(`unknown field ${JSON.stringify(unknown)}`);
  const network = { ...DEFAULTS, ...given };
  const wrong = complaint(network);
  if (wrong) throw refusal(wrong);
  return network;
}

/** @param {Record<string, string>} metadata */
function rewardScaleOf({ reward_scale: text = "1" }) {
  const scale = Number(text);
  if (!(scale > 0 && scale < Infinity)) {
    throw refusal(`reward_scale = ${JSON.stringify(text)}: must be a number above 0`);
  }
  return scale;
}

/** @param {string} why */
function refusal(why) {
  return new Error(`not a policy's weights for the lander: ${why}`);
}

/**
 * What is wrong with a description from a file; null if nothing.
 *
 * @param {Network} network
 */
function complaint(network) {
  const isCount = (/** @type {number} */ value) =>
    Number.isInteger(value) && value >= 0 && value <= MOST_NODES;
  const sizes = network.hidden_sizes;
  if (!Array.isArray(sizes) || !sizes.every((size) => isCount(size) && size > 0)) {
    return `hidden_sizes = ${JSON.stringify(sizes)}: must be from 1 to ${MOST_NODES} nodes each`;
  }
  if (sizes.length > MOST_LAYERS) {
    return `hidden_sizes: has ${sizes.length} layers, must be at most ${MOST_LAYERS} here`;
  }
  if (!ACTIVATIONS.includes(network.activation)) {
    return `activation = ${JSON.stringify(network.activation)}: must be ${ACTIVATIONS.join(", ")}`;
  }
  for (const name of /** @type {const} */ (["dueling", "layer_norm", "noisy"])) {
    if (typeof network[name] !== "boolean") return `${name}: must be true or false`;
  }
  const { quantiles, atoms, v_min: low, v_max: high } = network;
  if (!isCount(quantiles)) return `quantiles = ${quantiles}: must be from 0 to ${MOST_NODES}`;
  if (!isCount(atoms) || atoms === 1) {
    return `atoms = ${atoms}: must be 0 or from 2 to ${MOST_NODES}`;
  }
  if (atoms && quantiles) return `atoms = ${atoms}: must be 0 with quantiles = ${quantiles}`;
  if (!(Number.isFinite(low) && Number.isFinite(high) && Math.fround(low) < Math.fround(high))) {
    return `v_min = ${low}: must be below v_max = ${high}`;
  }
  return null;
}

/**
 * The names and shapes of the parameters that the greedy policy uses, in the module's order; see
 * touchdown.agents.layout.
 *
 * @param {Network} network
 * @returns {[name: string, shape: number[]][]}
 */
function layoutOf(network) {
  /** @type {[string, number[]][]} */
  const layout = [];
  const linear = (/** @type {string} */ name, /** @type {number} */ from, /** @type {number} */ to) =>
    layout.push([`${name}.weight`, [to, from]], [`${name}.bias`, [to]]);
  let last = INPUTS;
  network.hidden_sizes.forEach((size, number) => {
    linear(`layers.${number}`, last, size);
    if (network.layer_norm) {
      layout.push([`norms.${number}.weight`, [size]], [`norms.${number}.bias`, [size]]);
    }
    last = size;
  });
  const outputs = Math.max(1, network.quantiles, network.atoms);
  if (network.dueling) linear("value", last, outputs);
  const head = network.dueling ? "advantage" : `layers.${network.hidden_sizes.length}`;
  linear(head, last, ACTIONS * outputs);
  return layout;
}

/**
 * @param {Network} network
 * @param {Map<string, import("touchdown/engine/safetensors.js").Tensor>} tensors
 * @returns {Float32Array} [P].
 */
function paramsOf(network, tensors) {
  const layout = layoutOf(network);
  const noise = network.noisy
    ? layout.flatMap(([name]) => (name.startsWith("norms.") ? [] : [`${name}_sigma`]))
    : [];
  const wanted = [...layout.map(([name]) => name), ...noise];
  const unknown = [...tensors.keys()].find((name) => !wanted.includes(name));
  if (unknown !== undefined) throw refusal(`${unknown}: is not part of the network`);
  const missing = wanted.find((name) => !tensors.has(name));
  if (missing !== undefined) throw refusal(`${missing}: missing`);
  const parts = layout.map(([name, shape]) => {
    const tensor = tensors.get(name);
    if (tensor?.dtype !== "F32" || tensor.shape.join() !== shape.join()) {
      throw refusal(`${name} is ${tensor?.dtype}[${tensor?.shape}], must be F32[${shape}]`);
    }
    const numbers = /** @type {Float32Array} */ (tensor.data);
    if (!numbers.every(Number.isFinite)) throw refusal(`${name} has numbers that are not finite`);
    return numbers;
  });
  const params = new Float32Array(parts.reduce((total, part) => total + part.length, 0));
  let at = 0;
  for (const part of parts) {
    params.set(part, at);
    at += part.length;
  }
  return params;
}
