// Averages pictures of the object or the sphere until they converge.

import * as THREE from "three";
import { drawFromWorld, quantileTexture, tableTexture, worldTexture } from "./data.js";
import {
  DEPTH_FRAGMENT, DISPLAY_FRAGMENT, FRAGMENT, SCREEN_VERTEX, SUM_FRAGMENT, VERTEX,
} from "./shading.glsl.js";

export const PICTURES = 400; // that are averaged
const SHADOW_SIZE = 2048; // texels
const SHADOW_BIAS = 2.5e-3; // of the lamp camera's depth range, twice the object's diameter
// additive recurrences (Roberts 2018) for the sky's directions, and the pixels' half vectors
const SKY = [0.8191725133961645, 0.6710436067037893, 0.5497004779019703];
const HALF = [0.7548776662466927, 0.5698402909980532];
const PIXEL = [0.8566748838545029, 0.733891856627126]; // over the pixel's area
const START = 0.5;

export class Renderer {
  constructor(canvas, data) {
    this.data = data;
    this.gl = new THREE.WebGLRenderer({ canvas, antialias: false, preserveDrawingBuffer: true });
    this.gl.outputColorSpace = THREE.LinearSRGBColorSpace; // the display shader encodes sRGB itself
    if (!this.gl.getContext().getExtension("EXT_color_buffer_float"))
      throw new Error("This browser cannot draw to floating-point textures, which the page needs.");
    this.camera = new THREE.PerspectiveCamera(26, 1, 0.1, 100);
    this.camera.up.set(0, 0, 1);
    this.tables = data.materials.map((material) =>
      Object.fromEntries(Object.entries(material.models).map(([name, m]) => [name, tableTexture(data.grid, m.halves)])),
    );
    this.quantiles = data.materials.map((material) => quantileTexture(material.quantiles));
    this.worlds = data.worlds.map(worldTexture);
    this.none = new THREE.DataTexture(new Float32Array(4), 1, 1, THREE.RGBAFormat, THREE.FloatType);
    this.none.needsUpdate = true;
    this.scenes = { sphere: this.sphereScene() };
    if (data.object) this.scenes.object = this.objectScene();
    this.depth = new THREE.ShaderMaterial({
      glslVersion: THREE.GLSL3, vertexShader: VERTEX, fragmentShader: DEPTH_FRAGMENT, side: THREE.DoubleSide,
    });
    this.lampCamera = new THREE.OrthographicCamera(-1, 1, 1, -1, 0, 4);
    this.shadowMap = new THREE.WebGLRenderTarget(SHADOW_SIZE, SHADOW_SIZE, {
      format: THREE.RedFormat, type: THREE.FloatType, minFilter: THREE.NearestFilter, magFilter: THREE.NearestFilter,
    });
    this.screen = screenScene();
    this.targets = null;
    this.count = 0;
    this.moved = () => {};
    canvas.addEventListener("webglcontextrestored", () => this.restart());
  }

  shading(material, varies = false) {
    const grid = this.data.grid;
    return new THREE.ShaderMaterial({
      glslVersion: THREE.GLSL3,
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      side: THREE.DoubleSide,
      userData: { material },
      defines: varies ? { VARIES: 1 } : {},
      uniforms: {
        nodes: { value: new THREE.Vector3(grid.n_p, grid.n_d, grid.n_h) },
        knee: { value: grid.knee },
        epsilon: { value: grid.epsilon },
        table: { value: null },
        measured: { value: null },
        difference: { value: false },
        body: { value: new THREE.Vector3(...(this.data.materials[material].body ?? [0, 0, 0])) },
        quantiles: { value: null },
        sky: { value: false },
        world: { value: this.none },
        toLight: { value: new THREE.Vector3(0, 0, 1) },
        light: { value: new THREE.Vector3(1, 1, 1) },
        density: { value: 1 },
        shadows: { value: false },
        shadowMap: { value: this.none },
        shadowMatrix: { value: new THREE.Matrix4() },
        shadowBias: { value: SHADOW_BIAS },
        shift: { value: new THREE.Vector2() },
        eye: { value: new THREE.Vector3() },
      },
    });
  }

  sphereScene() {
    const scene = new THREE.Scene();
    scene.add(new THREE.Mesh(new THREE.SphereGeometry(1, 256, 128), this.shading(0)));
    return scene;
  }

  objectScene() {
    const scene = new THREE.Scene();
    const { positions, parts } = this.data.object;
    const attribute = new THREE.BufferAttribute(positions, 3);
    const whole = new THREE.BufferGeometry();
    whole.setAttribute("position", attribute);
    const everything = parts.map((part) => part.index);
    const index = new Uint32Array(everything.reduce((n, each) => n + each.length, 0));
    everything.reduce((at, each) => (index.set(each, at), at + each.length), 0);
    whole.setIndex(new THREE.BufferAttribute(index, 1));
    whole.computeVertexNormals(); // of the whole: parts share their normals where they meet
    for (const part of parts) {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", attribute);
      geometry.setAttribute("normal", whole.getAttribute("normal"));
      geometry.setIndex(new THREE.BufferAttribute(part.index, 1));
      if (part.factors) {
        const buffer = new THREE.InterleavedBuffer(part.factors, 10);
        const columns = { factorDiffuse: [3, 0], factorSpecular: [3, 3], factorRoughness: [1, 6], tilt: [3, 7] };
        for (const [name, [size, first]] of Object.entries(columns))
          geometry.setAttribute(name, new THREE.InterleavedBufferAttribute(buffer, size, first));
      }
      scene.add(new THREE.Mesh(geometry, this.shading(part.material, Boolean(part.factors))));
    }
    return scene;
  }

  resize(width, height) {
    this.gl.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    const options = { type: THREE.FloatType, minFilter: THREE.NearestFilter, magFilter: THREE.NearestFilter };
    for (const target of this.targets ?? []) target.dispose();
    this.targets = [0, 1, 2].map((i) => new THREE.WebGLRenderTarget(width, height, { ...options, depthBuffer: i === 2 }));
    this.restart();
  }

  restart() {
    this.count = 0;
  }

  // Add one picture to the average. state: see main.js.
  step(state) {
    if (this.count >= PICTURES) return false;
    const i = this.count;
    const [first, second, picture] = this.targets;
    const [before, after] = i % 2 ? [first, second] : [second, first];
    if (i === 0) this.clear(before);
    const scene = this.scenes[state.shown];
    const world = state.light === "lamp" ? null : this.data.worlds[state.light];
    const drawn = world && drawFromWorld(world, ...SKY.map((step) => (START + i * step) % 1));
    const toLight = drawn ? drawn.direction : state.lamp;
    if (state.shown === "object") this.traceShadows(scene, toLight);
    this.camera.updateMatrixWorld();
    for (const mesh of scene.children) this.setUniforms(mesh.material, state, drawn, toLight, i);
    const { width, height } = picture;
    this.camera.setViewOffset(
      width, height, ((START + i * PIXEL[0]) % 1) - 0.5, ((START + i * PIXEL[1]) % 1) - 0.5, width, height,
    );
    this.clear(picture);
    this.gl.render(scene, this.camera);
    this.camera.clearViewOffset();
    this.draw(SUM_FRAGMENT, { before: before.texture, picture: picture.texture }, after);
    this.sum = after;
    this.count += 1;
    return true;
  }

  setUniforms(material, state, drawn, toLight, i) {
    const own = state.shown === "sphere" ? state.material : material.userData.material;
    const u = material.uniforms;
    u.table.value = this.tables[own][state.model] ?? this.tables[own].measured;
    u.measured.value = this.tables[own].measured;
    u.difference.value = state.difference;
    u.quantiles.value = this.quantiles[own];
    u.sky.value = Boolean(drawn);
    u.world.value = drawn ? this.worlds[state.light] : this.none;
    u.toLight.value.copy(toLight);
    if (drawn) u.light.value.set(...drawn.radiance);
    else u.light.value.setScalar(state.irradiance);
    u.density.value = drawn ? drawn.density : 1;
    u.shadows.value = state.shown === "object";
    u.shadowMap.value = this.shadowMap.texture;
    u.shadowMatrix.value.copy(this.lampCamera.projectionMatrix).multiply(this.lampCamera.matrixWorldInverse);
    u.shift.value.set((i * HALF[0]) % 1, (i * HALF[1]) % 1);
    u.eye.value.copy(this.camera.position);
  }

  traceShadows(scene, toLight) {
    const lamp = this.lampCamera;
    lamp.position.copy(toLight).multiplyScalar(2); // the object is inside the unit sphere
    lamp.up.set(0, Math.abs(toLight.z) > 0.9 ? 1 : 0, Math.abs(toLight.z) > 0.9 ? 0 : 1);
    lamp.lookAt(0, 0, 0);
    lamp.updateMatrixWorld();
    scene.overrideMaterial = this.depth;
    this.gl.setRenderTarget(this.shadowMap);
    this.gl.setClearColor(0xffffff, 1);
    this.gl.clear();
    this.gl.render(scene, lamp);
    scene.overrideMaterial = null;
  }

  clear(target) {
    this.gl.setRenderTarget(target);
    this.gl.setClearColor(0x000000, 0);
    this.gl.clear();
  }

  // Draw a full-screen pass into a target, or to the canvas.
  draw(fragment, uniforms, target = null) {
    const material = (this.passes ??= {})[fragment] ??= new THREE.ShaderMaterial({
      glslVersion: THREE.GLSL3, vertexShader: SCREEN_VERTEX, fragmentShader: fragment, depthTest: false,
      depthWrite: false,
      uniforms: Object.fromEntries(Object.keys(uniforms).map((name) => [name, { value: null }])),
    });
    for (const [name, value] of Object.entries(uniforms)) material.uniforms[name].value = value;
    this.screen.quad.material = material;
    this.gl.setRenderTarget(target);
    this.gl.render(this.screen.scene, this.screen.camera);
  }

  show(state) {
    const sky = state.light !== "lamp" && state.background;
    const toWorld = this.camera.matrixWorld.clone().multiply(this.camera.projectionMatrixInverse);
    this.draw(DISPLAY_FRAGMENT, {
      sum: this.sum.texture, count: this.count, exposure: 2 ** state.exposure, difference: state.difference,
      sky, paper: new THREE.Color(...state.paper), world: sky ? this.worlds[state.light] : this.none, toWorld,
    });
  }

  // The average as linear radiance, RGBA, from the bottom row.
  radiance() {
    const { width, height } = this.sum;
    const out = new Float32Array(4 * width * height);
    this.gl.readRenderTargetPixels(this.sum, 0, 0, width, height, out);
    return out.map((value) => value / this.count);
  }
}

function screenScene() {
  const scene = new THREE.Scene();
  const quad = new THREE.Mesh(new THREE.PlaneGeometry(2, 2));
  quad.frustumCulled = false;
  scene.add(quad);
  return { scene, quad, camera: new THREE.Camera() };
}
