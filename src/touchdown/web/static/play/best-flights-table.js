// The table of a person's best flights.
import { RANGES } from "touchdown/play/conditions.js";
import { signed } from "touchdown/common/format.js";
import { STEPS_PER_SECOND } from "touchdown/common/units.js";
import { part } from "touchdown/common/parts.js";

/** @typedef {import("touchdown/play/best-flights.js").BestFlight} BestFlight */

/**
 * @param {HTMLElement} section
 * @param {BestFlight[]} flights the best first
 */
export function showBestFlights(section, flights) {
  part(section, ".none", HTMLElement).hidden = flights.length > 0;
  part(section, ".scroll", HTMLElement).hidden = flights.length === 0;
  part(section, "tbody", HTMLElement).replaceChildren(...flights.map(rowOf));
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

/** @param {BestFlight} flight */
function rowOf(flight) {
  const row = document.createElement("tr");
  const seconds = `${(flight.steps / STEPS_PER_SECOND).toFixed(1)} s`;
  const texts = [
    signed(flight.return, 1), flight.outcome, flight.by, String(flight.seed),
    conditionsOf(flight.link), seconds, flight.fuel.toFixed(1),
  ];
  for (const text of texts) row.insertCell().textContent = text;
  const link = document.createElement("a");
  link.href = `#${flight.link}`;
  link.textContent = "watch";
  row.insertCell().append(link);
  return row;
}
