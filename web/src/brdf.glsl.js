// GLSL of the measured BRDF. The table holds ln(rho * cosMap + epsilon) at the nodes of the basis'
// grid (core/basis/grid.py): x is phi_d (periodic), y is theta_d, z is theta_h.

export const BRDF = /* glsl */ `
const float HALF_PI = 1.5707963267948966;
const float PI = 3.141592653589793;

uniform vec3 nodes; // along phi_d, theta_d and theta_h
uniform float knee; // radians, constant of the logarithmic spacing of theta_h
uniform float epsilon; // 1/sr, of Nielsen's mapping

// Two unit vectors that are perpendicular to n and to each other.
void frameOf(vec3 n, out vec3 t, out vec3 b) {
  t = normalize(cross(abs(n.x) < 0.5 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0), n));
  b = cross(n, t);
}

// Reflectance in 1/sr; n, l, v of unit length, away from the surface. roughness: factor of alpha.
vec3 reflectance(sampler3D table, vec3 n, vec3 l, vec3 v, float roughness) {
  float cosI = dot(n, l), cosO = dot(n, v);
  if (cosI <= 0.0 || cosO <= 0.0) return vec3(0.0);
  vec3 h = normalize(l + v);
  vec3 b = cross(n, h);
  float sinH = length(b);
  float thetaH = atan(sinH, dot(n, h));
  b = sinH > 1e-6 ? b / sinH : normalize(cross(abs(h.x) < 0.5 ? vec3(1, 0, 0) : vec3(0, 1, 0), h));
  vec3 t = cross(b, h);
  float dx = dot(l, t), dy = dot(l, b);
  float thetaD = atan(length(vec2(dx, dy)), dot(l, h));
  float phiD = length(vec2(dx, dy)) > 1e-7 ? atan(dy, dx) : 0.0;
  float cosines = cosI * cosO;
  if (roughness != 1.0) { // the same lobe, stretched (core/varying/node_model.py)
    thetaH = atan(tan(min(thetaH, 1.55)) / roughness);
    float along = cos(thetaH) * cos(thetaD), across = sin(thetaH) * sin(thetaD) * cos(phiD);
    cosines = along * along - across * across;
  }
  vec3 at = vec3(
    phiD / PI * nodes.x,
    clamp(thetaD / HALF_PI, 0.0, 1.0) * (nodes.y - 1.0),
    log(1.0 + clamp(thetaH, 0.0, HALF_PI) / knee) / log(1.0 + HALF_PI / knee) * (nodes.z - 1.0)
  );
  vec3 logarithm = texture(table, (at + 0.5) / nodes).rgb;
  return max(exp(logarithm) - epsilon, 0.0) / clamp(cosines, 0.01, 1.0);
}
`;
