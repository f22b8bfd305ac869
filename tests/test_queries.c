/* Hull, Voronoi diagram, alpha values, nearest vertex: compared with brute force. */
#ifndef LINKED
#  define DELAUNAY_IMPLEMENTATION
#endif
#include "../delaunay.h"
#include "check.h"
#include <math.h>
#include <stdlib.h>

static uint64_t random_state = 3;
static uint32_t random_u32(void)
{
    random_state = random_state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (uint32_t)(random_state >> 33);
}
static double random_unit(void) { return (double)random_u32() / 2147483648.0; }

static void make(delaunay_mesh *mesh, uint32_t n, uint32_t lattice)
{
    double *xyz = (double *)malloc(3 * n * sizeof *xyz);
    uint32_t i;
    for (i = 0; i < 3 * n; i++) xyz[i] = lattice ? (double)(random_u32() % lattice) : random_unit();
    memset(mesh, 0, sizeof *mesh);
    CHECK(delaunay_tetrahedralize(mesh, xyz, n, NULL, NULL) == DELAUNAY_OK);
    CHECK(delaunay_link_vertices(mesh) == DELAUNAY_OK);
    free(xyz);
}

static const double *place(const delaunay_mesh *m, uint32_t v) { return m->vertices[v].x; }

/* All points behind every facet; polygons are flat, closed, convex, and not to be joined. */
static void check_hull(const delaunay_mesh *mesh)
{
    delaunay_hull hull;
    size_t f, p, i, sides = 0;
    uint32_t v;
    memset(&hull, 0, sizeof hull);
    CHECK(delaunay_hull_of(&hull, mesh, NULL) == DELAUNAY_OK);
    CHECK(hull.num_facets >= 4 && hull.num_polygons >= 4);
    for (f = 0; f < hull.num_facets; f++) {
        const uint32_t *t = hull.facets + 3 * f;
        p = hull.facet_polygon[f];
        CHECK(p < hull.num_polygons);
        for (v = 1; v < mesh->num_vertices; v++)
            CHECK(delaunay_orient3d(place(mesh, t[0]), place(mesh, t[1]), place(mesh, t[2]),
                                    place(mesh, v)) <= 0);
        for (i = hull.polygon_begin[p]; i < hull.polygon_begin[p + 1]; i++)
            CHECK(delaunay_orient3d(place(mesh, t[0]), place(mesh, t[1]), place(mesh, t[2]),
                                    place(mesh, hull.polygon_vertices[i])) == 0);
        for (i = 0; i < f; i++) { /* one plane, one polygon */
            const uint32_t *q = hull.facets + 3 * i;
            int same = !delaunay_orient3d(place(mesh, t[0]), place(mesh, t[1]), place(mesh, t[2]),
                                          place(mesh, q[0])) &&
                       !delaunay_orient3d(place(mesh, t[0]), place(mesh, t[1]), place(mesh, t[2]),
                                          place(mesh, q[1])) &&
                       !delaunay_orient3d(place(mesh, t[0]), place(mesh, t[1]), place(mesh, t[2]),
                                          place(mesh, q[2]));
            CHECK(same == (hull.facet_polygon[i] == p));
        }
    }
    CHECK(hull.polygon_begin[0] == 0);
    for (p = 0; p < hull.num_polygons; p++) { /* each side has its opposite once elsewhere */
        size_t begin = hull.polygon_begin[p], end = hull.polygon_begin[p + 1], j, q;
        CHECK(end - begin >= 3);
        for (i = begin; i < end; i++) {
            uint32_t a = hull.polygon_vertices[i];
            uint32_t b = hull.polygon_vertices[i + 1 < end ? i + 1 : begin];
            int found = 0;
            for (q = 0; q < hull.num_polygons; q++)
                for (j = hull.polygon_begin[q]; j < hull.polygon_begin[q + 1]; j++) {
                    size_t next = j + 1 < hull.polygon_begin[q + 1] ? j + 1 : hull.polygon_begin[q];
                    found += hull.polygon_vertices[j] == b && hull.polygon_vertices[next] == a;
                }
            CHECK(found == 1);
            sides++;
        }
    }
    CHECK(sides % 2 == 0);
    delaunay_hull_free(&hull);
    delaunay_hull_free(&hull);
}

static void hull_of_a_grid_is_a_cube(void)
{
    double xyz[3 * 125];
    delaunay_mesh mesh = {0};
    delaunay_hull hull;
    size_t i;
    memset(&hull, 0, sizeof hull);
    for (i = 0; i < 125; i++)
        xyz[3 * i] = (double)(i % 5), xyz[3 * i + 1] = (double)(i / 5 % 5),
                xyz[3 * i + 2] = (double)(i / 25);
    CHECK(delaunay_tetrahedralize(&mesh, xyz, 125, NULL, NULL) == DELAUNAY_OK);
    CHECK(delaunay_hull_of(&hull, &mesh, NULL) == DELAUNAY_OK);
    CHECK(hull.num_polygons == 6 && hull.num_facets == 6 * 2 * 16);
    for (i = 0; i < 6; i++) CHECK(hull.polygon_begin[i + 1] - hull.polygon_begin[i] == 16);
    delaunay_hull_free(&hull);
    delaunay_mesh_free(&mesh);
}

static double distance2(const double *a, const double *b)
{
    double d = 0;
    int k;
    for (k = 0; k < 3; k++) d += (a[k] - b[k]) * (a[k] - b[k]);
    return d;
}

/* Every pair of neighbours is a face once; its corners are at equal distance from both cells, no
 * vertex is nearer; they turn the right way around the edge. */
static void check_voronoi(const delaunay_mesh *mesh)
{
    delaunay_voronoi w;
    uint32_t a, b, n = mesh->num_vertices, v;
    uint8_t *neighbours = (uint8_t *)calloc((size_t)n * n, 1);
    delaunay_handle t;
    size_t f, i, unbounded = 0;
    memset(&w, 0, sizeof w);
    CHECK(delaunay_voronoi_of(&w, mesh, NULL) == DELAUNAY_OK);
    CHECK(w.num_cells == n && w.cell_begin[0] == 0 && w.cell_begin[n] == 2 * w.num_faces);
    for (t = 1; t < mesh->num_tets; t++)
        for (i = 0; i < 16; i++) {
            a = mesh->tets[t].v[i / 4], b = mesh->tets[t].v[i % 4];
            if (a && b && a != b) neighbours[(size_t)a * n + b] = 1;
        }
    for (f = 0; f < w.num_faces; f++) {
        size_t begin = w.face_begin[f], end = w.face_begin[f + 1], ghosts = 0;
        a = w.face_cells[2 * f], b = w.face_cells[2 * f + 1];
        CHECK(a && a < b && neighbours[(size_t)a * n + b] == 1);
        neighbours[(size_t)a * n + b] = neighbours[(size_t)b * n + a] = 2;
        for (i = begin; i < end; i++) {
            const double *c;
            delaunay_handle next = w.face_tets[i + 1 < end ? i + 1 : begin];
            uint32_t keep = 0, leave = 0;
            int k, l;
            t = w.face_tets[i];
            c = w.centers + 3 * t;
            for (k = 0; k < 4; k++) {
                if (mesh->tets[t].v[k] == a || mesh->tets[t].v[k] == b) continue;
                l = mesh->tets[t].n[k] >> 2 == next;
                if (l) leave = mesh->tets[t].v[k];
                else keep = mesh->tets[t].v[k];
            }
            if (delaunay_is_ghost(mesh, t)) {
                CHECK(i == begin || i + 1 == end);
                ghosts++;
                CHECK(fabs(distance2(c, place(mesh, 0)) - 1) < 1e-9); /* the ghost is at 0 */
                continue;
            }
            CHECK(leave && keep);
            CHECK(delaunay_orient3d(place(mesh, a), place(mesh, b), place(mesh, leave),
                                    place(mesh, keep)) > 0);
            for (v = 1; v < n; v++)
                CHECK(distance2(c, place(mesh, v)) >= distance2(c, place(mesh, a)) * (1 - 1e-4));
            CHECK(fabs(distance2(c, place(mesh, b)) - distance2(c, place(mesh, a))) <=
                  1e-4 * distance2(c, place(mesh, a)));
        }
        CHECK(ghosts == 0 || ghosts == 2);
        unbounded += ghosts == 2;
    }
    for (i = 0; i < (size_t)n * n; i++) CHECK(neighbours[i] != 1);
    CHECK(unbounded > 0);
    for (v = 0; v < n; v++)
        for (i = w.cell_begin[v]; i < w.cell_begin[v + 1]; i++) {
            f = w.cell_faces[i];
            CHECK(w.face_cells[2 * f] == v || w.face_cells[2 * f + 1] == v);
            CHECK(i == w.cell_begin[v] || w.cell_faces[i - 1] < f);
        }
    delaunay_voronoi_free(&w);
    free(neighbours);
}

/* Volumes of the cells of inner points of a lattice: by pyramids from the point. */
static void cells_of_a_lattice_are_cubes(void)
{
    double xyz[3 * 216];
    delaunay_mesh mesh = {0};
    delaunay_voronoi w;
    size_t i, j, k, inner = 0;
    memset(&w, 0, sizeof w);
    for (i = 0; i < 216; i++)
        xyz[3 * i] = (double)(i % 6), xyz[3 * i + 1] = (double)(i / 6 % 6),
                xyz[3 * i + 2] = (double)(i / 36);
    CHECK(delaunay_tetrahedralize(&mesh, xyz, 216, NULL, NULL) == DELAUNAY_OK);
    CHECK(delaunay_voronoi_of(&w, &mesh, NULL) == DELAUNAY_OK);
    for (i = 0; i < 216; i++) {
        double volume = 0;
        uint32_t v = mesh.vertex_of[i];
        int bounded = 1;
        for (j = w.cell_begin[v]; j < w.cell_begin[v + 1]; j++) {
            size_t f = w.cell_faces[j];
            const delaunay_handle *ring = w.face_tets + w.face_begin[f];
            double sign = w.face_cells[2 * f] == v ? 1 : -1;
            if (delaunay_is_ghost(&mesh, ring[0])) bounded = 0;
            for (k = 1; bounded && k + 1 < w.face_begin[f + 1] - w.face_begin[f]; k++) {
                const double *p = xyz + 3 * i, *a = w.centers + 3 * ring[0];
                const double *b = w.centers + 3 * ring[k], *c = w.centers + 3 * ring[k + 1];
                double x[3][3];
                int l;
                for (l = 0; l < 3; l++)
                    x[0][l] = a[l] - p[l], x[1][l] = b[l] - p[l], x[2][l] = c[l] - p[l];
                volume += sign / 6 *
                          (x[0][0] * (x[1][1] * x[2][2] - x[1][2] * x[2][1]) +
                           x[0][1] * (x[1][2] * x[2][0] - x[1][0] * x[2][2]) +
                           x[0][2] * (x[1][0] * x[2][1] - x[1][1] * x[2][0]));
            }
        }
        if (!bounded) continue;
        CHECK(fabs(volume - 1) < 1e-12);
        inner++;
    }
    CHECK(inner == 64);
    delaunay_voronoi_free(&w);
    delaunay_mesh_free(&mesh);
}

/* No simplex before its faces; a value is the simplex's own exactly when its sphere is empty. */
static void check_alpha(const delaunay_mesh *mesh, uint32_t lattice)
{
    delaunay_voronoi w;
    delaunay_alpha alpha;
    delaunay_handle t;
    size_t f, i, own = 0, later = 0;
    uint32_t v;
    int k;
    memset(&w, 0, sizeof w);
    memset(&alpha, 0, sizeof alpha);
    CHECK(delaunay_voronoi_of(&w, mesh, NULL) == DELAUNAY_OK);
    CHECK(delaunay_alpha_of(&alpha, mesh, &w, NULL) == DELAUNAY_OK);
    for (t = 1; t < mesh->num_tets; t++) {
        const double *p[4];
        if (delaunay_is_ghost(mesh, t)) continue;
        for (k = 0; k < 4; k++) {
            p[k] = place(mesh, mesh->tets[t].v[k]);
            CHECK(alpha.facets[4 * t + (delaunay_handle)k] <= alpha.tets[t]);
            CHECK(alpha.facets[4 * t + (delaunay_handle)k] == alpha.facets[mesh->tets[t].n[k]]);
        }
        CHECK(fabs(alpha.tets[t] - distance2(p[0], w.centers + 3 * t)) <= 1e-6 * alpha.tets[t]);
    }
    for (f = 0; f < w.num_faces; f++) {
        uint32_t a = w.face_cells[2 * f], b = w.face_cells[2 * f + 1];
        double middle[3], r2, least = DBL_MAX;
        int empty = 1;
        for (k = 0; k < 3; k++) middle[k] = 0.5 * (place(mesh, a)[k] + place(mesh, b)[k]);
        r2 = distance2(middle, place(mesh, a));
        for (v = 1; v < mesh->num_vertices; v++)
            if (v != a && v != b && distance2(middle, place(mesh, v)) < r2 * (1 - 1e-12)) empty = 0;
        for (i = w.face_begin[f]; i < w.face_begin[f + 1]; i++)
            for (k = 0; k < 4; k++) {
                uint32_t u = mesh->tets[w.face_tets[i]].v[k];
                double x = alpha.facets[4 * w.face_tets[i] + (delaunay_handle)k];
                if (u == a || u == b) continue;
                CHECK(alpha.edges[f] <= x);
                if (x < least) least = x;
            }
        if (empty) CHECK(fabs(alpha.edges[f] - r2) <= 1e-9 * r2);
        else CHECK(alpha.edges[f] == least);
        own += (size_t)empty;
        later += !empty;
    }
    CHECK(own > 0 && (later > 0 || lattice));
    delaunay_alpha_free(&alpha);
    delaunay_voronoi_free(&w);
}

static void check_nearest(delaunay_mesh *mesh, uint32_t lattice)
{
    delaunay_worker *worker = delaunay_worker_new(&mesh->memory);
    uint32_t i, v, u, ties = 0;
    for (i = 0; i < 200; i++) {
        double q[3];
        int k, tie = 0;
        for (k = 0; k < 3; k++)
            q[k] = lattice ? 0.5 * (double)(random_u32() % (2 * lattice + 4)) - 1
                           : 3 * random_unit() - 1;
        v = delaunay_nearest(mesh, worker, q, i % 2 ? random_u32() % mesh->num_tets : 0);
        CHECK(v > 0);
        for (u = 1; u < mesh->num_vertices; u++) {
            int s = delaunay_compare_distance(q, place(mesh, v), place(mesh, u));
            CHECK(s <= 0 && s == -delaunay_compare_distance(q, place(mesh, u), place(mesh, v)));
            tie |= u != v && s == 0;
        }
        ties += (uint32_t)tie;
    }
    CHECK(!lattice || ties > 20);
    for (i = 0; i < 9; i++) {
        double q[3] = {0.5, 0.5, 0.5};
        q[i % 3] = i < 3 ? (double)NAN : i < 6 ? (double)INFINITY : -(double)INFINITY;
        CHECK(delaunay_locate(mesh, q, 0) == 0 && delaunay_nearest(mesh, worker, q, 0) == 0);
    }
    delaunay_worker_free(worker);
}

static void nearest_may_be_none(void)
{
    const double xyz[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}, inside[3] = {0.7, 0.1, 0.1};
    const double outside[3] = {2, 0, 0};
    const uint32_t tet[4] = {0, 1, 2, 3};
    delaunay_mesh mesh;
    delaunay_worker *worker;
    memset(&mesh, 0, sizeof mesh);
    CHECK(delaunay_import(&mesh, xyz, 4, tet, NULL, 1, NULL, NULL) == DELAUNAY_OK);
    worker = delaunay_worker_new(&mesh.memory);
    CHECK(delaunay_nearest(&mesh, worker, inside, 0) == 0); /* no vertex_tet */
    CHECK(delaunay_link_vertices(&mesh) == DELAUNAY_OK);
    CHECK(delaunay_nearest(&mesh, worker, inside, 0) == 2);
    CHECK(delaunay_nearest(&mesh, worker, outside, 0) == 0); /* no hull */
    delaunay_worker_free(worker);
    delaunay_mesh_free(&mesh);
}

/* Differences in the last bit, and coordinates at the ends of the range of doubles. */
static void distances_are_exact(void)
{
    double q[3] = {0, 0, 0}, a[3] = {3, 4, 0}, b[3] = {0, 0, 5};
    CHECK(delaunay_compare_distance(q, a, b) == 0);
    a[0] = 3 + 4e-16 * 2;
    CHECK(delaunay_compare_distance(q, a, b) == 1);
    a[0] = 3, b[2] = 5 + 1e-15;
    CHECK(delaunay_compare_distance(q, a, b) == -1);
    a[0] = 3e-320, a[1] = 4e-320, b[2] = 5e-320;
    CHECK(delaunay_compare_distance(q, a, b) ==
          (a[0] / 5e-324 * (a[0] / 5e-324) + a[1] / 5e-324 * (a[1] / 5e-324) >
                   b[2] / 5e-324 * (b[2] / 5e-324)
               ? 1
           : a[0] / 5e-324 * (a[0] / 5e-324) + a[1] / 5e-324 * (a[1] / 5e-324) <
                   b[2] / 5e-324 * (b[2] / 5e-324)
               ? -1
               : 0));
    a[0] = 1e308, a[1] = 1e308, b[2] = -1.6e308;
    q[2] = 1e307;
    CHECK(delaunay_compare_distance(q, a, b) == -1);
    b[0] = 5e-324, b[1] = 0, b[2] = 1e308;
    a[0] = 0, a[1] = 0, a[2] = 1e308;
    CHECK(delaunay_compare_distance(q, a, b) == -1);
}

typedef struct failing {
    long calls, fail_at, live;
} failing;
static void *failing_alloc(void *user, size_t size)
{
    failing *f = (failing *)user;
    if (++f->calls >= f->fail_at) return NULL;
    f->live++;
    return malloc(size);
}
static void failing_release(void *user, void *block)
{
    ((failing *)user)->live--;
    free(block);
}

static void any_allocation_may_fail(void)
{
    delaunay_mesh mesh, none = {0};
    delaunay_hull hull;
    delaunay_voronoi w, whole;
    delaunay_alpha alpha;
    delaunay_host host;
    failing f = {0, 0, 0};
    int done = 0;
    memset(&host, 0, sizeof host);
    memset(&hull, 0, sizeof hull);
    memset(&w, 0, sizeof w);
    memset(&whole, 0, sizeof whole);
    memset(&alpha, 0, sizeof alpha);
    host.allocator.alloc = failing_alloc;
    host.allocator.release = failing_release;
    host.allocator.user = &f;
    make(&mesh, 50, 4);
    CHECK(delaunay_voronoi_of(&whole, &mesh, NULL) == DELAUNAY_OK);
    CHECK(delaunay_hull_of(&hull, &none, NULL) == DELAUNAY_ERROR_INVALID_ARGUMENT);
    while (done < 3) {
        f.calls = 0, f.fail_at++;
        done = delaunay_hull_of(&hull, &mesh, &host) == DELAUNAY_OK;
        CHECK(done || f.live == 0);
        f.calls = 0;
        done += delaunay_voronoi_of(&w, &mesh, &host) == DELAUNAY_OK;
        f.calls = 0;
        done += delaunay_alpha_of(&alpha, &mesh, &whole, &host) == DELAUNAY_OK;
        delaunay_hull_free(&hull);
        delaunay_voronoi_free(&w);
        delaunay_alpha_free(&alpha);
        CHECK(f.live == 0);
    }
    CHECK(f.fail_at > 6);
    delaunay_voronoi_free(&whole);
    delaunay_mesh_free(&mesh);
}

/* a and b are equal but for rounding, that of the smallest doubles included. */
static int close_to(double a, double b) { return fabs(a - b) <= 1e-12 * fabs(b) + 1e-322; }

static double square_of(double x, double y, double z)
{
    double sum = x * x + y * y + z * z;
    return sum > DBL_MAX ? DBL_MAX : sum;
}

/* Centres, normals and alpha values of the corner of a cube with edges of length a. */
static void corner_of_size(double a)
{
    const double x[12] = {0, 0, 0, a, 0, 0, 0, a, 0, 0, 0, a};
    delaunay_mesh mesh;
    delaunay_voronoi w;
    delaunay_alpha alpha;
    delaunay_handle t;
    size_t i;
    int k, real = 0;
    memset(&mesh, 0, sizeof mesh);
    memset(&w, 0, sizeof w);
    memset(&alpha, 0, sizeof alpha);
    CHECK(delaunay_tetrahedralize(&mesh, x, 4, NULL, NULL) == DELAUNAY_OK);
    CHECK(delaunay_voronoi_of(&w, &mesh, NULL) == DELAUNAY_OK);
    CHECK(delaunay_alpha_of(&alpha, &mesh, &w, NULL) == DELAUNAY_OK);
    for (t = 1; t < mesh.num_tets; t++) {
        const double *c = w.centers + 3 * t;
        if (delaunay_is_ghost(&mesh, t)) {
            CHECK(close_to(square_of(c[0], c[1], c[2]), 1));
            continue;
        }
        real++;
        for (k = 0; k < 3; k++) CHECK(close_to(c[k], a / 2));
        CHECK(close_to(alpha.tets[t], square_of(a / 2, a / 2, a / 2)));
        for (k = 0; k < 4; k++) { /* a triangle has the corner, or the sphere of the three others */
            double r = place(&mesh, mesh.tets[t].v[k])[0] + place(&mesh, mesh.tets[t].v[k])[1] +
                       place(&mesh, mesh.tets[t].v[k])[2];
            CHECK(close_to(alpha.facets[4 * t + (delaunay_handle)k],
                           r > 0 ? square_of(a / 2, a / 2, 0) : alpha.tets[t]));
        }
    }
    CHECK(real == 1 && w.num_faces == 6);
    for (i = 0; i < w.num_faces; i++) {
        const double *p = place(&mesh, w.face_cells[2 * i]);
        const double *q = place(&mesh, w.face_cells[2 * i + 1]);
        CHECK(close_to(alpha.edges[i],
                       square_of((p[0] - q[0]) / 2, (p[1] - q[1]) / 2, (p[2] - q[2]) / 2)));
    }
    delaunay_alpha_free(&alpha);
    delaunay_voronoi_free(&w);
    delaunay_mesh_free(&mesh);
}

static void any_scale(void)
{
    int e;
    for (e = -1068; e <= 1023; e += 17) corner_of_size(ldexp(1, e));
}

/* Coordinates of both signs, whose differences are more than a double holds. */
static void differences_beyond_doubles(void)
{
    const double h = 0.75 * DBL_MAX;
    const double x[15] = {-h, 0, 0, h, 0, 0, 0, h, h, 0, h, -h, 0, -h, 1};
    delaunay_mesh mesh;
    delaunay_voronoi w;
    delaunay_handle t;
    int k;
    memset(&mesh, 0, sizeof mesh);
    memset(&w, 0, sizeof w);
    CHECK(delaunay_tetrahedralize(&mesh, x, 5, NULL, NULL) == DELAUNAY_OK);
    CHECK(delaunay_voronoi_of(&w, &mesh, NULL) == DELAUNAY_OK);
    for (t = 1; t < mesh.num_tets; t++) {
        const double *c = w.centers + 3 * t;
        double d[4], p[3];
        if (delaunay_is_deleted(&mesh, t)) continue;
        if (delaunay_is_ghost(&mesh, t)) {
            CHECK(close_to(square_of(c[0], c[1], c[2]), 1));
            continue;
        }
        for (k = 0; k < 4; k++) {
            int j;
            for (j = 0; j < 3; j++)
                p[j] = ldexp(place(&mesh, mesh.tets[t].v[k])[j], -1000) - ldexp(c[j], -1000);
            d[k] = p[0] * p[0] + p[1] * p[1] + p[2] * p[2];
            CHECK(close_to(d[k], d[0]));
        }
    }
    delaunay_voronoi_free(&w);
    delaunay_mesh_free(&mesh);
}

/* Lengths multiplied by a power of two, and weights by its square: the same digits. */
static void weights_of_any_scale(void)
{
    enum { N = 40 };
    double x[3 * N], weight[N], y[3 * N], other[N];
    int e, i;
    for (i = 0; i < 3 * N; i++) x[i] = random_unit();
    for (i = 0; i < N; i++) weight[i] = 0.01 * random_unit();
    for (e = -400; e <= 400; e += 200) {
        delaunay_points points[2];
        delaunay_mesh mesh[2];
        delaunay_voronoi w[2];
        delaunay_alpha alpha[2];
        delaunay_handle t;
        size_t f;
        memset(points, 0, sizeof points);
        memset(mesh, 0, sizeof mesh);
        memset(w, 0, sizeof w);
        memset(alpha, 0, sizeof alpha);
        for (i = 0; i < 3 * N; i++) y[i] = ldexp(x[i], e);
        for (i = 0; i < N; i++) other[i] = ldexp(weight[i], 2 * e);
        for (i = 0; i < 2; i++) {
            points[i].xyz = i ? y : x;
            points[i].weights = i ? other : weight;
            points[i].count = N;
            CHECK(delaunay_tetrahedralize_points(&mesh[i], &points[i], NULL, NULL) == DELAUNAY_OK);
            CHECK(delaunay_voronoi_of(&w[i], &mesh[i], NULL) == DELAUNAY_OK);
            CHECK(delaunay_alpha_of(&alpha[i], &mesh[i], &w[i], NULL) == DELAUNAY_OK);
        }
        CHECK(mesh[0].num_tets == mesh[1].num_tets && w[0].num_faces == w[1].num_faces);
        for (t = 1; t < mesh[0].num_tets && t < mesh[1].num_tets; t++) {
            int ghost = delaunay_is_ghost(&mesh[0], t), k;
            for (k = 0; k < 3; k++)
                CHECK(ldexp(w[0].centers[3 * t + (delaunay_handle)k], ghost ? 0 : e) ==
                      w[1].centers[3 * t + (delaunay_handle)k]);
            CHECK(ghost || ldexp(alpha[0].tets[t], 2 * e) == alpha[1].tets[t]);
        }
        for (f = 0; f < w[0].num_faces && f < w[1].num_faces; f++)
            CHECK(ldexp(alpha[0].edges[f], 2 * e) == alpha[1].edges[f]);
        for (i = 0; i < 2; i++) {
            delaunay_alpha_free(&alpha[i]);
            delaunay_voronoi_free(&w[i]);
            delaunay_mesh_free(&mesh[i]);
        }
    }
}

/* The circumcentre of (l, l, 0) and the three unit vectors is (c, c, c), c = (2 l l - 1)/(4 l - 2),
 * whichever of them comes first. */
static void a_far_vertex_does_not_spoil_the_centre(void)
{
    int turn, k;
    double l;
    for (turn = 0; turn < 4; turn++)
        for (l = 10; l < 1e100; l *= 10) {
            static const double unit[4][3] = {{1, 1, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
            const double c = l < 1e15 ? (l * l - 0.5) / (2 * l - 1) : l / 2;
            delaunay_mesh mesh;
            delaunay_voronoi voronoi;
            double xyz[12];
            memset(&mesh, 0, sizeof mesh);
            memset(&voronoi, 0, sizeof voronoi);
            for (k = 0; k < 12; k++)
                xyz[k] = unit[(k / 3 + turn) & 3][k % 3] * (((k / 3 + turn) & 3) == 0 ? l : 1);
            CHECK(delaunay_tetrahedralize(&mesh, xyz, 4, NULL, NULL) == DELAUNAY_OK);
            CHECK(delaunay_voronoi_of(&voronoi, &mesh, NULL) == DELAUNAY_OK);
            for (k = 3; k < 6; k++) CHECK(fabs(voronoi.centers[k] - c) <= 1e-13 * c);
            delaunay_voronoi_free(&voronoi);
            delaunay_mesh_free(&mesh);
        }
}

int main(void)
{
    uint32_t lattice;
    for (lattice = 0; lattice < 6; lattice++) {
        delaunay_mesh mesh;
        if (lattice == 1) continue;
        make(&mesh, 120, lattice);
        check_hull(&mesh);
        check_voronoi(&mesh);
        check_alpha(&mesh, lattice);
        check_nearest(&mesh, lattice);
        delaunay_mesh_free(&mesh);
    }
    hull_of_a_grid_is_a_cube();
    cells_of_a_lattice_are_cubes();
    nearest_may_be_none();
    distances_are_exact();
    any_scale();
    a_far_vertex_does_not_spoil_the_centre();
    differences_beyond_doubles();
    weights_of_any_scale();
    any_allocation_may_fail();
    return check_report();
}
