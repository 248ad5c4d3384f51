// What the page was given: values as JSON, and files.

/** @param {string} id */
function readJson(id) {
  const element = document.getElementById(id);
  if (!element) throw new Error(`the page has no element #${id}`);
  return JSON.parse(element.textContent ?? "");
}

/** @type {Record<string, unknown>|undefined} many megabytes, which are parsed once */
let binaries;

/**
 * The values that the page was made with.
 * @returns {any}
 */
export function readData() {
  return readJson("data");
}

/**
 * A file that the page was made with.
 * @param {string} name such as "lander.wasm"
 * @returns {Uint8Array<ArrayBuffer>}
 * @throws {Error} if the page has no such file
 */
export function readBinary(name) {
  binaries ??= readJson("binaries");
  const encoded = binaries?.[name];
  if (typeof encoded !== "string") throw new Error(`the page has no file ${name}`);
  return decodeBase64(encoded);
}

/**
 * @param {string} encoded
 * @returns {Uint8Array<ArrayBuffer>}
 */
export function decodeBase64(encoded) {
  return Uint8Array.from(atob(encoded), (character) => character.charCodeAt(0));
}
