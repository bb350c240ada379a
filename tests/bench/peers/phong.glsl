// The model's formula for the peers that take GLSL. Before it go LIGHTS, and the constants POSITION,
// COLOR [LIGHTS], ATTENUATION, AMBIENT, DIFFUSE, SPECULAR and SHININESS of the scene; the compiler
// may fold them all. N and V are unit vectors.
vec3 phong(vec3 P, vec3 N, vec3 V) {
  vec3 W = 2.0 * dot(N, V) * N - V;
  vec3 sum = AMBIENT;
  for (int j = 0; j < LIGHTS; j++) {
    vec3 way = POSITION[j] - P;
    float d2 = dot(way, way);
    float d = sqrt(d2);
    vec3 L = way / d;
    float facing = dot(N, L);
    if (facing > 0.0) {
      float f = 1.0 / (ATTENUATION.x + ATTENUATION.y * d + ATTENUATION.z * d2);
      float g = pow(max(dot(L, W), 0.0), SHININESS);
      sum += f * COLOR[j] * (DIFFUSE * facing + SPECULAR * g);
    }
  }
  return sum;
}
