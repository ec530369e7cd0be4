// Curves on a canvas: lanes above one another, with one time axis.

const LEFT = 58, RIGHT = 10, TOP = 4, BOTTOM = 20, GAP = 10;
const SHRINK = 0.55; // share of the axis below which it becomes shorter: it shall not flicker

/** Return a step of 1, 2 or 5 times a power of ten that divides a range into about so many. */
function niceStep(range, count) {
  const raw = range / count, power = 10 ** Math.floor(Math.log10(raw));
  return [1, 2, 5, 10].find((each) => each * power >= raw) * power;
}

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
  /** lanes: [{share, unit, factor, curves: [{name, text, colour, dash}]}] */
  constructor(canvas, lanes) {
    this.canvas = canvas;
    this.setLanes(lanes);
    this.last = null;
    new ResizeObserver(() => this.redraw()).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.redraw());
  }

  /** Those of which no curve is drawn leave their room to the others. */
  setLanes(lanes) {
    this.lanes = lanes.map((each) => ({ ...each, low: NaN, high: NaN }));
  }

  redraw() {
    if (this.last) this.draw(...this.last);
  }

  /** curves: {name: {x, y, base}}; start and end on their axis of x; mark: an x, or null. */
  draw(curves, start, end, mark = null) {
    this.last = [curves, start, end, mark];
    const { canvas } = this, scale = window.devicePixelRatio || 1;
    const width = canvas.clientWidth, height = canvas.clientHeight;
    if (!width || !height) return;
    if (canvas.width !== Math.round(width * scale) || canvas.height !== Math.round(height * scale)) {
      canvas.width = Math.round(width * scale);
      canvas.height = Math.round(height * scale);
    }
    const pen = canvas.getContext("2d");
    pen.setTransform(scale, 0, 0, scale, 0, 0);
    pen.clearRect(0, 0, width, height);
    pen.font = "11px system-ui, 'DejaVu Sans', sans-serif";
    const style = getComputedStyle(canvas);
    const colour = (name) => style.getPropertyValue(`--${name}`);
    const across = (x) => LEFT + ((x - start) / (end - start)) * (width - LEFT - RIGHT);
    const lanes = this.lanes.filter((lane) => lane.curves.some((each) => curves[each.name]));
    const shares = lanes.reduce((sum, lane) => sum + lane.share, 0);
    const room = height - TOP - BOTTOM - GAP * (lanes.length - 1);
    let top = TOP;
    for (const lane of lanes) {
      const box = { top, bottom: top + room * lane.share / shares };
      this.lane(pen, lane, curves, box, across, width, colour);
      top = box.bottom + GAP;
    }
    this.times(pen, start, end, across, height, colour);
    if (mark !== null) {
      pen.strokeStyle = colour("faint");
      pen.setLineDash([3, 3]);
      pen.beginPath();
      pen.moveTo(across(mark), TOP);
      pen.lineTo(across(mark), height - BOTTOM);
      pen.stroke();
      pen.setLineDash([]);
    }
  }

  lane(pen, lane, curves, box, across, width, colour) {
    const [low, high] = this.range(lane, curves);
    const down = (y) => box.bottom - ((y - low) / (high - low)) * (box.bottom - box.top);
    const step = niceStep(high - low, Math.max(2, (box.bottom - box.top) / 34));
    pen.lineWidth = 1;
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    for (let y = Math.ceil(low / step) * step; y <= high + step * 1e-6; y += step) {
      pen.strokeStyle = colour("grid");
      pen.beginPath();
      pen.moveTo(LEFT, down(y));
      pen.lineTo(width - RIGHT, down(y));
      pen.stroke();
      pen.fillStyle = colour("faint");
      pen.fillText(label(y, step), LEFT - 6, Math.min(Math.max(down(y), box.top + 5), box.bottom - 5));
    }
    pen.save();
    pen.beginPath();
    pen.rect(LEFT, box.top - 2, width - LEFT - RIGHT, box.bottom - box.top + 4);
    pen.clip();
    for (const each of lane.curves) {
      const curve = curves[each.name];
      if (curve) this.curve(pen, curve, lane.factor, across, down, colour(each.colour), each.dash);
    }
    pen.restore();
    let left = LEFT + 8;
    pen.textAlign = "left";
    for (const each of lane.curves) {
      const text = `${each.text} (${lane.unit})`, long = pen.measureText(text).width;
      pen.fillStyle = colour("card");
      pen.globalAlpha = 0.85;
      pen.fillRect(left - 4, box.top + 1, long + 34, 16);
      pen.globalAlpha = 1;
      pen.strokeStyle = colour(each.colour);
      pen.lineWidth = 2;
      pen.setLineDash(each.dash || []);
      pen.beginPath();
      pen.moveTo(left, box.top + 9);
      pen.lineTo(left + 20, box.top + 9);
      pen.stroke();
      pen.setLineDash([]);
      pen.fillStyle = colour("ink");
      pen.fillText(text, left + 25, box.top + 9);
      left += long + 44;
    }
  }

  curve(pen, { x, y, base }, factor, across, down, colour, dash) {
    pen.strokeStyle = colour;
    pen.lineWidth = 1.6;
    pen.lineJoin = "round";
    pen.setLineDash(dash || []);
    pen.beginPath();
    let isBroken = true;
    for (let i = 0; i < x.length; i++) {
      if (Number.isNaN(y[i])) {
        isBroken = true;
        continue;
      }
      const place = [across(x[i]), down((y[i] + base) * factor)];
      if (isBroken) pen.moveTo(...place);
      else pen.lineTo(...place);
      isBroken = false;
    }
    pen.stroke();
    pen.setLineDash([]);
  }

  /** Return the ends of a lane's axis: whole steps, which move only if they must. */
  range(lane, curves) {
    let low = Infinity, high = -Infinity;
    for (const { name } of lane.curves) {
      const { y, base } = curves[name] || { y: [], base: 0 };
      for (const each of y) {
        if (Number.isNaN(each)) continue;
        low = Math.min(low, (each + base) * lane.factor);
        high = Math.max(high, (each + base) * lane.factor);
      }
    }
    if (low > high) [low, high] = [0, 1];
    const room = Math.max(0.08 * (high - low), lane.least / 2);
    const [wantedLow, wantedHigh] = [low - room, high + 2.2 * room];
    const fits = low >= lane.low && high <= lane.high;
    if (!fits || wantedHigh - wantedLow < SHRINK * (lane.high - lane.low)) {
      const step = niceStep(wantedHigh - wantedLow, 10);
      lane.low = Math.floor(wantedLow / step) * step;
      lane.high = Math.ceil(wantedHigh / step) * step;
    }
    return [lane.low, lane.high];
  }

  times(pen, start, end, across, height, colour) {
    const [factor, unit] = end - start < 0.5 ? [1e3, "ms"] : [1, "s"];
    const step = niceStep((end - start) * factor, 8);
    pen.textAlign = "center";
    pen.textBaseline = "top";
    pen.fillStyle = colour("faint");
    for (let x = Math.ceil((start * factor) / step) * step; x <= end * factor + step * 1e-6; x += step) {
      const isLast = x + step > end * factor + step * 1e-6;
      const text = label(x, step) + (isLast ? ` ${unit}` : "");
      const place = Math.min(across(x / factor), across(end) - pen.measureText(text).width / 2);
      pen.fillText(text, place, height - BOTTOM + 6);
    }
  }
}
