// The state of a race in words.
import { signed } from "touchdown/dials.js";
import { YOU } from "touchdown/link.js";

/** @typedef {import("touchdown/game.js").Game} Game */

/**
 * A race that goes on.
 * @param {Game} game
 */
export function describe({ race, playing, engaged, setup }) {
  const { lead, step } = race;
  if (step === 0 && lead.steps === 0 && !playing) {
    return engaged ? "Ready." : "Ready: press an engine to begin.";
  }
  if (race.replaying && !lead.over) return "A recorded flight: press an engine to take over.";
  if (!playing) return "Paused.";
  return engaged ? `${setup.autopilot} is flying: press an engine to override it.` : "You are flying.";
}

/**
 * A race that is over, the best return first.
 * @param {Game} game
 */
export function ranking({ race, pilot }) {
  const results = race.flights.map((flight) => ({
    name: flight === race.lead ? pilot : flight.name,
    outcome: flight.outcome ?? "",
    return: flight.at(flight.steps).return,
  }));
  const [only] = results;
  if (results.length === 1 && only) {
    const who = only.name === YOU ? "You" : only.name;
    return `${who} ${verbOf(only.outcome)}: return ${signed(only.return, 1)}.`;
  }
  results.sort((a, b) => b.return - a.return);
  const places = results.map(
    (each, i) => `${i + 1}. ${each.name} ${signed(each.return, 1)} (${each.outcome})`,
  );
  return places.join("   ");
}

/** @param {string} outcome */
function verbOf(outcome) {
  return outcome === "out of bounds" ? "left the screen" : outcome;
}
