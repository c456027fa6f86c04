// Pictures: float against packed, the difference as a heat map, and the worst tiles.

const uris = embedded.pictures || {};
const uriOf = path => (typeof path === "string" && Object.hasOwn(uris, path) ? uris[path] : null);

/// An image element, or null if the picture is not in the page.
function pictureOf(path, text) {
  const uri = uriOf(path);
  return uri && el("img", {src: uri, alt: text, decoding: "async"});
}

/// The colours of heat_map() (runtime/image/false_color.h).
const heatLegend = white => el("div", {class: "heat-legend"}, el("span", {}, "0"), el("span", {class: "ramp"}), el("span", {}, isNumber(white) ? `${plain(white)} and above` : "1"));

/// Float over packed, with a movable edge between them.
function wipe(picture) {
  const left = pictureOf(picture.float, `${picture.title}: float reference`), right = pictureOf(picture.packed, `${picture.title}: packed`);
  if (!left || !right) return el("p", {class: "muted"}, "These pictures were left out to keep this file small; see ", el("code", {}, String(picture.packed)), ".");
  const slider = el("input", {type: "range", min: 0, max: 100, value: 50, id: "wipe", "aria-label": "Edge between the float picture, left, and the packed one, right"});
  const edge = el("span", {class: "edge", "aria-hidden": "true"});
  const stage = el("div", {class: "stage"}, right, left, edge, el("span", {class: "corner left", "aria-hidden": "true"}, "float"), el("span", {class: "corner right", "aria-hidden": "true"}, "packed"));
  left.classList.add("over");
  const show = () => {
    left.style.clipPath = `inset(0 ${100 - slider.value}% 0 0)`;
    edge.style.left = `${slider.value}%`;
    slider.setAttribute("aria-valuetext", `${slider.value} % float`);
  };
  const drag = event => {
    if (event.type === "pointermove" && event.buttons === 0 && event.pointerType !== "mouse") return;
    const box = stage.getBoundingClientRect();
    slider.value = 100 * (event.clientX - box.left) / box.width;
    show();
  };
  stage.addEventListener("pointermove", drag);
  stage.addEventListener("pointerdown", drag);
  slider.addEventListener("input", show);
  show();
  return el("div", {}, stage, slider);
}

function tileList(tiles) {
  return el("ul", {class: "tiles"}, tiles.map(tile => el("li", {}, el("div", {class: "triple"}, ["float", "packed", "difference"].map(kind => el("figure", {}, pictureOf(tile[kind], `${kind}, pixels ${tile.x}, ${tile.y}`) || el("span", {class: "hole"}), el("figcaption", {}, kind)))),
    el("p", {}, placeName(tile), el("br"), el("span", {class: "muted"}, `error ${figure(tile.mae, 2)}, at most ${figure(tile.max, 2)}; ${tile.width} × ${tile.height} pixels at ${tile.x}, ${tile.y}`)))));
}

function pictureSection() {
  const pictures = list(report.pictures), tiles = list(report.tiles);
  if (pictures.length === 0 && tiles.length === 0) return null;
  const chooser = el("select", {id: "picture-choice"}, pictures.map(p => el("option", {}, p.title || p.id)));
  const body = el("div", {class: "grid two"}), worst = el("div");
  function show() {
    const picture = pictures[chooser.selectedIndex] || pictures[0];
    if (picture) {
      const difference = pictureOf(picture.difference, `${picture.title}: difference of packed and float`);
      body.replaceChildren(el("div", {}, el("h3", {}, "Float and packed"), wipe(picture)), el("div", {}, el("h3", {}, "Difference"), difference ? el("div", {class: "stage still"}, difference) : el("p", {class: "muted"}, "Left out to keep this file small."), heatLegend(picture.difference_white)));
    }
    const own = tiles.filter(t => picture && t.point_id === picture.id), rest = own.length ? own : tiles;
    const shown = rest.filter(t => uriOf(t.packed));
    worst.replaceChildren(...(shown.length ? [el("h3", {}, own.length || !picture ? "Worst tiles" : `Worst tiles of ${get(byId.get(rest[0].point_id), "label") || rest[0].point_id}`), tileList(shown)] : []));
  }
  chooser.addEventListener("change", show);
  show();
  return el("section", {id: "pictures", "aria-labelledby": "pictures-title"}, el("h2", {id: "pictures-title"}, "Where it differs"),
    pictures.length > 1 ? el("div", {class: "fields"}, el("label", {for: "picture-choice"}, "Picture"), chooser) : null, body, worst);
}
