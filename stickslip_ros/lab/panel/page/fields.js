// Copyright 2026 The stickslip_ros maintainers
// SPDX-License-Identifier: Apache-2.0

// The parts of a control: fields, buttons, notes; and the state of the drive, which they follow.

import { grouped } from "./plot.js";
import { ask } from "./socket.js";

/** What the newest picture tells: simulated time (s) and figures, in SI units. */
export const newest = { time_s: 0, figures: {} };

let parameters = {}, drive = null, earlier = 0;
const updates = [], pictures = [];

/** Return a limit or a first value: itself, or that of the parameter which it names. */
export function resolved(told) {
  if (typeof told !== "string") return told;
  const found = parameters[told.replace(/^-/, "")];
  return found === undefined ? null : told.startsWith("-") ? -found : found;
}

/** Return a value, or its text, with five significant digits of each number with a point. */
export const inDigits = (told) => String(told).replace(/-?\d+\.\d+(e[-+]?\d+)?/g, (each) => Number(Number(each).toPrecision(5)));

/** Return why no command is taken; nothing if one is. */
export const refusal = (state) => (state.lifecycle === "active" ? "" : state.condition.text);

export function whenStateComes(update) {
  updates.push(update);
}

export function whenPictureComes(update) {
  pictures.push(update);
}

export function followPicture({ time_s, figures }) {
  Object.assign(newest, { time_s, figures });
  for (const update of pictures) update();
}

export function followState(state) {
  parameters = state.parameters;
  if (state.drive !== drive) {
    drive = state.drive;
    earlier = Math.max(0, ...Object.values(state.notes).map((each) => each.number));
  }
  for (const update of updates) update(state);
}

export function make(tag, text = "", title = "") {
  const made = document.createElement(tag);
  made.textContent = text;
  if (title) made.title = title;
  return made;
}

/** A line beside a control: how what it did on this page has ended. */
export function note(name) {
  const made = make("output");
  made.className = "note";
  made.dataset.note = name;
  let shown = -1;
  whenStateComes((state) => {
    const told = state.notes[name] || { text: "", bad: false, number: 0 };
    if (told.number === shown || (told.number && told.number <= earlier)) return;
    shown = told.number;
    made.textContent = made.title = told.text;
    made.classList.toggle("bad", told.bad);
  });
  return made;
}

export function button(text, about, onclick) {
  const made = make("button", text, about);
  made.type = "button";
  made.dataset.about = about;
  if (onclick) made.onclick = onclick;
  return made;
}

/** Return a button that has a file chosen and takes it, and its field, which is hidden. */
export function fileButton(text, about, take) {
  const file = make("input"), made = button(text, about, () => {
    file.value = ""; // the same one may be read again
    file.click();
  });
  file.type = "file";
  file.hidden = true;
  file.onchange = () => file.files[0] && take(file.files[0]);
  return [made, file];
}

/** Grey a button and have it say why; without a reason it is as it was. */
export function grey(made, why) {
  made.disabled = Boolean(why);
  made.title = why ? `${made.dataset.about} – not now: ${why}` : made.dataset.about;
}

/** Sign, text and name of each direction of a command. */
export const DIRECTIONS = [[-1, "◀ −x", "backwards"], [1, "+x ▶", "forwards"]];

export function inRow(parts) {
  const row = make("div");
  row.className = "row";
  row.append(...parts);
  return row;
}

/** Return the range of a number as people read it; null is no upper end. */
export function ends(low, high) {
  const shown = (each) => grouped(String(Number(Math.abs(each).toPrecision(9))));
  if (!high) return `from ${shown(low)}`;
  return low === -high ? `± ${shown(high)}` : `${low < 0 ? "−" : ""}${shown(low)} to ${shown(high)}`;
}

export function numberField(command, { name, label: key, unit, factor, low, high, start, words }) {
  const id = `${command.name}-${name}`, about = `${command.name}: ${name}${unit && `, ${unit}`}`;
  const label = make("label", name), field = make("input", "", about), range = make("span", unit);
  label.htmlFor = field.id = id;
  field.inputMode = "decimal";
  field.autocomplete = "off";
  range.className = "unit";
  const shown = (told) => String(Number((told * factor).toPrecision(9)));
  whenStateComes(() => {
    const [least, most, first] = [low, high, start].map(resolved);
    if (!field.dataset.touched && first !== null && document.activeElement !== field) field.value = shown(first);
    const isKnown = least !== null && (most !== null || high === null);
    const text = words || `${isKnown ? ends(least * factor, most * factor) : ""} ${unit}`.trim();
    if (range.textContent !== text) range.textContent = text;
  });
  field.addEventListener("input", () => {
    field.dataset.touched = "yes";
  });
  const read = (sign = 1) => { // the server knows units
    const text = field.value.trim(), number = Number(text);
    if (text !== "" && Number.isFinite(number)) return (sign * number) / factor;
    return sign > 0 ? text : text.startsWith("-") ? text.slice(1) : `-${text}`;
  };
  field.addEventListener("keydown", (event) => {
    if (event.key !== "Enter") return;
    const beside = ["div", "fieldset"].map((each) => field.closest(each).querySelector("button:last-of-type"));
    beside.find(Boolean)?.click();
  });
  const write = (number) => {
    field.value = shown(number);
    field.dataset.touched = "yes";
    field.setAttribute("aria-invalid", false);
  };
  /** Have the server read a text with a unit or a comma; return why it cannot. */
  const settle = async () => {
    const told = typeof read() === "string" ? await ask("number", `${command.name} ${key}`, field.value) : {};
    if (told.read !== undefined) write(told.read);
    field.setAttribute("aria-invalid", Boolean(told.refused));
    return told.refused ?? "";
  };
  field.addEventListener("change", settle);
  return { name, field, read, write, settle, low, high, parts: [label, field, range] };
}
