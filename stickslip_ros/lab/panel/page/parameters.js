// Copyright 2026 The stickslip_ros maintainers
// SPDX-License-Identifier: Apache-2.0

// The card of all parameters, from their declarations; what somebody types waits here for Apply.

import { button, ends, fileButton, grey, inDigits, inRow, make, note, resolved, whenStateComes } from "./fields.js";
import { ask, wish } from "./socket.js";

const NAME = "parameters", NOTE = "settings"; // of addresses; of the wish and its note
const ANEW = "an active drive is deactivated, set and activated: it begins anew at 0 s, at rest";

/** Fill a card; it is folded at first. */
export function addParameters(card, { parameters, stages }) {
  const waiting = new Map(), rows = new Map(), list = make("div"), tell = make("output");
  let state = { changed: {}, notes: {} }, sent = null, order = "", problem = "";
  const search = make("input", "", "Words of a name or of its description");
  search.type = "search";
  search.placeholder = "search, such as friction";
  search.setAttribute("aria-label", "Search parameters");
  list.className = "parameters";
  tell.className = "note";
  const present = (name) => state.changed[name] ?? parameters[name].default;
  const seen = (name) => (parameters[name].kind === "str" ? present(name) : inDigits(present(name)));

  const row = (name) => {
    const { text, unit, factor, low, high, choices, source, default: usual, is_live: isLive, is_fixed: isFixed } = parameters[name];
    const made = make("div"), label = make("label", name, text), about = make("small");
    const field = make(choices.length ? "select" : "input", "", text);
    field.append(...choices.map((each) => make("option", each)));
    label.replaceChildren(...name.split(/(?<=[._])/).flatMap((part) => [part, make("wbr")])); // where it may break
    label.htmlFor = field.id = `parameter-${name}`;
    field.disabled = isFixed;
    field.autocomplete = "off";
    field.oninput = () => keep(name, field.value);
    const behind = make("span", unit);
    behind.className = "unit";
    made.append(label, field, behind, about);
    const show = () => {
      const now = seen(name), shown = waiting.get(name) ?? now;
      if (field.value !== shown) field.value = shown;
      const top = resolved(high), isBound = low !== null && top !== null;
      const range = isBound ? `${ends(low * factor, top * factor)} ${unit}`.trim() : "";
      const how = isFixed ? "read at the start" : isLive ? "live" : "";
      const before = waiting.has(name) ? `to apply; now ${now}` : "", from = `default: ${present(name) === usual ? "" : `${usual}, `}${source}`;
      about.textContent = [before, from, range, how].filter(Boolean).join("; ");
      made.classList.toggle("waits", waiting.has(name));
    };
    return { made, show, words: `${name} ${text}`.toLowerCase() };
  };

  function keep(name, text) {
    if ([present(name), seen(name)].includes(text)) waiting.delete(name);
    else waiting.set(name, text);
    showAll();
  }

  function showAll() {
    const names = [...waiting.keys()], begins = names.some((name) => !parameters[name].is_live);
    tell.textContent = problem || (names.length ? `${names.length} to apply: ${begins ? ANEW : "all live, the drive goes on"}` : "");
    tell.classList.toggle("bad", Boolean(problem));
    const none = names.length ? "" : "nothing waits";
    grey(apply, none || (state.lifecycle ? "" : state.condition?.text));
    grey(discard, none);
    const words = search.value.toLowerCase().split(/\s+/);
    const isTop = (name) => waiting.has(name) || name in state.changed;
    const isNamed = (name) => words.every((each) => name.includes(each));
    const sorted = [...rows.keys()].sort((one, other) => isNamed(other) - isNamed(one) || isTop(other) - isTop(one));
    for (const { made, show, words: own } of rows.values()) {
      made.hidden = !words.every((each) => own.includes(each));
      show();
    }
    if (order === sorted.join() || list.contains(document.activeElement)) return; // a field stays where it is typed in
    order = sorted.join();
    list.append(...sorted.map((name) => rows.get(name).made));
  }

  async function read(name, body) {
    const told = await ask(NAME, name, body);
    for (const [each, text] of Object.entries(told.read ?? {})) keep(each, text);
    problem = told.refused ? `${name}: ${told.refused}` : "";
    showAll();
  }

  const apply = button("Apply", `Set what waits; ${ANEW}`, () => {
    sent = { values: Object.fromEntries(waiting), number: state.notes[NOTE]?.number ?? 0 };
    wish({ do: "apply", name: NOTE, values: sent.values });
  });
  const discard = button("Discard", "Forget what waits", () => {
    waiting.clear();
    problem = "";
    showAll();
  });
  const save = make("a", "Save", "Save the parameters that the drive has as a file for --params");
  save.href = `${NAME}.yaml`;
  save.download = `${NAME}.yaml`;
  save.className = "button";
  const stage = make("select", "", "Have the parameters of a stage wait for Apply; the others get their defaults");
  stage.setAttribute("aria-label", "Stage");
  stage.append(...["stage…", ...stages].map((each) => make("option", each)));
  stage.onchange = () => {
    if (stage.selectedIndex) read(stage.value);
    stage.selectedIndex = 0;
  };
  const [open, file] = fileButton("Parameter file…", "Have the parameters of a file of --params wait for Apply", async (chosen) => read(chosen.name, chosen));
  for (const name of Object.keys(parameters)) rows.set(name, row(name));
  search.oninput = showAll;
  list.addEventListener("focusout", () => setTimeout(showAll));
  card.append(make("summary", "Parameters"), search, inRow([apply, discard, stage, open, save]), file, tell, note(NOTE), list);
  whenStateComes((latest) => {
    const isOther = latest.drive !== state.drive && state.drive;
    const told = latest.notes[NOTE];
    state = latest;
    if (isOther) waiting.clear();
    if (sent && told?.text && told.number > sent.number) {
      if (!told.bad) for (const [name, text] of Object.entries(sent.values)) if (waiting.get(name) === text) waiting.delete(name);
      sent = null;
    }
    showAll();
  });
}
