// Lobes that sample a material with the least variance: see nacre.sampling.fit, moment and mixture_moment.

#include "kernel.h"

enum { VIEWS = 8, LIGHTS = 512, POINTS = VIEWS * LIGHTS, COSINES = 3, MOST = 2 + 4 * 2, FREE = COSINES * MOST };

static const double cosines[COSINES] = {0.1, 0.45, 1.0};
static const double roughnesses[6] = {0.003, 0.01, 0.03, 0.1, 0.3, 1.0};  // of the proposal
// Points and weights of Gauss and Legendre in (-1, 1), mirrored.
static const double nodes[4] = {0.1834346424956498, 0.525532409916329, 0.7966664774136267, 0.9602898564975363};
static const double parts[4] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763};

typedef struct {
  Direction wi[POINTS], wo[POINTS], half[POINTS], view[POINTS];  // the last two in the frame of the lobes
  double density[POINTS], weights[POINTS], hats[VIEWS][COSINES];
  int32_t lobes;
} Moment;

// Density in 1/sr of mirror directions of visible GGX normals.
INLINE double visible(Direction h, Direction wo, double along, double across, double shift) {
  double x = h.x / along - shift * h.z, y = h.y / across;
  double squares = larger(x * x + y * y + h.z * h.z, 0.01);
  double sx = along * wo.x, sy = across * wo.y, sz = wo.z + shift * sx;
  double area = 0.5 * larger(sz + sqrt(sx * sx + sy * sy + sz * sz), 1e-12);
  return 1.0 / (PI * along * across * squares * squares * 4.0 * area);
}

EXPORT uint32_t lobes_bytes(void) { return ALIGNED(sizeof(Moment)); }
EXPORT int32_t lobes_points(void) { return POINTS; }

// Directions at which lobes are fitted, from a generator with the seed 0.
EXPORT void lobes_propose(Moment *to, Random *random, Vector *wi, Vector *wo) {
  double offset[4], root = 2.0, steps[4];
  random_doubles(random, offset, 4);
  for (int32_t k = 0; k < 64; k++) root = pow(1.0 + root, 0.2);
  for (int32_t k = 0; k < 4; k++) steps[k] = pow(root, -1.0 - k);
  for (int32_t point = 0; point < POINTS; point++) {
    double u[4], node = nodes[point / LIGHTS < 4 ? 3 - point / LIGHTS : point / LIGHTS - 4];
    for (int32_t k = 0; k < 4; k++) {
      double at = offset[k] + point * steps[k];
      u[k] = at - floor(at);
    }
    double sine = 0.5 * (1.0 + (point / LIGHTS < 4 ? -node : node));
    Direction view = around(sqrt(1.0 - sine), u[3]), light;
    int32_t part = (int32_t)(u[0] * 8.0);
    if (part == 0) light = around(sqrt(larger(1.0 - u[1], 0.0)), u[2]);
    else if (part == 1) light = around(1.0 - u[1], u[2]);
    else {
      double alpha = roughnesses[part - 2];
      Direction seen = normalized((Direction){alpha * view.x, alpha * view.y, view.z});
      Direction cap = around((1.0 - u[1]) * (1.0 + seen.z) - seen.z, u[2]);
      Direction m = normalized((Direction){alpha * (cap.x + seen.x), alpha * (cap.y + seen.y), cap.z + seen.z});
      double twice = 2.0 * dot(view, m);
      light = (Direction){twice * m.x - view.x, twice * m.y - view.y, twice * m.z - view.z};
    }
    double density = INFINITY;
    if (light.z > 0.0) {
      Direction h = middle(light, view);
      density = light.z / PI + 0.5 / PI;
      for (int32_t k = 0; k < 6; k++) density += visible(h, view, roughnesses[k], roughnesses[k], 0.0);
      density /= 8.0;
    } else light = (Direction){0.0, 0.0, 1.0};
    to->wi[point] = light;
    to->wo[point] = view;
    to->density[point] = density;
    wi[point] = (Vector){light.x, light.y, light.z, 0.0f};
    wo[point] = (Vector){view.x, view.y, view.z, 0.0f};
  }
}

// Weights of the directions from f_r there; their sum.
static double weighted(Moment *of, const Vector *rgb) {
  double total = 0.0;
  for (int32_t view = 0; view < VIEWS; view++) {
    double albedo[3] = {0.0}, brightest = 0.0;
    for (int32_t k = view * LIGHTS; k < (view + 1) * LIGHTS; k++) {
      const float *f = &rgb[k].x;
      for (int32_t c = 0; c < 3; c++)
        if (fabs(f[c]) < 3.4e38) albedo[c] += f[c] * of->wi[k].z / of->density[k] / LIGHTS;
    }
    for (int32_t c = 0; c < 3; c++) brightest = larger(brightest, albedo[c]);
    for (int32_t k = view * LIGHTS; k < (view + 1) * LIGHTS; k++) {
      const float *f = &rgb[k].x;
      double square = 0.0;
      for (int32_t c = 0; c < 3; c++) {
        double value = fabs(f[c]) < 3.4e38 ? f[c] * of->wi[k].z : 0.0;
        square += value * value / (albedo[c] * albedo[c] + 0.01 * brightest * brightest) / 3.0;
      }
      double weight = 0.5 * parts[view < 4 ? 3 - view : view - 4] / LIGHTS * square / of->density[k];
      of->weights[k] = weight < INFINITY ? weight : 0.0;
      total += of->weights[k];
    }
  }
  return total;
}

// Half vectors and views in the frame of lobes that turn with the view, or have an angle where `fixed`.
static void framed(Moment *of, int32_t fixed, double angle) {
  for (int32_t k = 0; k < POINTS; k++) {
    Direction wi = of->wi[k], wo = of->wo[k];
    double sine = sqrt(wo.x * wo.x + wo.y * wo.y);
    double c = fixed ? cos(angle) : wo.x / sine, s = fixed ? sin(angle) : wo.y / sine;
    of->half[k] = in_frame(middle(wi, wo), c, s);
    of->view[k] = in_frame(wo, c, s);
  }
  for (int32_t view = 0; view < VIEWS; view++) {
    double mu = of->wo[view * LIGHTS].z, *hats = of->hats[view];
    double low = smaller(larger((mu - cosines[0]) / (cosines[1] - cosines[0]), 0.0), 1.0);
    double high = smaller(larger((mu - cosines[1]) / (cosines[2] - cosines[1]), 0.0), 1.0);
    hats[0] = 1.0 - low;
    hats[1] = low - high;
    hats[2] = high;
  }
}

static const double lowest = -5.521460917862246, range = 5.926926025970411;  // logarithms of roughnesses: .004 to 1.5

INLINE double logistic(double x) { return 1.0 / (1.0 + exp(-smaller(larger(x, -30.0), 30.0))); }

// Values of a row of free parameters, and their derivatives.
static void bounded(const double *free, int32_t lobes, double *values, double chain[MOST][MOST]) {
  int32_t fractions = 2 + lobes, count = 2 + 4 * lobes;
  double whole = 1.0;
  for (int32_t i = 0; i < count; i++)
    for (int32_t j = 0; j < count; j++) chain[i][j] = 0.0;
  for (int32_t i = 0; i < fractions; i++) whole += values[i] = exp(smaller(larger(free[i], -30.0), 30.0));
  for (int32_t i = 0; i < fractions; i++) values[i] /= whole;
  for (int32_t i = 0; i < fractions; i++)
    for (int32_t j = 0; j < fractions; j++) chain[i][j] = 0.99 * values[i] * ((i == j) - values[j]);
  for (int32_t i = 0; i < fractions; i++) values[i] *= 0.99;
  for (int32_t i = fractions; i < count; i++)
    if (i < 2 + 3 * lobes) {
      double place = logistic(free[i]);
      values[i] = exp(lowest + range * place);
      chain[i][i] = values[i] * range * place * (1.0 - place);
    } else {
      values[i] = 2.0 * logistic(2.0 * free[i]) - 1.0;
      chain[i][i] = 1.0 - values[i] * values[i];
    }
}

// Value, gradient and near enough the Hessian of the second moment.
static double moment(Moment *of, const double *free, double *gradient, double hessian[FREE][FREE]) {
  int32_t lobes = of->lobes, count = 2 + 4 * lobes, size = COSINES * count;
  double values[COSINES][MOST], chain[COSINES][MOST][MOST], total = 0.0;
  for (int32_t m = 0; m < COSINES; m++) bounded(free + m * count, lobes, values[m], chain[m]);
  for (int32_t i = 0; i < size; i++) {
    gradient[i] = 0.0;
    for (int32_t j = 0; j < size; j++) hessian[i][j] = 0.0;
  }
  for (int32_t view = 0; view < VIEWS; view++) {
    double at[MOST], g[MOST] = {0.0}, h[MOST][MOST] = {{0.0}}, j[MOST][FREE];
    for (int32_t c = 0; c < count; c++) {
      at[c] = 0.0;
      for (int32_t m = 0; m < COSINES; m++) {
        at[c] += of->hats[view][m] * values[m][c];
        for (int32_t p = 0; p < count; p++) j[c][m * count + p] = of->hats[view][m] * chain[m][c][p];
      }
    }
    for (int32_t n = 0; n < LIGHTS; n++) {
      int32_t k = view * LIGHTS + n;
      double z = of->wi[k].z, cosine = z / PI, s[MOST];
      s[0] = 0.5 / PI - cosine;
      s[1] = 1.5 / PI * z * z - cosine;
      for (int32_t l = 0; l < lobes; l++) {
        double *shape = at + 2 + lobes + l, along = shape[0], across = shape[lobes], shift = shape[2 * lobes];
        double lobe = visible(of->half[k], of->view[k], along, across, shift), step = 1e-5;
        double fraction = at[2 + l] / step, *to = s + 2 + lobes + l;
        s[2 + l] = lobe - cosine;
        to[0] = fraction / along * (visible(of->half[k], of->view[k], along * (1.0 + step), across, shift) - lobe);
        to[lobes] = fraction / across * (visible(of->half[k], of->view[k], along, across * (1.0 + step), shift) - lobe);
        to[2 * lobes] = fraction * (visible(of->half[k], of->view[k], along, across, shift + step) - lobe);
      }
      double density = cosine;
      for (int32_t c = 0; c < 2 + lobes; c++) density += at[c] * s[c];
      double ratio = of->weights[k] / density;
      total += ratio;
      for (int32_t c = 0; c < count; c++) s[c] /= density;
      for (int32_t c = 0; c < count; c++) {
        g[c] -= ratio * s[c];
        for (int32_t d = 0; d <= c; d++) h[c][d] += 2.0 * ratio * s[c] * s[d];
      }
    }
    for (int32_t p = 0; p < size; p++) {
      double across[MOST];
      for (int32_t c = 0; c < count; c++) {
        across[c] = 0.0;
        gradient[p] += g[c] * j[c][p];
        for (int32_t d = 0; d < count; d++) across[c] += (d <= c ? h[c][d] : h[d][c]) * j[d][p];
      }
      for (int32_t q = 0; q < size; q++)
        for (int32_t c = 0; c < count; c++) hessian[p][q] += across[c] * j[c][q];
    }
  }
  return total;
}

// Damped Newton steps from a start, which becomes the best found; see nacre.numerics.newton.
static double minimized(Moment *of, double *best, int32_t iterations) {
  static double hessian[FREE][FREE], other[FREE][FREE], gradient[FREE], slope[FREE], a[FREE][FREE];
  int32_t size = COSINES * (2 + 4 * of->lobes);
  double value = moment(of, best, gradient, hessian), damping = 1e-3;
  for (int32_t round = 0; round < iterations; round++) {
    double step[FREE], trial[FREE], longest = 0.0;
    for (int32_t i = 0; i < size; i++) {
      for (int32_t j = 0; j < size; j++) a[i][j] = hessian[i][j];
      a[i][i] += damping * larger(hessian[i][i], 1e-9) + 1e-9;
      step[i] = -gradient[i];
    }
    for (int32_t i = 0; i < size; i++)
      for (int32_t r = i + 1; r < size; r++) {
        double factor = a[r][i] / a[i][i];
        for (int32_t j = i; j < size; j++) a[r][j] -= factor * a[i][j];
        step[r] -= factor * step[i];
      }
    for (int32_t i = size - 1; i >= 0; i--) {
      for (int32_t j = i + 1; j < size; j++) step[i] -= a[i][j] * step[j];
      step[i] /= a[i][i];
    }
    for (int32_t i = 0; i < size; i++) longest = larger(longest, fabs(step[i]));
    for (int32_t i = 0; i < size; i++) trial[i] = best[i] + step[i] * smaller(1.0, 2.0 / larger(longest, 2.0));
    double found = moment(of, trial, slope, other);
    if (found < value) {
      double gain = value - found;
      value = found;
      damping = larger(0.2 * damping, 1e-8);
      for (int32_t i = 0; i < size; i++) {
        best[i] = trial[i];
        gradient[i] = slope[i];
        for (int32_t j = 0; j < size; j++) hessian[i][j] = other[i][j];
      }
      if (gain < 1e-5) break;
    } else if ((damping *= 5.0) > 1e8) break;
  }
  return value;
}

// Go on from the best of some starts, which is then the first.
static double best_of(Moment *of, double (*starts)[FREE], int32_t count) {
  int32_t best = 0;
  double values[3];
  for (int32_t k = 0; k < count; k++) {
    values[k] = minimized(of, starts[k], 10);
    if (values[k] < values[best]) best = k;
  }
  for (int32_t i = 0; i < FREE; i++) starts[0][i] = starts[best][i];
  return minimized(of, starts[0], 40);
}

// Two lobes in the frame of an angle, or of the view: the second moment, and the numbers of the mixture
// as samples.c has them.
static double fitted(Moment *of, int32_t fixed, double angle, double *mixture) {
  static double starts[3][FREE], split[2][FREE];
  const double widths[3] = {0.02, 0.1, 0.4}, wider[2] = {-0.6, 0.6};
  framed(of, fixed, angle);
  of->lobes = 1;
  for (int32_t k = 0; k < 3; k++)
    for (int32_t m = 0; m < COSINES; m++) {
      double place = (log(widths[k]) - lowest) / range, roughness = log(place / (1.0 - place));
      const double row[6] = {-2.0, -2.0, 0.0, roughness, roughness, 0.0};
      for (int32_t c = 0; c < 6; c++) starts[k][6 * m + c] = row[c];
    }
  best_of(of, starts, 3);
  for (int32_t k = 0; k < 2; k++)
    for (int32_t m = 0; m < COSINES; m++)
      for (int32_t c = 0; c < 10; c++) {
        double own = starts[0][6 * m + (c < 2 ? c : 1 + c / 2)];
        split[k][10 * m + c] = own - (c == 2 || c == 3 ? log(2.0) : 0.0) + (c == 5 || c == 7 ? wider[k] : 0.0);
      }
  of->lobes = 2;
  double value = best_of(of, split, 2), values[COSINES][MOST], chain[MOST][MOST];
  const double head[4] = {2.0, COSINES, fixed, angle};
  for (int32_t k = 0; k < 4; k++) mixture[k] = head[k];
  for (int32_t m = 0; m < COSINES; m++) {
    bounded(split[0] + 10 * m, 2, values[m], chain);
    mixture[4 + m] = cosines[m];
    for (int32_t list = 0; list < MOST; list++) {
      int32_t column = list < 2 ? list : 2 + (list - 2) / 4 + 2 * ((list - 2) % 4);
      mixture[4 + COSINES * (1 + list) + m] = values[m][column];
    }
  }
  return value;
}

// The mixture of least second moment for f_r at the proposed directions, in 37 numbers; without lobes where
// it is black or the cosine lobe does as well.
EXPORT void lobes_fit(Moment *of, const Vector *rgb, int32_t isotropic, double *mixture) {
  double cosine = 0.0, total = weighted(of, rgb), other[37], c = 0.0, s = 0.0;
  mixture[0] = mixture[1] = mixture[2] = mixture[3] = 0.0;
  if (!(total > 0.0)) return;
  for (int32_t k = 0; k < POINTS; k++) {
    double x = of->wi[k].x + of->wo[k].x, y = of->wi[k].y + of->wo[k].y, z = of->wi[k].z + of->wo[k].z;
    double length = larger(x * x + y * y + z * z, 1e-30);
    c += of->weights[k] * (x * x - y * y) / length;
    s += of->weights[k] * x * y / length;
    cosine += PI * of->weights[k] / of->wi[k].z;
  }
  double value = fitted(of, 0, 0.0, mixture);
  if (!isotropic) {
    double found = fitted(of, 1, 0.5 * atan2(2.0 * s, c), other);
    if (found < value)
      for (int32_t k = 0; k < 37; k++) mixture[k] = other[k];
    value = smaller(value, found);
  }
  if (!(value < 0.999 * cosine)) mixture[0] = mixture[1] = mixture[2] = 0.0;
}
