// Copyright 2026 The stickslip_ros maintainers
// SPDX-License-Identifier: Apache-2.0

// Controls, made from what the server says of commands, services and faults.

import {
  button, DIRECTIONS, ends, grey, inDigits, inRow, make, newest, note, numberField, refusal, resolved, whenPictureComes, whenStateComes,
} from "./fields.js";
import { addParameters } from "./parameters.js";
import { addScript, noteCommand } from "./script.js";
import { wish } from "./socket.js";
import { addWaveform } from "./waveform.js";

const SWITCHES = {
  enable_amplifier: (state) => lamp(state, "AMPLIFIER_ENABLED"),
  set_paused: (state) => value(state, "time", "paused") === "true",
  set_recording: (state) => Boolean(value(state, "recorder", "file")),
};
const WORDS = {
  enable_amplifier: "Amplifier", set_paused: "Pause", set_recording: "Record",
  step_simulation: "Single block", stop: "STOP (Esc)",
};
const PANEL = "panel"; // of what no control has a place for
const RUN = ["set_paused", "step_simulation", "set_recording"], STOP = ["stop"];
const HANDS = ["jog", "position"], NEXT = "steps"; // above the pictures; first of the controls
const TRANSITIONS = {
  configure: ["unconfigured"], activate: ["inactive"], deactivate: ["active"], cleanup: ["inactive"],
};
const COMMANDS_LEFT = 4;
const STREAM_MS = 40, DRAWN_MS = 500; // so long a slider stands where it was drawn, not where the drive is
const PATIENCE_MS = 3000; // so long a field shows what is wished, before the drive says what it has
const TAKES_KEYS = "input, select, textarea";
const JOG_SHARE = 10; // a jog is renewed so many times before its watchdog ends it

let sheet = null, last = {};

const value = (state, part, name) => ((state.parts[part] || {}).values || {})[name];
const lamp = (state, name) => (state.bits & sheet.bits.find((each) => each.name === name).bit) !== 0;
const title = (name) => WORDS[name] || (name[0].toUpperCase() + name.slice(1)).replaceAll("_", " ");

export function addControls(told) {
  sheet = told;
  const columns = [make("div"), make("div")];
  for (const each of columns) each.className = "column";
  const byHand = ({ name }) => HANDS.includes(name), isNext = ({ name }) => name === NEXT;
  const rest = sheet.commands.filter((each) => !byHand(each)).sort((one, other) => isNext(other) - isNext(one)).map(commandControl);
  columns[0].append(...rest.slice(0, COMMANDS_LEFT));
  columns[1].append(...rest.slice(COMMANDS_LEFT), scriptControl(), standControl(), lifecycleControl(), faultControl());
  addParameters(document.getElementById("parameters"), sheet);
  document.getElementById("hands").replaceChildren(...sheet.commands.filter(byHand).map(commandControl));
  document.getElementById("columns").replaceChildren(...columns);
  const [run, stop] = [RUN, STOP].map((names) => names.filter((name) => sheet.services[name]));
  document.getElementById("run").replaceChildren(inRow(run.map(serviceButton)), notes(run));
  document.getElementById("stop").replaceChildren(...stop.map(serviceButton));
  document.getElementById("told").replaceChildren(notes([...stop, PANEL]));
}

function group(name, text, needsDrive = true, about = "") {
  const made = make("fieldset"), legend = make("legend", title(name), text), beside = make("span");
  beside.className = "unit";
  legend.append(" ", beside);
  made.append(legend);
  whenStateComes(() => { beside.textContent = about.replace(/{(.*?)}/g, (_, told) => inDigits(resolved(told) ?? "–")); });
  if (needsDrive) whenStateComes((state) => {
    if (made.disabled === !refusal(state)) made.querySelectorAll("button").forEach((each) => grey(each, refusal(state)));
    made.disabled = Boolean(refusal(state));
  });
  return made;
}

function notes(names) {
  const made = make("div");
  made.className = "notes";
  made.append(...names.map(note));
  return made;
}

// --- commands

function commandControl(command) {
  const made = group(command.name, command.text, true, command.about), send = (values) => {
    wish({ do: "command", name: command.name, values });
    if (command.way === "form") noteCommand(command.name, values);
  };
  if (command.way === "wave") addWaveform(made, command);
  else {
    const fields = make("div"), numbers = command.numbers.map((each) => numberField(command, each));
    fields.className = numbers.length === 1 ? "single" : "fields";
    fields.append(...numbers.flatMap((each) => each.parts));
    const read = (sign) => numbers.map((each) => each.read(each.name === command.signed ? sign : 1));
    const senders = sending(command, numbers, read, send);
    if (numbers.length === 1) fields.append(...senders);
    made.append(fields, ...(numbers.length === 1 ? [] : [inRow(senders)]));
    if (command.step) made.append(stepper(command, send));
    made.append(note(command.name));
    if (command.beside.length) made.append(fold(command.beside.map((each) => each.replace(/.*\./, "").replace("_", " ")).join(", "), "Live parameters",
      command.beside.map(liveField)));
  }
  return made;
}

/** Return what sends a command: a slider, a button, or one for each direction. */
function sending(command, numbers, read, send) {
  if (command.way === "slide") return [slider(command, numbers[0], send)];
  if (!command.signed) {
    const made = button("Send", command.text, () => send(read(1)));
    made.setAttribute("aria-label", `Send ${command.name}`);
    return [made];
  }
  return DIRECTIONS.map(([sign, text, where]) => {
    const isHeld = command.way === "hold", name = `${title(command.name)} ${where}`;
    const about = isHeld ? `${name}, as long as the button, or ${sign < 0 ? "←" : "→"}, is held` : name;
    const made = button(text, about, isHeld ? null : () => send(read(sign)));
    made.setAttribute("aria-label", name);
    if (isHeld) holds(made, sign < 0 ? "ArrowLeft" : "ArrowRight", () => send(read(sign)), () => send([0]));
    return made;
  });
}

/** Return what moves by a step: from the target that is held, or else from where the runner is. */
function stepper(command, send) {
  const made = make("div"), step = numberField(command, command.step);
  made.className = "single";
  made.append(...step.parts, ...DIRECTIONS.map(([sign, text, where]) => {
    const name = `Step ${where}`, each = button(text, `${name}, from the target that is held, else from the reading`, async () => {
      await step.settle();
      const from = last.target_m ?? newest.figures.position ?? null, by = step.read(sign);
      if (from !== null) send([typeof by === "string" ? by : from + by]);
    });
    each.setAttribute("aria-label", name);
    return each;
  }));
  return made;
}

/** A slider that follows the drive, and sends while it is drawn, not too often; Enter in the field sends too. */
function slider(command, number, send) {
  const made = make("input", "", command.text);
  made.type = "range";
  made.step = "any";
  made.setAttribute("aria-label", title(command.name));
  whenStateComes(() => {
    const [low, high] = [number.low, number.high].map(resolved);
    if (low === null || high === null || (Number(made.max) === high && Number(made.min) === low)) return;
    made.min = low;
    made.max = high;
    made.step = (high - low) / 1000;
  });
  let timer = 0, drawnAt = -Infinity;
  whenPictureComes(() => {
    const present = newest.figures[command.name] ?? null;
    if (present === null || timer || performance.now() < drawnAt + DRAWN_MS) return; // a busy page sends late
    made.value = present;
    if (document.activeElement !== number.field) number.write(Number(present.toFixed(1)));
  });
  const later = () => {
    timer ||= setTimeout(() => {
      timer = 0;
      send([number.read()]);
    }, STREAM_MS);
  };
  made.oninput = () => {
    number.write(Number(Number(made.value).toFixed(1)));
    drawnAt = performance.now();
    later();
  };
  number.field.addEventListener("change", () => {
    made.value = number.read();
    send([number.read()]);
  });
  return made;
}

/** Have a button repeat something as long as it, or its key, is held, and end it then. */
function holds(made, key, repeat, end) {
  let timer = 0;
  const renew = () => (made.matches(":disabled") ? release() : repeat());
  made.classList.add("hold");
  const release = () => {
    if (!timer) return;
    clearInterval(timer);
    timer = 0;
    made.classList.remove("held");
    end();
  };
  const press = () => {
    if (timer || made.matches(":disabled")) return;
    timer = setInterval(renew, (1e3 * (resolved("jog.timeout") || 0.5)) / JOG_SHARE);
    made.classList.add("held");
    repeat();
  };
  const isPress = (event) => event.key === " " || event.key === "Enter";
  made.onpointerdown = (event) => {
    if (event.button !== 0) return;
    made.setPointerCapture(event.pointerId);
    press();
  };
  made.onkeydown = (event) => {
    if (!isPress(event)) return;
    event.preventDefault();
    press();
  };
  made.onkeyup = (event) => isPress(event) && release();
  made.onpointerup = made.onpointercancel = made.onlostpointercapture = made.onblur = release;
  made.oncontextmenu = (event) => event.preventDefault();
  addEventListener("blur", release);
  addEventListener("keydown", (event) => {
    if (event.key === "Escape") release();
    const isFree = !event.target.closest(TAKES_KEYS) && !event.altKey && !event.ctrlKey && !event.metaKey;
    if (event.key === key && isFree && !event.repeat) press();
  });
  addEventListener("keyup", (event) => event.key === key && release());
  document.addEventListener("visibilitychange", release);
}

// --- services

function serviceButton(name) {
  const { text, is_switch: isSwitch } = sheet.services[name];
  const isOn = SWITCHES[name] || (() => false);
  const made = button(title(name), text, () => wish({ do: "service", name, wanted: !isOn(last) }));
  if (name === "stop") made.className = "stop";
  whenStateComes((state) => {
    last = state;
    const needsPause = name === "step_simulation" && !SWITCHES.set_paused(state);
    grey(made, refusal(state) || (needsPause ? "it needs Pause" : ""));
    if (isSwitch) made.setAttribute("aria-pressed", isOn(state));
  });
  return made;
}

function scriptControl() {
  const made = group("script", "commands one after another", false); // it waits for a drive that is silent
  addScript(made);
  return made;
}

function standControl() {
  const made = group("stand", "services of the drive");
  const names = Object.keys(sheet.services).filter((name) => ![...RUN, ...STOP, "clear_faults"].includes(name));
  made.append(...pairs(names.map(serviceButton)), notes(names));
  return made;
}

function pairs(buttons) {
  return buttons.map((each, index) => [each, buttons[index + 1]]).filter((_, index) => index % 2 === 0)
    .map((pair) => inRow(pair.filter(Boolean)));
}

function lifecycleControl() {
  const made = group("lifecycle", "states of the node", false);
  const buttons = Object.entries(TRANSITIONS).map(([transition, from]) => {
    const each = button(title(transition), `${transition}: from ${from.join(", ")}`, () =>
      wish({ do: "lifecycle", name: "lifecycle", transition }));
    whenStateComes(({ lifecycle }) =>
      grey(each, from.includes(lifecycle) ? "" : `the node is ${lifecycle || "not there"}`));
    return each;
  });
  made.append(...pairs(buttons), note("lifecycle"));
  return made;
}

// --- faults

function faultControl() {
  const made = group("faults", "faults that come and go while the drive runs");
  const fields = sheet.faults.map(liveField);
  if (sheet.services.clear_faults) fields.push(serviceButton("clear_faults"));
  const folded = fold("", "Open or fold the faults", fields), now = folded.firstChild;
  whenStateComes(({ parts }) => {
    const text = `${sheet.faults.length} to choose from; now: ${parts.faults?.message || "–"}`;
    if (now.textContent !== text) now.textContent = text;
  });
  made.append(folded, notes(["clear_faults", "fault"]));
  return made;
}

function fold(text, about, fields) {
  const made = make("details"), inside = make("div");
  inside.className = "faults";
  inside.append(...fields);
  made.append(make("summary", text, about), inside);
  return made;
}

/** Return the field of a parameter that changes while the drive runs. */
function liveField(name) {
  const parameter = sheet.parameters[name], isSwitch = parameter.kind === "bool";
  const field = make(parameter.choices.length && !isSwitch ? "select" : "input", "", parameter.text);
  const label = make("label", name.replace(/.*\./, "").replaceAll("_", " "), parameter.text), unit = make("span", parameter.unit);
  label.htmlFor = field.id = name;
  unit.className = "unit";
  if (isSwitch) field.type = "checkbox";
  else if (parameter.choices.length) field.append(...parameter.choices.map((each) => make("option", each)));
  const isNumber = !parameter.choices.length;
  let wished = null, wishedAt = -Infinity;
  field.onchange = () => {
    [wished, wishedAt] = [isSwitch ? String(field.checked) : field.value, performance.now()];
    wish({ do: "set", name, value: wished });
  };
  whenStateComes((state) => {
    if (isNumber) {
      const [low, high] = [parameter.low, resolved(parameter.high)].map((each) => each * parameter.factor);
      field.title = `${parameter.text}; ${ends(low, high)} ${parameter.unit}`.trim();
    }
    if (document.activeElement === field && isNumber) return;
    const present = state.changed[name] ?? parameter.default;
    if (present === wished) wished = null;
    if (wished !== null && performance.now() < wishedAt + PATIENCE_MS) return;
    if (isSwitch) field.checked = present === "true";
    else field.value = inDigits(present);
  });
  const made = make("div");
  made.className = "fields";
  made.append(label, field, unit, note(name));
  return made;
}
