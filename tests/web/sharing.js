// What `copyLink` does on a phone whose sharing dialog ends with an error.
import { copyLink } from "touchdown/play/share.js";

/**
 * @param {string[]} errors names of the errors
 * @returns {Promise<{said: string, copied: string[]}[]>}
 */
export async function share(errors) {
  const answers = [];
  for (const name of errors) {
    /** @type {string[]} */
    const copied = [];
    Object.assign(globalThis, {
      matchMedia: () => ({ matches: true }),
      location: { protocol: "https:" },
      document: { title: "" },
    });
    Object.defineProperty(globalThis, "navigator", {
      configurable: true,
      value: {
        share: () => Promise.reject(new DOMException("", name)),
        clipboard: { writeText: (/** @type {string} */ text) => Promise.resolve(copied.push(text)) },
      },
    });
    answers.push({ said: await copyLink("link"), copied });
  }
  return answers;
}
