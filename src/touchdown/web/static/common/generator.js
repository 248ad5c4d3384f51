// Random numbers from a key. They use only additions and integer multiplications, so every browser draws
// the same ones.

/** 2^32 divided by the golden ratio. */
export const STEP = 0x9e3779b9;

/**
 * Scatters the bits of an integer (the finaliser of MurmurHash3, by Appleby).
 * @param {number} value
 */
export function scatter(value) {
  let bits = value >>> 0;
  bits = Math.imul(bits ^ (bits >>> 16), 0x85ebca6b);
  bits = Math.imul(bits ^ (bits >>> 13), 0xc2b2ae35);
  return (bits ^ (bits >>> 16)) >>> 0;
}

export class Generator {
  /** @param {number[]} key integers, such as a seed, a purpose and a step */
  constructor(...key) {
    this.state = 0;
    for (const part of key) {
      this.state = scatter(this.state + STEP + scatter(part));
    }
  }

  /** 0 to 2^32 - 1. */
  integer() {
    this.state = (this.state + STEP) >>> 0;
    return scatter(this.state);
  }

  /**
   * @param {number} [low]
   * @param {number} [high] never reached
   */
  uniform(low = 0, high = 1) {
    return low + ((high - low) * this.integer()) / 2 ** 32;
  }

  /**
   * Mean 0, standard deviation 1: a sum of twelve uniform numbers. Logarithms and cosines, which
   * other methods need, are rounded differently by different browsers.
   */
  normal() {
    let sum = -6;
    for (let i = 0; i < 12; i++) sum += this.uniform();
    return sum;
  }
}
