// Copyright 2026 The stickslip_ros maintainers
// SPDX-License-Identifier: Apache-2.0

// The page: shows what the server says, and tells it what somebody wishes.
// Whatever comes from ROS becomes text, never markup.

import { addControls } from "./controls.js";
import { button, followPicture, followState, make } from "./fields.js";
import { grouped, Plot, tools } from "./plot.js";
import { connect, wish } from "./socket.js";

const NM = 1e9, UM = 1e6, S_PER_NS = 1e-9;
const DIGITS = { nm: 1, mN: 3 }, LEAST = { nm: 10, mN: 1 }, COLOURS = ["runner", "force", "foot"];
const byId = (id) => document.getElementById(id);

const scope = new Plot(byId("scope"), [
  { share: 0.66, unit: "nm", factor: NM, least: 10, curves: [
    { name: "runner", text: "runner", colour: "runner" },
    { name: "foot", text: "foot", colour: "foot", dash: [6, 3] } ] },
  { share: 0.34, unit: "V", factor: 1, least: 10, curves: [
    { name: "voltage", text: "voltage", colour: "volt" } ] },
]);
const history = new Plot(byId("history"), []);
const overview = new Plot(byId("overview"), [
  { share: 1, unit: "nm", factor: NM, least: 10, curves: [
    { name: "position", text: "position", colour: "runner" } ] },
]);

const twin = new Plot(byId("twin-window"), [
  { share: 0.6, unit: "nm", factor: NM, least: 10, curves: [
    { name: "twin_rig", text: "rig", colour: "runner" },
    { name: "twin_twin", text: "twin", colour: "foot", dash: [6, 3] } ] },
  { share: 0.4, unit: "nm", factor: NM, least: 1, curves: [
    { name: "twin_residual", text: "rig less twin", colour: "force" } ] },
]);
const estimates = new Plot(byId("twin-history"), []);

const FILM_MS = 8000, FRAME_MS = 100;
const REDRAWN = ["MOVING", "PRELOADING"]; // bits after whose changes the stand is drawn anew

let sheet = null, state = null, whole = null;

function hear(data) {
  try {
    if (typeof data === "string") read(JSON.parse(data));
    else showFrame(data);
  } finally {
    wish({ do: "dealt with" }); // a busy page is not sent what it cannot show
  }
}

function read(told) {
  if (told.sheet) build(told.sheet);
  if (told.state) showState(told.state);
  if (told.failed) showCondition("failed", `the picture cannot be made: ${told.failed}`);
}

function miss() {
  const condition = { word: "offline", text: "the panel does not answer; trying again" };
  showCondition(condition.word, condition.text);
  if (state && sheet.kind === "drive") followState({ ...state, lifecycle: "", condition });
}

// --- once

function build(told) {
  const isFirst = sheet === null;
  sheet = told;
  if (!isFirst) return;
  document.body.classList.toggle("recording", sheet.kind === "recording");
  fill("cycles", sheet.cycles, (each) => each);
  fill("span", sheet.spans_s, (each) => `${each} s`);
  byId("bits").replaceChildren(...sheet.bits.map((each) => {
    const lamp = make("li", each.name, each.text);
    lamp.classList.toggle("alarm", each.is_alarm);
    return lamp;
  }));
  byId("figures").prepend(...sheet.sensors.map(figure));
  history.setLanes(sheet.sensors.map((each, at) => ({
    share: 1, unit: each.unit, factor: each.factor, least: LEAST[each.unit],
    curves: [{ name: each.name, text: each.words.toLowerCase(), colour: COLOURS[at % COLOURS.length] }],
  })));
  byId("scope-tools").append(...tools(scope, "oscilloscope", button));
  byId("twin-tools").append(...tools(twin, "twin", button));
  byId("history-tools").append(...tools(history, "history", button));
  if (sheet.kind === "drive") addControls(sheet);
  else buildPlayer(sheet.run);
}

/** Return the large figure of a sensor. */
function figure(sensor) {
  const shown = make("dl", "", sensor.text), value = make("b", "–"), behind = make("dd");
  value.id = sensor.name;
  shown.hidden = sensor.is_optional;
  behind.append(value, ` ${sensor.unit}`);
  const name = make("dt", sensor.words), target = make("span");
  target.dataset.targetOf = sensor.name;
  name.append(target);
  shown.append(name, behind);
  return shown;
}

function fill(id, values, words) {
  byId(id).replaceChildren(...values.map((value) => {
    const option = make("option", words(value));
    option.value = value;
    return option;
  }));
}

function buildPlayer(run) {
  const shown = run.points.filter((point) => point[1] !== null);
  whole = { ...run, curve: { x: shown.map((p) => p[0]), y: shown.map((p) => p[1]), base: 0 } };
  fill("speed", run.speeds, (each) => `${each} ×`);
  byId("seek").min = run.start_s;
  byId("seek").max = run.end_s;
  byId("seek").value = run.start_s; // the browser has moved it to the end
  document.title = `${run.name} – stickslip panel`;
}

byId("cycles").onchange = (event) => wish({ do: "view", cycles: Number(event.target.value) });
byId("span").onchange = (event) => wish({ do: "view", span_s: Number(event.target.value) });
byId("drives").onchange = (event) => wish({ do: "attach", drive: event.target.value });
byId("speed").onchange = (event) => wish({ do: "speed", speed: Number(event.target.value) });
byId("seek").oninput = (event) => wish({ do: "seek", time_s: Number(event.target.value) });
byId("seek").onchange = fetchDrawing;
byId("stand").ontoggle = fetchDrawing;
byId("play").onclick = () => wish({ do: "play", wanted: !state.player.plays });
addEventListener("keydown", (event) => {
  if (!sheet) return;
  const isFree = event.target === document.body;
  if (event.key === "Escape" && sheet.kind === "drive") wish({ do: "service", name: "stop" });
  if (event.key === " " && isFree && sheet.kind === "recording") {
    event.preventDefault();
    byId("play").click();
  }
});

// --- once a film

const shadow = byId("drawing").attachShadow({ mode: "open" }), style = new CSSStyleSheet();
let drawing = null, begun_ms = 0;
shadow.adoptedStyleSheets = [style];

async function fetchDrawing() {
  if (document.hidden || !byId("stand").open) return;
  const answer = await fetch("stand.svg").catch(() => null);
  if (!answer) return;
  byId("stand").hidden = !answer.ok;
  if (!answer.ok) return;
  const [before, own, behind] = (await answer.text()).split(/<\/?style>/);
  style.replaceSync(`${own} svg { width: 100%; height: auto; display: block }`);
  drawing = new DOMParser().parseFromString(before + behind, "image/svg+xml").documentElement;
  shadow.replaceChildren(drawing);
  drawing.pauseAnimations(); // a browser would paint it 60 times a second
  begun_ms = performance.now();
}
setInterval(fetchDrawing, FILM_MS);
setInterval(() => {
  if (drawing && byId("stand").open) drawing.setCurrentTime((performance.now() - begun_ms) / 1000);
}, FRAME_MS);

// --- now and then

let redrawing = 0;
function showState(told) {
  const changed = state ? told.bits ^ state.bits : 0, moves = sheet.bits.some((each) => REDRAWN.includes(each.name) && changed & each.bit);
  if (!state || moves || told.lifecycle !== state.lifecycle || told.drive !== state.drive) {
    clearTimeout(redrawing);
    redrawing = setTimeout(fetchDrawing, 500);
  }
  state = told;
  showCondition(state.condition.word, state.condition.text);
  sheet.bits.forEach((each, index) => {
    const isOn = (state.bits & each.bit) !== 0;
    byId("bits").children[index].classList.toggle("on", isOn);
  });
  const target = state.target_m ?? null;
  document.querySelector("[data-target-of=position]").textContent = target === null ? "" : `target ${signed(target * NM, 1)}`;
  showEvents(state.events);
  byId("cycles").value = state.view.cycles;
  byId("span").value = state.view.span_s;
  if (sheet.kind === "drive") {
    showDrives();
    showParts(state.parts);
    followState(state);
  } else {
    byId("play").textContent = state.player.plays ? "Pause" : "Play";
    byId("speed").value = state.player.speed;
  }
}

function showCondition(word, text) {
  document.body.dataset.condition = word;
  const isFresh = ["running", "paused", "late", "waiting", "recording", "foreign"].includes(word);
  document.body.classList.toggle("fresh", isFresh);
  if (byId("word").textContent !== word) byId("word").textContent = word;
  if (byId("why").textContent !== text) byId("why").textContent = byId("condition").title = text;
}

function showDrives() {
  if (byId("source").textContent !== state.drive) byId("source").textContent = state.drive;
  const list = byId("drives"), there = [...list.options].map((each) => each.value);
  if (there.join() !== state.drives.join()) fill("drives", state.drives, (each) => each);
  list.value = state.drive;
}

let newestEvent = "";
function showEvents(events) {
  const now = JSON.stringify(events.at(-1) || null) + events.length;
  if (now === newestEvent) return;
  newestEvent = now;
  byId("events").replaceChildren(...events.toReversed().map((each) => {
    const line = make("p"), when = (each.time_ns * S_PER_NS).toFixed(3);
    const steps = each.steps ? `, ${each.steps} steps` : "";
    const why = each.message ? `: ${each.message}` : "";
    line.append(make("time", `${when} s`), `${each.command} ${each.number} ${each.result}${steps}${why}`);
    line.classList.toggle("bad", !["DONE", each.command === "preload" ? "" : "ABORTED"].includes(each.result));
    return line;
  }));
}

function showParts(parts) {
  const time = (parts.time || {}).values || {}, recorder = parts.recorder || { values: {} };
  const file = recorder.values, faults = parts.faults || { message: "–", level: 0 };
  const rows = [
    ["real-time factor", time.real_time_factor || "–", parts.time && parts.time.level > 1],
    ["lateness, 99 %", time.lateness_p99_us ? `${Number((time.lateness_p99_us / 1e3).toPrecision(2))} ms` : "–"],
    ["overruns", time.overruns_total || "–", Number(time.overruns) > 0],
    ["behind", time.behind_s ? `${Number(time.behind_s).toFixed(3)} s` : "–"],
    ["faults", faults.message, faults.level > 0],
    ["recorder", recorder.message || "–", recorder.level > 1],
    ["file", file.file ? file.file.split("/").at(-1) : "–"],
    ["length, size", file.size_bytes
      ? `${Number(file.length_s).toFixed(1)} s, ${(file.size_bytes / 1e6).toFixed(2)} MB` : "–"],
    ["dropped", file.dropped || "–", Number(file.dropped) > 0],
  ];
  byId("parts").replaceChildren(...rows.flatMap(([name, value, isBad]) => {
    const shown = make("dd", value, value);
    shown.classList.toggle("bad", Boolean(isBad));
    return [make("dt", name), shown];
  }));
}

// --- 25 times a second

function showFrame(data) {
  const size = new DataView(data).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, size)));
  const curves = {};
  let at = 4 + size;
  for (const [name, count, base] of head.curves) {
    const [x, y] = [0, 1].map((part) => new Float32Array(data, at + 4 * part * count, count));
    curves[name] = { x, y, base };
    at += 8 * count;
  }
  if (head.twin) return showTwin(head.twin, curves);
  followPicture(head);
  const none = head.scope ? "no reading" : "–";
  for (const { name, unit, factor } of sheet.sensors) {
    byId(name).closest("dl").hidden = !(name in head.figures);
    if (name in head.figures) showFigure(name, head.figures[name], factor, DIGITS[unit], none);
  }
  showFigure("voltage", head.figures.voltage, 1, 1, none);
  showFigure("velocity", head.figures.velocity, UM, 2, none);
  byId("time").textContent = head.time_s.toFixed(3);
  const length_s = -(curves.position?.x[0] ?? 0), span_s = sheet.spans_s.find((each) => each >= Math.min(length_s, head.span_s));
  history.draw(curves, -Math.min(span_s ?? head.span_s, head.span_s), 0, null, head.time_s);
  showScope(head.scope, curves, head.figures.voltage === null);
  if (whole) {
    overview.draw({ position: whole.curve }, whole.start_s, whole.end_s, head.time_s);
    if (document.activeElement !== byId("seek") || state.player.plays) byId("seek").value = head.time_s;
    byId("place").textContent = `${head.time_s.toFixed(4)} s of ${whole.end_s.toFixed(3)} s`;
  }
  document.body.dataset.frames = Number(document.body.dataset.frames || 0) + 1;
}

function showFigure(id, value, factor, digits, none) {
  byId(id).textContent = value === null ? none : signed(value * factor, digits);
}

/** Return a number with its sign, and thin spaces between thousands. */
function signed(value, digits) {
  const [whole, rest] = Math.abs(value).toFixed(digits).split(".");
  const isBelow = value < 0 && Number(`${whole}.${rest}`) > 0;
  return `${isBelow ? "−" : "+"}${grouped(whole)}.${rest}`;
}

function showScope(told, curves, isBlind) {
  if (!told) return;
  // Base: the place before the fall, from which runner and foot are shown.
  const relative = Object.fromEntries(["runner", "foot"].filter((name) => curves[name])
    .map((name) => [name, { ...curves[name], base: 0 }]));
  scope.draw({ ...relative, voltage: curves.voltage }, told.start_s, told.end_s, told.period_s ? 0 : null, told.at_s);
  byId("trigger").textContent = told.period_s
    ? `fall at ${told.at_s.toFixed(4)} s, ${(1 / told.period_s).toPrecision(4)} Hz`
    : `no ${isBlind ? "voltage" : "falls"}: runs freely; ${nextStep(isBlind)}Freeze holds it`;
}

/** Return what makes falls to trigger on: nothing if the page cannot. */
function nextStep(isBlind) {
  if (whole) return isBlind ? "open it with --map voltage_v=…, " : "go to a saw-tooth on the time line, ";
  return state?.lifecycle === "active" && !isBlind ? "send Sawtooth, " : "";
}

function showTwin({ window: last, length_s, fits, start_s, end_s }, curves) {
  byId("twin").hidden = last.t === undefined && !fits.length;
  if (byId("twin").hidden) return;
  if (length_s) twin.draw(curves, 0, length_s);
  const step = (name) => (name in last ? `${signed(last[name] * NM, 2)} nm` : "–");
  byId("twin-steps").textContent = `window to ${(last.t ?? 0).toFixed(1)} s, ${last.steps ?? 0} steps: `
    + `rig ${step("rig")}, twin ${step("twin")}, residual ${((last.residual_rms ?? 0) * NM).toFixed(2)} nm rms`;
  byId("twin-fits").replaceChildren(...fits.flatMap(([name, text]) => [make("dt", name), make("dd", text)]));
  const names = fits.map(([name]) => name);
  if (estimates.lanes.map((each) => each.curves[0].name).join() !== names.join()) {
    estimates.setLanes(names.map((name, at) => ({ share: 1, unit: "%", factor: 100, least: 1,
      curves: ["", " low", " high"].map((end) => ({ name: name + end, text: end ? `${end.trim()}er end` : name,
        colour: COLOURS[at % COLOURS.length], dash: end ? [2, 3] : undefined })) })));
  }
  if (end_s > start_s) estimates.draw(curves, 0, end_s - start_s);
}

connect(hear, miss);
