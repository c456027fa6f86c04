// Plots as SVG: they take their colours from the style sheet, print sharply, and their points can have the focus.

const tip = document.getElementById("tip");

/// Shows the tooltip beside a point of the window.
function showTip(content, x, y) {
  tip.replaceChildren(...content);
  tip.hidden = false;
  const box = tip.getBoundingClientRect(), room = document.documentElement;
  tip.style.left = `${Math.max(8, x + box.width + 24 > room.clientWidth ? x - box.width - 14 : x + 14)}px`;
  tip.style.top = `${Math.max(8, y + box.height + 24 > room.clientHeight ? y - box.height - 14 : y + 14)}px`;
}
const hideTip = () => { tip.hidden = true; };
addEventListener("scroll", hideTip, {passive: true});
addEventListener("keydown", event => { if (event.key === "Escape") hideTip(); });

/// Moves the focus to the mark with a label, after a plot was drawn again.
function refocus(holder, label) {
  const marks = [...holder.querySelectorAll("[tabindex]")], mark = marks.find(m => m.getAttribute("aria-label") === label);
  if (!mark) return;
  for (const m of marks) m.setAttribute("tabindex", m === mark ? 0 : -1);
  mark.focus({preventScroll: true});
}

/// A figure, titled unless its section has the same title, that draws itself again when its width changes. draw(width) returns an SVG element.
function plot(title, note, draw, table) {
  const holder = el("div", {class: "plot"});
  const box = el("figure", {}, title ? el("figcaption", {}, el("h3", {}, title), note ? el("p", {}, note) : null) : null, holder, table ? alternative(table) : null);
  let drawn = 0;
  box.redraw = () => {
    drawn = Math.floor(holder.clientWidth);
    if (drawn <= 0) return;
    const focused = holder.contains(document.activeElement) ? document.activeElement.getAttribute("aria-label") : null;
    holder.replaceChildren(draw(drawn));
    if (focused !== null) refocus(holder, focused);
  };
  new ResizeObserver(() => { if (Math.floor(holder.clientWidth) !== drawn) box.redraw(); }).observe(holder);
  return box;
}

/// Maps [lo, hi] to [a, b]. `ticks` are values with labels or without.
function linearScale(lo, hi, a, b, text, wanted = 5) {
  if (!(hi > lo)) [lo, hi] = [lo - (Math.abs(lo) || 1) / 2, hi + (Math.abs(hi) || 1) / 2];
  const rough = (hi - lo) / wanted, power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map(m => m * power).find(s => s >= rough);
  const ticks = [];
  for (let i = Math.ceil(lo / step - 1e-9); i * step <= hi + 1e-9 * step; ++i) ticks.push({value: i * step, label: text(i * step)});
  return {at: v => a + (v - lo) / (hi - lo) * (b - a), ticks, lo, hi, log: false};
}

function logScale(lo, hi, a, b, text, wanted = 6) {
  if (!(hi > lo)) [lo, hi] = [lo / 1.5, hi * 1.5];
  const from = Math.log10(lo), to = Math.log10(hi), ticks = [];
  const mantissas = to - from > 3.2 ? [1] : to - from > 1.3 ? [1, 2, 5] : [1, 1.5, 2, 3, 4, 5, 6, 8];
  const every = mantissas.length === 1 ? Math.ceil((to - from) / wanted) : 1;
  for (let e = Math.floor(from); e <= Math.ceil(to); ++e)
    for (const m of mantissas) {
      const value = m * 10 ** e;
      if (value >= lo * 0.999 && value <= hi * 1.001) ticks.push({value, label: e % every === 0 ? text(value) : ""});
    }
  return {at: v => a + (Math.log10(Math.max(v, lo)) - from) / (to - from) * (b - a), ticks, lo, hi, log: true};
}

/// Range of the values with a margin; on logarithmic axes, zeros are drawn at the lower end.
function padded(values, log, margin = 0.06) {
  const usable = values.filter(v => isNumber(v) && (!log || v > 0));
  if (usable.length === 0) return log ? [1, 10] : [0, 1];
  let lo = Math.min(...usable), hi = Math.max(...usable);
  if (log) {
    if (values.some(v => v === 0)) lo /= 3;
    const pad = Math.max((hi / lo) ** margin, 1.04);
    return [lo / pad, hi * pad];
  }
  const pad = (hi - lo || Math.abs(hi) || 1) * margin;
  return [lo >= 0 ? Math.max(0, lo - pad) : lo - pad, hi + pad];
}

/// Draws axes with grid lines and titles; returns the layer for marks.
function frame(svg, width, height, x, y, {xTitle, yTitle, left, bottom, right = 12, top = 12}) {
  const grid = el("g", {class: "axes", "aria-hidden": "true"});
  const below = height - bottom;
  let last = -Infinity;
  for (const tick of x.ticks) {
    const at = x.at(tick.value);
    grid.append(el("line", {class: "grid", x1: at, x2: at, y1: top, y2: below}));
    const half = tick.label.length * 3.4;
    if (!tick.label || at - half < last + 8 || at + half > width) continue;
    last = at + half;
    grid.append(el("text", {x: at, y: below + 16, "text-anchor": "middle"}, tick.label));
  }
  last = Infinity;
  for (const tick of [...y.ticks].sort((a, b) => a.value - b.value)) {
    const at = y.at(tick.value);
    grid.append(el("line", {class: "grid", x1: left, x2: width - right, y1: at, y2: at}));
    if (!tick.label || at > last - 13) continue;
    last = at;
    grid.append(el("text", {x: left - 6, y: at + 4, "text-anchor": "end"}, tick.label));
  }
  grid.append(
    el("line", {class: "axis", x1: left, x2: width - right, y1: below, y2: below}),
    el("text", {class: "title", x: width - right, y: height - 4, "text-anchor": "end"}, xTitle),
    el("text", {class: "title", x: 0, y: top - 27, "dominant-baseline": "hanging"}, yTitle));
  svg.append(grid);
}

/// Places labels where they cover neither each other nor the marks. `marks` and `labels`: {x, y, text}.
function placeLabels(svg, labels, marks, width, height) {
  const taken = marks.map(m => [m.x - 5, m.y - 5, m.x + 5, m.y + 5]);
  for (const {x, y, text, className} of labels) {
    const w = text.length * 7, spots = [[11, 4], [-11 - w, 4], [-w / 2, -11], [-w / 2, 20], [10, -9], [10, 17], [-10 - w, -9], [-10 - w, 17]];
    const boxes = spots.map(([dx, dy]) => [x + dx, y + dy - 11, x + dx + w, y + dy + 3]);
    const cost = b => taken.reduce((sum, t) => sum + (b[0] < t[2] && b[2] > t[0] && b[1] < t[3] && b[3] > t[1] ? 1 : 0), 0) +
      (b[0] < 62 || b[2] > width || b[1] < 10 || b[3] > height - 34 ? 20 : 0);
    const best = boxes.reduce((at, b, i) => (cost(b) < cost(boxes[at]) ? i : at), 0);
    taken.push(boxes[best]);
    svg.append(el("text", {class: `label ${className || ""}`, x: boxes[best][0], y: boxes[best][3] - 3, "aria-hidden": "true"}, text));
  }
}

/// Gives the nearest mark to pointers, and arrow keys to the focus: one mark of a plot is in the tab order.
function interactive(svg, marks, describe, choose) {
  const nearest = event => {
    const box = svg.getBoundingClientRect(), px = event.clientX - box.left, py = event.clientY - box.top;
    let best = null, least = 28 ** 2;
    for (const mark of marks) {
      const d = (mark.x - px) ** 2 + (mark.y - py) ** 2;
      if (d < least) [best, least] = [mark, d];
    }
    return best;
  };
  const light = mark => { for (const m of marks) m.node.classList.toggle("hover", m === mark); };
  svg.addEventListener("pointermove", event => {
    const mark = nearest(event);
    light(mark);
    svg.classList.toggle("pointing", mark !== null && Boolean(choose));
    if (!mark) return hideTip();
    showTip(describe(mark, marks.filter(m => m !== mark && Math.hypot(m.x - mark.x, m.y - mark.y) < 3).length), event.clientX, event.clientY);
  });
  svg.addEventListener("pointerleave", () => { light(null); hideTip(); });
  svg.addEventListener("click", event => { const mark = nearest(event); if (mark && choose) choose(mark.data); });
  marks.forEach((mark, i) => {
    mark.node.setAttribute("tabindex", i === 0 ? 0 : -1);
    mark.node.addEventListener("focus", () => {
      if (!mark.node.matches(":focus-visible")) return;
      const box = mark.node.getBoundingClientRect();
      light(mark);
      showTip(describe(mark, 0), box.right, box.bottom);
    });
    mark.node.addEventListener("blur", () => { light(null); hideTip(); });
    mark.node.addEventListener("keydown", event => {
      const step = {ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1}[event.key];
      const to = event.key === "Home" ? 0 : event.key === "End" ? marks.length - 1 : step ? i + step : null;
      if (to !== null && marks[to]) {
        event.preventDefault();
        mark.node.setAttribute("tabindex", -1);
        marks[to].node.setAttribute("tabindex", 0);
        marks[to].node.focus();
      } else if ((event.key === "Enter" || event.key === " ") && choose) {
        event.preventDefault();
        choose(mark.data);
      }
    });
  });
}

/// Points joined by lines. series: [{name, className, points: [{x, y, label?, data?}]}]; describe(data) gives the tooltip.
function linePlot(width, {series, xLog, yLog, xText, yText, xTitle, yTitle, xTicks, describe, label, height = 270, rules = []}) {
  const left = 58, bottom = 38, right = 16, top = 30, all = series.flatMap(s => s.points);
  const svg = el("svg", {width, height, viewBox: `0 0 ${width} ${height}`, role: "group", "aria-label": label});
  const make = (log, values, a, b, text, wanted) => (log ? logScale : linearScale)(...padded(values, log), a, b, text, wanted);
  const x = make(xLog, all.map(p => p.x), left, width - right, xText, width < 420 ? 4 : 6);
  if (xTicks) x.ticks = xTicks.map(value => ({value, label: xText(value)}));
  const y = make(yLog, [...all.map(p => p.y), ...rules.map(r => r.y)], height - bottom, top, yText, 5);
  frame(svg, width, height, x, y, {xTitle, yTitle, left, bottom, right, top});
  const spots = series.flatMap(s => along(s.points.map(p => ({x: x.at(p.x), y: y.at(p.y)}))));
  const ruled = rules.flatMap(rule => drawRule(svg, rule, y, left, width - right, spots));
  const marks = [], labels = [];
  for (const s of series) {
    svg.append(el("path", {class: `curve ${s.className}`, d: pathOf(s.points.map(p => ({x: x.at(p.x), y: y.at(p.y)})))}));
    for (const p of s.points) {
      const mark = {x: x.at(p.x), y: y.at(p.y), data: p.data, node: null};
      mark.node = el("circle", {class: `mark ${s.className}`, cx: mark.x, cy: mark.y, r: 4, role: "img", "aria-label": describe(p.data).map(n => n.textContent).join(", ")});
      svg.append(mark.node);
      marks.push(mark);
      if (p.label) labels.push({...mark, text: p.label, className: s.className});
    }
  }
  placeLabels(svg, labels, [...marks, ...spots, ...ruled], width, height);
  interactive(svg, marks, mark => describe(mark.data));
  return svg;
}

const pathOf = corners => corners.map((p, i) => `${i ? "L" : "M"}${p.x.toFixed(1)} ${p.y.toFixed(1)}`).join("");

/// Points along a polyline, which labels avoid.
function along(corners) {
  return corners.slice(1).flatMap((to, i) => {
    const from = corners[i], steps = Math.ceil(Math.hypot(to.x - from.x, to.y - from.y) / 8);
    return Array.from({length: steps}, (_, k) => ({x: from.x + (to.x - from.x) * k / steps, y: from.y + (to.y - from.y) * k / steps}));
  });
}

/// A line across the plot, with its text at the end that has fewer marks. Returns points that cover the text.
function drawRule(svg, {y: value, text, className}, y, left, right, marks) {
  const at = y.at(value), size = text.length * 6.5;
  const near = (from, to) => marks.filter(m => m.x > from - 6 && m.x < to + 6 && m.y > at - 24 && m.y < at + 6).length;
  const atLeft = near(right - size, right) > near(left, left + size);
  svg.append(el("line", {class: `rule ${className || ""}`, x1: left, x2: right, y1: at, y2: at}),
    el("text", {class: `label rule ${className || ""}`, x: atLeft ? left + 4 : right, y: at - 5, "text-anchor": atLeft ? "start" : "end", "aria-hidden": "true"}, text));
  return along([{x: atLeft ? left : right - size, y: at - 8}, {x: atLeft ? left + size : right, y: at - 8}]);
}

/// A histogram over bins of equal width on screen: the first edge is 0, the others are logarithmic. So are the heights,
/// because most pixels and samples have almost no error.
function histogram(width, {edges, counts, unit, label, className}) {
  const height = 150, left = 8, bottom = 36, top = 10;
  const svg = el("svg", {width, height, viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": label});
  const total = counts.reduce((a, b) => a + b, 0) || 1, most = Math.max(...counts, 1), step = (width - 2 * left) / counts.length;
  counts.forEach((n, i) => {
    const h = Math.log1p(n) / Math.log1p(most) * (height - bottom - top);
    const bar = el("rect", {class: `bar ${className || ""}`, x: left + i * step + 0.5, y: height - bottom - Math.max(h, n > 0 ? 1 : 0), width: Math.max(step - 1, 0.5), height: Math.max(h, n > 0 ? 1 : 0)});
    svg.append(bar);
  });
  svg.append(el("line", {class: "axis", x1: left, x2: width - left, y1: height - bottom, y2: height - bottom}));
  let last = -Infinity;
  edges.forEach((edge, i) => {
    const text = plain(edge, 2), half = text.length * 3.3, at = Math.min(Math.max(left + i * step, half), width - half);
    if (at - half < last + 10) return;
    last = at + half;
    svg.append(el("line", {class: "axis", x1: left + i * step, x2: left + i * step, y1: height - bottom, y2: height - bottom + 4}),
      el("text", {x: at, y: height - bottom + 16, "text-anchor": "middle"}, text));
  });
  svg.append(el("text", {class: "title", x: width - left, y: height - 4, "text-anchor": "end"}, unit));
  svg.addEventListener("pointermove", event => {
    const i = Math.floor((event.clientX - svg.getBoundingClientRect().left - left) / step);
    if (i < 0 || i >= counts.length) return hideTip();
    showTip([el("strong", {}, `${figure(edges[i])} to ${figure(edges[i + 1])} ${unit}`), el("div", {}, `${count(counts[i])} of ${count(total)} (${figure(counts[i] / total * 100, 2)} %)`)], event.clientX, event.clientY);
  });
  svg.addEventListener("pointerleave", hideTip);
  return svg;
}
