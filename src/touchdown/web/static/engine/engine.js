/**
 * The lander of Gymnasium's LunarLander-v3, and networks that fly it: the project's C++ code,
 * compiled to WebAssembly.
 */
import { Lander } from "touchdown/engine/lander.js";
import { NetworkPolicy } from "touchdown/engine/network.js";

export { Lander, NetworkPolicy };

/**
 * Functions of the WebAssembly module. Addresses and sizes are in bytes of its memory.
 *
 * @typedef {object} Exports
 * @property {WebAssembly.Memory} memory
 * @property {() => void} _initialize
 * @property {(size: number) => number} allocate
 * @property {(address: number) => void} release
 * @property {() => number} lander_new
 * @property {(lander: number) => void} lander_free
 * @property {(lander: number, gravity: number, wind: number, windPower: number,
 *   turbulencePower: number) => void} lander_configure
 * @property {(lander: number, low: number, high: number) => void} lander_reset
 * @property {(lander: number, action: number) => void} lander_step
 * @property {() => number} snapshot_size
 * @property {(lander: number, bytes: number) => void} lander_snapshot
 * @property {(lander: number, bytes: number) => number} lander_restore
 * @property {(inputs: number, actions: number, hiddenSizes: number, hidden: number,
 *   activation: number, layerNorm: number, dueling: number, quantiles: number, atoms: number,
 *   vMin: number, vMax: number) => number} network_new
 * @property {(network: number) => void} network_free
 * @property {(network: number) => number} network_params
 * @property {(network: number) => void} network_load
 * @property {(network: number) => number} network_observation
 * @property {(network: number) => number} network_values
 * @property {(network: number, layer: number) => number} network_features
 * @property {(network: number) => void} network_run
 */

/**
 * Compiles the engine.
 *
 * @param {BufferSource} bytes The content of lander.wasm.
 * @returns {Promise<Engine>}
 * @throws {WebAssembly.CompileError} They are something else.
 */
export async function loadEngine(bytes) {
  const { instance } = await WebAssembly.instantiate(bytes, {});
  const exports = /** @type {Exports} */ (/** @type {unknown} */ (instance.exports));
  exports._initialize();
  return new Engine(exports);
}

/** Makes landers and networks, which all live in the memory of one WebAssembly module. */
export class Engine {
  #exports;

  /** @param {Exports} exports */
  constructor(exports) {
    this.#exports = exports;
  }

  /**
   * A new lander; reset it before its first step.
   *
   * @param {import("touchdown/engine/lander.js").Settings} [settings]
   * @returns {Lander}
   * @throws {Error} A setting is out of range.
   */
  newLander(settings = {}) {
    return new Lander(this.#exports, settings);
  }

  /**
   * The greedy policy in a file of weights, such as `checkpoints/best.safetensors` of a run.
   *
   * @param {ArrayBuffer | Uint8Array} file
   * @returns {NetworkPolicy}
   * @throws {Error} It is not a network that flies the lander; one line says why.
   */
  newNetwork(file) {
    return new NetworkPolicy(this.#exports, file);
  }
}
