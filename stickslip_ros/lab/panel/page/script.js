// Copyright 2026 The stickslip_ros maintainers
// SPDX-License-Identifier: Apache-2.0

// The control of scripts: commands that go one after another, each when the one before has ended.

import { button, fileButton, grey, inRow, make, newest, refusal, whenStateComes } from "./fields.js";
import { saveAs } from "./plot.js";
import { ask, wish } from "./socket.js";

const ABOUT = "A command in a line, as after `stickslip command`; `wait 2` waits two simulated seconds; # is a comment";
const EXAMPLE = "preload 250mN\nsawtooth 300V 500Hz 20\nwait 0.5\nposition -2um";
const NAME = "script"; // of its wishes, and of what stands beside it
const STEP_MS = 50;
const KEEPS = "stickslip script";

let lines = null; // the text field; what the page sends is added while `adds` is pressed
let adds = null;

/** Add what the page sends, in SI units, to the script that is being noted. */
export function noteCommand(name, values) {
  if (adds?.getAttribute("aria-pressed") === "true") append([name, ...values].join(" "));
}

function append(line) {
  lines.value = `${lines.value.trimEnd()}\n${line}`.trimStart();
  lines.oninput();
}

export function addScript(made) {
  const told = make("output");
  let steps = [], known = new Set(), waiting = null;
  let state = { events: [], notes: {}, lifecycle: "", condition: { word: "", text: "" } };
  lines = make("textarea", "", ABOUT);
  lines.rows = 5;
  lines.spellcheck = false;
  lines.placeholder = EXAMPLE;
  lines.setAttribute("aria-label", "Commands of the script");
  lines.value = localStorage.getItem(KEEPS) || "";
  lines.oninput = () => localStorage.setItem(KEEPS, lines.value);
  told.className = "note";
  told.dataset.note = "script-line";

  const stem = (name) => name.split("_")[0]; // `zero` is zero_position
  const key = (event) => `${event.number} ${event.time_ns}`; // a drive that is built anew counts from 1
  const know = () => { known = new Set(state.events.map(key)); };
  const fresh = () => state.events.filter((each) => !known.has(key(each)));
  // Pictures may lag behind events.
  const now = () => Math.max(newest.time_s, 1e-9 * (fresh().at(-1)?.time_ns ?? 0));
  const refused = () => state.notes[NAME] || { number: 0 };
  const greyAll = () => {
    grey(run, waiting ? "a script runs" : refusal(state));
    grey(halt, waiting ? "" : "no script runs");
  };
  const show = (text, isBad = false) => {
    told.textContent = text;
    told.classList.toggle("bad", isBad);
    greyAll();
  };
  const begin = async ([number, text]) => {
    const [name, ...words] = text.split(/\s+/), isWait = name === "wait", from_s = now();
    const mine = waiting = { number, text, name, until: isWait ? Infinity : null, noted: refused().number, begun: newest.time_s };
    know();
    show(`line ${number}: ${text}`);
    if (!isWait) return wish({ do: "line", name: NAME, text });
    const told = await ask("number", `${NAME} wait s`, words.join(" "));
    if (waiting !== mine) return; // ended meanwhile
    if (told.refused) fail(told.refused);
    else waiting.until = from_s + told.read;
  };
  const end = (text, isBad = false) => {
    steps = [];
    waiting = null;
    show(text, isBad);
  };
  const fail = (text) => end(`ended at line ${waiting.number}: ${text}`, true);
  /** Return the end of the line that is carried out; what it replaces ends first, and tells its number. */
  const ended = () => {
    const by = fresh().map((each) => /by command (\d+)$/.exec(each.message)).find(Boolean);
    return fresh().find((each) => stem(each.command) === stem(waiting.name) && (!by || each.number === Number(by[1])));
  };
  setInterval(() => {
    if (!waiting || state.condition.word === "silent") return; // it may answer late
    if (state.lifecycle !== "active") return fail(state.condition.text);
    if (newest.time_s < waiting.begun) return fail("the drive has begun anew");
    if (refused().bad && refused().number > waiting.noted) return fail(refused().text);
    if (waiting.until === null) {
      const event = ended();
      if (!event) return;
      if (event.result !== "DONE") return fail(`${event.result}: ${event.message}`);
    } else if (newest.time_s < waiting.until) return;
    if (steps.length) begin(steps.shift());
    else end("done");
  }, STEP_MS);

  const run = button("Run", "Send the commands one after another", () => {
    steps = lines.value.split("\n").map((text, index) => [index + 1, text.replace(/#.*/, "").trim()]).filter(([, text]) => text);
    know();
    if (steps.length) begin(steps.shift());
  });
  const halt = button("End", "Send no further line; STOP ends the move too", () => end("ended"));
  adds = button("Note", "Add each command that the page sends to the script", () =>
    adds.setAttribute("aria-pressed", adds.getAttribute("aria-pressed") !== "true"));
  adds.setAttribute("aria-pressed", false);
  const store = button("Store place", "Add a line that comes back to the present position reading", () => {
    const position_m = newest.figures.position ?? null;
    if (position_m !== null) append(`position ${(1e9 * position_m).toFixed(1)}nm`);
  });
  const [open, file] = fileButton("Open…", "Read a script from a file", async (chosen) => {
    lines.value = await chosen.text();
    lines.oninput();
  });
  const save = button("Save", "Save the script as a file", () => saveAs(new Blob([lines.value]), "script.txt"));
  addEventListener("keydown", (event) => event.key === "Escape" && waiting && end("ended by STOP"));
  whenStateComes((latest) => {
    state = latest;
    greyAll();
  });
  made.append(lines, inRow([run, halt, adds]), inRow([store, open, save]), file, told);
  show("");
}
