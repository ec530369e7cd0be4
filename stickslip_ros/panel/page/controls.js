// Controls, made from what the server says of commands, services and faults.

import { button, DIRECTIONS, ends, grey, inRow, make, note, numberField, resolved, whenStateComes } from "./fields.js";
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
const ABOVE = ["set_paused", "step_simulation", "set_recording", "stop"];
const TRANSITIONS = {
  configure: ["unconfigured"], activate: ["inactive"], deactivate: ["active"], cleanup: ["inactive"],
};
const COMMANDS_LEFT = 5;
const STREAM_MS = 40;
const PATIENCE_MS = 3000; // so long a field shows what is wished, before the drive says what it has
const JOG_SHARE = 4; // a jog is renewed so many times before its watchdog ends it

let sheet = null, last = {};

const value = (state, part, name) => ((state.parts[part] || {}).values || {})[name];
const lamp = (state, name) => (state.bits & sheet.bits.find((each) => each.name === name).bit) !== 0;
const title = (name) => WORDS[name] || (name[0].toUpperCase() + name.slice(1)).replaceAll("_", " ");

export function addControls(told) {
  sheet = told;
  const columns = [make("div"), make("div")];
  for (const each of columns) each.className = "column";
  const commands = sheet.commands.map(commandControl);
  columns[0].append(...commands.slice(0, COMMANDS_LEFT));
  columns[1].append(...commands.slice(COMMANDS_LEFT), scriptControl(), standControl(), lifecycleControl());
  document.getElementById("controls").replaceChildren(...columns);
  document.getElementById("faults").replaceChildren(faultControl());
  const above = ABOVE.filter((name) => sheet.services[name]);
  document.getElementById("run").replaceChildren(...above.map(serviceButton), notes(above));
}

/** Return why no command is taken; nothing if one is. */
const refusal = (state) => (state.lifecycle === "active" ? "" : state.condition.text);

function group(name, text, needsDrive = true) {
  const made = make("fieldset");
  made.append(make("legend", title(name), text));
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
  const made = group(command.name, command.text), send = (values) => {
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
    made.append(fields, ...(numbers.length === 1 ? [] : [inRow(senders)]), note(command.name));
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
    const about = isHeld ? `${name}, as long as the button is held` : name;
    const made = button(text, about, isHeld ? null : () => send(read(sign)));
    made.setAttribute("aria-label", name);
    if (isHeld) holds(made, () => send(read(sign)), () => send([0]));
    return made;
  });
}

/** A slider that sends while it is drawn, not too often; Enter in the field sends too. */
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
    made.value = resolved(command.numbers[0].start) || 0;
  });
  let timer = 0;
  const later = () => {
    timer ||= setTimeout(() => {
      timer = 0;
      send([number.read()]);
    }, STREAM_MS);
  };
  made.oninput = () => {
    number.field.value = Number(made.value).toPrecision(4);
    number.field.dataset.touched = "yes";
    later();
  };
  number.field.addEventListener("change", () => {
    made.value = number.read();
    send([number.read()]);
  });
  return made;
}

/** Have a button repeat something as long as it is held, by pointer or key, and end it then. */
function holds(made, repeat, end) {
  let timer = 0;
  const release = () => {
    if (!timer) return;
    clearInterval(timer);
    timer = 0;
    made.classList.remove("held");
    end();
  };
  const press = () => {
    if (timer || made.matches(":disabled")) return;
    const watchdog_s = resolved("jog.timeout") || 0.5;
    timer = setInterval(() => (made.matches(":disabled") ? release() : repeat()), (1e3 * watchdog_s) / JOG_SHARE);
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
  addEventListener("keydown", (event) => event.key === "Escape" && release());
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
  const made = group("script", "commands one after another");
  addScript(made);
  return made;
}

function standControl() {
  const made = group("stand", "services of the drive");
  const names = Object.keys(sheet.services).filter((name) => !ABOVE.includes(name) && name !== "clear_faults");
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
  const made = group("faults", "faults that come and go while the drive runs"), fields = make("div");
  fields.className = "faults";
  fields.append(...sheet.faults.map(faultField));
  if (sheet.services.clear_faults) fields.append(serviceButton("clear_faults"));
  made.append(fields, notes(["clear_faults", "fault"]));
  return made;
}

function faultField(fault) {
  const short = fault.name.replace(/^fault\./, "");
  const field = make(fault.choices.length ? "select" : "input", "", fault.text);
  const label = make("label", short.replaceAll("_", " "), fault.text), unit = make("span", fault.unit);
  label.htmlFor = field.id = fault.name;
  unit.className = "unit";
  if (fault.choices.length) field.append(...fault.choices.map((each) => make("option", each)));
  else if (fault.kind === "bool") field.type = "checkbox";
  else {
    field.inputMode = "decimal";
    unit.textContent = fault.unit;
    field.title += `; ${ends(fault.low * fault.factor, fault.high * fault.factor)} ${fault.unit}`;
  }
  const isNumber = ["float", "int"].includes(fault.kind);
  let wished = null, wishedAt = -Infinity;
  field.onchange = () => {
    let wanted = fault.kind === "bool" ? field.checked : field.value;
    const number = Number(String(wanted).replace(",", "."));
    if (isNumber && wanted !== "" && !Number.isNaN(number)) wanted = number / fault.factor;
    wish({ do: "fault", name: fault.name, value: wanted });
    [wished, wishedAt] = [fault.kind === "bool" ? (wanted ? "True" : "False") : String(wanted), performance.now()];
  };
  whenStateComes((state) => {
    if (document.activeElement === field && isNumber) return;
    const present = value(state, "faults", short) ?? String(fault.default);
    if (present === wished) wished = null;
    if (wished !== null && performance.now() < wishedAt + PATIENCE_MS) return;
    if (fault.kind === "bool") field.checked = present === "True";
    else field.value = isNumber ? Number((Number(present) * fault.factor).toPrecision(9)) : present;
  });
  const made = make("div");
  made.className = "fields";
  made.append(label, field, unit, note(fault.name));
  return made;
}
