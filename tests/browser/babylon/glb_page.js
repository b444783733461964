// Draws a GLB with Babylon.js, a game engine, for test_glb.py: the same function as glb_page.js.

import {
  AppendSceneAsync, Color4, Constants, DirectionalLight, Engine, FreeCamera, RenderTargetTexture, Scene, Vector3,
} from "@babylonjs/core";
import "@babylonjs/loaders/glTF/2.0/index.js";

// Linear radiance, RGBA floats as base64, from the bottom row. eye, lamp: in glTF's frame (y up).
window.drawGlb = async ({ glb, side, field, eye, lamp }) => {
  const canvas = document.body.appendChild(document.createElement("canvas"));
  canvas.width = canvas.height = side; // the aspect ratio of the camera
  const engine = new Engine(canvas, false, { preserveDrawingBuffer: true });
  const scene = new Scene(engine);
  scene.useRightHandedSystem = true;
  scene.clearColor = new Color4(0, 0, 0, 1);
  scene.imageProcessingConfiguration.applyByPostProcess = true; // materials write linear radiance
  await AppendSceneAsync(`data:model/gltf-binary;base64,${glb}`, scene, { pluginExtension: ".glb" });
  const light = new DirectionalLight("lamp", new Vector3(...lamp).negate().normalize(), scene);
  light.intensity = Math.PI; // the irradiance
  const camera = new FreeCamera("camera", new Vector3(...eye), scene);
  camera.fov = (field * Math.PI) / 180;
  camera.setTarget(Vector3.Zero());
  const target = new RenderTargetTexture("radiance", side, scene, {
    type: Constants.TEXTURETYPE_FLOAT, samplingMode: Constants.TEXTURE_NEAREST_SAMPLINGMODE,
  });
  target.renderList = scene.meshes;
  target.activeCamera = camera;
  await scene.whenReadyAsync();
  scene.customRenderTargets.push(target);
  while (!target.isReadyForRendering()) await new Promise((done) => setTimeout(done, 50));
  scene.render();
  const out = await target.readPixels();
  let text = "";
  for (const each of new Uint8Array(out.buffer)) text += String.fromCharCode(each);
  return btoa(text);
};
