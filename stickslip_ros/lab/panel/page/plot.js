// Copyright 2026 The stickslip_ros maintainers
// SPDX-License-Identifier: Apache-2.0

// Curves over time, in lanes above one another: with a cursor, zoom, freeze, and as CSV and PNG.

/* global uPlot */
const LEFT = 72, RIGHT = 26, TOP = 6, BOTTOM = 22; // px
const SHRINK = 0.55; // share of the axis below which it becomes shorter: it shall not flicker
const ZOOM_PX = 5; // shortest way of the pointer that means a zoom
const FONT = "11px system-ui, 'DejaVu Sans', sans-serif";

function label(value, step) {
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  const [whole, rest] = Math.abs(value).toFixed(Math.min(digits, 9)).split(".");
  return (value < -step / 2 ? "−" : "") + grouped(whole) + (rest ? `.${rest}` : "");
}

/** Return whole digits with thin spaces between thousands. */
export function grouped(digits) {
  return digits.replace(/\B(?=(\d{3})+$)/g, "\u2009");
}

export class Plot {
  /** lanes: [{share, unit, factor, least, curves: [{name, text, colour, dash}]}] */
  constructor(box, lanes) {
    this.box = box;
    this.isFrozen = false;
    this.zoom = this.last = this.reference = this.table = this.from = null;
    this.plots = [];
    this.setLanes(lanes);
    new ResizeObserver(() => this.rebuild()).observe(box);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.rebuild());
  }

  /** Those of which no curve is drawn leave their room to the others. */
  setLanes(lanes) {
    this.lanes = lanes.map((each) => ({ ...each, low: NaN, high: NaN }));
    this.rebuild();
  }

  rebuild() {
    for (const each of this.plots) each.destroy();
    this.plots = [];
    this.redraw();
  }

  redraw() {
    if (this.last) this.show(...this.last);
  }

  /** curves: {name: {x, y, base}}, a common x in a lane; start and end on their axis of x; mark: an x, or null;
   *  origin: the time of x = 0. */
  draw(curves, start, end, mark = null, origin = 0) {
    if (!this.isFrozen) this.show(curves, start, end, mark, origin);
  }

  show(curves, start, end, mark, origin) {
    this.last = [curves, start, end, mark, origin];
    if (this.zoom && (this.zoom[0] > end || this.zoom[1] < start)) this.zoom = null;
    const lanes = this.lanes.filter((lane) => lane.curves.some((each) => curves[each.name]));
    if (!lanes.length || !this.box.clientWidth || !this.box.clientHeight) return;
    if (lanes.length !== this.plots.length) {
      for (const each of this.plots) each.destroy();
      const shares = lanes.reduce((sum, lane) => sum + lane.share, 0), room = this.box.clientHeight - BOTTOM;
      this.plots = lanes.map((lane, at) => this.build(lane, room * lane.share / shares, at === lanes.length - 1));
    }
    lanes.forEach((lane, at) => {
      const shown = lane.curves.map((each) => curves[each.name]), { x } = shown.find(Boolean);
      this.plots[at].setData([x, ...shown.map((each) => Array.from(each ? each.y : x, (y) =>
        (!each || Number.isNaN(y) ? null : (y + each.base) * lane.factor)))]);
    });
  }

  build(lane, height, isLast) {
    const style = getComputedStyle(this.box), colour = (name) => style.getPropertyValue(`--${name}`);
    const axis = { stroke: colour("faint"), font: FONT, ticks: { show: false } };
    const inTime = () => (this.last[2] - this.last[1] < 0.5 ? [1e3, "ms"] : [1, "s"]);
    const value = (plot, y, at) => this.reading(plot, y, at, 1, (lane.high - lane.low) / 1000);
    return new uPlot({
      width: this.box.clientWidth,
      height: height + (isLast ? BOTTOM : 0),
      padding: [TOP, RIGHT, TOP, 0],
      cursor: {
        y: false,
        sync: { key: this.box.id },
        drag: { setScale: false },
        bind: { dblclick: () => () => this.zoomTo(null) },
      },
      scales: {
        x: { time: false, range: () => this.zoom || [this.last[1], this.last[2]] },
        y: { range: (plot, low, high) => this.range(lane, low, high) },
      },
      axes: [
        { ...axis, show: isLast, size: BOTTOM, grid: { show: false }, values: (plot, places, ...[, , step]) =>
          places.map((x, at) => label(x * inTime()[0], step * inTime()[0])
            + (at === places.length - 1 ? ` ${inTime()[1]}` : "")) },
        { ...axis, size: LEFT, gap: 6, space: 34, grid: { stroke: colour("grid"), width: 1 },
          values: (plot, places, ...[, , step]) => places.map((y) => label(y, step)) },
      ],
      series: [
        { label: "at", value: (plot, x) => this.reading(plot, x, 0, inTime()[0], 1e-3, ` ${inTime()[1]}`) },
        ...lane.curves.map((each) => ({
          label: `${each.text} (${lane.unit})`, stroke: colour(each.colour), width: 1.6, dash: each.dash, pxAlign: 0,
          points: { show: false }, value,
        })),
      ],
      hooks: {
        ready: [(plot) => { plot.over.onclick = () => this.measureFrom(plot.posToVal(plot.cursor.left, "x")); }],
        setSelect: [(plot) => this.zoomBy(plot)],
        drawAxes: [(plot) => this.drawReference(plot, lane, colour)],
        draw: [(plot) => this.drawMark(plot, this.last[3], colour("faint")), (plot) => this.drawMark(plot, this.from, colour("ink"))],
      },
    }, null, this.box);
  }

  /** Zoom to what was drawn by the pointer. */
  zoomBy(plot) {
    const { left, width } = plot.select;
    if (width < ZOOM_PX) return;
    const ends = [left, left + width].map((each) => plot.posToVal(each, "x"));
    plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    this.zoomTo(ends);
  }

  zoomTo(ends) {
    this.zoom = ends;
    if (!ends) this.from = null;
    this.redraw();
  }

  /** Have the cursor tell changes from a place, too. */
  measureFrom(x) {
    this.from = x;
    this.redraw();
  }

  /** Return a value at the cursor, and its change from the place that was clicked. */
  reading(plot, value, at, factor, step, unit = "") {
    if (value == null) return "";
    const from = this.from === null ? null : plot.data[at][plot.valToIdx(this.from)];
    const change = from == null ? "" : ` (Δ ${label((value - from) * factor, step)}${unit})`;
    return `${label(value * factor, step)}${unit}${change}`;
  }

  /** Keep the curves of now, each with its lowest and highest value, for reference; or forget those that are kept. */
  keep() {
    const kept = !this.reference && this.last && Object.entries(this.last[0]).map(([name, curve]) => {
      const values = Array.from(curve.y).filter((each) => !Number.isNaN(each)).map((each) => each + curve.base);
      return [name, { ...curve, ends: values.length ? [Math.min(...values), Math.max(...values)] : [] }];
    });
    this.reference = kept ? Object.fromEntries(kept) : null;
    this.redraw();
  }

  /** Draw the curves that were kept, on the axes of those of now. */
  drawReference({ ctx: pen, bbox, valToPos }, lane, colour) {
    if (!this.reference) return;
    pen.save();
    pen.beginPath();
    pen.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    pen.clip();
    pen.globalAlpha = 0.4;
    pen.lineWidth = 1.6 * devicePixelRatio;
    for (const { name, colour: own } of lane.curves) {
      const { x, y, base } = this.reference[name] || { x: [] };
      pen.strokeStyle = colour(own);
      pen.beginPath();
      x.forEach((each, at) => pen.lineTo(valToPos(each, "x", true), valToPos((y[at] + base) * lane.factor, "y", true)));
      pen.stroke();
    }
    pen.restore();
  }

  drawMark({ ctx: pen, bbox, valToPos }, mark, colour) {
    if (mark === null) return;
    const x = valToPos(mark, "x", true);
    if (x < bbox.left || x > bbox.left + bbox.width) return;
    pen.save();
    pen.strokeStyle = colour;
    pen.lineWidth = devicePixelRatio;
    pen.setLineDash([3, 3]);
    pen.beginPath();
    pen.moveTo(x, bbox.top);
    pen.lineTo(x, bbox.top + bbox.height);
    pen.stroke();
    pen.restore();
  }

  /** Return the ends of a lane's axis: whole steps, which move only if they must. */
  range(lane, low, high) {
    if (low === null || high === null) [low, high] = [0, 1];
    for (const { name } of lane.curves) {
      const ends = (this.reference?.[name]?.ends || []).map((each) => each * lane.factor);
      [low, high] = [Math.min(low, ...ends), Math.max(high, ...ends)];
    }
    const room = Math.max(0.08 * (high - low), lane.least / 2);
    const [wantedLow, wantedHigh] = [low - room, high + 2.2 * room];
    const fits = low >= lane.low && high <= lane.high;
    if (!fits || wantedHigh - wantedLow < SHRINK * (lane.high - lane.low)) {
      const raw = (wantedHigh - wantedLow) / 10, power = 10 ** Math.floor(Math.log10(raw));
      const step = [1, 2, 5, 10].find((each) => each * power >= raw) * power;
      lane.low = Math.floor(wantedLow / step) * step;
      lane.high = Math.ceil(wantedHigh / step) * step;
    }
    return [lane.low, lane.high];
  }

  /** Return the samples of the picture, in SI units, as stickslip import reads them. */
  async csv(name) {
    const [, start, end, , origin] = this.last;
    return (await fetch(`${name}.csv?${new URLSearchParams({ origin, start, end })}`)).blob();
  }

  /** Return the picture on one canvas, with the names of its curves. */
  canvas() {
    const parts = this.plots.map((each) => each.ctx.canvas), whole = document.createElement("canvas");
    const style = getComputedStyle(this.box), scale = parts[0].width / this.box.clientWidth;
    whole.width = parts[0].width;
    whole.height = parts.reduce((sum, each) => sum + each.height, 0);
    const pen = whole.getContext("2d");
    pen.fillStyle = style.getPropertyValue("--card");
    pen.fillRect(0, 0, whole.width, whole.height);
    pen.font = `${11 * scale}px sans-serif`;
    let top = 0;
    this.plots.forEach((plot, at) => {
      pen.drawImage(parts[at], 0, top);
      let left = (LEFT + 8) * scale;
      for (const { label: name, stroke } of plot.series.slice(1)) {
        pen.fillStyle = stroke(plot);
        pen.fillText(name, left, top + 18 * scale);
        left += pen.measureText(name).width + 16 * scale;
      }
      top += parts[at].height;
    });
    return whole;
  }
}

/** Have the browser save a file. */
export function saveAs(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  URL.revokeObjectURL(link.href);
}

/** Return buttons that freeze a plot, keep its curves for reference, and save what it shows. */
export function tools(plot, name, button) {
  const reference = button("Reference", "Keep these curves, pale, behind those that follow; again: without", () => {
    plot.keep();
    reference.setAttribute("aria-pressed", plot.reference !== null);
  });
  reference.setAttribute("aria-pressed", false);
  const freeze = button("Freeze", "Hold this picture; drag in it to zoom, click to measure from there, double-click for all of it", () => {
    plot.isFrozen = !plot.isFrozen;
    plot.table = plot.isFrozen && plot.last ? plot.csv(name) : null; // later its samples are gone
    freeze.setAttribute("aria-pressed", plot.isFrozen);
  });
  freeze.setAttribute("aria-pressed", false);
  return [
    freeze,
    reference,
    button("CSV", "Save the samples of the picture as a table", async () =>
      plot.last && saveAs(await (plot.table || plot.csv(name)), `${name}.csv`)),
    button("PNG", "Save the picture", () => plot.last && plot.canvas().toBlob((blob) => saveAs(blob, `${name}.png`))),
  ];
}
