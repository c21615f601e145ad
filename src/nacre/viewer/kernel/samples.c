// Directions to fit a network at, and what it sees of them: see nacre.sampling.uniform and
// nacre.neural.inputs. Directions and colors have four numbers each, as textures of the page.

#include "kernel.h"

INLINE double clipped(double x) { return smaller(larger(x, 0.0), 1.0); }

// Light and view of Rusinkiewicz angles that are uniform for numbers in [0, 1).
static void rusinkiewicz(const float u[6], Direction *wi, Direction *wo) {
  double h = 0.5 * PI * u[0], d = 0.5 * PI * u[2];
  double c = cos(2.0 * PI * u[1]), s = sin(2.0 * PI * u[1]), hc = cos(h), hs = sin(h);
  Direction v = around(cos(d), u[3]);
  for (int32_t k = 0; k < 2; k++) {
    double x = hc * v.x + hs * v.z;
    *(k ? wo : wi) = (Direction){c * x - s * v.y, s * x + c * v.y, hc * v.z - hs * v.x};
    v.x = -v.x;
    v.y = -v.y;
  }
}

// A light that a mixture draws for a view; see nacre.sampling.mixture. Its numbers are how many lobes and
// cosines it has, whether it has an angle, that, and lists for the cosines: these, `uniform`, `squared`,
// and the fraction, roughness, across and shift of every lobe. Without lobes it is the cosine lobe.
static Direction drawn(const double *mixture, Direction wo, const float u[3]) {
  int32_t lobes = (int32_t)mixture[0], count = (int32_t)mixture[1], found = lobes - 1;
  const double *cosines = mixture + 4, *lists = cosines + count;
  double weights[16] = {1.0}, bound = 0.0, total = 0.0;
  for (int32_t k = 1; k < count; k++) {
    weights[k] = clipped((wo.z - cosines[k - 1]) / (cosines[k] - cosines[k - 1]));
    weights[k - 1] -= weights[k];
  }
#define AT(list) ({ double at = 0.0; for (int32_t m = 0; m < count; m++) at += weights[m] * lists[(list) * count + m]; at; })
  for (int32_t k = 0; k < lobes; k++) total += AT(2 + 4 * k);
  for (int32_t k = 0; k < lobes; k++) {
    bound += AT(2 + 4 * k);
    if (u[0] < bound) {
      found = k;
      break;
    }
  }
  if (u[0] >= total) {
    double below = total + (lobes ? AT(0) : 0.0), squared = below + (lobes ? AT(1) : 0.0), y = u[1];
    double z = u[0] < below ? y : u[0] < squared ? exp(log(larger(y, 1e-30)) / 3.0) : sqrt(y);
    return around(z, u[2]);
  }
  double along = AT(3 + 4 * found), across = AT(4 + 4 * found), shift = AT(5 + 4 * found);
  double c, s;
  azimuth(wo, &c, &s);
  if (mixture[2]) c = cos(mixture[3]), s = sin(mixture[3]);
  Direction view = in_frame(wo, c, s), seen = {along * view.x, across * view.y, view.z + shift * along * view.x};
  seen = normalized(seen);
  Direction cap = around((1.0 - u[1]) * (1.0 + seen.z) - seen.z, u[2]);
  cap = (Direction){cap.x + seen.x, cap.y + seen.y, cap.z + seen.z};
  Direction m = normalized((Direction){along * (cap.x + shift * cap.z), across * cap.y, cap.z});
  double twice = 2.0 * dot(view, m);
  return in_frame((Direction){twice * m.x - view.x, twice * m.y - view.y, twice * m.z - view.z}, c, -s);
}

// Pairs of directions from six times `count` random numbers, of which `u` has the room: in turn uniform in
// Rusinkiewicz angles, and as pictures of a sphere under the sky or in the light of its highlight show
// them ("mixed"). Returns how many are above the horizon.
EXPORT int32_t samples_draw(Random *random, float *u, int32_t count, int32_t isotropic, const double *mixture,
                            Vector *wi, Vector *wo) {
  int32_t kept = 0;
  random_floats(random, u, 6 * count);
  for (int32_t k = 0; k < count; k++) {
    float own[6];
    for (int32_t row = 0; row < 6; row++) own[row] = u[row * count + k];
    if (isotropic) own[1] = 0.0f;
    Direction light, view;
    if (k % 2) {
      view = around(sqrt(1.0 - own[0]), own[1]);
      light = drawn(mixture, view, own + 2);
      if (own[5] < 0.5f || light.z <= 0.0) light = around(1.0 - own[2], own[3]);
    } else rusinkiewicz(own, &light, &view);
    if (light.z <= 0.0 || view.z <= 0.0) continue;
    wi[kept] = (Vector){light.x, light.y, light.z, 0.0f};
    wo[kept++] = (Vector){view.x, view.y, view.z, 0.0f};
  }
  return kept;
}

enum { PAPER = 0, ENHANCED = 2, FREE = 1 };  // kinds of inputs; FREE where phi_h is not rotated to 0

INLINE double opened(double x, double least, double scale) { return log(x + least) / scale; }

// Inputs of a network for a pair of directions; returns how many. The angle is that of its axes.
static int32_t inputs(int32_t kind, double angle, Vector light, Vector view, double *to) {
  Direction wi = {light.x, light.y, light.z}, wo = {view.x, view.y, view.z};
  if (kind == ENHANCED + FREE && angle != 0.0) {
    wi = in_frame(wi, cos(angle), sin(angle));
    wo = in_frame(wo, cos(angle), sin(angle));
  }
  Direction h = middle(wi, wo);
  double square = h.x * h.x + h.y * h.y, sine = sqrt(larger(square, 3.2e-30));
  double grazing[2] = {opened(larger(wi.z, 0.0), 0.01, 4.6), opened(larger(wo.z, 0.0), 0.01, 4.6)};
  if (kind == ENHANCED + FREE) {
    double along = wi.z + (h.x * wi.x + h.y * wi.y) / larger(1.0 + h.z, 1e-6);
    double own[8] = {h.x, h.y, opened(h.x * h.x, 1e-3, 6.91), opened(h.y * h.y, 1e-3, 6.91), grazing[0],
                     grazing[1], wi.x - h.x * along, wi.y - h.y * along};
    for (int32_t k = 0; k < 8; k++) to[k] = own[k];
    return 8;
  }
  Direction d = difference(wi, h);
  double enhanced[6] = {sine, opened(square, 1e-4, 9.2), grazing[0], grazing[1], d.x, fabs(d.y)};
  double paper[6] = {sine, 0.0, h.z, d.x, d.y, d.z};
  if (kind == PAPER + FREE) paper[0] = h.x, paper[1] = h.y;
  for (int32_t k = 0; k < 6; k++) to[k] = kind == ENHANCED ? enhanced[k] : paper[k];
  return 6;
}

// Append samples to blocks of which `filled` samples are there, as far as they are known, where colors have
// a fourth number that is not 0, finite, and fit into `room`; returns how many there are then. The weight
// in the loss is `gain` cos theta_i, or `constant` where that is not 0.
EXPORT int32_t samples_fill(float *blocks, int32_t filled, int32_t room, const Vector *wi, const Vector *wo,
                            const Vector *rgb, int32_t count, int32_t kind, double angle, double gain,
                            double constant) {
  for (int32_t k = 0; k < count && filled < room; k++) {
    Vector f = rgb[k];
    if (f.w == 0.0f || !(fabs(f.x) + fabs(f.y) + fabs(f.z) < 3.4e38)) continue;
    double seen[8];
    int32_t rows = inputs(kind, angle, wi[k], wo[k], seen);
    float *to = blocks + (int64_t)(filled / BLOCK) * (rows + 4) * BLOCK + filled % BLOCK;
    for (int32_t row = 0; row < rows; row++) to[row * BLOCK] = (float)seen[row];
    float weight = constant != 0.0 ? (float)constant : (float)(gain * wi[k].z), color[3] = {f.x, f.y, f.z};
    for (int32_t channel = 0; channel < 3; channel++) {
      float target = color[channel] * weight;
      to[(rows + channel) * BLOCK] = target > 1e30f ? 1e30f : target > 0.0f ? target : 0.0f;
    }
    to[(rows + 3) * BLOCK] = weight;
    filled++;
  }
  return filled;
}

// Mean square of what axes at an angle in degrees leave unexplained of log(1 + 32 f cos theta_i); see
// nacre.neural.axes.
EXPORT double samples_axis(const Vector *wi, const Vector *wo, const Vector *rgb, int32_t count, int32_t degrees) {
  enum { TERMS = 8 };
  double angle = degrees % 90 * PI / 180.0, a[TERMS][TERMS + 1] = {{0.0}}, squares = 0.0;
  for (int32_t k = 0; k < count; k++) {
    double seen[8], t[TERMS + 1];
    inputs(ENHANCED + FREE, angle, wi[k], wo[k], seen);
    double x = wi[k].x + wo[k].x, y = wi[k].y + wo[k].y, z = wi[k].z + wo[k].z;
    double length = larger(x * x + y * y + z * z, 1e-30), square = (x * x + y * y) / length;
    double mean = (larger(rgb[k].x, 0.0) + larger(rgb[k].y, 0.0) + larger(rgb[k].z, 0.0)) / 3.0;
    double own[TERMS + 1] = {1.0, square, log(square + 1e-4), seen[4], seen[5], seen[2], seen[3],
                             (cos(2.0 * angle) * (x * x - y * y) + 2.0 * sin(2.0 * angle) * x * y) / length,
                             log(1.0 + 32.0 * mean * wi[k].z)};
    for (int32_t i = 0; i <= TERMS; i++) t[i] = own[i];
    for (int32_t i = 0; i < TERMS; i++)
      for (int32_t j = 0; j <= TERMS; j++) a[i][j] += t[i] * t[j];
    squares += t[TERMS] * t[TERMS];
  }
  // What elimination of one term after the other takes off the squares.
  for (int32_t i = 0; i < TERMS; i++) {
    if (a[i][i] <= 1e-12 * count) continue;
    squares -= a[i][TERMS] * a[i][TERMS] / a[i][i];
    for (int32_t r = i + 1; r < TERMS; r++) {
      double factor = a[r][i] / a[i][i];
      for (int32_t j = i; j <= TERMS; j++) a[r][j] -= factor * a[i][j];
    }
  }
  return squares / count;
}
