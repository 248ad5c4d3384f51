// Q against discounted returns: along one flight, and over training.

import { STEPS_PER_SECOND } from "touchdown/common/units.js";
import { expectations, mean, returnsToGo } from "touchdown/watch/flight.js";
import { drawPlot } from "touchdown/watch/plot.js";
import { STARTS } from "touchdown/watch/trials.js";

/** @typedef {import("touchdown/watch/theme.js").Colours} Colours */
/** @typedef {import("touchdown/watch/history.js").RunHistory} RunHistory */

/**
 * @param {HTMLElement} element
 * @param {import("touchdown/engine/engine.js").NetworkPolicy} policy
 * @param {import("touchdown/watch/flight.js").Flown} flown
 * @param {RunHistory} history
 * @param {Colours} colours
 */
export function drawAlongFlight(element, policy, flown, history, colours) {
  const settings = history.facts?.settings;
  const expected = expectations(policy, flown, settings?.reward_scale ?? 1);
  const returned = returnsToGo(flown.rewards, settings?.gamma ?? 1);
  const seconds = flown.rewards.map((_, step) => step / STEPS_PER_SECOND);
  return drawPlot(element, pair(seconds, expected, returned, colours), colours, {
    x: "seconds of the flight", y: "return points", legend: true, hovermode: "x unified",
  });
}

/**
 * Means over the states of each policy's flights; the policies that have flown so far.
 * @param {HTMLElement} element
 * @param {import("touchdown/watch/trials.js").Trials} trials
 * @param {import("touchdown/watch/history.js").Axis} axis
 * @param {Colours} colours
 */
export function drawOverTraining(element, trials, axis, colours) {
  const rows = trials.policies.flatMap((policy) => {
    const flown = STARTS.flatMap((start) => trials.at(policy, start) ?? []);
    if (!flown.length) return [];
    const x = axis === "seconds" ? trials.history.secondsAt(policy) : policy;
    const expected = mean(flown.map((trial) => trial.expected));
    return [{ x, expected, returned: mean(flown.map((trial) => trial.returned)) }];
  });
  const traces = pair(
    rows.map((row) => row.x), rows.map((row) => row.expected), rows.map((row) => row.returned), colours,
  );
  return drawPlot(element, traces.map((trace) => ({ ...trace, mode: "lines+markers" })), colours, {
    x: axis === "seconds" ? "seconds of training" : "environment steps",
    y: "return points", legend: true, hovermode: "x unified", revision: axis,
    xaxis: { rangemode: "tozero", tickformat: axis === "seconds" ? "" : "~s" },
  });
}

/** @param {number[]} x @param {number[]} expected @param {number[]} returned @param {Colours} colours */
function pair(x, expected, returned, colours) {
  const hovertemplate = "%{y:.1f}";
  return [
    { x, y: expected, name: "expected, max Q", mode: "lines", line: { color: colours.blue, width: 2 }, hovertemplate },
    { x, y: returned, name: "discounted return", mode: "lines", line: { color: colours.orange, width: 2 }, hovertemplate },
  ];
}
