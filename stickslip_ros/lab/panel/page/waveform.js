// Copyright 2026 The stickslip_ros maintainers
// SPDX-License-Identifier: Apache-2.0

// The control of waveforms: a shape of the literature or a file, drawn before it is played.

import { button, DIRECTIONS, fileButton, grey, inRow, make, note, numberField, resolved, whenStateComes } from "./fields.js";
import { Plot } from "./plot.js";
import { ask, wish } from "./socket.js";

const FILE = "file";
const LANE = { share: 1, unit: "V", factor: 1, least: 1, curves: [{ name: "wave", text: "one cycle", colour: "volt" }] };

export function addWaveform(made, command) {
  const { shapes, numbers } = command.wave;
  const fields = make("div"), [amplitude, frequency, cycles] = numbers.map((each) => numberField(command, each));
  const shape = make("select", "", "Shape of one cycle"), box = make("div");
  const label = make("label", "shape"), problem = make("output"), about = make("output");
  const [choose, file] = fileButton("File…", "A table with the columns time and voltage, headed with their units", take);
  file.id = `${command.name}-file`;
  about.className = "note";
  fields.className = "fields";
  label.htmlFor = shape.id = `${command.name}-shape`;
  shape.append(...[...Object.keys(shapes), FILE].map((each) => make("option", each)));
  box.className = "plot wave";
  box.setAttribute("role", "img");
  box.setAttribute("aria-label", "One cycle of the waveform");
  problem.className = "note bad";
  const tell = (text) => {
    problem.textContent = text;
    problem.hidden = !text;
  };
  tell("");
  const plot = new Plot(box, [LANE]);
  let table = null, drawn = [];

  /** Return the rows of time and voltage that a button would send; none while a field is not a number. */
  function rows(sign) {
    if (shape.value === FILE) return table || [];
    const [height, hertz] = [amplitude.read(), frequency.read()], low = resolved("amplifier.voltage_min");
    if (![height, hertz, low].every(Number.isFinite) || hertz <= 0) return [];
    const fall = (height * hertz) / resolved("amplifier.slew_rate");
    return apart(shapes[shape.value].rows, fall).map(([t, y]) => [t / hertz, low + height * (sign > 0 ? y : 1 - y)]);
  }

  const play = async (sign) => {
    const [ofHeight, ofRate] = await Promise.all([amplitude, frequency, cycles].map((each) => each.settle()));
    const values = rows(sign).flat(), isFile = shape.value === FILE, problem = ofHeight || ofRate;
    const why = isFile ? "choose a file" : problem || "the frequency is not above 0 Hz; raise it";
    tell(values.length ? "" : why);
    if (values.length) wish({ do: "command", name: command.name, values, cycles: cycles.read() });
  };
  const buttons = DIRECTIONS.map(([sign, text, where]) => {
    const each = button(text, `Play the waveform ${where}`, () => play(sign));
    each.setAttribute("aria-label", `Waveform ${where}`);
    return each;
  });

  const draw = () => {
    const isFile = shape.value === FILE;
    for (const each of [amplitude, frequency]) each.field.disabled = isFile;
    grey(buttons[0], isFile ? "a file is played as it is" : "");
    shape.title = isFile ? "Rows of a file" : shapes[shape.value].source;
    const limits = ["amplifier.voltage_min", "amplifier.slew_rate"].map(resolved);
    const inputs = isFile ? [table] : [shape.value, amplitude.read(), frequency.read(), ...limits];
    if (inputs.length === drawn.length && inputs.every((each, index) => each === drawn[index])) return;
    const wave = rows(1);
    if (!wave.length) return;
    drawn = inputs;
    const [x, y] = [0, 1].map((part) => wave.map((row) => row[part]));
    plot.draw({ wave: { x, y, base: 0 } }, 0, x.at(-1));
  };
  whenStateComes(draw);
  fields.addEventListener("input", draw); // a state may be a second off
  async function take(chosen) {
    const told = await ask("waveform", chosen.name, chosen);
    tell(told.refused ? `${chosen.name}: ${told.refused}` : "");
    if (told.refused) return;
    table = told.read;
    shape.value = FILE;
    const [length_s, last_v] = table.at(-1);
    about.textContent = `${chosen.name}: ${table.length} rows, ${Number((1e3 * length_s).toPrecision(6))} ms`;
    if (last_v !== table[0][1]) cycles.write(1);
  }
  const numberFields = [amplitude, frequency, cycles].flatMap((each) => each.parts);
  fields.append(label, shape, choose, ...numberFields, file);
  made.append(fields, about, box, inRow(buttons), problem, note(command.name));
}

/** Return rows whose times rise: where two are equal, the wave jumps, and takes a share of the cycle for it. */
function apart(rows, share) {
  const moved = [];
  let later = 0;
  rows.forEach(([time, height], index) => {
    if (index && time === rows[index - 1][0]) later += share * Math.abs(height - rows[index - 1][1]);
    moved.push([time + later, height]);
  });
  return moved.map(([time, height]) => [time / (1 + later), height]);
}
