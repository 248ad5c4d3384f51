// The list of runs: choose one, or several to see side by side.

import { readData } from "touchdown/common/data.js";

/** @typedef {{key: string, label: string, group: string, status: string, changed: number}} Listed */

const PAUSE = 3000; // milliseconds between two readings

/** @type {Record<string, string>} */
const STATES = { training: "training", finished: "finished", stopped: "stopped", gone: "deleted" };

export function start() {
  /** @type {Set<string>} */
  const chosen = new Set();
  /** @type {Listed[]} */
  let runs = readData().runs;
  const form = /** @type {HTMLFormElement} */ (document.getElementById("choose"));
  const list = /** @type {HTMLElement} */ (document.getElementById("list"));
  const note = /** @type {HTMLElement} */ (document.getElementById("chosen"));
  const button = /** @type {HTMLButtonElement} */ (document.getElementById("watch"));

  function say() {
    button.disabled = chosen.size === 0;
    note.textContent = chosen.size
      ? `${chosen.size} chosen`
      : runs.length
        ? "Open a run, or choose several to see them side by side."
        : "There are no runs yet; start one with: touchdown train";
  }

  function draw() {
    /** @type {Map<string, Listed[]>} */
    const groups = new Map();
    for (const run of runs) groups.set(run.group, [...(groups.get(run.group) ?? []), run]);
    list.replaceChildren(...[...groups].map(([name, members]) => group(name, members)));
    say();
  }

  /** @param {string} name @param {Listed[]} members */
  function group(name, members) {
    const box = document.createElement("fieldset");
    if (name) {
      const legend = document.createElement("legend");
      const all = document.createElement("button");
      all.type = "button";
      all.className = "quiet";
      all.textContent = "Choose all";
      all.addEventListener("click", () => {
        for (const run of members) chosen.add(run.key);
        draw();
      });
      legend.append(name, all);
      box.append(legend);
    }
    box.append(...members.map(row));
    return box;
  }

  /** @param {Listed} run */
  function row(run) {
    const label = document.createElement("label");
    const tick = document.createElement("input");
    tick.type = "checkbox";
    tick.checked = chosen.has(run.key);
    tick.setAttribute("aria-label", `choose ${run.label}`);
    tick.addEventListener("change", () => {
      if (tick.checked) chosen.add(run.key);
      else chosen.delete(run.key);
      say();
    });
    const link = document.createElement("a");
    link.href = `./?run=${run.key}`;
    link.textContent = run.label;
    const badge = document.createElement("span");
    badge.className = `badge ${run.status}`;
    badge.textContent = STATES[run.status] ?? run.status;
    const when = document.createElement("small");
    when.textContent = ago(run.changed);
    label.append(tick, link, badge, when);
    return label;
  }

  async function read() {
    if (document.hidden) return;
    try {
      const answer = await fetch("./runs");
      const found = await answer.text();
      if (found === JSON.stringify(runs)) return;
      runs = JSON.parse(found);
      draw();
    } catch {
      note.textContent = "no connection: the server has ended";
    }
  }

  form.addEventListener("submit", (event) => {
    event.preventDefault();
    location.href = `./?${[...chosen].map((key) => `run=${key}`).join("&")}`;
  });
  setInterval(read, PAUSE);
  draw();
}

/** How long ago something happened, in words. @param {number} seconds since the epoch */
function ago(seconds) {
  const passed = Date.now() / 1000 - seconds;
  if (passed < 60) return "now";
  if (passed < 3600) return `${Math.floor(passed / 60)} min ago`;
  if (passed < 86400) return `${Math.floor(passed / 3600)} h ago`;
  return new Date(seconds * 1000).toLocaleDateString("en-GB");
}
