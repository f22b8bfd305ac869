/* Coordinates over the whole range of doubles, and simultaneous calls from many threads of the
 * calling program. */
#ifndef LINKED
#  define DELAUNAY_IMPLEMENTATION
#endif
#include "../delaunay.h"
#include "check.h"
#include <fenv.h>
#include <math.h>
#include <stdlib.h>
#ifdef _OPENMP
#  include <omp.h>
#endif
#if defined(__unix__) || defined(__APPLE__)
#  include <pthread.h>
#  define HAVE_PTHREADS 1
#endif

static uint32_t next_u32(uint64_t *state)
{
    *state = *state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (uint32_t)(*state >> 33);
}
static double next_unit(uint64_t *state) { return next_u32(state) / 2147483648.0; }

enum { ALL_EXPONENTS, LARGEST, SUBNORMAL, FAR_AWAY, ONE_FLAT_AXIS, MIXED, NUM_KINDS };

static double coordinate(int kind, int axis, uint64_t *state)
{
    double u = 2 * next_unit(state) - 1;
    switch (kind) {
    case ALL_EXPONENTS:
        return ldexp(u, (int)(next_u32(state) % 2098) - 1074);
    case LARGEST:
        return u * DBL_MAX;
    case SUBNORMAL:
        return (double)(next_u32(state) % 7) * 4.9406564584124654e-324;
    case FAR_AWAY:
        return 4503599627370496.0 + (double)(next_u32(state) % 8);
    case ONE_FLAT_AXIS:
        return axis == 2 ? ldexp(u, -900) : u;
    default:
        return next_u32(state) % 2 ? (double)(next_u32(state) % 3)
                                   : ldexp((double)(next_u32(state) % 5), -1060);
    }
}

/* Exact: the validator's predicates know no filter for these. */
static void any_coordinates(int kind)
{
    enum { N = 250 };
    double xyz[3 * N];
    uint64_t state = 11 + (uint64_t)kind;
    int round;
    size_t i;
    for (round = 0; round < 3; round++) {
        delaunay_mesh mesh = {0};
        delaunay_report report;
        delaunay_result result;
        for (i = 0; i < 3 * N; i++) xyz[i] = coordinate(kind, (int)(i % 3), &state);
        result = delaunay_tetrahedralize(&mesh, xyz, N, NULL, &report);
        CHECK(result == DELAUNAY_OK);
        if (result != DELAUNAY_OK) continue;
        CHECK(delaunay_validate(&mesh, DELAUNAY_VALIDATE_DELAUNAY, &report) == DELAUNAY_OK);
        for (i = 0; i < N; i++) CHECK(mesh.vertex_of[i] != 0);
        delaunay_mesh_free(&mesh);
    }
}

/* Tetrahedra of a few points of extreme coordinates, by the exact tests alone. */
static void extremes_by_brute_force(int kind)
{
    enum { N = 9 };
    double xyz[3 * N];
    uint64_t state = 99 + (uint64_t)kind;
    int round, i;
    for (round = 0; round < 20; round++) {
        delaunay_mesh mesh = {0};
        uint32_t a, b, c, d, e, expected = 0;
        for (i = 0; i < 3 * N; i++) xyz[i] = coordinate(kind, i % 3, &state);
        if (delaunay_tetrahedralize(&mesh, xyz, N, NULL, NULL) != DELAUNAY_OK) continue;
        for (a = 1; a < mesh.num_vertices; a++)
            for (b = a + 1; b < mesh.num_vertices; b++)
                for (c = b + 1; c < mesh.num_vertices; c++)
                    for (d = c + 1; d < mesh.num_vertices; d++) {
                        const double *p[4];
                        int sign, empty = 1;
                        p[0] = mesh.vertices[a].x, p[1] = mesh.vertices[b].x;
                        p[2] = mesh.vertices[c].x, p[3] = mesh.vertices[d].x;
                        sign = delaunay_orient3d_exact(p[0], p[1], p[2], p[3]);
                        if (sign == 0) continue;
                        for (e = 1; e < mesh.num_vertices && empty; e++) {
                            const double *q = mesh.vertices[e].x;
                            int s = sign * delaunay_insphere_exact(p[0], p[1], p[2], p[3], q);
                            if (e == a || e == b || e == c || e == d) continue;
                            if (s == 0)
                                s = sign > 0
                                        ? delaunay_insphere_perturbed(p[0], p[1], p[2], p[3], q)
                                        : delaunay_insphere_perturbed(p[1], p[0], p[2], p[3], q);
                            empty = s < 0;
                        }
                        expected += (uint32_t)empty;
                    }
        CHECK(expected == delaunay_count_tets(&mesh));
        delaunay_mesh_free(&mesh);
    }
}

static uint64_t hash_mesh(const delaunay_mesh *m)
{
    uint64_t h = UINT64_C(0xcbf29ce484222325);
    const unsigned char *p = (const unsigned char *)m->tets;
    size_t i;
    for (i = 0; i < m->num_tets * sizeof *m->tets; i++) h = (h ^ p[i]) * UINT64_C(0x100000001b3);
    return h;
}

/* Points of a seed, triangulated; 0 on failure. */
static uint64_t one_mesh(uint64_t seed, int threads)
{
    enum { N = 6000 };
    double *xyz = (double *)malloc(3 * N * sizeof *xyz);
    double scale = ldexp(1, (int)(seed % 40) * 10 - 200); /* each host thread its own units */
    delaunay_mesh mesh = {0};
    delaunay_options options;
    uint64_t h = 0, state = seed;
    size_t i;
    memset(&options, 0, sizeof options);
    options.host.num_threads = threads;
    for (i = 0; xyz && i < 3 * N; i++) xyz[i] = scale * next_unit(&state);
    if (xyz && delaunay_tetrahedralize(&mesh, xyz, N, &options, NULL) == DELAUNAY_OK)
        h = hash_mesh(&mesh);
    delaunay_mesh_free(&mesh);
    free(xyz);
    return h;
}

enum { HOSTS = 6 };

/* Archer, which tells the thread sanitizer of OpenMP's barriers, does not know those of nested
 * teams. */
#define NESTED_LEVELS 2
#if defined(__has_feature)
#  if __has_feature(thread_sanitizer)
#    undef NESTED_LEVELS
#    define NESTED_LEVELS 1
#  endif
#endif

#ifdef HAVE_PTHREADS
typedef struct host_thread {
    uint64_t seed, hash;
    pthread_t thread;
} host_thread;
static void *run_host(void *user)
{
    host_thread *h = (host_thread *)user;
    h->hash = one_mesh(h->seed, 3);
    return NULL;
}
#endif

/* Several meshes at once, each in parallel itself: what each would be alone. */
static void many_hosts(void)
{
    uint64_t alone[HOSTS], nested[HOSTS];
    int i;
    for (i = 0; i < HOSTS; i++) {
        alone[i] = one_mesh((uint64_t)(100 + 7 * i), 1);
        CHECK(alone[i] != 0);
        nested[i] = 0;
    }
#ifdef _OPENMP
    omp_set_max_active_levels(NESTED_LEVELS);
#  pragma omp parallel for num_threads(4) schedule(dynamic, 1)
#endif
    for (i = 0; i < HOSTS; i++) nested[i] = one_mesh((uint64_t)(100 + 7 * i), 3);
    for (i = 0; i < HOSTS; i++) CHECK(nested[i] == alone[i]);
#ifdef _OPENMP
    omp_set_max_active_levels(1);
#  pragma omp parallel for num_threads(4) schedule(dynamic, 1)
    for (i = 0; i < HOSTS; i++) nested[i] = one_mesh((uint64_t)(100 + 7 * i), 3);
    for (i = 0; i < HOSTS; i++) CHECK(nested[i] == alone[i]);
#endif
#ifdef HAVE_PTHREADS
    {
        host_thread hosts[HOSTS];
        for (i = 0; i < HOSTS; i++) {
            hosts[i].seed = (uint64_t)(100 + 7 * i);
            hosts[i].hash = 0;
            CHECK(pthread_create(&hosts[i].thread, NULL, run_host, &hosts[i]) == 0);
        }
        for (i = 0; i < HOSTS; i++) {
            pthread_join(hosts[i].thread, NULL);
            CHECK(hosts[i].hash == alone[i]);
        }
    }
#endif
}

/* The self-test knows other rounding modes. */
static void other_rounding_is_noticed(void)
{
#if defined(FE_UPWARD) && defined(FE_DOWNWARD) && defined(FE_TOWARDZERO)
    static const int modes[3] = {FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO};
    int i;
    for (i = 0; i < 3; i++) {
        if (fesetround(modes[i]) != 0) continue;
        CHECK(delaunay_selftest() == DELAUNAY_ERROR_BROKEN_ARITHMETIC);
        fesetround(FE_TONEAREST);
    }
#endif
    CHECK(delaunay_selftest() == DELAUNAY_OK);
}

/* An import refuses a coordinate that is not finite and says where; the validator finds one. */
static void what_is_not_finite_is_refused(void)
{
    const double bad[3] = {(double)NAN, (double)INFINITY, -(double)INFINITY};
    const uint32_t tet[4] = {0, 1, 2, 3};
    int i, k;
    for (i = 0; i < 3; i++)
        for (k = 0; k < 15; k++) { /* point 4 is in no tetrahedron */
            double xyz[15] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 2, 2, 2};
            char name[16];
            delaunay_mesh mesh = {0};
            delaunay_report report;
            CHECK(delaunay_import(&mesh, xyz, 5, tet, NULL, 1, NULL, &report) == DELAUNAY_OK);
            CHECK(delaunay_validate(&mesh, DELAUNAY_VALIDATE_GEOMETRY, &report) == DELAUNAY_OK);
            mesh.vertices[1 + k / 3].x[k % 3] = bad[i];
            CHECK(delaunay_validate(&mesh, DELAUNAY_VALIDATE_TOPOLOGY, NULL) == DELAUNAY_OK);
            if (k < 12) {
                CHECK(delaunay_validate(&mesh, DELAUNAY_VALIDATE_GEOMETRY, &report) ==
                      DELAUNAY_ERROR_INVALID_MESH);
                CHECK(strstr(report.message, "not finite") && report.ids[0] == 1);
            }
            delaunay_mesh_free(&mesh);
            xyz[k] = bad[i];
            CHECK(delaunay_import(&mesh, xyz, 5, tet, NULL, 1, NULL, &report) ==
                  DELAUNAY_ERROR_NOT_FINITE);
            snprintf(name, sizeof name, "point %d ", k / 3);
            CHECK(strstr(report.message, name) && report.ids[0] == (uint32_t)(k / 3));
            CHECK(report.num_ids == 1 && mesh.tets == NULL);
        }
}

int main(void)
{
    int kind;
    what_is_not_finite_is_refused();
    other_rounding_is_noticed();
    for (kind = 0; kind < NUM_KINDS; kind++) {
        any_coordinates(kind);
        extremes_by_brute_force(kind);
    }
    many_hosts();
    return check_report();
}
