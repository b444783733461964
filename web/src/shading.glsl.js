// GLSL of the pictures that are averaged: a distant lamp with cast shadows, or a sky.
//
// Under a sky every picture takes two samples of each pixel, combined by the balance heuristic
// (Veach and Guibas 1995): one direction of the sky that all pixels share, with cast shadows, and
// one direction drawn from the material's half vectors, without shadows.

import { BRDF } from "./brdf.glsl.js";

export const VERTEX = /* glsl */ `
out vec3 point;
out vec3 smoothNormal;
out vec3 diffuseFactor;
out vec3 specularFactor;
out float roughness;
#ifdef VARIES
in vec3 factorDiffuse;
in vec3 factorSpecular;
in float factorRoughness;
in vec3 tilt;
#endif
void main() {
  diffuseFactor = specularFactor = vec3(1.0);
  roughness = 1.0;
  smoothNormal = normal;
#ifdef VARIES
  diffuseFactor = factorDiffuse;
  specularFactor = factorSpecular;
  roughness = factorRoughness;
  smoothNormal = normalize(normal + tilt - dot(tilt, normal) * normal);
#endif
  vec4 world = modelMatrix * vec4(position, 1.0);
  point = world.xyz;
  gl_Position = projectionMatrix * viewMatrix * world;
}
`;

export const FRAGMENT = /* glsl */ `
precision highp float;
precision highp int;
precision highp sampler3D;
${BRDF}
const int QUANTILES = 256;
uniform sampler3D table; // of the model that is shown
uniform sampler3D measured; // subtracted in the difference
uniform bool difference;
uniform vec3 body; // 1/sr, level of the diffuse body, of a material that varies
uniform sampler2D quantiles; // of theta_h of the material's half vectors, radians
uniform bool sky;
uniform sampler2D world; // radiance, and in alpha the density of the shared directions, 1/sr
uniform vec3 toLight; // unit vector to the lamp, or to this picture's direction of the sky
uniform vec3 light; // the lamp's irradiance, or the sky's radiance
uniform float density; // 1/sr, of toLight; of the sky
uniform bool shadows;
uniform sampler2D shadowMap;
uniform mat4 shadowMatrix;
uniform float shadowBias;
uniform vec2 shift; // quasi-random, of this picture
uniform vec3 eye;
in vec3 point;
in vec3 smoothNormal;
in vec3 diffuseFactor;
in vec3 specularFactor;
in float roughness;
out vec4 radiance;

float visibility(vec3 at) {
  if (!shadows) return 1.0;
  vec3 seen = (shadowMatrix * vec4(at, 1.0)).xyz * 0.5 + 0.5;
  if (any(lessThan(seen.xy, vec2(0.0))) || any(greaterThan(seen.xy, vec2(1.0)))) return 1.0;
  return seen.z - shadowBias > texture(shadowMap, seen.xy).r ? 0.0 : 1.0;
}

vec4 worldTowards(vec3 d) {
  vec2 at = vec2(0.5 - atan(d.y, d.x) / (2.0 * PI), acos(clamp(d.z, -1.0, 1.0)) / PI);
  // the first row of the data is the zenith; derivatives would be wrong at the seam
  return textureLod(world, at, 0.0);
}

float quantile(int k) {
  return texelFetch(quantiles, ivec2(k, 0), 0).r;
}

// Density of half vectors in 1/sr.
float halfDensity(float thetaH) {
  int low = 0, high = QUANTILES - 1;
  for (int step = 0; step < 8; step++) {
    int middle = (low + high + 1) / 2;
    if (quantile(middle) <= thetaH) low = middle; else high = middle - 1;
  }
  float width = quantile(low + 1) - quantile(low);
  return 1.0 / (float(QUANTILES) * width * 2.0 * PI * max(sin(thetaH), 1e-5));
}

float densityOfHalf(vec3 n, vec3 l, vec3 v) {
  vec3 h = normalize(l + v);
  return halfDensity(acos(clamp(dot(n, h), -1.0, 1.0))) / (4.0 * max(dot(v, h), 1e-4));
}

vec3 ofModel(sampler3D model, vec3 n, vec3 l, vec3 v) {
  vec3 rho = reflectance(model, n, l, v, roughness);
#ifdef VARIES
  vec3 below = min(rho, body);
  rho = diffuseFactor * below + specularFactor / (roughness * roughness) * (rho - below);
#endif
  return rho;
}

vec3 shown(vec3 n, vec3 l, vec3 v) {
  vec3 rho = ofModel(table, n, l, v);
  return difference ? rho - ofModel(measured, n, l, v) : rho;
}

// Two numbers in [0, 1) of a pixel (Jarzynski and Olano 2020, pcg2d).
vec2 ofPixel(uvec2 v) {
  v = v * 1664525u + 1013904223u;
  v.x += v.y * 1664525u;
  v.y += v.x * 1664525u;
  v ^= v >> 16u;
  v.x += v.y * 1664525u;
  v.y += v.x * 1664525u;
  v ^= v >> 16u;
  return vec2(v >> 8u) / 16777216.0;
}

void main() {
  vec3 v = normalize(eye - point);
  vec3 n = normalize(smoothNormal);
  vec3 face = normalize(cross(dFdx(point), dFdy(point)));
  if (dot(face, v) < 0.0) face = -face;
  if (dot(n, v) <= 1e-3) n = face;
  vec3 sum = vec3(0.0);
  float cosI = dot(n, toLight);
  if (cosI > 0.0 && dot(face, toLight) > 0.0) {
    float weight = visibility(point) * cosI;
    if (sky) weight /= density + densityOfHalf(n, toLight, v);
    sum += weight * light * shown(n, toLight, v);
  }
  if (sky) {
    vec2 u = fract(ofPixel(uvec2(gl_FragCoord.xy)) + shift);
    float at = u.x * float(QUANTILES);
    int k = min(int(at), QUANTILES - 1);
    float thetaH = mix(quantile(k), quantile(k + 1), at - float(k));
    vec3 t, b;
    frameOf(n, t, b);
    vec3 h = sin(thetaH) * (cos(2.0 * PI * u.y) * t + sin(2.0 * PI * u.y) * b) + cos(thetaH) * n;
    vec3 l = reflect(-v, h);
    cosI = dot(n, l);
    if (cosI > 0.0 && dot(v, h) > 0.0) {
      vec4 from = worldTowards(l);
      float drawn = halfDensity(thetaH) / (4.0 * max(dot(v, h), 1e-4));
      sum += cosI / (from.a + drawn) * from.rgb * shown(n, l, v);
    }
  }
  radiance = vec4(sum, 1.0);
}
`;

// Depth from the lamp.
export const DEPTH_FRAGMENT = /* glsl */ `
precision highp float;
out vec4 depth;
void main() {
  depth = vec4(gl_FragCoord.z, 0.0, 0.0, 1.0);
}
`;

export const SCREEN_VERTEX = /* glsl */ `
out vec2 at;
void main() {
  at = position.xy * 0.5 + 0.5;
  gl_Position = vec4(position.xy, 0.0, 1.0);
}
`;

export const SUM_FRAGMENT = /* glsl */ `
precision highp float;
uniform sampler2D before;
uniform sampler2D picture;
in vec2 at;
out vec4 sum;
void main() {
  sum = texture(before, at) + texture(picture, at);
}
`;

// The average, exposed and encoded as sRGB; or a difference in red (too bright) and blue (too dark).
export const DISPLAY_FRAGMENT = /* glsl */ `
precision highp float;
uniform sampler2D sum;
uniform float count;
uniform float exposure;
uniform bool difference;
uniform bool sky;
uniform vec3 paper; // sRGB, behind the object
uniform sampler2D world;
uniform mat4 toWorld; // from the screen to directions
in vec2 at;
out vec4 shown;

vec3 encoded(vec3 linear) {
  vec3 low = 12.92 * linear, high = 1.055 * pow(max(linear, 0.0031308), vec3(1.0 / 2.4)) - 0.055;
  return mix(high, low, vec3(lessThanEqual(linear, vec3(0.0031308))));
}

void main() {
  vec4 mean = texture(sum, at) / count;
  vec3 behind = paper;
  if (sky) {
    vec4 far = toWorld * vec4(at * 2.0 - 1.0, 1.0, 1.0), near = toWorld * vec4(at * 2.0 - 1.0, -1.0, 1.0);
    vec3 d = normalize(far.xyz / far.w - near.xyz / near.w);
    vec2 where = vec2(0.5 - atan(d.y, d.x) / 6.283185307179586, acos(clamp(d.z, -1.0, 1.0)) / 3.141592653589793);
    behind = encoded(clamp(exposure * textureLod(world, where, 0.0).rgb, 0.0, 1.0));
  }
  vec3 front;
  float cover = max(mean.a, 1e-6);
  if (difference) {
    float off = clamp(4.0 * exposure * dot(mean.rgb / cover, vec3(0.2126, 0.7152, 0.0722)), -1.0, 1.0);
    front = mix(vec3(0.94), off > 0.0 ? vec3(0.70, 0.09, 0.17) : vec3(0.13, 0.40, 0.67), abs(off));
  } else {
    front = encoded(clamp(exposure * mean.rgb / cover, 0.0, 1.0));
  }
  shown = vec4(mix(behind, front, clamp(mean.a, 0.0, 1.0)), 1.0);
}
`;
