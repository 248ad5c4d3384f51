// One card for each run: its state and its numbers. They are also the legend of the charts.

import { number } from "touchdown/common/format.js";
import { rowsOfWindow } from "touchdown/watch/history.js";
import { stateName } from "touchdown/watch/states.js";

/** @typedef {import("touchdown/watch/history.js").RunHistory} RunHistory */

const MANY = 6; // cards, which are then small

/**
 * @param {HTMLElement} element
 * @param {{history: RunHistory, colour: string}[]} runs
 */
export function drawCards(element, runs) {
  element.classList.toggle("many", runs.length > MANY);
  const cards = runs.map(({ history, colour }, place) => {
    const made = card(history, colour);
    const there = element.children[place];
    return there?.isEqualNode(made) ? there : made; // what has not changed stays
  });
  if (cards.some((each, place) => each !== element.children[place])) element.replaceChildren(...cards);
}

/** @param {RunHistory} history @param {string} colour */
function card(history, colour) {
  const box = document.createElement("article");
  box.className = "run";
  box.style.setProperty("--run", colour);
  const facts = history.facts;
  const title = document.createElement("p");
  title.className = "name";
  title.append(tag("strong", history.label));
  if (facts) {
    const badge = tag("span", stateName(facts.status));
    badge.className = `badge ${facts.status}`;
    title.append(badge, note([facts.group, facts.env_id, `seed ${facts.seed}`]));
  } else {
    title.append(note([history.isUnknown ? "there is no such run" : "reading …"]));
  }
  box.append(title);
  const rows = numbersOf(history);
  if (rows.length) {
    const list = document.createElement("dl");
    for (const [name, value] of rows) {
      const row = document.createElement("div");
      row.append(tag("dt", name), tag("dd", value));
      list.append(row);
    }
    box.append(list);
  }
  const done = progressOf(history);
  if (done !== null && facts?.status === "training") {
    const bar = document.createElement("progress");
    bar.value = done;
    bar.setAttribute("aria-label", `training of ${history.label}`);
    box.append(bar);
  }
  return box;
}

/** @param {RunHistory} history @returns {[string, string][]} */
function numbersOf(history) {
  const { episodes, validations, facts } = history;
  const count = episodes.length;
  if (!count) return facts ? [["episodes", "none yet"]] : [];
  const returns = episodes.get("episode_return").slice(-rowsOfWindow(episodes));
  const steps = episodes.get("env_steps")[count - 1];
  const seconds = episodes.get("seconds")[count - 1];
  const best = validations.get("mean_return");
  /** @type {[string, string][]} */
  const rows = [
    ["mean return, last 100", number(returns.reduce((sum, each) => sum + each, 0) / returns.length, 1)],
    ["env steps", number(steps)],
    ["episodes", number(episodes.get("episode")[count - 1])],
    ["ε", Number(episodes.get("epsilon")[count - 1]).toFixed(3)],
    ["training time", clock(seconds)],
    ["steps per second", number(steps / Math.max(seconds, 1e-9))],
  ];
  if (best.length) rows.push(["best validation", number(Math.max(...best), 1)]);
  if (facts?.test)
    rows.push([`test (n=${facts.test.episodes})`, number(facts.test.mean_return, 1)]);
  return rows;
}

/** The share of the budget that training has used; null if it is not known. */
function progressOf(/** @type {RunHistory} */ history) {
  const settings = history.facts?.settings;
  const count = history.episodes.length;
  if (!settings || !count) return null;
  const steps = history.episodes.get("env_steps")[count - 1];
  const episode = history.episodes.get("episode")[count - 1];
  const bySteps = settings.max_env_steps ? steps / settings.max_env_steps : 0;
  return Math.min(1, Math.max(bySteps, episode / settings.episodes));
}

/** Seconds as m:ss or h:mm:ss. */
function clock(/** @type {number} */ seconds) {
  const whole = Math.round(seconds);
  const parts = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  const shown = parts[0] ? parts : parts.slice(1);
  return shown.map((part, at) => (at ? String(part).padStart(2, "0") : String(part))).join(":");
}

/** @param {string} name @param {string} text */
function tag(name, text) {
  const element = document.createElement(name);
  element.textContent = text;
  return element;
}

/** @param {string[]} parts */
function note(parts) {
  const element = tag("span", parts.filter(Boolean).join(" · "));
  element.className = "note";
  return element;
}
