/**
 * The greedy policy of a network.
 */
/** @import { Policy } from "touchdown/policies/policy.js" */
import { ACTIONS, ACTIVATIONS, INPUTS, readNetwork } from "touchdown/engine/network-file.js";

/**
 * Flies by a network's values, computed in single precision; noisy weights by their means.
 *
 * @implements {Policy}
 */
export class NetworkPolicy {
  #exports;
  #address;

  /**
   * Made by `Engine.newNetwork`.
   *
   * @param {import("touchdown/engine/engine.js").Exports} exports
   * @param {ArrayBuffer | Uint8Array} file
   */
  constructor(exports, file) {
    const { network, params, preset, rewardScale } = readNetwork(file);
    /** The preset that the policy was trained with. */
    this.name = preset ?? "network";
    /** The factor of the rewards that the values estimate. */
    this.rewardScale = rewardScale;
    /** Inputs, units of each hidden layer, and actions. */
    this.layerSizes = [INPUTS, ...network.hidden_sizes, ACTIONS];
    this.#exports = exports;
    this.#address = create(exports, network);
    const at = exports.network_params(this.#address);
    new Float32Array(exports.memory.buffer, at, params.length).set(params);
    exports.network_load(this.#address);
  }

  /**
   * @param {Float32Array} observation [8].
   * @returns {number} The action with the highest value, the first of equal ones.
   * @throws {Error} A value is not finite.
   */
  act(observation) {
    const values = this.values(observation);
    return values.indexOf(Math.max(...values));
  }

  /**
   * Q(s,·): the return that the network expects after each action, times `rewardScale`.
   *
   * @param {Float32Array} observation [8].
   * @returns {Float32Array} [4].
   * @throws {Error} A value is not finite.
   */
  values(observation) {
    const { memory, network_observation, network_run, network_values } = this.#exports;
    const address = this.#use();
    const inputs = new Float32Array(memory.buffer, network_observation(address), INPUTS);
    inputs.set(observation);
    network_run(address);
    const values = new Float32Array(memory.buffer, network_values(address), ACTIONS).slice();
    if (!values.every(Number.isFinite)) {
      const wrong = Array.from(observation).join(", ");
      throw new Error(`the policy's values are not finite for the observation ${wrong}`);
    }
    return values;
  }

  /**
   * The hidden layers' outputs, after the activation function, for the last observation.
   *
   * @returns {Float32Array[]} One for each hidden layer.
   */
  activations() {
    const address = this.#use();
    const { memory, network_features } = this.#exports;
    return this.layerSizes.slice(1, -1).map((size, layer) =>
      new Float32Array(memory.buffer, network_features(address, layer), size).slice());
  }

  /** Give its memory back. It cannot be used afterwards. */
  free() {
    if (this.#address) this.#exports.network_free(this.#address);
    this.#address = 0;
  }

  #use() {
    if (!this.#address) throw new Error("the network was freed");
    return this.#address;
  }
}

/**
 * @param {import("touchdown/engine/engine.js").Exports} exports
 * @param {import("touchdown/engine/network-file.js").Network} network
 * @returns {number} The address of the network.
 */
function create(exports, network) {
  const sizes = network.hidden_sizes;
  const block = exports.allocate(4 * sizes.length);
  new Int32Array(exports.memory.buffer, block, sizes.length).set(sizes);
  const address = exports.network_new(
    INPUTS, ACTIONS, block, sizes.length, ACTIVATIONS.indexOf(network.activation),
    Number(network.layer_norm), Number(network.dueling), network.quantiles, network.atoms,
    network.v_min, network.v_max,
  );
  exports.release(block);
  return address;
}
