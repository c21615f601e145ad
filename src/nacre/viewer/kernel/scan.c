// Scattered samples of an isotropic reflectance, interpolated as nacre.measured.interpolation does it, and
// the directions at which nacre.neural.augmentation has them interpolated.

#include "kernel.h"

enum { NEAREST = 16, AXES = 4 };

typedef struct {
  int32_t count;
  double reach, scale[AXES];  // within which f_r is known, in coordinates times these
  double (*points)[AXES];     // a tree: the middle one of a range parts it along its axis
  double (*logs)[3];
  int32_t *axis, *own;        // of the points; the sample that each stands for
  double *room;
} Scan;

typedef struct { double distance[NEAREST]; int32_t point[NEAREST], count, most; } Near;

static void coordinates(Direction wi, Direction wo, double to[AXES]) {
  Direction h = middle(wi, wo), d = difference(wi, h);
  double sine = sqrt(larger(h.x * h.x + h.y * h.y, 0.0));
  to[0] = 2.0 * sqrt(atan2(sine, h.z));
  to[1] = 1.5 * atan2(sqrt(d.x * d.x + d.y * d.y), d.z);
  to[2] = 0.5 * sine * d.x;
  to[3] = 0.5 * sine * fabs(d.y);
}

static void swapped(Scan *scan, int32_t a, int32_t b) {
  for (int32_t k = 0; k < AXES; k++) {
    double held = scan->points[a][k];
    scan->points[a][k] = scan->points[b][k];
    scan->points[b][k] = held;
  }
  int32_t held = scan->own[a];
  scan->own[a] = scan->own[b];
  scan->own[b] = held;
}

// Part a range of points at its middle, and so on: along the axis on which it is longest.
static void parted(Scan *scan, int32_t start, int32_t end) {
  while (end - start > 1) {
    int32_t axis = 0, middle = (start + end) / 2, low = start, high = end - 1;
    double longest = -1.0;
    for (int32_t k = 0; k < AXES; k++) {
      double least = INFINITY, most = -INFINITY;
      for (int32_t p = start; p < end; p++) {
        least = smaller(least, scan->points[p][k]);
        most = larger(most, scan->points[p][k]);
      }
      if (most - least > longest) longest = most - least, axis = k;
    }
    while (low < high) {
      double pivot = scan->points[(low + high) / 2][axis];
      int32_t i = low, j = high;
      while (i <= j) {
        while (scan->points[i][axis] < pivot) i++;
        while (scan->points[j][axis] > pivot) j--;
        if (i <= j) swapped(scan, i++, j--);
      }
      if (middle <= j) high = j;
      else if (middle >= i) low = i;
      else break;
    }
    scan->axis[middle] = axis;
    parted(scan, start, middle);
    start = middle + 1;
  }
}

// Add the points of a range that are nearest; squares of distances, in scaled coordinates.
static void searched(const Scan *scan, const double *at, const double *scale, int32_t start, int32_t end, Near *near) {
  while (start < end) {
    int32_t middle = (start + end) / 2, axis = scan->axis[middle], k;
    double distance = 0.0;
    for (k = 0; k < AXES; k++) {
      double step = (scan->points[middle][k] - at[k]) * scale[k];
      distance += step * step;
    }
    if (near->count < near->most || distance < near->distance[near->count - 1]) {
      k = near->count < near->most ? near->count++ : near->most - 1;
      for (; k > 0 && near->distance[k - 1] > distance; k--) {
        near->distance[k] = near->distance[k - 1];
        near->point[k] = near->point[k - 1];
      }
      near->distance[k] = distance;
      near->point[k] = middle;
    }
    double beyond = (at[axis] - scan->points[middle][axis]) * scale[axis];
    searched(scan, at, scale, beyond < 0.0 ? start : middle + 1, beyond < 0.0 ? middle : end, near);
    if (near->count == near->most && beyond * beyond >= near->distance[near->count - 1]) return;
    if (beyond < 0.0) start = middle + 1;
    else end = middle;
  }
}

static const double even[AXES] = {1.0, 1.0, 1.0, 1.0};

static Near nearest(const Scan *scan, const double *at, const double *scale, int32_t most) {
  Near near = {.count = 0, .most = most < scan->count ? most : scan->count};
  searched(scan, at, scale, 0, scan->count, &near);
  return near;
}

// The one of so many numbers that comes after `rank` others.
static double ranked(double *numbers, int32_t count, int32_t rank) {
  int32_t low = 0, high = count - 1;
  while (low < high) {
    double pivot = numbers[(low + high) / 2];
    int32_t i = low, j = high;
    while (i <= j) {
      while (numbers[i] < pivot) i++;
      while (numbers[j] > pivot) j--;
      if (i <= j) {
        double held = numbers[i];
        numbers[i++] = numbers[j];
        numbers[j--] = held;
      }
    }
    if (rank <= j) high = j;
    else if (rank >= i) low = i;
    else break;
  }
  return numbers[rank];
}

EXPORT uint32_t scan_bytes(int32_t count) { return ALIGNED(sizeof(Scan)) + count * (8 * AXES + 8 * 3 + 8 + 8 + 8); }

// Samples to interpolate, in memory of that size. `gap` is the longest way from one light to the next
// where there are many views of few lights, else 0.
EXPORT void scan_new(void *memory, const Vector *wi, const Vector *wo, const Vector *rgb, int32_t count, double gap) {
  Scan *scan = memory;
  scan->count = count;
  scan->points = (double (*)[AXES])((char *)memory + ALIGNED(sizeof(Scan)));
  scan->logs = (double (*)[3])(scan->points + count);
  scan->room = (double *)(scan->logs + count);
  scan->axis = (int32_t *)(scan->room + count);
  scan->own = scan->axis + count;
  for (int32_t k = 0; k < count; k++) {
    coordinates((Direction){wi[k].x, wi[k].y, wi[k].z}, (Direction){wo[k].x, wo[k].y, wo[k].z}, scan->points[k]);
    const float *f = &rgb[k].x;
    for (int32_t c = 0; c < 3; c++) scan->logs[k][c] = log(1.0 + larger(f[c], 0.0) / 1e-4);
    scan->own[k] = k;
  }
  parted(scan, 0, count);
  int32_t few = count < 4 ? count : 4;
  for (int32_t k = 0; k < count; k++) scan->room[k] = sqrt(nearest(scan, scan->points[k], even, few).distance[few - 1]);
  double place = 0.99 * (count - 1), low = ranked(scan->room, count, (int32_t)place);
  double high = ranked(scan->room, count, (int32_t)place + 1 < count ? (int32_t)place + 1 : count - 1);
  scan->reach = low + (place - floor(place)) * (high - low) + 1e-9;
  for (int32_t k = 0; k < AXES; k++) scan->scale[k] = 1.0;
  if (gap > 0.0)
    for (int32_t k = 1; k < AXES; k++) scan->scale[k] = smaller(1.0, 0.5 * scan->reach / (0.5 * gap * (k == 1 ? 1.5 : 0.5)));
}

// Index of the nearest sample.
EXPORT int32_t scan_nearest(const Scan *scan, const Vector *wi, const Vector *wo) {
  double at[AXES];
  coordinates((Direction){wi->x, wi->y, wi->z}, (Direction){wo->x, wo->y, wo->z}, at);
  return scan->own[nearest(scan, at, even, 1).point[0]];
}

// f_r on the weighted plane through the nearest samples, kept within their range.
static void interpolated(const Scan *scan, const double *at, float *to) {
  Near near = nearest(scan, at, even, NEAREST);
  double scale = sqrt(near.distance[near.count - 1]) + 1e-12, a[AXES + 1][AXES + 4] = {{0.0}}, total = 0.0;
  double weights[NEAREST], low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {0.0};
  for (int32_t n = 0; n < near.count; n++) {
    double distance = sqrt(near.distance[n]) / scale, rest = larger(1.0 - distance, 1e-3);
    total += weights[n] = rest * rest / (distance * distance + 1e-6);
  }
  for (int32_t n = 0; n < near.count; n++) {
    const double *point = scan->points[near.point[n]], *logs = scan->logs[scan->own[near.point[n]]];
    double row[AXES + 4] = {1.0};
    for (int32_t k = 0; k < AXES; k++) row[k + 1] = (point[k] - at[k]) / scale;
    for (int32_t c = 0; c < 3; c++) {
      row[AXES + 1 + c] = logs[c];
      low[c] = smaller(low[c], logs[c]);
      high[c] = larger(high[c], logs[c]);
    }
    for (int32_t i = 0; i <= AXES; i++)
      for (int32_t j = 0; j < AXES + 4; j++) a[i][j] += weights[n] / total * row[i] * row[j];
  }
  for (int32_t k = 1; k <= AXES; k++) a[k][k] += 1e-3;
  // Eliminated from the last on, so that the first is left.
  for (int32_t i = AXES; i > 0; i--)
    for (int32_t r = 0; r < i; r++) {
      double factor = a[r][i] / a[i][i];
      for (int32_t j = 0; j < AXES + 4; j++) a[r][j] -= factor * a[i][j];
    }
  for (int32_t c = 0; c < 3; c++) {
    double level = smaller(larger(a[0][AXES + 1 + c] / a[0][0], low[c]), high[c]);
    to[c] = (float)(1e-4 * (exp(level) - 1.0));
  }
}

// f_r, and as fourth number whether it is known, at pairs of directions.
EXPORT void scan_evaluate(const Scan *scan, const Vector *wi, const Vector *wo, Vector *rgb, int32_t count) {
  for (int32_t k = 0; k < count; k++) {
    double at[AXES];
    coordinates((Direction){wi[k].x, wi[k].y, wi[k].z}, (Direction){wo[k].x, wo[k].y, wo[k].z}, at);
    interpolated(scan, at, &rgb[k].x);
    rgb[k].w = sqrt(nearest(scan, at, scan->scale, 1).distance[0]) <= scan->reach;
  }
}

// A direction near another one, by so much along each axis.
static Direction moved(Random *random, Direction w, double deviation) {
  float by[3];
  random_normals(random, deviation, by, 3);
  return normalized((Direction){w.x + by[0], w.y + by[1], w.z + by[2]});
}

// Pairs of directions over the whole hemisphere: a fifth near those of samples, three tenths near mirror
// directions, a fifth uniform in polar angles, the rest in Rusinkiewicz angles. Returns how many are kept.
EXPORT int32_t scan_draw(Random *random, const Vector *own_wi, const Vector *own_wo, int32_t samples, Vector *wi,
                         Vector *wo, int32_t count) {
  int32_t kept = 0;
  for (int32_t k = 0; k < count; k++) {
    double u[6];
    random_doubles(random, u, 6);
    Direction light = around(cos(0.5 * PI * u[1]), u[2]), view;
    if (u[0] < 0.2) {
      int32_t at = (int32_t)(u[1] * samples);
      light = moved(random, (Direction){own_wi[at].x, own_wi[at].y, own_wi[at].z}, 0.05);
      view = moved(random, (Direction){own_wo[at].x, own_wo[at].y, own_wo[at].z}, 0.05);
    } else if (u[0] < 0.5) view = moved(random, (Direction){-light.x, -light.y, light.z}, 0.001 * pow(300.0, u[3]));
    else if (u[0] < 0.7) view = around(cos(0.5 * PI * u[3]), u[4]);
    else {
      double c = cos(0.5 * PI * u[1]), s = sin(0.5 * PI * u[1]);
      Direction d = around(cos(0.5 * PI * u[3]), u[4]);
      light = in_frame((Direction){c * d.x + s * d.z, d.y, c * d.z - s * d.x}, cos(2.0 * PI * u[2]), -sin(2.0 * PI * u[2]));
      view = in_frame((Direction){s * d.z - c * d.x, -d.y, c * d.z + s * d.x}, cos(2.0 * PI * u[2]), -sin(2.0 * PI * u[2]));
    }
    if (light.z <= 0.0 || view.z <= 0.0) continue;
    wi[kept] = (Vector){light.x, light.y, light.z, 0.0f};
    wo[kept++] = (Vector){view.x, view.y, view.z, 0.0f};
  }
  return kept;
}
