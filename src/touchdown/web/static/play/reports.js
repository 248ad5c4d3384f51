// The state of a race in words.
import { signed } from "touchdown/common/format.js";
import { YOU } from "touchdown/play/link.js";

/** @typedef {import("touchdown/play/game.js").Game} Game */

/**
 * A race that goes on.
 * @param {Game} game
 */
export function describe(game) {
  const { race, playing, engaged, setup } = game;
  const { lead, step } = race;
  if (step === 0 && lead.steps === 0 && !playing) {
    return engaged ? "Ready." : "Ready: press an engine to begin.";
  }
  if (!playing) return "Paused: an engine key flies on from here.";
  if (step < lead.steps || (race.replaying && !lead.over)) {
    return "A recorded flight: press an engine to take over.";
  }
  if (lead.over) return `${sentenceOf(lead, game.flownBy)} The others are still flying.`;
  return engaged ? `${setup.autopilot} is flying: press an engine to override it.` : "You are flying.";
}

/**
 * A race that is over, the best return first.
 * @param {Game} game
 */
export function ranking({ race, flownBy }) {
  if (race.rivals.length === 0) return sentenceOf(race.lead, flownBy);
  const results = race.flights.map((flight) => ({
    name: flight === race.lead ? flownBy : flight.name,
    outcome: flight.outcome ?? "",
    return: flight.at(flight.steps).return,
  }));
  results.sort((a, b) => b.return - a.return);
  const places = results.map(
    (each, i) => `${i + 1}. ${each.name} ${signed(each.return, 1)} (${each.outcome})`,
  );
  return places.join(" · ");
}

/**
 * @param {import("touchdown/play/flight.js").Flight} flight that has ended
 * @param {string} flownBy
 */
function sentenceOf(flight, flownBy) {
  const who = flownBy === YOU ? "You" : flownBy;
  const did = flight.outcome === "out of bounds" ? "left the screen" : flight.outcome;
  return `${who} ${did}: return ${signed(flight.at(flight.steps).return, 1)}.`;
}
