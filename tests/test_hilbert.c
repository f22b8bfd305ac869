/* test_hilbert.c - hilbert.h compared with the definitions of the curves, and its batch functions
 * with those for single points. */
#define HILBERT_IMPLEMENTATION
#include "../hilbert.h"
#include "check.h"
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static uint64_t random_state = 1;
static uint64_t random_u64(void)
{
    uint64_t x = random_state += UINT64_C(0x9e3779b97f4a7c15);
    x = (x ^ x >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ x >> 27) * UINT64_C(0x94d049bb133111eb);
    return x ^ x >> 31;
}

static double random_unit(void) { return (double)(random_u64() >> 11) / 9007199254740992.0; }

/* ---- the curves as Table 2.3 defines them: base pattern, transformations in the order of the
 * curve; axis 1 is the lowest bit of an octant. The closings are those that close (Table 2.4 does
 * not). */
typedef struct definition {
    int base[8], turn[8][3], closing[2][8][3];
} definition;

#define CLOSING_CA                                                                                 \
    {{-2, -3, 1}, {-2, -3, 1}, {2, -3, -1}, {2, -3, -1}, {2, 3, 1}, {2, 3, 1}, {-2, 3, -1},        \
     {-2, 3, -1}}
#define CLOSING_HXT                                                                                \
    {{-1, 2, -3}, {3, 1, 2}, {3, 1, 2}, {-1, -2, 3}, {-1, -2, 3}, {-3, 1, -2}, {-3, 1, -2},        \
     {-1, 2, -3}}

static const definition definitions[5] = {
    {{0, 1, 3, 2, 7, 6, 4, 5},
     {{2, 3, 1},
      {3, 1, 2},
      {3, 1, 2},
      {-1, -2, 3},
      {-1, -2, 3},
      {-3, 1, -2},
      {-3, 1, -2},
      {2, -3, -1}},
     {CLOSING_CA, CLOSING_HXT}},
    {{0, 1, 3, 2, 7, 6, 4, 5},
     {{2, 3, 1},
      {3, 1, 2},
      {1, 2, 3},
      {-3, -1, 2},
      {3, -1, -2},
      {1, 2, 3},
      {-3, 1, -2},
      {2, -3, -1}},
     {CLOSING_CA, CLOSING_HXT}},
    {{0, 1, 3, 2, 7, 6, 4, 5},
     {{2, 3, 1},
      {3, 1, 2},
      {1, 2, 3},
      {-3, -1, 2},
      {-1, -2, 3},
      {-3, 1, -2},
      {-3, 1, -2},
      {2, -3, -1}},
     {CLOSING_CA, CLOSING_HXT}},
    {{0, 1, 3, 2, 7, 6, 4, 5},
     {{2, 3, 1}, {3, 1, 2}, {1, 2, 3}, {2, -3, -1}, {2, 3, 1}, {1, 2, 3}, {-3, 1, -2}, {2, -3, -1}},
     {CLOSING_CA, CLOSING_HXT}},
    {{0, 5, 1, 4, 7, 6, 2, 3},
     {{3, 1, 2}, {1, 2, 3}, {2, 3, 1}, {2, 3, 1}, {2, -3, -1}, {-3, 1, -2}, {1, 2, 3}, {2, -3, -1}},
     {{{1, -2, -3},
       {1, 2, 3},
       {2, 3, 1},
       {2, 3, 1},
       {2, -3, -1},
       {-3, 1, -2},
       {3, 1, 2},
       {-2, 3, -1}},
      {{1, -2, -3},
       {1, 2, 3},
       {2, 3, 1},
       {2, 3, 1},
       {-1, 2, -3},
       {-1, -2, 3},
       {-2, 3, -1},
       {-2, 3, -1}}}},
};

/* Key by the definition; which = -1: open, else the closing. */
static uint64_t defined_key(const definition *d, int which, int depth, uint32_t x, uint32_t y,
                            uint32_t z)
{
    int turn[3] = {1, 2, 3}, l, m;
    uint64_t key = 0;

    for (l = depth - 1; l >= 0; l--) {
        int bit[3], octant = 0, next[3];
        const int *t;
        bit[0] = (int)(z >> l & 1);
        bit[1] = (int)(y >> l & 1);
        bit[2] = (int)(x >> l & 1);
        for (m = 0; m < 3; m++) octant |= (bit[abs(turn[m]) - 1] ^ (turn[m] < 0)) << m;
        key = key << 3 | (uint64_t)d->base[octant];
        t = which >= 0 && l == depth - 1 ? d->closing[which][d->base[octant]]
                                         : d->turn[d->base[octant]];
        for (m = 0; m < 3; m++) next[m] = t[m] < 0 ? -turn[-t[m] - 1] : turn[t[m] - 1];
        memcpy(turn, next, sizeof turn);
    }
    return key;
}

static uint64_t table_key(const unsigned char table[14][8], unsigned state, int depth, uint32_t x,
                          uint32_t y, uint32_t z)
{
    uint64_t key = 0;
    int l;

    for (l = depth - 1; l >= 0; l--) {
        unsigned entry = table[state][(x >> l & 1) << 2 | (y >> l & 1) << 1 | (z >> l & 1)];
        key = key << 3 | (entry & 7);
        state = entry >> 3;
    }
    return key;
}

static int steps_apart(uint32_t a, uint32_t b) { return a > b ? (int)(a - b) : (int)(b - a); }

/* On a full grid: every key once (cells[] filled), neighbours adjacent, ends too if closed. */
static int is_a_path(const uint32_t *cells, size_t count, int dimension, int closed)
{
    size_t i;
    int m, jumps = 0;

    for (i = 0; i < (closed ? count : count - 1); i++) {
        const uint32_t *a = cells + 3 * i, *b = cells + 3 * ((i + 1) % count);
        int apart = 0;
        for (m = 0; m < dimension; m++) apart += steps_apart(a[m], b[m]);
        jumps += apart != 1;
    }
    return jumps == 0;
}

static void tables_follow_the_definitions(void)
{
    enum { MOST = 16 * 16 * 16 };
    static uint32_t cells[3 * MOST];
    int c, which, depth;

    for (c = 0; c < 5; c++)
        for (which = -1; which < 2; which++)
            for (depth = 1; depth <= 4; depth++) {
                uint32_t n = (uint32_t)1 << depth, x, y, z;
                size_t count = (size_t)n * n * n, i;
                int same = 1, once = 1;
                memset(cells, 255, sizeof cells);
                for (x = 0; x < n; x++)
                    for (y = 0; y < n; y++)
                        for (z = 0; z < n; z++) {
                            uint64_t key = defined_key(&definitions[c], which, depth, x, y, z);
                            same &= key == table_key(hilbert__encode_tables3[c],
                                                     which < 0 ? 0 : 12 + (unsigned)which, depth, x,
                                                     y, z);
                            once &= key < count && cells[3 * key] == UINT32_MAX;
                            if (!once) continue;
                            cells[3 * key] = x;
                            cells[3 * key + 1] = y;
                            cells[3 * key + 2] = z;
                        }
                CHECK(same);
                CHECK(once);
                CHECK(is_a_path(cells, count, 3, which >= 0 && depth > 1));
                for (i = 0; i < 14 * 8; i++) { /* decoding undoes encoding */
                    unsigned entry = hilbert__encode_tables3[c][i / 8][i % 8];
                    unsigned back = hilbert__decode_tables3[c][i / 8][entry & 7];
                    CHECK((back & 7) == i % 8 && back >> 3 == entry >> 3);
                }
            }
}

static void curves_in_2d(void)
{
    enum { MOST = 64 * 64 };
    static uint32_t cells[3 * MOST];
    int start, depth;

    for (start = 0; start < 10; start++) {
        if (start > 0 && start < 8) continue;
        for (depth = 1; depth <= 6; depth++) {
            uint32_t n = (uint32_t)1 << depth, x, y;
            size_t count = (size_t)n * n;
            int once = 1, l;
            memset(cells, 255, sizeof cells);
            for (x = 0; x < n; x++)
                for (y = 0; y < n; y++) {
                    unsigned state = (unsigned)start;
                    size_t key = 0;
                    for (l = depth - 1; l >= 0; l--) {
                        unsigned q = (x >> l & 1) << 1 | (y >> l & 1);
                        unsigned entry = hilbert__encode_table2[state][q];
                        unsigned back = hilbert__decode_table2[state][entry & 3];
                        once &= (back & 3) == q && back >> 2 == entry >> 2;
                        key = key << 2 | (entry & 3);
                        state = entry >> 2;
                    }
                    once &= cells[3 * key] == UINT32_MAX;
                    cells[3 * key] = x;
                    cells[3 * key + 1] = y;
                }
            CHECK(once);
            CHECK(is_a_path(cells, count, 2, start >= 8));
        }
    }
}

/* The sum over all keys of a 3D grid, z fastest: s = s*M + key + 1. */
static uint64_t checksum3(hilbert_curve curve, int depth)
{
    uint64_t s = 0;
    uint32_t n = (uint32_t)1 << depth, x, y, z;

    for (x = 0; x < n; x++)
        for (y = 0; y < n; y++)
            for (z = 0; z < n; z++)
                s = s * UINT64_C(6364136223846793005) + hilbert_encode3(curve, depth, x, y, z) + 1;
    return s;
}

static uint64_t checksum2(hilbert_curve curve, int depth)
{
    uint64_t s = 0;
    uint32_t n = (uint32_t)1 << depth, i, j;

    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            s = s * UINT64_C(6364136223846793005) + hilbert_encode2(curve, depth, i, j) + 1;
    return s;
}

/* Keys are data that people store: they must never change. */
static void keys_stay_what_they_were(void)
{
#if HILBERT_TABLE == HILBERT_TABLE_BUTZ && HILBERT_CLOSING == 0
    CHECK(checksum3(HILBERT_CURVE_HILBERT, 3) == UINT64_C(0x6b649a8fec55cb00));
    CHECK(checksum3(HILBERT_CURVE_HILBERT, 4) == UINT64_C(0x55f9cc15ce815800));
    CHECK(checksum3(HILBERT_CURVE_MOORE, 3) == UINT64_C(0xce9ae43b16536b00));
    CHECK(checksum3(HILBERT_CURVE_MOORE, 4) == UINT64_C(0x2659befae88b5800));
    CHECK(checksum2(HILBERT_CURVE_MOORE, 3) == UINT64_C(0x7c2f0e34dead6960));
    CHECK(checksum2(HILBERT_CURVE_MOORE, 6) == UINT64_C(0x9e721c3d3bf35800));
#endif
    CHECK(checksum2(HILBERT_CURVE_HILBERT, 3) == UINT64_C(0x958feae6d92ca660));
    CHECK(checksum2(HILBERT_CURVE_HILBERT, 6) == UINT64_C(0xc9f5336d27ee9800));
}

static void decoding_undoes_encoding(void)
{
    int i, c, depth;

    for (i = 0; i < 2000; i++)
        for (c = 0; c < 3; c++) {
            hilbert_curve curve = (hilbert_curve)c;
            uint64_t r = random_u64(), q = random_u64(), key, wide[3];
            uint32_t cell[3], x, y, z;
            hilbert_key128 deep;

            depth = 1 + (int)(r % 21);
            key = random_u64() & (((uint64_t)1 << 3 * depth) - 1);
            hilbert_decode3(curve, depth, key, cell);
            CHECK(hilbert_encode3(curve, depth, cell[0], cell[1], cell[2]) == key);
            deep = hilbert_encode3_deep(curve, depth, cell[0], cell[1], cell[2]);
            CHECK(deep.hi == 0 && deep.lo == key);
            if (depth > 1) /* the key of the cell around, one level up */
                CHECK(hilbert_encode3(curve, depth - 1, cell[0] >> 1, cell[1] >> 1, cell[2] >> 1) ==
                      key >> 3);

            depth = 1 + (int)(r % 32);
            x = (uint32_t)(q & (((uint64_t)1 << depth) - 1));
            y = (uint32_t)(q >> 32 & (((uint64_t)1 << depth) - 1));
            hilbert_decode2(curve, depth, hilbert_encode2(curve, depth, x, y), cell);
            CHECK(cell[0] == x && cell[1] == y);

            depth = 1 + (int)(r % 42);
            wide[0] = q & (((uint64_t)1 << depth) - 1);
            wide[1] = r & (((uint64_t)1 << depth) - 1);
            wide[2] = random_u64() & (((uint64_t)1 << depth) - 1);
            deep = hilbert_encode3_deep(curve, depth, wide[0], wide[1], wide[2]);
            {
                uint64_t back[3];
                hilbert_decode3_deep(curve, depth, deep, back);
                CHECK(memcmp(back, wide, sizeof back) == 0);
                if (curve != HILBERT_CURVE_Z && ++deep.lo != 0 && depth > 21) {
                    hilbert_decode3_deep(curve, depth, deep, back); /* the next cell touches */
                    CHECK((back[0] ^ wide[0]) + (back[1] ^ wide[1]) + (back[2] ^ wide[2]) != 0);
                    CHECK(llabs((long long)(back[0] - wide[0])) +
                              llabs((long long)(back[1] - wide[1])) +
                              llabs((long long)(back[2] - wide[2])) ==
                          1);
                }
            }
            z = 0;
            if (c == 2) { /* Z-order: bits in turn */
                uint64_t expected = 0;
                int l;
                for (l = 20; l >= 0; l--)
                    expected = expected << 3 | (uint64_t)((x >> l & 1) << 2 | (y >> l & 1) << 1 |
                                                          (z >> l & 1));
                CHECK(hilbert_encode3(curve, 21, x, y, z) == expected);
            }
        }
}

/* ---- from coordinates to cells */
static uint64_t cell_by_floor(double v, double lo, double hi, double middle, int depth)
{
    double half = ldexp(1, depth - 1), centre = lo * (1 - middle) + hi * middle;
    double factor = v < centre ? half / (centre - lo) : half / (hi - centre);
    double cell = floor((v - centre) * factor) + half;

    if (cell < 0) cell = 0;
    if (cell > 2 * half - 1) cell = 2 * half - 1;
    return (uint64_t)cell;
}

/* x cell of one point, through the public functions. */
static uint32_t cell_of(double v, double lo, double hi, double middle, int depth)
{
    double xyz[3] = {0, 0, 0};
    hilbert_box box;
    uint64_t key;
    uint32_t cell[3];

    xyz[0] = v;
    memset(&box, 0, sizeof box);
    box.lo[0] = lo;
    box.hi[0] = hi;
    box.middle[0] = middle;
    box.depth = depth;
    if (hilbert_keys3(&key, xyz, 0, 1, &box, 1) != HILBERT_OK) return UINT32_MAX;
    hilbert_decode3(HILBERT_CURVE_MOORE, depth, key, cell);
    return cell[0];
}

static void cells_of_coordinates(void)
{
    static const double boxes[][2] = {{0, 1},       {-1, 1},          {1e-300, 3e-300},
                                      {-5e307, 6e307}, {1, 1 + 1e-15}, {-1e308, 1e308},
                                      {0, 5e-324},  {1e6, 1e6 + 1}};
    static const double middles[] = {0, 0.5, 0.3, 0.7, 1e-3};
    size_t b, m, i;
    int depth = 21;

    for (b = 0; b < sizeof boxes / sizeof *boxes; b++)
        for (m = 0; m < 5; m++) {
            double lo = boxes[b][0], hi = boxes[b][1], mid = middles[m] == 0 ? 0.5 : middles[m];
            volatile double from_lo = lo * (1 - mid), from_hi = hi * mid; /* not to be fused */
            double centre = from_lo + from_hi, v = lo;
            uint32_t last = 0, n = (uint32_t)1 << depth;
            int monotone = 1;
            CHECK(cell_of(lo, lo, hi, middles[m], depth) <= n / 2);
            CHECK(cell_of(hi, lo, hi, middles[m], depth) < n);
            CHECK(cell_of(centre, lo, hi, middles[m], depth) == n / 2);
            if (centre - lo > 1e-9 * fabs(centre) && lo < centre)
                CHECK(cell_of(nextafter(centre, lo), lo, hi, middles[m], depth) == n / 2 - 1);
            for (i = 0; i <= 200; i++) {
                double f = (double)i / 200;
                uint32_t c;
                if (lo * (1 - f) + hi * f > v) v = lo * (1 - f) + hi * f;
                c = cell_of(v, lo, hi, middles[m], depth);
                monotone &= c >= last;
                last = c;
            }
            CHECK(monotone);
        }
    CHECK(cell_of(0, 0, 1, 0, 21) == 0 && cell_of(1, 0, 1, 0, 21) == 2097151);
    CHECK(cell_of(nextafter(1, 2), 0, 1, 0, 21) == 2097151 && cell_of(-1e300, 0, 1, 0, 21) == 0);
    CHECK(cell_of(1e308, 0, 1e-300, 0, 21) == 2097151);
    CHECK(cell_of(3, 0, 8, 0, 3) == 3 && cell_of(4, 0, 8, 0, 3) == 4);
    CHECK(cell_of(7, 7, 7, 0, 5) == 16); /* an axis without length */
    CHECK(cell_of(0.5, 1, 0, 0, 5) == UINT32_MAX); /* lo > hi */
    for (i = 0; i < 1000; i++) {
        double v = 3 * random_unit() - 1;
        CHECK(cell_of(v, 0, 1, 0.375, 10) == cell_by_floor(v, 0, 1, 0.375, 10));
    }
}

/* ---- many points */
enum { MANY = 5000 };
static double xyz[MANY][4];
static float  xyz_f[MANY][3];
static uint64_t keys[MANY], again[MANY];

static void make_points(int strange)
{
    size_t i;
    int m;

    for (i = 0; i < MANY; i++)
        for (m = 0; m < 4; m++) {
            xyz[i][m] = 12 * random_unit() - 6;
            if (strange && random_u64() % 50 == 0) {
                static const double values[] = {HUGE_VAL, -HUGE_VAL, 0.0, -0.0, 1e300, -1e300};
                size_t v = (size_t)(random_u64() % 7);
                xyz[i][m] = v == 6 ? NAN : values[v];
            }
            if (m < 3) xyz_f[i][m] = (float)xyz[i][m];
        }
}

static uint64_t single_key(const hilbert_box *box, const double *v, int dimension)
{
    int depth = box->depth ? box->depth : dimension == 3 ? 21 : 32, m;
    uint64_t c[3] = {0, 0, 0}, mask = depth * dimension == 64
                                          ? UINT64_MAX
                                          : ((uint64_t)1 << depth * dimension) - 1;

    for (m = 0; m < dimension; m++) {
        double mid = box->middle[m] == 0 ? 0.5 : box->middle[m];
        if (!(v[m] - v[m] == 0)) return UINT64_MAX;
        c[m] = cell_by_floor(v[m], box->lo[m], box->hi[m], mid, depth);
    }
    if (dimension == 3)
        return (hilbert_encode3(box->curve, depth, (uint32_t)c[0], (uint32_t)c[1],
                                (uint32_t)c[2]) + box->shift) & mask;
    return (hilbert_encode2(box->curve, depth, (uint32_t)c[0], (uint32_t)c[1]) + box->shift) & mask;
}

/* Every path, thread count and layout gives the keys that one point at a time has. */
static void batches_agree_with_single_points(void)
{
    static const int depths[] = {0, 1, 5, 8, 13, 20};
    int round, plain;

    for (round = 0; round < 150; round++) {
        hilbert_points points;
        hilbert_options options;
        hilbert_box box;
        size_t i, bad = 0, found;
        int good = 1, m;

        make_points(round % 3 == 0);
        memset(&points, 0, sizeof points);
        memset(&options, 0, sizeof options);
        memset(&box, 0, sizeof box);
        points.count = round < 130 ? (size_t)round : MANY - (size_t)round;
        points.dimension = round % 4 == 3 ? 2 : 0;
        if (round % 5 == 4) {
            points.coordinates = xyz_f;
            points.stride = sizeof xyz_f[0];
            points.scalar = HILBERT_FLOAT;
        } else {
            points.coordinates = xyz;
            points.stride = round % 2 ? sizeof xyz[0] : 0;
        }
        box.curve = (hilbert_curve)(round % 3);
        box.depth = depths[round % 6];
        box.shift = round % 2 ? random_u64() : 0;
        for (m = 0; m < 3; m++) {
            box.lo[m] = round % 8 < 4 ? -5 - m : -6.5; /* around most, or all that are finite */
            box.hi[m] = round % 8 < 4 ? 5 + 2 * m : 6.5 + m;
            box.middle[m] = round % 7 ? 0 : 0.3 + 0.1 * m;
        }
        for (plain = 0; plain < 3; plain++) {
            options.plain = plain;
            options.num_threads = 1 + round % 8;
            CHECK(hilbert_keys(plain ? again : keys, &points, &box, &found, &options) ==
                  HILBERT_OK);
            if (plain) CHECK(memcmp(keys, again, points.count * sizeof *keys) == 0);
        }
        for (i = 0; i < points.count; i++) {
            double v[3];
            size_t stride = points.stride ? points.stride : points.dimension == 2 ? 16 : 24;
            for (m = 0; m < (points.dimension == 2 ? 2 : 3); m++)
                v[m] = points.scalar == HILBERT_FLOAT
                           ? (double)xyz_f[i][m]
                           : ((double *)(void *)((char *)xyz + i * stride))[m];
            good &= keys[i] == single_key(&box, v, points.dimension == 2 ? 2 : 3);
            bad += !(v[0] - v[0] == 0) || !(v[1] - v[1] == 0) ||
                   (points.dimension != 2 && !(v[2] - v[2] == 0));
        }
        CHECK(good);
        CHECK(bad == found);
    }
}

static void threads_do_not_show(void)
{
    enum { N = 150000 };
    double *many = (double *)malloc(N * 3 * sizeof *many);
    uint64_t *first = (uint64_t *)malloc(N * 8), *other = (uint64_t *)malloc(N * 8);
    hilbert_box box, box_1;
    size_t i;
    int threads;

    for (i = 0; i < 3 * N; i++) many[i] = random_unit() * (double)(1 + i % 3);
    CHECK(hilbert_box_fit3(&box_1, many, 0, N, 1) == HILBERT_OK);
    CHECK(hilbert_keys3(first, many, 0, N, &box_1, 1) == HILBERT_OK);
    for (threads = 2; threads <= 8; threads++) {
        CHECK(hilbert_box_fit3(&box, many, 0, N, threads) == HILBERT_OK);
        CHECK(memcmp(&box, &box_1, sizeof box) == 0);
        CHECK(hilbert_keys3(other, many, 0, N, &box, threads) == HILBERT_OK);
        CHECK(memcmp(first, other, N * 8) == 0);
    }
    free(many);
    free(first);
    free(other);
}

static void integer_points(void)
{
    static uint32_t cells[MANY][3];
    hilbert_points points;
    hilbert_box box;
    size_t i;
    int good = 1;

    memset(&points, 0, sizeof points);
    memset(&box, 0, sizeof box);
    points.coordinates = cells;
    points.count = MANY;
    points.scalar = HILBERT_UINT32;
    box.depth = 9;
    for (i = 0; i < MANY; i++) {
        cells[i][0] = (uint32_t)random_u64();
        cells[i][1] = (uint32_t)random_u64() & 511;
        cells[i][2] = (uint32_t)random_u64() & 511;
    }
    CHECK(hilbert_keys(keys, &points, &box, NULL, NULL) == HILBERT_OK);
    for (i = 0; i < MANY; i++)
        good &= keys[i] == hilbert_encode3(HILBERT_CURVE_MOORE, 9, cells[i][0] & 511, cells[i][1],
                                           cells[i][2]);
    CHECK(good);
}

static void boxes_fit(void)
{
    int round;

    for (round = 0; round < 60; round++) {
        double lo[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, hi[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
        hilbert_points points;
        hilbert_options options;
        hilbert_box box;
        size_t bad = 0, found, i;
        int m;
        hilbert_result result;

        make_points(round % 2);
        memset(&points, 0, sizeof points);
        memset(&options, 0, sizeof options);
        points.coordinates = xyz;
        points.stride = round % 3 ? 0 : sizeof xyz[0];
        points.count = round < 50 ? (size_t)round : (size_t)MANY;
        options.plain = round & 4;
        for (i = 0; i < points.count; i++) {
            const double *v = (double *)xyz + i * (points.stride ? 4 : 3);
            if (!(v[0] - v[0] == 0) || !(v[1] - v[1] == 0) || !(v[2] - v[2] == 0)) {
                bad++;
                continue;
            }
            for (m = 0; m < 3; m++) {
                if (v[m] < lo[m]) lo[m] = v[m];
                if (v[m] > hi[m]) hi[m] = v[m];
            }
        }
        result = hilbert_box_fit(&box, &points, &found, &options);
        CHECK(result == HILBERT_OK ? bad < points.count : bad == points.count);
        CHECK(result == HILBERT_OK || result == HILBERT_ERROR_NO_FINITE_POINT);
        CHECK(found == bad);
        if (result == HILBERT_OK)
            for (m = 0; m < 3; m++) CHECK(box.lo[m] == lo[m] && box.hi[m] == hi[m]);
        hilbert_box_cube(&box);
        for (m = 0; m < 3; m++)
            CHECK(result != HILBERT_OK ||
                  fabs((box.hi[m] - box.lo[m]) / (box.hi[0] - box.lo[0]) - 1) < 1e-12 ||
                  points.count - bad < 2);
    }
}

/* ---- orders */
static void points_are_sorted(void)
{
    static double sorted[MANY][4];
    static size_t order[MANY], order_2[MANY];
    static char seen[MANY];
    int round;

    for (round = 0; round < 12; round++) {
        hilbert_points points;
        size_t i;
        int good = 1;

        make_points(round % 2);
        for (i = 0; round % 3 == 2 && i < MANY; i++) /* many points in one cell */
            xyz[i][0] = xyz[i][1] = xyz[i][2] = (double)(i % 3);
        for (i = 0; round == 4 && i < MANY; i++) xyz[i][0] = i % 16 ? 1 + 1e-9 * xyz[i][0] : 1e6;
        memset(&points, 0, sizeof points);
        points.count = round < 3 ? (size_t)round : (size_t)MANY;
        points.stride = sizeof sorted[0];
        points.coordinates = xyz;
        memset(seen, 0, sizeof seen);
        CHECK(hilbert_argsort(order, &points, NULL, again, NULL) == HILBERT_OK);
        CHECK(hilbert_keys(keys, &points, NULL, NULL, NULL) == HILBERT_OK);
        for (i = 0; i < points.count; i++) {
            seen[order[i]]++;
            good &= keys[order[i]] == again[i];
            if (i > 0) good &= again[i - 1] < again[i] ||
                               (again[i - 1] == again[i] && order[i - 1] < order[i]);
        }
        for (i = 0; i < points.count; i++) good &= seen[i] == 1;
        CHECK(good);
        memcpy(sorted, xyz, sizeof xyz);
        points.coordinates = sorted;
        CHECK(hilbert_sort_points(sorted, &points, NULL, round & 1 ? NULL : order_2, NULL) ==
              HILBERT_OK);
        for (i = 0; i < points.count; i++)
            good &= memcmp(sorted[i], xyz[order[i]], sizeof sorted[0]) == 0;
        if (!(round & 1)) good &= memcmp(order, order_2, points.count * sizeof *order) == 0;
        CHECK(good);
    }
}

/* In 2D at full depth the last cell of the curve has the key of points without a cell. */
static void points_that_are_not_finite_come_last(void)
{
    static const double xy[6][2] = {{NAN, 0}, {1, 1}, {0, 0}, {1, 0}, {HUGE_VAL, 1}, {0.5, 0.5}};
    int curve;
    for (curve = 0; curve < 3; curve++) {
        hilbert_points points;
        hilbert_box box;
        size_t order[6];
        uint64_t sorted[6];
        memset(&points, 0, sizeof points);
        points.coordinates = xy;
        points.count = 6;
        points.dimension = 2;
        CHECK(hilbert_box_fit(&box, &points, NULL, NULL) == HILBERT_OK);
        box.curve = (hilbert_curve)curve;
        CHECK(hilbert_argsort(order, &points, &box, sorted, NULL) == HILBERT_OK);
        CHECK(order[4] == 0 && order[5] == 4 && sorted[4] == UINT64_MAX);
        if (curve == HILBERT_CURVE_Z) CHECK(order[3] == 1 && sorted[3] == UINT64_MAX);
    }
}

static void partitions_hold_equal_counts(void)
{
    static const size_t counts[] = {1, 2, 7, 100, MANY};
    size_t c, num_parts, i, p;

    for (c = 0; c < 5; c++)
        for (num_parts = 1; num_parts <= 9; num_parts += c % 2 + 1) {
            hilbert_partition parts[9];
            size_t count = counts[c], held[9] = {0};
            int good = 1;

            for (i = 0; i < count; i++)
                keys[i] = c == 3 ? (uint64_t)(i / 40)
                                 : (uint64_t)i * 1000003 + (random_u64() & 1023);
            hilbert_partition_keys(parts, num_parts, keys, count);
            for (i = 0; i < count; i++) {
                size_t in = 0;
                for (p = 0; p < num_parts; p++)
                    if (hilbert_partition_has(parts[p], keys[i])) {
                        in++;
                        held[p]++;
                    }
                good &= in == 1;
            }
            for (i = 0; i < 1000; i++) { /* keys of no point are in one part as well */
                uint64_t key = random_u64() >> (i % 60 + 1);
                size_t in = 0;
                for (p = 0; p < num_parts; p++) in += (size_t)hilbert_partition_has(parts[p], key);
                good &= in == 1;
            }
            CHECK(good);
            for (p = 0; c != 3 && count >= num_parts && p < num_parts; p++)
                CHECK(held[p] == count / num_parts || held[p] == count / num_parts + 1);
        }
}

/* ---- the k-d pseudo-grid */
static void kd_cells_hold_equal_counts(void)
{
    enum { LEVELS = 2 };
    hilbert_points points;
    hilbert_kd kd, kd_2;
    size_t i, held[64] = {0}, bad;
    int cell, good = 1;

    make_points(0);
    memset(&points, 0, sizeof points);
    points.coordinates = xyz;
    points.stride = sizeof xyz[0];
    points.count = 4096;
    CHECK(hilbert_kd_build(&kd, &points, LEVELS, NULL) == HILBERT_OK);
    CHECK(hilbert_kd_keys(keys, &points, &kd, HILBERT_CURVE_MOORE, &bad, NULL) == HILBERT_OK);
    CHECK(bad == 0);
    for (i = 0; i < points.count; i++) held[keys[i] & 63]++;
    for (cell = 0; cell < 64; cell++) CHECK(held[cell] == 64);
    CHECK(hilbert_kd_keys(again, &points, &kd, HILBERT_CURVE_Z, NULL, NULL) == HILBERT_OK);
    for (i = 0; i < points.count; i++) { /* the two keys are one cell in two orders */
        uint32_t c[3];
        hilbert_decode3(HILBERT_CURVE_Z, LEVELS, again[i], c);
        good &= hilbert_encode3(HILBERT_CURVE_MOORE, LEVELS, c[0], c[1], c[2]) == keys[i];
        good &= (c[0] >> 1) == (xyz[i][0] >= kd.splits[0]);
    }
    CHECK(good);
    for (i = 0; i < points.count / 2; i++) { /* another order, the same tree */
        double t[4];
        memcpy(t, xyz[i], sizeof t);
        memcpy(xyz[i], xyz[points.count - 1 - i], sizeof t);
        memcpy(xyz[points.count - 1 - i], t, sizeof t);
    }
    CHECK(hilbert_kd_build(&kd_2, &points, LEVELS, NULL) == HILBERT_OK);
    CHECK(memcmp(kd.splits, kd_2.splits, 63 * sizeof(double)) == 0);
    hilbert_kd_free(&kd, NULL);
    hilbert_kd_free(&kd, NULL);
    hilbert_kd_free(&kd_2, NULL);

    make_points(1);
    for (i = 0; i < MANY; i++) /* duplicates, and two dimensions */
        if (i % 3) xyz[i][0] = floor(xyz[i][0]);
    points.dimension = 2;
    CHECK(hilbert_kd_build(&kd, &points, 5, NULL) == HILBERT_OK);
    CHECK(hilbert_kd_keys(keys, &points, &kd, HILBERT_CURVE_HILBERT, &bad, NULL) == HILBERT_OK);
    for (i = 0; i < points.count; i++) {
        int finite = xyz[i][0] - xyz[i][0] == 0 && xyz[i][1] - xyz[i][1] == 0;
        good &= finite ? keys[i] < 1024 : keys[i] == UINT64_MAX;
        bad -= !finite;
    }
    CHECK(good && bad == 0);
    hilbert_kd_free(&kd, NULL);
}

static void deep_keys_refine_the_others(void)
{
    static hilbert_key128 deep[MANY];
    hilbert_points points;
    hilbert_options options;
    hilbert_box box;
    size_t i, bad, bad_deep;
    int good = 1;

    make_points(1);
    memset(&points, 0, sizeof points);
    memset(&options, 0, sizeof options);
    memset(&box, 0, sizeof box);
    points.coordinates = xyz;
    points.count = MANY;
    for (i = 0; i < 3; i++) {
        box.lo[i] = -8;
        box.hi[i] = 8;
    }
    CHECK(hilbert_keys_deep(deep, &points, &box, &bad_deep, NULL) == HILBERT_OK);
    CHECK(hilbert_keys(keys, &points, &box, &bad, NULL) == HILBERT_OK);
    for (i = 0; i < MANY; i++) /* 126 bits; the upper 63 are the key at depth 21 */
        good &= keys[i] == UINT64_MAX ? deep[i].hi == UINT64_MAX && deep[i].lo == UINT64_MAX
                                      : (deep[i].hi << 1 | deep[i].lo >> 63) == keys[i];
    CHECK(good && bad == bad_deep && bad > 0);
    box.depth = 21;
    box.shift = 12345;
    CHECK(hilbert_keys_deep(deep, &points, &box, NULL, NULL) == HILBERT_OK);
    CHECK(hilbert_keys(keys, &points, &box, NULL, NULL) == HILBERT_OK);
    for (i = 0; i < MANY; i++) good &= deep[i].lo == keys[i];
    CHECK(good);
    box.depth = 43;
    CHECK(hilbert_keys_deep(deep, &points, &box, NULL, NULL) == HILBERT_ERROR_INVALID_ARGUMENT);
}

/* ---- what goes wrong */
typedef struct failing {
    long calls, fail_at, alive;
} failing;

static void *failing_alloc(void *user, size_t size)
{
    failing *f = (failing *)user;
    if (f->calls++ == f->fail_at) return NULL;
    f->alive++;
    return malloc(size);
}

static void failing_release(void *user, void *memory)
{
    failing *f = (failing *)user;
    if (memory) f->alive--;
    free(memory);
}

static void allocation_failures(void)
{
    static double sorted[MANY][4];
    static size_t order[MANY];
    hilbert_points points;
    hilbert_options options;
    failing f;
    int what;

    make_points(0);
    memset(&points, 0, sizeof points);
    memset(&options, 0, sizeof options);
    options.allocator.alloc = failing_alloc;
    options.allocator.release = failing_release;
    options.allocator.user = &f;
    points.coordinates = sorted;
    points.stride = sizeof sorted[0];
    points.count = MANY;
    for (what = 0; what < 3; what++) {
        memset(&f, 0, sizeof f);
        for (;; f.fail_at++) {
            hilbert_kd kd;
            hilbert_result result;

            memset(&kd, 0, sizeof kd);
            memcpy(sorted, xyz, sizeof xyz);
            f.calls = 0;
            result = what == 0   ? hilbert_argsort(order, &points, NULL, NULL, &options)
                     : what == 1 ? hilbert_sort_points(sorted, &points, NULL, NULL, &options)
                                 : hilbert_kd_build(&kd, &points, 3, &options);
            if (result == HILBERT_OK) {
                hilbert_kd_free(&kd, &options);
                CHECK(f.alive == 0);
                break;
            }
            CHECK(result == HILBERT_ERROR_OUT_OF_MEMORY && f.alive == 0 && kd.splits == NULL);
            CHECK(memcmp(sorted, xyz, sizeof xyz) == 0);
        }
        CHECK(f.fail_at >= 2);
    }
}

/* Records need not be aligned. */
static void points_at_odd_addresses(void)
{
    enum { N = 67 };
    static unsigned char records[N * 29 + 1];
    static uint64_t even[N], odd[N];
    double x[N][3];
    size_t stride, i;
    for (i = 0; i < 3 * N; i++) x[i / 3][i % 3] = random_unit();
    for (stride = 24; stride <= 29; stride += 5) {
        hilbert_points points;
        hilbert_box box, odd_box;
        memset(&points, 0, sizeof points);
        points.coordinates = x;
        points.count = N;
        CHECK(hilbert_keys(even, &points, NULL, NULL, NULL) == HILBERT_OK);
        CHECK(hilbert_box_fit(&box, &points, NULL, NULL) == HILBERT_OK);
        for (i = 0; i < N; i++) memcpy(records + 1 + i * stride, x[i], sizeof x[i]);
        points.coordinates = records + 1;
        points.stride = stride;
        CHECK(hilbert_keys(odd, &points, NULL, NULL, NULL) == HILBERT_OK);
        CHECK(hilbert_box_fit(&odd_box, &points, NULL, NULL) == HILBERT_OK);
        CHECK(memcmp(even, odd, sizeof even) == 0);
        CHECK(memcmp(box.lo, odd_box.lo, sizeof box.lo) == 0);
        CHECK(memcmp(box.hi, odd_box.hi, sizeof box.hi) == 0);
    }
}

/* Where the products that make the centre of this box are fused with their sum, its last bit, and
 * with it the key of a point there, are others. */
static void keys_do_not_depend_on_fused_operations(void)
{
    const double at[3] = {2.32, 2.32, 2.32};
    hilbert_points points;
    hilbert_box box;
    uint64_t key = 0;
    int i;
    memset(&points, 0, sizeof points);
    memset(&box, 0, sizeof box);
    points.coordinates = at;
    points.count = 1;
    for (i = 0; i < 3; i++) box.lo[i] = 1.9, box.hi[i] = 2.5, box.middle[i] = 0.7;
    box.curve = HILBERT_CURVE_Z;
    CHECK(hilbert_keys(&key, &points, &box, NULL, NULL) == HILBERT_OK);
    CHECK(key == UINT64_C(1152921504606846975));
}

/* 0 and -0 are equal: a tree of them has the same bytes in any order. */
static void kd_splits_have_no_sign(void)
{
    double at[8][3];
    hilbert_points points;
    hilbert_kd kd;
    int way, i;
    memset(&points, 0, sizeof points);
    points.coordinates = at;
    points.count = 8;
    for (way = 0; way < 2; way++) {
        for (i = 0; i < 8; i++) at[i][0] = at[i][1] = at[i][2] = i % 2 == way ? 0.0 : -0.0;
        CHECK(hilbert_kd_build(&kd, &points, 1, NULL) == HILBERT_OK);
        for (i = 0; i < 7; i++) CHECK(!signbit(kd.splits[i]));
        hilbert_kd_free(&kd, NULL);
    }
}

static void no_points_and_a_bad_box(void)
{
    hilbert_points points;
    hilbert_box box;
    memset(&points, 0, sizeof points);
    memset(&box, 0, sizeof box);
    CHECK(hilbert_sort_points(NULL, &points, &box, NULL, NULL) == HILBERT_OK);
    box.lo[1] = 1;
    CHECK(hilbert_sort_points(NULL, &points, &box, NULL, NULL) == HILBERT_ERROR_INVALID_ARGUMENT);
}

static void counts_that_no_memory_has(void)
{
    double one[3] = {0, 0, 0};
    hilbert_points points;
    hilbert_kd kd;
    size_t order;
    memset(&points, 0, sizeof points);
    points.coordinates = one;
    points.count = SIZE_MAX;
    CHECK(hilbert_argsort(&order, &points, NULL, NULL, NULL) == HILBERT_ERROR_TOO_LARGE);
    CHECK(hilbert_sort_points(one, &points, NULL, NULL, NULL) == HILBERT_ERROR_TOO_LARGE);
    CHECK(hilbert_kd_build(&kd, &points, 1, NULL) == HILBERT_ERROR_TOO_LARGE);
    points.dimension = 7;
    CHECK(hilbert_argsort(&order, &points, NULL, NULL, NULL) == HILBERT_ERROR_INVALID_ARGUMENT);
}

static void bad_arguments(void)
{
    double one[3] = {0, 0, 0};
    hilbert_points points;
    hilbert_options options;
    hilbert_box box;
    size_t order;
    uint64_t key;
    int i;

    memset(&points, 0, sizeof points);
    memset(&options, 0, sizeof options);
    memset(&box, 0, sizeof box);
    CHECK(hilbert_keys(NULL, &points, NULL, NULL, NULL) == HILBERT_OK); /* no points */
    CHECK(hilbert_argsort(NULL, &points, NULL, NULL, NULL) == HILBERT_OK);
    CHECK(hilbert_keys(&key, NULL, NULL, NULL, NULL) == HILBERT_ERROR_INVALID_ARGUMENT);
    points.count = 1;
    CHECK(hilbert_keys(&key, &points, NULL, NULL, NULL) == HILBERT_ERROR_INVALID_ARGUMENT);
    points.coordinates = one;
    CHECK(hilbert_keys(&key, &points, NULL, NULL, NULL) == HILBERT_OK);
    CHECK(hilbert_keys(NULL, &points, NULL, NULL, NULL) == HILBERT_ERROR_INVALID_ARGUMENT);
    CHECK(hilbert_argsort(&order, &points, NULL, NULL, NULL) == HILBERT_OK && order == 0);
    points.dimension = 4;
    CHECK(hilbert_keys(&key, &points, NULL, NULL, NULL) == HILBERT_ERROR_INVALID_ARGUMENT);
    points.dimension = 3;
    options.num_threads = -1;
    CHECK(hilbert_keys(&key, &points, NULL, NULL, &options) == HILBERT_ERROR_INVALID_ARGUMENT);
    options.num_threads = 1;
    options.allocator.release = failing_release;
    CHECK(hilbert_keys(&key, &points, NULL, NULL, &options) == HILBERT_ERROR_INVALID_ARGUMENT);
    box.depth = 22;
    CHECK(hilbert_keys(&key, &points, &box, NULL, NULL) == HILBERT_ERROR_INVALID_ARGUMENT);
    box.depth = 3;
    box.middle[1] = 1;
    CHECK(hilbert_keys(&key, &points, &box, NULL, NULL) == HILBERT_ERROR_INVALID_ARGUMENT);
    box.middle[1] = 0;
    box.hi[2] = HUGE_VAL;
    CHECK(hilbert_keys(&key, &points, &box, NULL, NULL) == HILBERT_ERROR_INVALID_ARGUMENT);
    for (i = 0; i >= -20; i--) CHECK(hilbert_result_string((hilbert_result)i)[0] != 0);
}

int main(void)
{
    tables_follow_the_definitions();
    curves_in_2d();
    keys_stay_what_they_were();
    decoding_undoes_encoding();
    cells_of_coordinates();
    batches_agree_with_single_points();
    threads_do_not_show();
    integer_points();
    boxes_fit();
    points_are_sorted();
    points_that_are_not_finite_come_last();
    partitions_hold_equal_counts();
    kd_cells_hold_equal_counts();
    deep_keys_refine_the_others();
    allocation_failures();
    points_at_odd_addresses();
    counts_that_no_memory_has();
    keys_do_not_depend_on_fused_operations();
    kd_splits_have_no_sign();
    no_points_and_a_bad_box();
    bad_arguments();
    return check_report();
}
