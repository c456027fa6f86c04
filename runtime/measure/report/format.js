// Numbers with units, and elements. All text reaches the page as text nodes: names in a scene may hold any characters.

const report = JSON.parse(document.getElementById("data").textContent);
const embedded = report.embedded || {};

/// Value at a dotted path, or null if a part of the path is missing.
function get(object, path) {
  let value = object;
  for (const key of path.split(".")) {
    if (value === null || value === undefined) return null;
    value = value[key];
  }
  return value === undefined ? null : value;
}

const list = value => (Array.isArray(value) ? value : []);
const isNumber = value => typeof value === "number" && Number.isFinite(value);
const none = "–";

/// Three significant digits; with an exponent below 1e-4.
function figure(value, digits = 3) {
  if (!isNumber(value)) return none;
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size < 9.995e-5 || size >= 1e15) return value.toExponential(digits - 1).replace("e-", "e−").replace(/^-/, "−").replace("e+", "e");
  const rounded = Number(value.toPrecision(digits));
  const decimals = Math.max(0, digits - 1 - Math.floor(Math.log10(Math.abs(rounded))));
  return grouped(rounded, decimals);
}

/// As short as possible, for ticks and values that people chose.
function plain(value, digits = 3) {
  if (!isNumber(value)) return none;
  const size = Math.abs(value);
  if (size > 0 && size < 9.995e-4) return value.toExponential(digits - 1).replace(/\.?0*e-/, "e−").replace(/^-/, "−");
  const rounded = Number(value.toPrecision(digits));
  return grouped(rounded, (String(Math.abs(rounded)).split(".")[1] || "").length);
}

/// Fixed decimals with thin spaces between thousands and a true minus sign.
function grouped(value, decimals) {
  const [whole, fraction] = Math.abs(value).toFixed(decimals).split(".");
  const spaced = whole.length > 4 ? whole.replace(/\B(?=(\d{3})+$)/g, "\u202f") : whole;
  return (value < 0 ? "−" : "") + spaced + (fraction ? "." + fraction : "");
}

const count = value => (isNumber(value) ? grouped(value, 0) : none);

const byteUnits = [[1e12, "TB"], [1e9, "GB"], [1e6, "MB"], [1e3, "kB"]];
function bytes(value, number = figure) {
  if (!isNumber(value)) return none;
  for (const [unit, name] of byteUnits) if (Math.abs(value) >= 0.9995 * unit) return `${number(value / unit)}\u00a0${name}`;
  return `${count(value)}\u00a0B`;
}

function seconds(value) {
  if (!isNumber(value)) return none;
  if (value >= 60) return `${Math.floor(value / 60)} min ${Math.round(value % 60)} s`;
  if (value >= 0.9995 || value === 0) return `${figure(value)}\u00a0s`;
  return value >= 9.995e-4 ? `${figure(value * 1e3)}\u00a0ms` : `${figure(value * 1e6)}\u00a0µs`;
}

const rate = value => (isNumber(value) ? `${figure(value)}\u00a0M/s` : none);
const times = value => (isNumber(value) ? `${figure(value, value < 10 ? 2 : 3)}\u00a0×` : none);
const degrees = value => (isNumber(value) ? `${figure(value)}°` : none);
const signed = (value, text) => (isNumber(value) && value > 0 ? "+" : "") + text(value);

/// Change against a base in per cent; "same" below half a per cent.
function change(value, base) {
  if (!isNumber(value) || !isNumber(base) || base === 0) return none;
  const percent = (value / base - 1) * 100;
  if (Math.abs(percent) < 0.5) return "same";
  return percent > 900 ? times(value / base) : `${percent > 0 ? "+" : "−"}${Math.round(Math.abs(percent))}\u00a0%`;
}

/// Text with its units kept beside their numbers.
const unbroken = text => String(text).replace(/(\d) (?=(?:%|[kMGT]?B|[mµ]?s|px|bits)(?![\w/]))/g, "$1\u00a0");

const svgNames = new Set(["svg", "g", "path", "rect", "circle", "line", "text", "title", "tspan"]);

/// Creates an element. `attributes` with a function value are listeners; null, undefined and false are left out.
function el(name, attributes = {}, ...children) {
  const element = svgNames.has(name) ? document.createElementNS("http://www.w3.org/2000/svg", name) : document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (typeof value === "function") element.addEventListener(key, value);
    else if (key === "style") Object.assign(element.style, value); // the policy forbids style attributes
    else element.setAttribute(key, value === true ? "" : String(value));
  }
  element.append(...children.flat(Infinity).filter(child => child !== null && child !== undefined && child !== false));
  return element;
}

/// A name from the scene, isolated from the direction of the text around it.
const named = text => el("bdi", {class: "name"}, text === null || text === undefined || text === "" ? "(no name)" : String(text));

let statusTimer = 0;
/// Announces a message to screen readers.
function announce(message) {
  clearTimeout(statusTimer);
  statusTimer = setTimeout(() => { document.getElementById("status").textContent = message; }, 300);
}

async function copyText(text) {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    const area = el("textarea", {readonly: true, class: "quiet"});
    area.value = text;
    document.body.append(area);
    area.select();
    const copied = document.execCommand("copy"); // for pages without access to the clipboard
    area.remove();
    return copied;
  }
}

/// Text that breaks between words, not after the hyphens of an option.
const code = text => el("code", {}, String(text).split(" ").flatMap((word, i) => (i ? [" ", el("span", {}, word)] : [el("span", {}, word)])));

/// A command with a button that copies it; null without a command.
function command(text, label = "Copy the command") {
  if (!text) return null;
  const button = el("button", {type: "button", class: "copy", "aria-label": label, click: async () => {
    const copied = await copyText(text);
    button.textContent = copied ? "Copied" : "Failed";
    announce(copied ? "Command copied" : "The command could not be copied");
    setTimeout(() => { button.textContent = "Copy"; }, 1500);
  }}, "Copy");
  return el("div", {class: "command"}, code(text), button);
}

/// A table that sorts by its headings. Columns: {name, value: row => number or text, text?: row => shown, numeric?, cell?}.
function table(columns, rows, {caption, sort = null, descending = false, className = ""}) {
  const body = el("tbody");
  const numeric = column => column.numeric !== false;
  const order = {column: sort, descending};
  const heads = columns.map((column, i) => el("th", {scope: "col", class: numeric(column) ? "number" : null},
    el("button", {type: "button", class: "sort", click: () => sortBy(i)}, column.name)));
  function sortBy(i) {
    order.descending = order.column === i ? !order.descending : numeric(columns[i]);
    order.column = i;
    fill();
    announce(`Sorted by ${columns[i].name}, ${order.descending ? "descending" : "ascending"}`);
  }
  function fill() {
    const sorted = [...rows];
    if (order.column !== null) {
      const {value} = columns[order.column];
      const rank = row => { const v = value(row); return v === null || v === undefined ? null : v; };
      sorted.sort((a, b) => {
        const x = rank(a), y = rank(b);
        if (x === null || y === null) return (x === null) - (y === null); // missing values last
        const sign = typeof x === "number" ? x - y : String(x).localeCompare(String(y), "en", {numeric: true});
        return order.descending ? -sign : sign;
      });
    }
    heads.forEach((head, i) => {
      if (i === order.column) head.setAttribute("aria-sort", order.descending ? "descending" : "ascending");
      else head.removeAttribute("aria-sort");
    });
    body.replaceChildren(...sorted.map(row => el("tr", {}, columns.map((column, i) => {
      const shown = column.cell ? column.cell(row) : column.text ? column.text(row) : column.value(row) ?? none;
      return el(i === 0 ? "th" : "td", {scope: i === 0 ? "row" : null, class: numeric(column) ? "number" : null}, shown);
    }))));
  }
  fill();
  return scroller(caption, el("table", {class: className}, el("caption", {class: "quiet"}, caption), el("thead", {}, el("tr", {}, heads)), body));
}

/// A region that scrolls sideways by keyboard too.
const scroller = (label, ...content) => el("div", {class: "scroller", role: "region", "aria-label": label, tabindex: 0}, content);

/// The table behind a plot, folded.
const alternative = (...content) => el("details", {class: "alternative"}, el("summary", {}, "Table"), content);
