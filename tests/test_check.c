/* test_check.c - mesher_check: every defect and note, with its ids; the intersection test compared
 * with an oracle in integer arithmetic on small lattices, where degenerate positions are the
 * rule. */
#ifndef LINKED
#  define MESHER_IMPLEMENTATION
#endif
#include "mesher.h"
#include "check.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* -- Small helpers. */

static uint64_t seed_state = 88172645463325252u;
static uint32_t random_below(uint32_t n)
{
    seed_state ^= seed_state << 13;
    seed_state ^= seed_state >> 7;
    seed_state ^= seed_state << 17;
    return (uint32_t)((seed_state >> 20) % n);
}

enum { ROOM = 4096 };
typedef struct result_of {
    mesher_result  code;
    mesher_report  report;
    mesher_finding findings[ROOM];
} result_of;
static result_of last;

static mesher_surface surface_of(const double *xyz, size_t nv, const uint32_t *triangles, size_t nt)
{
    mesher_surface s;
    memset(&s, 0, sizeof s);
    s.xyz = xyz;
    s.num_vertices = nv;
    s.triangles = triangles;
    s.num_triangles = nt;
    return s;
}

/* Runs the check; the result is in last. */
static void check_surface(const mesher_surface *s, const mesher_options *options)
{
    memset(&last.report, 0, sizeof last.report);
    last.report.findings = last.findings;
    last.report.cap_findings = ROOM;
    last.code = mesher_check(s, options, &last.report);
}

static uint64_t count_of(mesher_kind kind) { return last.report.counts[kind]; }

static uint64_t defects(void)
{
    uint64_t n = 0;
    int k;
    for (k = MESHER_DEFECT_FIRST; k < MESHER_NUM_KINDS; k++) n += last.report.counts[k];
    return n;
}

/* The first finding of a kind, or NULL. */
static const mesher_finding *first_of(mesher_kind kind)
{
    size_t i;
    for (i = 0; i < last.report.num_findings; i++)
        if (last.findings[i].kind == kind) return last.findings + i;
    return NULL;
}

/* One kind of defect, so often, and no other. */
static int only_defect(mesher_kind kind, uint64_t n)
{
    return last.code == MESHER_ERROR_SURFACE && count_of(kind) == n && defects() == n &&
           last.report.message[0];
}

/* -- The oracle. Points are homogeneous integers x/w; everything fits in 64 bits for coordinates up
 * to 4. */

typedef int64_t big;
typedef struct point { big x[3], w; } point;
typedef struct simplex { int n; uint32_t v[3]; big p[3][3]; } simplex;

static void sub(big *r, const big *a, const big *b)
{
    int i;
    for (i = 0; i < 3; i++) r[i] = a[i] - b[i];
}
static void cross(big *r, const big *a, const big *b)
{
    int i;
    for (i = 0; i < 3; i++)
        r[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}
static big dot(const big *a, const big *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* p - w*a: the difference scaled by w */
static void offset(big *r, const point *p, const big *a)
{
    int i;
    for (i = 0; i < 3; i++) r[i] = p->x[i] - p->w * a[i];
}

static int oracle_contains(const simplex *s, const point *p)
{
    big e[3], f[3], n[3], d[3], c[3];
    int i;
    sub(e, s->p[1], s->p[0]);
    offset(d, p, s->p[0]);
    if (s->n == 2) {
        cross(c, e, d);
        if (c[0] || c[1] || c[2]) return 0;
        return dot(e, d) >= 0 && dot(e, d) <= p->w * dot(e, e);
    }
    sub(f, s->p[2], s->p[0]);
    cross(n, e, f);
    if (dot(n, d) != 0) return 0;
    for (i = 0; i < 3; i++) {
        sub(e, s->p[(i + 1) % 3], s->p[i]);
        offset(d, p, s->p[i]);
        cross(c, e, d);
        if (dot(n, c) < 0) return 0;
    }
    return 1;
}

/* p is a vertex of both. */
static int oracle_common(const simplex *a, const simplex *b, const point *p)
{
    int i, j, k;
    for (i = 0; i < a->n; i++)
        for (j = 0; j < b->n; j++) {
            if (a->v[i] != b->v[j]) continue;
            for (k = 0; k < 3 && p->x[k] == p->w * a->p[i][k]; k++) {}
            if (k == 3) return 1;
        }
    return 0;
}

static int oracle_bad(const simplex *a, const simplex *b, point *p)
{
    int i;
    if (p->w < 0) {
        p->w = -p->w;
        for (i = 0; i < 3; i++) p->x[i] = -p->x[i];
    }
    return oracle_contains(a, p) && oracle_contains(b, p) && !oracle_common(a, b, p);
}

/* The intersection of two convex sets is the hull of its extreme points, and these are vertices,
 * crossings of an edge and a plane, or of two edges. They meet badly if one of these is in both and
 * is no common vertex. */
static int oracle_half(const simplex *a, const simplex *b)
{
    point p;
    big n[3], d[3], e[3], f[3], r[3], c[3], den, num;
    int i, j, k, edges = a->n == 3 ? 3 : 1, other = b->n == 3 ? 3 : 1;
    for (i = 0; i < a->n; i++) {
        memcpy(p.x, a->p[i], sizeof p.x);
        p.w = 1;
        if (oracle_bad(a, b, &p)) return 1;
    }
    for (i = 0; i < edges; i++) {
        const big *s = a->p[i], *t = a->p[(i + 1) % a->n];
        sub(d, t, s);
        if (b->n == 3) {
            sub(e, b->p[1], b->p[0]);
            sub(f, b->p[2], b->p[0]);
            cross(n, e, f);
            sub(r, b->p[0], s);
            den = dot(n, d);
            num = dot(n, r);
            if (den) {
                for (k = 0; k < 3; k++) p.x[k] = den * s[k] + num * d[k];
                p.w = den;
                if (oracle_bad(a, b, &p)) return 1;
            }
        }
        for (j = 0; j < other; j++) {
            sub(e, b->p[(j + 1) % b->n], b->p[j]);
            sub(r, b->p[j], s);
            cross(n, d, e);
            if (dot(n, r) != 0) continue;
            den = dot(n, n);
            if (!den) continue; /* parallel: ends are vertices */
            cross(c, r, e);
            num = dot(c, n);
            for (k = 0; k < 3; k++) p.x[k] = den * s[k] + num * d[k];
            p.w = den;
            if (oracle_bad(a, b, &p)) return 1;
        }
    }
    return 0;
}
static int oracle_meet(const simplex *a, const simplex *b)
{
    return oracle_half(a, b) || oracle_half(b, a);
}

/* -- Random soups on a lattice. */

enum {
    SOUP_VERTICES = 9,
    SOUP_TRIANGLES = 7,
    SOUP_LINES = 3,
    SOUP_ALL = SOUP_TRIANGLES + SOUP_LINES
};

typedef struct soup {
    double   xyz[3 * SOUP_VERTICES];
    uint32_t triangles[3 * SOUP_TRIANGLES], lines[2 * SOUP_LINES];
    size_t   num_triangles, num_lines;
    simplex  all[SOUP_ALL];
} soup;

static int degenerate(const simplex *s)
{
    big e[3], f[3], n[3];
    if (s->n == 2) return s->v[0] == s->v[1];
    sub(e, s->p[1], s->p[0]);
    sub(f, s->p[2], s->p[0]);
    cross(n, e, f);
    return !n[0] && !n[1] && !n[2];
}

static int same_vertices(const simplex *a, const simplex *b)
{
    int i, j, n = 0;
    for (i = 0; i < a->n; i++)
        for (j = 0; j < b->n; j++) n += a->v[i] == b->v[j];
    return n == (a->n < b->n ? a->n : b->n);
}

/* Fills one simplex of distinct, not collinear vertices, unlike all before it; 0 if none was
 * found. */
static int random_simplex(soup *s, simplex *out, int n, size_t before)
{
    int tries, i, k;
    size_t j;
    for (tries = 0; tries < 40; tries++) {
        out->n = n;
        for (i = 0; i < n; i++) {
            out->v[i] = random_below(SOUP_VERTICES);
            for (k = 0; k < 3; k++) out->p[i][k] = (big)s->xyz[3 * out->v[i] + (uint32_t)k];
        }
        if (degenerate(out)) continue;
        for (j = 0; j < before; j++)
            if (same_vertices(out, s->all + j)) break;
        if (j == before) return 1;
    }
    return 0;
}

static void random_soup(soup *s, uint32_t size, uint32_t depth)
{
    uint32_t i, j;
    size_t n = 0;
    for (i = 0; i < SOUP_VERTICES; i++) { /* distinct points */
        do {
            s->xyz[3 * i] = random_below(size);
            s->xyz[3 * i + 1] = random_below(size);
            s->xyz[3 * i + 2] = random_below(depth);
            for (j = 0; j < i && memcmp(s->xyz + 3 * i, s->xyz + 3 * j, 3 * sizeof(double)); j++) {}
        } while (j < i);
    }
    s->num_triangles = s->num_lines = 0;
    for (i = 0; i < SOUP_TRIANGLES; i++)
        if (random_simplex(s, s->all + n, 3, n)) {
            memcpy(s->triangles + 3 * s->num_triangles++, s->all[n].v, 3 * sizeof(uint32_t));
            n++;
        }
    for (i = 0; i < SOUP_LINES; i++)
        if (random_simplex(s, s->all + n, 2, n)) {
            memcpy(s->lines + 2 * s->num_lines++, s->all[n].v, 2 * sizeof(uint32_t));
            n++;
        }
}

static double distance_to(const soup *s, size_t i, const double *x, double scale)
{
    /* Smallest distance of x from the plane or line of simplex i, in units of the lattice. */
    const simplex *t = s->all + i;
    double e[3], f[3], d[3], n[3], length;
    int k;
    for (k = 0; k < 3; k++) {
        e[k] = (double)(t->p[1][k] - t->p[0][k]);
        f[k] = t->n == 3 ? (double)(t->p[2][k] - t->p[0][k]) : 0;
        d[k] = x[k] / scale - (double)t->p[0][k];
    }
    if (t->n == 2) {
        memcpy(f, d, sizeof f);
        for (k = 0; k < 3; k++)
            n[k] = e[(k + 1) % 3] * f[(k + 2) % 3] - e[(k + 2) % 3] * f[(k + 1) % 3];
        return sqrt((n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) /
                    (e[0] * e[0] + e[1] * e[1] + e[2] * e[2]));
    }
    for (k = 0; k < 3; k++)
        n[k] = e[(k + 1) % 3] * f[(k + 2) % 3] - e[(k + 2) % 3] * f[(k + 1) % 3];
    length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    return fabs(n[0] * d[0] + n[1] * d[1] + n[2] * d[2]) / length;
}

/* The pairs that the check names are those of the oracle. */
static void compare_soup(const soup *s, double scale)
{
    mesher_surface surface;
    mesher_options options;
    double xyz[3 * SOUP_VERTICES];
    size_t n = s->num_triangles + s->num_lines, i, j, k;
    uint64_t expected = 0;
    int bad = 0;
    for (i = 0; i < 3 * SOUP_VERTICES; i++) xyz[i] = s->xyz[i] * scale;
    surface = surface_of(xyz, SOUP_VERTICES, s->triangles, s->num_triangles);
    surface.edges = s->lines;
    surface.num_edges = s->num_lines;
    memset(&options, 0, sizeof options);
    options.host.num_threads = 1;
    check_surface(&surface, &options);
    for (i = 0; i < n; i++)
        for (j = i + 1; j < n; j++) {
            int meet = oracle_meet(s->all + i, s->all + j), named = 0;
            expected += (uint64_t)meet;
            for (k = 0; k < last.report.num_findings; k++) {
                const mesher_finding *f = last.findings + k;
                uint32_t a = f->triangles[0], b = f->triangles[1];
                if (f->kind != MESHER_DEFECT_INTERSECTION && f->kind != MESHER_DEFECT_OVERLAP &&
                    f->kind != MESHER_DEFECT_T_JUNCTION)
                    continue;
                if (!((a == i && b == j) || (a == j && b == i))) continue;
                named++;
                if (distance_to(s, i, f->xyz, scale) > 1e-9 ||
                    distance_to(s, j, f->xyz, scale) > 1e-9)
                    bad++;
                if (f->kind == MESHER_DEFECT_T_JUNCTION) {
                    /* the vertex is of the first and lies on the second */
                    point p;
                    uint32_t v = f->vertices[0];
                    for (p.w = 0; p.w < 3; p.w++) p.x[p.w] = (big)s->xyz[3 * v + (uint32_t)p.w];
                    p.w = 1;
                    if (!oracle_contains(s->all + a, &p) || !oracle_contains(s->all + b, &p)) bad++;
                }
            }
            if (named != meet) bad++;
        }
    if (count_of(MESHER_DEFECT_INTERSECTION) + count_of(MESHER_DEFECT_OVERLAP) +
            count_of(MESHER_DEFECT_T_JUNCTION) !=
        expected)
        bad++;
    CHECK(bad == 0);
}

static void soups_agree_with_the_oracle(void)
{
    static soup s;
    int i;
    for (i = 0; i < 12000; i++) {
        uint32_t size = 3 + random_below(3), depth = i % 3 == 0 ? 1 : i % 3 == 1 ? 2 : size;
        random_soup(&s, size < 4 && depth < 2 ? 4 : size, depth);
        compare_soup(&s, 1);
        if (i % 16 == 0) {
            compare_soup(&s, 1.0 / 1048576);
            compare_soup(&s, 1e6); /* lattice points stay integers */
        }
    }
}

/* Isolated points on the lattice: left out if and only if they lie on something. */
static void isolated_points_agree_with_the_oracle(void)
{
    static soup s;
    int round;
    for (round = 0; round < 400; round++) {
        double xyz[3 * (SOUP_VERTICES + 64)];
        mesher_surface surface;
        size_t n = SOUP_VERTICES, i, j, k;
        int bad = 0;
        random_soup(&s, 4, 4);
        memcpy(xyz, s.xyz, sizeof s.xyz);
        for (i = 0; i < 64; i++) {
            double x[3];
            x[0] = (double)(i % 4);
            x[1] = (double)(i / 4 % 4);
            x[2] = (double)(i / 16);
            for (j = 0; j < SOUP_VERTICES && memcmp(x, s.xyz + 3 * j, sizeof x); j++) {}
            if (j == SOUP_VERTICES) memcpy(xyz + 3 * n++, x, sizeof x);
        }
        surface = surface_of(xyz, n, s.triangles, s.num_triangles);
        surface.edges = s.lines;
        surface.num_edges = s.num_lines;
        check_surface(&surface, NULL);
        for (k = 0; k < last.report.num_findings; k++) {
            const mesher_finding *f = last.findings + k;
            point p;
            uint32_t under = DELAUNAY_NO_ID;
            if (f->kind != MESHER_NOTE_UNUSED_VERTEX || f->vertices[0] < SOUP_VERTICES) continue;
            for (j = 0; j < 3; j++) p.x[j] = (big)xyz[3 * f->vertices[0] + j];
            p.w = 1;
            for (i = s.num_triangles + s.num_lines; i-- > 0;)
                if (oracle_contains(s.all + i, &p)) under = (uint32_t)i;
            if (f->triangles[0] != under) bad++;
        }
        CHECK(bad == 0);
        CHECK(count_of(MESHER_NOTE_UNUSED_VERTEX) >= n - SOUP_VERTICES);
    }
}

/* -- Cases by hand. */

static const double cube_xyz[24] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0,
                                    0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1};
static const uint32_t cube_triangles[36] = {0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4,
                                            1, 2, 6, 1, 6, 5, 2, 3, 7, 2, 7, 6, 3, 0, 4, 3, 4, 7};

static void a_cube_is_clean(void)
{
    mesher_surface s = surface_of(cube_xyz, 8, cube_triangles, 12);
    int k;
    check_surface(&s, NULL);
    CHECK(last.code == MESHER_OK);
    for (k = 0; k < MESHER_NUM_KINDS; k++) CHECK(last.report.counts[k] == 0);
    CHECK(last.report.message[0] == 0);
    CHECK(last.report.input_triangles == 12 && last.report.input_vertices == 8);
}

static void numbers_are_checked(void)
{
    static double xyz[24];
    static uint32_t triangles[36];
    mesher_surface s;
    const double bad[4] = {(double)NAN, (double)INFINITY, -(double)INFINITY, 1e300};
    int i;
    memcpy(triangles, cube_triangles, sizeof triangles);
    memcpy(xyz, cube_xyz, sizeof xyz);
    s = surface_of(xyz, 8, triangles, 12);
    for (i = 0; i < 4; i++) {
        memcpy(xyz, cube_xyz, sizeof xyz);
        xyz[3 * 5 + 1] = bad[i];
        check_surface(&s, NULL);
        CHECK(only_defect(i < 3 ? MESHER_DEFECT_NOT_FINITE : MESHER_DEFECT_RANGE, 1));
        CHECK(last.findings[0].vertices[0] == 5);
        CHECK(strstr(last.report.message, "vertex 5 ") != NULL);
    }
    for (i = 0; i < 24; i++) xyz[i] = cube_xyz[i] * 1e-300;
    check_surface(&s, NULL);
    CHECK(only_defect(MESHER_DEFECT_RANGE, 1));
    memcpy(xyz, cube_xyz, sizeof xyz);
    triangles[10] = 8;
    triangles[20] = UINT32_MAX;
    check_surface(&s, NULL);
    CHECK(only_defect(MESHER_DEFECT_INDEX, 2));
    CHECK(last.findings[0].triangles[0] == 3 && last.findings[0].vertices[0] == 8);
    CHECK(last.findings[1].triangles[0] == 6 && last.findings[1].vertices[0] == UINT32_MAX);
    CHECK(strstr(last.report.message, "triangle 3 ") &&
          strstr(last.report.message, "1 defect more"));
}

/* A cube as twelve separate triangles is welded; -0.0 is 0.0. */
static void duplicates_are_welded(void)
{
    double xyz[108] = {0};
    uint32_t triangles[36] = {0}, i;
    mesher_surface s = surface_of(xyz, 36, triangles, 12);
    for (i = 0; i < 36; i++) {
        memcpy(xyz + 3 * i, cube_xyz + 3 * cube_triangles[i], 3 * sizeof(double));
        triangles[i] = i;
        if (i & 1 && xyz[3 * i] == 0) xyz[3 * i] = -0.0;
    }
    check_surface(&s, NULL);
    CHECK(last.code == MESHER_OK);
    CHECK(count_of(MESHER_NOTE_DUPLICATE_VERTEX) == 28);
    CHECK(count_of(MESHER_NOTE_OPEN_EDGE) == 0);
    CHECK(first_of(MESHER_NOTE_DUPLICATE_VERTEX)->vertices[1] == 0);
    CHECK(last.report.message[0] == 0);
}

/* Corners that differ by a rounding stay apart; the report says which were meant to be one. */
static void nearly_equal_corners_are_noted(void)
{
    double xyz[108] = {0};
    uint32_t triangles[36] = {0}, i, j, firsts = 0;
    mesher_surface s;
    const mesher_finding *f;
    for (i = 0; i < 36; i++) {
        for (j = 0; j < 3; j++)
            xyz[3 * i + j] = cube_xyz[3 * cube_triangles[i] + j] + (double)i * 1e-13;
        triangles[i] = i;
        for (j = 0; j < i && cube_triangles[j] != cube_triangles[i]; j++) {}
        firsts += i == j;
    }
    s = surface_of(xyz, 36, triangles, 12);
    check_surface(&s, NULL);
    CHECK(count_of(MESHER_NOTE_NEAR_VERTEX) == 36 - firsts);
    f = first_of(MESHER_NOTE_NEAR_VERTEX);
    CHECK(f && cube_triangles[f->vertices[0]] == cube_triangles[f->vertices[1]] &&
          f->vertices[1] < f->vertices[0]);
    for (i = 0; i < 108; i++) xyz[i] = cube_xyz[3 * cube_triangles[i / 3] + i % 3] + (i / 3) * 1e-5;
    check_surface(&s, NULL);
    CHECK(count_of(MESHER_NOTE_NEAR_VERTEX) == 0);
}

/* A cube whose triangles do not quite meet is whole again when welded, and only then. */
static void welding_closes_a_cube(void)
{
    double xyz[108] = {0};
    uint32_t triangles[36] = {0}, i;
    uint64_t moved = 0;
    delaunay_host host;
    mesher_surface s = surface_of(xyz, 36, triangles, 12);
    for (i = 0; i < 36; i++) triangles[i] = i;
    for (i = 0; i < 108; i++)
        xyz[i] = cube_xyz[3 * cube_triangles[i / 3] + i % 3] + (double)random_below(1000) * 1e-12;
    check_surface(&s, NULL);
    CHECK(last.code == MESHER_ERROR_SURFACE && count_of(MESHER_NOTE_NEAR_VERTEX) > 0);
    CHECK(mesher_weld(xyz, 36, 1e-13, NULL, &moved) == MESHER_OK && moved < 28);
    CHECK(mesher_weld(xyz, 36, 1e-9, NULL, &moved) == MESHER_OK && moved > 0 && moved <= 28);
    check_surface(&s, NULL);
    CHECK(last.code == MESHER_OK && count_of(MESHER_NOTE_OPEN_EDGE) == 0);
    CHECK(count_of(MESHER_NOTE_DUPLICATE_VERTEX) == 28);
    CHECK(mesher_weld(xyz, 36, 1e-9, NULL, &moved) == MESHER_OK && moved == 0);
    xyz[5] = 1e61; /* out of range, and no number: neither moves nor draws others */
    xyz[7] = (double)NAN;
    CHECK(mesher_weld(xyz, 36, 10, NULL, &moved) == MESHER_OK && moved > 0);
    CHECK(xyz[5] == 1e61 && xyz[7] != xyz[7]);
    CHECK(mesher_weld(xyz, 36, 0, NULL, &moved) == MESHER_ERROR_INVALID_ARGUMENT && moved == 0);
    CHECK(mesher_weld(xyz, 36, -1, NULL, NULL) == MESHER_ERROR_INVALID_ARGUMENT);
    CHECK(mesher_weld(xyz, 36, (double)NAN, NULL, NULL) == MESHER_ERROR_INVALID_ARGUMENT);
    CHECK(mesher_weld(xyz, 36, (double)INFINITY, NULL, NULL) == MESHER_ERROR_INVALID_ARGUMENT);
    CHECK(mesher_weld(NULL, 36, 1, NULL, NULL) == MESHER_ERROR_INVALID_ARGUMENT);
    CHECK(mesher_weld(NULL, 0, 1, NULL, NULL) == MESHER_OK);
    CHECK(mesher_weld(xyz, UINT32_MAX, 1, NULL, NULL) == MESHER_ERROR_TOO_LARGE);
    memset(&host, 0, sizeof host);
    host.memory_limit_bytes = 100;
    CHECK(mesher_weld(xyz, 36, 10, &host, &moved) == MESHER_ERROR_OUT_OF_MEMORY && moved == 0);
}

static int differ_by(const double *a, const double *b, double most)
{
    return fabs(a[0] - b[0]) <= most && fabs(a[1] - b[1]) <= most && fabs(a[2] - b[2]) <= most;
}

/* By the definition, in square time: on a lattice, whose points are often at just the distance, and
 * on its images by rounding, far from the origin and near it. */
static void welding_agrees_with_its_definition(void)
{
    enum { N = 300 };
    static double xyz[3 * N], expected[3 * N];
    int stays[N], round;
    for (round = 0; round < 60; round++) {
        double unit = round % 3 ? ldexp(1.0, (int)random_below(80) - 40) : 0.1;
        double shift = round % 4 == 3 ? unit * ldexp(1.0, 44 + round % 9) : 0;
        double distance = unit * (1 + random_below(2));
        uint64_t moved = 0, wanted = 0;
        int i, j, k;
        for (i = 0; i < 3 * N; i++)
            xyz[i] = unit * ((double)random_below(16) - 8) + (i % 3 == round % 3 ? shift : 0);
        memcpy(expected, xyz, sizeof xyz);
        for (i = 0; i < N; i++) {
            for (j = 0; j < i && !(stays[j] && differ_by(expected + 3 * j, expected + 3 * i,
                                                         distance)); j++) {}
            stays[i] = j == i;
            for (k = 0; k < 3; k++) expected[3 * i + k] = expected[3 * j + k];
            wanted += !differ_by(expected + 3 * i, xyz + 3 * i, 0);
        }
        CHECK(mesher_weld(xyz, N, distance, NULL, &moved) == MESHER_OK);
        CHECK(moved == wanted && memcmp(xyz, expected, sizeof xyz) == 0);
    }
}

static void triangles_again_are_notes(void)
{
    uint32_t triangles[3 * 17] = {0};
    mesher_surface s;
    memcpy(triangles, cube_triangles, sizeof cube_triangles);
    s = surface_of(cube_xyz, 8, triangles, 17);
    triangles[36] = 2; triangles[37] = 1; triangles[38] = 0; /* triangle 0, rotated */
    triangles[39] = 0; triangles[40] = 1; triangles[41] = 2; /* and turned over */
    triangles[42] = 4; triangles[43] = 6; triangles[44] = 4; /* repeated index */
    triangles[45] = 4; triangles[46] = 5; triangles[47] = 6; /* triangle 2 */
    triangles[48] = 4; triangles[49] = 5; triangles[50] = 6;
    check_surface(&s, NULL);
    CHECK(last.code == MESHER_OK);
    CHECK(count_of(MESHER_NOTE_DUPLICATE_TRIANGLE) == 3);
    CHECK(count_of(MESHER_NOTE_OPPOSITE_TRIANGLE) == 1);
    CHECK(count_of(MESHER_NOTE_REPEATED_INDEX) == 1);
    CHECK(first_of(MESHER_NOTE_OPPOSITE_TRIANGLE)->triangles[0] == 0);
    CHECK(first_of(MESHER_NOTE_OPPOSITE_TRIANGLE)->triangles[1] == 13);
    CHECK(first_of(MESHER_NOTE_REPEATED_INDEX)->triangles[0] == 14);
    CHECK(count_of(MESHER_NOTE_OPEN_EDGE) == 0 && count_of(MESHER_NOTE_NON_MANIFOLD_EDGE) == 0);
}

/* A diagonal, again and turned over, is one line; one from a vertex to itself is none. */
static void lines_again_are_one(void)
{
    static const uint32_t lines[8] = {0, 6, 0, 6, 3, 3, 6, 0};
    mesher_surface s = surface_of(cube_xyz, 8, cube_triangles, 12);
    mesher_domain d;
    s.edges = lines;
    s.num_edges = 4;
    check_surface(&s, NULL);
    CHECK(last.code == MESHER_OK && count_of(MESHER_NOTE_REPEATED_INDEX) == 1);
    CHECK(first_of(MESHER_NOTE_REPEATED_INDEX)->triangles[0] == 12 + 2);
    CHECK(first_of(MESHER_NOTE_REPEATED_INDEX)->vertices[0] == 3);
    CHECK(mesher_domain_init(&d, &s, NULL, NULL) == MESHER_OK && d.num_edges == 18 + 1);
    mesher_domain_free(&d);
}

static void orientation_is_noted(void)
{
    uint32_t triangles[36] = {0};
    mesher_surface s;
    memcpy(triangles, cube_triangles, sizeof triangles);
    s = surface_of(cube_xyz, 8, triangles, 12);
    triangles[15] = 5; triangles[16] = 0; /* triangle 5 turned over */
    check_surface(&s, NULL);
    CHECK(last.code == MESHER_OK);
    CHECK(count_of(MESHER_NOTE_FLIPPED_TRIANGLE) == 3);
    CHECK(first_of(MESHER_NOTE_FLIPPED_TRIANGLE)->triangles[0] == 5 ||
          first_of(MESHER_NOTE_FLIPPED_TRIANGLE)->triangles[1] == 5);
}

static void collinear_triangles_are_defects(void)
{
    double xyz[27] = {0};
    uint32_t triangles[39] = {0};
    mesher_surface s;
    memcpy(xyz, cube_xyz, sizeof cube_xyz);
    memcpy(triangles, cube_triangles, sizeof cube_triangles);
    s = surface_of(xyz, 9, triangles, 13);
    xyz[24] = 0.5; xyz[25] = 0.5; xyz[26] = 0.5; /* exactly between vertices 0 and 6 */
    triangles[36] = 0; triangles[37] = 8; triangles[38] = 6;
    check_surface(&s, NULL);
    CHECK(only_defect(MESHER_DEFECT_COLLINEAR, 1));
    CHECK(last.findings[0].triangles[0] == 12);
    xyz[24] = 0.5 + DBL_EPSILON / 2; /* one ulp beside the line: a needle */
    check_surface(&s, NULL);
    CHECK(count_of(MESHER_DEFECT_COLLINEAR) == 0);
}

static void nothing_enclosed(void)
{
    uint32_t triangles[36] = {0};
    double xyz[24] = {0};
    uint32_t open;
    mesher_surface s = surface_of(cube_xyz, 8, cube_triangles, 11);
    check_surface(&s, NULL); /* a cube without its last triangle */
    CHECK(only_defect(MESHER_DEFECT_NO_CELL, 1));
    CHECK(count_of(MESHER_NOTE_OPEN_EDGE) == 3);
    open = last.findings[0].vertices[0];
    CHECK((open == 3 || open == 4) && last.findings[0].vertices[1] != DELAUNAY_NO_ID);
    CHECK(strstr(last.report.message, "it is open, at edge") != NULL);
    s = surface_of(cube_xyz, 8, cube_triangles, 0);
    check_surface(&s, NULL);
    CHECK(only_defect(MESHER_DEFECT_NO_CELL, 1));
    CHECK(count_of(MESHER_NOTE_UNUSED_VERTEX) == 8);
    s = surface_of(NULL, 0, NULL, 0);
    check_surface(&s, NULL);
    CHECK(only_defect(MESHER_DEFECT_NO_CELL, 1));
    memcpy(triangles, cube_triangles, sizeof triangles);
    memcpy(xyz, cube_xyz, sizeof xyz);
    for (open = 0; open < 8; open++)
        xyz[3 * open + 2] = 2 * xyz[3 * open] + 3 * xyz[3 * open + 1] + 1;
    s = surface_of(xyz, 8, triangles, 12); /* all in one plane, not a coordinate plane */
    check_surface(&s, NULL);
    CHECK(count_of(MESHER_DEFECT_FLAT) == 1);
    CHECK(strstr(last.report.message, "in one plane") != NULL);
}

/* A fin on an edge of a cube, an open flap: facets with an open edge enclose nothing, the cube
 * still does. */
static void open_edges_beside_a_cell(void)
{
    double xyz[27] = {0};
    uint32_t triangles[39] = {0};
    mesher_surface s;
    mesher_options o;
    memcpy(xyz, cube_xyz, sizeof cube_xyz);
    memcpy(triangles, cube_triangles, sizeof cube_triangles);
    s = surface_of(xyz, 9, triangles, 13);
    xyz[24] = 0.5; xyz[25] = 0.4; xyz[26] = 0.3;
    triangles[36] = 0; triangles[37] = 8; triangles[38] = 1; /* inside */
    check_surface(&s, NULL);
    CHECK(last.code == MESHER_OK);
    CHECK(count_of(MESHER_NOTE_OPEN_EDGE) == 2 && count_of(MESHER_NOTE_NON_MANIFOLD_EDGE) == 1);
    xyz[25] = -0.4; xyz[26] = -0.3; /* outside */
    check_surface(&s, NULL);
    CHECK(only_defect(MESHER_DEFECT_OUTSIDE_FACET, 1));
    CHECK(last.findings[0].triangles[0] == 12);
    memset(&o, 0, sizeof o);
    o.drop_outside = 1;
    check_surface(&s, &o);
    CHECK(last.code == MESHER_OK && count_of(MESHER_NOTE_OUTSIDE_FACET) == 1);
}

/* Two triangles, one moved: each kind of contact by hand, with its name. */
static void contacts_have_names(void)
{
    static const double base[9] = {0, 0, 0, 4, 0, 0, 0, 4, 0};
    static const struct { double p[9]; int kind; uint32_t owner, v[3]; double at[3];
    } cases[] = {
        {{1, 1, -1, 1, 1, 1, 9, 9, 1},
         MESHER_DEFECT_INTERSECTION,
         0,
         {1, 2, DELAUNAY_NO_ID},
         {2, 2, 0}},
        {{1, 1, 0, 1, 1, 1, 9, 9, 1},
         MESHER_DEFECT_T_JUNCTION,
         1,
         {3, DELAUNAY_NO_ID, DELAUNAY_NO_ID},
         {1, 1, 0}},
        {{2, 0, 0, 2, 0, 1, 2, -3, 1}, MESHER_DEFECT_T_JUNCTION, 1, {3, 0, 1}, {2, 0, 0}},
        {{-1, 0, 0, 1, 0, 0, 0, -3, 0}, MESHER_DEFECT_T_JUNCTION, 0, {0, 3, 4}, {0, 0, 0}},
        {{1, -2, 1, 1, -2, -1, 9, -9, 0}, -1, 0, {0, 0, 0}, {0, 0, 0}},
        {{2, 0, -1, 2, 0, 1, 2, -5, 0},
         MESHER_DEFECT_INTERSECTION,
         0,
         {0, 1, DELAUNAY_NO_ID},
         {2, 0, 0}},
        {{4, 4, 0, 5, 4, 0, 4, 5, 0}, -1, 0, {0, 0, 0}, {0, 0, 0}},
        {{5, 0, 0, 6, 0, 0, 5, -1, 0}, -1, 0, {0, 0, 0}, {0, 0, 0}},
    };
    const uint32_t triangles[6] = {0, 1, 2, 3, 4, 5};
    size_t i;
    for (i = 0; i < sizeof cases / sizeof *cases; i++) {
        double xyz[18] = {0};
        mesher_surface s = surface_of(xyz, 6, triangles, 2);
        const mesher_finding *f;
        int k;
        memcpy(xyz, base, sizeof base);
        memcpy(xyz + 9, cases[i].p, sizeof cases[i].p);
        check_surface(&s, NULL);
        if (cases[i].kind < 0) {
            CHECK(defects() == 1); /* no cell */
            continue;
        }
        f = first_of((mesher_kind)cases[i].kind);
        CHECK(f != NULL);
        if (!f) continue;
        CHECK(f->triangles[0] == cases[i].owner && f->triangles[1] == 1 - cases[i].owner);
        CHECK(memcmp(f->vertices, cases[i].v, sizeof f->vertices) == 0);
        for (k = 0; k < 3; k++) CHECK(fabs(f->xyz[k] - cases[i].at[k]) < 1e-12);
    }
}

static void overlaps_have_places(void)
{
    const uint32_t triangles[6] = {0, 1, 2, 3, 4, 5};
    double xyz[18] = {0, 0, 0, 4, 0, 0, 0, 4, 0, 1, 1, 0, 5, 1, 0, 1, 5, 0};
    mesher_surface s = surface_of(xyz, 6, triangles, 2);
    const mesher_finding *f;
    check_surface(&s, NULL);
    f = first_of(MESHER_DEFECT_OVERLAP); /* its place is within both */
    CHECK(f && f->xyz[0] > 1 && f->xyz[1] > 1 && f->xyz[0] + f->xyz[1] < 4 && f->xyz[2] == 0);
}

/* How far x is outside of triangle p, at most. */
static double outside_of(const double *p, const double *x)
{
    double e[3][3], n[3], m[3], most = 0, across;
    int i, k;
    for (i = 0; i < 3; i++)
        for (k = 0; k < 3; k++) e[i][k] = p[3 * ((i + 1) % 3) + k] - p[3 * i + k];
    for (k = 0; k < 3; k++)
        n[k] = e[0][(k + 1) % 3] * e[1][(k + 2) % 3] - e[0][(k + 2) % 3] * e[1][(k + 1) % 3];
    for (i = 0; i < 4; i++) { /* beyond the edges; off the plane */
        for (k = 0; k < 3 && i < 3; k++)
            m[k] = e[i][(k + 1) % 3] * n[(k + 2) % 3] - e[i][(k + 2) % 3] * n[(k + 1) % 3];
        for (across = 0, k = 0; k < 3; k++)
            across += (i < 3 ? m : n)[k] * (x[k] - p[3 * (i % 3) + k]);
        if (i == 3) across = fabs(across);
        across /= i < 3 ? sqrt(m[0] * m[0] + m[1] * m[1] + m[2] * m[2])
                        : sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        most = across > most ? across : most;
    }
    return most;
}

/* Two triangles in the same plane but for rounding: the heights of one over the other are noise. */
static void nearly_flat_crossings_have_places(void)
{
    const uint32_t triangles[6] = {0, 1, 2, 3, 4, 5};
    double xyz[18] = {-0.6782968841354982, -3.799978451168032, -8.372578880346886,
                      34.30504444356506,   71.97616989726535,  -24.4879029858627,
                      34.208294364949076,  73.32348519512323,  -18.641931645662176,
                      0.10086718862627975, -1.33842027033598,  -5.847953230850296,
                      0.08474217552361601, -1.113867720692999, -4.873624674150208,
                      34.25666940425707,   72.64982754619429,  -21.564917315762436};
    mesher_surface s = surface_of(xyz, 6, triangles, 2);
    const mesher_finding *f;
    int i, k;
    for (i = 0; i < 3; i++) {
        check_surface(&s, NULL);
        f = first_of(MESHER_DEFECT_INTERSECTION);
        CHECK(f && outside_of(xyz, f->xyz) < 1e-9 && outside_of(xyz + 9, f->xyz) < 1e-9);
        for (k = 0; k < 6; k++) { /* the same, turned over, and with other axes */
            double x = xyz[3 * k];
            xyz[3 * k] = xyz[3 * k + 1];
            xyz[3 * k + 1] = xyz[3 * k + 2];
            xyz[3 * k + 2] = x;
        }
    }
}

/* Two triangles side by side in nearly one plane. They have a corner in common, and would have two
 * but for rounding: they cross near that one, whose distance to an edge is rounded to 0. And two at
 * a large angle, where an edge of one lies behind an edge of the other as seen along an axis. */
static void crossings_near_edges_have_places(void)
{
    const uint32_t triangles[2][6] = {{0, 1, 2, 0, 3, 4}, {0, 1, 2, 3, 4, 5}};
    const double xyz[2][18] = {
        {-175753620787.4405, -623790266195.3398, 294857275685.19653, -6.33051164808363e-06,
         -5.012540753013882e-06, -5.899072594302646e-06, -17490829585.34979, -498476747369.9928,
         442334090542.7627, -6.592874091863876e-06, -1.2489691963563775e-05, 7.35938763838795e-07,
         -158262791202.09073, -125313518825.34703, -147476814857.56613, 0, 0, 0},
        {0, 0, 2, 1.9999999999999996, 0.9999999999999999, 1, 0.9999999999999998, 1.9999999999999996,
         0.9999999999999998, 1, 1.9999999999999998, 1.9999999999999998, 0, 2, 1,
         -1.1102230246251565e-16, 0, 0}};
    const double at[2][3] = {{0, 0, 0}, {2 / 3.0, 4 / 3.0, 4 / 3.0}};
    const double error[2] = {1e-3, 1e-12};
    int i, k;
    for (i = 0; i < 2; i++) {
        mesher_surface s = surface_of(xyz[i], 5 + (size_t)i, triangles[i], 2);
        const mesher_finding *f;
        check_surface(&s, NULL);
        f = first_of(MESHER_DEFECT_INTERSECTION);
        for (k = 0; k < 3; k++) CHECK(f && fabs(f->xyz[k] - at[i][k]) < error[i]);
    }
}

/* Two triangles with a common edge, on the same side of it. */
static void folds_overlap(void)
{
    double xyz[12] = {0, 0, 0, 4, 0, 0, 0, 4, 0, 1, 1, 0};
    const uint32_t fold[6] = {0, 1, 2, 1, 0, 3};
    mesher_surface s = surface_of(xyz, 4, fold, 2);
    check_surface(&s, NULL);
    CHECK(count_of(MESHER_DEFECT_OVERLAP) == 1);
    xyz[11] = 1e-300; /* opened by a hair: no defect but that nothing is enclosed */
    check_surface(&s, NULL);
    CHECK(count_of(MESHER_DEFECT_OVERLAP) == 0 && defects() == 1);
    xyz[10] = -1; xyz[11] = 0; /* on the other side */
    check_surface(&s, NULL);
    CHECK(count_of(MESHER_DEFECT_OVERLAP) == 0);
}

/* -- Larger inputs: a bumpy sheet of n*n squares closed to a box, and shells of it shifted into
 * each other. */

typedef struct model {
    double   *xyz;
    uint32_t *triangles;
    size_t    nv, nt;
} model;

static void model_free(model *m)
{
    free(m->xyz);
    free(m->triangles);
}

/* A closed torus-like grid, n*m quads, at an offset; bumps make nothing coplanar. */
static void add_torus(model *m, uint32_t n, uint32_t k, double x0, double y0, double z0)
{
    uint32_t i, j, base = (uint32_t)m->nv;
    m->xyz = (double *)realloc(m->xyz, (m->nv + n * k) * 3 * sizeof(double));
    m->triangles = (uint32_t *)realloc(m->triangles, (m->nt + 2 * n * k) * 3 * sizeof(uint32_t));
    for (i = 0; i < n; i++)
        for (j = 0; j < k; j++) {
            double u = 6.283185307179586 * i / n, v = 6.283185307179586 * j / k,
                   r = 1 + 0.4 * cos(v);
            double *x = m->xyz + 3 * m->nv++;
            x[0] = x0 + r * cos(u);
            x[1] = y0 + r * sin(u);
            x[2] = z0 + 0.4 * sin(v);
        }
    for (i = 0; i < n; i++)
        for (j = 0; j < k; j++) {
            uint32_t a = base + i * k + j, b = base + (i + 1) % n * k + j;
            uint32_t c = base + (i + 1) % n * k + (j + 1) % k, d = base + i * k + (j + 1) % k;
            uint32_t *t = m->triangles + 3 * m->nt;
            t[0] = a; t[1] = b; t[2] = c;
            t[3] = a; t[4] = c; t[5] = d;
            m->nt += 2;
        }
}

static void large_models(void)
{
    model m = {NULL, NULL, 0, 0};
    mesher_surface s;
    mesher_options options;
    mesher_report first;
    mesher_finding *findings = (mesher_finding *)malloc(ROOM * sizeof *findings);
    uint64_t all;
    int threads;
    memset(&options, 0, sizeof options);
    add_torus(&m, 200, 60, 0, 0, 0);
    s = surface_of(m.xyz, m.nv, m.triangles, m.nt);
    check_surface(&s, NULL);
    CHECK(last.code == MESHER_OK);
    add_torus(&m, 190, 70, 1.1, 0.03, 0.02);
    add_torus(&m, 190, 70, 1.1, 0.031, 0.021); /* nearly the same again: thousands of crossings */
    s = surface_of(m.xyz, m.nv, m.triangles, m.nt);
    check_surface(&s, NULL);
    CHECK(last.code == MESHER_ERROR_SURFACE);
    all = count_of(MESHER_DEFECT_INTERSECTION);
    CHECK(all > ROOM && last.report.num_findings == ROOM);
    first = last.report;
    memcpy(findings, last.findings, sizeof last.findings);
    for (threads = 1; threads <= 8;
         threads = threads == 3 ? 8 : threads + 1) { /* the same report, byte by byte */
        options.host.num_threads = threads;
        check_surface(&s, &options);
        CHECK(memcmp(last.report.counts, first.counts, sizeof first.counts) == 0);
        CHECK(last.report.num_findings == first.num_findings);
        CHECK(memcmp(last.findings, findings, sizeof last.findings) == 0);
        CHECK(strcmp(last.report.message, first.message) == 0);
    }
    memset(&last, 0, sizeof last); /* no room, no report: the same code */
    CHECK(mesher_check(&s, NULL, &last.report) == MESHER_ERROR_SURFACE);
    CHECK(count_of(MESHER_DEFECT_INTERSECTION) == all && last.report.num_findings == 0);
    CHECK(mesher_check(&s, NULL, NULL) == MESHER_ERROR_SURFACE);
    options.no_intersection_test = 1;
    CHECK(mesher_check(&s, &options, NULL) == MESHER_OK);
    free(findings);
    model_free(&m);
}

/* Findings are kept for defects before notes when room is short. */
static void defects_come_first(void)
{
    model m = {NULL, NULL, 0, 0};
    mesher_surface s;
    mesher_finding findings[5];
    mesher_report report;
    size_t i;
    add_torus(&m, 20, 10, 0, 0, 0);
    add_torus(&m, 20, 10, 0.9, 0.05, 0.03);
    for (i = 0; i < m.nt; i += 7) { /* many badly oriented triangles: notes */
        uint32_t v = m.triangles[3 * i];
        m.triangles[3 * i] = m.triangles[3 * i + 1];
        m.triangles[3 * i + 1] = v;
    }
    s = surface_of(m.xyz, m.nv, m.triangles, m.nt);
    memset(&report, 0, sizeof report);
    report.findings = findings;
    report.cap_findings = 5;
    CHECK(mesher_check(&s, NULL, &report) == MESHER_ERROR_SURFACE);
    CHECK(report.num_findings == 5);
    CHECK(report.counts[MESHER_NOTE_FLIPPED_TRIANGLE] > 5 &&
          report.counts[MESHER_DEFECT_INTERSECTION] > 5);
    for (i = 0; i < 5; i++) CHECK(findings[i].kind == MESHER_DEFECT_INTERSECTION);
    for (i = 1; i < 5; i++) CHECK(findings[i - 1].triangles[0] <= findings[i].triangles[0]);
    model_free(&m);
}

/* -- Contracts. */

typedef struct counting { long left, live; } counting;
static void *counting_alloc(void *user, size_t size)
{
    counting *c = (counting *)user;
    void *p;
    if (c->left == 0) return NULL;
    if (c->left > 0) c->left--;
    p = malloc(size ? size : 1);
    if (p) c->live++;
    return p;
}
static void counting_release(void *user, void *p)
{
    if (p) ((counting *)user)->live--;
    free(p);
}

static void every_allocation_may_fail(void)
{
    model m = {NULL, NULL, 0, 0};
    mesher_surface s;
    mesher_options options;
    counting c;
    long k;
    mesher_result code = MESHER_ERROR_OUT_OF_MEMORY;
    memset(&options, 0, sizeof options);
    add_torus(&m, 20, 10, 0, 0, 0);
    add_torus(&m, 20, 10, 0.9, 0.05, 0.03);
    s = surface_of(m.xyz, m.nv - 3, m.triangles, m.nt - 20);
    s.num_vertices = m.nv;
    options.host.allocator.alloc = counting_alloc;
    options.host.allocator.release = counting_release;
    options.host.allocator.user = &c;
    for (k = 0; k < 1000 && code == MESHER_ERROR_OUT_OF_MEMORY; k++) {
        c.left = k;
        c.live = 0;
        check_surface(&s, &options);
        code = last.code;
        CHECK(code == MESHER_ERROR_OUT_OF_MEMORY || code == MESHER_ERROR_SURFACE);
        CHECK(c.live == 0);
    }
    CHECK(k > 10 && code == MESHER_ERROR_SURFACE);
    options.host.memory_limit_bytes = 1000;
    c.left = -1;
    CHECK(mesher_check(&s, &options, NULL) == MESHER_ERROR_OUT_OF_MEMORY);
    model_free(&m);
}

/* Two combs of n needles each, all of one through all of the other: every pair is counted, in
 * memory that does not grow with their number. */
static void a_thicket_is_counted_in_little_memory(void)
{
    enum { TEETH = 2000 };
    mesher_surface s;
    mesher_options options;
    double *xyz = (double *)malloc(2 * TEETH * 9 * sizeof *xyz);
    uint32_t *triangles = (uint32_t *)malloc(2 * TEETH * 3 * sizeof *triangles);
    uint32_t i;
    if (!xyz || !triangles) abort();
    memset(&options, 0, sizeof options);
    for (i = 0; i < 2 * TEETH; i++) {
        const double along[3] = {-1, 1, 1}, up[3] = {0, -1, 1};
        int k;
        for (k = 0; k < 3; k++) {
            double *x = xyz + 9 * (size_t)i + 3 * k;
            x[i % 2] = along[k];
            x[1 - i % 2] = 2.0 * (i / 2 + 1) / (TEETH + 1) - 1;
            x[2] = up[k];
            triangles[3 * i + (uint32_t)k] = 3 * i + (uint32_t)k;
        }
    }
    s = surface_of(xyz, 6 * TEETH, triangles, 2 * TEETH);
    options.host.memory_limit_bytes = (size_t)200 << 20;
    check_surface(&s, &options);
    CHECK(last.code == MESHER_ERROR_SURFACE);
    CHECK(last.report.counts[MESHER_DEFECT_INTERSECTION] == (uint64_t)TEETH * TEETH);
    free(xyz);
    free(triangles);
}

static int stop_at_once(void *user, const char *phase, double fraction)
{
    ++*(int *)user;
    return fraction >= 0 && phase != NULL;
}

static void arguments_are_checked(void)
{
    mesher_surface s = surface_of(cube_xyz, 8, cube_triangles, 12);
    mesher_options o, out;
    double bad[3] = {0, 0, (double)NAN};
    int calls = 0, k;
    memset(&o, 0, sizeof o);
    CHECK(mesher_options_resolve(&out, NULL) == MESHER_OK && out.gradation == 0 &&
          out.size_factor == 1);
    CHECK(mesher_options_resolve(NULL, NULL) == MESHER_ERROR_INVALID_ARGUMENT);
    o.size = -1;
    CHECK(mesher_options_resolve(&out, &o) == MESHER_ERROR_INVALID_ARGUMENT);
    o.size = (double)NAN;
    CHECK(mesher_check(&s, &o, NULL) == MESHER_ERROR_INVALID_ARGUMENT);
    o.size = 1; o.min_size = 2; o.max_size = 1;
    CHECK(mesher_options_resolve(&out, &o) == MESHER_ERROR_INVALID_ARGUMENT);
    o.min_size = 0; o.gradation = 0.5;
    CHECK(mesher_options_resolve(&out, &o) == MESHER_ERROR_INVALID_ARGUMENT);
    o.gradation = 0; o.host.num_threads = -1;
    CHECK(mesher_options_resolve(&out, &o) == MESHER_ERROR_INVALID_ARGUMENT);
    o.host.num_threads = 0; o.host.allocator.alloc = counting_alloc;
    CHECK(mesher_options_resolve(&out, &o) == MESHER_ERROR_INVALID_ARGUMENT);
    o.host.allocator.alloc = NULL;
    CHECK(mesher_options_resolve(&out, &o) == MESHER_OK);
    o.host.progress = stop_at_once;
    o.host.user = &calls;
    CHECK(mesher_check(&s, &o, NULL) == MESHER_CANCELLED && calls == 1);
    CHECK(mesher_check(NULL, NULL, NULL) == MESHER_ERROR_INVALID_ARGUMENT);
    s.triangles = NULL;
    CHECK(mesher_check(&s, NULL, NULL) == MESHER_ERROR_INVALID_ARGUMENT);
    s.triangles = cube_triangles;
    s.num_vertices = (size_t)UINT32_MAX;
    CHECK(mesher_check(&s, NULL, NULL) == MESHER_ERROR_TOO_LARGE);
    s.num_vertices = 8;
    s.seeds = bad;
    s.num_seeds = 1;
    CHECK(mesher_check(&s, NULL, NULL) == MESHER_ERROR_INVALID_ARGUMENT);
    for (k = 0; k < MESHER_NUM_KINDS; k++)
        CHECK(strcmp(mesher_kind_string((mesher_kind)k), "unknown mesher_kind") != 0);
    CHECK(strcmp(mesher_result_string(MESHER_ERROR_RECOVERY),
                 mesher_result_string(MESHER_ERROR_SURFACE)) != 0);
}

/* A frame, like a square ring, with a membrane over its hole: no edge is open, and yet the membrane
 * lies outside every cell. Without it, and with nothing but a hole to choose, no cell is kept. */
static void what_only_cells_tell_is_found(void)
{
    static const double width[5] = {2, 2, 1, 1, 1}, height[5] = {0, 2, 0, 1, 2};
    static const uint8_t sides[5][2] = {{0, 1}, {1, 4}, {4, 3}, {3, 2}, {2, 0}};
    static const double hole[3] = {1.5, 0, 1};
    static const int32_t tag = 0;
    double xyz[60];
    uint32_t triangles[126], n = 0, i, k;
    mesher_surface s;
    mesher_options o;
    for (i = 0; i < 20; i++) {
        xyz[3 * i] = width[i / 4] * (i % 4 == 1 || i % 4 == 2 ? 1 : -1);
        xyz[3 * i + 1] = width[i / 4] * (i % 4 >= 2 ? 1 : -1);
        xyz[3 * i + 2] = height[i / 4];
    }
    for (k = 0; k < 5; k++)
        for (i = 0; i < 4; i++) {
            uint32_t a = 4u * sides[k][0], b = 4u * sides[k][1], j = (i + 1) % 4;
            const uint32_t quad[6] = {a + i, a + j, b + j, a + i, b + j, b + i};
            memcpy(triangles + n, quad, sizeof quad);
            n += 6;
        }
    for (i = 0; i < 6; i++) triangles[n + i] = 12 + (i < 3 ? i : i == 3 ? 0 : i - 2);
    s = surface_of(xyz, 20, triangles, n / 3 + 2);
    check_surface(&s, NULL);
    CHECK(last.code == MESHER_ERROR_SURFACE && count_of(MESHER_NOTE_OPEN_EDGE) == 0);
    CHECK(count_of(MESHER_DEFECT_OUTSIDE_FACET) == 2);
    s.num_triangles = n / 3;
    check_surface(&s, NULL);
    CHECK(last.code == MESHER_OK);
    s.seeds = hole;
    s.seed_tags = &tag;
    s.num_seeds = 1;
    memset(&o, 0, sizeof o);
    o.regions = MESHER_REGIONS_SEEDS;
    check_surface(&s, &o);
    CHECK(last.code == MESHER_ERROR_SURFACE && count_of(MESHER_DEFECT_NONE_KEPT) == 1);
}

/* Defects come before notes, and take their room; all are counted. */
static void reports_keep_defects_first(void)
{
    static const double here[3] = {1, 2, 3};
    const uint32_t none = DELAUNAY_NO_ID;
    mesher_report r;
    mesher_finding kept[3];
    memset(&r, 0, sizeof r);
    r.findings = kept;
    r.cap_findings = 3;
    r.input_triangles = 100;
    mesher_report_add(&r, MESHER_NOTE_SHEET, 1, none, none, none, none, here);
    mesher_report_add(&r, MESHER_DEFECT_OVERLAP, 2, 3, none, none, none, here);
    mesher_report_add(&r, MESHER_NOTE_OPEN_EDGE, 4, none, 5, 6, none, NULL);
    CHECK(r.num_findings == 3 && kept[0].kind == MESHER_DEFECT_OVERLAP);
    CHECK(kept[0].triangles[0] == 2 && kept[0].triangles[1] == 3 && kept[0].xyz[2] == 3);
    CHECK(kept[1].kind == MESHER_NOTE_SHEET && kept[2].kind == MESHER_NOTE_OPEN_EDGE);
    CHECK(kept[2].vertices[1] == 6 && kept[2].xyz[0] == 0);
    mesher_report_add(&r, MESHER_NOTE_SHEET, 7, none, none, none, none, here); /* no room */
    mesher_report_add(&r, MESHER_DEFECT_FLAT, 8, none, none, none, none, here);
    mesher_report_add(&r, MESHER_DEFECT_FLAT, 9, none, none, none, none, here);
    mesher_report_add(&r, MESHER_DEFECT_FLAT, 10, none, none, none, none, here); /* no room */
    CHECK(r.num_findings == 3 && kept[0].triangles[0] == 2);
    CHECK(kept[1].triangles[0] == 8 && kept[2].triangles[0] == 9);
    CHECK(r.counts[MESHER_NOTE_SHEET] == 2 && r.counts[MESHER_DEFECT_FLAT] == 3);
    mesher_report_add(&r, MESHER_NUM_KINDS, 1, none, none, none, none, here);
    mesher_report_add(NULL, MESHER_NOTE_SHEET, 1, none, none, none, none, here);
    CHECK(r.num_findings == 3 && strstr(r.message, "triangle 3"));
}

static void turns_in_a_coordinate_plane(void)
{
    const double a[3] = {0.1, 0.2, 0.3}, e = DBL_EPSILON;
    double b[3], c[3];
    int axis, i, j;
    for (axis = 0; axis < 3; axis++) {
        i = (axis + 1) % 3;
        j = (axis + 2) % 3;
        memcpy(b, a, sizeof b);
        memcpy(c, a, sizeof c);
        b[i] += 1;
        c[j] += 1;
        CHECK(delaunay_orient2d(a, b, c, axis) == 1 && delaunay_orient2d(a, c, b, axis) == -1);
        b[0] = b[1] = b[2] = 1; /* powers of two: all on a line */
        c[0] = c[1] = c[2] = 2;
        {
            const double zero[3] = {0, 0, 0};
            CHECK(delaunay_orient2d(zero, b, c, axis) == 0 && delaunay_collinear(zero, b, c));
            c[j] *= 1 + e; /* an ulp beside it */
            CHECK(delaunay_orient2d(zero, b, c, axis) == 1);
            c[j] = 2 * (1 - e / 2);
            CHECK(delaunay_orient2d(zero, b, c, axis) == -1 && !delaunay_collinear(zero, b, c));
        }
    }
}

/* Each bad number of the options, by its name and value. */
static void bad_options_have_names(void)
{
    mesher_surface s = surface_of(cube_xyz, 8, cube_triangles, 12);
    const double sizes[8] = {1, 1, 1, 1, 1, 1, 1, 1};
    int k;
    for (k = 0; k < 26; k++) {
        static const char *const names[26] = {
            "options.size is nan", "options.min_size is -1", "options.max_size is inf",
            "options.gradation is 0.5", "options.growth is 1 ", "options.max_seconds is -1",
            "options.size_factor is nan", "options.layers is -1",
            "options.curvature_degrees is nan", "options.min_size is 2", "options.regions is 77",
            "options.host.num_threads is -1", "options.host.allocator", "options.sources is NULL",
            "options.region_sizes is NULL", "options.sources[1].size is 0",
            "options.sources[1].slope is nan", "options.sources[1].radius is -2",
            "options.sources[1].xyz[5] is nan", "options.sources[1].shape is 9",
            "options.size_grid->size is NULL", "options.size_grid->count[1] is 1",
            "options.size_grid->spacing[2] is 0", "options.size_grid->origin[0] is nan",
            "surface.xyz is NULL", "seed 1 is nan"};
        mesher_options o;
        mesher_source sources[2];
        mesher_size_grid grid;
        mesher_surface t = s;
        double seeds[6] = {0, 0, 0, 0, 0, 0};
        int j;
        memset(&o, 0, sizeof o);
        memset(sources, 0, sizeof sources);
        memset(&grid, 0, sizeof grid);
        sources[0].size = sources[1].size = 1;
        for (j = 0; j < 3; j++) grid.spacing[j] = 1, grid.count[j] = 2;
        grid.size = sizes;
        if (k >= 15 && k < 20) o.sources = sources, o.num_sources = 2;
        if (k >= 20) o.size_grid = &grid;
        switch (k) {
        case 0: o.size = (double)NAN; break;
        case 1: o.min_size = -1; break;
        case 2: o.max_size = (double)INFINITY; break;
        case 3: o.gradation = 0.5; break;
        case 4: o.growth = 1; break;
        case 5: o.max_seconds = -1; break;
        case 6: o.size_factor = (double)NAN; break;
        case 7: o.layers = -1; break;
        case 8: o.curvature_degrees = (double)NAN; break;
        case 9: o.min_size = 2, o.max_size = 1; break;
        case 10: o.regions = (mesher_regions)77; break;
        case 11: o.host.num_threads = -1; break;
        case 12: o.host.allocator.alloc = counting_alloc; break;
        case 13: o.num_sources = 1; break;
        case 14: o.num_region_sizes = 1; break;
        case 15: sources[1].size = 0; break;
        case 16: sources[1].slope = (double)NAN; break;
        case 17: sources[1].radius = -2; break;
        case 18: sources[1].xyz[5] = (double)NAN; break;
        case 19: sources[1].shape = (mesher_shape)9; break;
        case 20: grid.size = NULL; break;
        case 21: grid.count[1] = 1; break;
        case 22: grid.spacing[2] = 0; break;
        case 23: grid.origin[0] = (double)NAN; break;
        case 24: t.xyz = NULL; break;
        default: seeds[4] = (double)NAN, t.seeds = seeds, t.num_seeds = 2; break;
        }
        memset(&last.report, 0, sizeof last.report);
        CHECK(mesher_check(&t, &o, &last.report) == MESHER_ERROR_INVALID_ARGUMENT);
        CHECK(strstr(last.report.message, names[k]) != NULL);
    }
    CHECK(mesher_check(NULL, NULL, &last.report) == MESHER_ERROR_INVALID_ARGUMENT);
    CHECK(strstr(last.report.message, "no surface") != NULL);
    s.seeds = sizes;
    s.num_seeds = SIZE_MAX / 3 + 1; /* three times as many wrap around */
    CHECK(mesher_check(&s, NULL, &last.report) == MESHER_ERROR_TOO_LARGE);
}

/* A sentence for each kind, with the ids and the place; -1: not known. */
static void findings_have_sentences(void)
{
    static const struct {
        mesher_kind kind;
        int triangles[2], vertices[3];
        const char *text;
    } cases[] = {
        {MESHER_NOTE_DUPLICATE_VERTEX, {-1, -1}, {5, 6, -1},
         "vertex 5 has the coordinates of vertex 6 at (1, 0.5, -2)"},
        {MESHER_NOTE_UNUSED_VERTEX, {-1, -1}, {5, -1, -1},
         "vertex 5 at (1, 0.5, -2) is in no triangle or line"},
        {MESHER_NOTE_UNUSED_VERTEX, {10, -1}, {5, -1, -1},
         "isolated vertex 5 lies exactly on triangle 10 at (1, 0.5, -2) and is left out"},
        {MESHER_NOTE_REPEATED_INDEX, {20, -1}, {5, -1, -1},
         "line 0 has vertex 5 twice, at (1, 0.5, -2)"},
        {MESHER_NOTE_DUPLICATE_TRIANGLE, {10, 11}, {-1, -1, -1},
         "triangle 10 is there again as triangle 11"},
        {MESHER_NOTE_OPPOSITE_TRIANGLE, {10, 11}, {-1, -1, -1},
         "triangle 10 is there again as triangle 11, turned over"},
        {MESHER_NOTE_FLIPPED_TRIANGLE, {10, 11}, {5, 6, -1},
         "triangle 10 and triangle 11 are oriented against each other at their edge 5-6"},
        {MESHER_NOTE_OPEN_EDGE, {10, -1}, {5, 6, -1},
         "edge 5-6 of triangle 10 is in no other triangle, at (1, 0.5, -2)"},
        {MESHER_NOTE_NON_MANIFOLD_EDGE, {10, -1}, {5, 6, -1},
         "edge 5-6 of triangle 10 is in more than two triangles, at (1, 0.5, -2)"},
        {MESHER_NOTE_SHEET, {10, -1}, {-1, -1, -1},
         "triangle 10 has the same cell on both sides, at (1, 0.5, -2)"},
        {MESHER_NOTE_SHELL_FILLED, {10, -1}, {-1, -1, -1},
         "the shell of triangle 10 lies inside another one, and is filled"},
        {MESHER_NOTE_SURFACE_STEINER, {21, -1}, {-1, -1, -1},
         "a point was added to line 1 at (1, 0.5, -2)"},
        {MESHER_NOTE_NEAR_VERTEX, {-1, -1}, {5, 6, -1},
         "vertices 5 and 6, ends of open edges, are almost one point at (1, 0.5, -2)"},
        {MESHER_NOTE_OUTSIDE_LINE, {21, -1}, {-1, -1, -1},
         "line 1 lies in no cell that is kept, at (1, 0.5, -2)"},
        {MESHER_NOTE_OUTSIDE_SEED, {-1, -1}, {5, -1, -1},
         "seed 5 at (1, 0.5, -2) is in no bounded cell"},
        {MESHER_NOTE_SHARED_CELL, {-1, -1}, {5, 6, -1},
         "seed 5 at (1, 0.5, -2) is in the cell of seed 6, whose number it gets"},
        {MESHER_NOTE_UNSEEDED_CELL, {10, -1}, {-1, -1, -1},
         "a cell at triangle 10 has no seed and is left out, as others have one"},
        {MESHER_NOTE_OUTSIDE_FACET, {10, -1}, {-1, -1, -1},
         "triangle 10 lies outside every cell, and is left out, at (1, 0.5, -2)"},
        {MESHER_DEFECT_INDEX, {10, -1}, {99, -1, -1},
         "triangle 10 has vertex 99, but there are only 30"},
        {MESHER_DEFECT_COLLINEAR, {10, -1}, {5, 6, 7},
         "triangle 10 has its vertices 5, 6 and 7 on one line, at (1, 0.5, -2)"},
        {MESHER_DEFECT_T_JUNCTION, {10, 11}, {5, 6, 7},
         "vertex 5 of triangle 10 lies on the edge 6-7 of triangle 11, at (1, 0.5, -2)"},
        {MESHER_DEFECT_T_JUNCTION, {10, 11}, {5, -1, -1},
         "vertex 5 of triangle 10 lies on triangle 11, at (1, 0.5, -2)"},
        {MESHER_DEFECT_INTERSECTION, {10, 20}, {-1, -1, -1},
         "triangle 10 and line 0 intersect, at (1, 0.5, -2)"},
        {MESHER_DEFECT_NO_CELL, {10, -1}, {5, 6, -1},
         "the surface encloses no volume: it is open, at edge 5-6 of triangle 10 and 2 others, "
         "at (1, 0.5, -2)"},
        {MESHER_DEFECT_RECOVERY, {10, -1}, {-1, -1, -1},
         "a point would have to stay on triangle 10, at (1, 0.5, -2)"},
        {MESHER_DEFECT_RECOVERY, {10, -1}, {5, -1, -1},
         "a piece of an edge or facet of triangle 10, by vertex 5, could not be recovered, "
         "at (1, 0.5, -2)"},
        {MESHER_DEFECT_RECOVERY, {20, -1}, {5, 6, -1},
         "edge 5-6 of line 0 could not be recovered, at (1, 0.5, -2)"},
        {MESHER_DEFECT_RECOVERY, {10, -1}, {5, 6, 7},
         "facet 5-6-7 of triangle 10 could not be recovered, at (1, 0.5, -2)"},
        {MESHER_DEFECT_NOT_IN_MESH, {10, -1}, {5, 6, 7},
         "facet 5-6-7 of triangle 10 is not in the mesh, at (1, 0.5, -2)"},
        {MESHER_DEFECT_NOT_IN_MESH, {20, -1}, {5, 6, -1},
         "edge 5-6, line 0, is not in the mesh, at (1, 0.5, -2)"}};
    mesher_report report;
    mesher_finding f;
    char text[200];
    size_t i;
    int k;
    memset(&report, 0, sizeof report);
    report.input_vertices = 30;
    report.input_triangles = 20;
    report.counts[MESHER_NOTE_OPEN_EDGE] = 3;
    for (i = 0; i < sizeof cases / sizeof *cases; i++) {
        f.kind = cases[i].kind;
        for (k = 0; k < 2; k++) f.triangles[k] = (uint32_t)cases[i].triangles[k];
        for (k = 0; k < 3; k++) f.vertices[k] = (uint32_t)cases[i].vertices[k];
        f.xyz[0] = 1, f.xyz[1] = 0.5, f.xyz[2] = -2;
        mesher_finding_string(text, sizeof text, &report, &f);
        CHECK(strcmp(text, cases[i].text) == 0);
    }
    for (k = 0; k < MESHER_NUM_KINDS; k++) { /* each kind has one, and a name of its own */
        int j;
        text[0] = 0;
        f.kind = (mesher_kind)k;
        mesher_finding_string(text, sizeof text, &report, &f);
        CHECK(text[0] && strncmp(mesher_kind_string(f.kind), "unknown", 7) != 0);
        for (j = 0; j < k; j++)
            CHECK(strcmp(mesher_kind_string((mesher_kind)j), mesher_kind_string(f.kind)) != 0);
    }
}

int main(void)
{
    bad_options_have_names();
    what_only_cells_tell_is_found();
    reports_keep_defects_first();
    turns_in_a_coordinate_plane();
    a_cube_is_clean();
    numbers_are_checked();
    duplicates_are_welded();
    nearly_equal_corners_are_noted();
    welding_closes_a_cube();
    welding_agrees_with_its_definition();
    triangles_again_are_notes();
    orientation_is_noted();
    collinear_triangles_are_defects();
    nothing_enclosed();
    open_edges_beside_a_cell();
    contacts_have_names();
    overlaps_have_places();
    nearly_flat_crossings_have_places();
    crossings_near_edges_have_places();
    folds_overlap();
    soups_agree_with_the_oracle();
    isolated_points_agree_with_the_oracle();
    large_models();
    defects_come_first();
    every_allocation_may_fail();
    a_thicket_is_counted_in_little_memory();
    arguments_are_checked();
    findings_have_sentences();
    lines_again_are_one();
    return check_report();
}
