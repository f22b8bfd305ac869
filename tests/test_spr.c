/* test_spr.c - spr.h: quality measures of known shapes, and what every improvement must leave as it
 * was. */
#define SPR_IMPLEMENTATION
#include "spr.h"
#include "check.h"
#include "small_mesh.h"
#include <limits.h>
#include <math.h>
#include <stdio.h>

/* ---- meshes -------------------------------------------------------------------------------- */

static double random_double(void) { return small_random(1u << 24) / (double)(1u << 24); }

/* Random points in a cube (corners included) or in a ball, none too close to another. */
static void random_points(double *xyz, uint32_t n, int ball)
{
    double closest = 0.36 / pow((double)n, 2. / 3);
    uint32_t i, k, j, tries;
    for (i = 0; i < n; i++)
        for (tries = 0; tries < 50; tries++) {
            double *p = xyz + 3 * i, r = 0;
            for (k = 0; k < 3; k++) {
                p[k] = !ball && i < 8 ? (double)(i >> k & 1) : random_double();
                r += (p[k] - .5) * (p[k] - .5);
            }
            if (ball && r > .25) continue;
            for (j = 0; j < i; j++)
                if (pow(p[0] - xyz[3 * j], 2) + pow(p[1] - xyz[3 * j + 1], 2) +
                        pow(p[2] - xyz[3 * j + 2], 2) <
                    closest)
                    break;
            if (j == i) break;
        }
}

static int random_mesh(delaunay_mesh *m, uint32_t n, int ball, const delaunay_host *host)
{
    double *xyz = (double *)malloc(3 * n * sizeof *xyz);
    delaunay_options options;
    delaunay_result result;
    memset(m, 0, sizeof *m);
    memset(&options, 0, sizeof options);
    if (host) options.host = *host;
    random_points(xyz, n, ball);
    result = delaunay_tetrahedralize(m, xyz, n, &options, NULL);
    free(xyz);
    if (result != DELAUNAY_OK) return 0;
    return delaunay_enable_marks(m) == DELAUNAY_OK && delaunay_link_vertices(m) == DELAUNAY_OK;
}

static const double *point(const delaunay_mesh *m, delaunay_handle t, int i)
{
    return m->vertices[m->tets[t].v[i]].x;
}

static double triple(const double *a, const double *b, const double *c, const double *d)
{
    double u[3], v[3], w[3];
    int k;
    for (k = 0; k < 3; k++) {
        u[k] = b[k] - a[k];
        v[k] = c[k] - a[k];
        w[k] = d[k] - a[k];
    }
    return u[0] * (v[1] * w[2] - v[2] * w[1]) + u[1] * (v[2] * w[0] - v[0] * w[2]) +
           u[2] * (v[0] * w[1] - v[1] * w[0]);
}

static double determinant(const delaunay_mesh *m, delaunay_handle t)
{
    return triple(point(m, t, 0), point(m, t, 1), point(m, t, 2), point(m, t, 3));
}

static int is_real(const delaunay_mesh *m, delaunay_handle t)
{
    return !delaunay_is_deleted(m, t) && !delaunay_is_ghost(m, t);
}

/* Colours 1 and 2 by which side of a plane the middle is; 0 (outside) in one corner if there is a
 * third. */
static void color_mesh(delaunay_mesh *m, int colors)
{
    delaunay_handle t;
    int i;
    for (t = 1; t < m->num_tets; t++) {
        double x = 0, y = 0;
        if (!is_real(m, t)) continue;
        for (i = 0; i < 4; i++) {
            x += point(m, t, i)[0] / 4;
            y += point(m, t, i)[1] / 4;
        }
        m->color[t] = colors > 2 && y > .7 ? 0 : colors > 1 && x > .45 ? 2 : 1;
    }
}

static double volume(const delaunay_mesh *m, uint32_t color)
{
    double sum = 0;
    delaunay_handle t;
    for (t = 1; t < m->num_tets; t++)
        if (is_real(m, t) && m->color[t] == color) sum += determinant(m, t);
    return sum;
}

/* Sum over the walls of a hash of their corners' coordinates and of the colours on both sides: the
 * same as long as the walls are. */
static uint64_t walls(const delaunay_mesh *m)
{
    uint64_t sum = 0, count = 0;
    delaunay_handle t;
    int i, k, j;
    for (t = 1; t < m->num_tets; t++)
        for (i = 0; i < 4 && is_real(m, t); i++) {
            delaunay_handle n = m->tets[t].n[i] / 4;
            uint32_t other = n && is_real(m, n) ? m->color[n] : 99;
            uint64_t hash = 1;
            if (other == m->color[t] && !(m->flags[t] & DELAUNAY_FACET_BIT(i))) continue;
            for (k = 0; k < 3; k++) {
                uint64_t h = 0, bits;
                for (j = 0; j < 3; j++) {
                    memcpy(&bits, &point(m, t, delaunay_facet_order(i)[k])[j], sizeof bits);
                    h = (h ^ bits) * 0x9e3779b97f4a7c15u;
                    h ^= h >> 31;
                }
                hash *= h | 1;
            }
            sum += hash * (1 + m->color[t]);
            count++;
        }
    return sum + count;
}

static spr_options open_options(void)
{
    spr_options o;
    memset(&o, 0, sizeof o);
    o.free_vertices = 1;
    o.host.num_threads = 1;
    return o;
}

/* ---- measures ------------------------------------------------------------------------------ */

static void test_measures_of_known_shapes(void)
{
    const double a[3] = {1, 1, 1}, b[3] = {1, -1, -1}, c[3] = {-1, 1, -1}, d[3] = {-1, -1, 1};
    const double o[3] = {0, 0, 0}, x[3] = {1, 0, 0}, y[3] = {0, 1, 0}, z[3] = {0, 0, 1};
    const double *p[4];
    double angle[6], g;
    int i, j, positive = delaunay_orient3d(a, b, c, d) > 0;
    p[0] = a; p[1] = positive ? b : c; p[2] = positive ? c : b; p[3] = d;
    CHECK(fabs(spr_gamma(p[0], p[1], p[2], p[3]) - 1) < 1e-14);
    CHECK(fabs(spr_sicn(p[0], p[1], p[2], p[3]) - 1) < 1e-14);
    CHECK(fabs(spr_min_sine(p[0], p[1], p[2], p[3]) - sqrt(8) / 3) < 1e-14);
    CHECK(fabs(spr_gamma(p[1], p[0], p[2], p[3]) + 1) < 1e-14);
    CHECK(fabs(spr_sicn(p[1], p[0], p[2], p[3]) + 1) < 1e-14);
    spr_dihedrals(p[0], p[1], p[2], p[3], angle);
    for (i = 0; i < 6; i++) CHECK(fabs(angle[i] - 70.528779365509308) < 1e-10);
    /* corner of a cube: volume 1/6, areas 3/2 + sqrt(3)/2, longest edge sqrt 2 */
    g = sqrt(24.) * 3 * (1 / 6.) / (sqrt(2.) * (1.5 + sqrt(3.) / 2));
    CHECK(fabs(spr_gamma(o, x, y, z) - g) < 1e-14);
    spr_dihedrals(o, x, y, z, angle);
    for (i = 0; i < 3; i++) CHECK(fabs(angle[i] - 90) < 1e-10);
    for (i = 3; i < 6; i++) CHECK(fabs(angle[i] - 54.735610317245346) < 1e-10);
    /* S = W^-1, W the regular one: W^T W has eigenvalues 2, 1/2, 1/2 */
    g = spr_sicn(o, x, y, z);
    CHECK(fabs(g - 3 / sqrt(3 * 4.5)) < 1e-14);
    p[0] = o; p[1] = x; p[2] = y; p[3] = z;
    for (i = 0; i < 4; i++)
        for (j = 0; j < i; j++) { /* odd permutations change the sign, and no more than that */
            const double *q[4], *swap;
            memcpy((void *)q, (const void *)p, sizeof q);
            swap = q[i]; q[i] = q[j]; q[j] = swap;
            CHECK(fabs(spr_gamma(q[0], q[1], q[2], q[3]) + spr_gamma(o, x, y, z)) < 1e-14);
            CHECK(fabs(spr_sicn(q[0], q[1], q[2], q[3]) + g) < 1e-14);
        }
    CHECK(spr_gamma(o, o, o, o) == 0 && spr_sicn(o, o, o, o) == 0 && spr_gamma(o, x, y, x) == 0);
}

/* Best gamma over all apices, of isosceles triangles by the angle at the tip (by numeric
 * search). */
static void test_bound_of_triangles(void)
{
    static const double needle[][2] = {{60, 1},   {45, .93}, {30, .77}, {20, .60},
                                       {15, .49}, {10, .35}, {5, .19},  {1, .04}};
    double a[3] = {0, 0, 0}, b[3] = {0, 0, 0}, c[3] = {0, 0, 0}, bound, best = 0;
    size_t i;
    int k;
    for (i = 0; i < sizeof needle / sizeof *needle; i++) {
        double angle = needle[i][0] * 0.017453292519943295;
        b[0] = cos(angle / 2); b[1] = sin(angle / 2);
        c[0] = b[0]; c[1] = -b[1];
        bound = spr_gamma_bound(a, b, c);
        CHECK(fabs(bound - needle[i][1]) < 0.012);
        CHECK(fabs(bound - spr_gamma_bound(c, b, a)) < 0.01);
    }
    for (k = 0; k < 20000; k++) { /* no apex is better than the bound */
        double p[3];
        p[0] = 3 * random_double() - 1;
        p[1] = 3 * random_double() - 1.5;
        p[2] = 2 * random_double() - 1;
        best = fmax(best, fabs(spr_gamma(a, b, c, p)));
    }
    CHECK(best <= bound * 1.01 && best > 0.5 * bound);
    CHECK(spr_gamma_bound(a, a, b) == 0);
}

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

static void test_statistics_against_sorting(void)
{
    delaunay_mesh m;
    spr_statistics s;
    delaunay_handle t;
    double *q, sum = 0, lowest = 180, highest = 0, angle[6];
    uint64_t below = 0, angles = 0;
    size_t n = 0;
    int i;
    CHECK(random_mesh(&m, 700, 0, NULL));
    color_mesh(&m, 3);
    q = (double *)malloc(m.num_tets * sizeof *q);
    for (t = 1; t < m.num_tets; t++) {
        if (!is_real(&m, t) || m.color[t] == 0) continue;
        q[n] = spr_gamma(point(&m, t, 0), point(&m, t, 1), point(&m, t, 2), point(&m, t, 3));
        below += q[n] < 0.35;
        sum += q[n++];
        spr_dihedrals(point(&m, t, 0), point(&m, t, 1), point(&m, t, 2), point(&m, t, 3), angle);
        for (i = 0; i < 6; i++) {
            lowest = fmin(lowest, angle[i]);
            highest = fmax(highest, angle[i]);
        }
    }
    qsort(q, n, sizeof *q, compare_doubles);
    CHECK(spr_measure_mesh(&m, NULL, &s) == SPR_OK);
    CHECK(s.num_tets == n && s.num_below == below && n > 1000);
    CHECK(fabs(s.min - q[0]) < 1e-15 && fabs(s.p001 - q[n / 1000]) < 1e-15 &&
          fabs(s.p01 - q[n / 100]) < 1e-15);
    CHECK(fabs(s.mean - sum / (double)n) < 1e-12);
    CHECK(fabs(s.dihedral_min_degrees - lowest) < 1e-5 &&
          fabs(s.dihedral_max_degrees - highest) < 1e-5);
    for (i = 0; i < 18; i++) angles += s.dihedral_histogram[i];
    CHECK(angles == 6 * n);
    free(q);
    delaunay_mesh_free(&m);
}

/* Of four points that are nearly on a line rounding may make the quality negative, though they are
 * in positive order. The statistics do not report that as an inverted tetrahedron. */
static void test_rounding_inverts_nothing(void)
{
    static const uint32_t tet[4] = {0, 1, 2, 3};
    uint32_t tried = 0, found = 0;
    while (found < 5 && tried++ < 100000) {
        delaunay_mesh m;
        spr_statistics s;
        double x[12];
        int i;
        for (i = 0; i < 12; i++)
            x[i] = (i / 3 + 1) * 0.1 * (i % 3 + 1) * (1 + small_random(8) * 1e-16);
        if (delaunay_orient3d(x, x + 3, x + 6, x + 9) <= 0 ||
            spr_gamma(x, x + 3, x + 6, x + 9) > -1e-6)
            continue;
        memset(&m, 0, sizeof m);
        CHECK(delaunay_import(&m, x, 4, tet, NULL, 1, NULL, NULL) == DELAUNAY_OK);
        CHECK(spr_measure_mesh(&m, NULL, &s) == SPR_OK);
        CHECK(s.num_tets == 1 && s.gamma_min == 0 && s.min == 0 && s.sicn_min >= 0);
        delaunay_mesh_free(&m);
        found++;
    }
    CHECK(found == 5);
}

/* ---- improvement --------------------------------------------------------------------------- */

/* Improves, and checks what must hold whatever the options are. */
static void improve_and_check(delaunay_mesh *m, const spr_options *options, spr_report *report,
                              spr_result expected)
{
    double volumes[3];
    uint64_t border = walls(m);
    uint32_t v, ids = 0, n = m->num_vertices;
    delaunay_report found;
    double *fixed = (double *)malloc(3 * n * sizeof *fixed);
    int i;
    for (i = 0; i < 3; i++) volumes[i] = volume(m, (uint32_t)i);
    for (v = 1; v < n; v++) {
        memcpy(fixed + 3 * v, m->vertices[v].x, 3 * sizeof *fixed);
        ids += m->vertex_id[v] != DELAUNAY_NO_ID;
    }
    CHECK(spr_improve(m, options, report) == expected);
    CHECK(report->after.min >= report->before.min - 1e-15);
    CHECK(report->after.num_below <= report->before.num_below);
    CHECK(delaunay_validate(m, DELAUNAY_VALIDATE_GEOMETRY, &found) == DELAUNAY_OK);
    CHECK(walls(m) == border);
    for (i = 0; i < 3; i++) CHECK(fabs(volume(m, (uint32_t)i) - volumes[i]) <= 1e-12);
    for (v = 1; v < m->num_vertices; v++) ids -= m->vertex_id[v] != DELAUNAY_NO_ID;
    CHECK(ids == 0);
    for (v = 1; v < n && options; v++) /* what is added comes after */
        if (!options->free_vertices || (options->fixed_vertices && options->fixed_vertices[v]))
            CHECK(!memcmp(fixed + 3 * v, m->vertices[v].x, 3 * sizeof *fixed));
    free(fixed);
}

static void test_improves_a_cube_and_a_ball(void)
{
    uint64_t reconnected = 0, shaken = 0;
    int ball, colors;
    for (ball = 0; ball < 2; ball++)
        for (colors = 1; colors <= 3; colors++) {
            spr_options o = open_options();
            delaunay_mesh m;
            spr_report r;
            int i;
            CHECK(random_mesh(&m, 250, ball, NULL));
            color_mesh(&m, colors);
            improve_and_check(&m, &o, &r, SPR_OK);
            CHECK(r.after.num_below * 2 < r.before.num_below &&
                  (!ball || colors > 1 || r.stuck * 20 < r.before.num_below));
            CHECK(r.bounded + r.fixed + r.stuck + r.unfinished == r.after.num_below);
            CHECK(r.after.mean > r.before.mean && r.edges_removed > 0 && r.smoothed > 0);
            reconnected += r.reconnected;
            shaken += r.shaken;
            for (i = 0; i < r.num_worst; i++) {
                CHECK(r.worst[i].quality <= r.worst[i].bound * 1.01 && r.worst[i].quality < 0.35);
                CHECK(i == 0 || r.worst[i].quality >= r.worst[i - 1].quality);
            }
            CHECK((r.num_worst > 0) == (r.after.num_below > 0) &&
                  (r.num_worst == 0 || fabs(r.worst[0].quality - r.after.min) < 1e-12));
            delaunay_mesh_free(&m);
        }
    CHECK(reconnected > 0 && shaken > 0);
}

static int num_used_vertices(const delaunay_mesh *m)
{
    uint8_t *used = (uint8_t *)calloc(m->num_vertices, 1);
    delaunay_handle t;
    int i, num = 0;
    for (t = 1; t < m->num_tets; t++)
        for (i = 0; i < 4 && is_real(m, t); i++) {
            num += !used[m->tets[t].v[i]];
            used[m->tets[t].v[i]] = 1;
        }
    free(used);
    return num;
}

static void test_counts_vertices_that_come_and_go(void)
{
    uint64_t shaken = 0, removed = 0, inserted = 0;
    int pass;
    for (pass = 0; pass < 4; pass++) {
        spr_options o = open_options();
        delaunay_mesh m;
        spr_report r;
        int before;
        o.target = 0.2;
        CHECK(random_mesh(&m, 200, 1, NULL));
        color_mesh(&m, 1);
        before = num_used_vertices(&m);
        improve_and_check(&m, &o, &r, SPR_OK);
        CHECK(num_used_vertices(&m) ==
              before + (int)r.vertices_inserted - (int)r.vertices_removed);
        shaken += r.shaken;
        removed += r.vertices_removed;
        inserted += r.vertices_inserted;
        delaunay_mesh_free(&m);
    }
    CHECK(shaken > 0 && removed > 0 && inserted > 0);
}

static void test_keeps_the_callers_points_by_default(void)
{
    delaunay_mesh m;
    spr_report r;
    uint8_t *all;
    spr_options o;
    memset(&o, 0, sizeof o);
    o.host.num_threads = 1;
    CHECK(random_mesh(&m, 200, 0, NULL));
    color_mesh(&m, 1);
    all = (uint8_t *)malloc(m.num_vertices);
    memset(all, 1, m.num_vertices);
    o.fixed_vertices = all;
    o.keep_vertices = 1;
    improve_and_check(&m, &o, &r, SPR_OK);
    CHECK(r.smoothed == 0 && r.vertices_removed == 0 && r.edges_removed > 0);
    delaunay_mesh_free(&m);
    CHECK(random_mesh(&m, 200, 0, NULL));
    color_mesh(&m, 1);
    o.fixed_vertices = NULL;
    improve_and_check(&m, &o, &r, SPR_OK);
    CHECK(r.edges_removed > 0);
    free(all);
    delaunay_mesh_free(&m);
}

static double plain_gamma(void *user, const double *a, const double *b, const double *c,
                          const double *d)
{
    (void)user;
    return spr_gamma(a, b, c, d);
}

/* The side^3 points of a lattice in the unit cube, those inside shaken. */
static void shaken_lattice(int side, double *xyz)
{
    int i, k;
    for (i = 0; i < side * side * side; i++)
        for (k = 0; k < 3; k++) {
            int at = k == 0 ? i % side : k == 1 ? i / side % side : i / side / side;
            double shake = at > 0 && at < side - 1 ? 0.5 * small_random(1000) / 1000 - 0.25 : 0;
            xyz[3 * i + k] = (at + shake) / (side - 1);
        }
}

/* With gamma given as a user's measure nothing is done about angles. Points of lattices, shaken. */
static void test_rounds_extreme_angles(void)
{
    enum { SIDE = 9, POINTS = SIDE * SIDE * SIDE };
    double smallest[2] = {0, 0}, sicn[2] = {0, 0}, xyz[3 * POINTS];
    int seed, k;
    for (seed = 0; seed < 12; seed++) {
        shaken_lattice(SIDE, xyz);
        for (k = 0; k < 2; k++) {
            spr_options o = open_options();
            delaunay_mesh m;
            spr_report r;
            if (k == 0) {
                o.measure = SPR_USER;
                o.quality = plain_gamma;
            }
            memset(&m, 0, sizeof m);
            CHECK(delaunay_tetrahedralize(&m, xyz, POINTS, NULL, NULL) == DELAUNAY_OK);
            CHECK(delaunay_enable_marks(&m) == DELAUNAY_OK);
            color_mesh(&m, 1);
            improve_and_check(&m, &o, &r, SPR_OK);
            smallest[k] += r.after.dihedral_min_degrees;
            sicn[k] += r.after.sicn_min;
            delaunay_mesh_free(&m);
        }
    }
    CHECK(smallest[1] > smallest[0] + 0.5);
    CHECK(sicn[1] > sicn[0]);
}

static void test_each_operator_alone(void)
{
    int k;
    for (k = 0; k < 4; k++) {
        spr_options o = open_options();
        delaunay_mesh m;
        spr_report r;
        o.no_smoothing = k != 0;
        o.no_edge_removal = k != 1;
        o.no_reconnection = k != 2;
        o.keep_vertices = k != 3;
        CHECK(random_mesh(&m, 250, 1, NULL));
        color_mesh(&m, 2);
        improve_and_check(&m, &o, &r, SPR_OK);
        CHECK((r.smoothed > 0) == (k == 0) && (r.edges_removed > 0) == (k == 1) &&
              (r.reconnected > 0) == (k == 2));
        CHECK((r.vertices_removed + r.vertices_inserted > 0) == (k == 3));
        CHECK(k == 0 || r.shaken == 0);
        CHECK(r.after.num_below < r.before.num_below);
        delaunay_mesh_free(&m);
    }
}

/* A thin plate with one point inside. With it no mesh is as good as without it, but its star alone
 * cannot always be filled, or not well enough. */
static void test_a_vertex_goes_with_more_than_its_star(void)
{
    enum { SIDE = 5, POINTS = 2 * SIDE * SIDE + 1 };
    int trial, i, k;
    for (trial = 0; trial < 16; trial++) {
        double xyz[POINTS][3];
        delaunay_mesh m;
        spr_options o = open_options();
        spr_report r;
        uint32_t v;
        if (trial % 8 == 0) small_state = trial ? 45 : 15; /* with such ones among them */
        memset(&m, 0, sizeof m);
        for (i = 0; i < POINTS - 1; i++) {
            const int at[2] = {i / 2 / SIDE, i / 2 % SIDE};
            for (k = 0; k < 2; k++)
                xyz[i][k] = at[k] + (at[k] % (SIDE - 1) ? 0.3 * (random_double() - 0.5) : 0);
            xyz[i][2] = 0.1 * (i % 2);
        }
        for (k = 0; k < 2; k++) xyz[POINTS - 1][k] = SIDE / 2 + 0.8 * (random_double() - 0.5);
        xyz[POINTS - 1][2] = 0.03 + 0.04 * random_double();
        CHECK(delaunay_tetrahedralize(&m, xyz[0], POINTS, NULL, NULL) == DELAUNAY_OK);
        CHECK(delaunay_enable_marks(&m) == DELAUNAY_OK);
        color_mesh(&m, 1);
        o.free_vertices = 0;
        for (v = 1; v < m.num_vertices; v++)
            if (m.vertex_id[v] == POINTS - 1) m.vertex_id[v] = DELAUNAY_NO_ID;
        CHECK(spr_improve(&m, &o, &r) == SPR_OK && r.vertices_removed > 0);
        CHECK(delaunay_validate(&m, DELAUNAY_VALIDATE_GEOMETRY, NULL) == DELAUNAY_OK);
        for (v = 1; v < m.num_vertices; v++) CHECK(m.vertex_id[v] != DELAUNAY_NO_ID);
        delaunay_mesh_free(&m);
    }
}

static void test_constrained_edges_and_facets_stay(void)
{
    spr_options o = open_options();
    delaunay_mesh m;
    delaunay_worker *w;
    spr_report r;
    uint32_t ends[60][2], corners[40][3];
    int i, num_edges = 0, num_facets = 0;
    CHECK(random_mesh(&m, 250, 0, NULL));
    color_mesh(&m, 1);
    w = delaunay_worker_new(&m.memory);
    while (num_edges < 60 || num_facets < 40) {
        delaunay_handle t = 1 + small_random((uint32_t)m.num_tets - 1);
        int e = (int)small_random(6), f = (int)small_random(4);
        if (!is_real(&m, t)) continue;
        if (num_edges < 60) {
            ends[num_edges][0] = m.tets[t].v[delaunay_edge_order(e)[0]];
            ends[num_edges][1] = m.tets[t].v[delaunay_edge_order(e)[1]];
            CHECK(delaunay_mark_edge(&m, w, t, ends[num_edges][0], ends[num_edges][1], 1) ==
                  DELAUNAY_OK);
            num_edges++;
        } else {
            for (i = 0; i < 3; i++)
                corners[num_facets][i] = m.tets[t].v[delaunay_facet_order(f)[i]];
            delaunay_mark_facet(&m, 4 * t + (delaunay_handle)f, 1);
            num_facets++;
        }
    }
    improve_and_check(&m, &o, &r, SPR_OK);
    CHECK(r.edges_removed > 0);
    for (i = 0; i < num_edges; i++) {
        delaunay_handle t = delaunay_find_edge(&m, w, ends[i][0], ends[i][1]);
        int a, b;
        CHECK(t != 0);
        if (!t) continue;
        a = delaunay_local_index(&m.tets[t], ends[i][0]);
        b = delaunay_local_index(&m.tets[t], ends[i][1]);
        CHECK(m.flags[t] & DELAUNAY_EDGE_BIT(delaunay_edge_between(a, b)));
    }
    for (i = 0; i < num_facets; i++) {
        delaunay_handle f = delaunay_find_facet(&m, w, corners[i][0], corners[i][1], corners[i][2]);
        CHECK(f != 0 && (m.flags[f / 4] & DELAUNAY_FACET_BIT(f % 4)));
    }
    delaunay_worker_free(w);
    delaunay_mesh_free(&m);
}

static double stretched(void *user, const double *a, const double *b, const double *c,
                        const double *d)
{
    const double *p[4];
    double q[4][3];
    int i, k;
    p[0] = a; p[1] = b; p[2] = c; p[3] = d;
    for (i = 0; i < 4; i++)
        for (k = 0; k < 3; k++) q[i][k] = p[i][k] * (k == 0 ? *(const double *)user : 1);
    return spr_gamma(q[0], q[1], q[2], q[3]);
}

static double no_number(void *user, const double *a, const double *b, const double *c,
                        const double *d)
{
    return (double)NAN * (user ? a[0] + b[0] + c[0] + d[0] : 1);
}

/* What a measure has no number for counts as bad, and nothing is done about it. */
static void test_a_measure_without_numbers(void)
{
    spr_options o = open_options();
    delaunay_mesh m;
    spr_report r;
    o.measure = SPR_USER;
    o.quality = no_number;
    o.require_target = 1;
    CHECK(random_mesh(&m, 60, 0, NULL));
    color_mesh(&m, 1);
    CHECK(spr_improve(&m, &o, &r) == SPR_GOAL_NOT_MET);
    CHECK(r.after.num_tets > 0 && r.after.num_below == r.after.num_tets && r.after.min < 0);
    CHECK(delaunay_validate(&m, DELAUNAY_VALIDATE_GEOMETRY, NULL) == DELAUNAY_OK);
    delaunay_mesh_free(&m);
}

static void test_other_measures(void)
{
    static double factor = 0.6;
    int k;
    for (k = SPR_SICN; k <= SPR_USER; k++) {
        spr_options o = open_options();
        delaunay_mesh m;
        spr_report r;
        o.measure = (spr_measure)k;
        o.quality = stretched;
        o.quality_user = &factor;
        CHECK(random_mesh(&m, 150, 0, NULL));
        color_mesh(&m, 2);
        improve_and_check(&m, &o, &r, SPR_OK);
        CHECK(r.after.num_below * 3 < r.before.num_below * 2);
        delaunay_mesh_free(&m);
    }
}

/* A vertex of doubles and one more, which is read and not used, as those of a mesh. */
static void random_vertex(double *x, int flat)
{
    int k;
    for (k = 0; k < 3; k++) x[k] = (int)small_random(2001) / 1000. - 1;
    if (flat) x[2] = 0;
    x[3] = 7;
}

/* Values and gradients of cones by vectors are those of the plain way, bit by bit; the compiler may
 * make fused operations of the plain ones if the processor it compiles for has them. */
static void test_vectors_and_the_plain_way_agree(void)
{
    static spr__cone cone[2];
    double x[30][3][4], p[4], q[2][32], g[2][32][3];
    spr__state s;
    int round, i, k, simd;
    memset(&s, 0, sizeof s);
    s.gamma = 1;
    for (round = 0; round < 2000; round++) {
        int n = 1 + (int)small_random(28), flat = round % 5 == 0;
        size_t found[2];
        double least = round % 2 ? -HUGE_VAL : 0.1;
        random_vertex(p, flat);
        memset(q, 0, sizeof q);
        memset(g, 0, sizeof g);
        for (i = 0; i < n; i++)
            for (k = 0; k < 3; k++) random_vertex(x[i][k], flat);
        if (round % 7 == 0) memcpy(x[0][1], x[0][0], sizeof x[0][0]);
        if (round % 11 == 0) memcpy(p, x[0][0], sizeof p);
        for (simd = 0; simd < 2; simd++) {
            s.simd = simd && SPR__AVX2;
            cone[simd].n = 0;
            for (i = 0; i < n; i++) spr__cone_add(&cone[simd], x[i][0], x[i][1], x[i][2]);
            spr__cone_close(&s, &cone[simd]);
            found[simd] = spr__cone_values(&s, &cone[simd], p, least, q[simd]);
            for (i = 0; i < n; i += 4)
                spr__cone_gradients(&s, &cone[simd], (size_t)i, p, g[simd] + i);
        }
        for (i = 0; i < n && i < (int)found[0]; i++) {
            double value = spr_gamma(x[i][0], x[i][1], x[i][2], p);
            s.simd = SPR__AVX2;
            CHECK(fabs(spr__quality(&s, x[i][0], x[i][1], x[i][2], p) - value) < 1e-12);
#if !defined(__FMA__)
            CHECK(spr__quality(&s, x[i][0], x[i][1], x[i][2], p) == value);
#endif
            CHECK(fabs(value - q[0][i]) < 1e-12 && fabs(value - q[1][i]) < 1e-12);
        }
#if !defined(__FMA__)
        CHECK(found[0] == found[1] && !memcmp(q[0], q[1], sizeof q[0]));
        CHECK(!memcmp(g[0], g[1], sizeof g[0]));
        for (i = 0; i < n; i += 4)
            CHECK(!memcmp(&cone[0].f[i / 4], &cone[1].f[i / 4], sizeof cone[0].f[0]));
#endif
    }
}

static void test_statistics_by_vectors_and_the_plain_way_agree(void)
{
    static double x[4][4][4];
    int round, i, k;
    for (round = 0; round < 3000; round++) {
        spr__four four[2];
        double range[2] = {1, 0};
        memset(four, 0, sizeof four);
        for (k = 0; k < 4; k++)
            for (i = 0; i < 4; i++) {
                random_vertex(x[k][i], round % 5 == 0 && k == 0);
                four[0].corner[k][i] = four[1].corner[k][i] = x[k][i];
            }
        if (round % 7 == 0) memcpy(x[1][1], x[1][0], sizeof x[1][0]);
        spr__four_set(&four[0]);
#if defined(SPR__TARGET)
        if (SPR__AVX2) spr__four_set_avx2(&four[1]);
        else
#endif
            spr__four_set(&four[1]);
        for (k = 0; k < 4; k++) {
            const double **p = four[1].corner[k];
            CHECK(fabs(four[1].gamma[k] - spr_gamma(p[0], p[1], p[2], p[3])) < 1e-12);
            CHECK(fabs(four[1].sicn[k] - spr_sicn(p[0], p[1], p[2], p[3])) < 1e-12);
            for (i = 0; i < 6; i++) {
                range[0] = fmin(range[0], four[1].cosine[i][k]);
                range[1] = fmax(range[1], (double)four[1].tenth[i][k]);
            }
        }
        CHECK(range[0] > -1 - 1e-12 && range[1] <= 17);
#if !defined(__FMA__)
        CHECK(!memcmp(&four[0], &four[1], sizeof four[0]));
#endif
    }
}

static void test_same_bytes_for_any_number_of_threads(void)
{
    static const int threads[] = {1, 2, 3, 7};
    delaunay_mesh m[4];
    spr_report r;
    uint64_t seed = small_state;
    int k;
    for (k = 0; k < 4; k++) {
        spr_options o = open_options();
        small_state = seed;
        o.host.num_threads = threads[k];
        o.host.clock = check_hasty_clock;
        CHECK(random_mesh(&m[k], 250, 0, NULL));
        color_mesh(&m[k], 2);
        improve_and_check(&m[k], &o, &r, SPR_OK);
        CHECK(m[k].num_tets == m[0].num_tets && m[k].num_vertices == m[0].num_vertices);
        if (m[k].num_tets != m[0].num_tets || m[k].num_vertices != m[0].num_vertices) continue;
        CHECK(!memcmp(m[k].tets, m[0].tets, m[0].num_tets * sizeof *m[0].tets));
        CHECK(!memcmp(m[k].color, m[0].color, m[0].num_tets * sizeof *m[0].color));
        CHECK(!memcmp(m[k].vertices, m[0].vertices, m[0].num_vertices * sizeof *m[0].vertices));
    }
    for (k = 0; k < 4; k++) delaunay_mesh_free(&m[k]);
}

static void part_with_24_bad_ones(spr__patch *p)
{
    memset(p, 0, sizeof *p);
    p->num_bad = p->was_bad = 24;
    p->may_add = 2;
    p->weight = 100;
    p->before = p->least = 0.1;
    p->all_least = 0.08;
}

/* What is found for a part of a mesh with 24 bad ones: fewer, lighter, a better worst; two more
 * only for a worst that is much better; never a worst that is below the least of the part, or of
 * the mesh if the bad ones weigh less. Around the few worst of the mesh there may be six more that
 * weigh less in all. */
static void test_what_a_part_of_a_mesh_is_replaced_by(void)
{
    static spr__patch p;
    spr__burden as_before = {24, 100}, fewer = {23, 101}, lighter = {24, 96}, more = {26, 110},
                too_many = {27, 90}, far_too_many = {33, 90};
    part_with_24_bad_ones(&p);
    p.worst = 0.105;
    CHECK(!spr__patch_is_better(&p, as_before, 0.1));
    CHECK(spr__patch_is_better(&p, as_before, 0.11));
    CHECK(spr__patch_is_better(&p, fewer, 0.1));
    CHECK(spr__patch_is_better(&p, lighter, 0.1));
    CHECK(!spr__patch_is_better(&p, fewer, 0.099));
    CHECK(spr__patch_is_better(&p, lighter, 0.09));
    CHECK(!spr__patch_is_better(&p, lighter, 0.07));
    CHECK(!spr__patch_is_better(&p, more, 0.11));
    CHECK(spr__patch_is_better(&p, more, 0.12));
    CHECK(!spr__patch_is_better(&p, too_many, 0.3));
    p.few = 1;
    CHECK(spr__patch_is_better(&p, too_many, 0.3));
    CHECK(!spr__patch_is_better(&p, too_many, 0.1));
    CHECK(!spr__patch_is_better(&p, far_too_many, 0.3));
    CHECK(!spr__patch_is_better(&p, more, 0.099));
}

/* The same for its angles: all in all less extreme, by the measure that it is about no worse, by
 * the others not beyond what each may fall to. At the worst of the mesh that one alone, even if the
 * bad ones weigh a little more when it is much better. */
static void test_what_a_part_with_extreme_angles_is_replaced_by(void)
{
    static const double same[3] = {0.3, 0.3, 0.3}, rounder[3] = {0.3, 0.4, 0.3},
                        worse[3] = {0.4, 0.29, 0.4}, other[3] = {0.2, 0.31, 0.3},
                        beyond[3] = {0.1, 0.5, 0.3};
    static spr__patch p;
    spr__burden as_before = {24, 100}, heavier = {24, 104}, much_heavier = {24, 106},
                more = {26, 99}, many = {32, 99};
    part_with_24_bad_ones(&p);
    p.rounding = p.kind = 1;
    p.lack = 10;
    memcpy(p.extreme, same, sizeof same);
    memcpy(p.may_be, same, sizeof same);
    p.may_be[0] = 0.15;
    CHECK(!spr__patch_is_rounder(&p, as_before, 0.1, same, 9.9));
    CHECK(spr__patch_is_rounder(&p, as_before, 0.1, same, 9));
    CHECK(!spr__patch_is_rounder(&p, more, 0.3, same, 9));
    CHECK(spr__patch_is_rounder(&p, more, 0.1, rounder, 9));
    CHECK(!spr__patch_is_rounder(&p, more, 0.1, worse, 9));
    CHECK(!spr__patch_is_rounder(&p, as_before, 0.09, rounder, 9));
    CHECK(spr__patch_is_rounder(&p, as_before, 0.1, other, 9));
    CHECK(!spr__patch_is_rounder(&p, as_before, 0.1, beyond, 9));
    CHECK(!spr__patch_is_rounder(&p, as_before, 0.1, rounder, 10));
    CHECK(!spr__patch_is_rounder(&p, many, 0.1, rounder, 9));
    p.few = 1;
    CHECK(spr__patch_is_rounder(&p, heavier, 0.09, rounder, 10));
    CHECK(!spr__patch_is_rounder(&p, heavier, 0.07, rounder, 10));
    CHECK(!spr__patch_is_rounder(&p, heavier, 0.1, other, 10));
    CHECK(!spr__patch_is_rounder(&p, much_heavier, 0.1, rounder, 10));
    CHECK(spr__patch_is_rounder(&p, many, 0.1, rounder, 10));
}

/* An attempt about one measure does not see the others, and what is no better than the worst of
 * the part only as a little better than the angle that it is about. By vectors and the plain way.
 */
static void test_a_focus_hides_other_measures(void)
{
    static const double a[4] = {0, 0, 0, 0}, b[4] = {1, 0, 0, 0}, c[4] = {0.5, 0.9, 0, 0},
                        d[4] = {0.5, 0.3, 0.01, 0};
    static spr__patch p;
    static spr__cone cone;
    double e[3], q[4];
    spr__state s;
    int k;
    memset(&p, 0, sizeof p);
    memset(&s, 0, sizeof s);
    spr__extremes(a, b, c, d, e);
    CHECK(e[0] < 0.2 && e[1] < 0.2 && spr_gamma(a, b, c, d) < 0.1);
    p.rounding = 1;
    p.before = 0.5 * spr_gamma(a, b, c, d);
    for (k = 0; k < 3; k++) {
        p.extreme[k] = k == 2 ? 0.5 : 1e-3;
        p.kind = k;
        p.focused = 0;
        spr__patch_focus(&p, 0.35, &s.focus);
        CHECK(spr__measure_all(&s.focus, a, b, c, d) <= 0.35 * spr__min(e[0], e[1]));
        p.focused = 1;
        spr__patch_focus(&p, 0.35, &s.focus);
        CHECK((s.focus.lift > 0) == (k == 2));
        CHECK(spr__measure_all(&s.focus, a, b, c, d) ==
              spr__min(0.35 * e[k], spr__max(s.focus.lift, spr_gamma(a, b, c, d))));
        s.rounding = 1;
        s.quality = spr__measure_all;
        s.quality_user = &s.focus;
        s.target = 0.35;
        s.simd = SPR__AVX2;
        cone.n = 0;
        spr__cone_add(&cone, a, b, c);
        spr__cone_close(&s, &cone);
        spr__cone_four(&s, &cone, 0, d, q);
        CHECK(fabs(q[0] - spr__measure_all(&s.focus, a, b, c, d)) < 1e-12);
        CHECK(fabs(q[0] - spr__quality(&s, a, b, c, d)) < 1e-12);
    }
}

/* A new vertex nearer to a corner than half the shortest edge is tolerated in flat places only. */
static void test_room_for_a_new_vertex(void)
{
    static const double a[4] = {0, 0, 0, 0}, b[4] = {1, 0, 0, 0}, c[4] = {0, 1, 0, 0},
                        d[4] = {0, 0, 1, 0}, p[4] = {0.2, 0.2, 0.2, 0};
    static spr__cone cone;
    spr__state s;
    memset(&s, 0, sizeof s);
    spr__cone_add(&cone, a, c, b);
    spr__cone_add(&cone, b, c, d);
    spr__cone_close(&s, &cone);
    CHECK(!spr__pit_is_roomy(&cone, p, SPR__ROOM) && spr__pit_is_roomy(&cone, p, SPR__ROOM_FLAT));
}

/* The first few parts are tried anyway, and leave half of the plans to others; then there are as
 * many as what is left is enough for. */
static void test_shaking_keeps_within_its_plans(void)
{
    spr_report r;
    spr__state s;
    memset(&r, 0, sizeof r);
    memset(&s, 0, sizeof s);
    s.report = &r;
    r.before.num_tets = 2000;
    s.effort = 1;
    s.shake_credit = 1000;
    CHECK(spr__max_patches(&s, 0, 0) == SPR__SHAKE_FEW);
    CHECK(spr__max_patches(&s, 4, 4 * 499) == 3);
    CHECK(spr__max_patches(&s, 4, 40) == SPR__PATCHES);
    s.shake_credit = -7;
    CHECK(spr__max_patches(&s, 4, 40) == 1);
    spr__spare_credit(&s);
    CHECK(s.shake_credit == 2500);
}

/* The first stay in front; the others by the bad ones around, which are counted up to a limit. */
static void test_parts_with_few_bad_ones_are_shaken_first(void)
{
    static delaunay_tet tets[6];
    delaunay_mesh mesh;
    delaunay_memory memory;
    delaunay_host host;
    spr__state s;
    uint32_t around[6] = {0, 2, 100, 1000, 2, 7};
    int i, k;
    memset(&mesh, 0, sizeof mesh);
    memset(&host, 0, sizeof host);
    memset(&s, 0, sizeof s);
    CHECK(delaunay_memory_init(&memory, &host) == DELAUNAY_OK);
    mesh.tets = tets;
    s.mesh = &mesh;
    s.memory = s.items.memory = &memory;
    for (i = 1; i < 6; i++)
        for (k = 0; k < 4; k++) tets[i].v[k] = (uint32_t)i;
    for (i = 5; i > 0; i--) CHECK(delaunay_list_push(&s.items, (delaunay_handle)i) == DELAUNAY_OK);
    CHECK(spr__sort_by_crowd(&s, around, 1));
    CHECK(s.items.items[0] == 5 && s.items.items[1] == 4 && s.items.items[2] == 1);
    CHECK(s.items.items[3] == 3 && s.items.items[4] == 2);
    delaunay_list_free(&s.items);
}

/* Twice the Delaunay mesh of a shaken lattice, one region. */
static void make_lattices(int side, delaunay_mesh *m)
{
    size_t points = (size_t)side * (size_t)side * (size_t)side;
    double *xyz = (double *)malloc(3 * points * sizeof *xyz);
    int k;
    shaken_lattice(side, xyz);
    memset(m, 0, 2 * sizeof *m);
    for (k = 0; k < 2; k++) {
        CHECK(delaunay_tetrahedralize(&m[k], xyz, points, NULL, NULL) == DELAUNAY_OK);
        CHECK(delaunay_enable_marks(&m[k]) == DELAUNAY_OK);
        color_mesh(&m[k], 1);
    }
    free(xyz);
}

/* All of a mesh as one patch. */
static void patch_of_mesh(spr__patch *p, const delaunay_mesh *m)
{
    delaunay_handle t;
    uint32_t v;
    int k;
    memset(p, 0, sizeof *p);
    for (v = 1; v < m->num_vertices; v++) p->v[p->num_vertices++] = v;
    for (t = 1; t < m->num_tets; t++) {
        if (!is_real(m, t)) continue;
        for (k = 0; k < 4; k++) p->tets[p->num_tets][k] = m->tets[t].v[k] - 1;
        p->t[p->num_tets++] = t;
    }
}

static uint64_t num_marks(const delaunay_mesh *m)
{
    uint64_t num = 0;
    delaunay_handle t;
    int k;
    for (t = 1; t < m->num_tets; t++)
        for (k = 0; k < 4 && is_real(m, t); k++)
            num += (m->flags[t] & DELAUNAY_FACET_BIT(k)) != 0;
    return num;
}

/* A new vertex comes into a bad tetrahedron, and that stays valid with all its marks; into one that
 * is flat but for rounding none does. */
static void test_a_vertex_is_sown_in_a_bad_tetrahedron(void)
{
    static spr__patch p;
    delaunay_mesh m[2], own;
    delaunay_host host;
    delaunay_worker *worker;
    spr__state s;
    double *value;
    delaunay_handle t;
    size_t bad;
    int seed, k;
    memset(&host, 0, sizeof host);
    make_lattices(4, m);
    worker = delaunay_worker_new(&m->memory); /* of another mesh, as improvement lends it */
    patch_of_mesh(&p, m);
    CHECK(p.num_tets <= SPR__PATCH_TETS && p.num_vertices == 64);
    for (t = 1; t < m->num_tets; t++)
        for (k = 0; k < 4; k++)
            if (is_real(m, t) && t % 3 == 0) delaunay_mark_facet(m, 4 * t + (unsigned)k, 1);
    value = (double *)calloc(m->num_tets, sizeof *value);
    memset(&s, 0, sizeof s);
    s.mesh = m;
    s.value = value;
    s.target = 0.5;
    for (seed = 0; seed < 40; seed++) {
        bad = (size_t)seed * 7 % p.num_tets;
        for (t = 1; t < m->num_tets; t++) value[t] = t == p.t[bad] ? 0.1 : 0.9;
        p.was_bad = 1;
        p.seed = (uint32_t)seed;
        memset(&own, 0, sizeof own);
        CHECK(spr__patch_mesh(&s, &p, &host, &own) == DELAUNAY_OK);
        CHECK(num_marks(&own) == num_marks(m));
        if (seed % 2) { /* flat */
            const uint32_t *v = own.tets[bad + 1].v;
            memcpy(own.vertices[v[0]].x, own.vertices[v[1]].x, sizeof own.vertices[0].x);
        }
        CHECK(spr__patch_sow(&s, &p, &own, worker));
        CHECK(own.num_vertices == (seed % 2 ? 65 : 66));
        CHECK(own.num_tets - 1 == p.num_tets + (seed % 2 ? 0 : 3));
        CHECK(num_marks(&own) == num_marks(m));
        if (seed % 2 == 0) {
            CHECK(delaunay_local_index(&own.tets[bad + 1], 65) >= 0);
            CHECK(delaunay_validate(&own, DELAUNAY_VALIDATE_GEOMETRY, NULL) == DELAUNAY_OK);
        }
        delaunay_mesh_free(&own);
    }
    free(value);
    delaunay_worker_free(worker);
    delaunay_mesh_free(&m[0]);
    delaunay_mesh_free(&m[1]);
}

/* The bound of a facet is one of the quality that is asked for, with AVX2 or without. */
static double cube_of_gamma(void *user, const double *a, const double *b, const double *c,
                            const double *d)
{
    double gamma = spr_gamma(a, b, c, d);
    (void)user;
    return gamma * gamma * gamma;
}

static void test_bounds_are_of_the_callers_quality(void)
{
    static const double flat[3][3] = {{0, 0, 0}, {1, 0, 0}, {0.4, 0.1, 0}};
    double bound[2], gamma = spr_gamma_bound(flat[0], flat[1], flat[2]);
    spr__state s;
    spr__facet f;
    int simd;
    memset(&s, 0, sizeof s);
    s.quality = cube_of_gamma;
    spr__facet_set(&f, flat[0], flat[1], flat[2]);
    for (simd = 0; simd < 2; simd++) {
        s.simd = simd && SPR__AVX2;
        bound[simd] = spr__facet_bound(&s, &f, NULL, NULL, HUGE_VAL);
        CHECK(fabs(bound[simd] - gamma * gamma * gamma) < 0.01 * bound[simd]);
    }
    CHECK(bound[0] == bound[1]);
}

/* No apex within planes that lean over a facet is better than the bound, also if the search begins
 * at a corner of the wedge, as at apices of tetrahedra. */
static void test_bounds_within_leaning_planes(void)
{
    static const double corner[3][3] = {{0, 0, 0}, {1, 0, 0}, {0.5, 0.9, 0}};
    int trial, k, i;
    for (trial = 0; trial < 60; trial++) {
        spr__state s;
        spr__facet f;
        spr__wedge w;
        double here[3], p[3], least = 2, bound, best = 0;
        memset(&s, 0, sizeof s);
        s.gamma = 1;
        spr__facet_set(&f, corner[0], corner[1], corner[2]);
        w.rough = 0;
        for (w.n = 0; w.n < 1 + trial % 3; w.n++) {
            const double *a = corner[w.n], *b = corner[(w.n + 1) % 3];
            const double lean = 2 * random_double();
            memcpy(w.point[w.n], a, sizeof w.point[0]);
            w.normal[w.n][0] = -(b[1] - a[1]);
            w.normal[w.n][1] = b[0] - a[0];
            w.normal[w.n][2] = -lean * sqrt((b[0] - a[0]) * (b[0] - a[0]) +
                                            (b[1] - a[1]) * (b[1] - a[1]));
        }
        here[0] = 0.5, here[1] = 0.3; /* as high as the planes allow */
        for (i = 0; i < w.n; i++) {
            const double depth = (here[0] - w.point[i][0]) * w.normal[i][0] +
                                 (here[1] - w.point[i][1]) * w.normal[i][1];
            least = fmin(least, depth / fmax(1e-9, -w.normal[i][2]));
        }
        here[2] = 0.999 * least;
        bound = spr__facet_bound(&s, &f, &w, here, HUGE_VAL);
        for (k = 0; k < 20000; k++) {
            p[0] = 2 * random_double() - 0.5, p[1] = 2 * random_double() - 0.5;
            p[2] = 1.5 * random_double();
            for (i = 0; i < w.n; i++)
                if ((p[0] - w.point[i][0]) * w.normal[i][0] +
                        (p[1] - w.point[i][1]) * w.normal[i][1] + p[2] * w.normal[i][2] < 0)
                    break;
            if (i == w.n) best = fmax(best, spr_gamma(corner[0], corner[1], corner[2], p));
        }
        CHECK(best <= 1.002 * bound && bound < 1.5 * best);
    }
}

/* The removal of a vertex with many neighbours is searched for as long as there is credit; a search
 * in vain is paid for, and when no credit is left, that is known. */
static void test_large_refills_end_with_their_credit(void)
{
    enum { AROUND = 24 };
    double xyz[3 * (AROUND + 1)] = {0};
    delaunay_mesh m;
    delaunay_list star;
    spr__state s;
    int i, credit;
    for (i = 0; i < AROUND; i++) {
        double z = (2 * i + 1) / (double)AROUND - 1, angle = 2.399963229728653 * i;
        xyz[3 * i] = sqrt(1 - z * z) * cos(angle);
        xyz[3 * i + 1] = sqrt(1 - z * z) * sin(angle);
        xyz[3 * i + 2] = z;
    }
    xyz[3 * AROUND] = 0.3; /* the vertex: in each tetrahedron */
    memset(&m, 0, sizeof m);
    CHECK(delaunay_tetrahedralize(&m, xyz, AROUND + 1, NULL, NULL) == DELAUNAY_OK);
    CHECK(delaunay_link_vertices(&m) == DELAUNAY_OK);
    memset(&star, 0, sizeof star);
    star.memory = &m.memory;
    memset(&s, 0, sizeof s);
    s.mesh = &m;
    s.memory = &m.memory;
    s.gamma = 1;
    s.target = 0.99; /* beyond reach */
    s.value = (double *)calloc(m.num_tets, sizeof *s.value);
    for (i = 1; i < (int)m.num_tets; i++)
        if (is_real(&m, (delaunay_handle)i)) {
            s.value[i] = 0.95; /* so that no search succeeds */
            CHECK(delaunay_list_push(&star, (delaunay_handle)i) == DELAUNAY_OK);
        }
    for (credit = 1; credit >= 0; credit--) {
        delaunay_worker *worker = delaunay_worker_new(&m.memory);
        delaunay_plan *plan = (delaunay_plan *)delaunay_alloc(&m.memory, 1, sizeof *plan);
        memset(plan, 0, sizeof *plan);
        plan->star = star;
        s.refill_credit = credit;
        s.credit_ended = 0;
        CHECK(spr__plan_refill(&s, worker, m.vertex_of[AROUND], plan) == DELAUNAY_PLAN_NOTHING);
        CHECK((plan->data[SPR__COST] > 0) == credit);
        spr__charge_refill(&s, plan);
        CHECK(s.credit_ended && s.refill_credit <= 0);
        delaunay_release(&m.memory, plan);
        delaunay_worker_free(worker);
    }
    free(s.value);
    delaunay_list_free(&star);
    delaunay_mesh_free(&m);
}

/* Walls one tetrahedron thick, of shaken squares: all that is bad can be good without new vertices,
 * which are few then. */
static void test_walls_need_few_vertices(void)
{
    enum { SIDE = 14, WALLS = 10 };
    uint64_t added = 0;
    int k, i, j, layer;
    for (k = 0; k < WALLS; k++) {
        double xyz[2 * SIDE * SIDE][3];
        size_t n = 0;
        spr_options o = open_options();
        delaunay_mesh m;
        spr_report r;
        for (layer = 0; layer < 2; layer++)
            for (i = 0; i < SIDE; i++)
                for (j = 0; j < SIDE; j++, n++) {
                    int inner = i > 0 && j > 0 && i < SIDE - 1 && j < SIDE - 1;
                    xyz[n][0] = (i + (inner ? 0.0002 * (small_random(1001) - 500.0) : 0)) / 16;
                    xyz[n][1] = (j + (inner ? 0.0002 * (small_random(1001) - 500.0) : 0)) / 16;
                    xyz[n][2] = 1.25 / 16 * layer;
                }
        memset(&m, 0, sizeof m);
        CHECK(delaunay_tetrahedralize(&m, xyz[0], n, NULL, NULL) == DELAUNAY_OK);
        CHECK(delaunay_enable_marks(&m) == DELAUNAY_OK);
        CHECK(delaunay_link_vertices(&m) == DELAUNAY_OK);
        color_mesh(&m, 1);
        improve_and_check(&m, &o, &r, SPR_OK);
        CHECK(r.before.num_below > 50 && r.after.num_below == 0);
        added += r.vertices_inserted;
        delaunay_mesh_free(&m);
    }
    CHECK(added < 3 * WALLS);
}

static void check_same_and_free(delaunay_mesh *m)
{
    CHECK(m[1].num_tets == m[0].num_tets && m[1].num_vertices == m[0].num_vertices);
    CHECK(!memcmp(m[1].tets, m[0].tets, m[0].num_tets * sizeof *m[0].tets));
    CHECK(!memcmp(m[1].vertices, m[0].vertices, m[0].num_vertices * sizeof *m[0].vertices));
    delaunay_mesh_free(&m[0]);
    delaunay_mesh_free(&m[1]);
}

/* Points of a lattice, shaken: enough of them for several blocks of the relaxing sweep, in which
 * those between the blocks wait. By gamma, parts with extreme angles are shaken before it. */
static void test_relaxes_a_lattice(void)
{
    enum { SIDE = 19, POINTS = SIDE * SIDE * SIDE };
    static const int threads[] = {1, 4};
    static const spr_measure measures[] = {SPR_GAMMA, SPR_SICN};
    static const double gain[] = {0.008, 0.015};
    delaunay_mesh m[2];
    spr_report r;
    int k, j;
    for (j = 0; j < 2; j++) {
        make_lattices(SIDE, m);
        for (k = 0; k < 2; k++) {
            spr_options o = open_options();
            o.no_edge_removal = o.no_reconnection = o.keep_vertices = 1;
            o.measure = measures[j];
            o.target = 0.001; /* none is bad */
            o.host.num_threads = threads[k];
            improve_and_check(&m[k], &o, &r, SPR_OK);
            CHECK(r.relaxed > POINTS / 5 && r.after.mean > r.before.mean + gain[j]);
            CHECK(r.after.num_below <= r.before.num_below && (j == 0 || r.shaken == 0));
        }
        check_same_and_free(m);
    }
}

/* Where nothing is bad any more, the worst few are raised beyond the target, but not if it is the
 * caller's. */
static void test_raises_the_worst_where_none_is_bad(void)
{
    int trial, raised = 0;
    for (trial = 0; trial < 6; trial++) {
        delaunay_mesh m[2];
        spr_report r[2];
        int k;
        make_lattices(9, m);
        for (k = 0; k < 2; k++) {
            spr_options o = open_options();
            o.target = k ? 0.35 : 0;
            improve_and_check(&m[k], &o, &r[k], SPR_OK);
            CHECK(r[k].before.num_below > 0 && r[k].after.num_below == 0 && r[k].num_worst == 0);
            delaunay_mesh_free(&m[k]);
        }
        raised += r[0].after.min > r[1].after.min + 0.004;
    }
    CHECK(raised >= 4);
}

/* An octahedron about a vertex, all of it good: on average it can be better only at the price of
 * the worst, which must not fall. */
static void test_relaxing_spares_the_worst(void)
{
    static const uint32_t facets[8][3] = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                          {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    int round, i, k, moved = 0;
    for (round = 0; round < 300; round++) {
        double xyz[21] = {1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0};
        uint32_t tets[8][4];
        size_t nv = 7, nt = 8;
        spr_options o;
        spr_report r;
        memset(&o, 0, sizeof o);
        o.measure = SPR_SICN;
        o.target = 0.35; /* the worst is not raised before */
        for (i = 0; i < 21; i++) xyz[i] += 0.24 * (random_double() - 0.5);
        for (i = 0; i < 8; i++) {
            for (k = 0; k < 3; k++) tets[i][k] = facets[i][k];
            tets[i][3] = 6;
        }
        CHECK(spr_improve_arrays(xyz, &nv, nv, tets[0], NULL, &nt, nt, NULL, &o, &r) == SPR_OK);
        CHECK(r.after.min >= r.before.min - 1e-9);
        moved += r.relaxed > 0;
    }
    CHECK(moved > 10);
}

/* The same, flips for the mean alone: nothing becomes worse, and there are fewer tetrahedra. */
static void test_flips_for_the_mean(void)
{
    enum { SIDE = 11, POINTS = SIDE * SIDE * SIDE };
    static const int threads[] = {1, 3};
    delaunay_mesh m[2];
    spr_report r;
    int k;
    make_lattices(SIDE, m);
    for (k = 0; k < 2; k++) {
        spr_options o = open_options();
        o.no_smoothing = o.no_reconnection = o.keep_vertices = 1;
        o.target = 0.01;
        o.host.num_threads = threads[k];
        improve_and_check(&m[k], &o, &r, SPR_OK);
        CHECK(r.flipped > POINTS / 5 && r.relaxed == 0);
        CHECK(r.after.mean > r.before.mean + 0.01 && r.after.num_tets < r.before.num_tets);
        CHECK(r.after.min >= r.before.min && r.after.num_below <= r.before.num_below);
        CHECK(r.after.dihedral_max_degrees <= r.before.dihedral_max_degrees + 1e-9);
    }
    check_same_and_free(m);
}

/* A cylinder of many sides, all of it around one vertex, whose star is larger than any that is made
 * anew. All are bad: four for each side, three without the vertex. Away from the middle these are
 * better; in the middle they are worse, but not as bad as another tetrahedron far away. */
static void test_a_hub_goes(void)
{
    enum { SIDES = 120, HUB = 2 * SIDES + 2, POINTS = HUB + 5, TETS = 4 * SIDES + 1 };
    static const double far_away[12] = {9, 0, 0, 8, 0, 0, 9, 1, 0, 8, 1, 0.01};
    double *xyz = (double *)malloc(3 * POINTS * sizeof *xyz);
    uint32_t (*tets)[4] = (uint32_t (*)[4])malloc(TETS * sizeof *tets), side, k;
    int round;
    for (round = 0; round < 4; round++) {
        const int middle = round % 2;
        size_t nv = POINTS, nt = TETS;
        spr_report r;
        spr_options o = open_options();
        o.host.num_threads = 1 + round / 2 * 2;
        memset(xyz, 0, 3 * POINTS * sizeof *xyz);
        xyz[3 * (2 * SIDES + 1) + 2] = 0.9;
        xyz[3 * HUB] = middle ? 0 : 0.6;
        xyz[3 * HUB + 2] = 0.45;
        memcpy(xyz + 3 * (HUB + 1), far_away, sizeof far_away);
        for (side = 0; side < SIDES; side++) {
            double angle = 6.283185307179586 * side / (double)SIDES;
            uint32_t a = side, b = (side + 1) % SIDES, up = SIDES;
            uint32_t of[4][3] = {{a, 2 * SIDES, b}, {a + up, b + up, 2 * SIDES + 1}, {a, b, b + up},
                                 {a, b + up, a + up}};
            for (k = 0; k < 2; k++) {
                xyz[3 * (side + k * up)] = cos(angle);
                xyz[3 * (side + k * up) + 1] = sin(angle);
                xyz[3 * (side + k * up) + 2] = 0.9 * k;
            }
            for (k = 0; k < 4; k++) {
                memcpy(tets[4 * side + k], of[k], sizeof of[k]);
                tets[4 * side + k][3] = HUB;
            }
        }
        for (k = 0; k < 4; k++) tets[TETS - 1][k] = HUB + 1 + k;
        CHECK(spr_improve_arrays(xyz, &nv, nv, tets[0], NULL, &nt, nt, NULL, &o, &r) >= 0);
        CHECK(r.before.num_below == TETS && r.before.p01 > 5 * r.before.min);
        CHECK(r.vertices_removed == 1 && nt == 3 * SIDES + 1 && r.after.num_below == nt);
        CHECK(r.after.min >= r.before.min);
        CHECK(middle ? r.after.p01 < 0.9 * r.before.p01 : r.after.p01 > 1.2 * r.before.p01);
    }
    free(xyz);
    free(tets);
}

/* A V of two arms, 14 vertices, cut so that one tetrahedron between better ones is flat but for
 * rounding: all vertices are fixed, one has to be added before it can go, and that makes more bad
 * ones. */
static void test_a_flat_one_among_good_ones(void)
{
    static const double profile[7][2] = {{-5, 0},  {5, 0},   {19, 20}, {9, 20}, {0, 50.0 / 7},
                                         {-9, 20}, {-19, 20}};
    static const uint32_t cut[16][4] = {
        {8, 6, 0, 7},   {8, 6, 7, 13}, {11, 6, 13, 12}, {11, 6, 12, 5},
        {11, 8, 13, 6}, {11, 8, 6, 0}, {4, 11, 5, 6},   {1, 10, 2, 3},
        {1, 9, 2, 10},  {1, 8, 9, 10}, {1, 11, 0, 8},   {1, 11, 6, 0},
        {1, 11, 10, 3}, {1, 11, 8, 10}, {1, 4, 6, 11},  {1, 4, 11, 3}};
    double xyz[30][3];
    uint32_t tets[60][4];
    size_t nv = 14, nt = 16, i;
    spr_options o = open_options();
    spr_report r;
    o.free_vertices = 0;
    for (i = 0; i < nv; i++) {
        memcpy(xyz[i], profile[i % 7], sizeof profile[0]);
        xyz[i][2] = i < 7 ? 0 : 15;
    }
    memcpy(tets, cut, sizeof cut);
    CHECK(spr_improve_arrays(xyz[0], &nv, 30, tets[0], NULL, &nt, 60, NULL, &o, &r) == SPR_OK);
    CHECK(r.before.gamma_min < 1e-6 && r.after.gamma_min > 0.05);
    CHECK(r.before.dihedral_max_degrees > 179.9 && r.after.dihedral_max_degrees < 170);
    CHECK(nv > 14 && r.after.num_below <= r.before.num_below + 16);
    nv = 14;
    nt = 16;
    memcpy(tets, cut, sizeof cut); /* without room for a vertex it stays */
    CHECK(spr_improve_arrays(xyz[0], &nv, 14, tets[0], NULL, &nt, 60, NULL, &o, &r) == SPR_OK);
    CHECK(nv == 14 && r.vertices_inserted == 0 && r.after.gamma_min >= r.before.gamma_min);
}

/* A cell of a foam, whose polygons are plane but for rounding: flat tetrahedra lie over some of
 * them in a heap, and go only together. */
static void test_flat_ones_over_bent_polygons(void)
{
    static const double corners[12][3] = {
        {0, 0.25072647094943601, 0.24432190731852127},
        {0, 0.2420452558731534, 0.2528393446057286},
        {0.16599083942958551, 0.24802909252315275, 0.24968359407975971},
        {0, 0.24822396684887293, 0.50650626261751142},
        {0.0069968114939940058, 0.24848182568248053, 0.50660435663108416},
        {0.24434561684574496, 0.25095497052154175, 0.25235080801596449},
        {0.24390497585214968, 0.2569740064941522, 0.50012279607916688},
        {0, 0.24851281563198663, 0.50678753488377259},
        {0, 0.4971719132193641, 0.25231940205883191},
        {0.24395746876354552, 0.49595666657416348, 0.26028870890263189},
        {0.24355034520431917, 0.49708317940060975, 0.49310495905087492},
        {0, 0.49836558877253845, 0.49947520599658568}};
    static const uint32_t cut[18][4] = {
        {8, 3, 1, 4}, {8, 7, 3, 4}, {8, 11, 7, 4}, {6, 11, 4, 7}, {2, 3, 4, 1},
        {2, 8, 1, 4}, {2, 8, 0, 1}, {2, 8, 4, 11}, {2, 9, 0, 8}, {2, 10, 8, 11},
        {2, 10, 9, 8}, {2, 6, 4, 3}, {2, 6, 11, 4}, {2, 6, 10, 11}, {5, 2, 3, 6},
        {5, 2, 9, 0}, {5, 2, 10, 9}, {5, 2, 6, 10}};
    double xyz[30][3];
    uint32_t tets[80][4];
    size_t nv = 12, nt = 18;
    spr_options o = open_options();
    spr_report r;
    o.free_vertices = 0;
    memcpy(xyz, corners, sizeof corners);
    memcpy(tets, cut, sizeof cut);
    CHECK(spr_improve_arrays(xyz[0], &nv, 30, tets[0], NULL, &nt, 80, NULL, &o, &r) == SPR_OK);
    CHECK(r.before.gamma_min < 1e-12 && r.before.dihedral_max_degrees > 179.9999);
    CHECK(r.after.gamma_min > 1e-3 && r.after.dihedral_max_degrees < 179.9);
    CHECK(memcmp(xyz, corners, sizeof corners) == 0);
}

/* Points of a cube pressed flat: hardly a tetrahedron can be good, long searches meet their limits.
 */
static void test_where_hardly_anything_can_be_good(void)
{
    static const int threads[] = {1, 3};
    delaunay_mesh m[2];
    spr_report r;
    uint64_t seed = small_state;
    uint32_t v;
    int k;
    for (k = 0; k < 2; k++) {
        spr_options o = open_options();
        small_state = seed;
        o.host.num_threads = threads[k];
        o.host.clock = check_hasty_clock;
        CHECK(random_mesh(&m[k], 100, 0, NULL));
        color_mesh(&m[k], 2);
        for (v = 1; v < m[k].num_vertices; v++) m[k].vertices[v].x[2] *= 0.0625;
        improve_and_check(&m[k], &o, &r, SPR_OK);
        CHECK(10 * r.after.num_below < 9 * r.before.num_below &&
              r.after.mean > 1.1 * r.before.mean);
        CHECK(r.vertices_inserted <= r.before.num_tets / 50 + 6 &&
              r.stuck + r.fixed + r.bounded + r.unfinished == r.after.num_below);
    }
    CHECK(m[1].num_vertices == m[0].num_vertices && m[1].num_tets == m[0].num_tets &&
          !memcmp(m[1].tets, m[0].tets, m[0].num_tets * sizeof *m[0].tets));
    for (k = 0; k < 2; k++) { /* what is improved already does not become worse */
        spr_options o = open_options();
        improve_and_check(&m[0], &o, &r, SPR_OK);
        CHECK(r.after.num_below > 0);
    }
    for (k = 0; k < 2; k++) delaunay_mesh_free(&m[k]);
    small_state = seed;
}

/* ---- arrays -------------------------------------------------------------------------------- */

typedef struct soup {
    double   *xyz;
    uint32_t *tets, *colors;
    size_t    nv, nt, cap_v, cap_t;
} soup;

/* A mesh as arrays, with room; turned: all of them negative. */
static soup make_soup(uint32_t n, int turned)
{
    delaunay_mesh m;
    soup s;
    size_t i;
    CHECK(random_mesh(&m, n, 0, NULL));
    s.nv = n;
    s.nt = (size_t)delaunay_count_tets(&m);
    s.cap_v = 2 * s.nv;
    s.cap_t = 2 * s.nt;
    s.xyz = (double *)malloc(3 * s.cap_v * sizeof *s.xyz);
    s.tets = (uint32_t *)malloc(4 * s.cap_t * sizeof *s.tets);
    s.colors = (uint32_t *)malloc(s.cap_t * sizeof *s.colors);
    for (i = 0; i < n; i++) memcpy(s.xyz + 3 * i, m.vertices[m.vertex_of[i]].x, 3 * sizeof *s.xyz);
    delaunay_export_tets(&m, s.tets, s.nt);
    for (i = 0; i < s.nt; i++) {
        double x = 0;
        int k;
        for (k = 0; k < 4; k++) x += s.xyz[3 * s.tets[4 * i + (size_t)k]];
        s.colors[i] = x > 2 ? 0 : 7;
        if (turned) {
            uint32_t swap = s.tets[4 * i];
            s.tets[4 * i] = s.tets[4 * i + 1];
            s.tets[4 * i + 1] = swap;
        }
    }
    delaunay_mesh_free(&m);
    return s;
}

static void free_soup(soup *s)
{
    free(s->xyz);
    free(s->tets);
    free(s->colors);
}

static double soup_volume(const soup *s, uint32_t color, double *worst)
{
    double sum = 0;
    size_t i;
    *worst = 1;
    for (i = 0; i < s->nt; i++) {
        const double *a = s->xyz + 3 * s->tets[4 * i], *b = s->xyz + 3 * s->tets[4 * i + 1];
        const double *c = s->xyz + 3 * s->tets[4 * i + 2], *d = s->xyz + 3 * s->tets[4 * i + 3];
        double u[3], v[3], w[3];
        int k;
        *worst = fmin(*worst, (double)delaunay_orient3d(a, b, c, d));
        if (s->colors[i] != color) continue;
        for (k = 0; k < 3; k++) {
            u[k] = b[k] - a[k];
            v[k] = c[k] - a[k];
            w[k] = d[k] - a[k];
        }
        sum += fabs(u[0] * (v[1] * w[2] - v[2] * w[1]) + u[1] * (v[2] * w[0] - v[0] * w[2]) +
                    u[2] * (v[0] * w[1] - v[1] * w[0]));
    }
    return sum;
}

/* Around the origin, corners at distances of 1e-4, 1 and 1e4: qualities are less than their
 * rounding, and of flips that undo each other both may seem to gain. There is an end to it. */
static void test_ends_where_quality_is_less_than_rounding(void)
{
    enum { RINGS = 12, COLUMNS = 24, NUM = (RINGS - 1) * COLUMNS };
    const double far_[3] = {1e-4, 1, 1e4}, pi = acos(-1.0);
    double xyz[3 * (NUM + 3)];
    uint32_t tets[4 * 2 * NUM], round, i, j;
    for (round = 0; round < 3; round++) {
        delaunay_mesh m = {0};
        spr_options options;
        spr_report report;
        uint32_t *t = tets;
        small_state = 5 + round;
        for (i = 0; i < NUM + 2; i++) {
            const double a = i < NUM ? pi * (i / COLUMNS + 1) / RINGS : i == NUM ? 0 : pi;
            const double b = 2 * pi * (i % COLUMNS) / COLUMNS, r = far_[small_random(3)];
            xyz[3 * i] = i < NUM ? r * sin(a) * cos(b) : 0;
            xyz[3 * i + 1] = i < NUM ? r * sin(a) * sin(b) : 0;
            xyz[3 * i + 2] = r * cos(a);
        }
        memset(xyz + 3 * (NUM + 2), 0, 3 * sizeof *xyz);
        for (i = 0; i < 2 * NUM; i++) t[4 * i + 3] = NUM + 2;
        for (i = 0; i < RINGS; i++)
            for (j = 0; j < COLUMNS; j++) {
                const uint32_t k = (j + 1) % COLUMNS, up = i ? (i - 1) * COLUMNS : 0,
                               low = i * COLUMNS;
                if (i + 1 < RINGS) {
                    t[0] = i ? up + k : NUM;
                    t[1] = low + k;
                    t[2] = low + j;
                    t += 4;
                }
                if (i) {
                    t[0] = up + k;
                    t[1] = i + 1 < RINGS ? low + j : NUM + 1;
                    t[2] = up + j;
                    t += 4;
                }
            }
        CHECK(delaunay_import(&m, xyz, NUM + 3, tets, NULL, 2 * NUM, NULL, NULL) == DELAUNAY_OK);
        memset(&options, 0, sizeof options);
        options.max_rounds = 100000;
        CHECK(spr_improve(&m, &options, &report) == SPR_OK);
        CHECK(delaunay_validate(&m, DELAUNAY_VALIDATE_TOPOLOGY, NULL) == DELAUNAY_OK);
        delaunay_mesh_free(&m);
    }
}

static void test_arrays(void)
{
    int turned, room;
    for (turned = 0; turned < 2; turned++)
        for (room = 0; room < 2; room++) {
            soup s = make_soup(200, turned);
            spr_report r;
            spr_options o = open_options();
            uint8_t *fixed = (uint8_t *)calloc(s.nv, 1);
            double v0, v7, sign, *old = (double *)malloc(3 * s.nv * sizeof *old);
            size_t i, nv = s.nv;
            memcpy(old, s.xyz, 3 * nv * sizeof *old);
            for (i = 0; i < nv; i += 3) fixed[i] = 1;
            v0 = soup_volume(&s, 0, &sign);
            v7 = soup_volume(&s, 7, &sign);
            CHECK(sign == (turned ? -1 : 1));
            CHECK(spr_improve_arrays(s.xyz, &s.nv, room ? s.cap_v : s.nv, s.tets, s.colors, &s.nt,
                                     s.cap_t, fixed, &o, &r) == SPR_OK);
            CHECK(fabs(soup_volume(&s, 0, &sign) - v0) < 1e-12);
            CHECK(fabs(soup_volume(&s, 7, &sign) - v7) < 1e-12 && sign == 1);
            CHECK(r.after.num_tets == s.nt && r.after.num_below < r.before.num_below);
            CHECK(room ? s.nv > nv && r.vertices_inserted >= s.nv - nv
                       : s.nv == nv && r.vertices_inserted == 0);
            for (i = 0; i < nv; i += 3) CHECK(!memcmp(old + 3 * i, s.xyz + 3 * i, 3 * sizeof *old));
            free(fixed);
            free(old);
            free_soup(&s);
        }
}

/* Room for fewer new vertices than there are places for: not one more is written. */
static void test_arrays_with_little_room(void)
{
    size_t room, k;
    for (room = 0; room < 6; room++) {
        soup s = make_soup(500, 0);
        spr_report r;
        spr_options o = open_options();
        size_t nv = s.nv;
        o.no_smoothing = o.no_reconnection = 1; /* so that more are inserted, in less time */
        CHECK(s.cap_v > nv + room);
        for (k = 3 * (nv + room); k < 3 * s.cap_v; k++) s.xyz[k] = -77;
        CHECK(spr_improve_arrays(s.xyz, &s.nv, nv + room, s.tets, s.colors, &s.nt, s.cap_t, NULL,
                                 &o, &r) == SPR_OK);
        CHECK(s.nv <= nv + room && r.vertices_inserted <= room);
        for (k = 3 * (nv + room); k < 3 * s.cap_v; k++) CHECK(s.xyz[k] == -77);
        free_soup(&s);
    }
}

/* The number of items of size vertices that no tetrahedron has. */
static size_t soup_lacks(const soup *s, const uint32_t *items, size_t count, size_t size)
{
    size_t k, t, lacking = 0;
    for (k = 0; k < count; k++) {
        for (t = 0; t < s->nt; t++) {
            size_t i, j, has = 0;
            for (i = 0; i < size; i++)
                for (j = 0; j < 4; j++) has += s->tets[4 * t + j] == items[size * k + i];
            if (has == size) break;
        }
        lacking += t == s->nt;
    }
    return lacking;
}

/* Triangles and edges of the caller's stay, with their vertices, in the middle of a region. */
static void test_arrays_with_things_kept(void)
{
    enum { NT = 12, NE = 9 };
    int keep;
    for (keep = 0; keep < 2; keep++) {
        soup s = make_soup(400, 0);
        uint32_t triangles[3 * (NT + 2)], edges[2 * NE];
        spr_report r;
        spr_options o = open_options();
        double *old = (double *)malloc(3 * s.nv * sizeof *old);
        size_t i, j, moved = 0;
        memcpy(old, s.xyz, 3 * s.nv * sizeof *old);
        for (i = 0; i < NT; i++) /* a facet's vertices, in another order each time */
            for (j = 0; j < 3; j++)
                triangles[3 * i + j] = s.tets[4 * (i * 97 % s.nt) + (i + j) % 3];
        for (i = 0; i < NT; i++) CHECK(triangles[3 * i] != triangles[3 * i + 1]);
        for (i = 0; i < NE; i++)
            for (j = 0; j < 2; j++) edges[2 * i + j] = s.tets[4 * (i * 131 % s.nt) + 2 + j];
        for (j = 0; j < 3; j++) triangles[3 * NT + j] = s.tets[j / 2]; /* a vertex twice */
        triangles[3 * NT + 3] = s.tets[0];                            /* no facet */
        triangles[3 * NT + 4] = s.tets[4 * (s.nt / 2)];
        triangles[3 * NT + 5] = s.tets[4 * (s.nt - 1)];
        CHECK(soup_lacks(&s, triangles, NT, 3) == 0 && soup_lacks(&s, edges, NE, 2) == 0 &&
              soup_lacks(&s, triangles + 3 * NT + 3, 1, 3) == 1);
        o.kept_triangles = triangles;
        o.num_kept_triangles = keep ? NT + 2 : 0;
        o.kept_edges = edges;
        o.num_kept_edges = keep ? NE : 0;
        CHECK(spr_improve_arrays(s.xyz, &s.nv, s.cap_v, s.tets, s.colors, &s.nt, s.cap_t, NULL, &o,
                                 &r) == SPR_OK);
        CHECK(r.after.num_below < r.before.num_below && r.absent == (keep ? 2u : 0u));
        for (i = 0; i < 3 * NT; i++)
            moved += memcmp(old + 3 * triangles[i], s.xyz + 3 * triangles[i], 24) != 0;
        for (i = 0; i < 2 * NE; i++)
            moved += memcmp(old + 3 * edges[i], s.xyz + 3 * edges[i], 24) != 0;
        CHECK(keep ? moved == 0 : moved > 0);
        CHECK(keep ? soup_lacks(&s, triangles, NT, 3) == 0 : soup_lacks(&s, triangles, NT, 3) > 0);
        CHECK(keep ? soup_lacks(&s, edges, NE, 2) == 0 : soup_lacks(&s, edges, NE, 2) > 0);
        edges[3] = (uint32_t)s.nv;
        o.num_kept_edges = NE;
        CHECK(spr_improve_arrays(s.xyz, &s.nv, s.nv, s.tets, s.colors, &s.nt, s.nt, NULL, &o, &r) ==
                  SPR_ERROR_INVALID_ARGUMENT &&
              strstr(r.message, "edge 1 names"));
        o.kept_edges = NULL;
        CHECK(spr_improve_arrays(s.xyz, &s.nv, s.nv, s.tets, s.colors, &s.nt, s.nt, NULL, &o, &r) ==
              SPR_ERROR_INVALID_ARGUMENT);
        free(old);
        free_soup(&s);
    }
}

static void test_arrays_without_room_or_sense(void)
{
    soup s = make_soup(100, 0);
    spr_report r;
    spr_options o = open_options();
    size_t nt = s.nt, nv = s.nv;
    double was;
    int k;
    uint32_t *old = (uint32_t *)malloc(4 * nt * sizeof *old);
    memcpy(old, s.tets, 4 * nt * sizeof *old);
    CHECK(spr_improve_arrays(s.xyz, &s.nv, s.nv, s.tets, s.colors, &s.nt, s.nt - 1, NULL, NULL,
                             &r) == SPR_ERROR_INVALID_ARGUMENT);
    CHECK(strstr(r.message, "less room in it"));
    CHECK(spr_improve_arrays(NULL, &s.nv, s.nv, s.tets, s.colors, &s.nt, s.nt, NULL, NULL, &r) ==
          SPR_ERROR_INVALID_ARGUMENT);
    CHECK(spr_improve(NULL, NULL, &r) == SPR_ERROR_INVALID_ARGUMENT);
    for (k = -1; k <= 2; k += 3) {
        o.target = k;
        CHECK(spr_improve_arrays(s.xyz, &s.nv, s.nv, s.tets, s.colors, &s.nt, s.nt, NULL, &o,
                                 &r) == SPR_ERROR_INVALID_ARGUMENT &&
              strstr(r.message, "options.target, which should be 0 to 1, is") &&
              strstr(r.message, k < 0 ? " -1" : " 2"));
    }
    o.target = 0;
    o.measure = SPR_USER; /* no function */
    CHECK(spr_improve_arrays(s.xyz, &s.nv, s.nv, s.tets, s.colors, &s.nt, s.nt, NULL, &o, &r) ==
              SPR_ERROR_INVALID_ARGUMENT &&
          strstr(r.message, "options.quality is NULL"));
    o = open_options();
    o.num_kept_edges = SIZE_MAX;
    CHECK(spr_improve_arrays(s.xyz, &s.nv, s.nv, s.tets, s.colors, &s.nt, s.nt, NULL, &o, &r) ==
              SPR_ERROR_TOO_LARGE &&
          strstr(r.message, "options.num_kept_edges"));
    o.num_kept_edges = 0;
    o.num_kept_triangles = 1;
    CHECK(spr_improve_arrays(s.xyz, &s.nv, s.nv, s.tets, s.colors, &s.nt, s.nt, NULL, &o, &r) ==
              SPR_ERROR_INVALID_ARGUMENT &&
          strstr(r.message, "options.kept_triangles is NULL"));
    s.colors[1] = UINT32_MAX;
    CHECK(spr_improve_arrays(s.xyz, &s.nv, s.nv, s.tets, s.colors, &s.nt, s.nt, NULL, NULL, &r) ==
              SPR_ERROR_INVALID_ARGUMENT &&
          strstr(r.message, "tetrahedron 1 "));
    s.colors[1] = 0;
    s.tets[8] = (uint32_t)s.nv; /* no such vertex */
    CHECK(spr_improve_arrays(s.xyz, &s.nv, s.nv, s.tets, s.colors, &s.nt, s.nt, NULL, NULL, &r) <
              0 &&
          strstr(r.message, "tetrahedron 2"));
    s.tets[8] = old[8];
    was = s.xyz[7];
    s.xyz[7] = (double)NAN;
    CHECK(spr_improve_arrays(s.xyz, &s.nv, s.nv, s.tets, s.colors, &s.nt, s.nt, NULL, NULL, &r) ==
              SPR_ERROR_INVALID_MESH &&
          strstr(r.message, "point 2 "));
    s.xyz[7] = was;
    memcpy(s.tets, s.tets + 4, 4 * sizeof *s.tets); /* the same tetrahedron twice */
    CHECK(spr_improve_arrays(s.xyz, &s.nv, s.nv, s.tets, s.colors, &s.nt, s.nt, NULL, NULL, &r) ==
          SPR_ERROR_INVALID_MESH);
    CHECK(r.message[0] && s.nt == nt && s.nv == nv &&
          !memcmp(s.tets + 4, old + 4, (4 * nt - 4) * sizeof *old));
    free(old);
    free_soup(&s);
}

/* A tetrahedron split at its middle into four, and one of these again: nothing can be better than
 * its facets allow. */
/* ---- a polyhedron in arrays ------------------------------------------------------------------ */

/* All closures of a boundary, with nothing left out: the lowest open triangle takes every point in
 * turn. */
typedef struct closure {
    const spr_polyhedron *p;
    int open[8][8][8]; /* oriented triangles that wait for a tetrahedron, by their least turn */
    int      used[8], edge[8][8];
    double   best;
    long     count;
} closure;

static int *waits(closure *c, uint32_t a, uint32_t b, uint32_t d)
{
    if (a < b && a < d) return &c->open[a][b][d];
    return b < d ? &c->open[b][d][a] : &c->open[d][a][b];
}

static void close_all(closure *c, double worst);

static void close_with(closure *c, uint32_t a, uint32_t b, uint32_t d, uint32_t e, double worst)
{
    const double *x = c->p->xyz;
    uint32_t f[3][3] = {{a, b, e}, {b, d, e}, {d, a, e}};
    int cancels[3], i, ok = 1;
    double q = spr_gamma(x + 3 * a, x + 3 * b, x + 3 * d, x + 3 * e);
    if (delaunay_orient3d(x + 3 * a, x + 3 * b, x + 3 * d, x + 3 * e) <= 0) return;
    for (i = 0; i < 3; i++) {
        cancels[i] = *waits(c, f[i][1], f[i][0], f[i][2]) > 0;
        ok &= cancels[i] || *waits(c, f[i][0], f[i][1], f[i][2]) == 0;
    }
    if (!ok) return;
    *waits(c, a, b, d) -= 1;
    for (i = 0; i < 3; i++)
        if (cancels[i]) *waits(c, f[i][1], f[i][0], f[i][2]) -= 1;
        else *waits(c, f[i][0], f[i][1], f[i][2]) += 1;
    c->used[e]++;
    for (i = 0; i < 3; i++) c->edge[f[i][0]][e]++;
    close_all(c, q < worst ? q : worst);
    for (i = 0; i < 3; i++) c->edge[f[i][0]][e]--;
    c->used[e]--;
    for (i = 0; i < 3; i++)
        if (cancels[i]) *waits(c, f[i][1], f[i][0], f[i][2]) += 1;
        else *waits(c, f[i][0], f[i][1], f[i][2]) -= 1;
    *waits(c, a, b, d) += 1;
}

static void close_all(closure *c, double worst)
{
    uint32_t a, b, d, e, n = (uint32_t)c->p->num_points;
    size_t i;
    for (a = 0; a < n; a++)
        for (b = 0; b < n; b++)
            for (d = 0; d < n; d++)
                if (c->open[a][b][d] > 0) {
                    for (e = 0; e < n; e++)
                        if (e != a && e != b && e != d) close_with(c, a, b, d, e, worst);
                    return;
                }
    for (a = 0; a < n; a++)
        if (!c->used[a]) return;
    for (i = 0; i < c->p->num_edges; i++)
        if (!c->edge[c->p->edges[2 * i]][c->p->edges[2 * i + 1]] &&
            !c->edge[c->p->edges[2 * i + 1]][c->p->edges[2 * i]])
            return;
    c->count++;
    if (worst > c->best) c->best = worst;
}

static void enumerate_closures(closure *c, const spr_polyhedron *p)
{
    size_t i;
    uint32_t on = 0, k;
    memset(c, 0, sizeof *c);
    c->p = p;
    for (i = 0; i < p->num_facets + 2 * p->num_walls;
         i++) { /* inner sides: turned round; walls have two */
        const uint32_t *f =
            i < p->num_facets ? p->facets + 3 * i : p->walls + 3 * ((i - p->num_facets) / 2);
        int turned = i >= p->num_facets && (i - p->num_facets) % 2;
        *waits(c, f[0], f[turned ? 1 : 2], f[turned ? 2 : 1]) += 1;
        for (k = 0; k < 3; k++) {
            on |= 1u << f[k];
            c->edge[f[k]][f[(k + 1) % 3]]++;
        }
    }
    for (k = 0; k < p->num_points; k++) c->used[k] = on >> k & 1;
    close_all(c, 2);
}

/* Part of a Delaunay mesh of few points with integer coordinates: facets, turned outwards. */
static int random_polyhedron(spr_polyhedron *p, double *xyz, uint32_t *facets, uint32_t *constraint)
{
    delaunay_mesh m;
    delaunay_options options;
    uint32_t i, n = 5 + small_random(3), number[9], count = 0;
    delaunay_handle t;
    uint8_t in[200];
    int f, k;
    memset(&m, 0, sizeof m);
    memset(&options, 0, sizeof options);
    memset(p, 0, sizeof *p);
    memset(number, 0xff, sizeof number);
    for (i = 0; i < 3 * n; i++) xyz[i] = small_random(12);
    if (delaunay_tetrahedralize(&m, xyz, n, &options, NULL) != DELAUNAY_OK) return 0;
    for (t = 1; t < m.num_tets && t < 200; t++)
        in[t] = (uint8_t)(is_real(&m, t) && small_random(6) > 0);
    p->facets = facets;
    p->edges = p->walls = constraint;
    for (t = 1; t < m.num_tets && t < 200; t++)
        for (f = 0; f < 4 && in[t]; f++) {
            const uint8_t *o = delaunay_facet_order(f);
            uint32_t v[3];
            for (k = 0; k < 3; k++) v[k] = m.tets[t].v[o[k]];
            if (in[m.tets[t].n[f] / 4]) { /* perhaps a constraint */
                memcpy(constraint, v, sizeof v);
                count++;
            } else memcpy(facets + 3 * p->num_facets++, v, sizeof v);
        }
    p->num_edges = count > 0 && small_random(3) == 0;
    p->num_walls = count > 0 && !p->num_edges && small_random(3) == 0;
    for (i = 0; i < 3 * p->num_facets + 3;
         i++) { /* numbers of their own, without points that nothing has */
        uint32_t *v = i < 3 * p->num_facets ? facets + i
                      : count               ? constraint + (i - 3 * p->num_facets)
                                            : NULL;
        if (!v) break;
        if (number[*v] == UINT32_MAX) {
            number[*v] = (uint32_t)p->num_points;
            for (k = 0; k < 3; k++) xyz[24 + 3 * p->num_points + (size_t)k] = m.vertices[*v].x[k];
            p->num_points++;
        }
        *v = number[*v];
    }
    p->xyz = xyz + 24;
    delaunay_mesh_free(&m);
    return p->num_points >= 4 && p->num_facets >= 4;
}

static void test_reconnect_against_all_closures(void)
{
    static closure c;
    static spr_reconnection r;
    uint64_t seed = small_state;
    double xyz[48];
    uint32_t facets[3 * 200], constraint[3];
    long several = 0, edges = 0, walls = 0, refused = 0;
    int pass;
    for (pass = 0; pass < 1500; pass++) {
        spr_polyhedron p;
        spr_result result;
        double six = 0;
        size_t i;
        if (!random_polyhedron(&p, xyz, facets, constraint)) continue;
        result = spr_reconnect(&p, 0, 0, NULL, &r);
        if (result ==
            SPR_ERROR_INVALID_ARGUMENT) { /* nothing is left of it but a triangle with two sides */
            refused++;
            continue;
        }
        enumerate_closures(&c, &p);
        CHECK(r.proven && r.found == (c.count > 0) &&
              result == (c.count > 0 ? SPR_OK : SPR_GOAL_NOT_MET));
        if (!r.found) continue;
        CHECK(fabs(r.value - c.best) < 1e-14);
        for (i = 0; i < r.num_tets; i++) {
            const double *a = p.xyz + 3 * r.tets[i][0], *b = p.xyz + 3 * r.tets[i][1];
            const double *d = p.xyz + 3 * r.tets[i][2], *e = p.xyz + 3 * r.tets[i][3];
            CHECK(delaunay_orient3d(a, b, d, e) > 0 &&
                  spr_gamma(a, b, d, e) >= r.value * (1 - 1e-12));
            six += triple(a, b, d, e);
        }
        for (i = 0; i < p.num_facets; i++)
            six -= triple(p.xyz, p.xyz + 3 * p.facets[3 * i], p.xyz + 3 * p.facets[3 * i + 1],
                          p.xyz + 3 * p.facets[3 * i + 2]);
        CHECK(six == 0); /* integers: the volumes are the same */
        CHECK(spr_reconnect(&p, r.value, 0, NULL, &r) == SPR_GOAL_NOT_MET && r.proven &&
              r.num_tets == 0);
        several += c.count > 1;
        edges += p.num_edges > 0;
        walls += p.num_walls > 0;
    }
    CHECK(several > 300 && edges > 100 && walls > 100 && refused < 100);
    small_state = seed;
}

static void test_reconnect_without_sense(void)
{
    static spr_reconnection r;
    double xyz[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    const uint32_t out[12] = {1, 2, 3, 0, 3, 2, 0, 1, 3, 0, 2, 1},
                   in[12] = {1, 3, 2, 0, 2, 3, 0, 3, 1, 0, 1, 2};
    uint32_t bad[12];
    spr_polyhedron p;
    memset(&p, 0, sizeof p);
    p.xyz = xyz;
    p.facets = out;
    p.num_points = p.num_facets = 4;
    CHECK(spr_reconnect(&p, 0, 0, NULL, &r) == SPR_OK && r.num_tets == 1 && r.proven &&
          r.nodes > 0);
    CHECK(spr_reconnect(&p, 0, 1, NULL, &r) == SPR_GOAL_NOT_MET && !r.proven); /* an honest limit */
    p.facets = in;
    CHECK(spr_reconnect(&p, 0, 0, NULL, &r) == SPR_ERROR_INVALID_ARGUMENT &&
          strstr(r.message, "inwards"));
    p.facets = bad;
    memcpy(bad, out, sizeof bad);
    bad[11] = 4;
    CHECK(spr_reconnect(&p, 0, 0, NULL, &r) == SPR_ERROR_INVALID_ARGUMENT &&
          strstr(r.message, "number 3"));
    memcpy(bad + 9, out, 3 * sizeof *bad);
    CHECK(spr_reconnect(&p, 0, 0, NULL, &r) == SPR_ERROR_INVALID_ARGUMENT &&
          strstr(r.message, "twice"));
    bad[9] = 0, bad[10] = 1, bad[11] = 2;
    CHECK(spr_reconnect(&p, 0, 0, NULL, &r) == SPR_ERROR_INVALID_ARGUMENT &&
          strstr(r.message, "open"));
    p.facets = out;
    xyz[4] = NAN;
    CHECK(spr_reconnect(&p, 0, 0, NULL, &r) == SPR_ERROR_INVALID_ARGUMENT &&
          strstr(r.message, "number 1"));
    xyz[4] = 0;
    CHECK(spr_reconnect(&p, NAN, 0, NULL, &r) == SPR_ERROR_INVALID_ARGUMENT &&
          strstr(r.message, "bound"));
    p.num_facets = 3;
    CHECK(spr_reconnect(&p, 0, 0, NULL, &r) == SPR_ERROR_INVALID_ARGUMENT &&
          strstr(r.message, "not 4 to 512 facets"));
    p.num_facets = 4;
    p.num_edges = 1;
    CHECK(spr_reconnect(&p, 0, 0, NULL, &r) == SPR_ERROR_INVALID_ARGUMENT &&
          strstr(r.message, "edges, or none given"));
    bad[0] = 2, bad[1] = 3, bad[2] = 1, bad[3] = 1;
    p.edges = bad;
    CHECK(spr_reconnect(&p, 0, 0, NULL, &r) == SPR_OK && r.num_tets == 1); /* it is there */
    p.num_edges = 2;
    CHECK(spr_reconnect(&p, 0, 0, NULL, &r) == SPR_ERROR_INVALID_ARGUMENT &&
          strstr(r.message, "an edge without two points (number 1)"));
    p.num_edges = 0;
    p.num_walls = SPR_MAX_CONSTRAINTS + 1;
    p.walls = bad;
    CHECK(spr_reconnect(&p, 0, 0, NULL, &r) == SPR_ERROR_INVALID_ARGUMENT &&
          strstr(r.message, "walls, or none given"));
    bad[2] = 3;
    p.num_walls = 1;
    CHECK(spr_reconnect(&p, 0, 0, NULL, &r) == SPR_ERROR_INVALID_ARGUMENT &&
          strstr(r.message, "a wall without three points (number 0)"));
    p.num_walls = 0;
    p.num_points = 33;
    CHECK(spr_reconnect(&p, 0, 0, NULL, &r) == SPR_ERROR_INVALID_ARGUMENT);
    CHECK(spr_reconnect(NULL, 0, 0, NULL, &r) == SPR_ERROR_INVALID_ARGUMENT);
}

typedef struct told {
    uint64_t  count[4];
    double    worst;
    spr_worst last;
} told;

static void tell(void *user, const spr_worst *what)
{
    told *t = (told *)user;
    t->count[what->reason]++;
    if (what->quality < t->worst) t->worst = what->quality;
    CHECK(what->quality < 0.35 && what->bound >= what->quality * 0.999);
    CHECK(what->bound < 0.35 || what->reason != SPR_BOUNDED);
    t->last = *what;
}

static void tell_held(void *user, const spr_worst *what)
{
    CHECK(what->reason != SPR_BOUNDED || what->bound < *(const double *)user);
}

/* What is known of a tetrahedron that others have replaced meanwhile is not said of theirs. */
static void test_what_is_held_is_told_of_each(void)
{
    double target = 0.8;
    int run, i;
    for (run = 0; run < 12; run++) {
        double xyz[3 * 60];
        spr_options o = open_options();
        delaunay_mesh m;
        spr_report r;
        for (i = 0; i < 3 * 60; i++) xyz[i] = random_double();
        memset(&m, 0, sizeof m);
        CHECK(delaunay_tetrahedralize(&m, xyz, 60, NULL, NULL) == DELAUNAY_OK);
        o.target = target;
        o.left = tell_held;
        o.left_user = &target;
        CHECK(spr_improve(&m, &o, &r) >= 0);
        delaunay_mesh_free(&m);
    }
}

static void test_tells_of_all_that_is_left(void)
{
    int k;
    for (k = 0; k < 2; k++) {
        spr_options o = open_options();
        delaunay_mesh m;
        spr_report r;
        told t;
        double middle[3] = {0, 0, 0};
        int i, j;
        memset(&t, 0, sizeof t);
        t.worst = 1;
        o.left = tell;
        o.left_user = &t;
        o.no_reconnection = o.no_edge_removal = o.keep_vertices = 1;
        o.max_rounds = k;
        CHECK(random_mesh(&m, 120, 0, NULL));
        color_mesh(&m, 1);
        improve_and_check(&m, &o, &r, k ? SPR_STOPPED_BY_BUDGET : SPR_OK);
        CHECK(t.count[SPR_BOUNDED] == r.bounded && t.count[SPR_FIXED] == r.fixed &&
              t.count[SPR_STUCK] == r.stuck && t.count[SPR_BUDGET] == r.unfinished);
        CHECK(r.bounded + r.fixed + r.stuck + r.unfinished == r.after.num_below);
        CHECK(t.worst == r.worst[0].quality);
        CHECK(k ? r.unfinished > r.stuck : r.stuck > 0);
        for (i = 0; i < 4; i++)
            for (j = 0; j < 3; j++) middle[j] += m.vertices[m.tets[t.last.tet].v[i]].x[j] / 4;
        for (j = 0; j < 3; j++) CHECK(fabs(middle[j] - t.last.xyz[j]) < 1e-12);
        delaunay_mesh_free(&m);
    }
}

static void count_reason(void *user, const spr_worst *what)
{
    ((told *)user)->count[what->reason]++;
}

/* Also where little was tried, or where the last changes left new tetrahedra. */
static void test_counts_the_same_with_and_without_telling(void)
{
    int rounds, k, i;
    for (rounds = 0; rounds < 2; rounds++) {
        spr_report r[2];
        told t;
        memset(&t, 0, sizeof t);
        for (k = 0; k < 2; k++) {
            spr_options o = open_options();
            delaunay_mesh m;
            uint32_t v;
            o.max_rounds = rounds;
            o.left = k ? count_reason : NULL;
            o.left_user = &t;
            small_state = 12345;
            CHECK(random_mesh(&m, 40, 0, NULL));
            for (v = 1; v < m.num_vertices; v++) m.vertices[v].x[2] *= 0.125;
            color_mesh(&m, 1);
            CHECK(spr_improve(&m, &o, &r[k]) == (rounds ? SPR_STOPPED_BY_BUDGET : SPR_OK));
            delaunay_mesh_free(&m);
        }
        CHECK(rounds ? r[0].unfinished > 0 : r[0].bounded > 0);
        CHECK(r[0].bounded == r[1].bounded && r[0].fixed == r[1].fixed &&
              r[0].stuck == r[1].stuck && r[0].unfinished == r[1].unfinished);
        CHECK(t.count[SPR_BOUNDED] == r[0].bounded && t.count[SPR_FIXED] == r[0].fixed &&
              t.count[SPR_STUCK] == r[0].stuck && t.count[SPR_BUDGET] == r[0].unfinished);
        for (i = 0; i < r[0].num_worst; i++) CHECK(r[0].worst[i].reason == r[1].worst[i].reason);
    }
}

static void test_says_what_the_surface_holds(void)
{
    double xyz[3 * 8] = {0, 0, 0, 1, 0, 0, 0.5, 0.05, 0, 0.5, 0.02, 0.9};
    uint32_t tets[4 * 8] = {0, 1, 2, 3};
    size_t nv = 4, nt = 1;
    spr_report r;
    CHECK(spr_improve_arrays(xyz, &nv, 8, tets, NULL, &nt, 8, NULL, NULL, &r) == SPR_OK);
    CHECK(nt == 1 && r.bounded == 1 && r.num_worst == 1 && r.worst[0].reason == SPR_BOUNDED);
    CHECK(r.worst[0].bound >= r.worst[0].quality * 0.999 && r.worst[0].bound < 0.35);
}

/* A weighted triangulation; every second vertex is one that may go. */
static void test_vertices_keep_their_weights(void)
{
    enum { POINTS = 80 };
    double xyz[3 * POINTS], weights[POINTS];
    spr_options o = open_options();
    delaunay_points points;
    delaunay_mesh m;
    spr_report r;
    uint32_t v;
    int i;
    memset(&points, 0, sizeof points);
    memset(&m, 0, sizeof m);
    random_points(xyz, POINTS, 0);
    for (i = 0; i < POINTS; i++) weights[i] = 1e-6 * i;
    points.xyz = xyz;
    points.count = POINTS;
    points.weights = weights;
    CHECK(delaunay_tetrahedralize_points(&m, &points, NULL, NULL) == DELAUNAY_OK);
    for (v = 1; v < m.num_vertices; v += 2) m.vertex_id[v] = DELAUNAY_NO_ID;
    o.free_vertices = 0;
    CHECK(spr_improve(&m, &o, &r) == SPR_OK && r.vertices_removed > 0);
    for (v = 1; v < m.num_vertices; v++)
        CHECK(m.vertex_id[v] == DELAUNAY_NO_ID || m.weight[v] == weights[m.vertex_id[v]]);
    delaunay_mesh_free(&m);
}

/* ---- the host ------------------------------------------------------------------------------ */

/* An allocator that notices writes beyond the end of a block, for delaunay_alloc puts no gap there
 * if the memory begins at a multiple of 64. After `countdown` allocations (negative: never) one
 * fails, or all of them if `for_good`; those of size `fatal` always fail. */
typedef struct guard {
    long   countdown, outstanding, failed;
    int    for_good;
    size_t fatal, num_sizes, sizes[200]; /* the different sizes that were asked for */
} guard;

static const char fence[] = "the end of a block";

static void *guard_alloc(void *user, size_t size)
{
    guard *g = (guard *)user;
    char *base, *block;
    size_t i;
    for (i = 0; i < g->num_sizes && g->sizes[i] != size; i++) {}
    if (i == g->num_sizes && i < 200) g->sizes[g->num_sizes++] = size;
    if (g->countdown == 0 || size == g->fatal) {
        if (!g->for_good) g->countdown = -1;
        g->failed++;
        return NULL;
    }
    base = (char *)malloc(size + 128 + sizeof fence);
    if (!base) return NULL;
    block = base + (128 - (size_t)((uintptr_t)base % 64));
    memcpy(block - sizeof base, &base, sizeof base);
    memcpy(block - sizeof base - sizeof size, &size, sizeof size);
    memcpy(block + size, fence, sizeof fence);
    if (g->countdown > 0) g->countdown--;
    g->outstanding++;
    return block;
}

static void guard_release(void *user, void *block)
{
    char *base, *end = (char *)block;
    size_t size;
    memcpy(&base, end - sizeof base, sizeof base);
    memcpy(&size, end - sizeof base - sizeof size, sizeof size);
    CHECK(!memcmp(end + size, fence, sizeof fence));
    ((guard *)user)->outstanding--;
    free(base);
}

static spr_options guarded_options(guard *g)
{
    spr_options o = open_options();
    memset(g, 0, sizeof *g);
    g->countdown = -1;
    o.host.allocator.alloc = guard_alloc;
    o.host.allocator.release = guard_release;
    o.host.allocator.user = g;
    return o;
}

/* Improves a mesh; allocations fail as the guard says. Returns whether one has failed. */
static int improve_while_failing(delaunay_mesh *m, const spr_options *o, guard *g, long countdown,
                                 size_t fatal)
{
    const uint64_t border = walls(m);
    delaunay_report found;
    spr_report r;
    spr_result result;
    g->countdown = countdown;
    g->fatal = fatal;
    g->num_sizes = 0;
    result = spr_improve(m, o, &r);
    g->countdown = -1;
    g->fatal = 0;
    CHECK(result == (g->failed ? SPR_ERROR_OUT_OF_MEMORY : SPR_OK));
    CHECK(delaunay_validate(m, DELAUNAY_VALIDATE_GEOMETRY, &found) == DELAUNAY_OK &&
          walls(m) == border);
    delaunay_mesh_free(m);
    CHECK(g->outstanding == 0);
    return g->failed != 0;
}

static void test_failing_allocations(void)
{
    int for_good;
    for (for_good = 0; for_good < 2; for_good++) {
        int failed = 1;
        long k;
        for (k = 0; failed && k < 1000000; k += 1 + k / 12) {
            guard g;
            spr_options o = guarded_options(&g);
            delaunay_mesh m;
            g.for_good = for_good;
            small_state = 4711;
            CHECK(random_mesh(&m, 40, 0, &o.host));
            color_mesh(&m, 2);
            failed = improve_while_failing(&m, &o, &g, k, 0);
        }
        CHECK(!failed);
    }
}

/* Points on a sphere: the imported mesh has no slots to spare, and grows. All allocations of one
 * size fail, those of each size in turn. */
static void test_failing_allocations_while_the_mesh_grows(void)
{
    enum { POINTS = 20 };
    double xyz[3 * POINTS];
    uint32_t *tets, num = 0;
    size_t sizes[200] = {0}, num_sizes = 0, k;
    delaunay_mesh d;
    delaunay_handle t;
    int i;
    for (i = 0; i < POINTS; i++) {
        double z = 2 * random_double() - 1, angle = 6.283185307179586 * random_double();
        xyz[3 * i] = sqrt(1 - z * z) * cos(angle);
        xyz[3 * i + 1] = sqrt(1 - z * z) * sin(angle);
        xyz[3 * i + 2] = z;
    }
    memset(&d, 0, sizeof d);
    CHECK(delaunay_tetrahedralize(&d, xyz, POINTS, NULL, NULL) == DELAUNAY_OK);
    tets = (uint32_t *)malloc(4 * d.num_tets * sizeof *tets);
    for (t = 1; t < d.num_tets; t++)
        for (i = 0; i < 4 && is_real(&d, t); i++) tets[num++] = d.vertex_id[d.tets[t].v[i]];
    for (k = 0; k <= num_sizes; k++) {
        guard g;
        spr_options o = guarded_options(&g);
        delaunay_mesh m;
        memset(&m, 0, sizeof m);
        CHECK(delaunay_import(&m, xyz, POINTS, tets, NULL, num / 4, &o.host, NULL) == DELAUNAY_OK);
        CHECK(delaunay_enable_marks(&m) == DELAUNAY_OK);
        color_mesh(&m, 1);
        CHECK(improve_while_failing(&m, &o, &g, -1, k ? sizes[k - 1] : 0) == (k > 0));
        if (k > 0) continue;
        memcpy(sizes, g.sizes, sizeof sizes);
        num_sizes = g.num_sizes;
    }
    CHECK(num_sizes > 20 && num_sizes < 200);
    free(tets);
    delaunay_mesh_free(&d);
}

/* An allocator that notices when two threads are in it at once. `lingers`: it takes its time. */
typedef struct turnstile {
    volatile int *inside;
    volatile long clashes, calls;
    int lingers;
} turnstile;

static int in_parallel(void)
{
#ifdef _OPENMP
    return omp_in_parallel();
#else
    return 0;
#endif
}

static void pass(turnstile *t)
{
    volatile long wait = t->lingers && in_parallel() ? 3000000 : 0;
    if (*t->inside) t->clashes++;
    *t->inside = 1;
    t->calls++;
    while (wait > 0) wait--;
    *t->inside = 0;
}

static void *turnstile_alloc(void *user, size_t size)
{
    pass((turnstile *)user);
    return malloc(size);
}

static void turnstile_release(void *user, void *block)
{
    pass((turnstile *)user);
    free(block);
}

static double standing_clock(void *user)
{
    (void)user;
    return 0;
}

/* By a clock that stands still only the calling thread plans. The workers of the others have not
 * allocated anything yet when they are lent to patches. */
static void test_one_thread_at_a_time_allocates(void)
{
    volatile int inside = 0;
    turnstile of_mesh, of_call;
    spr_options o = open_options();
    delaunay_mesh m;
    spr_report r;
    memset(&of_mesh, 0, sizeof of_mesh);
    of_mesh.inside = &inside;
    of_call = of_mesh;
    of_mesh.lingers = 1;
    o.host.allocator.alloc = turnstile_alloc;
    o.host.allocator.release = turnstile_release;
    o.host.allocator.user = &of_mesh;
    o.host.clock = standing_clock;
    o.host.num_threads = 4;
    small_state = 4711;
    CHECK(random_mesh(&m, 300, 1, &o.host));
    color_mesh(&m, 1);
    o.host.allocator.user = &of_call;
    CHECK(spr_improve(&m, &o, &r) == SPR_OK);
    CHECK(of_mesh.clashes == 0 && of_call.clashes == 0 && of_call.calls > 500);
    delaunay_mesh_free(&m);
}

/* The limit that the mesh was made with gives way to that of the call. */
static void test_the_limit_is_that_of_the_call(void)
{
    delaunay_host tight;
    spr_options o = open_options();
    delaunay_mesh m;
    spr_report r;
    memset(&tight, 0, sizeof tight);
    tight.num_threads = 1;
    small_state = 4711; /* the same mesh twice */
    CHECK(random_mesh(&m, 300, 1, &tight));
    tight.memory_limit_bytes = m.memory.peak_bytes;
    delaunay_mesh_free(&m);
    small_state = 4711;
    CHECK(random_mesh(&m, 300, 1, &tight));
    CHECK(m.memory.limit_bytes == tight.memory_limit_bytes);
    o.host.memory_limit_bytes = tight.memory_limit_bytes;
    CHECK(spr_improve(&m, &o, &r) == SPR_ERROR_OUT_OF_MEMORY && r.message[0]);
    o.host.memory_limit_bytes = 0;
    improve_and_check(&m, &o, &r, SPR_OK);
    delaunay_mesh_free(&m);
}

static int cancel_later(void *user, const char *phase, double fraction)
{
    CHECK(phase != NULL && fraction >= 0 && fraction <= 1);
    return --*(int *)user <= 0;
}

static void set_max_threads(int threads)
{
#ifdef _OPENMP
    omp_set_num_threads(threads);
#else
    (void)threads;
#endif
}

static int get_max_threads(void)
{
#ifdef _OPENMP
    return omp_get_max_threads();
#else
    return 1;
#endif
}

typedef struct pulse {
    int calls;
    double last;
} pulse;

/* A host whose maximum of threads rises meanwhile. Progress never falls. */
static int more_threads(void *user, const char *phase, double fraction)
{
    pulse *t = (pulse *)user;
    (void)phase;
    set_max_threads(4);
    CHECK(fraction >= t->last && fraction <= 1);
    t->last = fraction;
    t->calls++;
    return 0;
}

/* With num_threads 0, what OpenMP said at first counts. */
static void test_max_threads_changes_meanwhile(void)
{
    const int was = get_max_threads();
    const uint64_t state = small_state;
    pulse t = {0, 0};
    spr_options o = open_options();
    delaunay_mesh m;
    spr_report r;
    set_max_threads(1);
    o.host.num_threads = 0;
    o.host.progress = more_threads;
    o.host.user = &t;
    small_state = 4711;
    CHECK(random_mesh(&m, 250, 1, NULL));
    color_mesh(&m, 1);
    improve_and_check(&m, &o, &r, SPR_OK);
    CHECK(t.calls > 40 && t.last > 0.5 && r.shaken > 0);
    delaunay_mesh_free(&m);
    set_max_threads(was);
    small_state = state;
}

static double ticking(void *user) { return (*(double *)user) += 1; }

/* All time is up as soon as it is cancelled. */
static double hurried(void *user) { return *(int *)user <= 0 ? 1e9 : 0; }

/* Whenever it is said, and whether or not time is up as well. */
static void test_cancel(void)
{
    const uint64_t state = small_state;
    int k, left = INT_MAX, calls = INT_MAX;
    for (k = INT_MAX; k > 0; k = k > calls ? calls : k - 1) {
        spr_options o = open_options();
        delaunay_mesh m;
        spr_report r;
        left = k;
        o.host.progress = cancel_later;
        o.host.clock = hurried;
        o.host.user = &left;
        o.max_seconds = 1e6;
        small_state = 777; /* the same mesh each time */
        CHECK(random_mesh(&m, 24, 0, NULL));
        color_mesh(&m, 1);
        improve_and_check(&m, &o, &r, k == INT_MAX ? SPR_OK : SPR_CANCELLED);
        if (k == INT_MAX) calls = INT_MAX - left;
        delaunay_mesh_free(&m);
    }
    small_state = state;
    CHECK(calls > 40 && calls < 100000);
}

static void test_budgets(void)
{
    int k;
    for (k = 0; k < 3; k++) {
        spr_options o = open_options();
        delaunay_mesh m;
        spr_report r;
        double now = 5;
        if (k == 0) {
            o.host.clock = ticking;
            o.host.user = &now;
            o.max_seconds = 30;
        } else if (k == 1)
            o.max_rounds = 2;
        else {
            o.require_target = 1;
            o.target = 0.9;
            o.max_seconds = 0.02;
        }
        CHECK(random_mesh(&m, 150, 0, NULL));
        color_mesh(&m, 1);
        improve_and_check(&m, &o, &r, SPR_STOPPED_BY_BUDGET);
        CHECK(r.message[0] && r.num_worst > 0 && r.worst[0].reason != SPR_STUCK);
        delaunay_mesh_free(&m);
    }
}

static void test_more_effort_leaves_fewer(void)
{
    static const double effort[] = {0.02, 1, 3}, refused[] = {-1, 0.001, 101, NAN, INFINITY};
    uint64_t left[3] = {0, 0, 0}, seed = small_state;
    delaunay_mesh m;
    spr_report r;
    int k, trial;
    for (trial = 1; trial <= 3; trial++)
        for (k = 0; k < 3; k++) {
            spr_options o = open_options();
            small_state = (uint64_t)trial;
            o.effort = effort[k];
            CHECK(random_mesh(&m, 600, 1, NULL));
            color_mesh(&m, 2);
            improve_and_check(&m, &o, &r, SPR_OK);
            CHECK(effort[k] > 1 || r.vertices_inserted <= r.before.num_tets / 50 + 6);
            left[k] += r.after.num_below;
            delaunay_mesh_free(&m);
        }
    CHECK(11 * left[1] < 10 * left[0] && left[2] <= left[1]);
    CHECK(random_mesh(&m, 50, 0, NULL));
    for (k = 0; k < 5; k++) {
        spr_options o = open_options();
        o.effort = refused[k];
        CHECK(spr_improve(&m, &o, &r) == SPR_ERROR_INVALID_ARGUMENT);
        CHECK(strstr(r.message, "options.effort, which should be 0 or 0.01 to 100, is "));
    }
    delaunay_mesh_free(&m);
    small_state = seed;
}

static void test_nothing_to_do(void)
{
    delaunay_mesh m;
    spr_report r;
    spr_options o = open_options();
    memset(&m, 0, sizeof m);
    CHECK(spr_improve(&m, NULL, &r) == SPR_OK && r.after.num_tets == 0);
    CHECK(random_mesh(&m, 100, 0, NULL));
    memset(m.color, 0, m.num_tets * sizeof *m.color);
    improve_and_check(&m, &o, &r, SPR_OK); /* all outside */
    CHECK(r.before.num_tets == 0 && r.plans == 0);
    delaunay_mesh_free(&m);
}

static void test_results_have_sentences(void)
{
    int k;
    for (k = -80; k <= 2; k++)
        if (k >= -5 || k == -80)
            CHECK(strncmp(spr_result_string((spr_result)k), "unknown", 7) != 0);
    CHECK(!strncmp(spr_result_string((spr_result)-79), "unknown", 7));
}

int main(void)
{
    test_measures_of_known_shapes();
    test_bound_of_triangles();
    test_statistics_against_sorting();
    test_rounding_inverts_nothing();
    test_improves_a_cube_and_a_ball();
    test_keeps_the_callers_points_by_default();
    test_rounds_extreme_angles();
    test_each_operator_alone();
    test_constrained_edges_and_facets_stay();
    test_other_measures();
    test_a_measure_without_numbers();
    test_vectors_and_the_plain_way_agree();
    test_statistics_by_vectors_and_the_plain_way_agree();
    test_same_bytes_for_any_number_of_threads();
    test_relaxes_a_lattice();
    test_raises_the_worst_where_none_is_bad();
    test_relaxing_spares_the_worst();
    test_a_hub_goes();
    test_flips_for_the_mean();
    test_what_a_part_of_a_mesh_is_replaced_by();
    test_what_a_part_with_extreme_angles_is_replaced_by();
    test_a_focus_hides_other_measures();
    test_shaking_keeps_within_its_plans();
    test_room_for_a_new_vertex();
    test_parts_with_few_bad_ones_are_shaken_first();
    test_a_vertex_is_sown_in_a_bad_tetrahedron();
    test_large_refills_end_with_their_credit();
    test_bounds_are_of_the_callers_quality();
    test_a_flat_one_among_good_ones();
    test_flat_ones_over_bent_polygons();
    test_where_hardly_anything_can_be_good();
    test_ends_where_quality_is_less_than_rounding();
    test_arrays();
    test_arrays_with_little_room();
    test_arrays_with_things_kept();
    test_arrays_without_room_or_sense();
    test_reconnect_against_all_closures();
    test_reconnect_without_sense();
    test_tells_of_all_that_is_left();
    test_counts_the_same_with_and_without_telling();
    test_says_what_the_surface_holds();
    test_counts_vertices_that_come_and_go();
    test_vertices_keep_their_weights();
    test_failing_allocations();
    test_failing_allocations_while_the_mesh_grows();
    test_one_thread_at_a_time_allocates();
    test_the_limit_is_that_of_the_call();
    test_max_threads_changes_meanwhile();
    test_cancel();
    test_budgets();
    test_more_effort_leaves_fewer();
    test_nothing_to_do();
    test_walls_need_few_vertices();
    test_a_vertex_goes_with_more_than_its_star();
    test_results_have_sentences();
    test_bounds_within_leaning_planes();
    test_what_is_held_is_told_of_each();
    return check_report();
}
