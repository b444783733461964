// Draws a GLB with three.js, for test_glb.py.

import * as THREE from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";

const fromBase64 = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));

// Linear radiance, RGBA floats as base64, from the bottom row. eye, lamp: in glTF's frame (y up).
window.drawGlb = async ({ glb, side, field, eye, lamp, sky }) => {
  const renderer = new THREE.WebGLRenderer();
  renderer.toneMapping = THREE.NoToneMapping;
  const { scene: content } = await new GLTFLoader().parseAsync(fromBase64(glb).buffer, "");
  const scene = new THREE.Scene();
  scene.add(content);
  if (lamp) {
    const sun = new THREE.DirectionalLight(0xffffff, Math.PI); // lux: the irradiance
    sun.position.set(...lamp);
    scene.add(sun);
  }
  if (sky) {
    const texture = new THREE.DataTexture(
      new Float32Array(fromBase64(sky.pixels).buffer), sky.width, sky.height, THREE.RGBAFormat, THREE.FloatType,
    );
    texture.mapping = THREE.EquirectangularReflectionMapping;
    texture.needsUpdate = true;
    const filter = new THREE.PMREMGenerator(renderer);
    scene.environment = filter.fromEquirectangular(texture).texture;
  }
  const camera = new THREE.PerspectiveCamera(field, 1, 0.1, 100);
  camera.position.set(...eye);
  camera.lookAt(0, 0, 0);
  const target = new THREE.WebGLRenderTarget(side, side, { type: THREE.FloatType });
  renderer.setRenderTarget(target);
  renderer.render(scene, camera);
  const out = new Float32Array(4 * side * side);
  renderer.readRenderTargetPixels(target, 0, 0, side, side, out);
  let text = "";
  for (const each of new Uint8Array(out.buffer)) text += String.fromCharCode(each);
  return btoa(text);
};
