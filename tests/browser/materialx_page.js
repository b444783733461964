// Evaluates a surface shader that MaterialX generated, at one pixel for each normal.
// options: fragment: GLSL ES 3.00 source; normals: three numbers for each pixel; draws: a list of
// uniforms: name to number, numbers or boolean; view, light: unit vectors from the surface.
// Returns for each draw the radiance under a distant light of irradiance 1 as base64 of float32,
// four numbers for each pixel.
"use strict";

const VERTEX = `#version 300 es
uniform float u_count;
in vec3 i_normal;
in float i_pixel;
out vec3 normalWorld;
out vec3 tangentWorld;
out vec3 positionWorld;
void main() {
  gl_Position = vec4(2.0 * (i_pixel + 0.5) / u_count - 1.0, 0.0, 0.0, 1.0);
  gl_PointSize = 1.0;
  normalWorld = i_normal;
  tangentWorld = normalize(cross(i_normal, vec3(0.31, 0.87, 0.39)));
  positionWorld = vec3(0.0);
}`;

window.evaluateSurface = ({ fragment, normals, draws }) => {
  const count = normals.length / 3;
  const gl = document.createElement("canvas").getContext("webgl2");
  gl.getExtension("EXT_color_buffer_float");
  const program = gl.createProgram();
  for (const [kind, source] of [
    [gl.VERTEX_SHADER, VERTEX],
    [gl.FRAGMENT_SHADER, fragment],
  ]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) {
      throw new Error(gl.getShaderInfoLog(shader));
    }
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
    throw new Error(gl.getProgramInfoLog(program));
  }
  gl.useProgram(program);
  const target = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, target);
  gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, count, 1);
  gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, target, 0);
  gl.viewport(0, 0, count, 1);
  const attribute = (name, size, values) => {
    const place = gl.getAttribLocation(program, name);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(values), gl.STATIC_DRAW);
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, size, gl.FLOAT, false, 0, 0);
  };
  attribute("i_normal", 3, normals);
  attribute("i_pixel", 1, Array.from({ length: count }, (_, pixel) => pixel));
  const place = (name) => gl.getUniformLocation(program, name);
  const active = Array.from(
    { length: gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS) },
    (_, index) => gl.getActiveUniform(program, index),
  );
  const whole = new Set(
    active.filter(({ type }) => type === gl.INT || type === gl.BOOL).map(({ name }) => name),
  );
  gl.uniform1f(place("u_count"), count);
  gl.uniform1i(place("u_numActiveLightSources"), 1);
  gl.uniform1i(place("u_lightData[0].type"), 1);
  gl.uniform3f(place("u_lightData[0].color"), 1, 1, 1);
  gl.uniform1f(place("u_lightData[0].intensity"), 1);
  return draws.map(({ uniforms, view, light }) => {
    for (const [name, value] of Object.entries(uniforms)) {
      if (Array.isArray(value)) gl[`uniform${value.length}fv`](place(name), value);
      else if (whole.has(name)) gl.uniform1i(place(name), value);
      else gl.uniform1f(place(name), value);
    }
    gl.uniform3fv(place("u_viewPosition"), view);
    gl.uniform3fv(place("u_lightData[0].direction"), light.map((x) => -x));
    gl.drawArrays(gl.POINTS, 0, count);
    const found = new Float32Array(4 * count);
    gl.readPixels(0, 0, count, 1, gl.RGBA, gl.FLOAT, found);
    if (gl.getError() !== gl.NO_ERROR) throw new Error("WebGL reports an error");
    let text = "";
    for (const byte of new Uint8Array(found.buffer)) text += String.fromCharCode(byte);
    return btoa(text);
  });
};
