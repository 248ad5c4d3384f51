/** A snapshot's envelope: what it is, its version, its size, and a checksum of its content. */

const MAGIC = new TextEncoder().encode("TDWEBFLY");
const VERSION = 1; // raised with every change to what a snapshot holds that leaves its size
const HEAD = MAGIC.length + 12; // bytes

/**
 * @param {Uint8Array} content
 * @returns {Uint8Array}
 */
export function seal(content) {
  const sealed = new Uint8Array(HEAD + content.length);
  sealed.set(MAGIC);
  sealed.set(content, HEAD);
  const head = new DataView(sealed.buffer, MAGIC.length);
  head.setUint32(0, VERSION, true);
  head.setUint32(4, content.length, true);
  head.setUint32(8, checksum(content), true);
  return sealed;
}

/**
 * The content of a snapshot that `seal` made.
 *
 * @param {Uint8Array} sealed
 * @param {number} size Bytes that the content must have.
 * @returns {Uint8Array}
 * @throws {Error} It is something else, of another version, or any bit has changed.
 */
export function unseal(sealed, size) {
  if (!(sealed instanceof Uint8Array) || MAGIC.some((byte, i) => sealed[i] !== byte)) {
    throw new Error("not a snapshot of a lander in the browser");
  }
  if (sealed.length < HEAD) throw new Error("the snapshot is damaged");
  const head = new DataView(sealed.buffer, sealed.byteOffset + MAGIC.length);
  if (head.getUint32(0, true) !== VERSION || head.getUint32(4, true) !== size) {
    throw new Error("a snapshot of another version of the engine");
  }
  const content = sealed.subarray(HEAD);
  if (content.length !== size || checksum(content) !== head.getUint32(8, true)) {
    throw new Error("the snapshot is damaged");
  }
  return content;
}

/**
 * FNV-1a: it detects accidents, and is no defence against intent.
 *
 * @param {Uint8Array} bytes
 */
function checksum(bytes) {
  let hash = 0x811c9dc5;
  for (const byte of bytes) hash = Math.imul(hash ^ byte, 0x01000193);
  return hash >>> 0;
}
