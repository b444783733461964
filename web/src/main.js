// The page: canvas, controls, values under the pointer.

import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { readData } from "./data.js";
import { connectPhotos } from "./photos.js";
import { halfDifference, intervalFactor, reflectance } from "./evaluate.js";
import { PICTURES, Renderer } from "./renderer.js";

const MODELS = { measured: "Measured", lobes: "Lobe Stack", principled: "Principled" };
const SMOOTH_FRAME = 33; // ms: where pictures take longer, they are smaller while the view moves
const MIN_RESOLUTION = 0.2; // of the canvas, of these smaller pictures
const REST = 400; // ms without a movement, after which pictures are as large as the canvas

function start() {
  const data = readData();
  const canvas = document.querySelector("canvas");
  const renderer = new Renderer(canvas, data);
  const state = {
    shown: data.object ? "object" : "sphere",
    material: 0,
    model: "measured",
    difference: false,
    light: data.worlds.length ? 0 : "lamp",
    lamp: new THREE.Vector3(0.5, -0.6, 0.62).normalize(),
    irradiance: Math.PI,
    exposure: 0,
    background: true,
    photo: 0,
    layer: data.photos.length ? Object.keys(data.photos[0].layers)[1] : "",
    paper: [0.5, 0.5, 0.5],
  };
  const orbit = new OrbitControls(renderer.camera, canvas);
  orbit.enablePan = false;
  orbit.minDistance = 1.5;
  orbit.maxDistance = 20;
  renderer.camera.position.set(0, -5.2, 0.9);
  orbit.update();
  orbit.addEventListener("change", () => {
    renderer.restart();
    renderer.moved();
  });

  connect(data, state, renderer);
  connectLamp(canvas, state, renderer, orbit);
  connectPointer(canvas, data, state, renderer);

  // Pictures are as large as the canvas at rest, and smaller while the view moves on slow machines.
  const speed = { resolution: 1, moving: 1, moved: -Infinity, last: 0, frames: 0, since: performance.now() };
  const fit = () => {
    const box = canvas.parentElement.getBoundingClientRect();
    const ratio = speed.resolution * Math.min(window.devicePixelRatio, 2);
    renderer.resize(Math.max(1, Math.round(box.width * ratio)), Math.max(1, Math.round(box.height * ratio)));
  };
  const useResolution = (resolution) => {
    if (resolution === speed.resolution) return;
    speed.resolution = resolution;
    fit();
  };
  renderer.moved = () => {
    speed.moved = performance.now();
    useResolution(speed.moving);
  };
  new ResizeObserver(fit).observe(canvas.parentElement);
  fit();

  const bar = document.getElementById("progress");
  const frame = (now) => {
    const taken = now - speed.last;
    speed.last = now;
    if (renderer.count > 1 && taken < 2000 && performance.now() - speed.moved < REST) {
      const wanted = speed.moving * Math.sqrt(SMOOTH_FRAME / Math.max(taken, 5));
      speed.moving = Math.min(1, Math.max(MIN_RESOLUTION, 0.7 * speed.moving + 0.3 * wanted));
    }
    if (performance.now() - speed.moved > REST) useResolution(1);
    if (state.shown !== "photos" && renderer.step(state)) renderer.show(state);
    bar.value = renderer.count / PICTURES;
    bar.hidden = renderer.count >= PICTURES || state.shown === "photos";
    speed.frames += 1;
    requestAnimationFrame(frame);
  };
  // for tests: the state, and the average of all pictures as linear radiance
  window.patina = {
    data, state, renderer,
    finish(pictures = PICTURES) {
      renderer.restart();
      while (renderer.count < pictures) renderer.step(state);
      renderer.show(state);
      return renderer.radiance();
    },
    // frames a second since the last call
    framesPerSecond() {
      const found = (1000 * speed.frames) / (performance.now() - speed.since);
      Object.assign(speed, { frames: 0, since: performance.now() });
      return found;
    },
  };
  requestAnimationFrame(frame);
}

// The controls of the panel.
function connect(data, state, renderer) {
  const inPhotos = connectPhotos(data, state, () => describe(data, state, inPhotos));
  const change = (name, value) => {
    state[name] = value;
    renderer.restart();
    describe(data, state, inPhotos);
  };
  const shapes = { ...(data.object && { object: "Object" }), sphere: "Sphere", ...(data.photos.length && { photos: "Photos" }) };
  choice("shown", shapes, state.shown, (value) => change("shown", value));
  choice("material", Object.fromEntries(data.materials.map((m, i) => [i, m.name])), state.material,
    (value) => change("material", Number(value)));
  const known = Object.keys(MODELS).filter((name) => data.materials.every((m) => m.models[name]));
  choice("model", Object.fromEntries(known.map((name) => [name, MODELS[name]])), state.model, (value) => {
    if (value === "measured") state.difference = document.getElementById("difference").checked = false;
    change("model", value);
  });
  choice("light", { lamp: "Lamp", ...Object.fromEntries(data.worlds.map((w, i) => [i, w.name])) }, state.light,
    (value) => change("light", value === "lamp" ? value : Number(value)));
  const difference = document.getElementById("difference");
  difference.addEventListener("change", () => change("difference", difference.checked));
  const exposure = document.getElementById("exposure");
  exposure.addEventListener("input", () => {
    state.exposure = Number(exposure.value);
    document.getElementById("stops").textContent = `${state.exposure >= 0 ? "+" : ""}${state.exposure.toFixed(1)}`;
    renderer.restart();
  });
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const paper = () => {
    state.paper = dark.matches ? [0.13, 0.13, 0.14] : [0.96, 0.96, 0.95];
    renderer.restart();
  };
  dark.addEventListener("change", paper);
  paper();
  describe(data, state, inPhotos);
}

function choice(id, options, value, changed) {
  const group = document.getElementById(id);
  const keys = Object.keys(options);
  group.parentElement.hidden = keys.length < 2;
  for (const key of keys) {
    const label = document.createElement("label");
    const input = document.createElement("input");
    input.type = "radio";
    input.name = id;
    input.checked = key === String(value);
    input.addEventListener("change", () => changed(key));
    label.append(input, document.createElement("span"));
    label.lastChild.textContent = options[key];
    group.append(label);
  }
}

// A sentence on what is shown, and the controls that belong to it. inPhotos: returns that of the photos.
function describe(data, state, inPhotos) {
  const photos = state.shown === "photos";
  document.getElementById("photos").hidden = !photos;
  document.querySelector("canvas").hidden = photos;
  for (const id of ["photo", "sides"]) document.getElementById(id).hidden = !photos;
  for (const id of ["model", "light"]) document.getElementById(id).parentElement.hidden = photos;
  document.getElementById("exposures").hidden = photos;
  const model = {
    measured: "the BRDF fitted to the photos; in directions that no photo shows, it is extrapolated",
    lobes: "the lobe stack, which approximates the BRDF in EEVEE and other programs",
    principled: "the Principled BSDF, which approximates the BRDF in exports to game engines",
  }[state.model];
  const what = state.difference ? `Shown: ${model}, minus the BRDF fitted to the photos` : `Shown: ${model}`;
  const colours = state.difference ? " Red is too bright, blue too dark." : "";
  const shadows = state.light !== "lamp" && state.shown === "object" ? " Interreflection is not shown." : "";
  document.getElementById("what").textContent = photos ? inPhotos() : `${what}.${colours}${shadows}`;
  document.getElementById("material").parentElement.hidden = state.shown !== "sphere" || data.materials.length < 2;
  const difference = document.getElementById("difference");
  difference.disabled = state.model === "measured";
  difference.parentElement.title = difference.disabled ? "Select another model first" : "";
  const lamp = state.light === "lamp";
  document.getElementById("lamp").hidden = !lamp || photos;
  const turn = window.matchMedia("(pointer: coarse)").matches ? "Drag to turn, pinch to zoom." : "Drag to turn, scroll to zoom.";
  const values = "Point at the surface for its reflectance and interval.";
  if (photos) {
    const fingers = window.matchMedia("(pointer: coarse)").matches;
    document.getElementById("hint").textContent = fingers ? "Pinch to enlarge, drag to move."
      : "Scroll to enlarge, drag to move, double click to see everything.";
    return;
  }
  document.getElementById("hint").textContent = lamp ? `${turn} Shift and drag moves the lamp. ${values}` : turn;
}

// Shift and drag: the lamp follows the pointer around the object.
function connectLamp(canvas, state, renderer, orbit) {
  const sliders = lampSliders(state, renderer);
  let moving = false;
  canvas.addEventListener("pointerdown", (event) => {
    moving = event.shiftKey;
    orbit.enabled = !moving;
  }, { capture: true });
  window.addEventListener("pointerup", () => {
    moving = false;
    orbit.enabled = true;
    sliders.follow();
  });
  window.addEventListener("pointermove", (event) => {
    if (!moving) return;
    const right = new THREE.Vector3().setFromMatrixColumn(renderer.camera.matrixWorld, 0);
    const up = new THREE.Vector3().setFromMatrixColumn(renderer.camera.matrixWorld, 1);
    state.lamp.applyAxisAngle(up, event.movementX * 0.01).applyAxisAngle(right, event.movementY * 0.01).normalize();
    if (state.light !== "lamp") return;
    renderer.restart();
    renderer.moved();
  });
}

// Azimuth and elevation of the lamp.
function lampSliders(state, renderer) {
  const [around, height] = ["around", "height"].map((id) => document.getElementById(id));
  const place = () => {
    const [a, h] = [around, height].map((slider) => (Number(slider.value) * Math.PI) / 180);
    state.lamp.set(Math.cos(h) * Math.sin(a), -Math.cos(h) * Math.cos(a), Math.sin(h));
    renderer.restart();
    renderer.moved();
  };
  const follow = () => {
    around.value = (180 / Math.PI) * Math.atan2(state.lamp.x, -state.lamp.y);
    height.value = (180 / Math.PI) * Math.asin(state.lamp.z);
  };
  for (const slider of [around, height]) slider.addEventListener("input", place);
  follow();
  return { follow };
}

// Values at the pointer: reflectance towards the lamp, its angles and interval.
function connectPointer(canvas, data, state, renderer) {
  const box = document.getElementById("values");
  const caster = new THREE.Raycaster();
  canvas.addEventListener("pointerleave", () => (box.hidden = true));
  canvas.addEventListener("pointermove", (event) => {
    const at = canvas.getBoundingClientRect();
    const place = new THREE.Vector2(
      (2 * (event.clientX - at.left)) / at.width - 1, 1 - (2 * (event.clientY - at.top)) / at.height,
    );
    caster.setFromCamera(place, renderer.camera);
    const [hit] = event.buttons || state.light !== "lamp" ? [] : caster.intersectObjects(renderer.scenes[state.shown].children);
    box.hidden = !hit;
    if (!hit) return;
    const { normal, factors } = surfaceAt(hit);
    const view = renderer.camera.position.clone().sub(hit.point).normalize();
    const own = state.shown === "sphere" ? state.material : hit.object.material.userData.material;
    const material = data.materials[own];
    const { halves } = material.models[state.model] ?? material.models.measured;
    const rho = reflectance(data.grid, halves, normal, state.lamp, view, factors && { ...factors, body: material.body });
    const angles = halfDifference(normal, state.lamp, view);
    const degrees = (radians) => `${((180 / Math.PI) * radians).toFixed(0)}°`;
    const between = (a, b) => degrees(Math.acos(Math.min(Math.max(a.dot(b), -1), 1)));
    const factor = state.model === "measured" && intervalFactor(data.grid, material.factor, data.interval_step, angles);
    const lines = [
      `${material.name}, ${MODELS[state.model]}: ${rho.map((value) => value.toPrecision(2)).join(", ")} 1/sr (R, G, B)`,
      `normal to lamp ${between(normal, state.lamp)}, to view ${between(normal, view)}`,
      `half vector ${degrees(angles.thetaH)} from normal, lamp ${degrees(angles.thetaD)} from half vector`,
    ];
    if (normal.dot(state.lamp) <= 0) lines[0] = `${material.name}: turned away from the lamp`;
    else if (factor) lines.push(`90 % interval: a factor of ${factor.toFixed(2)} either way`);
    box.replaceChildren(...lines.map((line) => Object.assign(document.createElement("div"), { textContent: line })));
    box.style.left = `${Math.min(event.clientX - at.left + 14, at.width - box.offsetWidth - 6)}px`;
    box.style.top = `${Math.min(event.clientY - at.top + 14, at.height - box.offsetHeight - 6)}px`;
  });
}

// The normal where the pointer meets the surface, and the factors of a material that varies.
function surfaceAt(hit) {
  const geometry = hit.object.geometry;
  const corners = [hit.face.a, hit.face.b, hit.face.c];
  const vertex = (name, k) => new THREE.Vector3().fromBufferAttribute(geometry.getAttribute(name), k);
  const weights = new THREE.Vector3();
  THREE.Triangle.getBarycoord(hit.point, ...corners.map((k) => vertex("position", k)), weights);
  const mean = (name) =>
    corners.reduce((sum, k, i) => sum.addScaledVector(vertex(name, k), weights.getComponent(i)), new THREE.Vector3());
  const normal = mean("normal").normalize();
  if (!geometry.getAttribute("tilt")) return { normal, factors: null };
  const tilt = mean("tilt");
  const roughness = corners.reduce(
    (sum, k, i) => sum + weights.getComponent(i) * geometry.getAttribute("factorRoughness").getX(k), 0,
  );
  const factors = { diffuse: mean("factorDiffuse").toArray(), specular: mean("factorSpecular").toArray(), roughness };
  return { normal: normal.clone().addScaledVector(normal, -tilt.dot(normal)).add(tilt).normalize(), factors };
}

try {
  start();
} catch (error) {
  const box = document.getElementById("failure");
  box.hidden = false;
  box.textContent = `The viewer cannot start: ${error.message} It needs WebGL 2 with floating-point textures.`;
  console.error(error);
}
