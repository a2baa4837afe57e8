// What draws scenes on a graphics card, in web pages and in windows: OpenGL ES 3.0 and OpenGL 3.3, which read the same.
// Sections begin with an exclamation mark. DISC: splats across normals; QUADS: splats as
// instances of four corners, where points have a largest size and vanish with their middles; PICK: what is there, in place of colours.
//! common
uniform mat3 linear; uniform vec3 offset; uniform vec2 focal, center, size; uniform float near, far, opacity, lookedAt;
uniform bool isOrthographic;
// 0: colours, 1: depths alone, 2: sums of colours, 3: veils, 4: what they let through.
uniform int mode;
uniform uint batch;
float light(vec3 normal, vec3 p) {
  vec3 towards = isOrthographic ? vec3(0, 0, 1) : p;
  float lengths = length(normal) * length(towards);
  return lengths > 0. ? .4 + .6 * abs(dot(normal, towards)) / lengths : 1.;
}
//! vertex
vec3 inCamera(vec3 p) { return linear * p + offset; }
vec2 inPixels(vec3 p) { return focal * p.xy / (isOrthographic ? 1. : p.z) + center; }
// A place in pixels as the corners of the clip space have it. w is the depth, so that what varies does so as in space.
vec4 clip(vec2 pixel, float z, float depth) {
  vec2 device = vec2(pixel.x + .5, size.y - pixel.y - .5) * 2. / size - 1.;
  float w = isOrthographic ? 1. : z;
  return vec4(device * w, (2. * depth / far - 1.) * w, w);
}
const vec4 nowhere = vec4(2, 2, 2, 1);
//! fragment
#ifdef PICK
layout(location = 0) out uvec4 result;
#else
layout(location = 0) out vec4 result;
#endif
void put(vec3 color, float z, float weight) {
#ifdef PICK
  result = uvec4(batch, floatBitsToUint(z), 0u, 0u);
#else
  float share = isOrthographic ? 1. : clamp(lookedAt / z, 1e-2, 1e2);
  float veil = opacity * share * share / 16.;
  if (mode == 2) result = vec4(color * weight, weight);
  else if (mode == 3) result = vec4(color * veil, veil);
  else if (mode == 4) result = vec4(opacity);
  else result = vec4(color, 1);
#endif
}
//! points.vertex
uniform bool isLength, hasNormals, isLit; uniform vec2 sizes; uniform float growth, pixelRatio, largest;
layout(location = 0) in vec3 position; layout(location = 1) in vec4 color; layout(location = 2) in vec2 octahedral;
flat out vec3 tint; flat out float depth, roundness;
#ifdef QUADS
out vec2 corner;
#endif
#ifdef DISC
flat out vec3 normal, middle; flat out vec2 pixel; flat out float reach;
#endif
vec3 inCameraOfNormal() {
  vec3 n = vec3(octahedral, 1. - abs(octahedral.x) - abs(octahedral.y));
  if (n.z < 0.) n.xy = (1. - abs(n.yx)) * vec2(n.x < 0. ? -1. : 1., n.y < 0. ? -1. : 1.);
  return normalize(linear * n);
}
void main() {
  vec3 p = inCamera(position);
  if (!(p.z > near)) { gl_Position = nowhere; return; }
  float scale = isOrthographic ? 1. : 1. / p.z;
  float diameter = sizes.x * pow(sizes.y / sizes.x, color.a) * growth;
  float pixels = isLength ? diameter * focal.x * scale : diameter * pixelRatio;
  float deep = isLength ? diameter : pixels / (focal.x * scale);
  float drawn = clamp(pixels, 1., largest);
  roundness = pixels < 1.42 ? 0. : 1.;
  bool isDirected = hasNormals && octahedral != vec2(-1);
  vec3 n = isDirected ? inCameraOfNormal() : vec3(0);
  tint = color.rgb;
  if (isDirected && isLit) tint *= light(n, p);
#ifdef DISC
  normal = n; middle = p; pixel = inPixels(p); reach = deep / 2.;
  // Near the border of a picture, the picture of a disc is longer than that of one in its middle.
  if (isDirected) drawn = clamp(1.25 * pixels, 2., 1.25 * largest);
#endif
  depth = p.z;
  vec2 middleOfSplat = inPixels(p);
#ifdef QUADS
  corner = vec2(gl_VertexID % 2 == 0 ? -1. : 1., gl_VertexID < 2 ? -1. : 1.);
  // What is smaller than two pixels is the pixel that its middle is in.
  if (roundness == 0. && drawn < 1.42) { middleOfSplat = floor(middleOfSplat + .5); drawn = 1.; }
  middleOfSplat += corner * drawn / 2.;
#else
  gl_PointSize = drawn;
#endif
  // What is mixed may lie as deep behind the nearest as it is large.
  gl_Position = clip(middleOfSplat, p.z, mode == 2 ? max(p.z - deep, 1e-7 * far) : p.z);
}
//! points.fragment
flat in vec3 tint; flat in float depth, roundness;
#ifdef QUADS
in vec2 corner;
#endif
#ifdef DISC
flat in vec3 normal, middle; flat in vec2 pixel; flat in float reach;
#endif
void main() {
#ifdef QUADS
  vec2 from = corner;
#else
  vec2 from = 2. * gl_PointCoord - 1.;
#endif
  float share = dot(from, from) * roundness, z = depth;
#ifdef DISC
  if (normal != vec3(0)) {
    vec2 here = vec2(gl_FragCoord.x - .5, size.y - gl_FragCoord.y - .5), beside = (here - center) / focal;
    vec3 origin = isOrthographic ? vec3(beside, 0) : vec3(0), ahead = isOrthographic ? vec3(0, 0, 1) : vec3(beside, 1);
    z = dot(normal, middle - origin) / dot(normal, ahead);
    vec3 away = origin + z * ahead - middle;
    share = dot(away, away) / (reach * reach);
    if (!(share <= 1.)) { share = 4. * dot(here - pixel, here - pixel); z = depth; }
  }
  gl_FragDepth = (mode == 2 ? max(z - 2. * reach, 1e-7 * far) : z) / far;
#endif
  if (!(share <= 1.)) discard;
  put(tint, z, (1. + 15. * (1. - share)) / 16.);
}
//! lines.vertex
uniform float width;
layout(location = 0) in vec3 a; layout(location = 1) in vec3 b; layout(location = 2) in vec4 color;
flat out vec3 tint; out vec3 place;
void main() {
  vec3 p = inCamera(a), q = inCamera(b);
  float least = max(near, 1e-9 * far);
  if (max(p.z, q.z) < least) { gl_Position = nowhere; return; }
  if (p.z < least) p = mix(q, p, (q.z - least) / (q.z - p.z));
  if (q.z < least) q = mix(p, q, (p.z - least) / (p.z - q.z));
  vec2 from = inPixels(p), along = inPixels(q) - from;
  along = length(along) > 0. ? normalize(along) : vec2(1, 0);
  bool isEnd = gl_VertexID > 1;
  vec2 aside = vec2(-along.y, along.x) * (gl_VertexID % 2 == 0 ? .5 : -.5) * width;
  place = isEnd ? q : p;
  tint = color.rgb;
  gl_Position = clip(inPixels(place) + aside, place.z, .5 * far);
}
//! lines.fragment
flat in vec3 tint; in vec3 place;
void main() {
  float z = place.z * .999;  // So that lines are seen on a surface.
  gl_FragDepth = z / far;
#ifdef PICK
  z = place.z;
#endif
  put(tint, z, 1.);
}
//! triangles.vertex
layout(location = 0) in vec3 position; layout(location = 1) in vec4 color; layout(location = 2) in vec3 normal;
layout(location = 3) in vec2 textured;
out vec3 tint, facing, place; out vec2 inTexture;
void main() {
  place = inCamera(position);
  inTexture = textured;
  tint = color.rgb;
  facing = linear * normal;
  // Cut where the depth is 0 only: clip spaces have no depth that is that of space.
  gl_Position = clip(inPixels(place), place.z, .5 * far);
  if (!isOrthographic) gl_Position.xy = (vec2(1, -1) * (focal * place.xy + (center + .5) * place.z) * 2. / size - vec2(1, -1) * place.z);
}
//! triangles.fragment
uniform bool hasNormals, hasTexture, isLit; uniform sampler2D photo;
in vec3 tint, facing, place; in vec2 inTexture;
void main() {
  vec3 flatNormal = cross(dFdx(place), dFdy(place));
  if (place.z < near) discard;
  gl_FragDepth = place.z / far;
  vec3 color = tint;
  if (hasTexture) color = texelFetch(photo, ivec2(clamp(floor(inTexture + .5), vec2(0), vec2(textureSize(photo, 0) - 1))), 0).rgb;
  if (isLit) color *= light(hasNormals ? facing : flatNormal, place);
  put(color, place.z, 1.);
#ifndef PICK
  // So that edges are not seen on it.
  if (!isLit && mode == 0) result = -result;
#endif
}
//! resolve.vertex
void main() { gl_Position = vec4(gl_VertexID == 1 ? 3 : -1, gl_VertexID == 2 ? 3 : -1, 0, 1); }
//! resolve.fragment
uniform sampler2D sums, depths, veils, passed; uniform vec3 background; uniform float edges; uniform int reach; uniform bool hasVeils;
out vec4 result;
float at(ivec2 p, float otherwise) {
  if (any(lessThan(p, ivec2(0))) || any(greaterThanEqual(p, ivec2(size)))) return otherwise;
  float depth = texelFetch(depths, p, 0).r;
  return depth < 1. ? depth * far : otherwise;
}
void main() {
  ivec2 p = ivec2(gl_FragCoord.xy);
  float depth = texelFetch(depths, p, 0).r, z = depth * far;
  vec3 color = background;
  if (depth < 1.) {
    vec4 sum = texelFetch(sums, p, 0);
    color = sum.a == 0. ? sum.rgb : sum.rgb / sum.a;
    float scale = isOrthographic ? focal.x / size.x : 1. / z, steps = 0.;
    ivec2 directions[4] = ivec2[4](ivec2(1, 0), ivec2(1, 1), ivec2(0, 1), ivec2(-1, 1));
    for (int k = 0; k < 4; ++k)
      steps += clamp((2. * z - at(p + reach * directions[k], z) - at(p - reach * directions[k], z)) * scale, 0., .04);
    if (sum.a > 0.) color /= 1. + edges * 12. * steps;
  }
  if (hasVeils) {
    vec4 veil = texelFetch(veils, p, 0);
    if (veil.a > 0.) color = mix(veil.rgb / veil.a, color, texelFetch(passed, p, 0).r);
  }
  result = vec4(color, 1);
}
