/**
 * Files of the safetensors format: a length, a JSON header, and the numbers of all tensors.
 *
 * @typedef {object} Tensor
 * @property {string} dtype As the file spells it, such as F32.
 * @property {number[]} shape
 * @property {Float32Array | Float64Array | Int32Array | BigInt64Array | Uint8Array} data A copy, row
 *   by row.
 *
 * @typedef {object} Tensors
 * @property {Map<string, Tensor>} tensors
 * @property {Record<string, string>} metadata
 */

const HEADER_LIMIT = 16 * 2 ** 20; // bytes
const ARRAYS = /** @type {const} */ ({
  F32: Float32Array,
  F64: Float64Array,
  I32: Int32Array,
  I64: BigInt64Array,
  U8: Uint8Array,
});

/**
 * Reads a file; nothing in it is executed.
 *
 * @param {ArrayBuffer | Uint8Array} file
 * @returns {Tensors}
 * @throws {Error} It is truncated or something else; one line says what is wrong.
 */
export function parse(file) {
  const bytes = file instanceof Uint8Array
    ? new Uint8Array(file.buffer, file.byteOffset, file.byteLength) // not a subclass
    : new Uint8Array(file);
  const refuse = (/** @type {string} */ why) => new Error(`not a safetensors file: ${why}`);
  if (bytes.length < 8) throw refuse(`it has ${bytes.length} bytes, must be at least 8`);
  const size = Number(new DataView(bytes.buffer, bytes.byteOffset, 8).getBigUint64(0, true));
  if (size > Math.min(HEADER_LIMIT, bytes.length - 8)) {
    throw refuse(`its header would have ${size} bytes`);
  }
  const header = decode(bytes.subarray(8, 8 + size), refuse);
  const content = bytes.subarray(8 + size);
  const { __metadata__: metadata = {}, ...entries } = header;
  if (!isRecord(metadata) || Object.values(metadata).some((text) => typeof text !== "string")) {
    throw refuse("its metadata must be texts");
  }
  /** @type {Map<string, Tensor>} */
  const tensors = new Map();
  for (const [name, entry] of Object.entries(entries)) {
    const tensor = isRecord(entry) ? tensorOf(entry, content) : null;
    if (!tensor) throw refuse(`the tensor ${JSON.stringify(name)} is not within it`);
    tensors.set(name, tensor);
  }
  return { tensors, metadata: /** @type {Record<string, string>} */ (metadata) };
}

/**
 * @param {Uint8Array} text
 * @param {(why: string) => Error} refuse
 * @returns {Record<string, unknown>}
 */
function decode(text, refuse) {
  let header;
  try {
    header = JSON.parse(new TextDecoder("utf-8", { fatal: true }).decode(text));
  } catch {
    throw refuse("its header is not JSON");
  }
  if (!isRecord(header)) throw refuse("its header is not a JSON object");
  return header;
}

/**
 * @param {unknown} value
 * @returns {value is Record<string, unknown>}
 */
function isRecord(value) {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}

/**
 * @param {unknown} value
 * @returns {value is number[]}
 */
function areCounts(value) {
  return Array.isArray(value) && value.every((item) => Number.isSafeInteger(item) && item >= 0);
}

/**
 * @param {Record<string, unknown>} entry
 * @param {Uint8Array} content
 * @returns {Tensor | null} Null if the entry is wrong.
 */
function tensorOf({ dtype, shape, data_offsets: offsets }, content) {
  if (typeof dtype !== "string" || !Object.hasOwn(ARRAYS, dtype)) return null;
  if (!areCounts(shape) || !areCounts(offsets)) return null;
  const [begin, end, ...more] = offsets;
  if (begin === undefined || end === undefined || more.length > 0) return null;
  const type = ARRAYS[/** @type {keyof typeof ARRAYS} */ (dtype)];
  const count = shape.reduce((product, size) => product * size, 1);
  if (end > content.length || end - begin !== count * type.BYTES_PER_ELEMENT) return null;
  const data = new type(content.slice(begin, end).buffer);
  return { dtype, shape, data };
}
