// The list of runs: choose one, or several to see side by side.

import { readData } from "touchdown/common/data.js";
import { stateName } from "touchdown/watch/states.js";

/** @typedef {{key: string, label: string, group: string, status: string, changed: number}} Listed */
/**
 * @typedef {{label: HTMLElement, tick: HTMLInputElement, link: HTMLAnchorElement,
 *   badge: HTMLElement, when: HTMLElement}} Row
 */
/** @typedef {{box: HTMLElement, head: HTMLElement[], members: Listed[]}} Group */

const PAUSE = 3000; // milliseconds between two readings

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

  /** @type {Map<string, Row>} by key; they stay the same, so that no click and no focus is lost */
  const rows = new Map();
  /** @type {Map<string, Group>} by name */
  const groups = new Map();

  function draw() {
    for (const run of runs) {
      const row = rows.get(run.key) ?? newRow(run.key);
      rows.set(run.key, row);
      showRun(row, run, chosen.has(run.key));
    }
    const names = [...new Set(runs.map((run) => run.group))];
    arrange(list, names.map((name) => {
      const group = groups.get(name) ?? newGroup(name);
      groups.set(name, group);
      group.members = runs.filter((run) => run.group === name);
      const labels = group.members.flatMap((run) => rows.get(run.key)?.label ?? []);
      arrange(group.box, [...group.head, ...labels]);
      return group.box;
    }));
    say();
  }

  /** @param {string} name @returns {Group} */
  function newGroup(name) {
    const box = document.createElement("fieldset");
    /** @type {Group} */
    const group = { box, head: [], members: [] };
    if (!name) return group;
    const legend = document.createElement("legend");
    const all = document.createElement("button");
    all.type = "button";
    all.className = "quiet";
    all.textContent = "Choose all";
    all.addEventListener("click", () => {
      for (const run of group.members) chosen.add(run.key);
      draw();
    });
    legend.append(name, all);
    group.head.push(legend);
    return group;
  }

  /** @param {string} key @returns {Row} */
  function newRow(key) {
    const label = document.createElement("label");
    const tick = document.createElement("input");
    tick.type = "checkbox";
    tick.addEventListener("change", () => {
      if (tick.checked) chosen.add(key);
      else chosen.delete(key);
      say();
    });
    const link = document.createElement("a");
    link.href = `./?run=${encodeURIComponent(key)}`;
    const badge = document.createElement("span");
    const when = document.createElement("small");
    label.append(tick, link, badge, when);
    return { label, tick, link, badge, when };
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
    location.href = `./?${[...chosen].map((key) => `run=${encodeURIComponent(key)}`).join("&")}`;
  });
  setInterval(read, PAUSE);
  new EventSource("./events"); // the server of a training ends when no page is open
  draw();
}

/** @param {Row} row @param {Listed} run @param {boolean} isChosen */
function showRun({ tick, link, badge, when }, run, isChosen) {
  tick.checked = isChosen;
  tick.setAttribute("aria-label", `choose ${run.label}`);
  link.textContent = run.label;
  badge.className = `badge ${run.status}`;
  badge.textContent = stateName(run.status);
  when.textContent = ago(run.changed);
}

/**
 * Makes elements the children of a place, in their order. Those that need not move stay where they
 * are, and the focus stays where it is.
 * @param {HTMLElement} place
 * @param {HTMLElement[]} elements
 */
function arrange(place, elements) {
  const focused = document.activeElement;
  for (const child of [...place.children])
    if (!elements.includes(/** @type {HTMLElement} */ (child))) child.remove();
  elements.forEach((element, at) => {
    const there = place.children[at] ?? null;
    if (there !== element) place.insertBefore(element, there);
  });
  if (focused instanceof HTMLElement && focused !== document.activeElement && place.contains(focused))
    focused.focus();
}

/** How long ago something happened, in words. @param {number} seconds since the epoch */
function ago(seconds) {
  const passed = Date.now() / 1000 - seconds;
  if (passed < 60) return "now";
  if (passed < 3600) return `${Math.floor(passed / 60)} min ago`;
  if (passed < 86400) return `${Math.floor(passed / 3600)} h ago`;
  return new Date(seconds * 1000).toLocaleDateString("en-GB");
}
