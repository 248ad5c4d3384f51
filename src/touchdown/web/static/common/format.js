// Numbers as text, and texts that fit.

/** Characters of a name where there is little room. */
export const LONGEST_NAME = 24;

/**
 * A number with its sign; a zero has none.
 * @param {number} value
 * @param {number} digits
 */
export function signed(value, digits) {
  const text = Math.abs(value).toFixed(digits);
  if (!/[1-9]/.test(text)) return text;
  return `${value < 0 ? "−" : "+"}${text}`;
}

/**
 * A number with commas between the thousands.
 * @param {number} value
 * @param {number} digits
 */
export function number(value, digits = 0) {
  return value.toLocaleString("en", { minimumFractionDigits: digits, maximumFractionDigits: digits });
}

/**
 * A text, cut off where it is longer than that many characters.
 * @param {string} text
 * @param {number} most
 */
export function shortened(text, most) {
  const characters = [...text];
  return characters.length > most ? `${characters.slice(0, most - 1).join("")}…` : text;
}
