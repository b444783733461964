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
  let connected = false; // the description is made after this function has returned
  const show = () => {
    const photo = photos[state.photo];
    name.value = state.photo;
    if (!(state.layer in photo.layers)) state.layer = Object.keys(photo.layers)[1];
    const [first] = Object.keys(photo.layers);
    for (const [id, layer] of [["left", first], ["right", state.layer]]) {
      element(id).src = `data:image/jpeg;base64,${photo.layers[layer]}`;
      element(id).alt = `${photo.name}: ${layer}`;
    }
    if (connected) changed();
  };
  const go = (step) => {
    state.photo = (state.photo + step + photos.length) % photos.length;
    show();
  };
  element("previous").addEventListener("click", () => go(-1));
  element("next").addEventListener("click", () => go(1));
  name.addEventListener("change", () => {
    state.photo = Number(name.value);
    show();
  });
  for (const layer of Object.keys(photos[0].layers).slice(1)) {
    const label = document.createElement("label");
    const input = Object.assign(document.createElement("input"), {
      type: "radio", name: "layer", checked: layer === state.layer,
    });
    input.addEventListener("change", () => {
      state.layer = layer;
      show();
    });
    label.append(input, Object.assign(document.createElement("span"), { textContent: layer }));
    element("layer").append(label);
  }
  connectZoom(element("photos"), element("stack"), element("divider"), element("right"));
  show();
  connected = true;
  return () => {
    const [first] = Object.keys(photos[state.photo].layers);
    return `Left of the divider: ${data.layer_texts[first]}. Right: ${data.layer_texts[state.layer]}.`;
  };
}

// The wheel enlarges at the pointer, dragging moves, a double click shows everything again.
function connectZoom(box, stack, divider, right) {
  const view = { scale: 1, x: 0, y: 0 };
  const place = () => {
    const { width, height } = stack.parentElement.getBoundingClientRect();
    view.x = Math.min(0, Math.max(view.x, width * (1 - view.scale)));
    view.y = Math.min(0, Math.max(view.y, height * (1 - view.scale)));
    stack.style.transform = `translate(${view.x}px, ${view.y}px) scale(${view.scale})`;
    stack.classList.toggle("near", view.scale > PIXELS_SHOW);
    // the divider belongs to the window: the same place of the enlarged picture
    const at = ((Number(divider.value) / 100) * width - view.x) / view.scale;
    right.style.clipPath = `inset(0 0 0 ${at}px)`;
  };
  box.addEventListener("wheel", (event) => {
    event.preventDefault();
    const at = box.getBoundingClientRect();
    const scale = Math.min(MAX_ZOOM, Math.max(1, view.scale * Math.exp(-event.deltaY / 400)));
    for (const [axis, pointer] of [["x", event.clientX - at.left], ["y", event.clientY - at.top]]) {
      view[axis] = pointer - ((pointer - view[axis]) * scale) / view.scale;
    }
    view.scale = scale;
    place();
  }, { passive: false });
  box.addEventListener("pointermove", (event) => {
    if (!event.buttons || event.target === divider) return;
    view.x += event.movementX;
    view.y += event.movementY;
    place();
  });
  box.addEventListener("dblclick", () => {
    Object.assign(view, { scale: 1, x: 0, y: 0 });
    place();
  });
  divider.addEventListener("input", place);
  new ResizeObserver(place).observe(box);
}
