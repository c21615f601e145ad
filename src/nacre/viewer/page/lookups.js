// GLSL that looks up reflectance in tables: material_eval(wi, wo) by the kind of a table, as
// nacre.measured.merl_table, mbsdf_table and rgl interpolate it, and material_known(wi, wo), whether
// it is valid there. Grids are 3-D textures.

const ANGLES = `
const float MATERIAL_PI = 3.14159265358979;
float material_polar(vec3 w) { return atan(length(w.xy), w.z); }
float material_azimuth(vec2 w) { return w == vec2(0.0) ? 0.0 : atan(w.y, w.x); }`;

// A loop over the corners of a cell, from `low` to `high`; `body` has a corner and its weight.
const corners = (body) => `for (int k = 0; k < 8; k++) {
    bvec3 upper = bvec3(k & 1, k & 2, k & 4);
    ivec3 node = ivec3(upper.x ? high.x : low.x, upper.y ? high.y : low.y, upper.z ? high.z : low.z);
    vec3 weights = mix(1.0 - part, part, vec3(upper));
    float weight = weights.x * weights.y * weights.z;
    ${body}
  }`;

// Linear between nodes, or that below; nodes without a valid sample, which are negative, do not take part.
const merl = ({ nearest }) => `${ANGLES}
uniform sampler3D material_nodes;  // over phi_d, theta_d and theta_h
// Weighted values of the nodes with a valid sample, and the sum of their weights.
vec4 material_sum(vec3 wi, vec3 wo) {
  vec3 h = wi + wo;
  h *= inversesqrt(max(dot(h, h), 1e-30));
  float s = length(h.xy);
  vec2 turn = s > 1e-15 ? h.xy / s : vec2(1.0, 0.0);
  vec2 w = vec2(dot(turn, wi.xy), turn.x * wi.y - turn.y * wi.x);
  vec3 d = vec3(h.z * w.x - s * wi.z, w.y, s * w.x + h.z * wi.z);
  float phi = material_azimuth(vec2(d.y < 0.0 ? -d.x : d.x, abs(d.y)));  // reciprocal: over half a turn
  ivec3 count = textureSize(material_nodes, 0), most = count - ivec3(0, 1, 1);
  vec3 at = vec3(phi / MATERIAL_PI, material_polar(d) * 2.0 / MATERIAL_PI, sqrt(material_polar(h) * 2.0 / MATERIAL_PI)) * vec3(count);
  ivec3 low = clamp(ivec3(at), ivec3(0), most), high = min(low + 1, most);
  vec3 part = ${nearest ? "vec3(0.0)" : "min(at - vec3(low), 1.0)"};
  vec4 sum = vec4(0.0);
  ${corners(`vec3 value = texelFetch(material_nodes, ivec3(node.x == count.x ? 0 : node.x, node.yz), 0).rgb;
    if (min(value.r, min(value.g, value.b)) >= 0.0) sum += weight * vec4(value, 1.0);`)}
  return sum;
}
vec3 material_eval(vec3 wi, vec3 wo) {
  vec4 sum = material_sum(wi, wo);
  return sum.rgb / max(sum.a, 1e-30) * MATERIAL_SCALE;
}
bool material_known(vec3 wi, vec3 wo) { return material_sum(wi, wo).a >= 1.0 - 1e-5; }`;

// Linear between the centers of cells.
const mbsdf = ({ grids }) => `${ANGLES}
uniform sampler3D material_nodes;  // over phi, theta_out and theta_in
vec3 material_eval(vec3 wi, vec3 wo) {
  float phi = material_azimuth(vec2(dot(wi.xy, wo.xy), abs(wi.x * wo.y - wi.y * wo.x)));
  ivec3 count = textureSize(material_nodes, 0);
  vec3 at = vec3(phi, 2.0 * material_polar(wo), 2.0 * material_polar(wi)) / MATERIAL_PI * vec3(count);
  at = max(at - 0.5, 0.0);
  ivec3 low = min(ivec3(at), count - 1), high = min(low + 1, count - 1);
  vec3 part = min(at - vec3(low), 1.0), sum = vec3(0.0);
  ${corners(`sum += weight * texelFetch(material_nodes, node, 0).${grids.nodes.channels === 3 ? "rgb" : "rrr"};`)}
  return max(sum, 0.0) * MATERIAL_SCALE;
}
bool material_known(vec3 wi, vec3 wo) { return true; }`;

// The map of Dupuy and Jakob 2018 from half vectors to a square, run backwards; slices of the tables
// belong to azimuths and polar angles of wo.
const rgl = ({ jacobian, isotropic, reduction, grids }) => `${ANGLES}
uniform sampler3D material_phi, material_theta, material_ndf, material_sigma, material_vndf, material_rows, material_columns, material_rgb;
const int SLICES = 4;
int material_slice[SLICES];
float material_weight[SLICES];

// Neighboring nodes of a list and how far from the first to the second.
int material_between(sampler3D nodes, float value, out float part) {
  int count = textureSize(nodes, 0).x, index = 0;
  part = 0.0;
  if (count == 1) return 0;
  for (int step = ${2 ** Math.ceil(Math.log2(Math.max(grids.phi.size[0], grids.theta.size[0], 2)))}; step > 0; step >>= 1) {
    int candidate = min(index + step, count - 2);
    if (texelFetch(nodes, ivec3(candidate, 0, 0), 0).r < value) index = candidate;
  }
  float low = texelFetch(nodes, ivec3(index, 0, 0), 0).r, high = texelFetch(nodes, ivec3(index + 1, 0, 0), 0).r;
  part = clamp((value - low) / (high - low), 0.0, 1.0);
  return index;
}

// A texel between slices.
vec3 material_blend(sampler3D grid, ivec2 at) {
  vec3 sum = vec3(0.0);
  for (int k = 0; k < SLICES; k++)
    if (material_weight[k] > 0.0) sum += material_weight[k] * texelFetch(grid, ivec3(at, material_slice[k]), 0).rgb;
  return sum;
}

ivec2 material_cell(sampler3D grid, vec2 point, out vec2 part) {
  ivec2 last = textureSize(grid, 0).xy - 1;
  vec2 at = clamp(point, 0.0, 1.0) * vec2(last);
  ivec2 cell = clamp(ivec2(at), ivec2(0), last - 1);
  part = at - vec2(cell);
  return cell;
}

float material_bilinear(sampler3D grid, vec2 point) {
  vec2 part;
  ivec3 cell = ivec3(material_cell(grid, point, part), 0);
  return mix(mix(texelFetch(grid, cell, 0).r, texelFetch(grid, cell + ivec3(1, 0, 0), 0).r, part.x),
             mix(texelFetch(grid, cell + ivec3(0, 1, 0), 0).r, texelFetch(grid, cell + ivec3(1, 1, 0), 0).r, part.x), part.y);
}

// Integral from 0 over part of one of so many segments, linear from start to end.
float material_integral(float part, float start, float end, int count) {
  return part * (start + 0.5 * part * (end - start)) / float(count);
}

vec3 material_eval(vec3 wi, vec3 wo) {
  vec2 signs = vec2(1.0);
  float z = max(wi.z, 1e-20);
${reduction === 1 ? "" : `  signs.y = wo.y >= 0.0 ? -1.0 : 1.0;
  signs.x = ${reduction === 4 ? "wo.x >= 0.0 ? -1.0 : 1.0" : "signs.y"};
  wi.xy *= signs;
  wo.xy *= signs;
`}  float theta = material_polar(wo), phi = material_azimuth(wo.xy);
${reduction === 1 ? "" : "  phi = -abs(phi);\n"}  vec2 along;
  int p = material_between(material_phi, phi, along.x), t = material_between(material_theta, theta, along.y);
  ivec2 count = ivec2(textureSize(material_phi, 0).x, textureSize(material_theta, 0).x);
  for (int k = 0; k < SLICES; k++) {
    ivec2 node = min(ivec2(p + (k >> 1), t + (k & 1)), count - 1);
    material_slice[k] = node.x * count.y + node.y;
    material_weight[k] = (k > 1 ? along.x : 1.0 - along.x) * ((k & 1) > 0 ? along.y : 1.0 - along.y);
  }
  vec3 m = wi + wo;
  m *= inversesqrt(max(dot(m, m), 1e-30));
  vec2 point = vec2(sqrt(material_polar(m) * 2.0 / MATERIAL_PI), (material_azimuth(m.xy)${isotropic ? " - phi" : ""}) / (2.0 * MATERIAL_PI) + 0.5);
  point.y -= floor(point.y);

  ivec2 last = textureSize(material_vndf, 0).xy - 1;
  vec2 part, square;
  ivec2 cell = material_cell(material_vndf, point, part), next = cell + ivec2(1, 0), above = cell + ivec2(0, 1);
  float left = mix(material_blend(material_vndf, cell).r, material_blend(material_vndf, above).r, part.y);
  float right = mix(material_blend(material_vndf, next).r, material_blend(material_vndf, above + ivec2(1, 0)).r, part.y);
  float low = material_blend(material_columns, ivec2(last.x, cell.y)).r, high = material_blend(material_columns, ivec2(last.x, above.y)).r;
  square.x = mix(material_blend(material_columns, cell).r, material_blend(material_columns, above).r, part.y)
      + material_integral(part.x, left, right, last.x);
  square.x /= max(mix(low, high, part.y), 1e-37);
  square.y = material_blend(material_rows, ivec2(cell.y, 0)).r + material_integral(part.y, low, high, last.y);

  vec2 inside;
  ivec2 at = material_cell(material_rgb, square, inside);
  vec3 color = mix(mix(material_blend(material_rgb, at), material_blend(material_rgb, at + ivec2(1, 0)), inside.x),
                   mix(material_blend(material_rgb, at + ivec2(0, 1)), material_blend(material_rgb, at + 1), inside.x), inside.y);
  float scale = MATERIAL_SCALE / z;
${jacobian ? `  vec2 seen = vec2(sqrt(theta * 2.0 / MATERIAL_PI), phi / (2.0 * MATERIAL_PI) + 0.5);
  scale *= material_bilinear(material_ndf, point) / (4.0 * max(material_bilinear(material_sigma, seen), 1e-20));
` : ""}  return max(scale * color, 0.0);
}

bool material_known(vec3 wi, vec3 wo) {
  vec3 f = material_eval(wi, wo);
  return max(f.r, max(f.g, f.b)) > 0.0;
}`;

const KINDS = { merl, mbsdf, rgl };

export const lookup = (table) => `const float MATERIAL_SCALE = ${table.scale.toExponential()};\n${KINDS[table.kind](table)}`;
