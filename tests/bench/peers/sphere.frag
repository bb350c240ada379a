// A full-screen cast of one sphere around the origin. Before it go phong.glsl and the constants
// EYE (the camera's distance on +z), SLOPE (tangent of half the field of view) and SIZE (pixels).
out vec4 pixel;

vec3 encoded(vec3 c) {
  return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, greaterThan(c, vec3(0.0031308)));
}

void main() {
  vec3 way = normalize(vec3((2.0 * gl_FragCoord.xy / SIZE - 1.0) * SLOPE, -1.0));
  float b = EYE * way.z;
  float root = b * b - EYE * EYE + 1.0;
  vec3 color = vec3(0.0);
  if (root > 0.0) {
    vec3 P = vec3(0.0, 0.0, EYE) + (-b - sqrt(root)) * way;
    color = phong(P, P, -way);
  }
#ifdef ENCODE
  color = encoded(clamp(color, 0.0, 1.0));
#endif
  pixel = vec4(color, 1.0);
}
