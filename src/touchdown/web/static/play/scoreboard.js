// The table of a person's best flights.
import { RANGES } from "touchdown/play/conditions.js";
import { signed } from "touchdown/scene/dials.js";
import { STEPS_PER_SECOND } from "touchdown/scene/frame.js";
import { part } from "touchdown/common/parts.js";

/** @typedef {import("touchdown/play/scores.js").Score} Score */

/**
 * @param {HTMLElement} section
 * @param {Score[]} scores the best first
 */
export function showScores(section, scores) {
  part(section, ".none", HTMLElement).hidden = scores.length > 0;
  part(section, ".scroll", HTMLElement).hidden = scores.length === 0;
  part(section, "tbody", HTMLElement).replaceChildren(...scores.map(rowOf));
}

/**
 * The conditions of a kept flight that are not Gymnasium's.
 * @param {string} link
 */
function conditionsOf(link) {
  const fields = new URLSearchParams(link);
  const changed = RANGES.filter(({ name }) => fields.has(name));
  return changed.map(({ name }) => `${name} ${fields.get(name)}`).join(", ") || "normal";
}

/** @param {Score} score */
function rowOf(score) {
  const row = document.createElement("tr");
  const seconds = `${(score.steps / STEPS_PER_SECOND).toFixed(1)} s`;
  const texts = [
    signed(score.return, 1), score.outcome, score.pilot, String(score.seed),
    conditionsOf(score.link), seconds, score.fuel.toFixed(1),
  ];
  for (const text of texts) row.insertCell().textContent = text;
  const link = document.createElement("a");
  link.href = `#${score.link}`;
  link.textContent = "watch";
  row.insertCell().append(link);
  return row;
}
