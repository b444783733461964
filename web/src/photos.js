// The photos: each beside its prediction, or what differs between them, with a divider and zoom.

const MAX_ZOOM = 40;
const PIXELS_SHOW = 3; // zoom from which single pixels are shown

// Connects the elements of the photos; changed: called where the description has to be renewed.
// Returns what the picture shows, as a sentence.
export function connectPhotos(data, state, changed) {
  const element = (id) => document.getElementById(id);
  const { photos } = data;
  if (!photos.length) return () => "";
  const name = element("name");
  name.append(...photos.map((photo, index) => new Option(photo.name, index)));
  const show = () => {
    const photo = photos[state.photo];
    name.value = state.photo;
    if (!(state.layer in photo.layers)) state.layer = Object.keys(photo.layers)[1];
    const [first] = Object.keys(photo.layers);
    for (const [id, layer] of [["left", first], ["right", state.layer]]) {
      element(id).src = `data:image/jpeg;base64,${photo.layers[layer]}`;
      element(id).alt = `${photo.name}: ${layer}`;
    }
  };
  const change = () => {
    show();
    changed();
  };
  const go = (step) => {
    state.photo = (state.photo + step + photos.length) % photos.length;
    change();
  };
  element("previous").addEventListener("click", () => go(-1));
  element("next").addEventListener("click", () => go(1));
  name.addEventListener("change", () => {
    state.photo = Number(name.value);
    change();
  });
  for (const layer of Object.keys(photos[0].layers).slice(1)) {
    const label = document.createElement("label");
    const input = Object.assign(document.createElement("input"), {
      type: "radio", name: "layer", checked: layer === state.layer,
    });
    input.addEventListener("change", () => {
      state.layer = layer;
      change();
    });
    label.append(input, Object.assign(document.createElement("span"), { textContent: layer }));
    element("layer").append(label);
  }
  connectZoom(element("photos"), element("stack"), element("divider"), element("right"));
  show();
  return () => {
    const [first] = Object.keys(photos[state.photo].layers);
    return `Left of the divider: ${data.layer_texts[first]}. Right: ${data.layer_texts[state.layer]}.`;
  };
}

// The wheel or two fingers enlarge, dragging moves, a double click shows everything again.
function connectZoom(box, stack, divider, right) {
  const view = { scale: 1, x: 0, y: 0 };
  const place = () => {
    const { offsetWidth: width, offsetHeight: height } = stack; // without the enlargement
    view.x = Math.min(0, Math.max(view.x, width * (1 - view.scale)));
    view.y = Math.min(0, Math.max(view.y, height * (1 - view.scale)));
    stack.style.transform = `translate(${view.x}px, ${view.y}px) scale(${view.scale})`;
    stack.classList.toggle("near", view.scale > PIXELS_SHOW);
    // the divider belongs to the window: the same place of the enlarged picture
    const at = ((Number(divider.value) / 100) * width - view.x) / view.scale;
    right.style.clipPath = `inset(0 0 0 ${at}px)`;
  };
  const enlarge = (factor, x, y) => {
    const at = box.getBoundingClientRect();
    const scale = Math.min(MAX_ZOOM, Math.max(1, view.scale * factor));
    for (const [axis, pointer] of [["x", x - at.left], ["y", y - at.top]]) {
      view[axis] = pointer - ((pointer - view[axis]) * scale) / view.scale;
    }
    view.scale = scale;
    place();
  };
  box.addEventListener("wheel", (event) => {
    event.preventDefault();
    enlarge(Math.exp(-event.deltaY / 400), event.clientX, event.clientY);
  }, { passive: false });
  const held = new Map(); // pointers that are down: their places
  box.addEventListener("pointerdown", (event) => {
    if (event.target !== divider) held.set(event.pointerId, event);
  });
  for (const kind of ["pointerup", "pointercancel", "pointerleave"]) {
    box.addEventListener(kind, (event) => held.delete(event.pointerId));
  }
  box.addEventListener("pointermove", (event) => {
    const before = held.get(event.pointerId);
    if (!before) return;
    held.set(event.pointerId, event);
    const [other] = [...held.values()].filter((one) => one.pointerId !== event.pointerId);
    if (other) {
      const apart = (one) => Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY);
      const middle = ["clientX", "clientY"].map((axis) => (event[axis] + other[axis]) / 2);
      enlarge(apart(event) / Math.max(apart(before), 1), ...middle);
      return;
    }
    view.x += event.clientX - before.clientX;
    view.y += event.clientY - before.clientY;
    place();
  });
  box.addEventListener("dblclick", (event) => {
    if (event.target === divider) return;
    Object.assign(view, { scale: 1, x: 0, y: 0 });
    place();
  });
  divider.addEventListener("input", place);
  new ResizeObserver(place).observe(box);
}
