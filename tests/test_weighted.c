/* Regular triangulations, compared with brute force, and points in any memory layout. */
#define DELAUNAY_IMPLEMENTATION
#include "../delaunay.h"
#include "check.h"

static uint64_t random_state = 5;
static uint32_t random_u32(void)
{
    random_state = random_state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (uint32_t)(random_state >> 33);
}
static double random_unit(void) { return (double)random_u32() / 2147483648.0; }

/* In integers of 64 bits: coordinates below 64, weights below 4096. */
static int sign_in_integers(const int64_t p[5][3], const int64_t *w)
{
    int64_t x[4][3], lift[4], det = 0;
    int i, k;
    for (i = 0; i < 4; i++) {
        for (lift[i] = w[4] - w[i], k = 0; k < 3; k++) {
            x[i][k] = p[i][k] - p[4][k];
            lift[i] += x[i][k] * x[i][k];
        }
    }
    for (i = 0; i < 4; i++) {
        const int64_t *a = x[(i + 1) % 4], *b = x[(i + 2) % 4], *c = x[(i + 3) % 4];
        int64_t minor = a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                        a[2] * (b[0] * c[1] - b[1] * c[0]);
        det += (i % 2 ? -1 : 1) * minor * lift[i];
    }
    return (det > 0) - (det < 0);
}

/* Exact under scaling by powers of two, weights by their squares, and on nearly nothing. */
static void the_predicate_is_exact(void)
{
    static const int scales[] = {0, 1, -3, 40, -45, 100, -200, 480, -500};
    int round, j, i, k, zeros = 0;
    for (round = 0; round < 2000; round++) {
        int64_t p[5][3], w[5];
        int size = round % 3 ? 3 : 60, expected;
        for (i = 0; i < 5; i++) {
            for (k = 0; k < 3; k++) p[i][k] = (int64_t)(random_u32() % (uint32_t)size);
            w[i] = (int64_t)(random_u32() % (uint32_t)(size * size)) - size;
        }
        expected = sign_in_integers((const int64_t(*)[3])p, w);
        zeros += expected == 0;
        for (j = 0; j < (int)(sizeof scales / sizeof *scales); j++) {
            double x[5][3], v[5];
            for (i = 0; i < 5; i++) {
                for (k = 0; k < 3; k++) x[i][k] = ldexp((double)p[i][k], scales[j]);
                v[i] = ldexp((double)w[i], 2 * scales[j]);
            }
            CHECK(delaunay_insphere_weighted(x[0], x[1], x[2], x[3], x[4], v) == expected);
            for (i = 0; i < 5; i++) v[i] = ldexp(3, 2 * scales[j] - 21);
            CHECK(delaunay_insphere_weighted(x[0], x[1], x[2], x[3], x[4], v) ==
                  delaunay_insphere(x[0], x[1], x[2], x[3], x[4]));
            if (expected) continue; /* the last bit of a weight tips a tie */
            for (i = 0; i < 5; i++) v[i] = ldexp((double)w[i], 2 * scales[j]);
            if (delaunay_orient3d(x[0], x[1], x[2], x[3]) <= 0) continue;
            if (v[4] == 0) v[4] = 5e-324;
            else v[4] *= v[4] > 0 ? 1 + DBL_EPSILON : 1 - DBL_EPSILON / 2;
            CHECK(delaunay_insphere_weighted(x[0], x[1], x[2], x[3], x[4], v) == 1);
        }
    }
    CHECK(zeros > 50);
}

/* All tetrahedra whose orthogonal sphere has no point too deep inside, and who is in none. */
static void brute_force(const delaunay_mesh *mesh, uint64_t num_hidden)
{
    uint32_t n = mesh->num_vertices, a, b, c, d, e, expected = 0, hidden = 0;
    uint8_t *used = (uint8_t *)calloc(n, 1);
    for (a = 1; a < n; a++)
        for (b = a + 1; b < n; b++)
            for (c = b + 1; c < n; c++)
                for (d = c + 1; d < n; d++) {
                    uint32_t v[4];
                    const double *p[4];
                    double w[5];
                    int i, empty = 1, sign;
                    v[0] = a, v[1] = b, v[2] = c, v[3] = d;
                    for (i = 0; i < 4; i++) p[i] = mesh->vertices[v[i]].x;
                    sign = delaunay_orient3d(p[0], p[1], p[2], p[3]);
                    if (sign == 0) continue;
                    if (sign < 0) {
                        v[0] = b, v[1] = a;
                        for (i = 0; i < 2; i++) p[i] = mesh->vertices[v[i]].x;
                    }
                    for (i = 0; i < 4; i++) w[i] = mesh->weight[v[i]];
                    for (e = 1; e < n && empty; e++) {
                        if (e == a || e == b || e == c || e == d) continue;
                        w[4] = mesh->weight[e];
                        empty = delaunay_insphere_weighted_perturbed(p[0], p[1], p[2], p[3],
                                                                     mesh->vertices[e].x, w) < 0;
                    }
                    if (!empty) continue;
                    expected++;
                    used[a] = used[b] = used[c] = used[d] = 1;
                }
    CHECK(expected == delaunay_count_tets(mesh));
    for (a = 1; a < n; a++) {
        hidden += !used[a];
        CHECK((mesh->vertex_of[mesh->vertex_id[a]] == 0) == !used[a]);
    }
    CHECK(hidden == num_hidden);
    free(used);
}

static void small_lattices(void)
{
    int round, valid = 0;
    uint64_t hidden = 0;
    for (round = 0; round < 300; round++) {
        double xyz[3 * 16], weights[16];
        uint32_t n = 5 + random_u32() % 12, side = 2 + random_u32() % 3, i, j;
        delaunay_mesh mesh = {0};
        delaunay_points points;
        delaunay_report report;
        delaunay_result result;
        memset(&points, 0, sizeof points);
        for (i = 0; i < 3 * n; i++) xyz[i] = random_u32() % side;
        for (i = 0; i < n; i++) weights[i] = (double)(random_u32() % 9) - 4;
        points.xyz = xyz, points.count = n, points.weights = weights;
        result = delaunay_tetrahedralize_points(&mesh, &points, NULL, &report);
        if (result == DELAUNAY_ERROR_DIMENSION) continue;
        CHECK(result == DELAUNAY_OK);
        CHECK(delaunay_validate(&mesh, DELAUNAY_VALIDATE_DELAUNAY, NULL) == DELAUNAY_OK);
        brute_force(&mesh, report.num_hidden);
        for (i = 0; i < n; i++) { /* of one place the heaviest, of these the first */
            uint32_t best = i, v;
            for (j = n; j-- > 0;)
                if (memcmp(xyz + 3 * i, xyz + 3 * j, 24) == 0 && weights[j] >= weights[best])
                    best = j;
            for (v = 1; mesh.vertex_id[v] != best; v++) CHECK(v + 1 < mesh.num_vertices);
            CHECK(mesh.vertex_of[i] == v || mesh.vertex_of[i] == 0);
            CHECK(mesh.weight[v] == weights[best]);
        }
        hidden += report.num_hidden;
        delaunay_mesh_free(&mesh);
        valid++;
    }
    CHECK(valid > 200 && hidden > 50);
}

static uint64_t hash_mesh(const delaunay_mesh *m)
{
    uint64_t h = UINT64_C(0xcbf29ce484222325);
    const unsigned char *p = (const unsigned char *)m->tets;
    size_t i;
    for (i = 0; i < m->num_tets * sizeof *m->tets; i++) h = (h ^ p[i]) * UINT64_C(0x100000001b3);
    for (i = 0; i < m->num_points; i++) h = (h ^ m->vertex_of[i]) * UINT64_C(0x100000001b3);
    return h;
}

/* The same bytes for any number of threads; a common weight changes nothing but the weights. */
static void many_points(int lattice)
{
    enum { N = 8000 };
    static const int threads[5] = {1, 2, 3, 5, 8};
    double *xyz = (double *)malloc(N * 3 * sizeof *xyz), *weights = (double *)malloc(N * 8);
    delaunay_mesh mesh = {0};
    delaunay_points points;
    delaunay_options options;
    delaunay_report report;
    uint64_t hash = 0;
    uint32_t i, v;
    int k;
    memset(&points, 0, sizeof points);
    memset(&options, 0, sizeof options);
    points.xyz = xyz, points.count = N, points.weights = weights;
    for (i = 0; i < 3 * N; i++) xyz[i] = lattice ? (double)(random_u32() % 30) : random_unit();
    for (i = 0; i < N; i++) weights[i] = lattice ? random_u32() % 3 : 0.002 * random_unit();
    for (k = 0; k < 5; k++) {
        options.host.num_threads = threads[k];
        CHECK(delaunay_tetrahedralize_points(&mesh, &points, &options, &report) == DELAUNAY_OK);
        if (k == 1)
            CHECK(delaunay_validate(&mesh, DELAUNAY_VALIDATE_DELAUNAY, NULL) == DELAUNAY_OK);
        CHECK(report.num_hidden > 100 && report.num_hidden < N);
        if (k == 0) hash = hash_mesh(&mesh);
        CHECK(hash == hash_mesh(&mesh));
    }
    CHECK(delaunay_link_vertices(&mesh) == DELAUNAY_OK);
    for (v = 1, i = 0; v < mesh.num_vertices; v++) { /* hidden: not inside its place's sphere */
        delaunay_handle t;
        if (mesh.vertex_tet[v]) continue;
        t = delaunay_locate(&mesh, mesh.vertices[v].x, 0);
        CHECK(t && !delaunay_is_ghost(&mesh, t) && delaunay__in_sphere(&mesh, t, v) < 0);
        i++;
    }
    CHECK(i == report.num_hidden);
    CHECK(delaunay_editor_new(&mesh) == NULL);
    CHECK(delaunay_insert(&mesh, xyz, 1, NULL, NULL) == DELAUNAY_ERROR_INVALID_ARGUMENT);
    for (i = 0; i < N; i++) weights[i] = 0.7;
    CHECK(delaunay_tetrahedralize_points(&mesh, &points, NULL, &report) == DELAUNAY_OK);
    hash = hash_mesh(&mesh);
    CHECK(report.num_hidden == 0);
    CHECK(delaunay_tetrahedralize(&mesh, xyz, N, NULL, NULL) == DELAUNAY_OK);
    CHECK(hash == hash_mesh(&mesh));
    weights[17] = INFINITY;
    CHECK(delaunay_tetrahedralize_points(&mesh, &points, NULL, &report) ==
          DELAUNAY_ERROR_NOT_FINITE);
    CHECK(report.num_ids == 1 && report.ids[0] == 17 && mesh.tets == NULL);
    CHECK(strstr(report.message, "point 17 ") && strstr(report.message, "weight"));
    delaunay_mesh_free(&mesh);
    free(xyz);
    free(weights);
}

/* Centres of the power diagram are at equal power from four vertices; alpha follows them. */
static void power_diagram(void)
{
    double xyz[300], weights[100];
    delaunay_mesh mesh = {0};
    delaunay_points points;
    delaunay_voronoi w;
    delaunay_alpha alpha;
    delaunay_handle t;
    uint32_t i, v;
    int k, j;
    memset(&points, 0, sizeof points);
    memset(&w, 0, sizeof w);
    memset(&alpha, 0, sizeof alpha);
    points.xyz = xyz, points.count = 100, points.weights = weights;
    for (i = 0; i < 300; i++) xyz[i] = random_unit();
    for (i = 0; i < 100; i++) weights[i] = 0.05 * random_unit();
    CHECK(delaunay_tetrahedralize_points(&mesh, &points, NULL, NULL) == DELAUNAY_OK);
    CHECK(delaunay_voronoi_of(&w, &mesh, NULL) == DELAUNAY_OK);
    CHECK(delaunay_alpha_of(&alpha, &mesh, &w, NULL) == DELAUNAY_OK);
    for (t = 1; t < mesh.num_tets; t++) {
        double power[4], error;
        if (delaunay_is_ghost(&mesh, t)) continue;
        for (k = 0; k < 4; k++) {
            const double *x = mesh.vertices[mesh.tets[t].v[k]].x;
            power[k] = -mesh.weight[mesh.tets[t].v[k]];
            for (j = 0; j < 3; j++)
                power[k] +=
                    (x[j] - w.centers[3 * t + (size_t)j]) * (x[j] - w.centers[3 * t + (size_t)j]);
        }
        error = 1e-6 * (1 + fabs(power[0]));
        for (k = 1; k < 4; k++) CHECK(fabs(power[k] - power[0]) < error);
        CHECK(fabs(alpha.tets[t] - power[0]) < error);
        for (v = 1; v < mesh.num_vertices; v++) {
            const double *x = mesh.vertices[v].x;
            double d = -mesh.weight[v];
            for (j = 0; j < 3; j++)
                d += (x[j] - w.centers[3 * t + (size_t)j]) * (x[j] - w.centers[3 * t + (size_t)j]);
            CHECK(d > power[0] - error);
        }
        for (k = 0; k < 4; k++) CHECK(alpha.facets[4 * t + (delaunay_handle)k] <= alpha.tets[t]);
    }
    delaunay_alpha_free(&alpha);
    delaunay_voronoi_free(&w);
    delaunay_mesh_free(&mesh);
}

/* Floats among other data, doubles among other data, off their alignment: the same mesh. */
static void layouts(void)
{
    enum { N = 500 };
    struct record {
        float color, x[3], weight;
    } *records = (struct record *)malloc(N * sizeof *records);
    double *xyz = (double *)malloc(N * 24), *weights = (double *)malloc(N * 8);
    char *bytes = (char *)malloc(N * 33 + 1);
    delaunay_mesh mesh = {0};
    delaunay_points points;
    uint64_t hash, plain;
    size_t i, k;
    for (i = 0; i < N; i++) {
        for (k = 0; k < 3; k++) xyz[3 * i + k] = records[i].x[k] = (float)random_unit();
        weights[i] = records[i].weight = 0.01f * (float)random_unit();
        records[i].color = NAN;
        memcpy(bytes + 33 * i + 1, xyz + 3 * i, 24);
        memcpy(bytes + 33 * i + 25, weights + i, 8);
    }
    CHECK(delaunay_tetrahedralize(&mesh, xyz, N, NULL, NULL) == DELAUNAY_OK);
    plain = hash_mesh(&mesh);
    memset(&points, 0, sizeof points);
    points.xyz = xyz, points.count = N, points.weights = weights;
    CHECK(delaunay_tetrahedralize_points(&mesh, &points, NULL, NULL) == DELAUNAY_OK);
    hash = hash_mesh(&mesh);
    memset(&points, 0, sizeof points);
    points.xyz = records->x, points.count = N, points.stride = sizeof *records, points.is_float = 1;
    CHECK(delaunay_tetrahedralize_points(&mesh, &points, NULL, NULL) == DELAUNAY_OK);
    CHECK(hash_mesh(&mesh) == plain);
    points.weights = &records->weight, points.weight_stride = sizeof *records;
    CHECK(delaunay_tetrahedralize_points(&mesh, &points, NULL, NULL) == DELAUNAY_OK);
    CHECK(hash_mesh(&mesh) == hash && hash != plain);
    memset(&points, 0, sizeof points);
    points.xyz = bytes + 1, points.count = N, points.stride = 33;
    CHECK(delaunay_tetrahedralize_points(&mesh, &points, NULL, NULL) == DELAUNAY_OK);
    CHECK(hash_mesh(&mesh) == plain);
    points.weights = bytes + 25, points.weight_stride = 33;
    CHECK(delaunay_tetrahedralize_points(&mesh, &points, NULL, NULL) == DELAUNAY_OK);
    CHECK(hash_mesh(&mesh) == hash);
    CHECK(delaunay_tetrahedralize_points(&mesh, NULL, NULL, NULL) ==
          DELAUNAY_ERROR_INVALID_ARGUMENT);
    delaunay_mesh_free(&mesh);
    free(records), free(xyz), free(weights), free(bytes);
}

int main(void)
{
    the_predicate_is_exact();
    small_lattices();
    many_points(0);
    many_points(1);
    power_diagram();
    layouts();
    return check_report();
}
